"""Read the tensors of a PyTorch checkpoint without importing PyTorch, which takes longer than recognising a table."""

from __future__ import annotations

import io
import pickle
from collections import OrderedDict
from pathlib import Path
from typing import Any

import numpy as np

from agent.errors import BadInput

_MAGIC = 0x1950A86A20F9469CFC6C  # the first pickle of a checkpoint that PyTorch before 1.6 wrote
_DTYPES = {"FloatStorage": np.dtype("<f4"), "LongStorage": np.dtype("<i8")}


def read_tensors(path: Path) -> dict[str, np.ndarray]:
    """Read a state dict in the format of PyTorch before 1.6; no code in the file is run.

    Returns:
        name -> array of the tensor's shape, float32 or int64.

    Raises:
        BadInput: if the file cannot be read, is of another format, or holds anything but tensors.
    """
    try:
        stream = io.BytesIO(path.read_bytes())
        if pickle.Unpickler(stream).load() != _MAGIC:
            raise pickle.UnpicklingError("another format")
        for _ in ("protocol version", "system"):
            _Reader(stream).load()
        reader = _Reader(stream)
        state = reader.load()
        for key in _Reader(stream).load():
            _fill(reader.storages[key], stream)
    except OSError as error:
        raise BadInput(f"cannot read {str(path)!r}: {error.strerror}") from error
    except (pickle.UnpicklingError, EOFError, KeyError, ValueError, TypeError, IndexError) as error:
        raise BadInput(f"{str(path)!r} is not a checkpoint of tensors in the format of PyTorch before 1.6") from error
    return dict(state)


def _fill(storage: np.ndarray, stream: io.BytesIO) -> None:
    """Read one storage: its length as int64, then its values."""
    length = int.from_bytes(stream.read(8), "little")
    content = stream.read(storage.nbytes)
    if length != len(storage) or len(content) < storage.nbytes:
        raise ValueError("the file ends within a tensor")
    storage[:] = np.frombuffer(content, storage.dtype)


class _Reader(pickle.Unpickler):
    """An unpickler that makes arrays, and refuses every class that a checkpoint of tensors does not need.

    Attributes:
        storages: key -> values (K,), which follow in the file.
    """

    def __init__(self, stream: io.BytesIO) -> None:
        super().__init__(stream)
        self.storages: dict[str, np.ndarray] = {}

    def find_class(self, module: str, name: str) -> Any:
        """Return what stands for a class or function of the file."""
        if (module, name) == ("collections", "OrderedDict"):
            return OrderedDict
        if module == "torch" and name in _DTYPES:
            return _DTYPES[name]
        if (module, name) == ("torch._utils", "_rebuild_tensor_v2"):
            return _view
        raise pickle.UnpicklingError(f"{module}.{name} is not a tensor")

    def persistent_load(self, pid: tuple[Any, ...]) -> np.ndarray:
        """Return the values of a storage, which are read later."""
        _, dtype, key, _, length, _ = pid
        return self.storages.setdefault(key, np.empty(length, dtype))


def _view(storage: np.ndarray, offset: int, shape: tuple[int, ...], stride: tuple[int, ...], *_: Any) -> np.ndarray:
    """Return a tensor's view of its storage."""
    steps = [step * storage.itemsize for step in stride]
    return np.lib.stride_tricks.as_strided(storage[offset:], shape, steps, writeable=False)
