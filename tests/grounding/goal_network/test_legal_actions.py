"""The grammar of actions: whatever follows it is a goal."""

from __future__ import annotations

import numpy as np
import pytest

from grounding.goal_network.beam_search import WrittenGoal
from grounding.goal_network.legal_actions import legal_actions
from grounding.goal_network.parts import parts_of
from grounding.goal_network.vocabulary import END, KEYWORD, KEYWORDS, NO_GOAL, START, Action
from grounding.goals.goal import Goal
from grounding.goals.parts import GoalError
from grounding.resolve.tokens import words_of

TEXT = "put the red mug 5 cm behind the bowl and the two cans in a row near me"


def random_actions(rng: np.random.Generator, words: int) -> list[Action]:
    """Walk through the legal actions at random; ends are likely, so that walks are short."""
    steps, taken = legal_actions(), []
    legal = next(steps)
    while True:
        options = [Action(KEYWORD, number) for number in sorted(legal.keywords)]
        options += [Action(START, place) for place in range(words)] if legal.start else []
        if legal.end_from is not None:
            options = [Action(END, place) for place in range(legal.end_from, min(words, legal.end_from + 3))]
        ends = [one for one in options if one.kind == KEYWORD and KEYWORDS[one.value] == "<end>"]
        action = ends[0] if ends and rng.random() < 0.3 else options[rng.integers(len(options))]
        taken.append(action)
        try:
            legal = steps.send(action)
        except StopIteration:
            return taken


@pytest.mark.parametrize("seed", range(200))
def test_every_legal_walk_is_a_goal_or_breaks_a_rule_between_parts(seed):
    words = words_of(TEXT)
    actions = random_actions(np.random.default_rng(seed), len(words))
    assert KEYWORDS[actions[-1].value] == "<end>"
    written = WrittenGoal(tuple(words), tuple(actions[:-1]), 1.0)
    try:
        found = parts_of(written, TEXT)
    except ValueError as error:
        assert "for a length" in str(error)  # words that are no length were copied
        return
    assert bool(found.parts) != (found.answer in NO_GOAL) or found.kept
    try:
        Goal.from_dict({"parts": list(found.parts)})
    except GoalError as error:
        # Only what a grammar of single parts cannot know: repeated objects, references to themselves, other parts.
        assert any(words in str(error) for words in ("twice", "itself", "own objects", "must name", "part", "listed",
                                                     "needs objects", "no parts")), error  # fmt: skip
