"""Draw instructions of one to four parts, each with the line that a language model should write.

Clauses come from `language/goal_clauses.txt` and `goal_additions.txt`, positions, sizes and headings from
`phrases.toml`; they are joined as people join wishes: with "and", "then", full stops, pronouns, left-out verbs and
corrections of themselves.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from functools import lru_cache
from importlib import resources

import numpy as np

from grounding.goals.parts import EDGES
from grounding.llm_goals.lines import Said, pieces_of
from grounding.spec import SLOTS_OF_SHAPE
from grounding.training.goal_phrases import COLOURS, GoalPhrases, phrases

_GRID = {2: ("two", "2"), 3: ("three", "3"), 4: ("four", "4"), 5: ("five", "5"), 6: ("six", "6"), 1: ("one", "1")}
_EDGE_WORDS = {"near": ("near", "front", "closest", "bottom"), "far": ("far", "back", "rear", "farthest", "top"),
               "left": ("left", "left-hand"), "right": ("right", "right-hand")}  # fmt: skip
_IMPOSSIBLE = ("spell {w} with {G}", "write the letter {c} with {G}", "arrange {G} as a heart",
               "build a bridge out of {G}",
               "make a star from {G}", "draw a face with {G}", "build a wall of several layers with {G}",
               "put {G} in a spiral",
               "make a smiley out of {G}", "form the word {w} with {G}", "arrange {G} in a zigzag",
               "build a house with {G}",
               "make a hexagon from "
               "{G}", "tilt {O} by 30 degrees", "throw {O} away", "open {O}", "cut {O} in half", "paint {O} red",
               "hang {O} over {R1}", "turn {O} upside down", "make {O} disappear", "lean {O} against {R1}")  # fmt: skip
_JOINS = (" and ", ", and ", " and then ", ", then ", "; ", ". ", ". then ", ". after that ", ", ", " then ", ". also ",
          ". next ",
          ", and also ", ". finally ", " while you ", " plus ", ", afterwards ", " - and ", ". and ")  # fmt: skip
_RELATION_ENDS = {"left of": "right of", "right of": "left of", "in front of": "behind", "behind": "in front of"}
_SHAPE_NOUNS = {"line": ("line", "row"), "circle": ("circle", "ring"), "tower": ("tower", "stack"),
                "cluster": ("group", "cluster"),
                "table setting": ("setting",)}  # fmt: skip
_CHOICE = re.compile(r"\(([^()]*\|[^()]*)\)")
_HOLE = re.compile(r"\{(\w+)\}")
_NOUN = re.compile(r"\ban? (line|row|circle|ring|grid|rectangle|square|triangle|arc|cross|half circle)\b(?!,)")
_PLACES = ("left of", "right of", "in front of", "behind", "next to", "between", "on", "in")


@dataclass(frozen=True)
class GoalSentence:
    """An instruction and its line.

    Attributes:
        text: the instruction, in small letters.
        line: the correct answer of a language model (`grounding.llm_goals.lines`).
        lengths: the lengths that the text names, in its own words.
        counts: the whole numbers of the text.
    """

    text: str
    line: str
    lengths: tuple[str, ...]
    counts: tuple[int, ...]


@dataclass
class _Drawn:
    """The state of the parts of one instruction that were drawn so far."""

    lengths: list[str] = field(default_factory=list)
    counts: list[int] = field(default_factory=list)
    structures: list[str] = field(default_factory=list)  # their shapes
    last: str | None = None  # what "it" means now: a noun phrase, or "structure k"


@lru_cache(maxsize=1)
def _clauses() -> tuple[tuple[bool, str, str], ...]:
    found = []
    for line in _lines("goal_clauses.txt"):
        label, text = line.split(" => ")
        found.append((label.startswith("with "), label.removeprefix("with "), text))
    return tuple(found)


@lru_cache(maxsize=1)
def _additions() -> dict[str, list[tuple[str, str]]]:
    found: dict[str, list[tuple[str, str]]] = {}
    for line in _lines("goal_additions.txt"):
        shapes, rest = line.split(": ", 1)
        label, text = rest.split(" => ")
        for shape in shapes.split():
            found.setdefault(shape, []).append((label, text))
    return found


def _lines(name: str) -> list[str]:
    text = resources.files("grounding").joinpath("language", name).read_text(encoding="utf-8")
    return [line for line in text.splitlines() if line and not line.startswith("#")]


class GoalSentences(GoalPhrases):
    """Instructions of several parts, drawn one after the other."""

    def draw(self) -> GoalSentence:
        """Draw one instruction whose line is legal: phrases that run together by chance can make it ambiguous."""
        while True:
            sentence = self._draw()
            try:
                pieces_of(sentence.line, Said.of(sentence.text, sentence.lengths, sentence.counts))
            except ValueError:
                continue
            return sentence

    def _draw(self) -> GoalSentence:
        if self.rng.random() < 0.05:
            return self._no_goal()
        drawn = _Drawn()
        texts: list[str] = []
        parts: list[str] = []
        for number in range(int(self.rng.choice([1, 2, 3, 4], p=[0.36, 0.45, 0.15, 0.04]))):
            putting = (
                number > 0 and texts[-1].startswith(("put ", "place ", "set ", "arrange ")) and self.rng.random() < 0.45
            )
            text, lines = self._clause(drawn, putting)
            texts.append(text)
            parts += lines
        if self.rng.random() < 0.04:
            texts.insert(int(self.rng.integers(len(texts) + 1)), self._untouched(drawn))
        text = texts[0]
        for after in texts[1:]:
            text += (
                str(self.rng.choice([" and ", ", ", ", and "] if not after.split()[0] in _VERBS else _JOINS)) + after
            )
        text = self._framed(text)
        lengths = tuple(length for length in dict.fromkeys(drawn.lengths) if length in text)
        return GoalSentence(text, " " + "; ".join(parts) + ".", lengths, tuple(drawn.counts))

    def _no_goal(self) -> GoalSentence:
        drawn = _Drawn()
        if self.rng.random() < 0.4:
            text, answer = self.one(phrases()["idle"]["any"]), "nothing"
        else:
            text, answer = self.one(_IMPOSSIBLE), "impossible"
            text = text.replace("{w}", self.one(("hello", "love", "yes", "hi"))).replace("{c}", self.one("abcdefhkst"))
            text, _ = self._filled(text, drawn)
            if self.rng.random() < 0.3:
                clause, _ = self._clause(drawn, False)
                text = f"{clause} and {text}" if self.rng.random() < 0.5 else f"{text}, then {clause}"
        text = re.sub(r"\{\w+\}", "it", text).lower()
        return GoalSentence(text, f" {answer}.", tuple(dict.fromkeys(drawn.lengths)), tuple(drawn.counts))

    def _clause(self, drawn: _Drawn, putting: bool) -> tuple[str, list[str]]:
        """Draw a clause and its parts of the line."""
        kinds = {"structure": 0.5, "place": 0.34, "move": 0.1, "swap": 0.06}
        kind = str(self.rng.choice(list(kinds), p=list(kinds.values())))
        if putting:
            kind = str(self.rng.choice(["structure", "place"], p=[0.6, 0.4]))
        if kind == "structure":
            shape = self._shape(putting)
            options = [(label, text) for w, label, text in _clauses() if w == putting and _head(label) == shape]
        elif kind == "place":
            relation = str(self.rng.choice([*_PLACES, "at"]))
            options = [
                (la, t) for w, la, t in _clauses() if w == putting and la.startswith(f"place of {{O}}; {relation} ")
            ]
        else:
            options = [(la, t) for w, la, t in _clauses() if w == putting and la.startswith(f"{kind} of ")]
        label, text = options[self.rng.integers(len(options))]
        if kind == "structure":
            return self._structure(label, text, drawn)
        return self._relation(label, text, drawn)

    def _untouched(self, drawn: _Drawn) -> str:
        text, _ = self._filled(self.one([text for _, label, text in _clauses() if label == "none"]), drawn)
        return text

    def _shape(self, putting: bool) -> str:
        shapes = sorted(
            {_head(label) for w, label, _ in _clauses() if w == putting} - {"place", "move", "swap", "none"}
        )
        weights = np.array([3.0 if shape in ("line", "circle", "tower") else 1.0 for shape in shapes])
        return str(self.rng.choice(shapes, p=weights / weights.sum()))

    def _structure(self, label: str, text: str, drawn: _Drawn) -> tuple[str, list[str]]:
        shape = _head(label)
        keys = label.split("; ")[1:]
        text, values = self._filled(text, drawn)
        added: list[tuple[str, str]] = []
        wide = _NOUN.search(text) if "size" in SLOTS_OF_SHAPE.get(shape, ()) and self.rng.random() < 0.15 else None
        if wide:
            size = self.one(("small", "large"))
            adjective = self.one(phrases()["size_adj"][size])
            article = "an" if adjective[0] in "aeiou" else "a"
            text = f"{text[: wide.start()]}{article} {adjective} {wide.group(1)}{text[wide.end() :]}"
            keys = [*keys, size]
        for _ in range(int(self.rng.choice([0, 1, 2], p=[0.3, 0.5, 0.2])) if "{AT}" not in label else 0):
            if (addition := self._addition(shape, drawn)) and not _clash(addition[0], [k for k, _ in added] + keys):
                added.append(addition)
        before = [
            t for k, t in added if re.fullmatch(r"left|right|center|top|middle|bottom", k) and self.rng.random() < 0.2
        ]
        for phrase in (t for _, t in added if t not in before):
            text += phrase if phrase.startswith(",") else f" {phrase}"
        for phrase in before:
            text = f"{phrase}, {text}" if self.rng.random() < 0.7 else f"{phrase} {text}"
        head = values.get("G") or values.get("T") or "(all)"
        filled = [
            one for key in keys for one in ([*values["AT"].split()] if key == "{AT}" else [self._label(key, values)])
        ]
        filled += [one for key, _ in added for one in key.split(", ")]
        own = f"structure {len(drawn.structures) + 1}"
        drawn.structures.append(shape)
        line = ", ".join([f"{shape} of {head}", *sorted(filter(None, filled), key=_rank)])
        drawn.last = own
        lines = [line]
        ones = re.match(rf"(the|all|my) ({'|'.join(COLOURS)}) \w+$", head)
        if ones and self.rng.random() < 0.35:
            other = f"the {self.one(COLOURS)} ones"
            drawn.structures.append(shape)
            text += self.one(
                (f", and {other} too", f" and {other} as well", f", then {other}", f", and the same with {other}")
            )
            return text, [line, f"{shape} of {other}"]
        if self.rng.random() < 0.14 and shape != "table setting" and "{AT}" not in label:
            relation = self.one(("left of", "right of", "in front of", "behind", "next to"))
            place, spoken = self.object(), self.one(_SPOKEN[relation])
            text = (
                f"{text} {spoken} {place}"
                if self.rng.random() < 0.75
                else f"{spoken} {place}{self.one((', ', ' '))}{text}"
            )
            lines.append(f"place of {own}, {relation} {place}")
        return text, lines

    def _relation(self, label: str, text: str, drawn: _Drawn) -> tuple[str, list[str]]:
        correction = None
        text, values = self._filled(text, drawn)
        keys = [self._label(key, values) for key in label.split("; ")[1:]]
        objects = values.get("O") or values.get("P")
        head = label.split(" of ")[0]
        if head == "place" and keys[0].split(" ")[0] != "at" and self.rng.random() < 0.05:
            old = next((r for r in _RELATION_ENDS if keys[0].startswith(r + " ")), None)
            if old is not None:
                correction = _RELATION_ENDS[old]
                keys[0] = correction + keys[0].removeprefix(old)
                text += self.one((", no, ", ", sorry, ", " - actually ", ", wait, ", ", I mean ")) + f"{correction} it"
        line = f"{head} of {objects}, " + ", ".join(k.replace("in ", "inside ", 1) if k.startswith("in ") and not
                                                      k.startswith("in front") else k for k in keys)  # fmt: skip
        if head == "swap":
            line = f"swap of {objects}"
        drawn.last = values.get("R") or (drawn.last if head != "place" else None)
        if head == "place" and keys and keys[0].startswith("at "):
            drawn.last = values["O"] if self.rng.random() < 0.5 else None
        return text, [line]

    def _filled(self, text: str, drawn: _Drawn) -> tuple[str, dict[str, str]]:
        """Fill the choices and holes of a text; return the label of each hole."""
        text = _CHOICE.sub(lambda match: self.one(match.group(1).split("|")), text)
        values: dict[str, str] = {}

        def fill(match: re.Match[str]) -> str:
            said, values[match.group(1)] = self._hole(match.group(1), drawn)
            return said

        return _HOLE.sub(fill, text), values

    def _hole(self, hole: str, drawn: _Drawn) -> tuple[str, str]:
        if hole == "G":
            return self.group()
        if hole == "T":
            a, b, c = (self.object() for _ in range(3))
            said = self.one((f"{a}, {b}, then {c}", f"first {a}, then {b}, then {c}", f"{a}, then {b} and then {c}",
                              f"{a}, {b}, {c}", f"first {a}, then {b} and last {c}", f"{a}, {b} and {c}"))  # fmt: skip
            return said, f"{a} + {b} + {c}"
        if hole == "O" and self.rng.random() < 0.07:
            return self.group_of_one_kind()
        if hole in ("O", "R1"):
            said = self.object()
            return said, said
        if hole == "R":
            return self._reference(drawn)
        if hole == "P":
            first, second = self.object(), self.object()
            return f"{first} and {second}", f"{first} + {second}"
        if hole == "L":
            drawn.lengths.append(self.length())
            return drawn.lengths[-1], drawn.lengths[-1]
        if hole in ("N", "M"):
            count = int(self.rng.integers(2, 6))
            drawn.counts.append(count)
            return self.one(_GRID[count]), str(count)
        if hole == "E":
            edge = self.one(EDGES)
            return self.one(_EDGE_WORDS[edge]), edge
        if hole == "AT":
            return self.place_on_table()
        raise ValueError(f"no hole {hole!r}")

    def _label(self, key: str, values: dict[str, str]) -> str:
        return _HOLE.sub(lambda match: values[match.group(1)], key)

    def _addition(self, shape: str, drawn: _Drawn) -> tuple[str, str] | None:
        slots = SLOTS_OF_SHAPE.get(shape, SLOTS_OF_SHAPE["line"])
        kinds = [kind for kind in ("x_position", "y_position", "xy", "size", "rotation", "key", "key", "key") if kind in
                 (*slots, "xy", "key")]  # fmt: skip
        kind = self.one(kinds)
        if kind == "key":
            options = _additions().get(shape, [])
            if not options:
                return None
            label, text = options[self.rng.integers(len(options))]
            text, values = self._filled(text, drawn)
            return self._label(label, values), text
        if kind == "xy":
            said, label = self.place_on_table()
            return label.replace(" ", ", "), said
        name = {"x_position": "x", "y_position": "y", "size": "size_adv", "rotation": "rot"}[kind]
        value = self.one([v for v in phrases()[name] if kind != "size" or v != "medium" or self.rng.random() < 0.3])
        said = self.one(phrases()[name][value][:40])
        return (f"facing {value}" if kind == "rotation" else value), said

    def _reference(self, drawn: _Drawn) -> tuple[str, str]:
        if drawn.last is not None and self.rng.random() < 0.4:
            if drawn.last.startswith("structure "):
                shape = drawn.structures[int(drawn.last.split()[1]) - 1]
                nouns = [f"the {noun}" for noun in _SHAPE_NOUNS.get(shape, (shape,)) if shape != "structure"]
                return self.one(["it", "them", "that", *nouns]), drawn.last
            return self.one(("it", "it", "that", "that one")), drawn.last
        said = self.object()
        return said, said

    def _framed(self, text: str) -> str:
        """Return the text with what people say around it."""
        draw = self.rng.random()
        if draw < 0.12:
            text = f"{self.one(phrases()['opening']['any'])} {text}"
        elif draw < 0.2:
            text = (
                f"{self.one(('please', 'could you', 'can you', 'would you', 'I want you to', 'now', 'kindly'))} {text}"
            )
        elif draw < 0.28:
            text = f"{text}{self.one((', ', ' '))}{self.one(phrases()['closing']['any'])}"
        return f"{text}{self.one(('', '', '.', '!'))}".lower()


_SPOKEN = {
    "left "
    "of": ("to the left of", "left of"), "right of": ("to the right of", "right of"), "in front of": ("in front of",),
    "behind": ("behind",), "next to": ("next to", "beside"),
}  # fmt: skip
_VERBS = frozenset(word for _, _, text in _clauses() for word in re.findall(r"[a-z]+", text.split("{")[0])[:8])
_ORDER = ("size", "x", "y", "facing", "order", "gap", "radius", "length", "rows", "columns", "around", "along", "group")
_VALUES = {
    **dict.fromkeys(("small", "medium", "large"), "size"), **dict.fromkeys(("left", "center", "right"), "x"),
    **dict.fromkeys(("top", "middle", "bottom"), "y"),
}  # fmt: skip


def _head(label: str) -> str:
    return label.split(" of ")[0]


def _key(label: str) -> str:
    first = label.split()[0]
    return _VALUES.get(first, first)


def _rank(label: str) -> int:
    return _ORDER.index(_key(label))


def _clash(label: str, others: list[str]) -> bool:
    kinds = {_key(part) for other in others if other and not other.startswith("{") for part in other.split(", ")}
    own = {_key(part) for part in label.split(", ")}
    if "along" in own | kinds and ({"x", "y", "facing"} & (own | kinds)):
        return True
    if {"gap", "size"} <= own | kinds or {"length", "gap"} <= own | kinds or {"radius", "gap"} <= own | kinds:
        return True
    return bool(own & kinds) or ({"radius", "length"} & own | {"radius", "length"} & kinds and "size" in own | kinds)
