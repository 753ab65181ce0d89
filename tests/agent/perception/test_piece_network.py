"""The networks are averaged, take features by their names, and are those that were trained."""

import numpy as np
import pytest

from agent.evaluation.segmentation.piece_examples import Example
from agent.evaluation.segmentation.train_pieces import train_pieces
from agent.perception.piece_network import PieceNetwork, piece_network


def test_networks_compute_what_their_weights_say(tmp_path):
    rng = np.random.default_rng(0)
    weights = {
        "mean": rng.normal(size=2), "scale": np.array([1.0, 2.0]),
        "hidden": rng.normal(size=(2, 2, 4)), "hidden_bias": rng.normal(size=(2, 4)),
        "second": rng.normal(size=(2, 4, 4)), "second_bias": rng.normal(size=(2, 4)),
        "out": rng.normal(size=(2, 4)), "out_bias": rng.normal(size=2),
    }  # fmt: skip
    np.savez(tmp_path / "weights.npz", features=np.array(["gap", "lean"]), **weights)
    pairs = [{"lean": 0.5, "other": 9.0, "gap": -1.0}, {"gap": 100.0, "lean": 0.0}]
    expected = []
    for pair in pairs:
        values = np.clip((np.array([pair["gap"], pair["lean"]]) - weights["mean"]) / weights["scale"], -5.0, 5.0)
        shares = []
        for k in range(2):
            first = np.maximum(values @ weights["hidden"][k] + weights["hidden_bias"][k], 0.0)
            second = np.maximum(first @ weights["second"][k] + weights["second_bias"][k], 0.0)
            shares.append(1.0 / (1.0 + np.exp(-(second @ weights["out"][k] + weights["out_bias"][k]))))
        expected.append(np.mean(shares))
    np.testing.assert_allclose(PieceNetwork(tmp_path / "weights.npz")(pairs), expected, rtol=1e-4)


def test_training_learns_a_rule_and_can_be_repeated(tmp_path, monkeypatch):
    monkeypatch.setattr("agent.evaluation.segmentation.train_pieces._STEPS", 300)
    rng = np.random.default_rng(1)
    examples = [
        Example({"gap": gap, "lean": lean}, bool(gap < 0.3 and lean > 0.0), 1.0)
        for gap, lean in zip(rng.uniform(size=600), rng.uniform(-1.0, 1.0, 600), strict=True)
    ]
    once, again = (train_pieces(examples[:500], seed=3) for _ in range(2))
    for name in once:
        np.testing.assert_array_equal(once[name], again[name])
    np.savez(tmp_path / "weights.npz", **once)
    likely = PieceNetwork(tmp_path / "weights.npz")([one.features for one in examples[500:]])
    assert ((likely > 0.5) == [one.one for one in examples[500:]]).mean() > 0.9


def test_the_shipped_network_takes_the_features_that_pieces_have():
    network = piece_network()
    pair = dict.fromkeys(network.features, 0.0)
    assert 0.0 <= float(network([pair])[0]) <= 1.0
    with pytest.raises(KeyError):
        network([{"gap": 0.0}])
