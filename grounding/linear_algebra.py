"""Keep numpy's products of matrices in one thread."""

from __future__ import annotations

from contextlib import AbstractContextManager
from functools import cache
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from threadpoolctl import ThreadpoolController


@cache
def _linear_algebra() -> ThreadpoolController:
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()


def one_thread() -> AbstractContextManager[object]:
    """Let numpy multiply matrices in one thread within a `with` block.

    Those of a sentence or of an object's picture are too small to share: threads that wait for each other on a busy
    machine take ten times as long. Besides, results do not depend on the number of cores then.
    """
    return _linear_algebra().limit(limits=1, user_api="blas")
