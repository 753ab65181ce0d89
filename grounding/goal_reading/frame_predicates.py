"""Take predicates into frames: what is said of objects, with the noun phrases that belong to it."""

from __future__ import annotations

from dataclasses import replace

from grounding.goal_reading.chunk import Chunk, Shape
from grounding.goal_reading.frame import PREDICATES, Frame, Predicate
from grounding.goal_reading.frame_builder import BOUNDARIES, FrameBuilder
from grounding.goal_reading.noun_phrase import NounPhrase

_TO_OBJECTS = ("relation", "apart", "either side")  # predicates that objects or a structure follow


class FramePredicates:
    """The predicates of one instruction.

    Args:
        builder: keeps the frames.
    """

    def __init__(self, builder: FrameBuilder) -> None:
        self._builder, self.chunks = builder, builder.chunks

    def take(self, at: int) -> int:
        """Take a predicate into the open frame or a new one; return the place after all that belongs to it."""
        if self._builder.frame.stays:
            self._builder.close()
        chunk = self.chunks[at]
        if chunk.kind == "relation" and chunk.value == "in" and self._kind(at + 1) in ("relation", "place"):
            return at + 1  # "tuck the cup in behind the bottle"
        reference, end = self._reference(at)
        if chunk.kind == "length" and (spaced := self._gap_between(at)):
            return spaced
        if chunk.kind == "another" and self._builder.copies is not None:
            return end
        chunk = self._meant(chunk, end)
        if chunk.kind == "another":
            self._builder.residue.append(chunk)
            return end
        if chunk.kind == "shape":
            if after := self._shape(at, chunk):
                return after
            if self._builder.frame.has("shape") and self._builder.pending is not None:
                verb = self._builder.frame.verb
                self._builder.close()
                self._builder.frame.verb = verb
                self._builder.extend(chunk)
        last = self.chunks[end - 1].end
        made = Predicate(chunk.kind, chunk.value, chunk.said, chunk.first, last, chunk.metres, tuple(reference))
        if self._fronted(at, end):
            self._builder.close()
        self._builder.pending = None
        self._builder.extend(chunk)
        self._builder.frame.end = last
        self._builder.frame.predicates.append(made)
        return end

    def _kind(self, at: int) -> str:
        return self.chunks[at].kind if at < len(self.chunks) else ""

    def _reference(self, at: int) -> tuple[list[NounPhrase], int]:
        """Read the noun phrases that a predicate is said of, if any; return them and the place after."""
        chunk, end = self.chunks[at], at + 1
        if chunk.kind in (*_TO_OBJECTS, "relation?") and self._kind(end) == "noun phrase":
            alone = chunk.value != "between" or self.chunks[end].value.many  # "between the two cans, and the mug ..."
            reference, end = self._builder.lists.read(end, self._builder.frame, reference=alone)
            if chunk.value == "between" and len(reference) > 2:
                return reference[:2], self._builder.lists.after_two(at + 1)
            return reference, end
        if chunk.kind in _TO_OBJECTS and self._structure_named(end):
            return [self._structure(end)], end + 1
        if chunk.kind == "relation" and (whole := self._new_structure(end)) is not None:
            return [whole[0]], whole[1]
        return [], end

    def _meant(self, chunk: Chunk, end: int) -> Chunk:
        """Return a chunk as what it means beside what was said before it."""
        frame = self._builder.frame
        distance = chunk.kind == "move" and frame.has("relation", "relation it", "apart")
        if chunk.kind == "same distance" or (distance and chunk.said.lower().endswith("away")):
            return replace(chunk, kind="away")  # "behind the bowl, 4 cm away"
        if chunk.kind == "another":
            frames = (*self._builder.frames, frame)
            shapes = [each.value.name for one in frames for each in (*one.get("verb shape"), *one.get("shape"))]
            return replace(chunk, kind="shape", value=Shape(shapes[-1])) if shapes else chunk
        rows = chunk.kind == "rows" and chunk.value > 1 and not frame.objects and self._builder.copies is None
        if rows and self._builder.lists.begins(end):
            return replace(chunk, kind="shape", value=Shape("line", count=chunk.value))
        return chunk

    def _shape(self, at: int, chunk: Chunk) -> int:
        """Take a shape that is more than a predicate of the open frame; return the place after it, or 0."""
        frame, shape = self._builder.frame, chunk.value
        several = len(frame.objects) > 1 and not frame.has("group")
        if several and shape.count in (0, len(frame.objects)):
            return self._one_for_each(at)
        if shape.count > 1 and not frame.objects and self._builder.copies is None:
            self._builder.copies = (chunk, shape.count)
            self._builder.extend(chunk)
            return at + 1
        own = [one.value.name for one in (*frame.get("shape"), *frame.get("verb shape"))]
        if own == [shape.name] and self._builder.pending == "and" and shape.definite and not shape.linked:
            self._builder.close()  # "put the cups in a row and the row on the left"
            return self._structure_objects(at)
        return self._structure_objects(at) if self._names_structure(chunk) else 0

    def _one_for_each(self, at: int) -> int:
        """Read "put the cups and the cans in two clusters": one for each noun phrase."""
        chunk, phrases, verb = self.chunks[at], self._builder.frame.objects, self._builder.frame.verb
        for number, phrase in enumerate(phrases):
            self._builder.frame.objects = [phrase]
            self._builder.extend(chunk)
            self._builder.frame.verb = self._builder.frame.verb or verb
            self._builder.frame.predicates.append(
                Predicate("shape", replace(chunk.value, count=1), chunk.said, chunk.first, chunk.end)
            )
            if number + 1 < len(phrases):
                self._builder.close()
        return at + 1

    def _gap_between(self, at: int) -> int:
        """Read "put 5 cm between the cans", which has a gap and its objects; return the place after it, or 0."""
        following = self.chunks[at + 1 : at + 3]
        if (
            [one.kind for one in following] != ["relation", "noun phrase"]
            or following[0].value != "between"
            or self._builder.frame.objects
        ):
            return 0
        chunk, frame = self.chunks[at], self._builder.frame
        frame.predicates.append(Predicate("gap", True, chunk.said, chunk.first, following[0].end, chunk.metres))
        frame.objects, end = self._builder.lists.read(at + 2, frame)
        self._builder.extend(chunk)
        return end

    def _new_structure(self, at: int) -> tuple[NounPhrase, int] | None:
        """Read a structure that something stands by: "the duck in front of a row made of the blocks"."""
        chunks = self.chunks
        if at + 1 >= len(chunks) or chunks[at].kind != "shape" or chunks[at].value.definite or chunks[at].value.linked:
            return None
        if chunks[at].value.count > 1 or chunks[at + 1].kind != "noun phrase" or chunks[at + 1].first == chunks[at].end:
            return None
        frame = Frame(sentence=self._builder.sentence, first=chunks[at].first)
        frame.predicates = [Predicate("shape", chunks[at].value, chunks[at].said, chunks[at].first, chunks[at].end)]
        frame.objects, end = self._builder.lists.read(at + 1, frame)
        frame.end = chunks[end - 1].end
        self._builder.frames.append(frame)
        return self._structure(at), end

    def _structure_named(self, at: int) -> bool:
        shape = self.chunks[at].value if self._kind(at) == "shape" else None
        return shape is not None and shape.definite and not shape.linked

    def _structure(self, at: int) -> NounPhrase:
        chunk = self.chunks[at]
        return NounPhrase("structure", chunk.first, chunk.end, chunk.value.name)

    def _names_structure(self, chunk: Chunk) -> bool:
        """Return whether "the row" means one that was asked for before."""
        frame = self._builder.frame
        complete = frame.objects and frame.has("shape", "verb shape") and self._builder.pending is not None
        begun = frame.objects or frame.has("shape")
        if not chunk.value.definite or chunk.value.linked or (begun and not complete):
            return False
        return any(
            each.value.name == chunk.value.name
            for one in (*self._builder.frames, *((frame,) if complete else ()))
            for each in (*one.get("shape"), *one.get("verb shape"))
        )

    def _structure_objects(self, at: int) -> int:
        if self._builder.frame.objects:
            self._builder.close()
        self._builder.frame.objects = [self._structure(at)]
        self._builder.extend(self.chunks[at])
        self._builder.pending = None
        return at + 1

    def _fronted(self, at: int, end: int) -> bool:
        """Return whether what is said here belongs to objects that come after it: "..., and on the right the cans"."""
        frame = self._builder.frame
        if not frame.objects and not (frame.predicates and self._builder.pending in BOUNDARIES and frame.verb):
            return False
        if self._builder.pending is None:
            return False
        while self._kind(end) in ("comma", *PREDICATES, "noise"):
            if self._kind(end) in ("relation", "apart") and self._kind(end + 1) == "noun phrase":
                _, end = self._builder.lists.read(end + 1, self._builder.frame, reference=True)
                continue
            end += 1
        if end >= len(self.chunks):
            return False
        following = self.chunks[end].kind
        stronger = self._builder.pending in BOUNDARIES
        plain = self.chunks[at].kind in ("another", "place", "relation", "shape", "along", "grid", "relation it")
        if following == "verb":
            again = self._kind(at) == "place" and frame.has("place", "along")  # "..., and on the right arrange ..."
            return plain and (stronger or (again and self._kind(end + 1) == "noun phrase"))
        return following == "noun phrase" and plain and not self._frame_of_phrase(end)

    def _frame_of_phrase(self, at: int) -> bool:
        """Return whether the noun phrase here begins a frame of its own, with its own predicate."""
        _, end = self._builder.lists.read(at, self._builder.frame, reference=True)
        return self._kind(end) in ("place", "relation", "shape")
