"""The scores of segmentation, on labels of which every number is known."""

import numpy as np
import pytest

from agent.evaluation.segmentation.scores import scores_of


@pytest.fixture
def true():
    labels = np.zeros((60, 80), dtype=int)
    labels[10:30, 10:30] = 1
    labels[10:30, 30:50] = 2
    labels[40:50, 10:20] = 3
    return labels


def test_the_truth_is_exact(true):
    scores = scores_of(true, true)
    assert scores.exact and scores.matched == 3
    assert scores.overlap == scores.boundary == (1.0, 1.0, 1.0)
    assert scores.split == scores.swallowed == scores.missed == scores.phantoms == 0


def test_numbers_of_objects_do_not_matter_and_other_labels_are_no_objects(true):
    turned = np.choose(true, [-1, 3, 1, 2])
    turned[0, :5] = -2
    assert scores_of(turned, true) == scores_of(true, true)


def test_two_objects_in_one_are_one_swallowed(true):
    scores = scores_of(np.where(true == 2, 1, true), true)
    assert not scores.exact and (scores.swallowed, scores.split, scores.missed) == (1, 0, 0)
    # 400 of 800 pixels belong to the matched one.
    assert scores.overlap == pytest.approx((500 / 900, 500 / 900, 500 / 900))


def test_an_object_in_two_is_split(true):
    found = true.copy()
    found[10:18, 10:30] = 4
    scores = scores_of(found, true)
    assert (scores.split, scores.swallowed, scores.missed, scores.phantoms) == (1, 0, 0, 0)
    assert scores.overlap == pytest.approx((740 / 900, 740 / 900, 740 / 900))


def test_what_is_not_found_is_missed_and_what_is_not_there_is_a_phantom(true):
    found = np.where(true == 3, 0, true)
    found[50:58, 60:70] = 5
    scores = scores_of(found, true)
    assert (scores.missed, scores.phantoms, scores.objects, scores.found) == (1, 1, 3, 3)
    assert not scores.exact
    assert scores.overlap == pytest.approx((800 / 880, 800 / 900, 2 * 800 / 1780))


def test_boundaries_may_be_three_pixels_apart(true):
    moved = scores_of(np.roll(true, 3, axis=0), true)
    assert moved.boundary[2] == pytest.approx(1.0) and moved.overlap[2] < 0.9
    assert scores_of(np.roll(true, 6, axis=0), true).boundary[2] < 0.7


def test_an_empty_table_without_finds_is_right():
    nothing = np.zeros((4, 4), dtype=int)
    scores = scores_of(nothing, nothing)
    assert scores.exact and scores.overlap[2] == scores.boundary[2] == 1.0
    assert scores_of(nothing + 1, nothing).phantoms == 1
