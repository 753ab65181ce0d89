"""Compare the installed files of the tool with the checksums that its installation recorded."""

from __future__ import annotations

import base64
import hashlib
import importlib.metadata
import json
import shlex
import sys
from pathlib import Path

from agent.diagnostics.requirements import NAME


def changed_files(root: Path) -> tuple[int, list[str]]:
    """Count the files of the tool in `root` that have a recorded checksum, and list those that differ or are missing.

    A checkout or an editable installation has no recorded checksums.

    Raises:
        OSError: for a file that exists but cannot be read.
    """
    try:
        files = importlib.metadata.files(NAME) or []
    except importlib.metadata.PackageNotFoundError:
        return 0, []
    count, changed = 0, []
    for file in files:
        path = Path(str(file.locate()))
        outside = file.parts[0].endswith((".dist-info", "..")) or path.resolve() != (root / file).resolve()
        if outside or file.hash is None or file.hash.mode != "sha256":
            continue
        count += 1
        if not path.is_file() or _checksum(path) != file.hash.value:
            changed.append(str(file))
    return count, changed


def reinstall(root: Path, part: str = "") -> str:
    """Return the command that restores the tool's own files; in a checkout it restores one part only, to keep other
    edits.
    """
    if part and (root / ".git").exists():
        return f"git -C {shlex.quote(str(root))} checkout -- {part}"
    return f"{shlex.quote(sys.executable)} -m pip install --force-reinstall --no-deps {_origin()}"


def _origin() -> str:
    """Return what the tool was installed from, as pip takes it; never a bare name, which somebody else may have
    published.
    """
    try:
        origin = json.loads(importlib.metadata.distribution(NAME).read_text("direct_url.json") or "{}")
        return shlex.quote(str(origin["url"]))
    except (importlib.metadata.PackageNotFoundError, ValueError, KeyError, TypeError, OSError):
        return "WHEEL_OR_CHECKOUT_OF_STRUCTAGENT"


def _checksum(path: Path) -> str:
    """Return a file's checksum as the installation's record writes it."""
    with path.open("rb") as file:
        digest = hashlib.file_digest(file, "sha256").digest()
    return base64.urlsafe_b64encode(digest).rstrip(b"=").decode()
