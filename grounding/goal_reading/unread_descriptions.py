"""Make unknown words of what describes a structure and names no object: "like a fence", "in a minuscule row".

The grammar would take the fence for an object that is to be placed, and "a minuscule" for one that the row is in.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from grounding.goal_reading.beyond import known
from grounding.goal_reading.chunk import Chunk
from grounding.goal_reading.tokens import Words

_INDEFINITE = ("a", "an")
_WISHING = frozenset("i'd we'd would i we you they who'd they'd i'll looks look sounds feels feel".split())


def with_descriptions_unread(chunks: Sequence[Chunk], said: Words) -> list[Chunk]:
    """Return the chunks with an unknown word in place of each comparison and each unknown adjective of a shape.

    Args:
        chunks: of an instruction.
        said: its words.
    """
    found: list[Chunk] = []
    at = 0
    while at < len(chunks):
        chunk = chunks[at]
        if (end := _likeness(chunks, at, said)) is not None:
            last = chunks[end - 1]
            words = said.quote(chunk.first, last.end)
            found.append(Chunk("unknown", words.lower(), chunk.first, last.end, said=words))
            at = end
            continue
        if found and _adjective(chunks, at, said):
            chunk = replace(chunk, kind="unknown", value=chunk.said.lower())
            if found[-1].kind == "relation":
                found[-1] = replace(found[-1], kind="noise", value=True)
        found.append(chunk)
        at += 1
    return found


def _likeness(chunks: Sequence[Chunk], at: int, said: Words) -> int | None:
    """Return the place after a comparison that begins here: "like a fence", "like birds on a wire"."""
    chunk = chunks[at]
    if chunk.kind != "noise" or chunk.said.lower() != "like" or at + 1 >= len(chunks):
        return None
    if said.word(chunk.first - 1) in _WISHING or chunks[at + 1].kind not in ("noun phrase", "unknown"):
        return None
    thing = chunks[at + 1]
    if thing.kind == "noun phrase" and (thing.value.kind != "objects" or not _compared(thing, said)):
        return None
    end = at + 2
    if end + 1 < len(chunks) and chunks[end].kind == "relation" and chunks[end].said.lower() in ("on", "in", "at"):
        end += 2 if chunks[end + 1].kind in ("noun phrase", "shape") else 0
    return end


def _compared(thing: Chunk, said: Words) -> bool:
    """Return whether a phrase names no particular object: "a fence", "birds", or a noun that nobody knows."""
    first = said.word(thing.first)
    return first in _INDEFINITE or first not in ("the", "my", "this", "that", "these", "those", "your") or not known([thing.value])


def _adjective(chunks: Sequence[Chunk], at: int, said: Words) -> bool:
    """Return whether a phrase is only the article and an adjective of the shape that follows: "a minuscule row"."""
    if at + 1 >= len(chunks) or chunks[at].kind != "noun phrase" or chunks[at + 1].kind != "shape":
        return False
    phrase, shape = chunks[at], chunks[at + 1]
    opened = said.word(shape.first) in ("a", "an", "the", "in", "into", "as", "of", "my", "one")
    return said.word(phrase.first) in (*_INDEFINITE, "the") and not opened and not known([phrase.value])
