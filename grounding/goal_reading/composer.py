"""Compose the goal of an instruction from its frames: structures with their keys, and relations."""

from __future__ import annotations

from typing import Any

from grounding.goal_reading.antecedents import antecedents_of
from grounding.goal_reading.denials import is_replaced, stated
from grounding.goal_reading.drafts import Draft, draft_of, made_part, refuse_another_shape, refuse_touching
from grounding.goal_reading.ellipsis import completed
from grounding.goal_reading.frame import RELATIONAL, Frame, Predicate
from grounding.goal_reading.frame_objects import FrameObjects
from grounding.goal_reading.noun_phrase import NounPhrase
from grounding.goal_reading.relation_parts import RelationParts
from grounding.goal_reading.scene_references import ReadingError, ReadingQuestion, SceneReferences
from grounding.goal_reading.structure_keys import StructureKeys
from grounding.goal_reading.structure_parts import StructureParts
from grounding.goals.goal import Goal
from grounding.goals.part_numbers import laid_around
from grounding.goals.parts import PartReference, RelationPart
from grounding.parse_result import Question, shortened

NOTHING = Goal()
_PLACES = ("x_position", "y_position")


class Composer:
    """The composition of one goal.

    Args:
        text: the instruction.
        frames: of the instruction.
        references: finds the objects that noun phrases mean.
        before: what was asked for before: the instruction adds to it, or says something else of it.
        about: the part of it that "it" is, where that is known.

    Attributes:
        unread: words that no part could take.
        notes: what has to be said about what was left out, a sentence each.
        unused: noun phrases of which nothing is said.
    """

    def __init__(
        self,
        text: str,
        frames: list[Frame],
        references: SceneReferences,
        before: Goal = NOTHING,
        about: int | None = None,
    ) -> None:
        self.text, self.frames, self.find = text, frames, references
        self.parts: list[Draft] = [draft_of(part) for part in before.parts]
        self.known = antecedents_of(before, about)
        self.objects = FrameObjects(text, self.parts, references, self.known)
        self.relations = RelationParts(self.objects)
        self.structures = StructureParts(self.objects, self.relations)
        self.unread, self.notes = self.structures.unread, self.structures.notes
        self.unused: list[NounPhrase] = []
        self._given = len(before.parts)

    @property
    def paired(self) -> bool:
        """Return whether a relation holds one by one between objects."""
        return self.relations.paired

    def goal(self) -> Goal:
        """Compose the goal.

        Raises:
            ReadingError: for what cannot be said in a goal.
            ReadingQuestion: for a doubt.
            GoalError: for parts that are not legal.
        """
        at = 0
        while at < len(self.frames):
            frame, number = self.frames[at], len(self.parts)
            self.known.before = len(self.known.mentioned)
            if frame.negated and is_replaced(frame, self.frames[at + 1 :]):
                self._mention(frame)  # "don't put the cups in a row, put them in a circle"
            else:
                self._frame(stated(frame))
            at += 1
            if len(self.parts) > number:
                at += self.structures.members(frame, self.frames[at:])
        if self.known.unused is not None:
            self._unread(self.known.unused)
        refuse_touching(self.parts[self._given :], self.known.untouched, self.text)
        left_out = self.known.left_out
        made = (made_part(part, self.parts, self.text, self.find, left_out) for part in self.parts)
        return laid_around(Goal(tuple(made)))

    def _unread(self, frame: Frame) -> None:
        words = " ".join(phrase.text for phrase in frame.objects) or " ".join(each.said for each in frame.predicates)
        self.unread.append(words or frame.verb_said)
        self.unused += frame.objects

    def _frame(self, frame: Frame) -> None:
        self.find.subject = None
        if frame.verb == "mention":
            self._mention(frame)
            return
        if frame.verb == "among":
            self.find.scope = frame.objects[0]
            if self.find.objects is None:
                self._unread(frame)  # what is chosen from them cannot be said in words
            return
        if frame.stays or frame.verb == "leave":
            self._leave(frame)
            return
        if frame.negated:
            raise ReadingError(
                f"{shortened(self.text)!r} says what must not be built, and only what stands in the end can be asked "
                "for"
            )
        if completed(frame, self.known.frame):
            self._frame(frame)
            return
        if frame.same:
            raise ReadingError(f"{shortened(self.text)!r} does not say what should be the same")
        if self.structures.take_inner(frame) or self.structures.take_more(frame):
            return
        if frame.verb == "swap":
            self.unread += [each.said for each in frame.predicates]
            self.relations.swap(frame)
        elif frame.verb == "surround":
            self.structures.surround(frame)
        elif frame.verb == "flank":
            if frame.second and not frame.predicates:
                self.relations.flank(frame)
            else:
                self._unread(frame)
        elif not frame.predicates:
            self._only_objects(frame)
        else:
            self._placed(frame)
        self.known.frame = frame

    def _mention(self, frame: Frame) -> None:
        """Keep what only a comment names, for the "it" after it: "my aunt gave me this bowl; put the banana in it"."""
        for phrase in frame.objects:
            try:
                objects = self.find.find(phrase)
            except ReadingError:
                continue
            self.known.mentioned.append((objects, phrase.many))
            self.known.last, self.known.structure = objects, None

    def _leave(self, frame: Frame) -> None:
        for phrase in frame.objects:
            if phrase.kind == "objects":
                objects = self.find.find(phrase)
                self.known.left_out.update(objects)
                if frame.verb_said.lower().endswith(("touch", "move")):
                    self.known.untouched.update(objects)
                self.known.mentioned.append((objects, phrase.many))
            elif phrase.kind in ("rest", "all"):
                continue
            elif phrase.kind == "pronoun" and isinstance(objects := self.known.meant(phrase), tuple):
                self.known.left_out.update(objects)
            else:
                self._unread(frame)
        if not frame.objects and frame.verb == "leave":
            self._unread(frame)

    def _only_objects(self, frame: Frame) -> None:
        """Take what is only named: the objects of what comes next ("take the cans and line them up")."""
        if self.known.unused is not None:
            self._unread(self.known.unused)
        if frame.verb not in ("", "take") and not (frame.verb == "place" and frame.objects):
            self._unread(frame)
        objects = self.objects.objects(frame.objects)
        if isinstance(objects, tuple):
            self.known.last = objects
        self.known.structure = None
        self.known.unused = frame

    def _placed(self, frame: Frame) -> None:
        """Read what is said of objects: a structure of them, or places and relations."""
        self._resume_list(frame)
        keys, values = self.structures.keys(frame)
        objects = self.objects.objects(frame.objects) if frame.objects else self._unnamed()
        self.find.subject = objects if isinstance(objects, tuple) else None
        if isinstance(objects, PartReference):
            self.relations.read(frame, objects, keys)
            return
        many = (
            any(phrase.many for phrase in frame.objects)
            or len(frame.objects) > 1
            or (len(objects) > 1 if objects is not None else not frame.objects)
        )
        relations = [each for each in frame.predicates if each.kind in RELATIONAL and each.value != "around"]
        put = any(each.value in ("on", "in") for each in relations)
        if keys.verb_shape_only and values["shape"] == "tower" and not many and put:
            values["shape"] = None
        if values["shape"] is None and self._side_by_side(frame, objects, keys, values, relations):
            return
        if objects is None and self.parts:
            refuse_another_shape(frame, values["shape"], self.parts[-1], self.text)
        structure = keys.asks(values)
        if objects is None and (relations or frame.has("move")) and values["shape"] is None and not structure:
            self.relations.ask_which(frame)
        if values["rotation"] is not None and values["shape"] is None and not many:
            raise ReadingError(f"a single object cannot be turned to face somewhere, as {shortened(self.text)!r} asks")
        if structure or (_is_placed(values) and many):
            self._structure(frame, objects, many, keys, values)
        else:
            self._single(frame, objects, many, keys, values)

    def _resume_list(self, frame: Frame) -> None:
        """Give a frame the objects that were only listed before it: "the box first, then the jar, all in a row"."""
        unused = self.known.unused
        pronoun = (
            len(frame.objects) == 1
            and frame.objects[0].kind == "pronoun"
            and frame.objects[0].text.lower() not in ("it", "this", "that")
        )
        if unused is not None and unused.listed and len(unused.objects) > 1 and (pronoun or not frame.objects):
            frame.objects, frame.listed = unused.objects, True
            self.known.unused = None

    def _unnamed(self) -> Any:
        """Return the objects of a frame that names none: those that were only named before it."""
        if self.known.unused is not None and self.known.unused.objects:
            objects, self.known.unused = self.known.last, None
            return objects
        return None

    def _side_by_side(
        self, frame: Frame, objects: Any, keys: StructureKeys, values: dict[str, Any], relations: list[Predicate]
    ) -> bool:
        """Read "beside each other", and a gap, where no shape is said: two objects are next to each other, more a line.

        Returns:
            Whether that is all that the frame says.
        """
        two = objects is not None and len(objects) == 2
        if frame.has("beside each other"):
            if not two or _is_placed(values):
                values["shape"] = "line"
                return False
            self.relations.add(frame, RelationPart("next to", objects[:1], objects[1:], keys.distance))
            if len(frame.predicates) == 1:
                return True
        if values.get("gap") is None or not two or relations:
            return False
        self.relations.add(frame, RelationPart("next to", objects[:1], objects[1:], values["gap"]))
        return True

    def _structure(self, frame: Frame, objects: Any, many: bool, keys: StructureKeys, values: dict[str, Any]) -> None:
        """Add a structure, with the relations in which it or its objects stand."""
        if values["shape"] is None and values.get("gap") is not None:
            raise ReadingQuestion(
                Question(
                    "shape",
                    f"which shape should have the gaps in {shortened(self.text)!r}: line, circle or grid?",
                    ("line", "circle", "grid"),
                )
            )
        if not many and objects is not None and len(objects) == 1 and values["shape"] is not None:
            raise ReadingError(f"a {values['shape']} needs several objects, but {shortened(self.text)!r} names one")
        found = self.objects.references(frame)  # "behind it" is said of what came before
        objects = _without(objects, (values["around"], *found.values()))
        self.structures.add(frame, values, objects)
        own = PartReference(len(self.parts) - 1) if values["shape"] or objects is None else objects
        self.relations.read(frame, own, keys, found)

    def _single(self, frame: Frame, objects: Any, many: bool, keys: StructureKeys, values: dict[str, Any]) -> None:
        """Add the places, the ways and the relations of objects that form no structure."""
        if many and isinstance(objects, tuple):
            objects = _without(objects, tuple(self.objects.references(frame).values()))
        if _is_placed(values) and objects is not None:
            self.structures.take_out(frame, objects)
            place = {key: values[key] for key in _PLACES}
            self.relations.add(frame, RelationPart("at", objects, **place))
        for move in frame.get("move"):
            if objects is None:
                self.relations.ask_which(frame)
            self.relations.add(frame, RelationPart("moved", objects, distance=move.metres, direction=move.value))
        self.relations.read(frame, objects, keys)


def _is_placed(values: dict[str, Any]) -> bool:
    return any(values[key] is not None for key in _PLACES)


def _without(objects: Any, others: tuple[Any, ...]) -> Any:
    """Leave out what a structure is laid around, or stands by: "the blocks in a square around the orange block"."""
    if not isinstance(objects, tuple) or not objects or isinstance(objects[0], str):
        return objects
    out = {one for other in others if isinstance(other, tuple) for one in other}
    left = tuple(one for one in objects if one not in out)
    return left if len(left) > 1 or (left and len(objects) == 2) else objects
