"""The trained verifier prefers what was meant to what was lost, and its arithmetic is torch's."""

import json
import shutil

import numpy as np
import pytest

from grounding.goal_benchmark.rows import goal_scenes
from grounding.goal_network.writer import GoalNetworkError
from grounding.goals.goal import Goal
from grounding.verify.verifier import GOAL, MOST_WORDS, WEIGHTS, Verifier, pair_of
from tests.grounding.goal_in_words import goal_of_words

CUPS = goal_scenes()["cans and cups"]


def test_a_pair_holds_the_text_and_the_goal_in_words():
    pair = pair_of("stack the cans", goal_of_words("tower of 0, 1, 2, left"), CUPS)
    assert " ".join(pair.words) == f"stack the cans {GOAL} tower of the cans , left"
    assert pair.words[pair.first : pair.end] == ("stack", "the", "cans")


def test_a_pair_begins_with_the_goal_so_far():
    before = goal_of_words("tower of 0, 1, 2")
    pair = pair_of("on the left", goal_of_words("tower of 0, 1, 2, left"), CUPS, before)
    assert " ".join(pair.words).startswith("so far : tower of the cans . now : on the left =>")
    assert pair.words[pair.first : pair.end] == ("on", "the", "left")


def test_a_long_text_is_cut_at_its_beginning():
    pair = pair_of("please " * 400 + "stack the cans", goal_of_words("tower of 0, 1, 2"), CUPS)
    assert len(pair.words) <= MOST_WORDS and pair.words[pair.end - 1] == "cans"


@pytest.mark.parametrize(
    ("text", "meant", "other"),
    [
        ("stack the cans on the left", "tower of 0, 1, 2, left", "tower of 0, 1, 2, right"),
        ("stack the cans on the left", "tower of 0, 1, 2, left", "tower of 0, 1, 2"),
        ("put the cups in a circle", "circle of 3, 4, 5, 6", "line of 3, 4, 5, 6"),
        ("stack the cans and line up the cups", "tower of 0, 1, 2; line of 3, 4, 5, 6", "tower of 0, 1, 2"),
        ("the red cup goes left of the green can", "3 left of 2", "2 left of 3"),
    ],
)
def test_what_was_meant_is_likelier_than_what_lost_a_word(verifier, text, meant, other):
    first, second = verifier.judge([pair_of(text, goal_of_words(goal), CUPS) for goal in (meant, other)])
    assert first.logit > second.logit
    assert (
        first.lost.shape == (len(pair_of(text, Goal(), CUPS).words) - 1,)
        and ((first.lost >= 0) & (first.lost <= 1)).all()
    )


def test_pairs_are_judged_alike_alone_and_together(verifier):
    pairs = [
        pair_of(text, goal_of_words("tower of 0, 1, 2"), CUPS)
        for text in ("stack the cans", "the cans, one on the other")
    ]
    together = verifier.judge(pairs)
    alone = [verifier.judge([pair])[0] for pair in pairs]
    np.testing.assert_allclose([one.logit for one in together], [one.logit for one in alone], atol=1e-4)
    assert verifier.judge([]) == []


def test_the_arithmetic_is_that_of_training(encoder, verifier):
    import torch

    from grounding.goal_network.writer import ENCODER_LAYER
    from grounding.training.verifier import VerifierNetwork

    network = VerifierNetwork(0.0).eval()
    network.load_state_dict({name: torch.from_numpy(array.copy()) for name, array in verifier.state.items()})
    pair = pair_of("stack the cans on the left", goal_of_words("tower of 0, 1, 2, left"), CUPS)
    said = encoder.word_states([list(pair.words)], ENCODER_LAYER)
    with torch.no_grad():
        right, lost = network(*(torch.from_numpy(each) for each in (said.hidden, said.pieces, said.first)))
    found = verifier.judge([pair])[0]
    assert found.logit == pytest.approx(right.item(), abs=1e-3)
    np.testing.assert_allclose(found.lost, lost.sigmoid().numpy()[0, pair.first : pair.end], atol=1e-3)


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ("encoder_sha256", "0", "was trained with another sentence encoder"),
        ("difference_to", {"network": "embedding", "sha256": "0"}, "is another than the one that was trained further"),
        ("weights", [1.0, 2.0], "must be an object with 'instruction' and 'follow_up'"),
    ],
)
def test_weights_that_do_not_fit_are_named(encoder, tmp_path, key, value, said):
    folder = tmp_path / "verifier"
    shutil.copytree(WEIGHTS, folder)
    config = json.loads((folder / "config.json").read_text())
    (folder / "config.json").write_text(json.dumps(config | {key: value}))
    with pytest.raises(GoalNetworkError, match=said):
        Verifier.from_pretrained(encoder, folder)
    with pytest.raises(GoalNetworkError, match="cannot be loaded"):
        Verifier.from_pretrained(encoder, tmp_path)
