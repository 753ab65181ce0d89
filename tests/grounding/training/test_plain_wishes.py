"""Plain wishes name objects of a scene, and their labels are legal."""

import re

import numpy as np

from grounding.goal_network.vocabulary import KEYWORD, KEYWORDS
from grounding.goal_network.word_presence import NOUN_HERE
from grounding.training.plain_wishes import PlainWishes


def test_wishes_of_all_kinds_are_drawn():
    wishes = PlainWishes(np.random.default_rng(0))
    drawn = [wishes.draw() for _ in range(300)]
    heads = {KEYWORDS[places[0]] for task in drawn for kind, places in task.steps if kind == KEYWORD}
    assert {
        "place of",
        "move of",
        "swap of",
        "line of",
        "tower of",
        "circle of",
        "rel in",
        "rel between",
        "x left",
        "(all)",
    } <= heads
    assert sum(NOUN_HERE in task.presence for task in drawn) > 200 and all(len(task.words) < 60 for task in drawn)


def test_lists_of_numbered_names_and_exclusive_words_are_drawn():
    wishes = PlainWishes(np.random.default_rng(0))
    texts = [" ".join(wishes.draw().words) for _ in range(600)]
    assert any(re.search(r"\b(\w+) \d , \1 \d and \1 \d", text) for text in texts)
    assert any(re.search(r"\bonly\b", text) for text in texts)


def test_the_same_seed_draws_the_same_wishes():
    one, other = (PlainWishes(np.random.default_rng(5)) for _ in range(2))
    assert [one.draw() for _ in range(5)] == [other.draw() for _ in range(5)]
