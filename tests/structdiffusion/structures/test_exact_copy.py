"""Exact copies: like objects in like places, to 5 mm and 5 degrees, not mirrored; what does not fit is refused."""

import math
from dataclasses import replace

import numpy as np
import pytest

from grounding.figures.figure import Figure, FigureError, FigurePlace
from grounding.figures.files import read_figure, write_figure
from grounding.figures.names import VARIABLE
from grounding.spec import StructureSpec
from structdiffusion.footprints import turned
from structdiffusion.structures.bodies import LayoutItem, PlacedBody
from structdiffusion.structures.exact_copy import ExactCopy
from structdiffusion.structures.structure import LayoutError
from tests.structdiffusion.structures.handmade import HEADINGS, TABLE

CUBE, PLANK = (0.04, 0.04, 0.04), (0.12, 0.04, 0.02)
# An L on the table, seen from above, and a plank on its longer leg.
PLACES = (
    FigurePlace(0.0, 0.0, 0.0, CUBE, 0.0), FigurePlace(0.08, 0.0, 0.0, CUBE, 0.0),
    FigurePlace(0.0, 0.06, 0.0, CUBE, 30.0),
    FigurePlace(0.04, 0.0, 0.04, PLANK, 0.0),
)  # fmt: skip
FIGURE = Figure("corner", ("corner",), places=PLACES, least=4)
COPY = ExactCopy(FIGURE)


@pytest.fixture(autouse=True)
def taught(monkeypatch, tmp_path):
    monkeypatch.setenv(VARIABLE, str(tmp_path))
    write_figure(FIGURE, tmp_path / "corner.toml")


def outline(length, width):
    return 0.5 * np.array([[-length, -width], [length, -width], [length, width], [-length, width]])


def item(size, yaw=0.0):
    return LayoutItem("block", turned(outline(*size[:2]), yaw), size[2])


ITEMS = [item(PLANK, 1.0), item(CUBE), item(CUBE, 0.3), item(CUBE, -0.2)]


def built(items=ITEMS, **slots):
    """Return the drafted bodies, by place."""
    draft = COPY.draft(items, StructureSpec("corner", **slots), 0.0, np.random.default_rng(0))
    bodies = []
    for i, at, turn, low in zip(draft.order, draft.offsets, draft.turns, draft.heights):
        outline_there = turned(items[i].footprint, turn) + at + (0.45, 0.0)
        top = low + items[i].height
        bodies.append(PlacedBody("block", "block", outline_there, at + (0.45, 0.0), low, top, 0.0))
    return bodies


def shifted(body, x=0.0, y=0.0, z=0.0, yaw=0.0):
    local = turned(body.local_footprint, yaw)
    at = body.centroid + (x, y)
    return PlacedBody(body.name, body.category, local + at, at, body.z_bottom + z, body.z_top + z, 0.0)


def failed(bodies, **slots):
    return [check.name for check in COPY.check(bodies, StructureSpec("corner", **slots), TABLE) if not check.passed]


@pytest.mark.parametrize("rotation", [None, *HEADINGS])
def test_a_draft_stands_in_its_places_whatever_the_objects_face(rotation):
    slots = {} if rotation is None else {"rotation": rotation}
    bodies = built(**slots)
    assert failed(bodies, **slots) == []
    assert [round(body.z_bottom, 3) for body in bodies] == [0.0, 0.0, 0.0, 0.04]  # the plank bridges the cubes
    right = -90.0 if rotation is None else HEADINGS[rotation] + 90.0  # the reader looks against the heading
    along = bodies[1].centroid - bodies[0].centroid
    assert along / 0.08 == pytest.approx([math.cos(math.radians(right)), math.sin(math.radians(right))], abs=1e-6)


@pytest.mark.parametrize(("change", "name"), [
    ({"x": 0.004}, ""), ({"x": 0.008}, "farthest from its place"), ({"z": 0.006}, "farthest from its place"),
    ({"yaw": math.radians(4)}, ""), ({"yaw": math.radians(7)}, "most turned from its place"),
    ({"yaw": math.radians(90)}, ""),
])  # fmt: skip
def test_limits_of_one_object(change, name):
    bodies = built()
    bodies[2] = shifted(bodies[2], **change)
    found = failed(bodies)
    assert found == [] if not name else len(found) == 1 and found[0].startswith(name)


def test_the_largest_error_is_reported_and_the_copy_may_stand_anywhere():
    bodies = [shifted(body, x=0.1, y=-0.2) for body in built()]
    bodies[0] = shifted(bodies[0], z=0.003)
    (off,) = (check for check in COPY.check(bodies, StructureSpec("corner"), TABLE) if "farthest" in check.name)
    assert off.measured == pytest.approx(0.003, abs=2e-4) and off.passed


def test_a_mirrored_copy_and_exchanged_objects_fail():
    across = np.array([1.0, -1.0])
    mirrored = [
        replace(body, footprint=(body.footprint * across)[::-1], centroid=body.centroid * across) for body in built()
    ]
    assert any("farthest" in name for name in failed(mirrored))
    assert failed(built()[:3]) == ["objects in the corner"]


def test_what_does_not_fit_is_refused_with_the_reason():
    with pytest.raises(LayoutError, match="needs exactly 4 objects, got 3"):
        built(ITEMS[:3])
    with pytest.raises(LayoutError, match="the block stands on would be 10 mm higher than in the example; legal: 4 mm"):
        built([ITEMS[0], *(item((0.04, 0.04, 0.05)) for _ in range(3))])
    with pytest.raises(LayoutError, match="the block and the block beside it would overlap by"):
        built([ITEMS[0], *(item((0.09, 0.09, 0.04)) for _ in range(3))])


def test_a_copy_has_two_to_twelve_places():
    places = tuple(FigurePlace(0.05 * k, 0.0, 0.0, CUBE, 0.0) for k in range(13))
    with pytest.raises(FigureError, match="cannot have 13 objects; legal: 2 to 12"):
        Figure("row", ("row",), places=places, least=13)


def test_its_file_keeps_every_place(tmp_path):
    assert read_figure(tmp_path / "corner.toml") == FIGURE
    (tmp_path / "wrong.toml").write_text(
        'name = "x"\nnouns = ["x"]\nleast = 2\nplaces = [{x = 0, y = 0, z = 0, size = [1]}]\n'
    )
    with pytest.raises(FigureError, match=r"size cannot be \[1.0\]; legal: three lengths in metres"):
        read_figure(tmp_path / "wrong.toml")
