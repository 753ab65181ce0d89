import math

import numpy as np
import pytest

from grounding.goals.parts import DIRECTIONAL, RelationPart
from grounding.goals.parts import RELATIONS as NAMES
from structdiffusion.evaluation_protocol import MAX_MOVED_OFF
from structdiffusion.objects.solids import circle_outline
from structdiffusion.observation import Table
from structdiffusion.relations import RELATIONS
from structdiffusion.relations.candidates import Candidates
from structdiffusion.relations.figure import Standing
from structdiffusion.structures.bodies import PlacedBody

ROUND = circle_outline(0.03, 72)
INSIDE, OUTSIDE = 0.998, 1.002  # of a limit


def body(x, y, outline=ROUND, z=0.0, height=0.05, rests_on=()):
    return PlacedBody("can", "can", outline + (x, y), np.array([x, y]), z, z + height, 0.0, rests_on)


def standing(*bodies, before=None, touches=None):
    centroids = np.array([one.centroid for one in bodies])
    return Standing(bodies, centroids if before is None else np.array(before), touches or ((),) * len(bodies), Table())


def held(part, *bodies, before=None, touches=None, references=None) -> bool:
    there = standing(*bodies, before=before, touches=touches)
    figures = [there.figure([i]) for i in range(len(bodies))]
    others = [there.figure(members) for members in references] if references else figures[1:]
    relation = RELATIONS[part.relation]
    checks = relation.check(figures[0], others[: relation.references], part)
    assert checks
    return all(check.passed for check in checks)


def related(name, distance=None) -> RelationPart:
    return RelationPart(name, (0,), (1,), distance=distance)


def test_every_relation_of_a_goal_has_its_class():
    assert tuple(RELATIONS) == NAMES


@pytest.mark.parametrize("name", DIRECTIONAL)
def test_a_direction_holds_within_45_degrees_and_a_gap_of_5_mm_to_25_cm(name):
    x, y = RELATIONS[name].direction
    reference = body(0.45, 0.0)

    def at(degrees, gap):
        turn, apart = math.radians(degrees), gap + 0.06
        direction = (x * math.cos(turn) - y * math.sin(turn), x * math.sin(turn) + y * math.cos(turn))
        return body(0.45 + apart * direction[0], apart * direction[1])

    for degrees in (-44.9, 0.0, 44.9):
        assert held(related(name), at(degrees, 0.1), reference)
        assert not held(related(name), at(degrees + 180, 0.1), reference)
    for degrees in (-45.1, 45.1, 90.0):
        assert not held(related(name), at(degrees, 0.1), reference)
    # The gap between two many-sided rings is that of their facing corners where these face each other.
    for gap, holds in ((0.0051, True), (0.0049, False), (0.2499, True), (0.2501, False), (-0.01, False)):
        assert held(related(name), at(0, gap), reference) is holds
    for gap, holds in ((0.0851, True), (0.0849, False), (0.1149, True), (0.1151, False)):
        assert held(related(name, 0.1), at(0, gap), reference) is holds
    # A distance of zero still leaves 5 mm; the smallest tolerance is 1 cm.
    for gap, holds in ((0.004, False), (0.0099, True), (0.0101, False)):
        assert held(related(name, 0.0), at(0, gap), reference) is holds


def test_next_to_holds_on_any_side_within_8_cm_and_not_stacked():
    reference = body(0.45, 0.0)
    for turn in np.radians(range(0, 360, 45)):
        near, far = ((0.45 + r * math.cos(turn), r * math.sin(turn)) for r in (0.1399, 0.1401))
        assert held(related("next to"), body(*near), reference)
        assert not held(related("next to"), body(*far), reference)
    assert not held(related("next to"), body(0.45, 0.0, z=0.05, rests_on=(1,)), reference)
    assert not held(related("next to"), body(0.45, 0.0), body(0.45, 0.0, z=0.05, rests_on=(0,)))
    assert held(related("next to", 0.2), body(0.45, 0.2899), reference)
    assert not held(related("next to", 0.2), body(0.45, 0.2901), reference)


def test_between_holds_in_the_middle_of_the_way_and_near_it():
    ends = body(0.3, -0.2), body(0.3, 0.2)
    part = RelationPart("between", (0,), (1, 2))
    for share, off, holds in (
        (0.5, 0.0, True), (0.301, 0.0, True), (0.299, 0.0, False), (0.699, 0.0, True), (0.701, 0.0, False),
        (0.5, 0.0399, True), (0.5, 0.0401, False), (0.5, -0.0401, False),
    ):  # fmt: skip
        assert held(part, body(0.3 + off, -0.2 + 0.4 * share), *ends) is holds
        assert held(part, body(0.3 + off, -0.2 + 0.4 * (1 - share)), *reversed(ends)) is holds


def test_on_holds_where_it_rests_on_the_reference_alone_and_its_middle_is_over_it():
    plate = body(0.45, 0.0, circle_outline(0.1, 72))

    def apple(y, rests_on):
        return body(0.45, y, z=0.05, rests_on=rests_on)

    assert held(related("on"), apple(0.0, (1,)), plate)
    assert held(related("on"), apple(0.099, (1,)), plate)
    assert not held(related("on"), apple(0.101, (1,)), plate)
    assert not held(related("on"), apple(0.0, ()), plate)
    for other in ((1, 2), (2,), (-1, 1)):
        assert not held(related("on"), apple(0.0, other), plate, body(0.6, 0.2))


def test_in_holds_a_centimetre_below_the_rim_and_where_nothing_outside_is_touched():
    mug = body(0.45, 0.0, circle_outline(0.04, 72), height=0.1)

    def spoon(y=0.0, z=0.02):
        return body(0.45, y, z=z, height=0.15)

    none = ((), ())
    assert held(related("in"), spoon(), mug, touches=none)
    assert held(related("in"), spoon(z=0.0899), mug, touches=none)
    assert not held(related("in"), spoon(z=0.0901), mug, touches=none)
    assert held(related("in"), spoon(0.0399), mug, touches=none)
    assert not held(related("in"), spoon(0.0401), mug, touches=none)
    assert held(related("in"), spoon(), mug, touches=((1,), (0,)))
    assert not held(related("in"), spoon(), mug, touches=((1, -1), (0,)))  # the table
    outside, inside = body(0.6, 0.0), body(0.46, 0.0, z=0.03)
    for other, holds in ((outside, False), (inside, True)):
        assert held(related("in"), spoon(), mug, other, touches=((1, 2), (0,), (0,))) is holds


@pytest.mark.parametrize(
    "x, y", [(x, y) for x in ("left", "center", "right", None) for y in ("top", "middle", "bottom", None)][:-1]
)
def test_at_holds_in_thirds_of_where_the_object_can_lie(x, y):
    part = RelationPart("at", (0,), x_position=x, y_position=y)
    low, high = np.array([0.18 + 0.03, -0.45 + 0.03]), np.array([0.72 - 0.03, 0.45 - 0.03])
    thirds = {"bottom": 0, "middle": 1, "top": 2, "right": 0, "center": 1, "left": 2}
    for row in range(3):
        for column in range(3):
            for inside in (0.01, 0.99):
                place = low + (high - low) * ((row + inside) / 3, (column + inside) / 3)
                expected = (y is None or thirds[y] == row) and (x is None or thirds[x] == column)
                assert held(part, body(*place)) is expected


@pytest.mark.parametrize(
    "direction, step", [("left", (0, 1)), ("right", (0, -1)), ("away", (1, 0)), ("closer", (-1, 0))]
)
def test_moved_holds_within_a_centimetre_and_a_half_along_and_across(direction, step):
    part = RelationPart("moved", (0,), distance=0.1, direction=direction)
    start, step = np.array([0.45, 0.0]), np.array(step)
    across = step[::-1]
    for along, beside, holds in (
        (0.0, 0.0, True), (INSIDE, INSIDE, True), (-INSIDE, -INSIDE, True),
        (OUTSIDE, 0.0, False), (-OUTSIDE, 0.0, False), (0.0, OUTSIDE, False), (0.0, -OUTSIDE, False),
    ):  # fmt: skip
        end = start + (0.1 + along * MAX_MOVED_OFF) * step + beside * MAX_MOVED_OFF * across
        assert held(part, body(*end), before=[start]) is holds
    assert not held(part, body(*start), before=[start])
    assert not held(part, body(*(start - 0.1 * step)), before=[start])


def test_swapped_holds_within_3_cm_of_where_the_other_was():
    part = RelationPart("swapped", (0, 1))
    before = [(0.3, 0.2), (0.6, -0.2)]
    there = body(0.3, 0.2)
    assert held(part, body(0.6, -0.2), there, before=before)
    assert held(part, body(0.6, -0.2 + 0.0299), there, before=before)
    assert not held(part, body(0.6 - 0.0301, -0.2), there, before=before)
    assert not held(part, body(0.3, 0.2), body(0.6, -0.2), before=before)


def random_case(name, rng):
    """A relation with every key that it takes, two references at random, and the table's state before."""
    outlines = [
        scale * circle_outline(1.0, int(sides))
        for scale, sides in zip(rng.uniform(0.02, 0.08, 3), rng.integers(4, 30, 3))
    ]
    places = rng.uniform((0.25, -0.35), (0.65, 0.35), (3, 2))
    bodies = [body(*place, outline) for place, outline in zip(places, outlines)]
    distance = float(rng.uniform(0.0, 0.2)) if rng.random() < 0.5 else None
    keys = {
        "at": {"x_position": "left", "y_position": "top"},
        "moved": {"direction": str(rng.choice(["left", "right", "away", "closer"])), "distance": 0.1},
    }.get(name, {})
    if name in (*DIRECTIONAL, "next to"):
        keys["distance"] = distance
    reference = {"between": (1, 2), "at": None, "moved": None, "swapped": None}.get(name, (1,))
    objects = (0, 1) if name == "swapped" else (0,)
    return RelationPart(name, objects, reference, **keys), bodies


@pytest.mark.parametrize("name", [name for name in NAMES if name not in ("on", "in")])
def test_margins_are_positive_exactly_where_the_checks_hold_and_samples_lie_there(name):
    rng, relation = np.random.default_rng(3), RELATIONS[name]
    compared = accepted = good = 0
    for _ in range(25):
        part, bodies = random_case(name, rng)
        there = standing(*bodies, before=rng.uniform((0.25, -0.35), (0.65, 0.35), (3, 2)))
        figure, *others = (there.figure([i]) for i in range(3))
        references = others[: relation.references]
        drawn = relation.sample(figure, references, part, 20, rng)
        assert drawn.shape == (20, 2)
        around = np.concatenate((drawn, drawn + 0.04 * rng.standard_normal((20, 2))))
        candidates = Candidates(figure.outline - figure.centroid, around, there.before[0])
        margins = relation.margins(candidates, references, part, there.table)
        assert margins.shape == (40,) and margins.max() <= 1.0
        for k, (place, margin) in enumerate(zip(around, margins)):
            here = standing(body(*place, bodies[0].local_footprint), *bodies[1:], before=there.before)
            now, *refs = (here.figure([i]) for i in range(3))
            checks = relation.check(now, refs[: relation.references], part)
            if abs(margin) > 1e-6 and not (name == "next to" and margin == -1.0):
                assert all(check.passed for check in checks) is bool(margin > 0), (part, place, margin, checks)
                compared += 1
            accepted += margin > 0
            good += k < 20 and margin > 0
    assert compared > 500 and accepted > 100
    assert good >= 0.85 * 25 * 20  # a place between references that are far apart may be drawn at a limit


def test_a_structure_as_a_whole_is_its_hull():
    row = [body(0.45, y) for y in (-0.2, 0.0, 0.2)]
    there = standing(body(0.60, 0.0), *row)
    structure = there.figure([1, 2, 3], "line")
    np.testing.assert_allclose(structure.centroid, (0.45, 0.0), atol=1e-6)
    checks = RELATIONS["behind"].check(there.figure([0]), [structure], related("behind"))
    assert all(check.passed for check in checks)
    # Behind the middle of the row, but 45 degrees off what is beside its end.
    beside = standing(body(0.52, 0.25), *row)
    checks = RELATIONS["behind"].check(beside.figure([0]), [beside.figure([1, 2, 3])], related("behind"))
    assert not all(check.passed for check in checks)
