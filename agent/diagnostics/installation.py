"""Whether the tool's own files are those that were installed."""

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
    """How many files of the tool in `root` have a checksum from their installation, and which differ or are gone.

    A checkout, and whatever was installed in place of one, has none.

    Raises:
        OSError: for a file that is there and cannot be read.
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
    """The line that brings the tool's own files back; in a checkout only those of a part, to keep work on others."""
    if part and (root / ".git").exists():
        return f"git -C {shlex.quote(str(root))} checkout -- {part}"
    return f"{shlex.quote(sys.executable)} -m pip install --force-reinstall --no-deps {_origin()}"


def _origin() -> str:
    """What the tool was installed from, as pip takes it; a name would be somebody else's where nobody published it."""
    try:
        origin = json.loads(importlib.metadata.distribution(NAME).read_text("direct_url.json") or "{}")
        return shlex.quote(str(origin["url"]))
    except (importlib.metadata.PackageNotFoundError, ValueError, KeyError, TypeError, OSError):
        return "WHEEL_OR_CHECKOUT_OF_STRUCTAGENT"


def _checksum(path: Path) -> str:
    """As an installation's record has it."""
    with path.open("rb") as file:
        digest = hashlib.file_digest(file, "sha256").digest()
    return base64.urlsafe_b64encode(digest).rstrip(b"=").decode()
