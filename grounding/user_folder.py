"""Tell where the user's own files are: the configuration, and the figures that were taught."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path


def user_folder(environment: Mapping[str, str]) -> Path | None:
    """Return the user's folder, in `XDG_CONFIG_HOME` or `~/.config`; `None` without a home folder."""
    base = environment.get("XDG_CONFIG_HOME", "")
    if not os.path.isabs(base):  # empty or relative, which the XDG specification says to ignore
        base = os.path.join(environment.get("HOME") or os.path.expanduser("~"), ".config")
    return Path(base) / "structagent" if os.path.isabs(base) else None
