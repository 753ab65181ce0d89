"""The weights of the probability are those of a logistic regression."""

import numpy as np
import pytest

from grounding.training.calibration import OF_DEVELOPMENT, WITHOUT_SCENE, fitted, texts


def test_a_share_of_right_goals_becomes_its_logit():
    rows, right = np.ones((4000, 1)), np.array([1.0] * 3000 + [0.0] * 1000)
    assert fitted(rows, right)[0] == pytest.approx(np.log(3.0), abs=0.01)


def test_what_tells_right_from_wrong_gets_weight():
    rng = np.random.default_rng(0)
    said, noise = rng.normal(size=5000), rng.normal(size=5000)
    right = (rng.random(5000) < 1.0 / (1.0 + np.exp(-2.0 * said))).astype(float)
    weights = fitted(np.stack([np.ones(5000), said, noise], axis=1), right)
    assert weights == pytest.approx([0.0, 2.0, 0.0], abs=0.15)


def test_a_row_counts_as_often_as_its_weight():
    rows, right = np.ones((2, 1)), np.array([1.0, 0.0])
    assert fitted(rows, right, np.array([3000.0, 1000.0]))[0] == pytest.approx(np.log(3.0), abs=0.01)


def test_texts_are_held_back_ones_and_the_development_sets(encoder):
    rows = list(texts(encoder))
    assert {row.weight for row in rows} == {OF_DEVELOPMENT, WITHOUT_SCENE, 1.0} and sum(
        row.objects is None for row in rows
    ) > 600
    assert any(row.before.parts for row in rows)
