"""The few-shot prompt: what it teaches is legal, and teaches every value."""

import pytest

from grounding.spec import LEGAL_VALUES, SLOTS, StructureSpec
from prompts import PromptError, load_prompt, prompt_examples

PROMPT = load_prompt("parse_structure")


def test_every_example_is_a_legal_spec():
    examples = prompt_examples(PROMPT)
    assert len(examples) == PROMPT.count("Output:") >= 8
    for text, answers in examples:
        spec = StructureSpec(**dict(zip(SLOTS, answers, strict=True)))
        assert spec.tokens(), text


def test_the_examples_show_every_shape_and_every_slot_left_open():
    answers = [dict(zip(SLOTS, answer, strict=True)) for _, answer in prompt_examples(PROMPT)]
    assert {answer["shape"] for answer in answers} == {*LEGAL_VALUES["shape"], None}
    for slot in SLOTS:
        assert {answer[slot] for answer in answers} >= {None, LEGAL_VALUES[slot][-1]} or slot == "rotation"
    assert {answer["rotation"] for answer in answers} >= {None, "south", "east", "west"}


@pytest.mark.parametrize("slot", SLOTS)
def test_the_prompt_lists_exactly_the_vocabulary(slot):
    assert f"Available {slot}: {', '.join(LEGAL_VALUES[slot])}\n" in PROMPT


def test_an_unknown_prompt_is_named_with_the_known_ones():
    with pytest.raises(PromptError, match="no prompt 'poetry'; available: parse_structure"):
        load_prompt("poetry")
