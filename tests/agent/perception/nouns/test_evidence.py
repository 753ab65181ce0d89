"""What the picture shows counts as far as shape and size allow it."""

import numpy as np
import pytest

from agent.perception.nouns.evidence import confidences, likeliest
from agent.perception.nouns.vocabulary import CLASSES, vocabulary

MUG_SIDES = np.array([0.12, 0.09, 0.1])


def picture(**shares: float) -> dict[str, float]:
    return {"mug": 0.0, "bowl": 0.0, "banana": 0.0, **shares}


def test_picture_and_shape_that_agree_are_sure():
    found = confidences(picture(mug=0.7), {"mug": 0.9, "other": 0.1}, MUG_SIDES)
    assert next(iter(found)) == "mug" and found["mug"] > 0.8
    assert list(found.values()) == sorted(found.values(), reverse=True) and sum(found.values()) < 1.0


def test_a_shape_that_contradicts_the_picture_leaves_doubt():
    agreeing = confidences(picture(bowl=0.5), {"bowl": 0.9, "other": 0.1}, np.array([0.16, 0.15, 0.07]))
    doubtful = confidences(picture(bowl=0.5), {"bowl": 0.05, "box": 0.9, "other": 0.05}, np.array([0.16, 0.15, 0.07]))
    assert agreeing["bowl"] > 0.8 > 0.5 > doubtful["bowl"]


@pytest.mark.parametrize(
    ("nouns", "expected"),
    [
        ({"mug": 0.75, "cup": 0.2}, ("mug",)),
        ({"cup": 0.45, "mug": 0.3, "bowl": 0.2}, ("cup", "mug")),
        ({"mug": 0.5, "bowl": 0.2, "glass": 0.05, "cup": 0.2}, ()),  # of three kin, the two likeliest count
        ({"bowl": 0.45, "cup": 0.35}, ()),  # nobody calls a bowl a cup
        ({"cup": 0.3, "mug": 0.3}, ()),
        ({"can": 0.69}, ()),
        ({}, ()),
    ],
)
def test_kin_name_an_object_together(nouns, expected):
    assert likeliest(nouns, 0.7) == expected


def test_sizes_veto():
    shape = {"other": 0.6, "long": 0.4}
    assert confidences(picture(banana=0.95), shape, np.array([0.18, 0.05, 0.04]))["banana"] > 0.8
    for longest in (0.04, 0.5):
        assert "banana" not in confidences(picture(banana=0.95), shape, np.array([longest, 0.03, 0.03]))


def test_what_neither_tells_has_no_noun():
    found = confidences(picture(), {"other": 0.95, "mug": 0.05}, MUG_SIDES)
    assert max(found.values()) < 0.5


def test_classes_are_summed_by_noun():
    words = vocabulary()
    logits = np.full((1, CLASSES), -10.0)
    logits[0, [440, 898]] = 3.0  # a beer and a water bottle
    assert words.shares(logits)["bottle"] == pytest.approx(1.0, abs=0.01)
    logits[0, 281] = 3.0  # a cat stands on no table
    assert words.shares(logits)["bottle"] == pytest.approx(2 / 3, abs=0.01)
