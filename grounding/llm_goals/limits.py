"""Say which pieces of a line an instruction does not ask for, which it needs, and which words name objects.

A line with a piece that nobody asked for, or without one that was asked for, fails the checks
(`grounding.llm_goals.checks`), so that a small model is given no such choice.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from grounding.goal_reading.chunk import Chunk
from grounding.goals.parts import EDGES, GROUPINGS, MAX_ROWS, ORDER_KEYS
from grounding.llm_goals.checks import (
    SIDES,
    implied_shapes,
    named_shapes,
    said_keys,
    said_order_keys,
    said_places,
    said_relations,
)
from grounding.llm_goals.lines import PLACED, Said
from grounding.spec import LEGAL_VALUES, SHAPES

_NAMING = ("noun phrase", "except")  # chunks whose words a line copies
_INSIDE = {"in": "inside"}
_EDGE_OF = {"left": "left", "right": "right", "top": "far", "bottom": "near"}


def limited(said: Said, chunks: Sequence[Chunk]) -> Said:
    """Return the words of an instruction with the limits of its line; without any where a word is not understood.

    Args:
        said: the words.
        chunks: the chunks of the instruction, without words that the speaker took back.
    """
    if any(chunk.kind == "unknown" for chunk in chunks):
        return said
    lengths = (frozenset((f" {length}",)) for length in said.lengths)
    return replace(
        said, unasked=frozenset(_unasked(chunks)), needed=(*_needed(chunks), *lengths), naming=_naming(said, chunks)
    )


def _unasked(chunks: Sequence[Chunk]) -> Iterator[str]:
    shapes, keys, orders = implied_shapes(chunks), said_keys(chunks), said_order_keys(chunks)
    yield from (f" {shape} of" for shape in SHAPES if shape not in shapes)
    kinds, verbs = {chunk.kind for chunk in chunks}, {chunk.value for chunk in chunks if chunk.kind == "verb"}
    if "move" not in kinds:
        yield " move of"
    if "swap" not in verbs:
        yield " swap of"
    sizes = keys["size"] if "spread" not in verbs else LEGAL_VALUES["size"]
    yield from (f", {value}" for value in LEGAL_VALUES["size"] if value not in sizes)
    yield from (f", facing {value}" for value in LEGAL_VALUES["rotation"] if value not in keys["rotation"])
    places = {value for _, value in said_places(chunks)} | ({"center", "middle"} if "inner" in kinds else set())
    for slot in ("x_position", "y_position"):
        yield from (f", {value}" for value in LEGAL_VALUES[slot] if value not in places)
    yield from (f", along {edge}" for edge in EDGES if edge not in keys["along"])
    yield from (f", group {by}" for by in GROUPINGS if by not in keys["group_by"])
    for key in ("rows", "columns"):
        yield from (f", {key} {count}" for count in range(1, MAX_ROWS + 1) if count not in keys[key])
    alike = {"height", "volume"} if orders & {"height", "volume"} else set()
    yield from (f", order {by}" for by in ORDER_KEYS if by != "listed" and by not in orders | alike)
    yield from _unasked_relations(chunks)


def _unasked_relations(chunks: Sequence[Chunk]) -> Iterator[str]:
    said, places = said_relations(chunks), {value for _, value in said_places(chunks)}
    kinds, verbs = {chunk.kind for chunk in chunks}, {chunk.value for chunk in chunks if chunk.kind == "verb"}
    implied = {relation for relation, (_, side) in SIDES.items() if side in places}
    implied |= {"next to"} if "beside each other" in kinds else set()
    implied |= {"on"} if "stack" in verbs else set()
    implied |= {"around"} if "inner" in kinds or verbs & {"surround", "circle"} else set()
    for relation in (*PLACED, "around"):
        if not said[relation] and relation not in implied:
            yield f", {_INSIDE.get(relation, relation)}"


def _needed(chunks: Sequence[Chunk]) -> Iterator[frozenset[str]]:
    """Yield sets of pieces of which a line needs one each."""
    keys = said_keys(chunks)
    yield from (frozenset((f" {shape} of", " grid of")) for shape in named_shapes(chunks) if shape == "line")
    yield from (frozenset((f" {shape} of",)) for shape in named_shapes(chunks) if shape != "line")
    for relation, count in said_relations(chunks).items():
        if count and relation in (*PLACED, "around"):
            yield frozenset((f", {_INSIDE.get(relation, relation)}",))
    if any(chunk.kind == "move" for chunk in chunks):
        yield frozenset((" move of",))
    if any(chunk.kind == "verb" and chunk.value == "swap" for chunk in chunks):
        yield frozenset((" swap of",))
    yield from (frozenset((f", {value}",)) for value in sorted(keys["size"]))
    yield from (frozenset((f", facing {value}",)) for value in sorted(keys["rotation"]))
    yield from (frozenset((f", along {edge}",)) for edge in sorted(keys["along"]))
    yield from (frozenset((f", group {by}",)) for by in sorted(keys["group_by"]))
    for key in ("rows", "columns"):
        yield from (frozenset((f", {key} {count}",)) for count in sorted(keys[key]))
    for _, value in sorted(said_places(chunks)):
        sides = {f", {relation}" for relation, (_, side) in SIDES.items() if side == value}
        yield frozenset((f", {value}", f" {value}", f", along {_EDGE_OF.get(value, value)}", *sides))
    if any(chunk.kind in ("order", "order end") for chunk in chunks):
        yield frozenset(f", order {by}" for by in ORDER_KEYS)


def _naming(said: Said, chunks: Sequence[Chunk]) -> tuple[bool, ...]:
    """Say of each word whether it stands in a phrase that names objects; empty where the phrases are not found."""
    naming, first = [False] * len(said.words), 0
    for chunk in chunks:
        if chunk.kind not in _NAMING:
            continue
        words = Said.of(chunk.said).words
        place = next((i for i in range(first, len(naming)) if said.words[i : i + len(words)] == words), None)
        if place is None:
            return ()
        first = place + len(words)
        naming[place:first] = [True] * len(words)
    return tuple(naming) if any(naming) else ()
