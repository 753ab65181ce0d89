"""A goal in the words of the goal network, and the network's goal after a correction."""

from dataclasses import replace

import pytest

from grounding.goal_benchmark.rows import goal_scenes
from grounding.goal_network.beam_search import WrittenGoal
from grounding.goal_network.goal_rendition import AfterGoal, object_phrases, rendition_of
from grounding.goal_network.vocabulary import END, KEYWORD, NUMBER_OF, START, Action, keyword
from grounding.goals.goal import Goal
from grounding.goals.parts import Order, PartReference, RelationPart, StructurePart
from grounding.propose.network import NetworkProposer
from grounding.propose.resolution import resolved
from grounding.resolve.tokens import words_of

OBJECTS = goal_scenes()["cans and cups"]
TOWER = StructurePart("tower", x_position="left", objects=(0, 1, 2))


@pytest.mark.parametrize(
    ("indices", "said"),
    [
        ((0, 1, 2), ["the cans"]),
        ((0,), ["the red can"]),
        ((1, 3), ["the blue can", "the red cup"]),
        ((3, 4, 5, 6, 2), ["the cups", "the green can"]),
    ],
)
def test_phrases(indices, said):
    found = object_phrases(indices, OBJECTS)
    assert [one.words for one in found] == said
    assert sorted(index for one in found for index in one.objects) == sorted(indices)


def test_phrases_of_a_colour():
    blocks = goal_scenes()["blocks"]
    assert [one.words for one in object_phrases((0, 1, 8), blocks)] == ["the red blocks", "the orange block"]
    assert [one.words for one in object_phrases((2,), blocks)] == ["block 3"]


def test_rendition():
    line = StructurePart("line", objects=(4, 3), order=Order("listed", None, "left"), gap=0.03)
    place = RelationPart("behind", PartReference(1), PartReference(0), distance=0.1)
    found = rendition_of(Goal((TOWER, line, place)), OBJECTS)
    assert found.label == (
        "tower of the cans , left ; line of the yellow cup + the red cup , order listed from left , gap 3 cm ; "
        "place of structure 2 , behind structure 1 , distance 10 cm"
    )
    words = words_of(found.text)
    phrases = [" ".join(words[first : last + 1]) for first, last in found.phrases]
    assert phrases == ["the cans", "the yellow cup", "the red cup"]


class Writes:
    """A network that copies the goal's first phrase and a phrase of the sentence into a tower."""

    def likeliest(self, text, count, objects=None, answers=True):
        words = words_of(text)
        new, old = len(words) - 2, words.index("cans")
        copied = [Action(START, old - 1), Action(END, old), Action(START, new), Action(END, new + 1)]
        first = WrittenGoal(tuple(words), (Action(KEYWORD, NUMBER_OF["tower of"]), *copied), 0.9)
        return [first, replace(first, actions=(keyword("nothing"),), certainty=0.03)]


def test_a_proposal_joins_objects_of_the_goal_with_named_ones():
    goal, text = Goal((TOWER,)), "on top put red cup"
    first, second = NetworkProposer(Writes).propose(text, OBJECTS, goal)
    assert str(resolved(first, text, OBJECTS, None).goal) == "tower of 0, 1, 2, 3"
    assert first.certainty == 0.9 and (second.answer, second.certainty) == ("nothing", 0.03)


def test_marks_stand_for_phrases_of_the_goal_alone():
    found = rendition_of(Goal((TOWER,)), OBJECTS)
    words = tuple(words_of(f"{found.text} the cans"))
    both = [(words.index("cans") - 1, words.index("cans")), (len(words) - 2, len(words) - 1)]
    actions = tuple(Action(kind, at) for pair in both for kind, at in zip((START, END), pair, strict=True))
    after = AfterGoal(words, actions, 1.0, found)
    assert found.known[after.phrase(0)] == (0, 1, 2) and after.phrase(2) == "the cans"
