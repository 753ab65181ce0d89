"""Read files of networks that may come from anybody, up to a limit, before a library sees them."""

from __future__ import annotations

import errno
import json
import os
import stat
import struct
from pathlib import Path
from typing import Any

# Bytes of a JSON file beside weights: the longest of ours, a config with its training's words, has 42 kB.
JSON_BYTES = 1_000_000
# Bytes of the header of a file of weights, and tensors in it: ours have 20 kB and 180. A library of its own would take
# 100 MB, and a minute for half a million empty tensors.
HEADER_BYTES = 2_000_000
TENSORS = 10_000
# Bytes of a file of weights: the largest of ours has 15 MB.
WEIGHTS_BYTES = 200_000_000


class GivenTwiceError(ValueError):
    """A JSON object that contains a key twice: readers differ in which of the two values counts.

    Attributes:
        key: that key.
    """

    def __init__(self, key: str) -> None:
        super().__init__("it gives a key twice in one JSON object")
        self.key = key


def each_key_once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Make a JSON object, for `object_pairs_hook`.

    Raises:
        GivenTwiceError: for a key that is given twice.
    """
    found: dict[str, Any] = {}
    for key, value in pairs:
        if key in found:
            raise GivenTwiceError(key)
        found[key] = value
    return found


def read_regular(path: Path, most: int) -> bytes:
    """Read a regular file of at most `most` bytes; a pipe, which may never end or begin, is not opened.

    Raises:
        OSError: if it cannot be read, is something else, or is larger.
    """
    descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
    with os.fdopen(descriptor, "rb") as file:
        if not stat.S_ISREG(os.fstat(descriptor).st_mode):
            raise OSError(errno.EINVAL, "it is not a file", str(path))
        content = file.read(most + 1)
    if len(content) > most:
        raise OSError(errno.EFBIG, f"it has more than {most} bytes, and no more are read", str(path))
    return content


def read_json(path: Path, most: int = JSON_BYTES) -> Any:
    """Read a JSON file.

    Raises:
        OSError: as `read_regular`.
        ValueError: if it is not JSON, or lists are in lists too deep to be read.
    """
    try:
        return json.loads(read_regular(path, most))
    except RecursionError as error:
        raise ValueError("its lists are too deep") from error


def check_weights(path: Path, most: int = WEIGHTS_BYTES) -> None:
    """Check the header of a file of weights (safetensors), before memory is allocated for it.

    What is in the header is checked by the library: types, shapes, and where the numbers are.

    Args:
        path: the file.
        most: bytes that it may have.

    Raises:
        OSError: if it cannot be read, or is no regular file.
        ValueError: if it is too large, its header is not JSON, or it has too many tensors or one twice.
    """
    with os.fdopen(os.open(path, os.O_RDONLY | os.O_NONBLOCK), "rb") as file:
        found = os.fstat(file.fileno())
        if not stat.S_ISREG(found.st_mode):
            raise OSError(errno.EINVAL, "it is not a file", str(path))
        if found.st_size > most:
            raise ValueError(f"it has {found.st_size} bytes; at most {most} are read")
        start = file.read(8)
        length = struct.unpack("<Q", start)[0] if len(start) == 8 else None
        if length is None or length > found.st_size - 8:
            raise ValueError("it is incomplete")
        if length > HEADER_BYTES:
            raise ValueError(f"its header has {length} bytes; at most {HEADER_BYTES} are read")
        header = file.read(length)
    try:
        tensors = json.loads(header.decode(), object_pairs_hook=each_key_once)
    except GivenTwiceError as error:
        raise ValueError(f"its header has {error.key[:60]!r} twice") from error
    except RecursionError as error:
        raise ValueError("its header is too deep") from error
    except UnicodeDecodeError as error:
        raise ValueError("its header is not text") from error
    if not isinstance(tensors, dict) or len(tensors) > TENSORS:
        what = (
            f"lists {len(tensors)} tensors; at most {TENSORS} are read"
            if isinstance(tensors, dict)
            else "is not an object"
        )
        raise ValueError(f"its header {what}")
