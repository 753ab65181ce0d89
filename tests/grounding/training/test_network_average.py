"""Averages of goal networks lie between them, and only networks of one form have one."""

import json
import shutil

import numpy as np
import pytest
from safetensors.numpy import load_file

from grounding.goal_network.writer import WEIGHTS, NetworkWriter, base_arrays
from grounding.packed_weights import packed_bytes, unpacked
from grounding.training.network_average import average


def arrays(folder):
    return unpacked(load_file(folder / "model.safetensors"), base_arrays())


@pytest.fixture
def moved(tmp_path):
    """The shipped network with other biases."""
    folder = tmp_path / "moved"
    shutil.copytree(WEIGHTS, folder)
    state = {name: each + 0.5 if name.endswith("bias") else each for name, each in arrays(WEIGHTS).items()}
    (folder / "model.safetensors").write_bytes(packed_bytes(state, base_arrays()))
    return folder


def test_an_average_lies_between_its_networks(moved, encoder, tmp_path):
    average({WEIGHTS: 3.0, moved: 1.0}, tmp_path / "mean")
    one, mean = arrays(WEIGHTS), arrays(tmp_path / "mean")
    name = next(name for name in one if name.endswith("bias"))
    assert np.allclose(mean[name] - one[name], 0.125, atol=0.02)
    assert NetworkWriter.from_pretrained(encoder, tmp_path / "mean").likeliest("stack the cans", 1)


def test_networks_of_different_forms_have_none(moved, tmp_path):
    config = json.loads((moved / "config.json").read_text())
    (moved / "config.json").write_text(json.dumps(config | {"keywords": config["keywords"][:-1]}))
    with pytest.raises(ValueError, match="different forms"):
        average({WEIGHTS: 1.0, moved: 1.0}, tmp_path / "mean")
    with pytest.raises(ValueError, match="positive"):
        average({WEIGHTS: 0.0}, tmp_path / "mean")
