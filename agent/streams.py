"""Standard output is for results alone, whatever libraries print from C."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TextIO


@contextmanager
def results_stream() -> Iterator[TextIO]:
    """Standard output for results alone: what libraries print there from C goes to standard error meanwhile."""
    sys.stdout.flush()
    try:
        descriptor = sys.stdout.fileno()
    except (OSError, ValueError, AttributeError):  # not a file: somebody captures the output in this process
        yield sys.stdout
        return
    kept = os.dup(descriptor)
    os.dup2(2, descriptor)
    try:
        with os.fdopen(kept, "w", buffering=1, encoding="utf-8", closefd=False) as results:
            yield results
    finally:
        sys.stdout.flush()
        os.dup2(kept, descriptor)
        os.close(kept)


def import_pybullet_silently() -> None:
    """Imports PyBullet, which greets with its build time on standard error, without the greeting."""
    sys.stderr.flush()
    kept, nowhere = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 2)
    try:
        import pybullet  # noqa: F401
    finally:
        os.dup2(kept, 2)
        os.close(kept)
        os.close(nowhere)
