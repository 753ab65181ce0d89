"""Labelled instructions become lines of the language model."""

from __future__ import annotations

import pytest

from grounding.language_model.goal_lines import parts_of
from grounding.training.adapter_sentences import adapter_sentences, goal_sentence
from grounding.training.goal_lines import LabelError, goal_lines
from grounding.training.goal_reader import held_out


@pytest.mark.parametrize(
    ("text", "label", "line"),
    [
        (
            "The Tins go on the left, 5cm behind the plate", "place of The Tins {0,1}, behind the plate {2}, distance 5cm.",
            " place of the tins, behind the plate, distance 5 cm.",
        ),
        (
            "a row of cups on the right, small gaps of 2 cm", "line of cups {0,1}, gap 2 cm, right.",
            " line of cups, right, gap 2 cm.",
        ),
        ("the pen, near left corner", "place of the pen {1}, at bottom left.", " place of the pen, at left bottom."),
        ("Swap Fork and the cup", "swap of Fork {0} + the cup {1}.", " swap of fork + the cup."),
        ("line up the cans, and keep the bowl there", "line of the cans {0}; keep of the bowl {1}.", " line of the cans."),
        ("spell hello", "impossible.", " impossible."),
    ],
)  # fmt: skip
def test_a_label_becomes_the_line(text, label, line):
    found = goal_sentence(text, label)
    assert found.line == line
    assert parts_of(line, found.said)


@pytest.mark.parametrize(
    ("text", "label"),
    [
        ("line up all but the bowl", "line of (all); keep of the bowl {1}."),
        ("keep the bowl", "keep of the bowl {1}."),
        ("a ring, radius 18", "circle of (all), radius 18 {0.18}."),
        ("put the cup down", "tower of the can {0}."),
        ("stack the cans", "tower of the cans, colour red."),
        ("the can by the cup", "place of the can, by the cup."),
    ],
)
def test_what_a_line_cannot_hold_is_an_error(text, label):
    with pytest.raises(LabelError):
        goal_sentence(text, label)


def test_nearly_all_labelled_instructions_have_a_line_and_the_held_out_ones_are_not_trained_on():
    seen, unseen = adapter_sentences(seen=True), adapter_sentences(seen=False)
    assert len(seen) + len(unseen) > 0.97 * len(goal_lines())
    held = {row.text for row in goal_lines() if held_out(row)}
    assert {one.text for one in unseen} <= held and held.isdisjoint(one.text for one in seen)
