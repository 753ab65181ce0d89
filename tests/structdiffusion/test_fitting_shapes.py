"""Why a structure does not fit on a table, and what does."""

import numpy as np
import pytest

from grounding.spec import StructureSpec
from structdiffusion.fitting_shapes import shapes_that_fit, values_in_the_way, why_it_does_not_fit
from structdiffusion.observation import ObjectCloud, Scene, Table


def boxes(count, side):
    """A scene of `count` square boxes, seen whole."""
    rng = np.random.default_rng(0)
    points = rng.uniform(-0.5, 0.5, (2000, 3)) * (side, side, 0.1)
    points[:, 2] += 0.05
    places = [(0.25 + 0.16 * (k % 4), -0.35 + 0.16 * (k // 4), 0.0) for k in range(count)]
    clouds = [ObjectCloud(f"box {k}", "box", (points + place).astype(np.float32)) for k, place in enumerate(places)]
    return Scene(tuple(clouds), Table())


def test_the_reason_names_what_is_needed_and_what_there_is():
    """Ten boxes of 14 cm, side by side, are 1.4 m and the gaps; a line of them may run in any direction."""
    reason = why_it_does_not_fit(boxes(10, 0.14), StructureSpec("line"), np.random.default_rng(0))
    start, needed, _, side, rest = reason.split(" is ")[0], *reason.split(" is ")[1].split(" ", 3)
    assert (
        start == "a line of these objects"
        and side in ("wide,", "deep,")
        and rest.startswith("and the table has room for")
    )
    assert 1.4 < float(needed) < 1.9


def test_what_fits_is_given_no_reason():
    assert why_it_does_not_fit(boxes(5, 0.06), StructureSpec("line"), np.random.default_rng(0)) == ""


@pytest.mark.parametrize("count, side", [(10, 0.14), (9, 0.15), (8, 0.1)])
def test_what_is_offered_can_be_laid_out(count, side):
    scene, spec = boxes(count, side), StructureSpec("line", x_position="left")
    offered = shapes_that_fit(scene, spec, np.random.default_rng(0))
    assert "line" not in offered and len(offered) <= 3
    for shape in offered:
        assert why_it_does_not_fit(scene, StructureSpec(shape, x_position="left"), np.random.default_rng(1)) == ""


def test_nothing_is_offered_where_nothing_fits():
    assert shapes_that_fit(boxes(12, 0.24), StructureSpec("line"), np.random.default_rng(0)) == []


def test_the_reason_names_what_stays_where_it_is_and_is_in_the_way():
    """A box of 30 cm on the left, on a table of 54 cm by 90 cm, leaves no place there for a circle of three."""
    rng, small = np.random.default_rng(0), boxes(3, 0.08)
    points = (rng.uniform(-0.15, 0.15, (2000, 3)) + (0.45, 0.28, 0.15)).astype(np.float32)
    scene = Scene(small.objects, small.table, (ObjectCloud("crate", "box", points),))
    left = StructureSpec("circle", "small", x_position="left")
    assert why_it_does_not_fit(small, left, rng) == ""
    assert "it meets what stays where it is: crate" in why_it_does_not_fit(scene, left, rng)
    assert values_in_the_way(scene, left, rng) == ["left"]
    assert why_it_does_not_fit(scene, StructureSpec("circle", "small", x_position="right"), rng) == ""


def test_what_has_no_size_is_not_offered_for_a_structure_of_one():
    offered = shapes_that_fit(boxes(9, 0.15), StructureSpec("line", "small"), np.random.default_rng(0))
    assert "table setting" not in offered
