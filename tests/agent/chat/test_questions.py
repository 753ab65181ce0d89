"""Questions about several objects, and about what was and will be built, as strangers ask them."""

import re
from dataclasses import replace

import numpy as np
import pytest

from agent import events
from agent.chat.answers import answer
from agent.chat.commands import command_of
from agent.chat.knowledge import Knowledge
from agent.chat.state import Build, Situation
from grounding.dialogue.acts import acts_of
from grounding.dialogue.state import Dialogue
from structdiffusion.observation import ObjectCloud, Scene
from tests.grounding.goal_in_words import goal_of_words

TABLE = (0.18, 0.72, -0.45, 0.45)
COLORS = {
    "red": (200, 20, 20), "blue": (20, 40, 200), "yellow": (220, 200, 30), "white": (250, 250, 250),
    "orange": (240, 130, 20)
}  # fmt: skip
# name, noun, colour, (x, y), sides, z of its bottom
THINGS = (
    ("cup 1", "cup", "red", (0.25, 0.30), (0.08, 0.08, 0.09), 0.0),
    ("cup 2", "cup", "blue", (0.45, 0.00), (0.08, 0.08, 0.07), 0.0),
    ("box", "box", "red", (0.65, -0.30), (0.16, 0.10, 0.20), 0.0),
    ("banana", "banana", "yellow", (0.32, -0.21), (0.18, 0.04, 0.04), 0.0),
    ("plate", "plate", "white", (0.60, 0.25), (0.20, 0.20, 0.02), 0.0),
    ("orange", "orange", "orange", (0.60, 0.25), (0.07, 0.07, 0.07), 0.02),
    ("bowl", "bowl", "red", (0.45, -0.38), (0.14, 0.14, 0.06), 0.0),
)


def cloud(name, noun, color, at, sides, bottom) -> ObjectCloud:
    points = (np.random.default_rng(0).uniform(-0.5, 0.5, (3000, 3)) + (0, 0, 0.5)) * sides + (*at, bottom)
    return ObjectCloud(
        name, noun, points.astype(np.float32), np.tile(np.array(COLORS[color], np.uint8), (3000, 1)), bottom
    )


@pytest.fixture(scope="module")
def known() -> Knowledge:
    clouds = [cloud(*thing) for thing in THINGS]
    scene = Scene(tuple(clouds), world_from_camera=np.eye(4), color=np.full((8, 8, 3), 230, np.uint8))
    objects = tuple(
        events.SeenObject(
            one.name, one.category, True, tuple(one.centroid.tolist()), len(one.points), display_name=one.name
        )
        for one in clouds
    )
    seen = events.Perceived(objects, TABLE, 0.0, scene=scene)
    return Knowledge(seen, Situation(Dialogue(), tuple(one.name for one in clouds), {}))


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("what's on the plate?", "On the plate: the orange."),
        ("what is on the bowl", "Nothing stands on the bowl."),
        ("is anything on the plate?", "On the plate: the orange."),
        ("what does the plate hold?", "On the plate: the orange."),
        ("what is under the orange", "Under the orange: the plate."),
        ("what is the orange standing on?", "The orange stands on the plate."),
        ("what is the banana lying on", "The banana stands on the table."),
        ("is the plate empty?", "No: the orange is on the plate."),
        ("is the bowl empty?", "Yes: nothing is on the bowl."),
        ("which things stand in front of the plate?", "In front of the plate: cup 1, 21 cm away."),
        ("what is next to the banana?", "Nothing stands next to the banana. The nearest is the bowl, 8 cm away."),
        ("what stands left of the box?", "To the left of the box: cup 2, 23 cm away, the plate, 40 cm away, the "
                                      "orange, 47 cm away and cup 1, 58 cm away."),
        ("is the orange on the plate", "Yes: the orange is on the plate, on the left, far from you: 60 cm ahead, 25 cm "
                                       "to the left."),
        ("is the banana left of the box?", "No: the banana is in front of the box, 16 cm away."),
        ("what is on the left?", "On the left: cup 1, the plate and the orange."),
        ("is the banana on the right", "Yes: the banana is on the right, near you: 32 cm ahead, 21 cm to the right."),
        ("where is the thing on the plate", "The orange is on the plate, on the left, far from you: 60 cm ahead, 25 cm "
                                            "to the left."),
        ("how many cups are on the plate", "No cups on the plate was seen."),
        ("how many things are on the right?", "There are 3 objects: box (red), banana (yellow) and bowl (red)."),
        ("is there a cup on the plate?", "No. No cup on the plate was seen."),
        ("what is on the unicorn", "There is no unicorn on the table. There are: 2 cups, a box, a banana, a plate, an "
                                   "orange and a bowl."),
        ("how far is the banana from the box?", "Between the banana and the box there are 16 cm; their centers are 34 "
                                                "cm apart."),
        ("is the box taller than the banana?", "Yes: the box is 20 cm tall; the banana is 4 cm tall."),
        ("is cup 1 smaller than cup 2", "No: cup 1 is about 9 cm tall and 8 by 8 cm across; cup 2 is about 7 cm tall "
                                        "and 8 by 8 cm across."),
        ("which is taller, the banana or the box?", "The box: the banana is 4 cm tall; the box is 20 cm tall."),
        ("which cup is taller?", "The taller is cup 1, 9 cm tall. Next is cup 2, 7 cm tall."),
        ("how tall is the tallest thing", "The tallest is the box, 20 cm tall. Next is cup 1, 9 cm tall."),
        ("are the cups the same height?", "No: cup 1 is 9 cm tall; cup 2 is 7 cm tall."),
        ("are the cups the same colour?", "No: cup 1 is red; cup 2 is blue."),
        ("is there a heart?", "Yes: I can build a heart."),
        ("is there a pentagon?", "Yes: I can build a pentagon."),
        ("is there a giraffe?", "No. There is no giraffe on the table."),
        ("do you know circles?", "Yes: I can build a circle."),
        ("can you reach the banana?", "The arm may be able to take the banana: it stands 38 cm from the arm, and "
                                      "nothing rules it out."),
        ("what have you built so far?", "I have built nothing that still stands on the table."),
        ("what's left to do?", "Nothing is left to do: you have not asked for anything yet."),
    ],
)  # fmt: skip
def test_answers(known, line, said):
    assert answer(acts_of(line), known).startswith(said)


def test_from_across_the_table_left_is_right(known):
    opposite = replace(known, situation=replace(known.situation, viewpoint="opposite"))
    assert answer(acts_of("what stands right of the box"), opposite).startswith(
        "To the right of the box: cup 2, 23 cm away"
    )
    assert answer(acts_of("is the banana behind the box"), opposite).startswith("Yes: the banana is behind the box")


def test_what_the_arm_cannot_take_is_said(known):
    answered = answer(acts_of("can you pick up the bowl?"), replace(known, out_of_reach=("bowl",)))
    assert answered.startswith("No: the arm cannot take the bowl.")


def test_a_support_that_was_not_seen_is_not_asserted(known):
    answered = answer(acts_of("what is the orange standing on?"), replace(known, supposed=frozenset({"orange"})))
    assert answered == "The orange seems to stand on the plate."


def test_what_is_left_and_what_was_built(known):
    names = tuple(name for name, *_ in THINGS)
    line, cups = goal_of_words("line of 0, 1"), ("cup 1", "cup 2")
    built = Build(line, names, {}, cups, "")
    situation = Situation(Dialogue(line), names, {}, builds=(built,))
    assert answer(acts_of("what is left to do"), replace(known, situation=situation)).startswith(
        "Nothing is left to do: a line of cup 1 and cup 2 stands as asked."
    )
    failed = replace(situation, builds=(built, replace(built, trouble="cup 2 fell")))
    assert "It is not as asked: cup 2 fell. “continue” proposes it again." in answer(
        acts_of("is everything built?"), replace(known, situation=failed)
    )
    assert (
        answer(acts_of("what did you build"), replace(known, situation=failed)).count("a line of cup 1 and cup 2") == 2
    )
    wanted = replace(situation, dialogue=Dialogue(goal_of_words("circle of 0, 1")))
    assert answer(acts_of("what remains to be done?"), replace(known, situation=wanted)).startswith(
        "Still to build: a circle"
    )


@pytest.mark.parametrize(
    ("line", "name"),
    [
        ("stop right there", "/stop"), ("wait, stop!", "/stop"), ("don't move", "/stop"),
        ("ok let's start all over", "/reset"), ("back to square one", "/reset"), ("/start over", "/reset"),
        ("go back one step", "/undo"), ("oops, undo the last thing", "/undo"), ("take back the last move", "/undo"),
        ("can you try that again please", "/again"), ("show me something else", "/again"), ("another one", "/again"),
        ("Something else!", "/again"), ("next", "/again"), ("the next one please", "/again"), ("try again", "/again"),
        ("a different arrangement", "/again"), ("can I see another?", "/again"),
        ("how about something different", "/again"),
        ("show me other options", "/again"), ("not that one", "/again"), ("what else?", "/again"),
        ("another", "/again"),
        ("forget everything I said", "/clear"), ("clear all", "/clear"), ("finish the job", "/continue"),
        ("I am done", "/quit"),
    ],
)  # fmt: skip
def test_commands_in_a_strangers_words(line, name):
    command, rest = command_of(line)
    assert (command.name, rest) == (name, "")


@pytest.mark.parametrize(
    "line",
    [
        "can you put the mug next to the bowl?", "would you mind stacking the cups?", "could the cups go in a circle?",
        "why don't you stack the boxes on the left", "the mug next to the bowl", "can the mug be on the plate",
        "what about the apple on the plate", "is it okay to put the mug in the bowl", "should the mug be on the plate",
        "could the apple sit on the plate", "why is the mug not on the plate? put it there",
        "stop stacking, make a line",
        "something else on the left", "next to the box", "put it next to the bowl", "another cup", "a second",
        "drop the circle", "leave the cups where they are", "forget the tower", "undo the circle and make a line",
    ],
)  # fmt: skip
def test_no_instruction_is_a_question_or_a_command(line):
    assert acts_of(line) == () and command_of(line) is None


def test_no_instruction_of_the_benchmarks_is_a_command():
    from grounding.benchmark import development_rows, free_rows

    rows = [row.text for row in (*free_rows(), *development_rows()) if not row.refuse]
    assert len(rows) > 600 and [text for text in rows if command_of(re.sub(r"\s+", " ", text)) is not None] == []
