"""Make the parts of a goal, with the instruction's words for objects, of what the goal network wrote."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from grounding.goal_network.beam_search import WrittenGoal
from grounding.goal_network.goal_rendition import AfterGoal
from grounding.goal_network.vocabulary import HEADS, KEYWORD, KEYWORDS, NO_GOAL, STRUCTURE_HEADS, Action
from grounding.resolve.measures import lengths_of
from grounding.resolve.tokens import split, words_of

DIAMETER = re.compile(r"\b(?:diameter|across|wide|width)\b", re.IGNORECASE)
RADIUS = re.compile(r"\bradius\b", re.IGNORECASE)


class UnreadLengthError(ValueError):
    """Words that were copied for a length, and that are none; the message quotes them."""


@dataclass(frozen=True)
class WrittenParts:
    """The parts of a written goal.

    Attributes:
        parts: as JSON values, with words of the instruction for objects and lengths in metres.
        kept: the words for what is to stay as it is.
        answer: a word of `NO_GOAL` in place of parts, or "".
    """

    parts: tuple[dict[str, Any], ...] = ()
    kept: tuple[str, ...] = ()
    answer: str = ""


def parts_of(written: WrittenGoal, text: str) -> WrittenParts:
    """Return the parts of a written goal.

    Raises:
        UnreadLengthError: for a length that is none.
    """
    return _Parts(written, _lengths(text), text).read()


@lru_cache(maxsize=16)  # the goals of a text have its lengths
def _lengths(text: str) -> Mapping[str, float]:
    """Find the lengths of a text: its words -> metres."""
    said = split(text)
    return {
        " ".join(words_of(said.quote(first, end))): abs(metres) for first, (metres, end) in lengths_of(said).items()
    }


class _Parts:
    """A reader of actions, one after another."""

    def __init__(self, written: WrittenGoal, lengths: Mapping[str, float], text: str) -> None:
        self.written, self.lengths, self.text = written, lengths, text
        self.after_lengths = isinstance(written, AfterGoal) and " cm" in written.rendition.text
        self.at = 0

    @property
    def next(self) -> str:
        """Return the keyword that comes; "" for a phrase or the end."""
        if self.at == len(self.written.actions):
            return ""
        action: Action = self.written.actions[self.at]
        return KEYWORDS[action.value] if action.kind == KEYWORD else ""

    def take(self) -> str:
        """Take a keyword."""
        self.at += 1
        action = self.written.actions[self.at - 1]
        return KEYWORDS[action.value]

    def phrase(self) -> str:
        """Take a phrase."""
        self.at += 2
        return self.written.phrase(self.at - 2)

    def objects(self) -> Any:
        """Take objects: their words, `None` for all, or a structure by its number."""
        if self.next == "(all)":
            self.take()
            return None
        if self.next.startswith("structure "):
            return {"part": int(self.take().split()[1]) - 1}
        found = [self.phrase()]
        while not self.next and self.at < len(self.written.actions):
            found.append(self.phrase())
        return found

    def length(self) -> float:
        """Take a length, in metres."""
        phrase = self.phrase()
        for words, metres in self.lengths.items():
            if f" {phrase} " in f" {words} " or f" {words} " in f" {phrase} ":
                return metres
        if self.after_lengths and (found := _lengths(f"{phrase} cm")):
            return next(iter(found.values()))  # "make that 20", of a goal in centimetres
        raise UnreadLengthError(f"has {phrase!r} for a length")

    def is_diameter(self, phrase: str) -> bool:
        """Tell whether the words of a radius are those of a diameter: by themselves, or by the text around them."""
        return DIAMETER.search(phrase) is not None or (
            DIAMETER.search(self.text) is not None and RADIUS.search(self.text) is None
        )

    def read(self) -> WrittenParts:
        """Take all parts."""
        if self.next in NO_GOAL:
            return WrittenParts(answer=self.take())
        parts: list[dict[str, Any]] = []
        kept: list[str] = []
        while self.next in HEADS:
            head = self.take()
            objects = self.objects()
            if head == "keep of":
                kept += objects or []
            elif head in STRUCTURE_HEADS:
                parts.append(self.structure(head.removesuffix(" of"), objects))
            elif head == "swap of":
                parts.append({"kind": "relation", "relation": "swapped", "objects": objects})
            elif head == "move of":
                way = self.take().removeprefix("move ")
                move = {"relation": "moved", "objects": objects, "direction": way, "distance": self.length()}
                parts.append({"kind": "relation"} | move)
            else:
                parts.append(self.place(objects))
        return WrittenParts(_numbered(parts), tuple(kept))

    def structure(self, shape: str, objects: Any) -> dict[str, Any]:
        """Take the keys of a structure."""
        part: dict[str, Any] = {"kind": "structure", "shape": None if shape == "structure" else shape}
        part["objects"] = objects
        while self.next and self.next not in HEADS:
            word = self.take()
            name, _, value = word.partition(" ")
            if name in ("size", "along"):
                part[name] = value
            elif name in ("x", "y"):
                part[f"{name}_position"] = value
            elif name == "facing":
                part["rotation"] = value
            elif name == "group":
                part["group_by"] = value
            elif name == "order":
                part["order"] = {"by": value, "direction": None, "from": None}
            elif name in ("ascending", "descending"):
                part["order"]["direction"] = name
            elif name == "from":
                part["order"]["from"] = value
            elif name in ("rows", "columns"):
                part[name] = int(self.take().split()[1])
            elif name == "around":
                part["around"] = self.objects()
            else:
                across = name == "radius" and self.is_diameter(self.written.phrase(self.at))
                part[name] = self.length() / (2 if across else 1)
        return part

    def place(self, objects: Any) -> dict[str, Any]:
        """Take where some objects go."""
        part: dict[str, Any] = {"kind": "relation", "objects": objects, "relation": self.take().removeprefix("rel ")}
        if part["relation"] == "at":
            while self.next[:2] in ("x ", "y "):
                axis, value = self.take().split()
                part[f"{axis}_position"] = value
            return part
        part["reference"] = self.objects()
        if self.next == "distance":
            self.take()
            part["distance"] = self.length()
        return part


def _numbered(parts: list[dict[str, Any]]) -> tuple[dict[str, Any], ...]:
    """Return the parts with "structure k" made the number of that part; one that does not exist is illegal later."""
    structures = [number for number, part in enumerate(parts) if part["kind"] == "structure"]
    for part in parts:
        for key in ("objects", "reference"):
            value = part.get(key)
            if isinstance(value, dict):
                part[key] = {"part": structures[value["part"]] if value["part"] < len(structures) else len(parts)}
    return tuple(parts)
