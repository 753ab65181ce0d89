"""Define the line format in which a small language model writes a goal, with its grammar.

A goal is one line, "tower of the cans, left; place of the mug, next to part 1, 10 cm." Objects and lengths are words of
the instruction itself, so that the model copies and never invents. `goal_line` yields what may follow, piece by piece.
"""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass
from typing import Any

from grounding.goals.parts import DIRECTIONAL, EDGES, MOVE_DIRECTIONS, ORDER_KEYS, SHAPES_OF_KEY, order_starts
from grounding.resolve.tokens import words_of
from grounding.spec import LEGAL_VALUES, SHAPES, SLOTS_OF_SHAPE, X_POSITIONS, Y_POSITIONS

# Answers instead of a goal: nothing to arrange; what cannot be built; what can be read in several ways.
NO_GOAL = ("nothing", "impossible", "unclear")
EVERYTHING = " (all)"
MOST_PARTS, MOST_OBJECTS, MOST_WORDS = 6, 6, 8
PLACED = (*DIRECTIONAL, "next to", "between", "on", "in")
_DIRECTION = {" up": "ascending", " down": "descending"}


@dataclass(frozen=True)
class Said:
    """The words of an instruction that a line may copy.

    Attributes:
        words: in small letters; `None` where punctuation stands.
        lengths: the text's lengths with their units, in its own words.
        counts: whole numbers of the text.
    """

    words: tuple[str | None, ...]
    lengths: tuple[str, ...] = ()
    counts: tuple[int, ...] = ()

    @classmethod
    def of(cls, text: str, lengths: Sequence[str] = (), counts: Sequence[int] = ()) -> Said:
        """Divide a text into words; numbers and their units are parted, as the lengths must be."""
        return cls(tuple(w if w[0].isalnum() else None for w in words_of(text)), tuple(lengths), tuple(counts))

    def names(self, place: int) -> bool:
        """Return whether there is a word at a place."""
        return place < len(self.words) and self.words[place] is not None

    @property
    def text(self) -> str:
        """Return the words as the model is shown them: commas between them where punctuation stands."""
        return " ".join(word or "," for word in self.words).replace(" ,", ",")


# Yields the pieces that may follow, takes the one that does, and returns the parts as JSON has them.
Line = Generator[list[str], str, "list[dict[str, Any]] | str"]


def goal_line(said: Said) -> Line:
    """Yield the legal pieces of a line one after the other; see `Line`. A word of `NO_GOAL` comes back in place of
    parts.
    """
    parts: list[dict[str, Any]] = []
    # A structure that is referred to stands before or after: which numbers exist is known at the end only.
    while True:
        heads = {f" {shape} of": shape for shape in SHAPES} | {" structure of": None}
        answers = [f" {word}." for word in NO_GOAL] if not parts else []
        head = yield [*heads, " place of", " move of", " swap of", *answers]
        if head in answers:
            return head[1:-1]
        if head in heads:
            part, end = yield from _structure(said, heads[head])
        elif head == " place of":
            part, end = yield from _place(said, sum(one["kind"] == "structure" for one in parts))
        elif head == " move of":
            part, end = yield from _move(said)
        else:
            objects, end = yield from _objects(said, _ends(len(parts)))
            part = {"kind": "relation", "relation": "swapped", "objects": objects}
        parts.append(part)
        if end == ".":
            return _numbered(parts)


def _ends(parts: int) -> list[str]:
    return [".", ";"] if parts + 1 < MOST_PARTS else ["."]


def _numbered(parts: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return the parts with "structure k" of the line made the number of that part."""
    structures = [number for number, part in enumerate(parts) if part["kind"] == "structure"]
    for part in parts:
        for key in ("objects", "reference"):
            if isinstance(part.get(key), dict):
                part[key] = {"part": structures[part[key]["part"]]}
    return parts


def _objects(
    said: Said, ends: Sequence[str], structures: int = 0, everything: bool = False, most: int = MOST_OBJECTS
) -> Generator[list[str], str, tuple[Any, str]]:
    """Read noun phrases of the instruction, a structure or everything, and the piece that ends them."""
    phrases: list[str] = []
    while True:
        special = {f" structure {k + 1}": {"part": k} for k in range(structures)} if not phrases else {}
        special |= {EVERYTHING: None} if everything and not phrases else {}
        starts = [f" {word}" for word in dict.fromkeys(w for p, w in enumerate(said.words) if said.names(p))]
        piece = yield [*special, *(word for word in starts if word not in special)]
        if piece in special:
            return special[piece], (yield list(ends))
        phrase = [piece[1:]]
        places = [place for place, word in enumerate(said.words) if word == phrase[0] and said.names(place)]
        while True:
            follow = {said.words[p + 1] or "" for p in places if said.names(p + 1)}
            more = [f" {word}" for word in sorted(follow)] if len(phrase) < MOST_WORDS else []
            joined = [" +"] if len(phrases) + 1 < most else []
            piece = yield [*ends, *joined, *more]
            if piece not in more:
                break
            phrase.append(piece[1:])
            places = [p + 1 for p in places if said.names(p + 1) and said.words[p + 1] == phrase[-1]]
        phrases.append(" ".join(phrase))
        if piece in ends:
            return list(dict.fromkeys(phrases)), piece


def _structure(said: Said, shape: str | None) -> Generator[list[str], str, tuple[dict[str, Any], str]]:
    part: dict[str, Any] = {"kind": "structure", "shape": shape}
    keys = _keys_of(said, shape)

    def following(after: int) -> list[str]:
        return [f", {key}" for rank, (key, _, _) in enumerate(keys) if rank > after] + [".", ";"]

    part["objects"], end = yield from _objects(said, following(-1), everything=True)
    while end not in (".", ";"):
        rank = next(i for i, (key, _, _) in enumerate(keys) if f", {key}" == end)
        _, name, value = keys[rank]
        rank = max(i for i, (_, other, _) in enumerate(keys) if other == name)
        ends = following(rank)
        if name == "order":
            part["order"], end = yield from _order(value, shape, ends)
        elif name == "around":
            part[name], end = yield from _objects(said, ends, most=1)
        elif value is None:
            part[name] = (yield [f" {length}" for length in said.lengths])[1:]
            end = yield ends
        else:
            part[name] = value
            end = yield ends
    return part, end


def _keys_of(said: Said, shape: str | None) -> list[tuple[str, str, Any]]:
    """List what may follow in the line of a shape: the piece, its key, and its value; `None` for a length to come."""
    slots = SLOTS_OF_SHAPE[shape]
    found: list[tuple[str, str, Any]] = []
    for slot, before in (("size", ""), ("x_position", ""), ("y_position", ""), ("rotation", "facing ")):
        if slot in slots:
            found += [(f"{before}{value}", slot, value) for value in LEGAL_VALUES[slot]]

    def takes(key: str) -> bool:
        return shape in SHAPES_OF_KEY[key]

    found += [(f"order {by}", "order", by) for by in ORDER_KEYS] if takes("order") else []
    found += [(key, key, None) for key in ("gap", "radius", "length") if takes(key) and said.lengths]
    for key in ("rows", "columns"):
        found += [(f"{key} {count}", key, count) for count in sorted(set(said.counts))] if takes(key) else []
    found += [("around", "around", None)] if takes("around") else []
    found += [(f"along {edge}", "along", edge) for edge in EDGES] if takes("along") else []
    found += [(f"group {by}", "group_by", by) for by in ("colour", "kind")] if takes("group_by") else []
    return found


def _order(by: str, shape: str | None, ends: Sequence[str]) -> Generator[list[str], str, tuple[dict[str, Any], str]]:
    start = {f" from {place}": place for place in order_starts(shape)}
    order: dict[str, Any] = {"by": by, "direction": None, "from": None}
    piece = yield [*(_DIRECTION if by != "listed" else ()), *start, *ends]
    if piece in _DIRECTION:
        order["direction"] = _DIRECTION[piece]
        piece = yield [*start, *ends]
    if piece in start:
        order["from"] = start[piece]
        piece = yield list(ends)
    return order, piece


def _place(said: Said, before: int) -> Generator[list[str], str, tuple[dict[str, Any], str]]:
    part: dict[str, Any] = {"kind": "relation"}
    relations = {f", {'inside' if one == 'in' else one}": one for one in (*PLACED, "at")}
    part["objects"], piece = yield from _objects(said, list(relations), before)
    part["relation"] = relation = relations[piece]
    if relation == "at":
        x = {f" {value}": value for value in X_POSITIONS}
        y = {f" {value}": value for value in Y_POSITIONS}
        piece = yield [*x, *y]
        if piece in x:
            part["x_position"] = x[piece]
            piece = yield [*y, ".", ";"]
        if piece in y:
            part["y_position"] = y[piece]
            piece = yield [".", ";"]
        return part, piece
    ends = [".", ";"] + ([", distance"] if said.lengths and relation in (*DIRECTIONAL, "next to") else [])
    part["reference"], end = yield from _objects(said, ends, before, most=2 if relation == "between" else 1)
    if end == ", distance":
        part["distance"] = (yield [f" {length}" for length in said.lengths])[1:]
        end = yield [".", ";"]
    return part, end


def _move(said: Said) -> Generator[list[str], str, tuple[dict[str, Any], str]]:
    ways = {f", {way}": way for way in MOVE_DIRECTIONS} if said.lengths else {}
    objects, piece = yield from _objects(said, list(ways) or ["."])
    if not ways:
        return {"kind": "relation", "relation": "moved", "objects": objects}, piece
    length = (yield [f" {length}" for length in said.lengths])[1:]
    end = yield [".", ";"]
    return {
        "kind": "relation",
        "relation": "moved",
        "objects": objects,
        "direction": ways[piece],
        "distance": length,
    }, end


def pieces_of(line: str, said: Said) -> list[str]:
    """Divide a line into its pieces.

    Raises:
        ValueError: for a line that is not legal for this instruction; the message shows where.
    """
    steps, pieces, rest = goal_line(said), [], line
    legal = next(steps)
    while True:
        fitting = [piece for piece in legal if rest.startswith(piece) and not rest[len(piece) :][:1].isalnum()]
        if not fitting:
            raise ValueError(f"the line {line!r} is not legal at {rest[:40]!r}")
        piece = max(fitting, key=len)
        pieces.append(piece)
        rest = rest[len(piece) :]
        try:
            legal = steps.send(piece)
        except StopIteration:
            if rest:
                raise ValueError(f"the line {line!r} goes on after its end") from None
            return pieces


def parts_of(line: str, said: Said) -> list[dict[str, Any]] | str:
    """Read a line: the parts as JSON values, with the instruction's words for objects and lengths; see `goal_line`."""
    steps = goal_line(said)
    next(steps)
    try:
        for piece in pieces_of(line, said):
            steps.send(piece)
    except StopIteration as end:
        return end.value
    raise ValueError(f"the line {line!r} has no end")
