"""The average of networks lies between them."""

from __future__ import annotations

import numpy as np

from grounding.goal_network.writer import NetworkWriter
from grounding.training.goal_network import GoalNetwork
from grounding.training.goal_reader import save
from grounding.training.network_average import average


def test_weights_are_means(encoder, tmp_path):
    networks = [GoalNetwork() for _ in range(3)]
    for number, network in enumerate(networks):
        save(network, encoder, tmp_path / f"{number}", number)
    states = [NetworkWriter.from_pretrained(encoder, tmp_path / f"{n}").decoder.state for n in range(3)]
    found = average([tmp_path / f"{n}" for n in range(3)], encoder).decoder().state
    assert all(np.allclose(found[name], sum(state[name] for state in states) / 3, atol=1e-6) for name in found)
