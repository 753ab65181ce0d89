"""The network in numpy is the network in torch."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from grounding.goal_network.decoder import GoalDecoder, Writings
from grounding.goal_network.vocabulary import KEYWORD, NUMBER_OF, START, Action, keyword
from grounding.goal_network.word_presence import NO_NAME, NOUN_HERE, PRESENCES
from grounding.goal_network.writer import ENCODER_LAYER
from grounding.training.goal_network import GoalNetwork

WORDS = ["stack", "the", "red", "cans", "behind", "the", "plate"]
PRESENCE = [NO_NAME, NOUN_HERE, *(k % PRESENCES for k in range(len(WORDS) - 2))]
ACTIONS = [keyword("tower of"), Action(START, 1), Action(2, 3), keyword("y top"), keyword("place of")]


@pytest.fixture(scope="module")
def network():
    with torch.random.fork_rng():
        torch.manual_seed(3)
        return GoalNetwork().eval()


def test_scores_agree_with_torch_action_by_action(network, encoder):
    states = encoder.word_states([WORDS], ENCODER_LAYER)
    decoder = network.decoder()
    # Beside it others are written: of an instruction with other words, and another goal of the same words.
    several = encoder.word_states([WORDS[:3], WORDS], ENCODER_LAYER)
    first = [several.first[0, :3], several.first[1]]
    fewer, same = decoder.begin(several.hidden, several.pieces, first, [PRESENCE[:3], PRESENCE])
    writings, scores = decoder.scores(Writings((fewer, same)), [None, None])
    ours, writings = [scores[1]], writings.chosen([0, 1, 1])
    for action, another in zip(ACTIONS, reversed(ACTIONS)):
        at_first = another if another.kind == KEYWORD else Action(another.kind, 0)
        writings, scores = decoder.scores(writings, [at_first, another, action])
        ours.append(scores[2])
        writings = writings.chosen([0, 1, 2])
    started = [Action(KEYWORD, NUMBER_OF["<start>"]), *ACTIONS]
    with torch.no_grad():
        memory = network.remembered(
            torch.from_numpy(states.hidden),
            torch.from_numpy(states.pieces),
            torch.from_numpy(states.first),
            torch.tensor([PRESENCE]),
        )
        theirs = network(
            memory,
            torch.from_numpy(states.words),
            torch.tensor([[action.kind for action in started]]),
            torch.tensor([[action.value for action in started]]),
        )[0]
    np.testing.assert_allclose(np.stack(ours), theirs.numpy(), atol=1e-4)


def test_missing_and_misshaped_arrays_are_named(network):
    state = dict(network.decoder().state)
    with pytest.raises(KeyError, match="word.bias"):
        GoalDecoder({name: array for name, array in state.items() if name != "word.bias"})
    with pytest.raises(ValueError, match=r"word.bias has the shape \(3,\); it must have \(256,\)"):
        GoalDecoder(state | {"word.bias": np.zeros(3, dtype=np.float32)})
