"""Keys: what is laid out for them passes their checks, what is just beyond a limit fails, what cannot be is told."""

import math
from dataclasses import replace

import numpy as np
import pytest

from grounding.goals.parts import SHAPES_OF_KEY, Order, StructurePart
from grounding.spec import SHAPES, StructureSpec
from structdiffusion.data.scene_sampling import eligible, layout_item
from structdiffusion.evaluation_protocol import MAX_LENGTH_OFF, MAX_RADIUS_OFF
from structdiffusion.layouts import lay_out
from structdiffusion.objects.solids import circle_outline
from structdiffusion.observation import Table
from structdiffusion.protocol.semantic import check_structure
from structdiffusion.structures import STRUCTURES
from structdiffusion.structures.bodies import LayoutItem
from structdiffusion.structures.key_checks import check_keys
from structdiffusion.structures.keys import NO_KEYS, StructureKeys, structure_keys
from structdiffusion.structures.sequences import measure
from structdiffusion.structures.structure import LayoutError
from tests.structdiffusion.structures.handmade import arc, at_places, cross, grid, rectangle, ring_at, row, tower

OWN_KEYS = ("order", "gap", "radius", "length", "rows", "columns")


def failed(bodies, shape, **keys):
    return [check.name for check in check_keys(bodies, StructureSpec(shape), StructureKeys(**keys)) if not check.passed]


def discs(*radii, heights=None):
    heights = heights or [0.1] * len(radii)
    return [LayoutItem("can", circle_outline(radius), height) for radius, height in zip(radii, heights)]


def drawn_keys(key, shape, rng):
    starts = ["bottom", "top"] if shape == "tower" else ["left", "right", "near", "far"]
    by, direction = (
        str(rng.choice(["height", "width", "volume", "listed"])),
        str(rng.choice(["ascending", "descending"])),
    )
    value = {
        "order": Order(by, direction if rng.random() < 0.5 else None,
                       str(rng.choice(starts)) if rng.random() < 0.6 else None),
        "gap": float(rng.uniform(0.01, 0.08)), "radius": float(rng.uniform(0.08, 0.2)),
        "length": float(rng.uniform(0.2, 0.5)),
        "rows": int(rng.integers(2, 4)), "columns": int(rng.integers(2, 4)),
    }[key]  # fmt: skip
    return StructureKeys(**{key: value})


@pytest.mark.parametrize(("key", "shape"), [(key, shape) for key in OWN_KEYS for shape in SHAPES_OF_KEY[key]])
def test_what_is_laid_out_for_a_key_passes_every_check(key, shape, library, built):
    structure, made, rng = STRUCTURES[shape], 0, np.random.default_rng(SHAPES.index(shape))
    for _ in range(40):
        models = eligible(library, shape)
        count = int(rng.integers(structure.least, 5 if structure.stacks else 8))
        chosen = sorted((models[i] for i in rng.permutation(len(models))[: 2 * count]), key=lambda one: one.radius)[
            :count
        ]
        items, keys = [layout_item(model, float(rng.uniform(-3, 3))) for model in chosen], drawn_keys(key, shape, rng)
        try:
            bodies = built(items, lay_out(items, StructureSpec(shape), Table(), rng, keys))
        except LayoutError:
            continue
        made += 1
        checks = [
            *check_structure(bodies, StructureSpec(shape), Table()),
            *check_keys(bodies, StructureSpec(shape), keys),
        ]
        assert len(checks) > len(check_structure(bodies, StructureSpec(shape), Table()))
        assert all(check.passed for check in checks), (keys, [check for check in checks if not check.passed])
        if made == 12:
            break
    assert made >= 8


def test_the_key_of_a_part_becomes_that_of_its_structure():
    part = StructurePart("grid", objects=(0, 1, 2, 3), rows=2, gap=0.03)
    assert structure_keys(part) == StructureKeys(rows=2, gap=0.03) and structure_keys(StructurePart("tower")) == NO_KEYS


def test_gaps_are_measured_between_neighbours_alone():
    for shape, bodies, gap in (
        ("line", row(0.02), 0.02), ("grid", grid(2, 3, (0.08, 0.08)), 0.02), ("cross", cross(0.09), 0.03),
        ("rectangle", rectangle(0.24, 0.12), 0.06), ("square", rectangle(0.24, 0.12), 0.06),
    ):  # fmt: skip
        assert failed(bodies, shape, gap=gap) == []
        assert failed(bodies, shape, gap=gap + 0.0095) == []
        assert failed(bodies, shape, gap=gap + 0.0115) and failed(bodies, shape, gap=max(gap - 0.0115, 0.0))


def test_the_opening_of_a_ring_is_no_gap():
    opened = ring_at(0.12, np.arange(60, 301, 48))
    keys, gap = StructureKeys(gap=2 * 0.12 * math.sin(math.radians(24)) - 0.06), "clear gap off"
    assert all(check.passed for check in check_keys(opened, StructureSpec("circle", rotation="north"), keys))
    assert any(gap in check.name and not check.passed for check in check_keys(opened, StructureSpec("circle"), keys))


@pytest.mark.parametrize(("shape", "bodies"), [("circle", ring_at(0.12, np.arange(0, 360, 60))), ("arc", arc(0.12))])
def test_a_radius_has_a_tolerance(shape, bodies):
    for off, wrong in ((0.9 * MAX_RADIUS_OFF, False), (1.1 * MAX_RADIUS_OFF, True)):
        assert bool(failed(bodies, shape, radius=0.12 + off)) is bool(failed(bodies, shape, radius=0.12 - off)) is wrong


def test_a_length_has_a_tolerance():
    bodies = row(0.02, 4)  # squares of 6 cm: 24 cm between the ends
    assert failed(bodies, "line", length=0.24) == failed(bodies, "line", length=0.24 + 0.9 * MAX_LENGTH_OFF) == []
    assert failed(bodies, "line", length=0.24 - 1.1 * MAX_LENGTH_OFF) == ["length off 0.218 (m)"]


def test_rows_run_left_to_right():
    assert failed(grid(2, 3), "grid", rows=2, columns=3) == [] and failed(grid(2, 3), "grid", rows=3) == ["rows"]
    assert failed(grid(3, 2), "grid", rows=3, columns=2) == [] and failed(grid(3, 3, missing=2), "grid", columns=2) == [
        "columns"
    ]


def heights(bodies, values):
    return [replace(body, z_top=body.z_bottom + value) for body, value in zip(bodies, values)]


def test_an_order_is_monotone_up_to_ties():
    bodies = row(0.02, 4)  # the leftmost first
    rising = heights(bodies, (0.05, 0.08, 0.076, 0.1))  # a tie of 4 mm
    assert failed(rising, "line", order=Order("height")) == []
    assert failed(rising, "line", order=Order("height", "ascending", "left")) == []
    assert failed(rising, "line", order=Order("height", "descending", "right")) == []
    assert failed(rising, "line", order=Order("height", "ascending")) == []  # from either end
    assert failed(rising, "line", order=Order("height", "descending", "left")) and failed(
        rising, "line", order=Order("height", "ascending", "right")
    )
    assert failed(heights(bodies, (0.05, 0.08, 0.074, 0.1)), "line", order=Order("height")) == [
        "height out of order by (m)"
    ]


def test_ties_do_not_add_up():
    falling = heights(row(0.01, 5), (0.1, 0.096, 0.092, 0.088, 0.12))
    assert failed(falling, "line", order=Order("height", "ascending", "left")) == ["height out of order by (m)"]


def test_listed_is_the_order_of_the_objects():
    bodies = row(0.02, 4)
    for order, right in (
        (Order("listed", None, "left"), True), (Order("listed", None, "right"), False), (Order("listed"), True),
        (Order("listed", "descending", "right"), True), (Order("listed", "descending", "left"), False),
    ):  # fmt: skip
        assert (failed(bodies, "line", order=order) == []) is right, order
    swapped = [bodies[i] for i in (1, 0, 2, 3)]
    assert failed(swapped, "line", order=Order("listed")) == ["objects out of their order"]


def test_an_end_that_the_line_does_not_have():
    assert failed(row(0.02, 4, degrees=90), "line", order=Order("listed", None, "left")) != []


def test_a_tower_is_ordered_from_bottom_to_top():
    bodies = heights(tower(), (0.05, 0.05, 0.09))
    assert failed(bodies, "tower", order=Order("height", "ascending", "bottom")) == []
    assert failed(bodies, "tower", order=Order("height", "descending", "top")) == []
    assert failed(bodies, "tower", order=Order("height", "ascending", "top")) == ["height out of order by (m)"]
    assert failed(bodies, "tower", order=Order("width", "descending", "bottom")) == []


def test_width_and_volume_do_not_depend_on_how_an_object_stands():
    box = np.array([[-0.05, -0.02], [0.05, -0.02], [0.05, 0.02], [-0.05, 0.02]])
    for yaw in (0.0, 0.4, 1.2):
        turn = np.array([[math.cos(yaw), math.sin(yaw)], [-math.sin(yaw), math.cos(yaw)]])
        item = LayoutItem("box", box @ turn, 0.03)
        assert measure(item, "width") == pytest.approx(0.1) and measure(item, "height") == 0.03
        assert measure(item, "volume") == pytest.approx((0.1 * 0.04 * 0.03) ** (1 / 3))


@pytest.mark.parametrize(
    ("shape", "items", "keys", "sentence"),
    [
        ("circle", discs(*[0.04] * 5), {"radius": 0.06},
         "a circle with a radius of 0.06 m is too small for these objects: they need 0.07"),
        ("circle", discs(*[0.03] * 5), {"radius": 0.2, "gap": 0.02},
         "with gaps of 0.02 m has a radius of 0.068 m, not 0.2 m"),
        ("circle", discs(*[0.03] * 5), {"radius": 0.9},
         "a circle of these objects is .* deep, and the table has room for 0.53 m"),
        ("line", discs(*[0.05] * 4), {"length": 0.2}, "cannot have a length of 0.2 m: it is 0.3.. m long or more"),
        ("line", discs(*[0.03] * 4), {"length": 0.5, "gap": 0.02}, "with gaps of 0.02 m is 0.2.. m long, not 0.5 m"),
        ("line", discs(*[0.03] * 6), {"gap": 0.2}, "a line of these objects is .* m wide, and the table has room for"),
        ("arc", discs(*[0.03] * 4), {"radius": 0.3, "gap": 0.01},
         "an arc of these objects with gaps of 0.01 m and a radius of 0.3 m spans 40"),
        ("grid", discs(*[0.03] * 7), {"rows": 3, "columns": 3}, "a grid of 3 by 3 takes 9 objects, got 7"),
        ("square", discs(*[0.03] * 6), {"gap": 0.05}, "a square of these objects cannot have even gaps of 0.05 m"),
        ("grid", discs(0.02, 0.1, 0.02, 0.03), {"gap": 0.03},
         "a grid of these objects cannot have even gaps of 0.03 m"),
    ],
)  # fmt: skip
def test_a_key_that_cannot_be_kept_is_told_with_its_numbers(shape, items, keys, sentence):
    with pytest.raises(LayoutError, match=sentence):
        lay_out(items, StructureSpec(shape), Table(), np.random.default_rng(0), StructureKeys(**keys))


def test_a_size_that_contradicts_a_key_is_told():
    with pytest.raises(
        LayoutError, match="a large line cannot have gaps of 0.01 m with these objects: it would be 1.00 times"
    ):
        lay_out(
            discs(*[0.03] * 4),
            StructureSpec("line", "large"),
            Table(),
            np.random.default_rng(0),
            StructureKeys(gap=0.01),
        )


def test_an_order_from_an_end_that_the_structure_does_not_have_is_told():
    order = StructureKeys(order=Order("height", None, "near"))
    items = discs(0.03, 0.03, 0.03, heights=[0.05, 0.1, 0.15])
    with pytest.raises(LayoutError, match="a line facing north has no near end"):
        lay_out(items, StructureSpec("line", rotation="north"), Table(), np.random.default_rng(0), order)
    with pytest.raises(LayoutError, match="a line along the near edge has no near end"):
        STRUCTURES["line"].draft(
            items, StructureSpec("line"), 0.0, np.random.default_rng(0), replace(order, along="near")
        )


@pytest.mark.parametrize("start", ["left", "right", "near", "far"])
def test_the_tallest_stands_at_the_end_that_was_named(start, built):
    items, at = (
        discs(*[0.03] * 4, heights=[0.08, 0.2, 0.05, 0.12]),
        {"left": (1, 1), "right": (1, -1), "near": (0, -1), "far": (0, 1)},
    )
    keys = StructureKeys(order=Order("height", "descending", start))
    for shape in ("line", "arc"):
        layout = lay_out(items, StructureSpec(shape), Table(), np.random.default_rng(3), keys)
        axis, sign = at[start]
        ends = [layout.positions[i, axis] * sign for i in (1, 2)]  # the tallest, and the lowest
        assert ends[0] > ends[1]
        assert check_keys(built(items, layout), StructureSpec(shape), keys)[-1].passed


def test_too_few_objects_have_no_keys_to_check():
    assert check_keys(at_places([(0, 0)]), StructureSpec("line"), StructureKeys(gap=0.1)) == []
    with pytest.raises(ValueError, match="a structure without a shape cannot have keys"):
        check_keys(at_places([(0, 0)]), StructureSpec(), StructureKeys(gap=0.1))
