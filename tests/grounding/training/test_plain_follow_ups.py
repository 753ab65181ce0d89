"""Plain sentences about a goal keep what it has, and their labels are what they say."""

import re

import numpy as np
import pytest

from grounding.goal_network.vocabulary import END, KEYWORD, KEYWORDS, START
from grounding.training.goal_corrections import goal_of
from grounding.training.plain_follow_ups import PlainFollowUps

KITCHEN = "place of the kettle {0}, right of the teapot {2}."


def written(task):
    """Return the label of a task: keywords and phrases."""
    words = []
    for kind, places in task.steps[:-1]:
        if kind == KEYWORD:
            words.append(KEYWORDS[places[0]])
        elif kind == START:
            first = places[0]
        else:
            assert kind == END
            words.append(" ".join(task.words[first : places[0] + 1]))
    return " ".join(words)


def drawn(scene, label, count=1500):
    """Return what is said and the label of each draw."""
    follow_ups = PlainFollowUps({scene: [goal_of(label)]}, np.random.default_rng(2))
    tasks = [follow_ups.draw() for _ in range(count)]
    return {" ".join(task.words[task.said_from :]).rstrip(" .!"): written(task) for task in tasks}


@pytest.fixture(scope="module")
def kitchen():
    return drawn("kitchen", KITCHEN)


def test_one_thing_more_keeps_the_goal(kitchen):
    more = {label for said, label in kitchen.items() if "the pitcher" in said and "behind the kettle" in said}
    assert "place of the kettle rel right of the teapot place of the pitcher rel behind the kettle" in more
    added = [label for label in kitchen.values() if label.count("place of") > 1]
    assert added and all(label.startswith("place of the kettle rel right of the teapot place of") for label in added)


def test_the_last_word_of_a_repair_counts(kitchen):
    repaired = {label for said, label in kitchen.items() if ", behind it" in said}
    assert repaired and all("rel behind" in label.rpartition("place of")[2] for label in repaired)


def test_the_other_side_is_the_opposite_relation(kitchen):
    other = {label for said, label in kitchen.items() if "on the other side" in said}
    assert other == {"place of the kettle rel left of the teapot"}


def test_a_structure_is_referred_to_by_its_shape():
    found = drawn("cans and cups", "line of the cans {0,1,2}; circle of the cups {3,5,6}.")
    beside = {label.rpartition("rel ")[2] for said, label in found.items() if "yellow cup" in said and "circle" in said}
    assert any(each.endswith("structure 2") for each in beside) and not any("structure 1" in each for each in beside)


def test_a_structure_takes_another_shape():
    found = drawn("cans and cups", "circle of the cups {3,4,5,6}.")
    squares = {label for said, label in found.items() if "make it a square" in said}
    assert squares == {"square of the cups"}


def test_nothing_is_added_where_everything_takes_part():
    labels = drawn("cans and cups", "circle of (all).", 40).values()
    assert not any("place of" in label for label in labels)


def test_either_of_two_structures_may_stand_in_front():
    found = drawn("party", "line of the red cups {0,1,2}; line of the blue cups {3,4,5}.")
    ends = {re.search(r"(red|blue) .* in front of the (red|blue)", said): label for said, label in found.items()}
    ends = {match[1]: label.rpartition("place of ")[2] for match, label in ends.items() if match}
    numbered = {"red": "structure 1 rel in front of structure 2", "blue": "structure 2 rel in front of structure 1"}
    assert ends == numbered


def test_one_of_two_structures_takes_a_place():
    found = drawn("party", "line of the red cups {0,1,2}; circle of the blue cups {3,4,5}.")
    moved = {label for said, label in found.items() if re.search("the (red|blue) .* (at|to) the back$", said)}
    one, other = "line of the red cups", "circle of the blue cups"
    assert moved == {f"{one} y top {other}", f"{one} {other} y top"}
