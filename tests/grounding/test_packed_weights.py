"""Networks stored as differences: what comes back is near what was stored, and another base is refused."""

import json
import shutil

import numpy as np
import pytest

from grounding.goal_network.writer import WEIGHTS, GoalNetworkError, NetworkWriter
from grounding.packed_weights import CODES, STEP, packed, packed_bytes, unpacked


@pytest.fixture
def arrays():
    rng = np.random.default_rng(0)
    base = {"matrix": rng.standard_normal((64, 96)).astype(np.float32)}
    own = {
        "matrix": base["matrix"] + 0.05 * rng.standard_normal((64, 96)).astype(np.float32),
        "bias": rng.standard_normal(64).astype(np.float32),
    }
    return own, base


def test_difference_comes_back_within_half_a_step(arrays):
    own, base = arrays
    stored = packed(own, base)
    back = unpacked(stored, base)
    error = np.abs(back["matrix"] - own["matrix"])
    assert (error <= 0.6 * stored[f"matrix{STEP}"].astype(np.float32)[:, None]).all() and error.mean() < 0.012 * 0.05
    np.testing.assert_allclose(back["bias"], own["bias"], atol=2e-3)


def test_a_network_without_a_base_comes_back_too(arrays):
    own, _ = arrays
    stored = packed(own, {})
    assert np.abs(unpacked(stored, {})["matrix"] - own["matrix"]).max() <= 0.6 * float(stored[f"matrix{STEP}"].max())


def test_a_matrix_takes_a_byte_a_weight_and_two_a_row(arrays):
    stored = packed(*arrays)
    assert stored[f"matrix{CODES}"].shape == (64, 96) and stored[f"matrix{CODES}"].dtype == np.uint8
    assert stored[f"matrix{STEP}"].nbytes == 64 * 2
    assert stored["bias"].dtype == np.float16 and "matrix" not in stored


def test_equal_networks_differ_by_nothing_that_counts(arrays):
    _, base = arrays
    assert np.abs(unpacked(packed(base, base), base)["matrix"] - base["matrix"]).max() < 1e-3


def test_what_was_unpacked_can_be_stored_again(arrays):
    """Unpacked matrices lie column by column in memory; a file must not depend on it."""
    from safetensors.numpy import load

    once = unpacked(packed(arrays[0], {}), {})
    twice = unpacked(load(packed_bytes(once, {})), {})
    np.testing.assert_allclose(twice["matrix"], once["matrix"], atol=0.03)


def test_other_shapes_are_refused(arrays):
    own, base = arrays
    with pytest.raises(ValueError, match="'matrix' has another shape"):
        unpacked(packed(own, base), {"matrix": base["matrix"][:32]})


def test_file_says_its_bits(arrays, tmp_path):
    from safetensors import safe_open

    (tmp_path / "model.safetensors").write_bytes(packed_bytes(*arrays))
    with safe_open(tmp_path / "model.safetensors", "np") as file:
        assert file.metadata() == {"bits": "8"}


def test_another_base_is_refused(encoder, tmp_path):
    folder = tmp_path / "network"
    shutil.copytree(WEIGHTS, folder)
    config = json.loads((folder / "config.json").read_text())
    config["difference_to"]["sha256"] = "0" * 64
    (folder / "config.json").write_text(json.dumps(config))
    with pytest.raises(GoalNetworkError, match="'embedding' is another than the one that was trained further"):
        NetworkWriter.from_pretrained(encoder, folder)
