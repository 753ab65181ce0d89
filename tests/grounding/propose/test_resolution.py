"""Goals in words become goals about a scene, or a question whose answers can be had."""

from grounding.goal_benchmark.rows import goal_scenes
from grounding.propose.proposal import WordedGoal
from grounding.propose.resolution import resolved

FRUIT = goal_scenes()["fruit and plate"]  # plate 0, apples 1 and 2 (red, green), banana 3, cans 4 and 5
CUPS = goal_scenes()["cans and cups"]  # cans 0 to 2, cups 3 to 6


def words(*parts: dict) -> WordedGoal:
    return WordedGoal(1.0, parts)


def line(*objects: str) -> dict:
    return {"kind": "structure", "shape": "line", "objects": list(objects)}


def test_a_phrase_within_another_one_is_asked_about_once():
    """It recursed without end: the answer was known for the phrase alone, and not where it stands within the other."""
    place = {
        "kind": "relation",
        "objects": ["the can in front of the apple"],
        "relation": "behind",
        "reference": ["the apple"],
    }
    found = resolved(words(place), "the can in front of the apple goes behind the apple", FRUIT, None)
    assert found.question is not None and found.question.text.startswith("'the apple' fits 2 objects")
    assert all(str(goal) in ("4 behind 1", "5 behind 2", "4 behind 2", "5 behind 1") for goal in found.choices)


def test_two_of_three_offers_every_two():
    found = resolved(words(line("the two cans")), "put the two cans in a line", CUPS, None)
    assert found.question is not None and "means 2 of these 3 objects" in found.question.text
    assert [str(goal) for goal in found.choices] == ["line of 0, 1", "line of 0, 2", "line of 1, 2"]
    assert found.question.options == ("can, can 2", "can, can 3", "can 2, can 3")


def test_one_of_four_offers_each_that_can_be_had():
    place = {"kind": "relation", "objects": ["the cup"], "relation": "at", "x_position": "left"}
    found = resolved(words(place), "put the cup on the left", CUPS, None)
    assert [str(goal) for goal in found.choices] == [f"{number} at left" for number in (3, 4, 5, 6)]
