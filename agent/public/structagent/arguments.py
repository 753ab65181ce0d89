"""Check single arguments; each is refused in one sentence that names it, its value and the legal values."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from agent.errors import BAD_INPUT, USAGE
from structagent.errors import StructagentError

MOST_SEED = 2**63 - 1
LONGEST_NAME = 80  # characters


def bad_input(message: str) -> StructagentError:
    """Make the error of data that cannot be used."""
    return StructagentError(message, BAD_INPUT)


def wrong_argument(message: str) -> StructagentError:
    """Make the error of an argument that is not legal."""
    return StructagentError(message, USAGE)


def shown(value: object, longest: int = 60) -> str:
    """Write a value as a message shows it: on one line, and short."""
    if hasattr(value, "shape") and hasattr(value, "dtype"):
        return f"an array of shape {tuple(value.shape)}"
    text = " ".join(repr(value).split())
    return text if len(text) <= longest else text[: longest - 3] + "..."


def is_listing(value: object) -> bool:
    """Return whether a value is a list, a tuple or an array that can be counted; an endless iterator is not."""
    return not isinstance(value, str | bytes) and hasattr(value, "__len__") and hasattr(value, "__getitem__") and (
        isinstance(value, Sequence) or hasattr(value, "shape")
    )  # fmt: skip


def as_array(value: Any, place: str, legal: str) -> np.ndarray:
    """Convert any real-valued array-like to a NumPy array of its own dtype; tensors come to the CPU.

    Raises:
        StructagentError: for ragged lists, and for values that are no real numbers.
    """
    try:
        if hasattr(value, "detach"):  # a tensor of torch, which may want a gradient or lie on a GPU
            value = value.detach().cpu()
            value = (value.float() if value.dtype.is_floating_point and value.element_size() == 2 else value).numpy()
        array = np.asarray(value)
    except (ValueError, TypeError, RuntimeError, OverflowError) as error:
        raise bad_input(
            f"{place} is not an array of numbers ({' '.join(str(error).split())}); legal: {legal}"
        ) from None
    if array.dtype.kind not in "fiu":
        raise bad_input(f"{place} has the dtype {array.dtype}; legal: {legal}")
    return array


def check_text(text: Any) -> None:
    """Check that a value is text.

    Raises:
        StructagentError: for any value except a string that can be encoded as UTF-8.
    """
    if not isinstance(text, str):
        raise wrong_argument(f"the instruction cannot be {shown(text)}; legal: a sentence in English")
    try:
        text.encode("utf-8")
    except UnicodeEncodeError as error:
        raise wrong_argument(f"the instruction has a character at place {error.start} that is not text") from None


def check_choice(argument: str, value: Any, legal: Sequence[str]) -> None:
    """Check that a value is one of the legal ones.

    Raises:
        StructagentError: naming the argument, the value and the legal ones.
    """
    if not isinstance(value, str) or value not in legal:
        raise wrong_argument(f"{argument} cannot be {shown(value)}; legal: {', '.join(legal)}")


def checked_integer(argument: str, value: Any, least: int, most: int) -> int:
    """Check a whole number, which may be of a NumPy type, and return it as `int`.

    Raises:
        StructagentError: for any other value, and outside the limits.
    """
    legal = f"legal: a whole number of {least} to {most}"
    dimensions: Any = getattr(value, "ndim", 0)
    if isinstance(value, bool) or not hasattr(value, "__index__") or dimensions:
        raise wrong_argument(f"{argument} cannot be {shown(value)}; {legal}")
    number = value.__index__()
    if not least <= number <= most:
        raise wrong_argument(f"{argument} cannot be {number}; {legal}")
    return number


def checked_pose(pose: Any) -> np.ndarray:
    """Check and return a rigid transform (4, 4) as float64.

    Raises:
        StructagentError: for anything else.
    """
    legal = "a rigid transform (4, 4): a rotation, metres, and the last row 0 0 0 1"
    array = as_array(pose, "world_from_camera", legal).astype(np.float64)
    rigid = array.shape == (4, 4) and np.isfinite(array).all() and np.allclose(array[3], (0, 0, 0, 1), atol=1e-6)
    if (
        not rigid
        or np.abs(array[:3, :3] @ array[:3, :3].T - np.eye(3)).max() > 1e-3
        or np.linalg.det(array[:3, :3]) < 0
    ):
        raise wrong_argument(f"world_from_camera of shape {array.shape} is not a rigid transform; legal: {legal}")
    return array
