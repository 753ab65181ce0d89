"""Files of arrays: what is torn, strange or lacking is told in one sentence."""

import numpy as np
import pytest

from structdiffusion.data.npz_files import DataFolderError, read_arrays, save_arrays

ARRAYS = {"goal": np.arange(6.0).reshape(2, 3), "words": np.array(["a", "b"])}


@pytest.fixture
def path(tmp_path):
    save_arrays(tmp_path / "shard.npz", ARRAYS)
    return tmp_path / "shard.npz"


def test_arrays_come_back(path):
    there = read_arrays(path)
    assert list(there) == list(ARRAYS)
    assert all(np.array_equal(there[name], array) for name, array in ARRAYS.items())
    assert list(read_arrays(path, "words")) == ["words"]
    assert [file.name for file in path.parent.iterdir()] == ["shard.npz"]


def test_what_is_no_such_file_is_told(path, tmp_path):
    content = path.read_bytes()
    for spoilt in (content[: len(content) // 2], b"", b"text", content[:60] + b"\xff" * 20 + content[80:]):
        path.write_bytes(spoilt)
        with pytest.raises(
            DataFolderError, match=r"shard.npz is incomplete, or not a file of arrays; remove it, and `structag"
        ):
            read_arrays(path)
    with path.open("wb") as file:
        np.save(file, ARRAYS["goal"])
    with pytest.raises(DataFolderError, match="shard.npz is one array, and must be a file of named arrays"):
        read_arrays(path)
    with pytest.raises(FileNotFoundError):
        read_arrays(tmp_path / "other.npz")


def test_an_array_that_is_lacking_is_named(path):
    with pytest.raises(DataFolderError, match="shard.npz lacks the array 'frame'; remove it"):
        read_arrays(path, "goal", "frame")
