"""What structures share: sizes, positions, and the judgement of an open shape."""

import numpy as np
import pytest

from grounding.spec import StructureSpec
from structdiffusion.observation import Table
from tests.structdiffusion.structures.handmade import body, failures, ring, row, setting


@pytest.mark.parametrize(
    ("ratio", "size"),
    [(1.02, "small"), (1.27, "small"), (1.33, "medium"), (1.77, "medium"), (1.83, "large"), (2.6, "large")],
)
def test_sizes_are_bands_of_the_extent_over_the_tightest(ratio, size):
    tightest = 2 * 0.03 + 0.01  # of a ring of six, whose sides are as long as its radius
    wide = Table(-1, 2, -1, 1)
    line = row(0.07 * ratio - 0.06)  # neighbours 7 cm apart are the tightest line
    for other in ("small", "medium", "large"):
        expected = [] if other == size else ["extent / tightest extent"]
        assert failures(ring(tightest * ratio), StructureSpec("circle", other), wide) == expected
        assert failures(line, StructureSpec("line", other), wide) == expected


@pytest.mark.parametrize(
    ("y", "column"), [(-0.39, "right"), (-0.14, "right"), (-0.13, "center"), (0.13, "center"), (0.14, "left")]
)
@pytest.mark.parametrize(("x", "line"), [(0.24, "bottom"), (0.37, "bottom"), (0.38, "middle"), (0.53, "top")])
def test_positions_are_thirds_of_where_the_centre_can_lie(x, y, column, line):
    """A base of 10 cm: its centre can lie from 0.23 to 0.67 in x, and from -0.4 to 0.4 in y."""
    square = 0.05 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    tower = [body(x, y, outline=square), body(x, y, z=0.05, rests_on=(0,))]
    for wanted in ("left", "center", "right"):
        expected = [] if wanted == column else [f"{wanted}: place in the range"]
        assert failures(tower, StructureSpec("tower", x_position=wanted)) == expected
    for wanted in ("top", "middle", "bottom"):
        expected = [] if wanted == line else [f"{wanted}: place in the range"]
        assert failures(tower, StructureSpec("tower", y_position=wanted)) == expected


def test_an_open_shape_is_judged_as_the_shape_that_fits_best():
    for bodies in (ring(), row(), setting(180.0)):
        assert failures(bodies, StructureSpec()) == []
    scattered = [body(0.25, -0.3), body(0.3, 0.35), body(0.66, 0.1), body(0.5, -0.38), body(0.45, 0.0)]
    assert failures(scattered, StructureSpec()) != []
    # With a size only circle and line are meant, and this ring is not large.
    assert failures(ring(0.075), StructureSpec(size="large")) == ["extent / tightest extent"]
