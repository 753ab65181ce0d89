"""Check the installed files, the prompts, the cache and the terminal, without another process."""

from __future__ import annotations

import hashlib
import os
import shutil
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TextIO

from agent import __version__
from agent.diagnostics.installation import changed_files, reinstall
from agent.errors import one_sentence


@dataclass(frozen=True)
class Check:
    """The result of one check.

    Attributes:
        group: the group of the check, such as "packages".
        name: what was checked.
        works: whether it works.
        needed: whether structagent, as configured, fails without it.
        detail: what was found.
        repair: the command or advice that repairs it; empty if the check passed or no repair is known.
    """

    group: str
    name: str
    works: bool
    needed: bool
    detail: str
    repair: str = ""


def check_installation(root: Path) -> Check:
    """Compare the files of structagent in `root` with their installation."""
    try:
        count, changed = changed_files(root)
    except Exception as error:  # broken metadata
        return Check("python", "structagent", False, True, one_sentence(error), reinstall(root))
    if changed:
        said = f"{__version__}; {len(changed)} of {count} files are not as installed: {', '.join(changed[:3])}"
        return Check("python", "structagent", False, True, said, reinstall(root))
    said = f"all {count} files as installed" if count else "a checkout, which has no checksums to compare with"
    return Check("python", "structagent", True, True, f"{__version__} in {root}; {said}")


def check_prompts(root: Path, needed: bool) -> Iterator[Check]:
    """Check that every prompt is the shipped one; a changed prompt silently changes what the language model parses."""
    from prompts import SHIPPED

    for name, shipped in SHIPPED.items():
        path = root / "prompts" / f"{name}.txt"
        repair = reinstall(root, path.relative_to(root).as_posix())
        try:
            found = hashlib.sha256(path.read_text(encoding="utf-8").encode()).hexdigest()
        except (OSError, UnicodeError) as error:
            said = f"{path.name} cannot be read: {one_sentence(error)}"
            yield Check("python", "prompt", False, needed, said, repair)
            continue
        said = f"{path.name} has the SHA-256 {found[:12]}"
        if found == shipped:
            yield Check("python", "prompt", True, needed, f"{said}, as shipped")
        else:
            said = f"{said}, and the shipped one has {shipped[:12]}: the published results do not hold for it"
            yield Check("python", "prompt", False, needed, said, repair)


def check_cache() -> Check:
    """Check that the cache folder can be written to and has room."""
    folder = Path(os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")) / "structagent"
    try:
        there = next(path for path in (folder, *folder.parents) if path.exists())
        free = shutil.disk_usage(there).free / 1e9
        writable = there.is_dir() and os.access(there, os.W_OK | os.X_OK)
    except (OSError, StopIteration) as error:
        return Check("machine", "cache", False, False, one_sentence(error), "export XDG_CACHE_HOME=/tmp/cache")
    said = f"{folder}, {free:.1f} GB free" if writable else f"{folder} cannot be written"
    enough = writable and free > 0.5
    return Check("machine", "cache", enough, False, said, "" if enough else "export XDG_CACHE_HOME=/tmp/cache")


def check_terminal(stream: TextIO) -> Check:
    """Check the size, the colours and the encoding of the terminal behind `stream`."""
    try:
        columns, lines = os.get_terminal_size(stream.fileno())
        here = f"{columns}x{lines}"
    except (OSError, ValueError):
        here = "none, output goes to a file or pipe"
    encoding = (sys.stdout.encoding or "ascii").lower()
    colour = "colour" if has_colour(stream) else "no colour"
    said = f"{here}; TERM {os.environ.get('TERM', 'not set')}; {colour}; {encoding}"
    if encoding.replace("-", "") != "utf8":
        said = f"{said}, and pictures need utf-8"
        return Check("machine", "terminal", False, False, said, "export PYTHONIOENCODING=utf-8")
    return Check("machine", "terminal", True, False, said)


def has_colour(stream: TextIO) -> bool:
    """Tell whether a stream is a terminal with colour, and the user wants colour."""
    return stream.isatty() and not os.environ.get("NO_COLOR") and os.environ.get("TERM", "dumb") != "dumb"
