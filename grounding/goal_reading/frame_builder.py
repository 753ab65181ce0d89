"""Build frames: keep the one that is open, and tell whether noun phrases join it or open the next one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from grounding.goal_reading.chunk import Chunk
from grounding.goal_reading.frame import Frame, Predicate
from grounding.goal_reading.noun_phrase import NounPhrase
from grounding.goal_reading.phrase_lists import PhraseLists
from grounding.references.phrases import ANY

BOUNDARIES = ("stop", "then", "followed by")


class FrameBuilder:
    """The frames of one instruction, as far as its chunks were read.

    Args:
        chunks: of the instruction, corrections applied, what says nothing left out.
        ambiguous: tells whether a noun phrase for one object fits several: what follows it may then say which.

    Attributes:
        lists: reads lists of noun phrases.
        frames: that are complete, in the order of the text.
        frame: the open one.
        residue: chunks that no frame could take.
        sentence: the number of the present sentence.
        pending: a joint, before what follows it is known.
        copies: "two towers", and how many of them were not said yet.
    """

    def __init__(self, chunks: list[Chunk], ambiguous: Callable[[NounPhrase], bool]) -> None:
        self.chunks = chunks
        self.lists = PhraseLists(chunks, ambiguous)
        self.frames: list[Frame] = []
        self.residue: list[Chunk] = []
        self.frame = Frame()
        self.sentence = 0
        self.pending: str | None = None
        self.copies: tuple[Chunk, int] | None = None

    def open(self, chunk: Chunk) -> None:
        """Open a frame with a chunk."""
        if not self.frame.empty:
            self.close()
        self.frame.first = chunk.first
        self.pending = None

    def extend(self, chunk: Chunk) -> None:
        """Extend the open frame to a chunk."""
        frame = self.frame
        if frame.end == 0:
            frame.first, frame.sentence = chunk.first, self.sentence
        frame.end = max(frame.end, chunk.end)

    def close(self) -> None:
        """Close the open frame, and open an empty one."""
        if not self.frame.empty:
            self.frames.append(self.frame)
        self.frame = Frame(sentence=self.sentence)
        self.pending = None

    def take_objects(self, at: int) -> int:
        """Take a list of noun phrases into the open frame or the next one; return the place after it."""
        frame, chunk = self.frame, self.chunks[at]
        phrases, end = self.lists.read(at, self.frame)
        joint = self.pending
        if self._counts(phrases):  # "..., all three in a row"
            phrases = [NounPhrase("pronoun", phrases[0].first, phrases[0].end, "all of them")]
        if self._heading(phrases, end):
            return end
        if self.copies is not None and phrases[0].kind in ("objects", "rest"):
            return self._one_of(at)
        if phrases[0].kind == "each other":
            self.residue.append(chunk)
            return end
        if end < len(self.chunks) and self.chunks[end].kind == "stays" and frame.objects:
            self.close()  # "swap them while everything else remains unchanged"
            self.frame.objects = phrases
        elif frame.objects and not frame.predicates and joint in ("and", "comma", "list", "or") and not frame.second:
            frame.objects += phrases
        elif frame.objects and joint is None and phrases[0].superlative and not frame.predicates:
            self.residue.append(chunk)
        elif frame.objects and self._members_of(frame, phrases):
            frame.objects += phrases
        elif frame.objects and frame.predicates and self._added(frame, end):
            frame.objects += phrases
        elif frame.objects:
            self.close()
            self.frame.objects = phrases
        elif frame.predicates and not frame.verb and joint in BOUNDARIES and frame.sentence != self.sentence:
            self.close()
            self.frame.objects = phrases
        else:
            frame.objects = phrases
        self.pending = None
        self.extend(chunk)
        self.frame.end = self.chunks[end - 1].end
        return end

    def take_second(self, at: int) -> int:
        """Take the objects that "with" joins to a verb; return the place after them."""
        phrases, end = self.lists.read(at, self.frame, reference=True)
        self.frame.second = phrases
        self.frame.end = self.chunks[end - 1].end
        return end

    def take_exceptions(self, at: int) -> int:
        """Take what the last noun phrase leaves out; return the place after it."""
        if at + 1 >= len(self.chunks) or self.chunks[at + 1].kind != "noun phrase":
            self.residue.append(self.chunks[at])
            return at + 1
        phrases, end = self.lists.exceptions(at + 1, self.frame)
        if self.frame.objects:
            last = self.frame.objects[-1]
            self.frame.objects[-1] = replace(last, without=(*last.without, *phrases))
        else:
            self.frame.objects = [
                NounPhrase("all", self.chunks[at].first, self.chunks[at].end, "everything", without=tuple(phrases))
            ]
        self.frame.end = self.chunks[end - 1].end
        return end

    def joins_objects(self, at: int) -> bool:
        """Return whether "with" joins objects to a verb: "swap the mug with the bowl", "surround it with cups"."""
        following = self.chunks[at + 1] if at + 1 < len(self.chunks) else None
        return (
            following is not None
            and following.kind == "noun phrase"
            and self.frame.verb in ("swap", "surround", "flank")
            and bool(self.frame.objects)
        )

    def continues_list(self, at: int) -> bool:
        """Return whether a noun phrase after "then" goes on with the list of the open frame."""
        frame = self.frame
        only_verb = all(each.kind in ("verb shape", "shape", "listed", "direction") for each in frame.predicates)
        if not (frame.objects and only_verb and at < len(self.chunks) and self.chunks[at].kind == "noun phrase"):
            return False
        if frame.has("shape") and not self.lists.bare_phrase(at):
            return False
        return frame.objects[0].kind == "objects" and not self.lists.opens_frame(at + 1) or self._shape_ends(at + 1)

    def _counts(self, phrases: list[NounPhrase]) -> bool:
        """Return whether a phrase only counts the objects that were named: "all three", "all five of them"."""
        said = phrases[0].mention
        named = any(frame.objects for frame in (*self.frames, self.frame))
        bare = said is not None and said.noun == ANY and not said.modifiers and (said.count or 0) > 1
        return named and len(phrases) == 1 and bare and phrases[0].text.lower().startswith("all ")

    def _members_of(self, frame: Frame, phrases: list[NounPhrase]) -> bool:
        """Return whether adjectives after a colon list the group before them: "cups from left to right: red, blue"."""
        kinds = ("shape", "verb shape", "direction", "listed", "side by side", "stacked")
        keys = all(each.kind in kinds for each in frame.predicates)
        group = len(frame.objects) == 1 and frame.objects[0].many and frame.objects[0].kind == "objects"
        return self.pending == "comma" and keys and group and len(phrases) > 1 and all(one.borrowed for one in phrases)

    def _one_of(self, at: int) -> int:
        """Read the objects of one of "two towers": "one with the cans and one with the cups"."""
        shape, left = self.copies
        if any(each.kind == "shape" for each in self.frame.predicates) or self.frame.objects:
            self.close()
        phrase, end = self.lists.one(at, self.frame)
        self.frame.objects = [phrase]
        self.frame.predicates.append(
            Predicate("shape", replace(shape.value, count=1), shape.said, shape.first, shape.end)
        )
        self.extend(self.chunks[at])
        self.copies = (shape, left - 1) if left > 1 else None
        self.pending = None
        return end

    def _heading(self, phrases: list[NounPhrase], end: int) -> bool:
        """Return whether the phrase only announces what comes: "make two things: ..."."""
        said = phrases[0].mention
        colon = end < len(self.chunks) and self.chunks[end].said == ":"
        return colon and len(phrases) == 1 and said is not None and said.noun == "object" and not said.modifiers

    def _added(self, frame: Frame, end: int) -> bool:
        """Return whether objects after a complete frame belong to it: "put the mug on the left, and the bowl too"."""
        following = self.chunks[end] if end < len(self.chunks) else None
        too = following is not None and following.said.lower() in ("too", "also", "as well")
        stacked = frame.has("verb shape", "shape")
        only_verb = all(each.kind == "verb shape" for each in frame.predicates)
        if (
            only_verb
            and self.pending in ("and", "comma", "list")
            and not too
            and not self.lists.predicate_follows(end)
        ):
            return True
        return too and not stacked

    def _shape_ends(self, at: int) -> bool:
        return (
            at < len(self.chunks)
            and self.chunks[at].kind in ("shape", "direction", "listed")
            and not self.frame.has("shape")
        )
