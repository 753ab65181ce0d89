"""Gather the chunks of an instruction into frames: one for each thing that is asked for, with all that is said of it.

A frame begins where something new is asked for: with a verb, or with objects after what was said of others ("cups on the
left, cans on the right").
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from grounding.goal_reading.chunk import Chunk, Shape
from grounding.goal_reading.frame import PREDICATES, Frame, Predicate
from grounding.goal_reading.goal_words import SHAPES_OF_VERB
from grounding.goal_reading.members import with_members
from grounding.goal_reading.noun_phrase import NounPhrase
from grounding.goal_reading.phrase_lists import PhraseLists
from grounding.goal_reading.shared_frames import shared
from grounding.references.phrases import ANY

_JOINTS = ("and", "comma", "or")
_BOUNDARIES = ("stop", "then", "followed by")


class Framer:
    """The gathering of chunks into frames.

    Args:
        chunks: of one instruction, corrections applied.
        ambiguous: tells whether a noun phrase for one object fits several: what follows it may then say which.

    Attributes:
        frames: the frames, in the order of the text.
        residue: chunks that no frame could take.
    """

    def __init__(self, chunks: list[Chunk], ambiguous: Callable[[NounPhrase], bool] = lambda phrase: False) -> None:
        self.chunks = [
            chunk
            for chunk in chunks
            if chunk.kind != "noise" or chunk.said.lower() in ("with", "too", "also", "as well", "respectively")
        ]
        self.lists = PhraseLists(self.chunks, ambiguous)
        self.frames: list[Frame] = []
        self.residue: list[Chunk] = []
        self._frame = Frame()
        self._sentence = 0
        self._pending: str | None = None  # a joint, before what follows it is known
        self._copies: tuple[Chunk, int] | None = None  # "two towers", and how many of them were said

    def read(self) -> list[Frame]:
        """Return the frames."""
        at = 0
        while at < len(self.chunks):
            at = self._step(at)
        self._close()
        if self._copies is not None:
            self.residue.append(self._copies[0])
        self._join_keys()
        self.frames = with_members(shared(self.frames))
        return self.frames

    def _join_keys(self) -> None:
        """Join what is said of objects before their shape: "put 5 cm between the cans and line them up"."""
        for one, other in zip(self.frames[:-1], self.frames[1:], strict=True):
            keys = one.predicates and all(each.kind in ("gap", "order", "direction") for each in one.predicates)
            pronoun = len(other.objects) == 1 and other.objects[0].kind == "pronoun"
            if keys and one.objects and pronoun and other.has("shape", "verb shape"):
                one.predicates += other.predicates
                one.verb, one.verb_said, one.end = other.verb or one.verb, other.verb_said or one.verb_said, other.end
                self.frames.remove(other)
                return

    # One chunk

    def _step(self, at: int) -> int:
        chunk = self.chunks[at]
        kind = chunk.kind
        if kind in _JOINTS:
            self._pending = kind
            return at + 1
        if kind in _BOUNDARIES:
            if kind == "followed by" or (kind == "then" and self._continues_list(at + 1)):
                self._frame.listed = True
                self._pending = "list"
                return at + 1
            self._sentence += kind == "stop"
            self._pending = kind
            return at + 1
        if kind == "noise":
            if chunk.said.lower() in ("too", "also", "as well"):
                self._frame.also = True
            elif chunk.said.lower() == "respectively":
                self._frame.respectively = True
            elif chunk.said.lower() == "with" and self._with(at):
                return self._with_objects(at + 1)
            return at + 1
        if kind == "verb":
            return self._verb(at)
        if kind in ("mentioned", "among"):
            self._close()
            verb, phrases = ("mention", list(chunk.value)) if kind == "mentioned" else (kind, [chunk.value])
            self.frames.append(Frame(verb=verb, objects=phrases, sentence=self._sentence))
            return at + 1
        if kind == "negated":
            self._start(chunk)
            self._frame.negated = True
            return at + 1
        if kind == "same":
            if at + 1 < len(self.chunks) and self.chunks[at + 1].kind == "noun phrase":
                self._close()
            self._frame.same = True
            self._extend(chunk)
            return at + 1
        if kind == "stays":
            self._frame.stays = True
            self._frame.end = chunk.end
            return at + 1
        if kind == "except":
            return self._exceptions(at)
        if kind == "noun phrase":
            return self._objects(at)
        if kind in PREDICATES:
            return self._predicate(at)
        self.residue.append(chunk)
        return at + 1

    def _verb(self, at: int) -> int:
        chunk, frame = self.chunks[at], self._frame
        participle = chunk.said.lower().split()[0].endswith("ed") or (chunk.said.lower() == "put" and not frame.predicates)
        if frame.objects and self._pending is None and (participle or not (frame.verb or frame.predicates)):
            return self._take_verb(at)
        if frame.verb == "place" and participle and frame.objects and not frame.predicates and self._pending is None:
            return self._take_verb(at)
        stands = frame.verb == "make" and chunk.said.lower() in ("stand", "sit", "go", "rest", "lie")
        if stands and frame.objects and not frame.predicates and self._pending is None:
            frame.verb, frame.verb_said = chunk.value, chunk.said.lower()  # "make the drill stand in the corner"
            return at + 1
        linked = chunk.value == "make" and frame.objects and not frame.has("shape") and self._pending is None
        if linked:
            return at + 1
        alone = at + 1 == len(self.chunks) or self.chunks[at + 1].kind in ("stop", "comma", "and", "then")
        if chunk.value == "swap" and frame.objects and not frame.predicates and not frame.verb and alone:
            return self._take_verb(at)  # "scissors and tape: trade places"
        if frame.verb == "make" and chunk.value == "place" and frame.objects and not frame.predicates and self._pending is None:
            frame.verb, frame.verb_said = "place", chunk.said.lower()  # "make the drill stand in the corner"
            self._extend(chunk)
            return at + 1
        if frame.negated and not frame.verb and not frame.objects:
            frame.verb = chunk.value
            return at + 1
        whole = frame.has("shape", "table setting", "grid", "rows", "columns", "group")
        fronted = (
            bool(frame.predicates)
            and not whole
            and not frame.objects
            and not frame.verb
            and frame.sentence == self._sentence
        )
        only_order = fronted and all(each.kind in ("order", "listed", "direction") for each in frame.predicates)
        if not frame.empty and (not fronted or self._pending in _BOUNDARIES) and not only_order:
            self._close()
            self._frame.first = chunk.first
        self._pending = None
        return self._take_verb(at)

    def _take_verb(self, at: int) -> int:
        chunk = self.chunks[at]
        if not self._frame.verb or self._frame.verb == "place":
            self._frame.verb, self._frame.verb_said = chunk.value, chunk.said.lower()
        self._extend(chunk)
        if chunk.value in SHAPES_OF_VERB:
            shape = SHAPES_OF_VERB[chunk.value]
            self._frame.predicates.append(Predicate("verb shape", Shape(shape), chunk.said, chunk.first, chunk.end))
        return at + 1

    def _start(self, chunk: Chunk) -> None:
        if not self._frame.empty:
            self._close()
        self._frame.first = chunk.first
        self._pending = None

    def _extend(self, chunk: Chunk) -> None:
        frame = self._frame
        if frame.end == 0:
            frame.first, frame.sentence = chunk.first, self._sentence
        frame.end = max(frame.end, chunk.end)

    def _close(self) -> None:
        if not self._frame.empty:
            self.frames.append(self._frame)
        self._frame = Frame(sentence=self._sentence)
        self._pending = None

    # Noun phrases

    def _objects(self, at: int) -> int:
        frame, chunk = self._frame, self.chunks[at]
        phrases, end = self.lists.read(at, self._frame)
        joint = self._pending
        if self._counts(phrases):  # "..., all three in a row"
            phrases = [NounPhrase("pronoun", phrases[0].first, phrases[0].end, "all of them")]
        if self._heading(phrases, end):
            return end
        if self._copies is not None and phrases[0].kind in ("objects", "rest"):
            return self._one_of(at)
        if phrases[0].kind == "each other":
            self.residue.append(chunk)
            return end
        if end < len(self.chunks) and self.chunks[end].kind == "stays" and frame.objects:
            self._close()  # "swap them while everything else remains unchanged"
            self._frame.objects = phrases
        elif frame.objects and not frame.predicates and joint in ("and", "comma", "list", "or") and not frame.second:
            frame.objects += phrases
        elif frame.objects and joint is None and phrases[0].superlative and not frame.predicates:
            self.residue.append(chunk)
        elif frame.objects and self._members_of(frame, phrases):
            frame.objects += phrases
        elif frame.objects and self._said_of(frame):
            if self._added(frame, end):
                frame.objects += phrases
            else:
                self._close()
                self._frame.objects = phrases
        elif frame.objects:
            self._close()
            self._frame.objects = phrases
        elif frame.predicates and not frame.verb and joint in _BOUNDARIES and frame.sentence != self._sentence:
            self._close()
            self._frame.objects = phrases
        else:
            frame.objects = phrases
        self._pending = None
        self._extend(chunk)
        self._frame.end = self.chunks[end - 1].end
        return end

    def _counts(self, phrases: list[NounPhrase]) -> bool:
        """Return whether a phrase only counts the objects that were named: "all three", "all five of them"."""
        said = phrases[0].mention
        named = any(frame.objects for frame in (*self.frames, self._frame))
        bare = said is not None and said.noun == ANY and not said.modifiers and (said.count or 0) > 1
        return named and len(phrases) == 1 and bare and phrases[0].text.lower().startswith("all ")

    def _members_of(self, frame: Frame, phrases: list[NounPhrase]) -> bool:
        """Return whether adjectives after a colon list the group before them: "cups from left to right: red, blue"."""
        keys = all(each.kind in ("shape", "verb shape", "direction", "listed", "side by side", "stacked") for each in frame.predicates)
        group = len(frame.objects) == 1 and frame.objects[0].many and frame.objects[0].kind == "objects"
        return self._pending == "comma" and keys and group and len(phrases) > 1 and all(one.borrowed for one in phrases)

    def _one_of(self, at: int) -> int:
        """Read the objects of one of "two towers": "one with the cans and one with the cups"."""
        shape, left = self._copies
        if any(each.kind == "shape" for each in self._frame.predicates) or self._frame.objects:
            self._close()
        phrase, end = self.lists.one(at, self._frame)
        self._frame.objects = [phrase]
        self._frame.predicates.append(
            Predicate("shape", replace(shape.value, count=1), shape.said, shape.first, shape.end)
        )
        self._extend(self.chunks[at])
        self._copies = (shape, left - 1) if left > 1 else None
        self._pending = None
        return end

    def _heading(self, phrases: list[NounPhrase], end: int) -> bool:
        """Return whether the phrase only announces what comes: "make two things: ..."."""
        said = phrases[0].mention
        colon = end < len(self.chunks) and self.chunks[end].said == ":"
        return colon and len(phrases) == 1 and said is not None and said.noun == "object" and not said.modifiers

    def _said_of(self, frame: Frame) -> bool:
        return any(each.kind != "verb shape" for each in frame.predicates) or frame.has("verb shape")

    def _added(self, frame: Frame, end: int) -> bool:
        """Return whether objects after a complete frame belong to it: "put the mug on the left, and the bowl too"."""
        following = self.chunks[end] if end < len(self.chunks) else None
        too = following is not None and following.said.lower() in ("too", "also", "as well")
        stacked = frame.has("verb shape", "shape")
        only_verb = all(each.kind == "verb shape" for each in frame.predicates)
        if (
            only_verb
            and self._pending in ("and", "comma", "list")
            and not too
            and not self.lists.predicate_follows(end)
        ):
            return True
        return too and not stacked

    def _continues_list(self, at: int) -> bool:
        frame = self._frame
        only_verb = all(each.kind in ("verb shape", "shape", "listed", "direction") for each in frame.predicates)
        if not (frame.objects and only_verb and at < len(self.chunks) and self.chunks[at].kind == "noun phrase"):
            return False
        if frame.has("shape") and not self.lists.bare_phrase(at):
            return False
        return frame.objects[0].kind == "objects" and not self.lists.opens_frame(at + 1) or self._shape_ends(at + 1)

    def _shape_ends(self, at: int) -> bool:
        return (
            at < len(self.chunks)
            and self.chunks[at].kind in ("shape", "direction", "listed")
            and not self._frame.has("shape")
        )

    def _exceptions(self, at: int) -> int:
        if at + 1 >= len(self.chunks) or self.chunks[at + 1].kind != "noun phrase":
            self.residue.append(self.chunks[at])
            return at + 1
        phrases, end = self.lists.exceptions(at + 1, self._frame)
        if self._frame.objects:
            last = self._frame.objects[-1]
            self._frame.objects[-1] = replace(last, without=(*last.without, *phrases))
        else:
            self._frame.objects = [
                NounPhrase("all", self.chunks[at].first, self.chunks[at].end, "everything", without=tuple(phrases))
            ]
        self._frame.end = self.chunks[end - 1].end
        return end

    # Predicates

    def _with(self, at: int) -> bool:
        """Return whether "with" joins objects to a verb: "swap the mug with the bowl", "surround it with cups"."""
        following = self.chunks[at + 1] if at + 1 < len(self.chunks) else None
        return (
            following is not None
            and following.kind == "noun phrase"
            and self._frame.verb in ("swap", "surround", "flank")
            and bool(self._frame.objects)
        )

    def _with_objects(self, at: int) -> int:
        phrases, end = self.lists.read(at, self._frame, reference=True)
        self._frame.second = phrases
        self._frame.end = self.chunks[end - 1].end
        return end

    def _predicate(self, at: int) -> int:
        if self._frame.stays:
            self._close()
        chunk, frame = self.chunks[at], self._frame
        reference: list[NounPhrase] = []
        end = at + 1
        if (
            chunk.kind in ("relation", "apart", "relation?", "either side")
            and end < len(self.chunks)
            and self.chunks[end].kind == "noun phrase"
        ):
            alone = chunk.value != "between" or self.chunks[end].value.many  # "between the two cans, and the mug ..."
            reference, end = self.lists.read(end, frame, reference=alone)
            if chunk.value == "between" and len(reference) > 2:
                end = self.lists.after_two(at + 1)
                reference = reference[:2]
        elif chunk.kind in ("relation", "apart", "either side") and end < len(self.chunks) and self._structure_named(end):
            reference, end = [self._structure(end)], end + 1
        elif chunk.kind == "relation" and (whole := self._new_structure(end)) is not None:
            reference, end = [whole[0]], whole[1]
        elif (
            chunk.kind == "relation"
            and chunk.value == "in"
            and end < len(self.chunks)
            and self.chunks[end].kind in ("relation", "place")
        ):
            return end  # "tuck the cup in behind the bottle"
        if (
            chunk.kind == "move"
            and chunk.said.lower().endswith("away")
            and frame.has("relation", "relation it", "apart")
        ):
            chunk = replace(chunk, kind="away")  # "behind the bowl, 4 cm away"
        if chunk.kind == "length" and (spaced := self._gap_between(at)):
            return spaced
        if chunk.kind == "same distance":
            chunk = replace(chunk, kind="away")
        if chunk.kind == "another" and self._copies is not None:
            return end
        if chunk.kind == "another":
            shapes = [
                each.value.name for one in (*self.frames, frame) for each in (*one.get("verb shape"), *one.get("shape"))
            ]
            if not shapes:
                self.residue.append(chunk)
                return end
            chunk = replace(chunk, kind="shape", value=Shape(shapes[-1]))
        if (
            chunk.kind == "rows"
            and chunk.value > 1
            and not frame.objects
            and self._copies is None
            and self.lists.begins(end)
        ):
            chunk = replace(chunk, kind="shape", value=Shape("line", count=chunk.value))
        several = chunk.kind == "shape" and len(frame.objects) > 1 and not frame.has("group")
        if several and chunk.value.count in (0, len(frame.objects)):
            return self._one_for_each(at)
        if chunk.kind == "shape" and chunk.value.count > 1 and not frame.objects and self._copies is None:
            self._copies = (chunk, chunk.value.count)
            self._extend(chunk)
            return end
        own = [one.value.name for one in (*frame.get("shape"), *frame.get("verb shape"))] if chunk.kind == "shape" else []
        if own == [chunk.value.name if own else ""] and self._pending == "and" and chunk.value.definite and not chunk.value.linked:
            self._close()  # "put the cups in a row and the row on the left"
            return self._structure_objects(at)
        if chunk.kind == "shape" and self._names_structure(chunk):
            return self._structure_objects(at)
        if chunk.kind == "shape" and frame.has("shape") and self._pending is not None:
            verb = frame.verb
            self._close()
            self._frame.verb = verb
            self._extend(chunk)
        made = Predicate(
            chunk.kind, chunk.value, chunk.said, chunk.first, self.chunks[end - 1].end, chunk.metres, tuple(reference)
        )
        if self._fronted(at, end):
            self._close()
        self._pending = None
        self._extend(chunk)
        self._frame.end = self.chunks[end - 1].end
        self._frame.predicates.append(made)
        return end

    def _one_for_each(self, at: int) -> int:
        """Read "put the cups and the cans in two clusters": one for each noun phrase."""
        chunk, phrases, verb = self.chunks[at], self._frame.objects, self._frame.verb
        for number, phrase in enumerate(phrases):
            self._frame.objects = [phrase]
            self._extend(chunk)
            self._frame.verb = self._frame.verb or verb
            self._frame.predicates.append(
                Predicate("shape", replace(chunk.value, count=1), chunk.said, chunk.first, chunk.end)
            )
            if number + 1 < len(phrases):
                self._close()
        return at + 1

    def _gap_between(self, at: int) -> int:
        """Read "put 5 cm between the cans", which has a gap and its objects; return the place after it, or 0."""
        following = self.chunks[at + 1 : at + 3]
        if (
            [one.kind for one in following] != ["relation", "noun phrase"]
            or following[0].value != "between"
            or self._frame.objects
        ):
            return 0
        chunk = self.chunks[at]
        self._frame.predicates.append(Predicate("gap", True, chunk.said, chunk.first, following[0].end, chunk.metres))
        self._frame.objects, end = self.lists.read(at + 2, self._frame)
        self._extend(chunk)
        return end

    def _new_structure(self, at: int) -> tuple[NounPhrase, int] | None:
        """Read a structure that something stands by: "the duck in front of a row made of the blocks"."""
        chunks = self.chunks
        if at + 1 >= len(chunks) or chunks[at].kind != "shape" or chunks[at].value.definite or chunks[at].value.linked:
            return None
        if chunks[at].value.count > 1 or chunks[at + 1].kind != "noun phrase" or chunks[at + 1].first == chunks[at].end:
            return None
        frame = Frame(sentence=self._sentence, first=chunks[at].first)
        frame.predicates = [Predicate("shape", chunks[at].value, chunks[at].said, chunks[at].first, chunks[at].end)]
        frame.objects, end = self.lists.read(at + 1, frame)
        frame.end = chunks[end - 1].end
        self.frames.append(frame)
        return self._structure(at), end

    def _structure_named(self, at: int) -> bool:
        chunk = self.chunks[at]
        return chunk.kind == "shape" and chunk.value.definite and not chunk.value.linked

    def _structure(self, at: int) -> NounPhrase:
        chunk = self.chunks[at]
        return NounPhrase("structure", chunk.first, chunk.end, chunk.value.name)

    def _names_structure(self, chunk: Chunk) -> bool:
        """Return whether "the row" means one that was asked for before."""
        frame = self._frame
        complete = frame.objects and frame.has("shape", "verb shape") and self._pending is not None
        if not chunk.value.definite or chunk.value.linked or not (complete or not (frame.objects or frame.has("shape"))):
            return False
        return any(
            each.value.name == chunk.value.name
            for one in (*self.frames, *((frame,) if complete else ()))
            for each in (*one.get("shape"), *one.get("verb shape"))
        )

    def _structure_objects(self, at: int) -> int:
        if self._frame.objects:
            self._close()
        self._frame.objects = [self._structure(at)]
        self._extend(self.chunks[at])
        self._pending = None
        return at + 1

    def _fronted(self, at: int, end: int) -> bool:
        """Return whether what is said here belongs to objects that come after it: "..., and on the right the cans"."""
        frame = self._frame
        if not frame.objects and not (frame.predicates and self._pending in _BOUNDARIES and frame.verb):
            return False
        if self._pending is None:
            return False
        while end < len(self.chunks) and self.chunks[end].kind in ("comma", *PREDICATES, "noise"):
            if (
                self.chunks[end].kind in ("relation", "apart")
                and end + 1 < len(self.chunks)
                and self.chunks[end + 1].kind == "noun phrase"
            ):
                _, end = self.lists.read(end + 1, self._frame, reference=True)
                continue
            end += 1
        if end >= len(self.chunks):
            return False
        following = self.chunks[end].kind
        stronger = self._pending in _BOUNDARIES
        plain = self.chunks[at].kind in ("another", "place", "relation", "shape", "along", "grid", "relation it")
        if following == "verb":
            again = self.chunks[at].kind == "place" and frame.has("place", "along")  # "..., and on the right arrange ..."
            return plain and (stronger or (again and self.chunks[end + 1 : end + 2] != [] and self.chunks[end + 1].kind == "noun phrase"))
        return following == "noun phrase" and plain and not self._frame_of_phrase(end)

    def _frame_of_phrase(self, at: int) -> bool:
        """Return whether the noun phrase here begins a frame of its own, with its own predicate."""
        _, end = self.lists.read(at, self._frame, reference=True)
        return (
            end < len(self.chunks)
            and self.chunks[end].kind in PREDICATES
            and self.chunks[end].kind in ("place", "relation", "shape")
        )
