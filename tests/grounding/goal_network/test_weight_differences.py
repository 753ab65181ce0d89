"""Networks stored as differences: what comes back is near what was stored, and another base is refused."""

import json
import shutil

import numpy as np
import pytest

from grounding.goal_network.weight_differences import CODES, LEGAL_BITS, STEP, packed, packed_bytes, unpacked
from grounding.goal_network.writer import CORRECTIONS, WEIGHTS, GoalNetworkError, NetworkWriter


@pytest.fixture
def arrays():
    rng = np.random.default_rng(0)
    base = {"matrix": rng.standard_normal((64, 96)).astype(np.float32)}
    own = {
        "matrix": base["matrix"] + 0.05 * rng.standard_normal((64, 96)).astype(np.float32),
        "bias": rng.standard_normal(64).astype(np.float32),
    }
    return own, base


@pytest.mark.parametrize(("bits", "share"), [(2, 0.35), (4, 0.12), (8, 0.012)])  # of the difference's deviation
def test_difference_comes_back_with_the_error_of_a_normal_quantiser(arrays, bits, share):
    own, base = arrays
    back = unpacked(packed(own, base, bits), base)
    error = np.sqrt(((back["matrix"] - own["matrix"]) ** 2).mean())
    assert 0.3 * share * 0.05 < error < share * 0.05
    np.testing.assert_allclose(back["bias"], own["bias"], atol=2e-3)


@pytest.mark.parametrize("bits", LEGAL_BITS)
def test_a_matrix_takes_its_bits_and_two_bytes_a_row(arrays, bits):
    stored = packed(*arrays, bits)
    assert stored[f"matrix{CODES}"].nbytes == 64 * 96 * bits // 8 and stored[f"matrix{CODES}"].dtype == np.uint8
    assert stored[f"matrix{STEP}"].nbytes == 64 * 2
    assert stored["bias"].dtype == np.float16 and "matrix" not in stored


def test_equal_networks_differ_by_nothing_that_counts(arrays):
    _, base = arrays
    assert np.abs(unpacked(packed(base, base, 4), base)["matrix"] - base["matrix"]).max() < 1e-3


def test_illegal_bits_and_other_shapes_are_refused(arrays):
    own, base = arrays
    with pytest.raises(ValueError, match="bits cannot be 3; legal values: 2, 4, 8"):
        packed(own, base, 3)
    with pytest.raises(ValueError, match="'matrix' has another shape"):
        unpacked(packed(own, base, 4), {"matrix": base["matrix"][:32]})
    with pytest.raises(KeyError):
        unpacked(packed(own, base, 4), {})


def test_file_says_its_bits(arrays, tmp_path):
    from safetensors import safe_open

    (tmp_path / "model.safetensors").write_bytes(packed_bytes(*arrays, 4))
    with safe_open(tmp_path / "model.safetensors", "np") as file:
        assert file.metadata() == {"bits": "4"}


def test_shipped_networks_are_differences_of_each_other(encoder):
    goals, corrections = (NetworkWriter.from_pretrained(encoder, folder) for folder in (WEIGHTS, CORRECTIONS))
    changed = [
        np.linalg.norm(corrections.decoder.state[name] - array) / np.linalg.norm(array)
        for name, array in goals.decoder.state.items() if array.ndim == 2 and array.size >= 4096
    ]  # fmt: skip
    assert 0.01 < np.mean(changed) < 0.5
    assert "tower" in corrections.taught_words


def test_another_base_is_refused(encoder, tmp_path):
    folder = tmp_path / "network"
    shutil.copytree(CORRECTIONS, folder)
    config = json.loads((folder / "config.json").read_text())
    config["difference_to"]["sha256"] = "0" * 64
    (folder / "config.json").write_text(json.dumps(config))
    with pytest.raises(GoalNetworkError, match="'goals' is another than the one that was trained further"):
        NetworkWriter.from_pretrained(encoder, folder)
