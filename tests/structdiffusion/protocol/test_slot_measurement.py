"""Structures that were laid out for a spec read back that spec."""

from dataclasses import replace

import numpy as np
import pytest

from grounding.spec import FIRST_SHAPES, LEGAL_VALUES, SHAPES, SLOTS_OF_SHAPE, StructureSpec
from structdiffusion.data.scene_sampling import eligible, full_spec, layout_item
from structdiffusion.geometry import wrap_angle
from structdiffusion.layouts import lay_out
from structdiffusion.objects.solids import circle_outline
from structdiffusion.observation import Table
from structdiffusion.protocol.slot_measurement import (
    distinct_values,
    evenness,
    fitting_values,
    realised_shape,
    realised_spec,
)
from structdiffusion.structures import STRUCTURES
from structdiffusion.structures.bodies import LayoutItem
from structdiffusion.structures.structure import LayoutError

TABLE = Table()


def some_items(library, shape, rng):
    pool = [model for model in eligible(library, shape) if model.stackable and model.height < 0.2]
    if shape == "table setting":
        nouns = ("plate", "fork", "knife", "spoon", "cup")
        chosen = [next(model for model in pool if model.category == noun) for noun in nouns]
    else:
        wanted = 3 if STRUCTURES[shape].stacks else max(4, STRUCTURES[shape].least)
        chosen = STRUCTURES[shape].choose([pool[i] for i in rng.permutation(len(pool))], wanted, rng, True)
    return [layout_item(model, float(wrap_angle(rng.uniform(-3, 3)))) for model in chosen]


def some_layout(library, shape, rng):
    while True:
        items, spec = some_items(library, shape, rng), full_spec(shape, rng)
        try:
            return spec, items, lay_out(items, spec, TABLE, rng)
        except LayoutError:
            continue


@pytest.mark.parametrize("shape", SHAPES)
def test_what_was_laid_out_is_read_back(shape, library, built):
    rng = np.random.default_rng(SHAPES.index(shape))
    seen = set()
    for _ in range(12):
        spec, items, layout = some_layout(library, shape, rng)
        bodies = built(items, layout)
        if shape in FIRST_SHAPES:  # an open shape becomes one of these
            assert realised_shape(bodies, TABLE) == shape
        if shape == "line":  # which faces both ways
            spec = replace(spec, rotation={"south": "north", "west": "east"}.get(spec.rotation, spec.rotation))
        assert realised_spec(bodies, TABLE, shape) == spec
        seen.update(spec.tokens())
    assert {slot for slot, _ in seen} == {"shape", *SLOTS_OF_SHAPE[shape]}
    assert {value for slot, value in seen if slot == "x_position"} == {"left", "center", "right"}


def test_a_closed_ring_faces_nowhere(built):
    rng = np.random.default_rng(1)
    items = [LayoutItem("can", circle_outline(0.03, 24), 0.1) for _ in range(5)]
    ring = lay_out(items, StructureSpec("circle", size="medium"), TABLE, rng)
    read = realised_spec(built(items, ring), TABLE)
    assert (read.shape, read.size, read.rotation) == ("circle", "medium", None)
    assert None not in (read.x_position, read.y_position)


def test_a_setting_without_cutlery_has_a_heading(built):
    rng = np.random.default_rng(1)
    laid = [LayoutItem("plate", circle_outline(0.11, 24), 0.02), LayoutItem("cup", circle_outline(0.04, 24), 0.09)]
    wish = StructureSpec("table setting", rotation="west")
    setting = lay_out(laid, wish, TABLE, rng)
    assert realised_spec(built(laid, setting), TABLE, "table setting").rotation == "west"


def test_what_cannot_be_measured_stays_open(built):
    two = [LayoutItem("can", circle_outline(0.03, 24), 0.1) for _ in range(2)]
    line = lay_out(two, StructureSpec("line"), TABLE, np.random.default_rng(0))
    assert realised_spec(built(two, line), TABLE, "circle") == StructureSpec("circle")


def test_values_that_fit():
    rng = np.random.default_rng(0)
    thin = [LayoutItem("can", circle_outline(0.03, 24), 0.1) for _ in range(4)]
    broad = [LayoutItem("can", circle_outline(0.085, 24), 0.1) for _ in range(5)]
    assert fitting_values(thin, StructureSpec("circle"), "size", TABLE, rng) == ("small", "medium", "large")
    assert fitting_values(broad, StructureSpec("circle"), "size", TABLE, rng) == ("small",)
    assert fitting_values(thin, StructureSpec("line"), "rotation", TABLE, rng) == ("north", "east")
    small = set(fitting_values(thin, StructureSpec(size="small"), "shape", TABLE, rng))
    assert small >= {"circle", "line"} and not small & {"tower", "table setting"}  # these have no size
    some = set(fitting_values(thin, StructureSpec(), "shape", TABLE, rng))
    assert some >= {"circle", "line", "tower"} and "table setting" not in some
    assert distinct_values("circle", "rotation") == LEGAL_VALUES["rotation"]


def test_even_draws_are_even_in_the_mean_however_few():
    rng = np.random.default_rng(0)
    for count, names in ((5, "abcd"), (64, "abc"), (2, "ab")):
        drawn = [evenness(list(rng.choice(list(names), count)), list(names)) for _ in range(4000)]
        assert np.mean(drawn) == pytest.approx(1.0, abs=0.03)


def test_what_is_alike_or_does_not_fit_is_no_spread():
    assert evenness(["left"] * 12, ["left", "center", "right"]) == 0.0
    assert evenness(["left", "right"] * 500, ["left", "center", "right"]) == pytest.approx(
        np.log(2) / np.log(3), rel=1e-2
    )
    mixed = ["a", "b"] * 20
    assert evenness([*mixed, *"c" * 16], ["a", "b"]) == evenness(mixed, ["a", "b"]) == pytest.approx(1.0, abs=0.02)
    assert evenness(["left"], ["left", "right"]) is None and evenness(["left", "left"], ["left"]) is None
