"""Goals of a language model in a scene: used where they are legal and say all that was said, else replaced by the grammar's."""

import pytest

from grounding.goal_network.writer import NetworkWriter
from grounding.goal_reading.reader import GoalReader
from grounding.goal_reading.written_references import UnusableGoalError
from grounding.goals.goal import Goal
from grounding.goals.parts import PartReference
from grounding.interpreter import Interpreter
from grounding.llm_goals.reader import KEPT, LLMGoalReader
from grounding.parse_result import Parse
from grounding.parsers.llm_reply import IllegalReplyError, LLMError
from grounding.references.attributes import ObjectAttributes, SceneObject
from grounding.spec import StructureSpec

TABLE = [
    SceneObject(name, ObjectAttributes((colour,)))
    for name, colour in (
        ("can", "red"),
        ("can 2", "blue"),
        ("can 3", "green"),
        ("cup", "red"),
        ("cup 2", "blue"),
        ("bowl", "white"),
    )
]
SPOKEN = "stack the cans on the left and put the bowl 5 cm behind the red cup"
PARTS = [
    {"kind": "structure", "shape": "tower", "objects": ["the cans"], "x_position": "left"},
    {"kind": "relation", "relation": "behind", "objects": ["the bowl"], "reference": ["the red cup"], "distance": 0.05},
]


class Saying:
    """A language model that gives the same answers to all texts, one after the other."""

    identity, knows_words = "a model", False

    def __init__(self, *answers):
        self.answers, self.asked = list(answers), []

    def parts(self, text, chunks):
        self.asked.append(text)
        answer = self.answers[min(len(self.asked), len(self.answers)) - 1]
        if isinstance(answer, Exception):
            raise answer
        return answer


def reader(writer):
    return LLMGoalReader(lambda: writer, GoalReader())


def test_words_become_the_objects_of_the_scene():
    reading = reader(Saying(PARTS)).read(SPOKEN, TABLE)
    assert reading.complete and reading.by_model and not reading.fallback
    tower, relation = reading.goal.parts
    assert (tower.shape, tower.objects, tower.x_position) == ("tower", (0, 1, 2), "left")
    assert (relation.relation, relation.objects, relation.reference, relation.distance) == ("behind", (5,), (3,), 0.05)


def test_without_a_scene_the_words_stand():
    reading = reader(Saying(PARTS)).read(SPOKEN)
    assert not reading.fallback and reading.goal.parts[0].objects == ("cans",)


def test_an_answer_is_kept_until_the_scene_is_known():
    model = Saying(PARTS)
    asking = reader(model)
    asking.read(SPOKEN)
    asking.read(SPOKEN, TABLE)
    assert model.asked == [SPOKEN]
    for number in range(KEPT + 5):
        asking.read(f"put mug {number} next to the bowl and swap the fork and the knife")
    assert len(asking._kept) == KEPT


def test_an_instruction_of_one_plain_structure_is_not_sent():
    model = Saying(PARTS)
    reader(model).read("put the cans in a small circle on the left", TABLE)
    assert model.asked == []


@pytest.mark.parametrize(
    ("answer", "why"),
    [
        (PARTS[:1], "leaves out"),
        ([PARTS[0], PARTS[1] | {"distance": 0.5}], "leaves out the length 5 cm"),
        ([PARTS[0], PARTS[1] | {"relation": "in front of"}], "leaves out 'behind'"),
        ([PARTS[0] | {"y_position": "top"}, PARTS[1]], "which nobody asked for"),
        ([PARTS[0], PARTS[1] | {"objects": ["the bowl behind"]}], "no noun phrase"),
        ([PARTS[0], PARTS[1], PARTS[1] | {"reference": {"part": 0}}], "once more"),
        ("impossible", "is 'impossible', where every word is understood"),
        (UnusableGoalError("has no end"), "has no end"),
        (IllegalReplyError("the language model 'm' gave no legal answer"), "gave no legal answer"),
    ],
)
def test_what_is_not_right_is_read_by_the_grammar_which_says_so(answer, why):
    reading = reader(Saying(answer)).read(SPOKEN, TABLE)
    expected = GoalReader().read(SPOKEN, TABLE)
    assert reading.goal == expected.goal and len(reading.goal.parts) == 2
    assert why in reading.fallback and not reading.by_model


def test_a_model_that_cannot_be_used_is_not_asked_again():
    model = Saying(LLMError("no server there"))
    asking = reader(model)
    for text in (SPOKEN, SPOKEN + " please", "swap the bowl and the red cup"):
        reading = asking.read(text, TABLE)
        assert "no server there" in reading.fallback and reading.goal.parts
    assert len(model.asked) == 1

    def missing():
        raise LLMError("not installed")

    asking = LLMGoalReader(missing, GoalReader())
    assert "not installed" in asking.read(SPOKEN, TABLE).fallback


def test_several_objects_that_fit_are_a_question_and_missing_ones_a_refusal():
    two = "put the cup behind the bowl and stack the cans"
    parts = [
        {"kind": "relation", "relation": "behind", "objects": ["the cup"], "reference": ["the bowl"]},
        {"kind": "structure", "shape": "tower", "objects": ["the cans"]},
    ]
    reading = reader(Saying(parts)).read(two, TABLE)
    assert reading.question is not None and set(reading.question.options) == {"cup", "cup 2"} and not reading.goal.parts
    yellow = "put the yellow cup behind the bowl and stack the cans"
    parts[0] = parts[0] | {"objects": ["the yellow cup"]}
    reading = reader(Saying(parts)).read(yellow, TABLE)
    assert not reading.complete and "yellow" in reading.problem


def test_what_the_objects_cannot_form_stays_refused():
    model = Saying([{"kind": "structure", "shape": "circle", "objects": ["the cups"], "radius": 0.1}])
    reading = reader(model).read("put the cups in a circle of radius 10 cm", TABLE)
    assert not reading.complete and reading.problem and model.asked == []
    assert reading.fallback.endswith("was not asked for a goal, because the grammar knows why it cannot be built")


def test_contradictions_are_refused():
    text = "put the bowl left of the red cup and the red cup left of the bowl"
    parts = [
        {"kind": "relation", "relation": "left of", "objects": ["the bowl"], "reference": ["the red cup"]},
        {"kind": "relation", "relation": "left of", "objects": ["the red cup"], "reference": ["the bowl"]},
    ]
    reading = reader(Saying(parts)).read(text, TABLE)
    assert not reading.complete and "contradicts itself" in reading.problem


UNKNOWN = "put the bowl zorp behind the red cup and stack the cans"
KNOWN_PARTS = [
    {"kind": "relation", "relation": "behind", "objects": ["the bowl"], "reference": ["the red cup"]},
    {"kind": "structure", "shape": "tower", "objects": ["the cans"]},
]


def test_unknown_words_are_left_only_to_models_that_know_words_and_then_it_is_said():
    small = reader(Saying(KNOWN_PARTS)).read(UNKNOWN, TABLE)
    assert not small.complete and "the words 'zorp' are unknown" in small.fallback and "zorp" in small.residue
    large = Saying(KNOWN_PARTS)
    large.knows_words = True
    reading = reader(large).read(UNKNOWN, TABLE)
    assert reading.complete and any("zorp" in note for note in reading.notes)


def test_exceptions_groups_and_references_to_structures():
    text = "put everything except the bowl in a ring around the bowl"
    parts = [
        {"kind": "structure", "shape": "circle", "objects": ["everything except the bowl"], "around": ["the bowl"]}
    ]
    reading = reader(Saying(parts)).read(text, TABLE)
    assert not reading.fallback and reading.goal.parts[0].objects == (0, 1, 2, 3, 4)
    text = "line up the cans and put the bowl behind them"
    parts = [
        {"kind": "structure", "shape": "line", "objects": ["the cans"]},
        {"kind": "relation", "relation": "behind", "objects": ["the bowl"], "reference": {"part": 0}},
    ]
    reading = reader(Saying(parts)).read(text, TABLE)
    assert not reading.fallback and reading.goal.parts[1].reference == PartReference(0)


def test_the_remaining_ones_are_those_that_no_other_part_names():
    text = "swap the red can with the red cup and then stack the remaining cans"
    parts = [
        {"kind": "relation", "relation": "swapped", "objects": ["the red can", "the red cup"]},
        {"kind": "structure", "shape": "tower", "objects": ["the remaining cans"]},
    ]
    reading = reader(Saying(parts)).read(text, TABLE)
    assert not reading.fallback and reading.goal.parts[1].objects == (1, 2)


def test_a_place_of_several_objects_is_a_structure_and_of_one_a_relation():
    text = "the cups go on the left, and the bowl goes on the right"
    parts = [
        {"kind": "relation", "relation": "at", "objects": ["the cups"], "x_position": "left"},
        {"kind": "structure", "shape": None, "objects": ["the bowl"], "x_position": "right"},
    ]
    reading = reader(Saying(parts)).read(text, TABLE)
    assert not reading.fallback, reading.fallback
    assert [getattr(part, "relation", "structure") for part in reading.goal.parts] == ["structure", "at"]


class FiveSlots:
    name = "llm"

    def parse(self, text):
        return Parse(text, StructureSpec(), "llm", "refused", "asks for more than one structure")

    def parse_batch(self, texts):
        return [self.parse(text) for text in texts]


def test_an_interpretation_has_the_models_goal_and_its_fallback():
    interpreter = Interpreter(FiveSlots, goal_reader=lambda grammar: LLMGoalReader(lambda: Saying(PARTS), grammar))
    found = interpreter.interpret(SPOKEN, TABLE)
    assert found.status == "ok" and found.goal.parts[0].objects == (0, 1, 2) and found.fallback == ""
    assert found.by_model
    interpreter = Interpreter(FiveSlots, goal_reader=lambda grammar: LLMGoalReader(lambda: Saying(PARTS[:1]), grammar))
    found = interpreter.interpret(SPOKEN, TABLE)
    assert found.status == "ok" and len(found.goal.parts) == 2 and "leaves out" in found.fallback
    assert found.fallback.endswith("; the grammar's reader read this") and not found.by_model
    assert found.to_dict()["fallback"] == found.fallback


def test_the_opposite_viewpoint_turns_the_goal():
    made = Interpreter(
        FiveSlots,
        viewpoint="opposite",
        goal_reader=lambda grammar: LLMGoalReader(lambda: Saying(PARTS), grammar, opposite=True),
    )
    found = made.interpret(SPOKEN, TABLE)
    assert found.goal.parts[0].x_position == "right" and found.goal.parts[1].relation == "in front of"
    assert isinstance(found.goal, Goal)


@pytest.fixture(scope="module")
def default(parser, encoder):
    return Interpreter(lambda: parser, encoder=encoder, network=lambda: NetworkWriter.from_pretrained(encoder))


def with_model(default, encoder, *answers):
    """Make an interpreter whose language model gives these answers, with the default parser for the rest."""
    network = lambda: NetworkWriter.from_pretrained(encoder)  # noqa: E731
    reading = lambda grammar: LLMGoalReader(lambda: Saying(*answers), grammar)  # noqa: E731
    return Interpreter(FiveSlots, encoder=encoder, goal_reader=reading, network=network, default=default)


SPOKEN_FREELY = "wud ya kindly plonk the cans in a pile by the left edge, and the bowl goes behind the red cup, guv"
FEW_WORDS = "put the bowl zorp behind the red cup and stack the cans on the left"


@pytest.mark.parametrize(
    "text",
    [
        FEW_WORDS,
        SPOKEN_FREELY,
        "put the cup behind the bowl and stack the cans",
        "stack the cans and pour the water into the bowl",
        "stack the cans and put the bowl at the edge",
    ],
)
@pytest.mark.parametrize("objects", [None, TABLE])
def test_what_the_model_does_not_read_is_read_exactly_as_by_the_default_parser(default, encoder, text, objects):
    found = with_model(default, encoder, PARTS).interpret(text, objects)
    expected = default.interpret(text, objects)
    assert (found.status, found.goal, found.question) == (expected.status, expected.goal, expected.question)
    assert found.message == expected.message and found.parse == expected.parse
    assert found.fallback.startswith("the language model") and found.fallback.endswith("; the embedding parser read this")


def test_the_network_reads_what_the_grammar_alone_cannot(default, encoder):
    grammar = Interpreter(
        FiveSlots, encoder=encoder, goal_reader=lambda grammar: LLMGoalReader(lambda: Saying(PARTS), grammar)
    ).interpret(FEW_WORDS, TABLE)
    assert grammar.status == "refused" and grammar.fallback.endswith("; the grammar's reader read this")
    found = with_model(default, encoder, PARTS).interpret(FEW_WORDS, TABLE)
    assert found.status == "ok" and [part.objects for part in found.goal.parts] == [(5,), (0, 1, 2)]
    assert "the words 'zorp' are unknown" in found.fallback and "read without knowing 'zorp'" in found.message
    strict = with_model(default, encoder, PARTS).interpret(FEW_WORDS, TABLE, strictly=True)
    assert strict.status == "refused"


def test_a_scene_that_is_known_later_is_read_by_the_model_again(default, encoder):
    known = with_model(default, encoder, PARTS[:1], PARTS).interpret(SPOKEN)
    assert not known.by_model and "leaves out" in known.fallback  # the answer without a scene is kept
    found = known.among(TABLE)
    assert found.fallback == known.fallback and len(found.goal.parts) == 2
    found = with_model(default, encoder, PARTS).interpret(SPOKEN).among(TABLE)
    assert found.by_model and not found.fallback and found.parse.parser == "llm"


def test_a_models_doubt_about_objects_that_the_grammar_finds_is_no_question(default, encoder):
    doubtful = [PARTS[0], PARTS[1] | {"objects": ["the cup"]}]
    text = "stack the cans on the left and put the bowl 5 cm behind the red cup"
    found = with_model(default, encoder, doubtful).interpret(text, TABLE)
    assert found.status == "ok" and found.goal == default.interpret(text, TABLE).goal


def test_the_network_reads_plain_wishes_that_the_five_slots_refuse(default, encoder):
    text = "wud ya kindly plonk the cans in a triangle, guv"
    found = with_model(default, encoder, PARTS).interpret(text, TABLE)
    assert found.status == "ok" and found.goal.parts[0].shape == "triangle"
    assert found.fallback.endswith("read this") and not found.by_model


def test_a_network_that_is_certain_of_another_goal_counts_as_it_does_against_the_grammar(default, encoder):
    text = "put the bowl between the red cup and the blue cup, and stack the cans"
    names = {"objects": ["the red cup"], "reference": ["the bowl", "the blue cup"]}
    between = {"kind": "relation", "relation": "between"} | names
    tower = {"kind": "structure", "shape": "tower", "objects": ["the cans"]}
    assert reader(Saying([between, tower])).read(text, TABLE).by_model  # the checks do not see it
    found = with_model(default, encoder, [between, tower]).interpret(text, TABLE)
    assert found.goal == default.interpret(text, TABLE).goal and not found.by_model
    assert found.fallback == (
        "the language model's goal is not used, because the network is certain of another one; the goal network read this"
    )
