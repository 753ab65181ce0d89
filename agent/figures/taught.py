"""Keep the figures that users teach: one file each, in the folder beside the user's configuration."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from agent.errors import NotWritten, UsageError
from grounding.figures.figure import Figure, FigureError
from grounding.figures.files import write_figure
from grounding.figures.names import VARIABLE, figure_named, figure_nouns, file_name, taught_folder
from grounding.parse_result import shortened
from grounding.resolve import figure_names


def teach(name: str, read: Callable[[str], Figure]) -> tuple[Figure, Path]:
    """Keep a figure under a name.

    Args:
        name: what people will call it.
        read: returns the figure for that name; a known one may have its own.

    Returns:
        The figure and its file. A figure of this name that was taught before is replaced.

    Raises:
        UsageError: for a name that something else has, or that cannot be one.
        FigureError: if there is no figure.
        NotWritten: if its file cannot be written.
    """
    name = checked_name(name)
    figure = replace(read(name), name=name, nouns=(name,))
    path = _folder() / file_name(name)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_figure(figure, path)
    except (OSError, FigureError) as error:
        raise NotWritten(f"the figure {name!r} cannot be kept: {error}") from error
    return figure, path


def forget(name: str) -> Path:
    """Remove the file of a taught figure; return its path.

    Raises:
        UsageError: for a figure that was not taught.
    """
    path = _folder() / file_name(name)
    if not path.is_file():
        known = ", ".join(taught_names()) or "none"
        raise UsageError(f"no figure {shortened(name)!r} was taught; taught figures: {known}")
    path.unlink()
    return path


def taught_names() -> tuple[str, ...]:
    """Return the names of the taught figures."""
    shipped = figure_nouns(taught=False)
    return tuple(name for name in figure_nouns() if name not in shipped)


def figure_said(noun: str) -> Figure:
    """Return the figure of a noun or a name; capitals do not matter: "letter t", "smiley face".

    Raises:
        FigureError: if there is none.
    """
    said = " ".join(noun.lower().split())
    named = (name for name, nouns in figure_nouns().items() if said in (name.lower(), *map(str.lower, nouns)))
    return figure_named(next(named, noun))


def checked_name(name: str) -> str:
    """Return a name for a figure, in small letters and without its article.

    Raises:
        UsageError: for a name that a shape or a shipped figure has, of more than four words, or without letters.
    """
    try:
        return figure_names.checked_name(name)
    except FigureError as error:
        raise UsageError(str(error)) from error


def _folder() -> Path:
    folder = taught_folder()
    if folder is None:
        raise UsageError(f"there is no home folder to keep figures in; set {VARIABLE} to a folder")
    return folder
