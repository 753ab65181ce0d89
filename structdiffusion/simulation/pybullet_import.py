"""Import PyBullet without its greeting on standard error."""

from __future__ import annotations

import os
import sys


def import_pybullet_silently() -> None:
    """Import PyBullet without the build time that it prints on standard error."""
    sys.stderr.flush()
    kept, nowhere = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 2)
    try:
        import pybullet  # noqa: F401
    finally:
        os.dup2(kept, 2)
        os.close(kept)
        os.close(nowhere)
