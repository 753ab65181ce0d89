"""Define the chunks that an instruction is divided into."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Chunk:
    """A chunk of an instruction.

    Attributes:
        kind: "verb", "noun phrase", "shape", "place", "relation", "gap", "and", "comma", "unknown" and so on.
        value: what it says.
        first, end: its words.
        metres: the length in it, where it has one.
        said: its words, as they were written.
    """

    kind: str
    value: Any
    first: int
    end: int
    metres: float | None = None
    said: str = ""


@dataclass(frozen=True)
class Shape:
    """A shape and what stands with its noun: size, rotation, rows and columns; `definite` for "the row".

    `count` is 0 for several of which the number is not said: "in piles".

    `measured` is what the length in the chunk says of it: "length of" in "a 40 cm long row", "radius", "diameter" or "wide".
    """

    name: str
    size: str | None = None
    rotation: str | None = None
    grid: tuple[int | None, int | None] = (None, None)
    definite: bool = False
    linked: bool = False
    count: int = 1
    measured: str | None = None
