"""Find figures by name: those that are shipped, then those that were taught; the one in a file, "like FILE"; a drawing.

Nothing is kept in memory that a file could contradict: a name can be written to JSON, sent to another process and
resolved there. A file is parsed only when its figure is used; for the names its first lines are enough.
"""

from __future__ import annotations

import os
import re
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import cache, lru_cache
from pathlib import Path

from grounding.figures.drawings import DRAWING, drawn
from grounding.figures.figure import Figure, FigureError
from grounding.figures.files import BYTES, read_figure
from grounding.figures.words import WORD, written
from grounding.untrusted_files import read_regular
from grounding.user_folder import user_folder

LIBRARY = Path(__file__).parent / "library"
LIKE = "like "  # before the path of a figure's file, in place of a name
VARIABLE = "STRUCTAGENT_STRUCTURES"  # in the environment: the folder of taught figures


def taught_folder(environment: Mapping[str, str] = os.environ) -> Path | None:
    """Return the folder of the taught figures, beside the user's configuration file; `None` without a home folder."""
    if given := environment.get(VARIABLE):
        return Path(given).absolute()
    folder = user_folder(environment)
    return None if folder is None else folder / "structures"


def file_name(name: str) -> str:
    """Return the name of a figure's file: "letter_t.toml" for "letter T".

    Raises:
        FigureError: for a name without a letter or digit.
    """
    slug = "_".join(re.findall(r"\w+", name.lower()))
    if not slug:
        raise FigureError(f"a figure cannot be called {name!r}; legal: letters and digits")
    return f"{slug[:80]}.toml"


def figure_named(name: str) -> Figure:
    """Return the figure of a name, of the file in "like FILE", or of "drawing NAME <DRAWING>": then this is its name.

    Raises:
        FigureError: if there is none, or its file is wrong.
    """
    if name.startswith(LIKE):
        return replace(_read(Path(name.removeprefix(LIKE))), name=name)
    if name.startswith(WORD):
        return written(name.removeprefix(WORD), figure_named)
    if name.startswith(DRAWING):
        return drawn(name)
    return _read(file_of(name))


def file_of(name: str) -> Path:
    """Return the file of a figure that is shipped or taught.

    Raises:
        FigureError: if there is none, or its file is wrong.
    """
    for folder in _folders():
        path = folder / file_name(name)
        if path.is_file() and _read(path).name == name:
            return path
    raise FigureError(f"no figure is called {name!r}; `structagent structures list` shows all")


def is_figure(name: str) -> bool:
    """Return whether a name has a figure that can be used."""
    try:
        return bool(figure_named(name))
    except FigureError:
        return False


def figure_names() -> tuple[str, ...]:
    """Return the names of all figures, the shipped ones first."""
    return tuple(figure_nouns())


def shipped_names() -> tuple[str, ...]:
    """Return the names of the figures that are shipped, in order."""
    return tuple(figure_nouns(taught=False))


def figure_nouns(taught: bool = True) -> Mapping[str, tuple[str, ...]]:
    """Return name -> nouns of all figures; a file that cannot be read is left out.

    A taught figure with the name of a shipped one is left out: the name means the shipped one.

    Args:
        taught: whether taught figures are among them.
    """
    found = dict(_shipped_nouns())
    folder = taught_folder() if taught else None
    if folder is not None and folder.is_dir():
        for name, nouns in _nouns_in(folder).items():
            found.setdefault(name, nouns)
    return found


@cache
def _shipped_nouns() -> Mapping[str, tuple[str, ...]]:
    """Return name -> nouns of the shipped figures, once: their files are a part of this package."""
    return _nouns_in(LIBRARY)


def _nouns_in(folder: Path) -> dict[str, tuple[str, ...]]:
    """Return name -> nouns of the figures in a folder, the first file of a name."""
    found: dict[str, tuple[str, ...]] = {}
    for path in sorted(folder.glob("*.toml")):
        for name, nouns in _head(path):
            found.setdefault(name, nouns)
    return found


def _folders() -> Iterator[Path]:
    yield LIBRARY
    taught = taught_folder()
    if taught is not None and taught.is_dir():
        yield taught


def _read(path: Path) -> Figure:
    try:
        stamp = path.stat()
    except OSError as error:
        raise FigureError(f"{path} cannot be read: {error.strerror or error}") from error
    return _read_once(path, stamp.st_mtime_ns, stamp.st_size)


@lru_cache(maxsize=512)
def _read_once(path: Path, written: int, size: int) -> Figure:
    """Read a file once as long as it is not written again."""
    return read_figure(path)


def _head(path: Path) -> list[tuple[str, tuple[str, ...]]]:
    try:
        stamp = path.stat()
        return _head_once(path, stamp.st_mtime_ns, stamp.st_size)
    except OSError:
        return []


@lru_cache(maxsize=512)
def _head_once(path: Path, written: int, size: int) -> list[tuple[str, tuple[str, ...]]]:
    """Return the name and the nouns of a file of which only these lines are parsed; [] if it is no file of a figure."""
    text = read_regular(path, BYTES).decode("utf-8", "replace")
    lines = re.findall(r"^(?:name|nouns) *=.*$", text, re.MULTILINE)
    try:
        entries = tomllib.loads("\n".join(lines))
        return [(str(entries["name"]), tuple(map(str, entries["nouns"])))]
    except (tomllib.TOMLDecodeError, KeyError, TypeError):
        return []
