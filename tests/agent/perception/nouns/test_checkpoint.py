"""Checkpoints are read without PyTorch, and nothing in them is run."""

import os
import pickle

import numpy as np
import pytest
import torch

from agent.errors import BadInput
from agent.perception.nouns.checkpoint import read_tensors


@pytest.fixture
def checkpoint(tmp_path):
    def written(content) -> "os.PathLike[str]":
        torch.save(content, tmp_path / "weights.pth", _use_new_zipfile_serialization=False)
        return tmp_path / "weights.pth"

    return written


def test_tensors_are_those_that_were_saved(checkpoint):
    whole = torch.arange(24, dtype=torch.float32)
    state = {
        "plain": torch.randn(3, 4, generator=torch.Generator().manual_seed(0)),
        "turned": whole.reshape(4, 6).T,  # views of one storage, one of them not contiguous
        "part": whole[5:9],
        "count": torch.tensor(7),
    }
    read = read_tensors(checkpoint(state))
    assert set(read) == set(state)
    for name, tensor in state.items():
        assert np.array_equal(read[name], tensor.numpy()) and read[name].dtype == tensor.numpy().dtype


class Harmful:
    def __reduce__(self):
        return os.system, ("touch harmful-was-run",)


@pytest.mark.parametrize(
    "damage",
    [
        lambda content: content[: len(content) - 3],  # ends within a tensor
        lambda content: b"PK\x03\x04" + content,
        lambda content: b"",
        lambda content: content[:-8] + b"garbage!"[:0],
        lambda content: pickle.dumps(0x1950A86A20F9469CFC6C) + pickle.dumps(Harmful()),
    ],
)
def test_other_files_are_refused_and_not_run(checkpoint, damage, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    file = checkpoint({"a": torch.ones(5)})
    file.write_bytes(damage(file.read_bytes()))
    with pytest.raises(BadInput, match="weights.pth' is not a checkpoint of tensors"):
        read_tensors(file)
    assert not (tmp_path / "harmful-was-run").exists()


def test_a_missing_file_is_reported(tmp_path):
    with pytest.raises(BadInput, match="cannot read .*none.pth': No such file"):
        read_tensors(tmp_path / "none.pth")
