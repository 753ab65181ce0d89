"""Say which pieces of a line an instruction does not ask for, and which of its words name objects.

A line with a piece that nobody asked for fails the checks (`grounding.llm_goals.checks`), so that a small model is given
no such choice. What is asked for is not forced on it: a line that leaves it out is a sign that the model is wrong.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from grounding.goal_reading.chunk import Chunk
from grounding.goals.parts import EDGES, GROUPINGS, MAX_ROWS, ORDER_KEYS
from grounding.llm_goals.lines import PLACED, Said
from grounding.llm_goals.wishes import SIDES, implied_shapes, said_keys, said_order_keys, said_places, said_relations
from grounding.spec import LEGAL_VALUES, SHAPES

_NAMING = ("noun phrase", "except")  # chunks whose words a line copies
_INSIDE = {"in": "inside"}


def limited(said: Said, chunks: Sequence[Chunk]) -> Said:
    """Return the words of an instruction with the limits of its line; without any where a word is not understood.

    Args:
        said: the words.
        chunks: the chunks of the instruction, without words that the speaker took back.
    """
    if any(chunk.kind == "unknown" for chunk in chunks):
        return said
    return replace(said, unasked=frozenset(_unasked(chunks)), naming=_naming(said, chunks))


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
    places |= {chunk.value for chunk in chunks if chunk.kind == "move"}  # the same words as for the way of a move
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
