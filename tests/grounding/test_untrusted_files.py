"""Files of networks from anybody: what is wrong is said before it costs memory or time."""

import json
import os
import struct
from pathlib import Path

import numpy as np
import pytest
from safetensors.numpy import save

from grounding.untrusted_files import HEADER_BYTES, TENSORS, check_weights, read_json, read_regular


def weights(path: Path, header: bytes, body: bytes = b"", length: int | None = None) -> Path:
    path.write_bytes(struct.pack("<Q", len(header) if length is None else length) + header + body)
    return path


EMPTY = {"dtype": "F32", "shape": [0], "data_offsets": [0, 0]}


@pytest.mark.parametrize(
    ("header", "length", "said"),
    [
        (b"{}", 100, "incomplete"),
        (b"{}", 2**63, "incomplete"),
        (b"{}", 2**64 - 1, "incomplete"),
        (b"{}" + b" " * HEADER_BYTES, None, f"at most {HEADER_BYTES} are read"),
        (b"[" * 100_000, None, "too deep"),
        (b'{"a":' * 100_000, None, "too deep"),
        (b"[]", None, "is not an object"),
        (b"{", None, "Expecting"),
        (b"\xff\xfe", None, "is not text"),
        (b'{"a": 1, "b": 2, "a": 1}', None, "has 'a' twice"),
        (b'{"a": {"dtype": "F32", "dtype": "F16"}}', None, "has 'dtype' twice"),
        (json.dumps({f"t{number}": EMPTY for number in range(TENSORS + 1)}).encode(), None, f"at most {TENSORS}"),
    ],
    ids=range(12),
)
def test_a_header_that_no_trainer_writes(header, length, said, tmp_path):
    with pytest.raises(ValueError, match=said):
        check_weights(weights(tmp_path / "w", header, length=length))


@pytest.mark.parametrize("content", [b"", b"1234567"])
def test_a_file_without_a_header(content, tmp_path):
    (tmp_path / "w").write_bytes(content)
    with pytest.raises(ValueError, match="incomplete"):
        check_weights(tmp_path / "w")


def test_a_file_of_holes_is_not_read(tmp_path):
    path = weights(tmp_path / "w", b"{}")
    os.truncate(path, 2**40)
    with pytest.raises(ValueError, match="at most 1000 are read"):
        check_weights(path, 1000)
    with pytest.raises(OSError, match="more than 1000 bytes"):
        read_regular(path, 1000)


@pytest.mark.parametrize("read", [check_weights, read_json, lambda path: read_regular(path, 10)])
def test_a_pipe_or_a_folder_is_not_waited_for(read, tmp_path):
    os.mkfifo(tmp_path / "pipe")
    for path in (tmp_path / "pipe", tmp_path, Path("/dev/zero")):
        with pytest.raises(OSError, match="not a file|Is a directory"):
            read(path)


def test_deep_json_is_a_value_error(tmp_path):
    (tmp_path / "a.json").write_text("[" * 100_000)
    with pytest.raises(ValueError, match="too deep"):
        read_json(tmp_path / "a.json")


def test_what_a_trainer_writes_is_taken(tmp_path):
    (tmp_path / "w").write_bytes(save({"a": np.zeros((2, 3), np.float32)}, {"bits": "4"}))
    check_weights(tmp_path / "w")
    (tmp_path / "a.json").write_text('{"a": 1}')
    assert read_json(tmp_path / "a.json") == {"a": 1}
