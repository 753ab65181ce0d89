"""The segmentation network in numpy computes what torch trained, and its input says what a table looks like."""

import json

import numpy as np
import pytest
import torch
from safetensors.numpy import load_file, save_file

from agent.errors import BadInput
from agent.segmentation_network.features import CHANNELS, chosen_of_blocks, features
from agent.segmentation_network.network import OUTPUTS, SegmentationNetwork
from agent.training.segmentation.network import SegmentationConfig
from agent.training.segmentation.network import SegmentationNetwork as TorchNetwork


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    """A small network with normalisation that does something, and the folder it was written to."""
    torch.manual_seed(0)
    network = TorchNetwork(SegmentationConfig((8, 12, 16, 20)))
    for module in network.modules():
        if isinstance(module, torch.nn.BatchNorm2d):
            module.running_mean.normal_()
            module.running_var.uniform_(0.5, 2.0)
            module.weight.data.uniform_(0.5, 1.5)
            module.bias.data.normal_()
    folder = tmp_path_factory.mktemp("network")
    network.eval().save_pretrained(folder)
    return network, folder


@pytest.mark.parametrize("shape", [(32, 48), (30, 42)])
def test_numpy_computes_what_torch_does(trained, shape):
    network, folder = trained
    maps = np.random.default_rng(0).normal(size=(CHANNELS, *shape)).astype(np.float32)
    expected = network(torch.from_numpy(maps)[None])[0].detach().numpy()
    found = SegmentationNetwork.from_pretrained(folder).outputs(maps)
    assert found.shape == (OUTPUTS, *shape)
    np.testing.assert_allclose(found, expected, atol=0.01 * np.abs(expected).max())  # weights are written as float16


def test_an_answer_has_probabilities_and_metres(trained):
    seen = SegmentationNetwork.from_pretrained(trained[1])(np.zeros((CHANNELS, 32, 32), dtype=np.float32))
    np.testing.assert_allclose(seen.classes.sum(axis=0), 1.0, rtol=1e-5)
    assert seen.votes.shape == (3, 32, 32) and (seen.spread > 0).all()
    assert ((seen.seeds > 0) & (seen.seeds < 1)).all()


def damage(name):
    def other_shape(weights):
        weights["up.0.0.weight"] = weights["up.0.0.weight"][:, 1:]

    def missing(weights):
        del weights["head.bias"]

    def not_finite(weights):
        weights["down.2.1.bias"][0] = np.nan

    return {"other shape": other_shape, "missing": missing, "not finite": not_finite}[name]


@pytest.mark.parametrize(
    ("kind", "named"), [("other shape", "up.0.0.weight"), ("missing", "head.bias"), ("not finite", "down.2.1")]
)
def test_damaged_weights_are_refused(trained, tmp_path, kind, named):
    weights = load_file(trained[1] / "model.safetensors")
    damage(kind)(weights)
    save_file({name: np.ascontiguousarray(array) for name, array in weights.items()}, tmp_path / "model.safetensors")
    (tmp_path / "config.json").write_text((trained[1] / "config.json").read_text())
    with pytest.raises(BadInput, match=named.replace(".", r"\.")):
        SegmentationNetwork.from_pretrained(tmp_path)


def test_another_kind_of_network_is_refused(trained, tmp_path):
    (tmp_path / "config.json").write_text(json.dumps({"kind": "diffusion"}))
    with pytest.raises(BadInput, match="its kind is 'diffusion'"):
        SegmentationNetwork.from_pretrained(tmp_path)


def test_a_block_is_shown_by_its_measured_pixel_of_middle_depth():
    depth = np.array([[1.0, 9.0, np.nan, np.nan], [2.0, 3.0, np.nan, 5.0], [7.0, 7.0, 7.0, 7.0]])
    chosen = chosen_of_blocks(depth, 2)
    assert chosen.shape == (1, 2)
    assert depth.ravel()[chosen].tolist() == [[2.0, 5.0]]


def test_features_of_a_table_seen_from_above():
    x, y = np.meshgrid(np.linspace(0.3, -0.3, 40), np.linspace(0.4, -0.4, 50), indexing="ij")
    level = np.stack((x, y, np.zeros_like(x)), axis=-1)
    level[20:, :, 2] = 0.06  # a step that is a surface too
    level[:3] = np.nan
    eye = np.array([0.0, 0.0, 1.0])
    maps = features(level, level[..., 2], eye, 0.015, None)
    assert maps.shape == (CHANNELS, 40, 50) and np.isfinite(maps).all()
    assert not maps[:, :3].any() and not maps[8:].any()  # not measured; no colours
    np.testing.assert_allclose(maps[3:6, 8:16, 5:45].mean(axis=(1, 2)), (0.0, 0.0, 1.0), atol=1e-5)
    assert (maps[1, 25:] > maps[1, 10]).all() and (maps[2, 25:] == 5.0).all()
    shades = np.full((40, 50, 3), (55.0, 30.0, 0.0))
    colored = features(level, level[..., 2], eye, 0.015, shades)
    np.testing.assert_allclose(colored[8:, 10, 10], (0.0, 1.0, 0.0, 1.0))
    np.testing.assert_array_equal(colored[:8], maps[:8])
