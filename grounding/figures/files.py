"""Read and write the file of a figure: TOML that people can read, edit and share."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from grounding.atomic_files import write_whole
from grounding.figures.figure import MOST, Figure, FigureBlock, FigureError, FigurePlace
from grounding.untrusted_files import read_regular

BYTES = 100_000  # of a file of a figure: the longest of ours has 2 kB
_KEYS = ("name", "nouns", "strokes", "pattern", "blocks", "places", "least", "numbers", "points", "grows")
_NEEDED = ("name", "nouns", "least")
_BLOCK_KEYS = ("x", "level", "width")
_PLACE_KEYS = ("x", "y", "z", "size", "turn")


def read_figure(path: Path) -> Figure:
    """Read the file of a figure.

    Raises:
        FigureError: for a file that cannot be read, is no TOML, or has a wrong key or value: one sentence with the
            file.
    """
    try:
        return figure_from(tomllib.loads(read_regular(path, BYTES).decode("utf-8")))
    except OSError as error:
        raise FigureError(f"{path} cannot be read: {error.strerror or error}") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise FigureError(f"{path} is not a TOML file: {error}") from error
    except FigureError as error:
        raise FigureError(f"{path}: {error}") from error


def figure_from(entries: Mapping[str, Any]) -> Figure:
    """Make the figure of the entries of a file.

    Raises:
        FigureError: for a wrong key or value.
    """
    if unknown := [key for key in entries if key not in _KEYS]:
        raise FigureError(f"unknown key {unknown[0]!r}; legal keys: {', '.join(_KEYS)}")
    if missing := [key for key in _NEEDED if key not in entries]:
        raise FigureError(f"the key {missing[0]!r} is missing")
    strokes = [
        [_pair(point, "strokes") for point in _list(stroke, "strokes")]
        for stroke in _list(entries.get("strokes", []), "strokes")
    ]
    return Figure(
        name=_text(entries["name"], "name"),
        nouns=_texts(entries["nouns"], "nouns"),
        strokes=tuple(map(tuple, strokes)),
        pattern=_texts(entries.get("pattern", []), "pattern"),
        blocks=tuple(sorted(map(_block, _list(entries.get("blocks", []), "blocks")))),
        places=tuple(map(_place, _list(entries.get("places", []), "places"))),
        least=_count(entries["least"], "least"),
        numbers=tuple(_count(one, "numbers") for one in _list(entries.get("numbers", []), "numbers")),
        points=_flag(entries.get("points", False), "points"),
        grows=_texts(entries.get("grows", []), "grows"),
    )  # fmt: skip


def figure_text(figure: Figure) -> str:
    """Return the content of a figure's file."""
    lines = [f"name = {_quoted(figure.name)}", f"nouns = [{', '.join(map(_quoted, figure.nouns))}]"]
    if figure.strokes:
        strokes = ["    [" + ", ".join(f"[{x:g}, {y:g}]" for x, y in stroke) + "]," for stroke in figure.strokes]
        lines += ["strokes = [", *strokes, "]"]
    if figure.pattern:
        lines.append(f"pattern = [{', '.join(map(_quoted, figure.pattern))}]")
    if figure.blocks:
        blocks = [f"    {{x = {one.x:g}, level = {one.level}, width = {one.width:g}}}," for one in figure.blocks]
        lines += ["blocks = [", *blocks, "]"]
    if figure.places:
        lines += ["places = [", *(f"    {_place_text(one)}," for one in figure.places), "]"]
    lines.append(f"least = {figure.least}")
    if figure.numbers:
        lines.append(f"numbers = [{', '.join(map(str, figure.numbers))}]")
    if figure.points:
        lines.append("points = true")
    if figure.grows:
        lines.append(f"grows = [{', '.join(map(_quoted, figure.grows))}]")
    return "\n".join(lines) + "\n"


def write_figure(figure: Figure, path: Path) -> None:
    """Write the file of a figure, as a whole or not at all; its folder must exist.

    Raises:
        FigureError: if it cannot be written.
    """
    try:
        write_whole(path, figure_text(figure))
    except OSError as error:
        raise FigureError(f"{path} cannot be written: {error.strerror or error}") from error


def _quoted(text: str) -> str:
    return '"' + "".join(f"\\u{ord(c):04x}" if ord(c) < 32 or c in '"\\\x7f' else c for c in text) + '"'


def _list(value: Any, key: str) -> Sequence[Any]:
    if not isinstance(value, list):
        raise FigureError(f"{key} cannot be {value!r:.60}; legal: a list")
    return value


def _text(value: Any, key: str) -> str:
    if not isinstance(value, str) or not value.strip():
        raise FigureError(f"{key} cannot be {value!r:.60}; legal: a text that is not empty")
    return value


def _texts(value: Any, key: str) -> tuple[str, ...]:
    return tuple(_text(one, key) for one in _list(value, key))


def _flag(value: Any, key: str) -> bool:
    if not isinstance(value, bool):
        raise FigureError(f"{key} cannot be {value!r:.60}; legal values: true, false")
    return value


def _count(value: Any, key: str) -> int:
    if type(value) is not int or not 1 <= value <= MOST:
        raise FigureError(f"{key} cannot be {value!r:.60}; legal: whole numbers from 1 to {MOST}")
    return value


def _number(value: Any, key: str) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        raise FigureError(f"{key} cannot have {value!r:.60}; legal: finite numbers")
    return float(value)


def _pair(value: Any, key: str) -> tuple[float, float]:
    if not isinstance(value, list) or len(value) != 2:
        raise FigureError(f"{key} cannot have the point {value!r:.60}; legal: pairs of numbers")
    return _number(value[0], key), _number(value[1], key)


def _block(value: Any) -> FigureBlock:
    if not isinstance(value, dict) or not {"x", "level"} <= value.keys() <= set(_BLOCK_KEYS):
        raise FigureError(f"blocks cannot have {value!r:.80}; legal: x, level and width of each block")
    level = value["level"]
    if type(level) is not int or not 0 <= level < MOST:
        raise FigureError(f"level cannot be {level!r:.60}; legal: whole numbers from 0 to {MOST - 1}")
    return FigureBlock(level, _number(value["x"], "blocks"), _number(value.get("width", 1.0), "blocks"))


def _place(value: Any) -> FigurePlace:
    if not isinstance(value, dict) or not {"x", "y", "z", "size"} <= value.keys() <= set(_PLACE_KEYS):
        raise FigureError(f"places cannot have {value!r:.80}; legal: x, y, z, size and turn of each place")
    size = [_number(one, "size") for one in _list(value["size"], "size")]
    if len(size) != 3:
        raise FigureError(f"size cannot be {size!r:.60}; legal: three lengths in metres")
    turn = _number(value["turn"], "turn") if "turn" in value else None
    x, y, z = (_number(value[key], "places") for key in "xyz")
    return FigurePlace(x, y, z, (size[0], size[1], size[2]), turn)


def _place_text(one: FigurePlace) -> str:
    size = ", ".join(f"{length:g}" for length in one.size)
    turn = "" if one.turn is None else f", turn = {one.turn:g}"
    return f"{{x = {one.x:g}, y = {one.y:g}, z = {one.z:g}, size = [{size}]{turn}}}"
