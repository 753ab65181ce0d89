"""What every structure has to keep: one entry for each shape, orders that are permutations,
corrections that change nothing.
"""

from dataclasses import replace

import numpy as np
import pytest

from grounding.spec import LEGAL_VALUES, SHAPES, SLOTS_OF_SHAPE, StructureSpec
from grounding.structure_words import STRUCTURES as WORDS
from structdiffusion.objects.solids import circle_outline
from structdiffusion.observation import Table
from structdiffusion.structures import STRUCTURES
from structdiffusion.structures.bodies import LayoutItem
from structdiffusion.structures.checks import HEADING_MEASURE, PLACE_MEASURE, SIZE_MEASURE
from tests.structdiffusion.structures import handmade
from tests.structdiffusion.structures.handmade import ring, row, setting, tower

GOOD = {"circle": ring(0.1), "line": row(), "tower": tower(), "table setting": setting(90.0)}
GOOD |= {shape: getattr(handmade, shape)() for shape in SHAPES[4:]}
each = pytest.mark.parametrize("shape", SHAPES)


def test_every_shape_has_one_structure():
    assert tuple(STRUCTURES) == SHAPES
    assert all(name == structure.name for name, structure in STRUCTURES.items())
    assert all(structure.slots == SLOTS_OF_SHAPE[name] for name, structure in STRUCTURES.items())
    assert {name: structure.least for name, structure in STRUCTURES.items()} == {
        name: each.least for name, each in WORDS.items()
    }


@each
def test_a_slot_that_can_be_asked_for_is_checked(shape):
    structure, measures = STRUCTURES[shape], {"size": SIZE_MEASURE, "rotation": HEADING_MEASURE}
    plain = [check.name for check in structure.check(GOOD[shape], StructureSpec(shape), Table())]
    for slot in structure.slots:
        for value in LEGAL_VALUES[slot]:
            checks = structure.check(GOOD[shape], StructureSpec(shape, **{slot: value}), Table())
            assert any(measures.get(slot, f"{value}: {PLACE_MEASURE}") in check.name for check in checks)
    assert not any(measure in name for name in plain for measure in (*measures.values(), PLACE_MEASURE))


@each
def test_too_few_objects_fail_without_an_error(shape):
    structure = STRUCTURES[shape]
    for count in range(1, structure.least):
        checks = structure.check(GOOD[shape][:count], StructureSpec(shape), Table())
        assert not all(check.passed for check in checks)
        assert structure.centre(GOOD[shape][:count]).shape == (2,)
        assert structure.corrections(GOOD[shape][:count], None).shape == (count, 2)


@each
def test_what_is_right_is_not_corrected(shape):
    structure, bodies = STRUCTURES[shape], GOOD[shape]
    assert all(check.passed for check in structure.check(bodies, StructureSpec(shape), Table()))
    np.testing.assert_allclose(structure.corrections(bodies, None), 0.0, atol=1e-9)
    np.testing.assert_allclose(structure.turns(bodies, np.pi / 2), 0.0, atol=1e-9)


@pytest.mark.parametrize("shape", [shape for shape in SHAPES[4:] if not STRUCTURES[shape].stacks])
def test_what_misses_its_place_by_little_is_corrected(shape):
    """Objects moved at random by a centimetre pass the checks after the correction, more often than without it."""
    structure, spec = STRUCTURES[shape], StructureSpec(shape)
    rng = np.random.default_rng(0)

    def moved(body, by):
        return replace(body, footprint=body.footprint + by, centroid=body.centroid + by)

    def holds(bodies):
        return all(check.passed for check in structure.check(bodies, spec, Table()))

    before = after = 0
    for _ in range(20):
        shaken = [moved(body, rng.normal(0.0, 0.01, 2)) for body in GOOD[shape]]
        corrected = [moved(body, by) for body, by in zip(shaken, structure.corrections(shaken, None))]
        before, after = before + holds(shaken), after + holds(corrected)
    assert before <= after and after >= 18


@each
def test_places_are_taken_once_by_every_object(shape):
    items = [
        LayoutItem(noun, circle_outline(radius), 0.05)
        for noun, radius in (("cup", 0.03), ("plate", 0.1), ("mug", 0.05))
    ]
    random = np.array([[0, 1, 2], [2, 0, 1], [1, 2, 0]] * 8)
    ordered = STRUCTURES[shape].order_places(items, random, np.random.default_rng(0))
    ordered = random if ordered is None else ordered
    assert ordered.shape == random.shape and (np.sort(ordered, axis=1) == [0, 1, 2]).all()
    first = {"tower": 1, "table setting": 1}  # the broadest, and the base
    assert shape not in first or (ordered[:16, 0] == first[shape]).all()
