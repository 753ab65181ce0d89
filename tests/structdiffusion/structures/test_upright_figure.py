"""Upright figures: blocks carry each other as drawn, level below what bridges; what rests otherwise fails."""

from dataclasses import replace

import numpy as np
import pytest

from grounding.figures.growth import supports_of
from grounding.figures.names import figure_named, shipped_names
from grounding.spec import StructureSpec
from structdiffusion.footprints import turned
from structdiffusion.objects.blocks import block_objects
from structdiffusion.structures import structure_named
from structdiffusion.structures.bodies import LayoutItem, PlacedBody
from structdiffusion.structures.structure import TALLEST, LayoutError
from tests.structdiffusion.structures.handmade import HEADINGS, failures

UPRIGHT = [name for name in shipped_names() if figure_named(name).stacked]
BLOCKS = {one.name: one for one in block_objects()}


def box(length, width=0.035, height=0.035):
    outline = 0.5 * np.array([[-length, -width], [length, -width], [length, width], [-length, width]])
    return LayoutItem("block", outline, height)


def items_for(name, count):
    return [box(0.08 if block.width > 1 else 0.036) for block in figure_named(name).blocks_of(count)[0]]


def built(name, items, **slots):
    """Return the bodies of a drafted figure, each resting on what the drawing says, by item."""
    structure = structure_named(name)
    draft = structure.draft(items, StructureSpec(name, **slots), 0.0, np.random.default_rng(0))
    carriers = next(own for own in map(supports_of, structure.figure.blocks_of(len(items))))
    bodies = [None] * len(items)
    for place, (item, at, turn, bottom) in enumerate(zip(draft.order, draft.offsets, draft.turns, draft.heights)):
        outline = turned(items[item].footprint, turn) + at
        below = tuple(draft.order[k] for k in carriers[place])
        bodies[item] = PlacedBody("block", "block", outline, at, bottom, bottom + items[item].height, 0.0, below)
    return bodies


@pytest.mark.parametrize("name", UPRIGHT)
def test_what_is_drafted_holds(name):
    for count in [number for number in figure_named(name).legal if number <= 12]:
        bodies = built(name, items_for(name, count))
        assert failures(bodies, StructureSpec(name)) == [], count
        assert failures(bodies, StructureSpec(name, rotation="south")) == [], count


@pytest.mark.parametrize("rotation", HEADINGS)
def test_stairs_rise_to_the_readers_right(rotation):
    bodies = built("stairs", items_for("stairs", 6), rotation=rotation)
    assert failures(bodies, StructureSpec("stairs", rotation=rotation)) == []
    others = [one for one in HEADINGS if one != rotation]
    assert all(failures(bodies, StructureSpec("stairs", rotation=one)) for one in others)
    if rotation == "south":  # the reader stands on the robot's side: right is -y
        assert max(bodies, key=lambda one: one.z_top).centroid[1] == min(one.centroid[1] for one in bodies)


def test_what_rests_on_something_else_fails():
    bodies = built("gate", items_for("gate", 5))
    top = max(range(5), key=lambda i: bodies[i].z_bottom)
    one_post = [replace(one, rests_on=one.rests_on[:1]) if i == top else one for i, one in enumerate(bodies)]
    assert failures(one_post, StructureSpec("gate")) == ["objects that rest on others than drawn"]
    assert failures(bodies, StructureSpec("stairs"))
    assert failures(bodies[:4], StructureSpec("gate")) == ["objects in the gate"]


def test_the_longest_bridges_and_a_short_lintel_fails():
    items = [box(0.036), box(0.1), box(0.036)]
    bodies = built("gate", items)
    assert bodies[1].rests_on == (0, 2) or set(bodies[1].rests_on) == {0, 2}
    wide = turned(box(0.036, 0.2).footprint, np.pi / 2)
    broad_post = replace(bodies[0], footprint=wide + bodies[0].centroid)
    assert failures([broad_post, *bodies[1:]], StructureSpec("gate")) == ["what bridges shorter than the rest (m)"]


def test_a_wall_that_is_not_straight_fails():
    bodies = built("brick wall", items_for("brick wall", 5))
    off = np.array([0.07, 0.0])
    bent = [
        replace(one, centroid=one.centroid + off, footprint=one.footprint + off) if not i else one
        for i, one in enumerate(bodies)
    ]
    assert "distance to the wall's line (m)" in failures(bent, StructureSpec("brick wall"))


def test_what_cannot_be_built_is_said():
    with pytest.raises(LayoutError, match="a gate needs 3, 5, 7"):
        built("gate", [box(0.04)] * 4)
    with pytest.raises(LayoutError, match="needs objects of one height|not level"):
        built("gate", [box(0.04, height=0.03), box(0.04, height=0.05), box(0.1, height=0.04)])
    with pytest.raises(LayoutError, match=f"the arm reaches {TALLEST} m"):
        built("gate", [*[box(0.05, height=0.09)] * 10, box(0.09)])
    with pytest.raises(LayoutError, match="too short or too wide"):
        built("house", [box(0.06)] * 6)


def test_drawn_objects_suit_it():
    for name in UPRIGHT:
        structure, rng = structure_named(name), np.random.default_rng(4)
        pool = [one for one in BLOCKS.values() if structure.suits(one)]
        chosen = structure.choose([pool[i] for i in rng.permutation(len(pool))], 7, rng, named=False)
        assert len(chosen) in structure.figure.legal and len({one.name for one in chosen}) == len(chosen)
    with pytest.raises(LayoutError, match="objects, but only 1 can be used"):
        structure_named("gate").choose([BLOCKS["post_red"]], 3, np.random.default_rng(0), named=False)
