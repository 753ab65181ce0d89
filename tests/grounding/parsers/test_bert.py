"""The network in numpy, against the same layers in torch."""

import json
import math

import numpy as np
import pytest
import torch
from torch.nn import functional

from grounding.parsers.bert import Bert, EncoderLayer, gelu, layer_sizes
from grounding.parsers.slot_head import QUESTIONS
from grounding.training.slot_network import SlotNetwork, encoder_layer

WIDTH, HEADS, INNER = 384, 12, 1536


@pytest.fixture
def batch():
    """States (3, 9, 384), and a mask (3, 9) of sentences of different lengths."""
    states = np.random.default_rng(0).standard_normal((3, 9, WIDTH), dtype=np.float32)
    mask = np.arange(9) < np.array([[9], [4], [1]])
    return states, mask


def test_gelu_is_that_of_torch_and_keeps_the_tails():
    x = np.concatenate([np.linspace(-9.0, 9.0, 200_001), [0.0, -0.0, -40.0, 40.0]]).astype(np.float32)
    exact = np.array([value * 0.5 * (1.0 + math.erf(value / math.sqrt(2.0))) for value in x.tolist()])
    ours = gelu(x.copy())
    np.testing.assert_allclose(ours, exact, atol=1e-6)
    np.testing.assert_allclose(ours, functional.gelu(torch.from_numpy(x)).numpy(), atol=2e-6)
    rows = x[:200_000].reshape(20, -1)
    np.testing.assert_array_equal(gelu(rows.copy()), ours[:200_000].reshape(20, -1))


def test_a_layer_is_that_of_torch(batch):
    states, mask = batch
    torch.manual_seed(0)
    reference = encoder_layer(WIDTH, HEADS, INNER).eval()
    state = {name: tensor.numpy() for name, tensor in reference.state_dict().items()}
    assert {name: array.shape for name, array in state.items()} == layer_sizes(WIDTH, INNER)
    layer = EncoderLayer.of(state, HEADS)
    assert all(layer.state()[name] is array for name, array in state.items())
    with torch.inference_mode():
        theirs = reference(torch.from_numpy(states), src_key_padding_mask=torch.from_numpy(~mask)).numpy()
    np.testing.assert_allclose(layer(states, mask)[mask], theirs[mask], atol=1e-5)


def test_padding_changes_nothing(batch):
    states, mask = batch
    torch.manual_seed(1)
    layer = EncoderLayer.of(
        {name: tensor.numpy() for name, tensor in encoder_layer(WIDTH, HEADS, INNER).state_dict().items()}, HEADS
    )
    alone = layer(states[1:2, :4], mask[1:2, :4])
    np.testing.assert_allclose(layer(states, mask)[1, :4], alone[0], atol=1e-5)


def test_some_places_alone_come_to_the_same(batch):
    states, mask = batch
    torch.manual_seed(2)
    layer = EncoderLayer.of(
        {name: tensor.numpy() for name, tensor in encoder_layer(WIDTH, HEADS, INNER).state_dict().items()}, HEADS
    )
    places = np.array([[0, 8, 3], [2, 0, 2], [0, 0, 0]])
    whole = layer(states, mask)
    np.testing.assert_allclose(layer.at(states, mask, places), whole[np.arange(3)[:, None], places], atol=1e-5)


def test_the_trained_reader_is_the_network_that_was_trained(parser, batch):
    states, mask = batch
    network = SlotNetwork.of(parser.reader).eval()
    with torch.inference_mode():
        theirs = network(torch.from_numpy(states), torch.from_numpy(mask))
    ours = parser.reader(states, mask)
    assert len(ours) == len(theirs) == len(QUESTIONS)
    for mine, other in zip(ours, theirs, strict=True):
        np.testing.assert_allclose(mine[mask], other.numpy()[mask], atol=1e-4)
        assert not mine[~mask].any()  # padding says nothing
    again = network.reader()
    assert again.answers == parser.reader.answers
    with torch.no_grad():
        network.shared.bias += 1.0
    np.testing.assert_array_equal(again(states, mask)[0], ours[0])


def test_a_checkpoint_that_does_not_fit_its_config_is_told(encoder):
    config = json.loads((encoder.folder / "config.json").read_text())
    path = encoder.folder / "model.safetensors"
    with pytest.raises(
        ValueError, match=r"dense.weight has the shape \(1536, 384\), and the config says \(1024, 384\)"
    ):
        Bert.from_pretrained(path, {**config, "intermediate_size": 1024}, 1)
    with pytest.raises(KeyError, match="encoder.layer.6.attention.self.query.weight"):
        Bert.from_pretrained(path, config, 7)
