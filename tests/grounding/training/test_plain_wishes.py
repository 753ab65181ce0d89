"""Plain wishes name objects of a scene, and their labels are legal."""

import numpy as np

from grounding.goal_network.vocabulary import KEYWORD, KEYWORDS
from grounding.goal_network.word_presence import NOUN_HERE
from grounding.training.plain_wishes import PlainWishes


def test_wishes_of_all_kinds_are_drawn():
    wishes = PlainWishes(np.random.default_rng(0))
    drawn = [wishes.draw() for _ in range(300)]
    heads = {KEYWORDS[places[0]] for task in drawn for kind, places in task.steps if kind == KEYWORD}
    assert {"place of", "move of", "swap of", "line of", "tower of", "circle of", "rel in", "rel between", "x left"} <= heads
    assert all(NOUN_HERE in task.presence and len(task.words) < 40 for task in drawn)


def test_the_same_seed_draws_the_same_wishes():
    one, other = (PlainWishes(np.random.default_rng(5)) for _ in range(2))
    assert [one.draw() for _ in range(5)] == [other.draw() for _ in range(5)]
