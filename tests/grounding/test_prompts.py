"""The few-shot prompt: what it teaches is legal, and teaches every answer."""

import hashlib
import re

import pytest

from grounding.figures.names import figure_named, figure_nouns
from grounding.parsers.llm_reply import ANSWERS, BUILD, NONE
from grounding.spec import SLOTS, StructureSpec
from prompts import SHIPPED, PromptError, load_prompt, prompt_examples, prompt_names

PROMPT = load_prompt("parse_structure")
EXAMPLES = prompt_examples(PROMPT)


def test_every_example_answers_every_question_with_a_legal_answer():
    assert len(EXAMPLES) == PROMPT.count("Output:") >= 8
    for text, answers in EXAMPLES:
        assert list(answers) == list(ANSWERS), text
        for question, answer in answers.items():
            assert answer in ANSWERS[question], text


def test_examples_to_build_are_legal_specs_and_refused_ones_say_nothing():
    for text, answers in EXAMPLES:
        spec = StructureSpec(**{slot: None if answers[slot] == NONE else answers[slot] for slot in SLOTS})
        assert bool(spec.tokens()) == (answers["request"] == BUILD), text


def test_the_examples_show_every_request_and_shape_and_every_slot_left_open():
    shown = {question: {answers[question] for _, answers in EXAMPLES} for question in ANSWERS}
    assert shown["request"] == set(ANSWERS["request"])
    assert shown["shape"] == set(ANSWERS["shape"])
    for slot in SLOTS[1:]:
        assert NONE in shown[slot] and len(shown[slot]) >= 3


@pytest.mark.parametrize("question", ANSWERS)
def test_the_prompt_lists_exactly_the_vocabulary(question):
    legal = ", ".join(answer for answer in ANSWERS[question] if answer != NONE)
    assert f"Available {question}: {legal}\n" in PROMPT


def test_an_unknown_prompt_is_named_with_the_known_ones():
    with pytest.raises(PromptError, match="no prompt 'poetry'; available: parse_structure, read_goal"):
        load_prompt("poetry")


def test_shipped_checksums_are_those_of_the_files():
    """Whoever changes a prompt measures again, and writes its checksum down."""
    assert {name: hashlib.sha256(load_prompt(name).encode()).hexdigest() for name in prompt_names()} == SHIPPED


def test_the_prompt_of_goals_names_every_figure_that_is_shipped():
    line = next(line for line in load_prompt("read_goal").splitlines() if line.startswith("- FIGURES"))
    flat, upright = (re.split(", ", part) for part in re.search(r"capitals, (.*?)\. .*?size: (.*?)\.", line).groups())
    named = [figure_named(name) for name in figure_nouns(taught=False) if not name.startswith(("letter ", "digit "))]
    assert flat == [one.name for one in named if not one.stacked] and upright == [
        one.name for one in named if one.stacked
    ]
