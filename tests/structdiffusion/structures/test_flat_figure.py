"""Flat figures: what is drafted passes its checks in any order, and what is not the figure, as asked,
fails the right one.
"""

import numpy as np
import pytest

from grounding.figures.names import figure_named, shipped_names
from grounding.goals.parts import Order
from grounding.spec import StructureSpec
from structdiffusion.evaluation_protocol import MAX_FIGURE_OFF_DEGREES
from structdiffusion.footprints import turned
from structdiffusion.objects.solids import circle_outline
from structdiffusion.observation import Table
from structdiffusion.structures import structure_named
from structdiffusion.structures.bodies import LayoutItem, PlacedBody
from structdiffusion.structures.key_checks import check_keys
from structdiffusion.structures.keys import StructureKeys
from structdiffusion.structures.structure import LayoutError
from tests.structdiffusion.structures.handmade import HEADINGS, body, failures, moved

FLAT = [name for name in shipped_names() if not figure_named(name).stacked]


def cans(*radii):
    return [LayoutItem("can", circle_outline(radius, 40), 0.08 + radius) for radius in radii]


def built(name, items, seed=0, keys=StructureKeys(), **slots):
    """Return the bodies of a drafted figure in the middle of a large table, by item."""
    spec = StructureSpec(name, **slots)
    draft = structure_named(name).draft(items, spec, 0.0, np.random.default_rng(seed), keys)
    bodies = [None] * len(items)
    for item, at, turn in zip(draft.order, draft.offsets, draft.turns):
        outline = turned(items[item].footprint, turn) + at
        bodies[item] = PlacedBody("can", "can", outline, at, 0.0, items[item].height, 0.0, ())
    return bodies


@pytest.mark.parametrize("name", FLAT)
def test_what_is_drafted_holds_whatever_the_order(name):
    figure = figure_named(name)
    rng = np.random.default_rng(2)
    for count in figure.legal[:3]:
        bodies = built(name, cans(*rng.uniform(0.027, 0.033, count)))
        shuffled = [bodies[i] for i in rng.permutation(count)]
        facing = "north" if figure.points else "south"  # its top is away from the robot
        assert failures(shuffled, StructureSpec(name, rotation=facing)) == [], count


@pytest.mark.parametrize("name", FLAT)
def test_equal_objects_stand_as_tightly_as_they_can(name):
    """Where the gaps are narrow, every step has to fit: the objects move along the strokes, and corners give way."""
    for count in figure_named(name).legal[:4]:
        assert failures(built(name, cans(*[0.03] * count), size="small"), StructureSpec(name, size="small")) == [], (
            count
        )


@pytest.mark.parametrize("size", ("small", "medium", "large"))
@pytest.mark.parametrize("rotation", HEADINGS)
def test_size_and_rotation_are_as_asked(size, rotation):
    for name in ("letter R", "arrow"):
        bodies = built(name, cans(*[0.03] * 10), size=size, rotation=rotation)
        assert failures(bodies, StructureSpec(name, size=size, rotation=rotation)) == []
        others = [one for one in HEADINGS if one != rotation]
        assert all("heading (deg off)" in failures(bodies, StructureSpec(name, rotation=one)) for one in others)
    assert MAX_FIGURE_OFF_DEGREES < 45


def test_an_arrow_points_and_a_letter_faces_its_reader():
    """Asked for "west", the arrow's tip is to the robot's left, and the letter's foot is."""
    arrow = np.array([one.centroid for one in built("arrow", cans(*[0.03] * 7), rotation="west")])
    assert arrow[arrow[:, 1].argmax()] @ [1, 0] == pytest.approx(arrow[:, 0].mean(), abs=0.01)
    letter = np.array([one.centroid for one in built("letter T", cans(*[0.03] * 7), rotation="west")])
    assert letter[letter[:, 1].argmax()] @ [1, 0] == pytest.approx(letter[:, 0].mean(), abs=0.01)
    assert np.ptp(letter[letter[:, 1] < letter[:, 1].min() + 0.01][:, 0]) > 0.05  # the bar is on the right


def test_a_mirrored_figure_is_off_the_drawing():
    """The limit of the protocol is wide, and some mirrored figures are within it;
    none is as near as the figure itself.
    """

    def off(bodies, name):
        checks = structure_named(name).check(bodies, StructureSpec(name), Table())
        return next(check.measured for check in checks if "outline" in check.name)

    for name, count in (("letter F", 9), ("question mark", 9), ("letter P", 9)):
        bodies = built(name, cans(*[0.03] * count))
        mirrored = [body(one.centroid[0], -one.centroid[1]) for one in bodies]
        assert off(mirrored, name) > 2 * off(bodies, name)


def test_a_gap_an_uneven_stroke_and_a_closed_end_are_found():
    bodies = built("letter I", cans(*[0.03] * 5), size="small")
    tip = max(range(5), key=lambda i: bodies[i].centroid[0])
    apart = [moved(one, 0.06, 0.0) if i == tip else one for i, one in enumerate(bodies)]
    assert "ends, junctions and strokes that differ" in failures(apart, StructureSpec("letter I"))
    assert "variation of the gaps along a stroke" in failures(apart, StructureSpec("letter I"))
    horns = built("letter U", cans(*[0.03] * 9))
    closed = built("letter O", cans(*[0.03] * 9))
    assert failures(horns, StructureSpec("letter U")) == [] and failures(closed, StructureSpec("letter O")) == []
    assert failures(closed, StructureSpec("letter U"))


def test_only_legal_numbers_can_show_it():
    with pytest.raises(LayoutError, match="a star needs 10, 15 or 20 objects, got 11"):
        built("star", cans(*[0.03] * 11))
    assert failures([body(0.1 * k, 0.0) for k in range(3)], StructureSpec("star")) == ["objects in the star"]


def test_objects_of_too_different_widths_are_refused_in_a_sentence():
    with pytest.raises(LayoutError, match="cannot stand evenly along a heart"):
        built("heart", cans(*[0.015] * 7, 0.15), size="small")


@pytest.mark.parametrize("start", ("left", "right"))
def test_an_order_runs_along_the_stroke_from_its_end(start):
    keys = StructureKeys(Order("width", "ascending", start))
    bodies = built("wave", cans(*np.linspace(0.034, 0.026, 8)), keys=keys)
    checks = check_keys(bodies, StructureSpec("wave"), keys)
    assert checks and all(check.passed for check in checks)
    narrowest = bodies[-1].centroid[1]
    assert narrowest == (max if start == "left" else min)(one.centroid[1] for one in bodies)


def test_corrections_bring_a_figure_into_its_size():
    structure = structure_named("heart")
    bodies = built("heart", cans(*[0.03] * 8), size="large")
    assert np.abs(structure.corrections(bodies, None)).max() == 0.0
    shifted = [moved(one, *by) for one, by in zip(bodies, structure.corrections(bodies, "small"))]
    assert failures(shifted, StructureSpec("heart", size="small")) == []
    assert failures(bodies, StructureSpec("heart", size="small")) == ["extent / tightest extent"]


def test_an_unknown_name_is_refused():
    with pytest.raises(LayoutError, match="no figure is called 'unicorn'"):
        structure_named("unicorn")
