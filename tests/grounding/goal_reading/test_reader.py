"""Instructions are read into goals: the parts, their objects, and what is refused or asked about."""

import json
import random
import time
from importlib import resources

import pytest

from grounding.goal_reading.reader import GoalReader
from grounding.goals.comparison import compare_goals
from grounding.goals.goal import Goal
from grounding.interpreter import Interpreter
from grounding.references.attributes import ObjectAttributes, SceneObject

DATA = resources.files("grounding") / "benchmark_data"
SCENES = {
    name: [
        SceneObject(each["name"], ObjectAttributes(tuple(each["colors"]), tuple(each["size"]), tuple(each["position"])))
        for each in objects
    ]
    for name, objects in json.loads((DATA / "goal_scenes.json").read_text()).items()
}
ROWS = [json.loads(line) for line in (DATA / "goals_development.jsonl").read_text().splitlines()]
# As written in the development set, with what is right; none may be lost again.
LEAST_EXACT = 0.97


@pytest.fixture(scope="module")
def interpreter(parser, encoder):
    return Interpreter(lambda: parser, encoder=encoder)


def is_right(interpretation, row):
    if row["status"] != "ok":
        return interpretation.status == row["status"] and not interpretation.goal.parts
    scene = SCENES[row["scene"]]
    goals = [Goal.from_dict(goal) for goal in row["goals"]]
    return interpretation.status == "ok" and any(
        compare_goals(interpretation.goal, goal, len(scene)).exact for goal in goals
    )


def test_the_development_goals(interpreter):
    wrong = [
        row["text"] for row in ROWS if not is_right(interpreter.interpret(row["text"], SCENES.get(row["scene"])), row)
    ]
    assert len(ROWS) >= 150 and len(wrong) <= (1 - LEAST_EXACT) * len(ROWS), wrong


def part(text, scene=None, number=0):
    reading = GoalReader().read(text, SCENES[scene] if scene else None)
    assert reading.complete, (reading.problem, reading.residue, reading.question)
    return {key: value for key, value in reading.goal.parts[number].to_dict().items() if value is not None}


@pytest.mark.parametrize(
    ("said", "metres"),
    [
        ("10 cm", 0.1), ("100mm", 0.1), ("half a metre", 0.5), ("two inches", 0.0508), ("a foot and a half", 0.4572),
        ("a couple of centimetres", 0.02), ("2 1/2 inches", 0.0635), ('4"', 0.1016), ("1 foot 6 inches", 0.4572),
        ("two and a half cm", 0.025), ("0,05 m", 0.05), ("twenty five centimeters", 0.25), ("½ m", 0.5),
    ],
)  # fmt: skip
def test_lengths(said, metres):
    assert part(f"move the mug {said} to the left")["distance"] == pytest.approx(metres)


@pytest.mark.parametrize(
    "text",
    [
        "put the mug next to the bowl and frobnicate the can",
        "stack the cups and wash the dishes",
        "put the mug 10 cm left of the bowl at dawn sideways",
    ],
)
def test_what_is_not_understood_is_never_dropped(interpreter, text):
    found = interpreter.interpret(text)
    assert found.status == "refused" and not found.goal.parts


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("put the bowl left of the plate and the plate left of the bowl", "contradicts itself"),
        ("put the cups in a circle and stack the cups", "object"),
        ("move the mug -5 cm to the left", "-0.05"),
        ("circle of radius 1e9 cm", "radius"),
    ],
)
def test_contradictions_and_impossible_values_are_named(interpreter, text, words):
    found = interpreter.interpret(text)
    assert found.status == "refused" and words in found.message and "\n" not in found.message


def test_the_opposite_viewpoint_turns_places_and_choices(parser, encoder):
    other = Interpreter(lambda: parser, viewpoint="opposite", encoder=encoder)
    found = other.interpret("put the leftmost can to the left of the red cup", SCENES["cans and cups"]).goal.parts[0]
    assert (found.objects, found.relation, found.reference) == ((1,), "right of", (3,))


def test_objects_are_resolved_later(interpreter):
    later = interpreter.interpret("swap the blue can and the white cup").among(SCENES["cans and cups"])
    assert later.goal.parts[0].objects == (1, 5) and later.selection.indices == (1, 5)


def test_a_library_offers_any_of_several(interpreter):
    library = [SceneObject(name) for name in ("mug", "mug", "bowl", "can")]
    found = interpreter.interpret("put the mug next to the bowl and swap the can and the bowl").among(
        library, catalogue=True
    )
    assert found.status == "ok" and found.selection.indices == (0, 2, 3)


def test_odd_instructions_get_a_short_answer():
    generator = random.Random(5)
    words = (
        "put stack line the a red mug bowl cups cans left right of to on in next between and , . ; no wait not except it them 5 cm -5 "
        "1e9 \" ' by row grid 3 x those rest second from around along edge corner swap tallest at with then inch 1/2 each other"
    ).split()
    texts = [" ".join(generator.choices(words, k=generator.randint(1, 40))) for _ in range(300)]
    texts += [
        "a" * 1900,
        "the red " * 240,
        "left of " * 240,
        "( " * 900,
        "½ " * 500,
        "no wait " * 200,
        "; ".join(["put the mug left"] * 40),
    ]
    reader = GoalReader()
    for number, text in enumerate(texts):
        started = time.process_time()  # of this process alone: the machine may be busy
        reading = reader.read(text, SCENES["breakfast"] if number % 2 else None)
        assert time.process_time() - started < 1.0, text
        assert "\n" not in reading.problem and reading.complete == (bool(reading.goal.parts) and not reading.residue)


def test_what_stands_in_for_a_list_adds_nothing():
    assert part("put the cups, all of them, in a row", "cans and cups")["objects"] == [3, 4, 5, 6]
    found = part("the box first, then the bottle, then the jar, all in a row", "tall and short")
    assert found["objects"] == [4, 0, 3] and found["order"]["by"] == "listed"


def test_a_pronoun_means_the_same_for_what_stands_on_its_other_side(interpreter):
    """The knife is right of the plate, and not of the fork."""
    found = interpreter.interpret(
        "put the plate in the middle, the fork left of it and the knife to its right", ["fork", "plate", "knife"]
    )
    relations = [(part.objects, part.relation, part.reference) for part in found.goal.relations[1:]]
    assert relations == [((0,), "left of", (1,)), ((2,), "right of", (1,))]
