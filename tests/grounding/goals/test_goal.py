"""Goals of several parts: what is legal, JSON, the one spelling, and the opposite viewpoint."""

import json
import random

import pytest

from grounding.goals.goal import MAX_PARTS, Goal
from grounding.goals.parts import (
    EDGES,
    KEYS,
    MAX_LENGTH,
    MOVE_DIRECTIONS,
    RELATIONS,
    SHAPES_OF_KEY,
    WITH_DISTANCE,
    GoalError,
    Order,
    PartReference,
    RelationPart,
    StructurePart,
)
from grounding.spec import ROTATIONS, SHAPES, SIZES, SLOTS_OF_SHAPE, X_POSITIONS, Y_POSITIONS, StructureSpec

LINE = {"kind": "structure", "shape": "line", "x_position": "left", "objects": [2, 4, 5], "gap": 0.05}
BOWL = {"kind": "relation", "relation": "left of", "objects": [0], "reference": [1]}


def random_structure(rng: random.Random, objects: tuple[int, ...]) -> StructurePart:
    shape = rng.choice(SHAPES)
    slots = {"size": SIZES, "x_position": X_POSITIONS, "y_position": Y_POSITIONS, "rotation": ROTATIONS}
    values = {
        slot: rng.choice(legal) for slot, legal in slots.items() if slot in SLOTS_OF_SHAPE[shape] and rng.random() < 0.5
    }
    starts = ("bottom", "top") if shape == "tower" else ("left", "right", "near", "far")
    keys = {
        "order": Order(rng.choice(("height", "listed")), rng.choice(("ascending", "descending", None)),
                       rng.choice((*starts, None))),
        "gap": rng.choice((0.0, 0.05)), "radius": 0.15, "length": 0.4, "rows": 2, "columns": 3, "around": (99,),
        "along": rng.choice(EDGES), "group_by": "colour",
    }  # fmt: skip
    values |= {key: value for key, value in keys.items() if shape in SHAPES_OF_KEY[key] and rng.random() < 0.5}
    return StructurePart(shape, objects=objects, **values)


def random_relation(rng: random.Random, structures: int) -> RelationPart:
    relation = rng.choice(RELATIONS)
    pair = tuple(rng.sample(range(20, 40), 4))
    if relation == "at":
        return RelationPart("at", pair[:1], x_position="left", y_position=rng.choice((*Y_POSITIONS, None)))
    if relation == "moved":
        return RelationPart("moved", pair[:1], distance=0.1, direction=rng.choice(MOVE_DIRECTIONS))
    if relation == "swapped":
        return RelationPart("swapped", pair[:2])
    reference = PartReference(rng.randrange(structures)) if relation != "between" and rng.random() < 0.3 else None
    reference = reference or (pair[2:] if relation == "between" else pair[2:3])
    distance = 0.07 if relation in WITH_DISTANCE and rng.random() < 0.5 else None
    return RelationPart(relation, pair[:1], reference, distance)


def random_goal(seed: int) -> Goal:
    rng = random.Random(seed)
    structures = rng.randint(1, 3)
    parts = [random_structure(rng, tuple(range(5 * i, 5 * i + 5))) for i in range(structures)]
    return Goal((*parts, *(random_relation(rng, structures) for _ in range(rng.randint(0, 3)))))


@pytest.mark.parametrize("seed", range(200))
def test_json_holds_every_goal_and_the_opposite_viewpoint_taken_twice_changes_nothing(seed: int) -> None:
    goal = random_goal(seed)
    assert Goal.from_dict(json.loads(json.dumps(goal.to_dict()))) == goal
    assert goal.turned().turned() == goal
    assert goal.canonical().canonical() == goal.canonical()
    assert Goal.from_dict(json.loads(goal.to_json())) == goal.canonical()
    assert all(set(part) >= {"kind", "objects"} for part in goal.to_dict()["parts"])


def test_every_key_of_the_protocol_is_there_and_null_where_nobody_asked() -> None:
    structure, relation = Goal.from_dict({"parts": [LINE, BOWL]}).to_dict()["parts"]
    slots = {"shape", "size", "x_position", "y_position", "rotation"}
    assert set(structure) == {"kind", "objects"} | slots | set(KEYS)
    assert set(relation) == {
        "kind", "relation", "objects", "reference", "distance", "x_position", "y_position", "direction",
    }  # fmt: skip
    assert [key for key, value in structure.items() if value is not None] == [
        "kind",
        "shape",
        "x_position",
        "objects",
        "gap",
    ]


def test_the_five_slots_alone_are_the_goal_of_one_structure() -> None:
    spec = StructureSpec(shape="circle", size="small", rotation="south")
    goal = Goal.from_dict(spec.to_dict())
    assert goal == Goal((StructurePart.of(spec),))
    assert goal.plain_spec == spec
    assert Goal.from_dict({"parts": [LINE]}).plain_spec is None  # it has a gap
    assert Goal.from_dict({"parts": [BOWL]}).plain_spec is None


def test_orders_from_either_end_are_one_order() -> None:
    def spelled(direction: str, start: str, by: str = "height", objects: tuple[int, ...] = (3, 1, 2)) -> Goal:
        return Goal((StructurePart("line", objects=objects, order=Order(by, direction, start)),)).canonical()

    assert spelled("descending", "left") == spelled("ascending", "right")
    assert spelled("descending", "left") != spelled("ascending", "left")
    assert spelled("ascending", "left", "listed") == spelled("ascending", "right", "listed", (2, 1, 3))
    assert spelled("ascending", "left", "listed") != spelled("ascending", "left", "listed", (1, 2, 3))


def test_the_rest_is_what_no_part_names() -> None:
    goal = Goal.from_dict({"parts": [
        {"kind": "structure", "shape": "circle", "around": [3]},
        {"kind": "relation", "relation": "on", "objects": [0], "reference": [5]},
    ]})  # fmt: skip
    assert goal.resolved(7).structures[0].objects == (1, 2, 4, 6)
    assert goal.named_objects() == (3, 0, 5)
    with pytest.raises(GoalError, match="part 0 takes all objects that no other part names, but there are none"):
        Goal.from_dict({"parts": [{"kind": "structure", "shape": "circle", "around": [0]}]}).resolved(1)


@pytest.mark.parametrize(
    ("parts", "said"),
    [
        ([{"kind": "structure", "shape": "blob"}], "shape cannot be 'blob'; legal values: circle, line"),
        ([{"kind": "pile"}], "part 0: kind cannot be 'pile'; legal values: structure, relation"),
        ([LINE | {"radius": 0.1}], "a line cannot have the key radius; shapes that can: circle, arc"),
        ([LINE | {"gap": -0.05}], "gap cannot be -0.05 m; legal values: 0 to 3 m"),
        ([LINE | {"gap": 1e7}], "gap cannot be 10000000.0 m"),
        ([LINE | {"gap": float("nan")}], "gap cannot be nan"),
        ([LINE | {"gap": True}], "gap cannot be True"),
        ([LINE | {"length": 0}], "legal values: more than 0 to 3 m"),
        ([LINE | {"colour": "red"}], "unknown key 'colour' of a structure; legal keys: shape"),
        ([LINE | {"objects": [1, 1]}], "names an object twice"),
        ([LINE | {"objects": [-1]}], "objects cannot be"),
        ([LINE | {"objects": []}], "objects cannot be"),
        ([LINE | {"order": {"by": "colour"}}], "order.by cannot be 'colour'; legal values: height, width, volume, "
                                               "listed"),
        ([LINE | {"order": {"by": "height", "from": "bottom"}}], "legal values: left, right, near, far, null"),
        ([LINE, LINE], "object 2 is in parts 0 and 1"),
        ([{"kind": "structure", "shape": "line"}, {"kind": "structure", "shape": "circle"}], "both take all objects"),
        ([BOWL | {"relation": "under"}], "relation cannot be 'under'; legal values: left of"),
        ([BOWL | {"reference": None}], "needs a reference"),
        ([BOWL | {"reference": [0]}], "an object cannot be 'left of' itself"),
        ([BOWL | {"reference": {"part": 3}}], "refers to part 3; structures that it can refer to: none"),
        ([LINE, BOWL | {"reference": {"part": 1}}], "structures that it can refer to: 0"),
        ([BOWL | {"relation": "between"}], "reference must name 2 objects, not 1"),
        ([BOWL | {"relation": "on", "distance": 0.1}], "cannot have a distance; those that can"),
        ([{"kind": "relation", "relation": "at", "objects": [1]}], "needs x_position or y_position"),
        ([{"kind": "relation", "relation": "moved", "objects": [1], "distance": 0.1}],
         "needs a direction and a distance"),
        ([{"kind": "relation", "relation": "swapped", "objects": [1]}], "must name 2 objects"),
        ([{"kind": "relation"}], "part 0: "),
        (["line"], "part 0 is a JSON object"),
        ("line", "the parts of a goal are a list"),
        ([BOWL | {"objects": [i], "reference": [50]} for i in range(MAX_PARTS + 1)], "more than a goal can have"),
    ],
)  # fmt: skip
def test_what_is_not_legal_is_refused_in_a_sentence_with_the_legal_values(parts: object, said: str) -> None:
    with pytest.raises(GoalError) as error:
        Goal.from_dict({"parts": parts})
    assert said in str(error.value)
    assert "\n" not in str(error.value) and len(str(error.value)) < 400


def test_the_longest_legal_length_is_legal() -> None:
    assert StructurePart("line", gap=MAX_LENGTH).gap == MAX_LENGTH


@pytest.mark.parametrize(
    ("parts", "said"),
    [
        ([LINE | {"objects": [1, 1]}], "cup is named twice"),
        ([LINE, LINE], "fork would be in two structures"),
        ([{"kind": "structure", "shape": "line"}, {"kind": "structure", "shape": "circle"}],
         "two structures of it take everything"),
        ([BOWL | {"reference": [0]}], "bowl cannot be left of itself"),
        ([BOWL | {"reference": {"part": 3}}], "it is not clear which structure is meant"),
        ([{"kind": "relation", "relation": "swapped", "objects": [1]}], "this takes 2 objects, not 1"),
        ([LINE | {"gap": 1e7}], "gap cannot be 10000000.0 m; legal values: 0 to 3 m"),
    ],
)  # fmt: skip
def test_who_spoke_hears_names_and_no_numbers_of_parts(parts: object, said: str) -> None:
    with pytest.raises(GoalError) as error:
        Goal.from_dict({"parts": parts})
    assert error.value.spoken(("bowl", "cup", "fork", "knife")) == said
