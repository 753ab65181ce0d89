"""Decide which files a chat may name: any, or those in a few folders where other programs can drive it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from agent.errors import UsageError
from grounding.parse_result import shortened


@dataclass(frozen=True)
class FileAccess:
    """The files that `/load`, `/save`, `/example` and `/report` may name.

    Attributes:
        folders: where they may lie; `None` for anywhere.
    """

    folders: Sequence[Path] | None = None

    def path(self, command: str, text: str) -> Path:
        """Return the path that was typed, with `~` expanded; in a few folders alone also with links followed, so that
        what was checked is what is opened.

        Raises:
            UsageError: if it lies outside the folders, or cannot be a path.
        """
        path = Path(text)
        if text.startswith("~/"):
            path = path.expanduser()
        if self.folders is None:
            return path
        try:
            followed = path.resolve()
            inside = any(followed.is_relative_to(folder.resolve()) for folder in self.folders)
        except (OSError, RuntimeError, ValueError) as error:  # links in a circle, a zero byte
            raise UsageError(f"{command} cannot take {shortened(text)!r}: it is not the path of a file") from error
        if not inside:
            legal = " and ".join(repr(str(folder)) for folder in self.folders)
            raise UsageError(
                f"{command} from a page takes only files in {legal}, but {shortened(text)!r} lies outside; "
                "`structagent serve --any-file` takes any"
            )
        return followed
