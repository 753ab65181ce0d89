"""Orders of building in which all stands after every object: found by physics, with rollback, or refused."""

import numpy as np
import pytest

from structdiffusion.geometry import pose_from_xyz_yaw
from structdiffusion.objects.solids import assemble, box
from structdiffusion.postprocessing.build_order import BuildOrder, NoOrderError

NAMES = ("base", "plank", "one end", "middle", "other end")
# z of the bottoms, each a little above contact: a plank on a narrow base, with weights on its ends and in its middle.
PLACES = [(0.0, 0.0), (0.0, 0.041), (-0.08, 0.062), (0.0, 0.062), (0.08, 0.062)]


def cuboid(length, width, height, density=650.0):
    return assemble(
        "box", "box", [box(length, width, 0.0, height)], density=density, friction=0.6, color=(1, 0, 0),
        source="blocks", rng=np.random.default_rng(0),
    )  # fmt: skip


def search(middle):
    """Return a search on scales with a middle weight of a density; `None` leaves it out."""
    models = [cuboid(0.04, 0.04, 0.04), cuboid(0.20, 0.04, 0.02), *(cuboid(0.04, 0.04, 0.04) for _ in range(3))]
    models[3] = cuboid(0.04, 0.04, 0.04, middle or 650.0)
    goals = np.array([pose_from_xyz_yaw(0.45 + x, 0.0, z, 0.0) for x, z in PLACES])
    return BuildOrder(models, goals, [0, 1, 2, 4] if middle is None else range(5), NAMES)


def test_a_weight_that_tips_the_plank_comes_after_the_one_that_holds_it():
    for order in search(2500.0).find():
        assert order[:3] == (0, 1, 3)  # supports first, then the middle, though an end is farther away
        assert sorted(order) == [0, 1, 2, 3, 4]


def test_what_stands_in_no_order_is_refused_with_what_falls():
    with pytest.raises(NoOrderError, match=r"at best when 2 of 4 objects stand: the .* falls when .* put in its place"):
        search(None).find()
    with pytest.raises(NoOrderError, match="at best when 3 of 5 objects stand"):
        search(100.0).find()  # too light to hold the plank


def test_what_others_stand_on_may_be_there_already():
    one = search(2500.0)
    there = [(one.models[0], one.goals[0])]
    assert BuildOrder(one.models, one.goals, [1, 2, 3, 4], NAMES, there).find()[0][:2] == (1, 3)
