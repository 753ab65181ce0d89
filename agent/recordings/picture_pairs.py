"""Pair the depth and colour pictures of a folder: by a file that lists pairs, by their names, or by their times."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from agent.recordings.decimal_commas import is_decimal_comma, refusal

_LIST_SUFFIXES = (".txt", ".csv")
_MOST_BYTES = 5_000_000  # of a list: 50,000 pairs
_TOGETHER = 0.05  # s: pictures that are further apart show another moment
_DIGITS = {19: 1e9, 16: 1e6, 13: 1e3, 10: 1.0}  # of a whole number of units since 1970 -> units a second
_SECONDS = re.compile(r"\d+\.\d+|\d{10,19}")


@dataclass(frozen=True)
class Pair:
    """The colour picture that goes with a depth picture.

    Attributes:
        color: its file.
        note: how it was found, or "" for the same name.
    """

    color: Path
    note: str = ""


def pairs_of(folder: Path, depths: Mapping[str, Path], colors: Mapping[str, Path]) -> dict[str, Pair]:
    """Return the colour picture of each depth picture that has one.

    Args:
        folder: of the pictures; lists of pairs or of times are looked for in it.
        depths, colors: what the name of a picture has beside the word for its kind -> its file.

    Raises:
        BadInput: for a list whose times have decimal commas.
    """
    listed = _listed_pairs(folder, list(depths.values()), list(colors.values()))
    times = _times(folder, [*depths.values(), *colors.values()])
    found = {}
    for name, depth in depths.items():
        if depth in listed:
            color, file = listed[depth]
            told = "" if colors.get(name) == color else f"the colour picture is {_of(color, folder)}, by {file.name}"
            found[name] = Pair(color, told)
        elif name in colors:
            found[name] = Pair(colors[name])
        elif near := _nearest(depth, list(colors.values()), times):
            apart = abs(times[near] - times[depth])
            found[name] = Pair(near, f"the colour picture is {_of(near, folder)}, taken {apart:.3f} s from the depth")
    if not found and len(depths) == len(colors) == 1:
        (name, depth), color = next(iter(depths.items())), next(iter(colors.values()))
        if depth not in times or color not in times:
            found[name] = Pair(color, f"the colour picture is {_of(color, folder)}, the only one")
    return found


def why_none(folder: Path, depth: Path, colors: Mapping[str, Path]) -> str:
    """Say why no colour picture goes with a depth picture, where there are some."""
    names = [_of(color, folder) for color in colors.values()]
    few = ", ".join(names[:3]) + (f" and {len(names) - 3} more" if len(names) > 3 else "")
    return (
        f"no colour picture goes with {_of(depth, folder)}: {few} {'has' if len(names) == 1 else 'have'} another name, "
        f"no file lists them together, and no times say that they were taken within {_TOGETHER:g} s"
    )


def _of(path: Path, folder: Path) -> str:
    return path.relative_to(folder).as_posix()


def _lines(folder: Path) -> Iterator[tuple[Path, list[str]]]:
    """Yield the words in each line of the folder's lists, without comments."""
    for file in sorted(folder.iterdir()):
        if file.suffix.lower() not in _LIST_SUFFIXES or not file.is_file() or file.stat().st_size > _MOST_BYTES:
            continue
        for line in file.read_text(encoding="utf-8-sig", errors="replace").splitlines():
            words = line.partition("#")[0].split()
            if words:
                yield file, words


def _listed_pairs(folder: Path, depths: Sequence[Path], colors: Sequence[Path]) -> dict[Path, tuple[Path, Path]]:
    """Return depth picture -> (colour picture, file) of the lines that name one of each, in any order and column."""
    depth_of, color_of = _by_words(folder, depths), _by_words(folder, colors)
    pairs: dict[Path, tuple[Path, Path]] = {}
    for file, words in _lines(folder):
        each = [part for word in words for part in re.split(r"[,;]", word) if part]
        found = [[table[key] for word in each if (key := _key(word)) in table] for table in (depth_of, color_of)]
        if len(found[0]) == len(found[1]) == 1:
            pairs.setdefault(found[0][0], (found[1][0], file))
    return pairs


def _by_words(folder: Path, files: Sequence[Path]) -> dict[str, Path]:
    """Return the words that may stand for each file: its path in the folder, and its name where no other has it."""
    table = {file.relative_to(folder).as_posix(): file for file in files}
    for file in files:
        table[file.name] = file
    names = [file.name for file in files]
    return {word: file for word, file in table.items() if "/" in word or names.count(word) == 1}


def _key(word: str) -> str:
    """Return a path in a list as it stands in the tables: its last two parts, without quotes."""
    parts = word.strip("\"'").replace("\\", "/").split("/")
    return "/".join([part for part in parts if part not in ("", ".")][-2:])


def _times(folder: Path, files: Sequence[Path]) -> dict[Path, float]:
    """Return when pictures were taken, seconds: as a list of times and files says, or their names.

    Raises:
        BadInput: for a time with a decimal comma.
    """
    times = {file: when for file in files if (when := _seconds(file.stem)) is not None}
    of_word = _by_words(folder, files)
    for file, words in _lines(folder):
        if len(words) == 2 and (picture := of_word.get(_key(words[1]))) is not None:
            if is_decimal_comma(words[0]):
                raise refusal(f"the list {str(file)!r}", words[0])
            if (when := _seconds(words[0])) is not None:
                times[picture] = when
    return times


def _seconds(text: str) -> float | None:
    """Return the seconds that a picture's name or a list gives; `None` for a number that is no time."""
    found = _SECONDS.search(text)
    if found is None:
        return None
    if "." in found[0]:
        return float(found[0])
    return int(found[0]) / _DIGITS[len(found[0])] if len(found[0]) in _DIGITS else None


def _nearest(depth: Path, colors: Sequence[Path], times: Mapping[Path, float]) -> Path | None:
    """Return the colour picture that was taken nearest to a depth picture, if it was near enough."""
    known = [color for color in colors if color in times]
    if depth not in times or not known:
        return None
    nearest = min(known, key=lambda color: abs(times[color] - times[depth]))
    return nearest if abs(times[nearest] - times[depth]) <= _TOGETHER else None
