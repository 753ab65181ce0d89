"""What libraries say of themselves is nobody's result."""

from __future__ import annotations

import os
import sys


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
