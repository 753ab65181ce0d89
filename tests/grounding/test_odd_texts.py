"""Whatever is said is read, asked about or refused: no text is a defect of the program."""

from dataclasses import replace

import pytest

from grounding.dialogue.state import STATUSES, Dialogue
from grounding.dialogue.turns import say
from grounding.goal_benchmark.rows import goal_scenes
from grounding.resolve.attributes import SceneObject
from grounding.resolve.goal_phrases import GoalPhrases
from grounding.resolve.phrase import PhraseGroup
from grounding.resolve.referents import Referents
from tests.grounding.odd_texts import OddTexts

ROLES = ("structure", "objects", "reference", "around", "kept")


def some_objects(texts: OddTexts) -> list[SceneObject]:
    """Return the objects of a scene of the benchmark: as they are, or with attributes that are not known."""
    scene = list(texts.random.choice(list(goal_scenes().values())))
    unknown = texts.random.choice(({}, {}, {"position": None}, {"size": None}, {"colors": ()}))
    kept = texts.random.choice((0.0, 0.5, 1.0))
    named = texts.random.random() < 0.3
    return [
        each
        if texts.random.random() < kept
        else SceneObject(each.name, None if named else replace(each.attributes, **unknown))
        for each in scene
    ]


def test_phrases_for_objects(encoder):
    texts = OddTexts(3)
    for _ in range(150):
        objects, whole = some_objects(texts), texts.one()
        groups = [PhraseGroup((texts.phrase(),), texts.random.choice(ROLES), part=n) for n in range(3)]
        there = Referents(objects, encoder, opposite=texts.random.random() < 0.3)
        assert len(GoalPhrases(there, whole).resolve(groups)) == 3


def test_instructions(interpreter):
    texts = OddTexts(4)
    for _ in range(15):
        objects = texts.random.choice((None, some_objects(texts)))
        assert interpreter.interpret(texts.one(), objects).status in ("ok", "ask", "refused")


def test_corrections(interpreter):
    texts = OddTexts(5)
    for _ in range(4):
        objects = some_objects(texts)
        state, _ = say(Dialogue(), texts.instruction(), interpreter, objects)
        for _ in range(3):
            state, said = say(state, texts.one(), interpreter, objects)
            assert said.status in STATUSES and (said.status == "ok" or said.goal == state.goal)


@pytest.mark.parametrize(
    "text",
    ["stack the left bowl on the right bowl", "put the bowls in a circle with the right one",
     "put the bowl behind the leftmost cup on its right", "line up the two leftmost cups"],
)  # fmt: skip
def test_words_of_place_where_no_place_is_known(interpreter, text):
    read = interpreter.interpret(text, ["bowl", "bowl", "cup", "cup", "cup"])
    assert read.status in ("refused", "ask")


def phrases(encoder, said: str, text: str, *names: str):
    objects = [SceneObject(name) for name in names]
    return GoalPhrases(Referents(objects, encoder), text).resolve([PhraseGroup((said,), "structure")])[0]


def test_what_contrasts_with_nothing_is_not_found(encoder):
    said = "all cups bar the one that is"
    assert isinstance(phrases(encoder, said, said, "cup", "cup 2", "cup 3", "bowl"), Exception)


def test_a_comparison_that_stands_for_itself_is_not_found(encoder):
    text = "of the two white objects, the flatter one goes in the middle and the other one is placed on it"
    assert isinstance(phrases(encoder, "it", text, "cube", "cube 2", "brick"), Exception)
