"""Gather the chunks of an instruction into frames: one for each thing that is asked for, with all that is said of it.

A frame begins where something new is asked for: with a verb, or with objects after what was said of others ("cups on
the left, cans on the right").
"""

from __future__ import annotations

from collections.abc import Callable

from grounding.goal_reading.chunk import Chunk, Shape
from grounding.goal_reading.frame import PREDICATES, Frame, Predicate
from grounding.goal_reading.frame_builder import BOUNDARIES, FrameBuilder
from grounding.goal_reading.frame_predicates import FramePredicates
from grounding.goal_reading.goal_words import SHAPES_OF_VERB
from grounding.goal_reading.members import with_members
from grounding.goal_reading.noun_phrase import NounPhrase
from grounding.goal_reading.shared_frames import shared

_JOINTS = ("and", "comma", "or")


class Framer:
    """The gathering of chunks into frames.

    Args:
        chunks: of one instruction, corrections applied.
        ambiguous: tells whether a noun phrase for one object fits several: what follows it may then say which.

    Attributes:
        chunks: those that frames are gathered from.
        residue: chunks that no frame could take.
    """

    def __init__(self, chunks: list[Chunk], ambiguous: Callable[[NounPhrase], bool] = lambda phrase: False) -> None:
        self.chunks = [
            chunk
            for chunk in chunks
            if chunk.kind != "noise" or chunk.said.lower() in ("with", "too", "also", "as well", "respectively")
        ]
        self._builder = FrameBuilder(self.chunks, ambiguous)
        self._predicates = FramePredicates(self._builder)
        self.residue = self._builder.residue

    def read(self) -> list[Frame]:
        """Return the frames, in the order of the text."""
        at = 0
        while at < len(self.chunks):
            at = self._step(at)
        self._builder.close()
        if self._builder.copies is not None:
            self.residue.append(self._builder.copies[0])
        _join_keys(self._builder.frames)
        return with_members(shared(self._builder.frames))

    def _step(self, at: int) -> int:
        chunk = self.chunks[at]
        kind = chunk.kind
        if kind in _JOINTS:
            self._builder.pending = kind
            return at + 1
        if kind in BOUNDARIES:
            if kind == "followed by" or (kind == "then" and self._builder.continues_list(at + 1)):
                self._builder.frame.listed = True
                self._builder.pending = "list"
                return at + 1
            self._builder.sentence += kind == "stop"
            self._builder.pending = kind
            return at + 1
        if kind == "noise":
            if chunk.said.lower() in ("too", "also", "as well"):
                self._builder.frame.also = True
            elif chunk.said.lower() == "respectively":
                self._builder.frame.respectively = True
            elif chunk.said.lower() == "with" and self._builder.joins_objects(at):
                return self._builder.take_second(at + 1)
            return at + 1
        if kind == "verb":
            return self._verb(at)
        if kind in ("mentioned", "among"):
            self._builder.close()
            verb, phrases = ("mention", list(chunk.value)) if kind == "mentioned" else (kind, [chunk.value])
            self._builder.frames.append(Frame(verb=verb, objects=phrases, sentence=self._builder.sentence))
            return at + 1
        if kind == "negated":
            self._builder.open(chunk)
            self._builder.frame.negated = True
            return at + 1
        if kind == "same":
            if at + 1 < len(self.chunks) and self.chunks[at + 1].kind == "noun phrase":
                self._builder.close()
            self._builder.frame.same = True
            self._builder.extend(chunk)
            return at + 1
        if kind == "stays":
            self._builder.frame.stays = True
            self._builder.frame.end = chunk.end
            return at + 1
        if kind == "except":
            return self._builder.take_exceptions(at)
        if kind == "noun phrase":
            return self._builder.take_objects(at)
        if kind in PREDICATES:
            return self._predicates.take(at)
        self.residue.append(chunk)
        return at + 1

    def _verb(self, at: int) -> int:
        chunk, frame, builder = self.chunks[at], self._builder.frame, self._builder
        said = chunk.said.lower()
        bare = bool(frame.objects) and not frame.predicates
        participle = said.split()[0].endswith("ed") or (said == "put" and not frame.predicates)
        if frame.objects and builder.pending is None and (participle or not (frame.verb or frame.predicates)):
            return self._take_verb(at)
        if frame.verb == "place" and participle and bare and builder.pending is None:
            return self._take_verb(at)
        stands = frame.verb == "make" and said in ("stand", "sit", "go", "rest", "lie")
        if stands and bare and builder.pending is None:
            frame.verb, frame.verb_said = chunk.value, said  # "make the drill stand in the corner"
            return at + 1
        linked = chunk.value == "make" and frame.objects and not frame.has("shape") and builder.pending is None
        if linked:
            return at + 1
        alone = at + 1 == len(self.chunks) or self.chunks[at + 1].kind in ("stop", "comma", "and", "then")
        if chunk.value == "swap" and bare and not frame.verb and alone:
            return self._take_verb(at)  # "scissors and tape: trade places"
        if frame.verb == "make" and chunk.value == "place" and bare and builder.pending is None:
            frame.verb, frame.verb_said = "place", said  # "make the drill stand in the corner"
            builder.extend(chunk)
            return at + 1
        if frame.negated and not frame.verb and not frame.objects:
            frame.verb = chunk.value
            return at + 1
        whole = frame.has("shape", "table setting", "grid", "rows", "columns", "group")
        fronted = bool(frame.predicates) and not (whole or frame.objects or frame.verb)
        fronted = fronted and frame.sentence == builder.sentence
        only_order = fronted and all(each.kind in ("order", "listed", "direction") for each in frame.predicates)
        if not frame.empty and (not fronted or builder.pending in BOUNDARIES) and not only_order:
            builder.close()
            builder.frame.first = chunk.first
        builder.pending = None
        return self._take_verb(at)

    def _take_verb(self, at: int) -> int:
        chunk, frame = self.chunks[at], self._builder.frame
        if not frame.verb or frame.verb == "place":
            frame.verb, frame.verb_said = chunk.value, chunk.said.lower()
        self._builder.extend(chunk)
        if chunk.value in SHAPES_OF_VERB:
            shape = Shape(SHAPES_OF_VERB[chunk.value])
            frame.predicates.append(Predicate("verb shape", shape, chunk.said, chunk.first, chunk.end))
        return at + 1


def _join_keys(frames: list[Frame]) -> None:
    """Join what is said of objects before their shape: "put 5 cm between the cans and line them up"."""
    for one, other in zip(frames[:-1], frames[1:], strict=True):
        keys = one.predicates and all(each.kind in ("gap", "order", "direction") for each in one.predicates)
        pronoun = len(other.objects) == 1 and other.objects[0].kind == "pronoun"
        if keys and one.objects and pronoun and other.has("shape", "verb shape"):
            one.predicates += other.predicates
            one.verb, one.verb_said, one.end = other.verb or one.verb, other.verb_said or one.verb_said, other.end
            frames.remove(other)
            return
