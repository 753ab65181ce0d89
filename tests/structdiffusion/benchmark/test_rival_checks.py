"""The rivals' looser checks, on scenes whose answers follow from their published definitions."""

import math

import numpy as np
import pytest

from grounding.goals.goal import Goal
from grounding.goals.parts import PartReference, RelationPart, StructurePart
from structdiffusion.benchmark.rival_checks import lgmcts_accepts, srem_accepts
from structdiffusion.observation import Table
from structdiffusion.protocol.semantic import check_structure
from structdiffusion.structures.bodies import PlacedBody


def body(x, y, half=0.02):
    corners = np.array([[-half, -half], [half, -half], [half, half], [-half, half]]) + (x, y)
    return PlacedBody("block", "block", corners, np.array([x, y]), 0.0, 0.05, 0.0)


def bodies(places):
    return [body(x, y) for x, y in places]


def structure(shape, count, **values):
    return Goal((StructurePart(shape, objects=tuple(range(count)), **values),))


def ring(count, radius, off=()):  # off: (number, m beyond the radius) pairs
    radii = [radius + dict(off).get(k, 0.0) for k in range(count)]
    return [
        (0.45 + r * math.cos(2 * math.pi * k / count), r * math.sin(2 * math.pi * k / count))
        for k, r in enumerate(radii)
    ]


def ours(places, shape):
    return all(
        check.passed for check in check_structure(bodies(places), Goal.from_dict({"shape": shape}).plain_spec, Table())
    )


def test_a_crooked_line_passes_both_and_not_ours():
    crooked = [(0.4, 0.3), (0.48, 0.15), (0.4, 0.0), (0.48, -0.15), (0.4, -0.3)]
    goal = structure("line", 5)
    assert lgmcts_accepts(bodies(crooked), goal) and srem_accepts(bodies(crooked), goal) and not ours(crooked, "line")
    far = [(0.4, 0.3), (0.51, 0.0), (0.4, -0.3)]
    assert lgmcts_accepts(bodies(far), structure("line", 3)) is False


def test_a_lines_limit_is_ten_centimetres_off_the_line_through_its_ends():
    for off, accepted in ((0.099, True), (0.101, False)):
        assert lgmcts_accepts(bodies([(0.3, 0.3), (0.3 + off, 0.0), (0.3, -0.3)]), structure("line", 3)) is accepted


def test_a_dented_ring_passes_lgmcts_because_only_outward_counts():
    dented = ring(8, 0.20, {0: -0.15}.items())
    assert lgmcts_accepts(bodies(dented), structure("circle", 8)) and not ours(dented, "circle")
    assert srem_accepts(bodies(dented), structure("circle", 8)) is False
    star = ring(8, 0.05, dict.fromkeys((0, 2, 4, 6), 0.25).items())  # 12.5 cm outside the circle between them
    assert lgmcts_accepts(bodies(star), structure("circle", 8)) is False


def test_three_objects_always_form_a_circle_for_lgmcts():
    row = [(0.3, 0.0), (0.4, 0.0), (0.6, 0.001)]
    assert lgmcts_accepts(bodies(row), structure("circle", 3)) and not ours(row, "circle")


def test_polygons_of_srem_spread_by_less_than_three_centimetres():
    square = [(0.4, 0.1), (0.4, -0.1), (0.6, -0.1), (0.6, 0.1)]
    assert srem_accepts(bodies(square), structure("square", 4))
    assert srem_accepts(bodies([(0.3, 0.1), *square[1:]]), structure("square", 4))  # a corner 10 cm off
    assert srem_accepts(bodies([(0.2, 0.1), *square[1:]]), structure("square", 4)) is False
    # A ring of four objects is a square to it, and three in any triangle with like radii one too.
    assert srem_accepts(bodies(ring(3, 0.12)), structure("triangle", 3))


def test_rectangles_of_lgmcts_are_of_four_objects():
    oblong = [(0.4, 0.2), (0.4, -0.2), (0.5, -0.2), (0.5, 0.2)]
    assert lgmcts_accepts(bodies(oblong), structure("rectangle", 4)) is False  # sides 10 and 40 cm: 15 over their mean
    rough = [(0.4, 0.1), (0.43, -0.12), (0.6, -0.1), (0.55, 0.16)]
    assert lgmcts_accepts(bodies(rough), structure("rectangle", 4))
    assert lgmcts_accepts(bodies([*oblong, (0.45, 0.2)]), structure("rectangle", 5)) is None


@pytest.mark.parametrize(
    ("relation", "place", "lgmcts", "srem"),
    [
        ("left of", (0.45, 0.02), True, False),  # boxes overlap
        ("left of", (0.70, 0.40), True, True),  # far off the direction: no matter
        ("left of", (0.45, -0.1), False, False),
        ("right of", (0.45, -0.1), True, True),
        ("behind", (0.55, 0.0), True, True),
        ("in front of", (0.55, 0.0), False, False),
        ("next to", (0.55, 0.0), None, None),
    ],
)
def test_relations(relation, place, lgmcts, srem):
    scene = [body(*place), body(0.45, 0.0)]
    goal = Goal((RelationPart(relation, (0,), (1,)),))
    assert lgmcts_accepts(scene, goal) is lgmcts and srem_accepts(scene, goal) is srem


def test_inside_is_eight_tenths_of_the_box():
    bowl = body(0.45, 0.0, half=0.08)
    goal = Goal((RelationPart("in", (0,), (1,)),))
    assert srem_accepts([body(0.52, 0.0), bowl], goal) is False and srem_accepts([body(0.515, 0.0), bowl], goal)
    assert lgmcts_accepts([body(0.45, 0.0), bowl], goal) is None


def test_a_structure_as_a_whole_and_several_parts():
    line = [(0.3, 0.2), (0.3, 0.1), (0.3, 0.0)]
    goal = Goal((StructurePart("line", objects=(0, 1, 2)), RelationPart("behind", (3,), PartReference(0))))
    for accepts in (lgmcts_accepts, srem_accepts):
        assert accepts(bodies([*line, (0.5, 0.0)]), goal) and accepts(bodies([*line, (0.2, 0.0)]), goal) is False
    unknown = Goal((StructurePart("line", objects=(0, 1, 2)), StructurePart("tower", objects=(3, 4))))
    assert lgmcts_accepts(bodies([*line, (0.5, 0.0), (0.6, 0.0)]), unknown) is None
