"""Small talk and questions are told from instructions, and no instruction is taken for either."""

import pytest

from grounding.benchmark import development_rows, free_rows, templated_rows
from grounding.dialogue.acts import KINDS, Act, acts_of, bare, is_question

# From the issue.
NAMED = [
    ("hello", "greeting"), ("hi there", "greeting"), ("thanks", "thanks"), ("what can you do", "abilities"),
    ("how does this work", "working"), ("what do you see", "objects"), ("what's on the table", "objects"),
    ("where is the banana", "where"), ("is there a mug", "there"), ("how many cups are there", "count"),
    ("what colour is the mug", "color"), ("which one is the tallest", "extreme"), ("why that one", "why"),
    ("why did you choose this", "why"), ("what did you just do", "done"), ("what are you going to do", "next"),
]  # fmt: skip
# Written before the wordings were, and not looked at until these were done: 76 of these and the instructions below, of
# 77, came out right at once (all but “what number of boxes are we dealing with”).
UNSEEN = [
    ("hiya", "greeting"),
    ("Hey robot!", "greeting"),
    ("good afternoon to you", "greeting"),
    ("howdy partner", "greeting"),
    ("hi, how's it going?", "greeting"),
    ("cheers mate", "thanks"),
    ("thank you so much!", "thanks"),
    ("ta, that's lovely", "thanks"),
    ("well done", "thanks"),
    ("So what exactly are you able to do?", "abilities"),
    ("what sort of things can you build", "abilities"),
    ("i have no idea what to type", "abilities"),
    ("what are my options here", "abilities"),
    ("Who are you?", "identity"),
    ("are you an AI", "identity"),
    ("how do you actually decide where things go", "working"),
    ("ok but how does all this work", "working"),
    ("Could you tell me what's lying on the table at the moment?", "objects"),
    ("list everything you can see", "objects"),
    ("which objects have you got", "objects"),
    ("show me what is there", "objects"),
    ("Where's the orange gone?", "where"),
    ("can you tell me where the red cup is", "where"),
    ("where did you put the banana", "where"),
    ("do you happen to see a fork anywhere", "there"),
    ("there isn't a plate, is there?", "there"),
    ("Any spoons?", "there"),
    ("is the mug still on the table?", "there"),
    ("what number of boxes are we dealing with", "count"),
    ("how many have we got of the cups", "count"),
    ("hey, how many things are lying around there", "count"),
    ("What colour would you say the second cup is", "color"),
    ("is the mug red or blue", "color"),
    ("whats the smallest thing you have", "extreme"),
    ("which cup is furthest away from you", "extreme"),
    ("Which of the boxes is the biggest?", "extreme"),
    ("how come you picked that one", "why"),
    ("why this arrangement and not another", "why"),
    ("explain your choice", "why"),
    ("What have you done so far?", "done"),
    ("did it work", "done"),
    ("what happened just now?", "done"),
    ("so what happens if i say yes", "next"),
    ("what's your plan?", "next"),
    ("What will you do next", "next"),
    ("what did i ask you for again", "wish"),
]
INSTRUCTIONS = [
    "can you put the cups in a line?",
    "could you make a tower",
    "would you mind stacking the cans",
    "why don't you put the mugs in a circle",
    "what about a circle",
    "how about on the left instead",
    "hello, put the cups in a line",
    "is there a way to put the cups in a line",
    "thanks for the help, now stack them",
    "where is the banana? put it into the line",
    "what do you see? make a line of it",
    "good, now bigger",
    "good morning, a circle please",
    "are you able to build a tower with the cans",
    "what about the boxes",
    "show me a circle of cups",
    "nice row, but on the left",
    "how about the other side?",
    "hi, bigger",
    "do it on the other side",
    "is it possible to have the cups in a circle",
    "look at the cups and put them in a row",
]
UNSEEN_INSTRUCTIONS = [
    "hi! would it be possible to get the cups into a ring?",
    "thanks, but a bit more to the left",
    "Great, now do the same with the boxes",
    "what if they were in a line instead?",
    "how about further back",
    "why not make it a tower",
    "why don't we line the cans up",
    "can the cups stand in a row on the right",
    "is there any chance you could stack these",
    "where the banana is now, put the cups in a circle",
    "do you think you could spread them out more?",
    "could we see it as a circle",
    "may I have the cups in a row please",
    "shouldn't it be smaller?",
    "which is the tallest? put that at the bottom of a tower",
    "nice, but bigger",
    "see the cups? circle.",
    "what do you say to a small tower at the back",
    "hello hello, all cans in a queue",
    "how many cups there are, put them all in a row",
    "there is a mug, add it to the circle",
    "do you mind moving it to the other side",
    "isn't it nicer on the left?",
    "what would it look like on the right",
    "why so small",
    "can it be done with the boxes too",
    "would a line fit there",
    "any shape you like, on the left",
    "show me the cups in a circle",
    "well done, now stack the cans",
    "who cares about the size, just a line",
]


def test_the_unseen_lines_are_many():
    assert len(UNSEEN) + len(UNSEEN_INSTRUCTIONS) >= 60 and min(len(UNSEEN), len(UNSEEN_INSTRUCTIONS)) >= 25


@pytest.mark.parametrize(("line", "kind"), [*NAMED, *UNSEEN])
def test_small_talk_and_questions(line, kind):
    assert [act.kind for act in acts_of(line)] == [kind] and kind in KINDS


@pytest.mark.parametrize("line", [*INSTRUCTIONS, *UNSEEN_INSTRUCTIONS, "", "?", "what " * 100])
def test_instructions_and_what_is_mixed_with_them_stay_instructions(line):
    assert acts_of(line) == ()


def test_no_instruction_of_the_benchmarks_is_swallowed():
    rows = [row for row in (*free_rows(), *development_rows(), *templated_rows()) if not row.refuse]
    assert len(rows) > 8000
    assert [row.text for row in rows if acts_of(row.text)] == []


@pytest.mark.parametrize(
    ("line", "act"),
    [
        ("where is the banana", Act("where", "banana")),
        ("Where's the red cup, please?", Act("where", "red cup")),
        ("is there any green mug on the table?", Act("there", "green mug")),
        ("how many of the soup cans are there", Act("count", "soup cans")),
        ("how many are there?", Act("count")),
        ("is the mug red or blue?", Act("color", "mug", "red or blue")),
        ("which of the boxes is the tallest", Act("extreme", "boxes", "tallest")),
        ("what's the smallest cup on the table?", Act("extreme", "cup", "smallest")),
        ("why candidate 3?", Act("why", "", "3")),
        ("what is object 3", Act("object", "object 3")),
    ],
)
def test_what_is_asked_about(line, act):
    assert acts_of(line) == (act,)


def test_two_questions_are_two_acts():
    assert acts_of("Hello! What do you see? Where is the orange?") == (Act("objects"), Act("where", "orange"))
    assert acts_of("hello, hello!") == (Act("greeting"),)


def test_bare():
    assert bare("OK, stop it, please!") == "stop it" and bare("please") == "please"


def test_what_has_the_form_of_a_question():
    for line in ("who won the match", "do you like tea", "it is nice, or not?", "tell me why the sky is blue"):
        assert is_question(line), line
    for line in ("what a nice day", "stack the cans", "whatever"):
        assert not is_question(line), line
