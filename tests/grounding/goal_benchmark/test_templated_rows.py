"""The templated benchmark of goals: complete, and about what is there."""

from collections import Counter

from grounding.goal_benchmark.rows import goal_scenes, templated_goal_rows
from grounding.goals.parts import RELATIONS
from grounding.spec import SHAPES
from grounding.structure_words import KEYS


def test_every_family_shape_key_and_relation_is_there():
    rows = templated_goal_rows()
    counts = Counter(row.stratum for row in rows)
    assert len(rows) > 3000 and len(counts) == 9 and all(200 < count <= 400 for count in counts.values())
    assert len({(row.text, row.scene) for row in rows}) == len(rows)
    structures = [part for row in rows for goal in row.goals for part in goal.structures]
    assert {part.shape for part in structures} == set(SHAPES) - {"table setting"}
    assert {key for part in structures for key in part.keys} == set(KEYS)
    assert {part.relation for row in rows for goal in row.goals for part in goal.relations} == set(RELATIONS)
    assert {row.status for row in rows} == {"ok", "ask", "refused"}


def test_goals_name_objects_that_are_there():
    for row in templated_goal_rows():
        count = len(goal_scenes()[row.scene])
        assert (row.status == "ok") == bool(row.goals)
        for goal in row.goals:
            assert all(0 <= index < count for index in goal.named_objects()), row.text
            assert goal.resolved(count)
