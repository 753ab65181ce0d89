"""Sentences with five slots, and the temperature at which right answers are the likeliest."""

from itertools import islice

import numpy as np
import pytest

from grounding.corpus.grammar import split_of
from grounding.training.slot_texts import TEMPERATURES, draw_sentences, misfit, temperature


def test_of_the_grammar_only_seen_sentences_are_drawn():
    drawn = list(islice(draw_sentences(np.random.default_rng(1), 1.0), 50))
    assert {split_of(one.text) for one in drawn} == {"seen"} and all(one.refuse is None for one in drawn)
    assert all(one.refuse for one in islice(draw_sentences(np.random.default_rng(1), 0.0, 1.0), 20))


def test_misfit_is_the_negative_log_likelihood_of_all_right_answers():
    logits = np.log([[0.5, 0.25, 0.25], [0.1, 0.1, 0.8]])
    right = np.array([[True, True, False], [False, False, True]])
    assert misfit(logits, right) == pytest.approx(-np.log(0.75) - np.log(0.8))


def test_what_is_certain_and_often_wrong_is_cooled_down():
    logits = np.array([[4.0, 0.0]] * 4)
    assert temperature(logits, np.array([[True, False]] * 4)) == TEMPERATURES[0]
    # Right in three of four, as softmax says at 4 / T = log 3.
    wrong = np.array([[True, False]] * 3 + [[False, True]])
    assert temperature(logits, wrong) == pytest.approx(4.0 / np.log(3.0), rel=0.05)
