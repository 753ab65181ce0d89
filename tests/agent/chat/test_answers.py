"""Answers say what the table really holds."""

from dataclasses import replace

import numpy as np
import pytest

from agent import events
from agent.chat.answers import answer
from agent.chat.knowledge import Knowledge
from agent.chat.state import Situation
from agent.chat.table_facts import matching_facts, object_facts, place_in_words
from grounding.dialogue.acts import acts_of
from grounding.dialogue.state import Dialogue
from structdiffusion.observation import ObjectCloud, Scene

TABLE = (0.18, 0.72, -0.45, 0.45)
PICTURE = np.full((8, 8, 3), 230, np.uint8)
COLORS = {"red": (200, 20, 20), "blue": (20, 40, 200), "yellow": (220, 200, 30)}
# name, noun, colour, (x, y), sides
THINGS = (
    ("cup 1", "cup", "red", (0.25, 0.30), (0.08, 0.08, 0.09)),
    ("cup 2", "cup", "blue", (0.45, 0.00), (0.08, 0.08, 0.07)),
    ("box", "box", "red", (0.65, -0.30), (0.16, 0.10, 0.20)),
    ("banana", "banana", "yellow", (0.32, -0.21), (0.18, 0.04, 0.04)),
)


def cloud(name, noun, color, at, sides, bottom=0.0) -> ObjectCloud:
    rng = np.random.default_rng(0)
    points = (rng.uniform(-0.5, 0.5, (3000, 3)) + (0, 0, 0.5)) * sides + (*at, bottom)
    colors = None if color is None else np.tile(np.array(COLORS[color], np.uint8), (3000, 1))
    return ObjectCloud(name, noun, points.astype(np.float32), colors, bottom)


def seen(clouds) -> events.Perceived:
    scene = Scene(tuple(clouds), world_from_camera=np.eye(4), color=PICTURE)
    objects = tuple(
        events.SeenObject(
            one.name, one.category, True, tuple(one.centroid.tolist()), len(one.points), display_name=one.name
        )
        for one in clouds
    )
    return events.Perceived(objects, TABLE, 0.0, scene=scene)


@pytest.fixture
def known() -> Knowledge:
    clouds = [cloud(*thing) for thing in THINGS]
    return Knowledge(seen(clouds), Situation(Dialogue(), tuple(one.name for one in clouds), {}))


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("where is the banana", "The banana is on the right, near you: 32 cm ahead, 21 cm to the right."),
        ("where are the cups", "Cup 1 is on the left, near you: 25 cm ahead, 30 cm to the left.\n"
                               "Cup 2 is in the middle of the table: 45 cm straight ahead."),
        ("where is the second cup", "Cup 2 is in the middle of the table: 45 cm straight ahead."),
        ("where is the blue cup?", "Cup 2 is in the middle of the table: 45 cm straight ahead."),
        ("where's cup 1", "Cup 1 is on the left, near you: 25 cm ahead, 30 cm to the left."),
        ("where is the fork", "There is no fork on the table. There are: 2 cups, a box and a banana."),
        ("is there a yellow cup", "No. There is no yellow cup on the table. There are: 2 cups, a box and a banana."),
        ("is there a mouse on the table", "No. There is no mouse on the table. There are: 2 cups, a box and a banana."),
        ("are there any forks", "No. There are no forks on the table. There are: 2 cups, a box and a banana."),
        ("is there a banana?", "Yes: the banana is on the right, near you: 32 cm ahead, 21 cm to the right."),
        ("how many cups are there", "There are 2 cups: cup 1 (red) and cup 2 (blue)."),
        ("how many red things do you see", "There are 2 objects: cup 1 (red) and box (red)."),
        ("how many boxes are there", "There is 1 box: box (red)."),
        ("how many wooden cups are there", "I cannot tell what is “wooden”. There are 2 cups: cup 1 (red) and cup 2 "
                                           "(blue)."),
        ("what colour is the box", "The box is red."),
        ("is the banana yellow or blue?", "Yes. The banana is yellow."),
        ("is the box blue?", "No. The box is red."),
        ("which one is the tallest", "The tallest is the box, 20 cm tall. Next is cup 1, 9 cm tall."),
        ("which cup is the tallest?", "The tallest is cup 1, 9 cm tall. Next is cup 2, 7 cm tall."),
        ("what is the flattest thing", "The flattest is the banana, 4 cm tall. Next is cup 2, 7 cm tall."),
        ("which one is nearest to you", "The nearest is the banana, 38 cm from the arm. Next is cup 1, 39 cm from the "
                                        "arm."),
        ("how big is the box", "The box is about 20 cm tall and 16 by 10 cm across."),
        ("where is the circle", "I have built nothing that still stands on the table. Say what to build."),
        ("why that one", "There is no proposal now, so there is no choice to explain. Say what to build."),
        ("what did i ask for", "You have not asked for anything yet. Say what to build."),
    ],
)  # fmt: skip
def test_answers(known, line, said):
    assert answer(acts_of(line), known) == said


def test_what_is_seen_is_listed_with_colour_and_place(known):
    lines = answer(acts_of("what do you see"), replace(known, held="banana", fallen=("plate",))).splitlines()
    assert lines[0] == "4 objects stand on the table:"
    assert lines[4].split() == "banana yellow on the right, near you: 32 cm ahead, 21 cm to the right".split()
    assert lines[5:] == ["The banana is in the hand.", "Fallen off the table: plate."]
    assert answer(acts_of("where is the plate"), replace(known, fallen=("plate",))) == "The plate fell off the table."


def test_from_across_the_table_left_is_right_and_near_is_far(known):
    opposite = replace(known, situation=replace(known.situation, viewpoint="opposite"))
    assert answer(acts_of("where is the banana"), opposite) == (
        "The banana is on the left, far from you: 32 cm ahead of the arm, 21 cm to its right."
    )
    assert answer(acts_of("what is the leftmost thing"), known).startswith("The leftmost is cup 1,")
    assert answer(acts_of("what is the leftmost thing"), opposite).startswith("The leftmost is the box,")


def test_what_stands_on_something_is_said_to():
    clouds = [cloud(*THINGS[2]), cloud("cup", "cup", "blue", (0.65, -0.30), (0.08, 0.08, 0.09), 0.2)]
    (box, cup) = object_facts(seen(clouds))
    assert cup.where.startswith("on the box, on the right, far from you") and box.on == ""
    assert cup.sides[2] == pytest.approx(0.09, abs=0.002)


def test_without_colours_none_is_claimed():
    clouds = [cloud(name, noun, None, at, sides) for name, noun, _, at, sides in THINGS]
    known = Knowledge(seen(clouds), Situation(Dialogue(), (), {}))
    assert answer(acts_of("what colour is the box"), known) == "The color of the box was not seen."
    assert answer(acts_of("how many cups"), known) == "There are 2 cups: cup 1 and cup 2."
    assert answer(acts_of("is there a red cup"), known).startswith("I cannot tell what is “red”. Yes: cup 1")


def test_words_of_a_recording_are_kept(known):
    objects = tuple(replace(one, display_name=f"{one.name}, green, tall") for one in known.seen.objects)
    facts = object_facts(replace(known.seen, objects=objects))
    assert {fact.color for fact in facts} == {"green"} and facts[0].display_name.startswith("cup 1, green, tall")


def test_an_empty_table():
    known = Knowledge(seen([]), Situation(Dialogue(), (), {}))
    for line in (
        "what do you see",
        "where is the cup",
        "is there a cup",
        "how many things are there",
        "which one is the tallest",
    ):
        assert "Nothing stands on the table." in answer(acts_of(line), known)


def test_words_that_mean_no_object_mean_none(known):
    for about in ("moon", "left", "love"):
        assert matching_facts(about, known.facts) == []
    assert [fact.name for fact in matching_facts("red ones", known.facts)] == ["cup 1", "box"]


@pytest.mark.parametrize(
    ("position", "words"),
    [
        ((0.2, 0.4), "on the left, near you"), ((0.45, 0.0), "in the middle of the table"),
        ((0.7, 0.0), "in the center, far from you"), ((0.45, -0.4), "on the right, halfway back"),
        ((0.9, -0.9), "on the right, far from you"),
    ],
)  # fmt: skip
def test_places(position, words):
    assert place_in_words(position, TABLE) == words


def test_a_proposal_is_explained(conversation, told):
    conversation.say("put the cups in a small circle on the left")
    known = conversation._known()
    why = answer(acts_of("why that one"), known)
    candidates = conversation.situation.proposal.proposed.candidates
    count, total = len(candidates), candidates[0].scores["total"]
    assert why.startswith(f"Candidate 1 is the best of {count}: its score, {total:.2f}, is the product of")
    assert answer(acts_of("why candidate 99"), known).startswith(f"There is no candidate 99; there are 1 to {count}.")
    plan = answer(acts_of("what are you going to do"), known).splitlines()
    assert plan[0] == "I propose candidate 1, a small circle of cup 1, cup 2 and cup 3 (left):" and len(plan) == 5
    assert plan[1].startswith("  cup 1 goes on the left, ")
    where = answer(acts_of("where will cup 2 go"), known).splitlines()
    assert len(where) == 3 and where[1].startswith("  cup 2 goes ")
    assert "A proposal stands: “y” builds it" in answer(acts_of("hello"), known)
