"""Read lists of noun phrases among the chunks of an instruction, and tell where a list ends and a new frame begins."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from grounding.goal_reading.chunk import Chunk
from grounding.goal_reading.frame import PREDICATES, Frame
from grounding.goal_reading.noun_phrase import NounPhrase
from grounding.goal_reading.places import Place

_STANDING = ("left of", "right of", "in front of", "behind", "next to", "on", "in")


def side_of(place: Place) -> str | None:
    """Return the side that a place speaks of; `None` for a corner."""
    if place.corner or (place.x_position is None) == (place.y_position is None):
        return None
    return {"left": "left", "right": "right", "bottom": "near", "top": "far"}.get(
        place.x_position or place.y_position or "", "middle"
    )


class PhraseLists:
    """A reader of lists of noun phrases.

    Args:
        chunks: of one instruction.
        ambiguous: tells whether a noun phrase for one object fits several: what follows it may then say which.
    """

    def __init__(self, chunks: list[Chunk], ambiguous: Callable[[NounPhrase], bool]) -> None:
        self.chunks, self._ambiguous = chunks, ambiguous

    def read(self, at: int, frame: Frame, reference: bool = False, most: int = 40) -> tuple[list[NounPhrase], int]:
        """Read noun phrases that are joined by commas and "and"; return them and the place after.

        Args:
            at: place of the first.
            frame: that they belong to; it is marked where "then" joins them.
            reference: whether something is said to stand by them.
            most: how many are read.
        """
        chunks = self.chunks
        first, at = self.one(at, frame, reference)
        phrases = [first]
        while at < len(chunks) and len(phrases) < most:
            joint = at
            while joint < len(chunks) and chunks[joint].kind in ("and", "comma", "or") and joint - at < 2:
                joint += 1
            listed = False
            if (
                joint < len(chunks)
                and not reference
                and chunks[joint].kind in ("then", "followed by")
                and self.bare_phrase(joint + 1)
            ):
                joint, listed = joint + 1, True
            if joint >= len(chunks) or chunks[joint].kind != "noun phrase":
                break
            after = joint + 1
            if joint == at and not self._asyndetic(joint, frame, phrases, reference):
                break
            if joint > at and chunks[joint].value.kind == "pronoun" and not chunks[joint].value.many and frame.has("shape"):
                break  # "a row of the cups, and it should be long"
            # "next to the bowl and the spoon behind it": what comes next is said of other objects.
            if reference and self.opens_frame(after):
                break
            if (reference or frame.has("verb shape", "shape")) and self._too(after):
                break  # "stack the red ones, and the blue ones too": another tower
            if frame.has("shape") and after < len(chunks) and chunks[after].kind == "shape" and not reference:
                break
            phrase, at = self.one(joint, frame, reference)
            phrases.append(phrase)
            frame.listed = frame.listed or listed
        if at < len(chunks) and chunks[at].kind == "except":
            exceptions, at = self.exceptions(at + 1, frame)
            phrases[-1] = replace(phrases[-1], without=(*phrases[-1].without, *exceptions))
        return phrases, at

    def _asyndetic(self, at: int, frame: Frame, phrases: list[NounPhrase], reference: bool) -> bool:
        """Return whether a phrase right after another one is listed with it: "a row of the cup the can the bowl"."""
        phrase = self.chunks[at].value
        alike = all(one.kind == "objects" and not one.superlative for one in (phrases[-1], phrase))
        shaped = frame.has("shape", "verb shape", "grid", "side by side", "stacked", "listed")
        if reference or not alike or not shaped or phrases[-1].end != phrase.first or phrase.borrowed:
            return False
        return not self.opens_frame(at + 1) or not self.predicate_of_relation(at + 1)

    def predicate_of_relation(self, at: int) -> bool:
        """Return whether a relation to other objects stands here."""
        return at < len(self.chunks) and self.chunks[at].kind in ("relation", "apart", "relation it", "shape")

    def exceptions(self, at: int, frame: Frame) -> tuple[list[NounPhrase], int]:
        """Read what is left out: "without the drill and the clamp"."""
        chunks, found = self.chunks, list[NounPhrase]()
        while True:
            phrase, at = self.one(at, frame, reference=True)
            found.append(phrase)
            joint = at
            while joint < len(chunks) and chunks[joint].kind in ("and", "comma", "or") and joint - at < 2:
                joint += 1
            if joint == at or joint >= len(chunks) or chunks[joint].kind != "noun phrase":
                return found, at
            again = chunks[joint].value.text.lower() in (one.text.lower() for one in found)
            if again or (chunks[at].kind == "comma" and self.opens_frame(joint + 1)):
                return found, at
            at = joint

    def one(self, at: int, frame: Frame, reference: bool = False) -> tuple[NounPhrase, int]:
        """Read what says which object is meant: "the mug on the right" where there are two; return the place after it."""
        phrase, chunks = self.chunks[at].value, self.chunks
        following = chunks[at + 1] if at + 1 < len(chunks) else None
        if following is None or following.kind not in ("place", "relation") or not self._ambiguous(phrase):
            return phrase, at + 1
        swapped = frame.verb in ("swap", "take")
        if following.kind == "place":
            side = side_of(following.value)
            if side is not None and (reference or swapped or self._asks(at + 2)):
                return replace(phrase, side=side, end=following.end), at + 2
        elif following.value in _STANDING and at + 2 < len(chunks) and chunks[at + 2].kind == "noun phrase":
            if swapped or (self._asks(at + 3) and not reference):
                return replace(
                    phrase, relation=following.value, landmark=chunks[at + 2].value, end=chunks[at + 2].end
                ), at + 3
        return phrase, at + 1

    def _too(self, at: int) -> bool:
        return at < len(self.chunks) and self.chunks[at].said.lower() in ("too", "as well", "also")

    def _asks(self, at: int) -> bool:
        return at < len(self.chunks) and self.chunks[at].kind in PREDICATES and self.chunks[at].kind != "size"

    def opens_frame(self, after: int) -> bool:
        """Return whether what stands after a noun phrase says something of it, so that it opens a frame."""
        chunks = self.chunks
        while (
            after < len(chunks)
            and chunks[after].kind in ("and", "comma")
            and after + 1 < len(chunks)
            and chunks[after + 1].kind == "noun phrase"
        ):
            after += 2
        if (
            after < len(chunks)
            and chunks[after].kind == "verb"
            and chunks[after].said.lower().split()[0].endswith("ed")
        ):
            return True
        return (
            after < len(chunks)
            and chunks[after].kind in (*PREDICATES, "stays")
            and chunks[after].kind not in ("away", "size", "gap", "order end", "order")
        )

    def bare_phrase(self, at: int) -> bool:
        """Return whether a noun phrase stands here of which nothing but an order is said."""
        if at >= len(self.chunks) or self.chunks[at].kind != "noun phrase":
            return False
        return not self.predicate_follows(at + 1)

    def predicate_follows(self, end: int) -> bool:
        """Return whether something is said here that is more than an order or a length."""
        if (
            end < len(self.chunks)
            and self.chunks[end].kind == "verb"
            and self.chunks[end].said.lower().split()[0].endswith("ed")
        ):
            return True
        return (
            end < len(self.chunks)
            and self.chunks[end].kind in (*PREDICATES, "stays")
            and self.chunks[end].kind not in ("listed", "direction", "order", "gap", "size")
        )

    def begins(self, at: int) -> bool:
        """Return whether objects are listed from here on: "two rows: the cans and the cups"."""
        return [one.kind for one in self.chunks[at : at + 2]] == ["comma", "noun phrase"] or [
            one.kind for one in self.chunks[at : at + 3]
        ] == ["comma", "noise", "noun phrase"]

    def after_two(self, at: int) -> int:
        """Return the place after the next two noun phrases."""
        seen = 0
        while seen < 2:
            seen += self.chunks[at].kind == "noun phrase"
            at += 1
        return at
