"""Read the training language: frames with holes, and the phrases that fill them.

`language/frames_*.txt` has one frame a line, `labels => text`: the labels that the fixed words say,
and a text whose holes ({x}, {a_shape}, {not_size_adj} ...) bring their own. `language/phrases.toml`
has the phrases per hole and value, `structures/*.toml` those of each shape. All are plain text, to be
read and extended by people.
"""

from __future__ import annotations

import lzma
import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, lru_cache
from importlib import resources

from grounding.parse_result import REFUSALS
from grounding.spec import FIRST_VALUES
from grounding.structure_words import STRUCTURES

FRAME_FILES = (
    "frames_plain", "frames_wording", "frames_corrections", "frames_passing", "frames_distraction", "frames_spoken",
)  # fmt: skip
# Hole -> the slots that it fills. A hole with "not_" before it names another value and fills nothing.
SLOTS_OF_HOLE: Mapping[str, tuple[str, ...]] = {
    "a_shape": ("shape",),
    "shape_noun": ("shape",),
    "do_shape": ("shape",),
    "size_adj": ("size",),
    "size_adv": ("size",),
    "x": ("x_position",),
    "x_adj": ("x_position",),
    "y": ("y_position",),
    "y_adj": ("y_position",),
    "xy": ("x_position", "y_position"),
    "rot": ("rotation",),
    "heading": ("rotation",),
}
# Hole -> which phrases of a shape's own file fill it.
_OF_STRUCTURES: Mapping[str, str] = {"shape_noun": "noun", "do_shape": "action"}
OTHER_HOLES = ("objects", "object", "nouns", "noun", "fact", "other_shape", "idle")
_HOLE = re.compile(r"\{(?P<negated>not_)?(?P<name>\w+)\}")


class FrameError(ValueError):
    """Raised for an invalid frame; the message names the file, the line and the legal values."""


@dataclass(frozen=True)
class Hole:
    """A place to fill: its kind, and whether it names another value than the intended one."""

    name: str
    negated: bool


@dataclass(frozen=True)
class Frame:
    """A sentence with holes.

    Attributes:
        pieces: text and holes, in turns.
        labels: slot -> value that the fixed words say.
        refuse: why it has to be refused, one of `REFUSALS`, or `None`.
    """

    pieces: tuple[str | Hole, ...]
    labels: Mapping[str, str]
    refuse: str | None

    @property
    def holes(self) -> tuple[Hole, ...]:
        """List the holes in the order of the text."""
        return tuple(piece for piece in self.pieces if isinstance(piece, Hole))


def read_frame(line: str, where: str) -> Frame:
    """Read the frame of one line; `where` names the line in errors.

    Raises:
        FrameError: for a line without an arrow, an unknown label, value or hole.
    """
    said, arrow, text = line.partition("=>")
    if not arrow or not text.strip():
        raise FrameError(f"{where}: a frame reads 'labels => text', and this one has no text: {line!r}")
    labels: dict[str, str] = {}
    refuse = None
    for entry in filter(None, (part.strip() for part in said.split(","))):
        slot, _, value = entry.partition("=")
        legal = tuple(REFUSALS) if slot == "refuse" else FIRST_VALUES.get(slot)
        if legal is None:
            raise FrameError(f"{where}: unknown label {slot!r}; legal: refuse, {', '.join(FIRST_VALUES)}")
        if value not in legal:
            raise FrameError(f"{where}: {slot} cannot be {value!r}; legal values: {', '.join(legal)}")
        if slot == "refuse":
            refuse = value
        else:
            labels[slot] = value
    return Frame(_pieces(text.strip(), where), labels, refuse)


def _pieces(text: str, where: str) -> tuple[str | Hole, ...]:
    pieces: list[str | Hole] = []
    end = 0
    for match in _HOLE.finditer(text):
        name = match["name"]
        if name not in SLOTS_OF_HOLE and (match["negated"] or name not in OTHER_HOLES):
            raise FrameError(f"{where}: unknown hole {match[0]}; legal: {', '.join((*SLOTS_OF_HOLE, *OTHER_HOLES))}")
        pieces += [text[end : match.start()], Hole(name, bool(match["negated"]))]
        end = match.end()
    pieces.append(text[end:])
    return tuple(piece for piece in pieces if piece)


def all_frames() -> Mapping[str, tuple[Frame, ...]]:
    """Read all frames: file -> frames."""
    return {name: frames_of(name) for name in FRAME_FILES}


@cache
def frames_of(name: str) -> tuple[Frame, ...]:
    """Read the frames of one of `FRAME_FILES`; the largest is packed (`xzcat` prints it)."""
    folder = resources.files("grounding") / "language"
    packed = folder / f"{name}.txt.xz"
    text = lzma.decompress(packed.read_bytes()) if packed.is_file() else (folder / f"{name}.txt").read_bytes()
    lines = text.decode().splitlines()
    return tuple(
        read_frame(line, f"{name}.txt, line {number}")
        for number, line in enumerate(lines, start=1)
        if line.strip() and not line.startswith("#")
    )


@lru_cache(maxsize=1)
def all_phrases() -> Mapping[str, Mapping[str, tuple[str, ...]]]:
    """Read all phrases: table -> value -> phrases. A shape's own phrases of a hole are the table `own_table` names."""
    text = (resources.files("grounding") / "language" / "phrases.toml").read_text(encoding="utf-8")
    tables: dict[str, dict[str, tuple[str, ...]]] = {}
    for table, values in tomllib.loads(text).items():
        kind = _OF_STRUCTURES.get(table)
        tables[table] = {shape: structure.phrases[kind] for shape, structure in STRUCTURES.items()} if kind else {}
        tables[table] |= {value: tuple(phrases) for value, phrases in values.items()}
        for shape, structure in STRUCTURES.items():
            if table in structure.own_phrases:
                tables[own_table(table, shape)] = dict(structure.own_phrases[table].phrases)
    return tables


def own_table(hole: str, shape: str) -> str:
    """Name the table of the phrases that only one shape has for a hole."""
    return f"{hole} of a {shape}"
