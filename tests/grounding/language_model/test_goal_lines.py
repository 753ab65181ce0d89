"""The line that a small language model writes for a goal: what is legal, and which goal it is."""

import numpy as np
import pytest

from grounding.goals.goal import Goal
from grounding.language_model.goal_lines import NO_GOAL, Said, goal_line, parts_of, pieces_of
from prompts import load_prompt, prompt_lines

TEXT = "Stack the red cans, then put the two cups in a ring 15 cm around the bowl; swap the mug and the fork."
SAID = Said.of(TEXT, ["15 cm"], [2])


def test_words_are_small_and_part_at_punctuation():
    assert Said.of("Put it, 10cm LEFT!").words == ("put", "it", None, "10", "cm", "left", None)
    assert Said.of("Put it, 10cm LEFT!").text == "put it, 10 cm left,"


@pytest.mark.parametrize(
    ("line", "parts"),
    [
        (
            " tower of the red cans, left, order height down from bottom.",
            [{"kind": "structure", "shape": "tower", "objects": ["the red cans"], "x_position": "left",
              "order": {"by": "height", "direction": "descending", "from": "bottom"}}],
        ),
        (
            " circle of the two cups, gap 15 cm, around the bowl; place of structure 1, behind the mug.",
            [{"kind": "structure", "shape": "circle", "objects": ["the two cups"], "gap": "15 cm", "around": ["the bowl"]},
             {"kind": "relation", "relation": "behind", "objects": {"part": 0}, "reference": ["the mug"]}],
        ),
        (
            " swap of the mug + the fork; line of (all), order width, along near; place of the mug, behind structure 1.",
            [{"kind": "relation", "relation": "swapped", "objects": ["the mug", "the fork"]},
             {"kind": "structure", "shape": "line", "objects": None, "along": "near",
              "order": {"by": "width", "direction": None, "from": None}},
             {"kind": "relation", "relation": "behind", "objects": ["the mug"], "reference": {"part": 1}}],
        ),
        (
            " place of the mug, at right top; move of the fork, closer 15 cm; grid of (all), rows 2.",
            [{"kind": "relation", "relation": "at", "objects": ["the mug"], "x_position": "right", "y_position": "top"},
             {"kind": "relation", "relation": "moved", "objects": ["the fork"], "direction": "closer", "distance": "15 cm"},
             {"kind": "structure", "shape": "grid", "objects": None, "rows": 2}],
        ),
        (
            " place of the fork, inside the mug; place of the bowl, between the mug + the fork.",
            [{"kind": "relation", "relation": "in", "objects": ["the fork"], "reference": ["the mug"]},
             {"kind": "relation", "relation": "between", "objects": ["the bowl"], "reference": ["the mug", "the fork"]}],
        ),
        (" cluster of (all), group colour.",
         [{"kind": "structure", "shape": "cluster", "objects": None, "group_by": "colour"}]),
    ],
)  # fmt: skip
def test_a_line_is_a_goal(line, parts):
    assert parts_of(line, SAID) == parts
    metres = [{key: 0.15 if value == "15 cm" else value for key, value in part.items()} for part in parts]
    assert len(Goal.from_dict({"parts": metres}).parts) == len(parts)


@pytest.mark.parametrize("word", NO_GOAL)
def test_a_line_can_say_that_there_is_no_goal(word):
    assert parts_of(f" {word}.", SAID) == word


@pytest.mark.parametrize(
    "line",
    [
        " tower of the blue cans.",  # nobody said so
        " tower of the red cups.",  # not together
        " tower of the red cans",  # no end
        " tower of the red cans, gap 15 cm.",  # no key of a tower
        " circle of (all), gap 20 cm.",
        " circle of (all), left, small.",  # keys have one order
        " circle of (all), small, large.",
        " place of the mug.",
        " place of structure 1, left of the mug.",  # there is none yet
        " grid of (all), rows 7.",
        " tower of the red cans. line of (all).",
        "",
    ],
)
def test_what_is_not_legal_is_no_line(line):
    with pytest.raises(ValueError, match="line"):
        parts_of(line, SAID)


def test_every_walk_over_legal_pieces_ends_in_parts_with_the_keys_of_goals():
    """Whatever a model chooses, the line ends, and its parts have keys that goals have."""
    rng = np.random.default_rng(0)
    for _ in range(300):
        steps = goal_line(SAID)
        legal, pieces = next(steps), []
        while True:
            assert legal and len(set(legal)) == len(legal)
            pieces.append(legal[rng.integers(len(legal))])
            try:
                legal = steps.send(pieces[-1])
            except StopIteration as end:
                parts = end.value
                break
        line = "".join(pieces)
        if isinstance(parts, str):
            assert parts in NO_GOAL
            continue
        assert parts == parts_of(line, SAID)
        for part in parts:
            part = {key: 0.15 if value == "15 cm" else value for key, value in part.items()}
            if isinstance(part["objects"], dict) or isinstance(part.get("reference"), dict):
                continue
            try:
                Goal.from_dict({"parts": [part]})
            except ValueError as error:  # objects among themselves
                assert (
                    "object" in str(error) or "itself" in str(error) or "listed" in str(error) or "way" in str(error)
                ), line


def test_pieces_make_up_the_line():
    line = " circle of the two cups, gap 15 cm, around the bowl."
    assert "".join(pieces_of(line, SAID)) == line
    assert pieces_of(line, SAID)[-1] == "."


def test_the_examples_of_the_prompt_are_legal_lines():
    from grounding.language_model.local_goals import PROMPT, said_counts, said_lengths

    examples = prompt_lines(load_prompt(PROMPT))
    assert len(examples) >= 8
    shown = set()
    for text, line in examples:
        parts = parts_of(f" {line}", Said.of(text, said_lengths(text), said_counts(text)))
        shown |= {parts} if isinstance(parts, str) else {part.get("relation", part.get("shape")) for part in parts}
    assert {
        "nothing",
        "impossible",
        "tower",
        "line",
        "circle",
        "cluster",
        "moved",
        "swapped",
        "at",
        "on",
        "behind",
    } <= shown
