"""A damaged goal is legal, differs from the labelled one, and in one part only."""

import numpy as np

from grounding.goals.comparison import compare_goals
from grounding.training.damaged_goals import damaged
from grounding.training.goal_corrections import goal_of

GOAL = goal_of("tower of the tins {0,1,2}, left; place of the cup {3}, behind the plate {4}, distance 5 cm.")


def test_one_part_is_damaged():
    rng = np.random.default_rng(0)
    found = [one for one in (damaged(GOAL, 6, rng) for _ in range(200)) if one is not None]
    assert len(found) > 100 and not any(compare_goals(one, GOAL, 6).exact for one in found)
    kept = [sum(part in one.parts for part in GOAL.parts) for one in found]
    assert set(kept) == {1}
    assert {len(one.parts) for one in found} == {1, 2}  # a part is dropped, or changed
    structures = {one.structures[0].shape for one in found if one.structures}
    assert len(structures) > 5
    distances = {round(part.distance, 4) for one in found for part in one.relations if part.distance is not None}
    assert distances == {0.025, 0.05, 0.1, 0.15}  # a tenth is less than the least distance
