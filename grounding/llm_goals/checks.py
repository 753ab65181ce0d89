"""Check that a goal which a language model wrote leaves nothing of the instruction out and adds nothing to it.

The instruction's chunks (`grounding.goal_reading.chunks`) say which nouns, lengths, shapes, places, relations and
orders it has.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from grounding.goal_reading.chunk import Chunk
from grounding.goals.comparison import SAME_LENGTH
from grounding.llm_goals.wishes import (
    SIDES,
    implied_shapes,
    named_shapes,
    said_keys,
    said_order_keys,
    said_places,
    said_relations,
)

_LENGTH_KEYS = ("gap", "radius", "length", "distance")
_IDLE_WORDS = frozenset(
    "the a an my your our his her their this that these those all both each every of any some just only them it one "
    "ones objects object things thing".split()
)


def mismatch(chunks: Sequence[Chunk], parts: Sequence[Mapping[str, Any]]) -> str:
    """Say what a goal leaves out of an instruction, or adds to it; empty where nothing was found.

    Args:
        chunks: the chunks of the instruction, without words that the speaker took back.
        parts: of the goal, as JSON values, with the instruction's words for objects and lengths in metres.
    """
    if denied := [chunk.said for chunk in chunks if chunk.kind in ("negated", "not")]:
        return f"may do what {denied[0]!r} forbids"
    unread = any(chunk.kind == "unknown" for chunk in chunks)
    structures = [part for part in parts if part["kind"] == "structure"]
    relations = [part for part in parts if part["kind"] == "relation"]
    return next(
        filter(
            None,
            (
                _lengths(chunks, parts), _nouns(chunks, parts), _shapes(chunks, structures, relations, unread),
                _relations(chunks, structures, relations, unread), _references(chunks, parts),
                _places(chunks, parts, unread),
                _keys(chunks, structures, unread),
            ),
        ),
        "",
    )  # fmt: skip


def _lengths(chunks: Sequence[Chunk], parts: Sequence[Mapping[str, Any]]) -> str:
    said = [c.metres / (2 if c.kind == "diameter" else 1) for c in chunks if c.metres is not None]
    held = [value for part in parts for key in _LENGTH_KEYS if isinstance(value := part.get(key), (int, float))]

    def among(value: float, others: Sequence[float]) -> bool:
        return any(math.isclose(abs(value), abs(other), rel_tol=SAME_LENGTH) for other in others)

    for value in said:
        if not among(value, held):
            return f"leaves out the length {value * 100:.4g} cm"
    for value in held:
        if not among(value, said):
            return f"has a length of {value * 100:.4g} cm that nobody said"
    return ""


def _nouns(chunks: Sequence[Chunk], parts: Sequence[Mapping[str, Any]]) -> str:
    """Compare the named objects: each noun phrase counts as often as it occurs, plus at most once per pronoun."""
    lists = list(_phrase_lists(parts))
    held = [phrase for phrases in lists for phrase in phrases]
    together = [range(sum(map(len, lists[:k])), sum(map(len, lists[: k + 1]))) for k in range(len(lists))]
    unused = [set(phrase.split()) for phrase in held]
    untouched = set(range(len(held)))
    everything = any(part["kind"] == "structure" and part.get("objects") is None for part in parts)
    # A structure can be meant by the words for its objects: "the cups in a ring, the bowl left of the cups".
    again = sum(isinstance(part.get(key), Mapping) for part in parts for key in ("objects", "reference"))
    pronouns = 0
    for place, chunk in enumerate(chunks):
        if chunk.kind != "noun phrase":
            continue
        words = {word for word in _plain(chunk.said) if word not in _IDLE_WORDS}
        if _left_alone(chunks, place):
            if everything and not any(words <= set(phrase.split()) for phrase in held):
                return f"may move {chunk.said!r}, which stays as it is"
            continue
        if chunk.value.kind in ("pronoun", "structure", "each other") or not words:
            pronouns += 1
            continue
        holding = [i for i, left in enumerate(unused) if words <= left]
        if holding:
            best = min(holding, key=lambda i: len(unused[i]))
            unused[best] -= words
            untouched.discard(best)
        elif chunk.value.kind in ("all", "rest") and everything:
            continue
        elif spread := next((p for p in together if words - {"and"} <= set().union(*(unused[i] for i in p))), None):
            untouched -= {i for i in spread if words & unused[i]}  # "the red and blue blocks": the red + blue blocks
            for i in spread:
                unused[i] -= words
        elif again:
            again -= 1
        else:
            return f"leaves out {chunk.said!r}"
    if len(untouched) > pronouns:
        return f"names {held[min(untouched)]!r} once more than was said"
    return ""


def phrases_of(parts: Iterable[Mapping[str, Any]]) -> list[str]:
    """List the noun phrases of a goal with words for objects."""
    return [phrase for phrases in _phrase_lists(parts) for phrase in phrases]


def _phrase_lists(parts: Iterable[Mapping[str, Any]]) -> Iterator[list[str]]:
    """Return the noun phrases that stand together in a part."""
    for part in parts:
        for key in ("objects", "reference", "around"):
            if isinstance(part.get(key), (list, tuple)):
                yield [" ".join(_plain(phrase)) for phrase in part[key]]


def _plain(said: str) -> list[str]:
    return "".join(char if char.isalnum() or char in "'’.-" else " " for char in said.lower()).replace("-", " ").split()


def _left_alone(chunks: Sequence[Chunk], place: int) -> bool:
    """Return whether a noun phrase is what shall stay as it is, or is excepted."""
    before = [chunk for chunk in chunks[:place] if chunk.kind not in ("noise", "noun phrase", "and", "comma")]
    if before and (
        before[-1].kind in ("except", "negated") or (before[-1].kind == "verb" and before[-1].value == "leave")
    ):
        return True
    after = [chunk for chunk in chunks[place + 1 :] if chunk.kind != "noise"]
    return bool(after) and after[0].kind == "stays"


def _shapes(
    chunks: Sequence[Chunk],
    structures: Sequence[Mapping[str, Any]],
    relations: Sequence[Mapping[str, Any]],
    unread: bool,
) -> str:
    held = Counter(part.get("shape") for part in structures)
    for shape in named_shapes(chunks):
        if not held[shape] and not (shape == "line" and held["grid"]):
            return f"leaves out the {shape}"
    implied = implied_shapes(chunks)
    for shape in held:
        if shape is not None and shape not in implied and not unread:
            return f"has a {shape} that nobody asked for"
    swaps = sum(chunk.kind == "verb" and chunk.value == "swap" for chunk in chunks)
    if swaps > sum(part["relation"] == "swapped" for part in relations):
        return "leaves out a swap"
    stacks = any(chunk.kind == "verb" and chunk.value == "stack" for chunk in chunks)
    if stacks and not (
        held["tower"] or held["pyramid"] or held["cluster"] or any(p["relation"] == "on" for p in relations)
    ):
        return "leaves out the tower"
    return ""


def _relations(
    chunks: Sequence[Chunk],
    structures: Sequence[Mapping[str, Any]],
    relations: Sequence[Mapping[str, Any]],
    unread: bool,
) -> str:
    said = said_relations(chunks)
    said["moved"] = sum(chunk.kind == "move" for chunk in chunks)
    held = Counter(part["relation"] for part in relations)
    held["around"] += sum(part.get("around") is not None for part in structures)
    if said["in the middle of"]:
        said["in the middle of"], held["in the middle of"] = 0, 0
    for relation, count in said.items():
        if held[relation] < count:
            return f"leaves out {relation!r}"
    ways = Counter(chunk.value for chunk in chunks if chunk.kind == "move")
    if ways and ways != Counter(part.get("direction") for part in relations if part["relation"] == "moved"):
        return "has another direction of a move"
    sides = {
        value for chunk in chunks if chunk.kind == "place" for value in (chunk.value.x_position, chunk.value.y_position)
    }
    for relation, count in held.items():
        if relation in ("at", "swapped") or unread:
            continue
        of_side = relation in SIDES and SIDES[relation][1] in sides
        beside = relation == "next to" and any(chunk.kind == "beside each other" for chunk in chunks)
        on_top = relation == "on" and any(chunk.kind == "verb" and chunk.value == "stack" for chunk in chunks)
        inner = relation == "around" and any(chunk.kind in ("inner", "verb") for chunk in chunks)
        if count > said[relation] and not (of_side or beside or on_top or inner):
            return f"has {relation!r} once more than was said"
    return ""


def _references(chunks: Sequence[Chunk], parts: Sequence[Mapping[str, Any]]) -> str:
    """Compare the direction of relations: the object after "left of" is the reference."""
    relations = [part for part in parts if part["kind"] == "relation"]
    seen: list[tuple[Any, ...]] = []
    for part in relations:
        objects, reference = part.get("objects"), part.get("reference")
        if part["relation"] == "at" and isinstance(objects, Mapping):
            return "gives a structure its place apart from its other keys"
        if isinstance(objects, Mapping) and isinstance(reference, Mapping) and objects["part"] <= reference["part"]:
            return f"has {part['relation']!r} the other way round"
        if (same := (part["relation"], str(objects), str(reference))) in seen:
            return f"has {part['relation']!r} twice of the same objects"
        seen.append(same)
    spoken = [chunk for chunk in chunks if chunk.kind != "noise"]
    for chunk, after in zip(spoken, spoken[1:], strict=False):
        if (
            chunk.kind not in ("relation", "apart")
            or chunk.value not in (*SIDES, "next to", "on", "in")
            or after.kind != "noun phrase"
        ):
            continue
        words = {word for word in _plain(after.said) if word not in _IDLE_WORDS}
        if after.value.kind != "objects" or not words:
            continue
        held = [_reference_words(part, parts) for part in relations if part["relation"] == chunk.value]
        if held and not any(words <= one for one in held):
            return f"does not place anything {chunk.value!r} {after.said!r}"
    return ""


def _reference_words(part: Mapping[str, Any], parts: Sequence[Mapping[str, Any]]) -> set[str]:
    reference = part.get("reference")
    if isinstance(reference, Mapping):
        reference = parts[reference["part"]].get("objects") if reference["part"] < len(parts) else None
    return {word for phrase in reference or () for word in _plain(phrase)}


def _places(chunks: Sequence[Chunk], parts: Sequence[Mapping[str, Any]], unread: bool) -> str:
    held = {(key, part[key]) for part in parts for key in ("x_position", "y_position") if part.get(key) is not None}
    said = said_places(chunks)
    relations = {SIDES[part["relation"]] for part in parts if part.get("relation") in SIDES}
    edges = {part["along"] for part in parts if part.get("along") is not None}
    for key, value in sorted(said - held - relations):
        if {"left": "left", "right": "right", "top": "far", "bottom": "near"}.get(value) not in edges:
            return f"leaves out {key.replace('_', ' ')} {value}"
    inner = any(chunk.kind == "inner" for chunk in chunks)
    for key, value in sorted(held - said):
        if not unread and not (inner and value in ("center", "middle")):
            return f"has {key.replace('_', ' ')} {value}, which nobody asked for"
    return ""


def _keys(chunks: Sequence[Chunk], structures: Sequence[Mapping[str, Any]], unread: bool) -> str:
    def held(key: str) -> set[Any]:
        return {part[key] for part in structures if part.get(key) is not None}

    said = said_keys(chunks)
    spread = any(chunk.kind == "verb" and chunk.value == "spread" for chunk in chunks)
    for key, values in said.items():
        here = held(key)
        if lost := values - here:
            return f"leaves out {key.replace('_', ' ')} {sorted(map(str, lost))[0]}"
        if (more := here - values) and not unread and not (key == "size" and spread):
            return f"has {key.replace('_', ' ')} {sorted(map(str, more))[0]}, which nobody asked for"
    return _orders(chunks, structures, unread)


def _orders(chunks: Sequence[Chunk], structures: Sequence[Mapping[str, Any]], unread: bool) -> str:
    said = [chunk.value for chunk in chunks if chunk.kind in ("order", "order end")]
    orders = [part["order"] for part in structures if part.get("order") is not None]
    if said and not orders:
        return "leaves out the order"
    keys = said_order_keys(chunks)
    for order in orders:
        if order["by"] == "listed" or unread:
            continue
        if order["by"] not in keys and not (keys & {"height", "volume"} and order["by"] in ("height", "volume")):
            return f"has an order by {order['by']} that nobody asked for"
    ways = {value["direction"] for value in said if value.get("direction") and value.get("from") is None}
    if len(ways) == 1 and len(orders) == 1 and orders[0].get("from") is None and orders[0].get("direction") not in ways:
        return "has another direction of the order"
    directions = {chunk.value for chunk in chunks if chunk.kind == "direction"}
    return _order_ends([*said, *({"from": start, "direction": way} for start in directions for way in ways)], orders)


def _order_ends(said: Sequence[Mapping[str, Any]], orders: Sequence[Mapping[str, Any]]) -> str:
    """Compare an order that names an end with the words, since "tallest on the left" can be said from both ends."""
    ends = [(value["from"], value.get("direction")) for value in said if value.get("from")]
    if len(orders) != 1 or not ends:
        return ""
    other = {"left": "right", "right": "left", "near": "far", "far": "near", "bottom": "top", "top": "bottom"}
    turned = {"ascending": "descending", "descending": "ascending"}
    start, way = orders[0].get("from"), orders[0].get("direction")
    for end, direction in ends:
        alike = [(end, direction), (other[end], turned.get(direction or "", direction))]
        if (start, way) not in alike:
            return f"has another order than {direction or 'one'} from {end}"
    return ""
