"""Tell whether an instruction asks for more than one plain structure, as far as it was understood."""

from __future__ import annotations

from collections.abc import Sequence

from grounding.goal_reading.chunk import Chunk
from grounding.goal_reading.frame import Frame
from grounding.goal_reading.noun_phrase import NounPhrase
from grounding.references.attributes import SUPERLATIVES
from grounding.spec import FIRST_SHAPES

_TELLING = frozenset("opposite colour height width alternate alternating alternately".split())
_SIGNS = frozenset("grid rows columns gap radius diameter length apart order group".split()) | {
    "order end",
    "length of",
    "either side",
    "one side",
    "same distance",
}


_MOST_UNREAD = 2  # with more words that are not understood, two clauses are likelier a story than two wishes


def asks_beyond(chunks: Sequence[Chunk], frames: Sequence[Frame]) -> bool:
    """Return whether something was certainly said that one plain structure cannot hold."""
    if _certain(chunks, frames):
        return True
    unread = sum(chunk.kind == "unknown" for chunk in chunks)
    return unread <= _MOST_UNREAD and (_unknown_act(chunks) or _several(frames))


def _certain(chunks: Sequence[Chunk], frames: Sequence[Frame]) -> bool:
    if any(chunk.kind == "unknown" and chunk.value in _TELLING for chunk in chunks):
        return True
    if any(chunk.kind in _SIGNS or chunk.metres is not None for chunk in chunks):
        return True
    if any(one.value == "between" and after.kind == "noun phrase" for one, after in zip(chunks, chunks[1:], strict=False)):
        return True
    if any(frame.has("shape", "verb shape", "stacked", "side by side") for frame in frames) and any(
        word in SUPERLATIVES for chunk in chunks for word in chunk.said.lower().split()
    ):
        return True
    return any(set(each.value.name for each in frame.get("shape")) - set(FIRST_SHAPES) - {"cluster"} for frame in frames)


def _unknown_act(chunks: Sequence[Chunk]) -> bool:
    """Return whether an act is asked for that is not known, with its object: "... and wash the dishes"."""
    return any(
        chunk.kind == "unknown"
        and before.kind in ("and", "then")
        and after.kind == "noun phrase"
        and known([after.value])
        for before, chunk, after in zip(chunks, chunks[1:], chunks[2:], strict=False)
    )


def _several(frames: Sequence[Frame]) -> bool:
    """Return whether several things are asked for, or one that is no structure."""
    relations = [
        (frame, each) for frame in frames for each in frame.predicates if each.kind == "relation" and each.reference
    ]
    if any(
        frame.verb in ("swap", "surround")
        and frame.objects
        or frame.has("shape")
        and set(each.value.name for each in frame.get("shape")) - set(FIRST_SHAPES)
        for frame in frames
    ):
        return True
    if any(frame.objects and known(each.reference) for frame, each in relations):
        return True
    if sum(bool(frame.objects) for frame in frames) > 1 and any(
        each.reference[0].kind == "pronoun" for _, each in relations
    ):
        return True
    asked = [
        frame
        for frame in frames
        if frame.verb not in ("", "take", "leave", "make") and known(frame.objects) and not frame.negated
    ]
    if len(asked) > 1 and len(_nouns(asked)) > 1:
        return True
    ends = {frame.end for frame in frames}  # "screws boxes" are not two things
    told = [
        frame
        for frame in frames
        if frame.predicates
        and known(frame.objects)
        and not frame.negated
        and (not frame.first or frame.first not in ends)
    ]
    if told and any(frame.negated and known(frame.objects) for frame in frames):
        return True
    rest = any(
        phrase.kind == "rest" for frame in frames if frame.has("shape", "verb shape") for phrase in frame.objects
    )
    if rest and any(frame.has("shape", "verb shape", "place") for frame in told):
        return True
    shapes = {each.value.name for frame in told for each in (*frame.get("shape"), *frame.get("verb shape"))}
    places = {each.value for frame in told for each in (*frame.get("place"), *frame.get("inner"))}
    related = any(each.reference and each.value != "in" for frame in told for each in frame.get("relation"))
    return (
        len(told) > 1
        and len(_nouns(told)) > 1
        and (len(shapes) > 1 or len(places) > 1 or (bool(shapes) and (bool(places) or related)))
    )


def _nouns(frames: Sequence[Frame]) -> set[str]:
    return {phrase.mention.noun for frame in frames for phrase in frame.objects if phrase.mention is not None}


def known(phrases: Sequence[NounPhrase]) -> bool:
    """Return whether noun phrases are there, and all of them are of known nouns."""
    return bool(phrases) and all(
        phrase.kind == "structure" or (phrase.mention is not None and phrase.mention.known) for phrase in phrases
    )


def unknown_subjects(chunks: Sequence[Chunk]) -> tuple[str, ...]:
    """Return the words that are not understood and stand where objects or relations are named: "glorp on the left"."""
    found, chunks = [], list(chunks)
    for number, chunk in enumerate(chunks):
        before = chunks[number - 1].kind if number else "stop"
        after = chunks[number + 1].kind if number + 1 < len(chunks) else ""
        word = chunk.kind == "unknown" and chunk.said.isalpha() and len(chunk.said) > 2
        around = chunks[number - 1 : number] + chunks[number + 1 : number + 2]
        if word and len(around) == 2 and all(one.kind == "noun phrase" and known([one.value]) for one in around):
            found.append(chunk.said)  # how two objects stand to each other: "the knife after the fork"
        if word and before in ("stop", "and", "comma", "then") and after in ("place", "relation", "along", "beside each other"):
            found.append(chunk.said)
    return tuple(found)


def alternatives(chunks: Sequence[Chunk]) -> tuple[Chunk, Chunk] | None:
    """Return the objects between which an instruction leaves the choice, "the hammer or the drill"; `None` for none."""
    denied = False
    for before, chunk, after in zip(chunks, chunks[1:], chunks[2:], strict=False):
        if before.kind in ("stop", "then"):
            denied = False
        denied = denied or before.kind in ("negated", "except", "not") or (before.kind, before.value) == ("verb", "leave")
        both = before.kind == after.kind == "noun phrase" and known([before.value]) and known([after.value])
        if chunk.kind == "or" and both and not denied:
            return before, after
    return None
