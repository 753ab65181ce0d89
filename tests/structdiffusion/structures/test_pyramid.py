"""A pyramid holds while every upper object rests on two, in a straight wall, and fails once that is broken."""

from dataclasses import replace

import numpy as np
import pytest

from grounding.spec import StructureSpec
from structdiffusion.layouts import lay_out
from structdiffusion.objects.solids import circle_outline
from structdiffusion.observation import Table
from structdiffusion.structures.bodies import LayoutItem
from structdiffusion.structures.pyramid import row_lengths
from structdiffusion.structures.structure import LayoutError
from tests.structdiffusion.structures.handmade import failures, moved, pyramid, tower

SPEC = StructureSpec("pyramid")
BLOCK = 0.03 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])


def cans(count):
    return [LayoutItem("can", circle_outline(0.06, 60), 0.05) for _ in range(count)]


def blocks(count, height=0.05, scale=1.0, **more):
    return [LayoutItem("block", scale * BLOCK, height, **more) for _ in range(count)]


def test_numbers_of_objects_that_make_one():
    assert {count: row_lengths(count) for count in range(2, 11)} == {
        2: (), 3: (2, 1), 4: (), 5: (3, 2), 6: (3, 2, 1), 7: (4, 3), 8: (), 9: (4, 3, 2), 10: (4, 3, 2, 1)
    }  # fmt: skip


def test_a_wall_that_narrows_holds_and_others_do_not():
    bodies = pyramid()
    assert failures(bodies, SPEC) == [] and failures(bodies[:5], SPEC) == []
    one, other = "rows shorter by one than the row below", "objects that rest on exactly two of the row below"
    assert failures([*bodies[:4], bodies[5]], SPEC) == [one, other]
    assert failures([*bodies[:5], replace(bodies[5], rests_on=(3,))], SPEC) == [other]
    assert failures(bodies[:3], SPEC) == [one] and one in failures(tower(), SPEC)
    bent = [*bodies[:4], moved(bodies[4], 0.025), bodies[5]]
    assert failures(bent, SPEC) == ["distance to the wall's line (m)"]


@pytest.mark.parametrize("count", [3, 5, 6, 10])
def test_upper_blocks_stand_over_the_middle_of_two(count):
    layout = lay_out(blocks(count), SPEC, Table(), np.random.default_rng(count))
    lengths, places = row_lengths(count), [layout.positions[i] for i in layout.order]
    start = 0
    for below, length in zip(lengths, lengths[1:]):
        lower, upper = places[start : start + below], places[start + below : start + below + length]
        for k, at in enumerate(upper):
            np.testing.assert_allclose(at[:2], (lower[k][:2] + lower[k + 1][:2]) / 2, atol=1e-9)
            assert at[2] == pytest.approx(lower[k][2] + 0.05, abs=1e-3)
        start += below


def test_rows_are_made_of_equally_high_objects():
    items = [*blocks(1, 0.05), *blocks(1, 0.08), *blocks(1, 0.05), *blocks(1, 0.08), *blocks(1, 0.05), *blocks(1, 0.03)]
    layout = lay_out(items, SPEC, Table(), np.random.default_rng(0))
    assert set(layout.order[:3]) == {0, 2, 4} and set(layout.order[3:5]) == {1, 3} and layout.order[5] == 5


@pytest.mark.parametrize(
    ("items", "sentence"),
    [
        (blocks(4), "4 objects do not make a pyramid, .*; numbers that do: 3, 5, 6, 7, 9, 10"),
        (blocks(2), "a pyramid needs 3 or more objects, got 2"),
        ([*blocks(1, 0.05), *blocks(1, 0.07), *blocks(1, 0.09)],
         "equally high within 8 degrees of lean; these are not: block 0.050 m, block 0.070 m"),
        (blocks(3, stackable=False), "rows of objects that carry others"),
        (blocks(3, flat_bottom=False), "objects with a level bottom"),
        ([*cans(2), *blocks(1, 0.02, scale=0.08)], "the block is too small to lie on two others"),
        (blocks(10, 0.15), "would be built up to 0.45 m, and the arm reaches 0.4 m"),
    ],
)  # fmt: skip
def test_what_cannot_be_built_is_said_in_a_sentence(items, sentence):
    with pytest.raises(LayoutError, match=sentence):
        lay_out(items, SPEC, Table(), np.random.default_rng(0))
