"""Compose the goal of an instruction from its frames: structures with their keys, and relations."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from grounding.goal_reading.antecedents import antecedents_of
from grounding.goal_reading.denials import is_replaced, stated
from grounding.goal_reading.drafts import Draft, draft_of, made_part, refuse_another_shape, refuse_touching
from grounding.goal_reading.ellipsis import completed
from grounding.goal_reading.frame import RELATIONAL, Frame, Predicate
from grounding.goal_reading.frame_objects import FrameObjects
from grounding.goal_reading.members import ORDERED, is_member, ordered, other_end, spot_of
from grounding.goal_reading.noun_phrase import NounPhrase
from grounding.goal_reading.pairings import is_paired, pairs
from grounding.goal_reading.places import Place
from grounding.goal_reading.scene_references import ReadingError, ReadingQuestion, SceneReferences
from grounding.goal_reading.structure_keys import StructureKeys
from grounding.goals.goal import Goal
from grounding.goals.part_numbers import laid_around
from grounding.goals.parts import Objects, PartReference, RelationPart
from grounding.parse_result import Question, shortened

NOTHING = Goal()


class Composer:
    """The composition of one goal.

    Args:
        text: the instruction.
        frames: of the instruction.
        references: finds the objects that noun phrases mean.
        before: what was asked for before: the instruction adds to it, or says something else of it.
        about: the part of it that "it" is, where that is known.
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
        self._given = len(before.parts)  # parts whose keys may be said anew
        self.unread: list[str] = []
        self.paired = False  # whether a relation holds one by one between objects
        self.notes: list[str] = []
        self.unused: list[NounPhrase] = []  # that are named, and of which nothing is said
        self.objects = FrameObjects(text, self.parts, references, self.known)

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
            at += 1 + (self._members(at) if len(self.parts) > number else 0)
        if self.known.unused is not None:
            self._unread(self.known.unused)
        refuse_touching(self.parts[self._given :], self.known.untouched, self.text)
        goal = Goal(tuple(made_part(part, self.parts, self.text, self.find, self.known.left_out) for part in self.parts))
        return laid_around(goal)

    def _unread(self, frame: Frame) -> None:
        words = " ".join(phrase.text for phrase in frame.objects) or " ".join(each.said for each in frame.predicates)
        self.unread.append(words or frame.verb_said)
        self.unused += frame.objects

    # One frame

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
                f"{shortened(self.text)!r} says what must not be built, and only what stands in the end can be asked for"
            )
        if completed(frame, self.known.frame):
            self._frame(frame)
            return
        if frame.same:
            raise ReadingError(f"{shortened(self.text)!r} does not say what should be the same")
        if self._inner(frame) or self._continued(frame):
            return
        if frame.verb == "swap":
            self._swap(frame)
        elif frame.verb == "surround":
            self._surround(frame)
        elif frame.verb == "flank":
            self._flank(frame)
        elif not frame.predicates:
            self._only_objects(frame)
        else:
            self._placed(frame)
        self.known.frame = frame

    def _members(self, at: int) -> int:
        """Read the frames after a structure that say where single objects stand in it; return how many there are."""
        part = self.parts[-1] if self.parts and self.parts[-1].frame is self.frames[at] else None
        shape = part.values.get("shape") if part is not None and part.values is not None else None
        if shape not in ORDERED or not isinstance(part.objects, tuple):
            return 0
        members: list[tuple[Any, str | None]] = []
        count = 0
        for frame in self.frames[at + 1 :]:
            if not is_member(frame, shape) or not frame.predicates and not frame.objects:
                break
            said = [self._member(part, phrase) for phrase in frame.objects]
            if any(len(one) != 1 for one in said):
                break
            spot = spot_of(frame.predicates[0], shape) if frame.predicates else None
            members += [(one[0], spot if one is said[-1] else None) for one in said]
            count += 1
        if not any(spot for _, spot in members):
            return 0
        if self._any_of(part) and len(members) == len(part.objects):
            part.objects = tuple(one for one, _ in members)  # "three blocks: the red one at the bottom, ..."
        self._ordered(part, shape, members, self.frames[at + 1])
        return count

    def _any_of(self, part: Draft) -> bool:
        """Return whether a structure is of any objects of a number: "stack three blocks"."""
        phrases = part.frame.objects
        said = phrases[0].mention if len(phrases) == 1 else None
        return said is not None and said.exact and not said.definite and not said.modifiers and self.find.objects is not None

    def _member(self, part: Draft, phrase: NounPhrase) -> tuple[Any, ...]:
        """Find which object of a structure a phrase means."""
        if not self._any_of(part):
            return self.objects.among(part.objects, phrase)
        kinds = replace(part.frame.objects[0], mention=replace(part.frame.objects[0].mention, count=None))
        found = self.objects.among(self.find.fitting(kinds), phrase)
        return found[:1] if phrase.text.lower().startswith(("a ", "an ")) else found

    def _ordered(self, part: Draft, shape: str, members: list[tuple[Any, str | None]], frame: Frame) -> None:
        """Order a structure by the places of its members."""
        order = part.values.get("order")
        if order is not None and order.by == "listed" and order.start is None and len(members) == 1:
            (one, spot) = members[0]
            if spot != "middle" and one in (part.objects[0], part.objects[-1]):  # "in this order, the fork on the left"
                part.values["order"] = replace(order, start=spot if one == part.objects[0] else other_end(spot))
                return
        found = ordered(part.objects, shape, members) if order is None else None
        if found is None:
            words = " ".join((frame.objects[0].text, frame.predicates[0].said if frame.predicates else "")).strip()
            raise ReadingError(
                f"{words!r} in {shortened(self.text)!r} asks for a place of one object within a structure, which cannot be built yet"
            )
        part.objects, part.values["order"] = found

    def _mention(self, frame: Frame) -> None:
        """Keep what only a comment names, for the "it" after it: "my sister gave me this bowl; put the banana in it"."""
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

    def _inner(self, frame: Frame) -> bool:
        """Read "a circle of cups with the bowl in the middle": the bowl is what the circle is laid around."""
        inner = frame.get("inner")
        if not inner:
            return False
        structure = self.parts[-1] if self.parts and self.parts[-1].values is not None else None
        explicit = any(word in inner[0].said.lower() for word in (" of ", "inside"))
        takes = structure is not None and structure.values.get("shape") in (
            "circle",
            "arc",
            "rectangle",
            "square",
            "triangle",
        )
        if takes and frame.objects and len(frame.predicates) == 1 and frame.objects[0].kind in ("objects",):
            center = self.objects.objects(frame.objects)
            if not isinstance(center, tuple) or len(center) != 1:
                raise ReadingError(
                    f"{frame.objects[0].text!r} in the middle of the {structure.values['shape']} must be one object"
                )
            structure.values["around"] = center
            self.known.mentioned.append((center, False))
            return True
        if inner[0].said.lower() == "inside it":
            frame.predicates = [
                replace(each, kind="relation it", value="in") if each.kind == "inner" else each
                for each in frame.predicates
            ]
            return False
        if explicit:
            raise ReadingError(
                f"{inner[0].said!r} is not understood in {shortened(self.text)!r}: say in the middle of what"
            )
        frame.predicates = [
            replace(
                each,
                kind="place",
                value=Place(y_position="middle") if "middle" in each.said.lower() else Place(x_position="center"),
            )
            if each.kind == "inner"
            else each
            for each in frame.predicates
        ]
        return False

    def _continued(self, frame: Frame) -> bool:
        """Add what is said of a structure after it: "put the cups in a circle. On the left.", "..., then put them on the right"."""
        pronoun = len(frame.objects) == 1 and frame.objects[0].kind in ("pronoun", "structure")
        number = self.known.structure
        if frame.objects and frame.objects[0].kind == "structure":
            number = self.objects.structure_of(frame.objects[0])
        if (again := self._again(frame)) is not None:
            number, pronoun = again, True
        bare = not frame.objects and not frame.verb and frame.predicates
        if not (pronoun or bare) or number is None or not frame.predicates or frame.verb in ("swap", "surround"):
            return False
        several = frame.objects and frame.objects[0].text.lower().split()[0] in ("both", "all", "each")
        numbers = [i for i in range(number + 1) if self.parts[i].values is not None] if several else [number]
        for each in numbers[:-1]:
            self._more(each, frame)
        return self._more(number, frame)

    def _again(self, frame: Frame) -> int | None:
        """Return the structure whose objects a frame names again, to say more of it: "the cups should be 5 cm apart"."""
        named = all(one.kind == "objects" for one in frame.objects) and bool(frame.objects)
        shaped = frame.has("shape", "verb shape", "grid", "stacked", "side by side", "group")
        if not named or shaped or frame.verb or not self.parts or self.find.objects is None or self.find.catalogue:
            return None
        if any(one.borrowed or not one.many for one in frame.objects):
            return None
        objects = {one for phrase in frame.objects for one in self.find.fitting(phrase)}
        same = [i for i, part in enumerate(self.parts) if part.values is not None and set(part.objects or ()) == objects]
        return same[0] if same and self.parts[same[0]].values.get("shape") is not None else None

    def _more(self, number: int, frame: Frame) -> bool:
        part = self.parts[number]
        if part.values is None:
            return False
        keys = StructureKeys(self.text, self._reference_of(frame))
        more = keys.read(frame, shape=part.values.get("shape"))
        for key, value in more.items():
            if value is None or key == "shape" and value == part.values.get("shape"):
                continue
            if number >= self._given and part.values.get(key) is not None and part.values[key] != value:
                raise ReadingError(
                    f"{shortened(self.text)!r} contradicts itself: {key.replace('_', ' ')} {part.values[key]} and {value}"
                )
            part.values[key] = value
        self.unread += keys.unread
        self.notes += keys.notes
        self._relations(frame, PartReference(number), keys)
        return True

    # Swaps, rings

    def _swap(self, frame: Frame) -> None:
        phrases = [*frame.objects, *frame.second]
        objects = self.objects.objects(phrases)
        if objects is None and self.find.count == 2:
            objects = (0, 1)
        if not isinstance(objects, tuple):
            raise ReadingError(f"{shortened(self.text)!r} does not say which two objects trade places")
        objects = objects[:2] if self.find.catalogue else objects
        if len(objects) != 2 and not isinstance(objects[0], str):
            raise ReadingError(f"two objects can trade places, and {shortened(self.text)!r} names {len(objects)}")
        self.unread += [each.said for each in frame.predicates]
        self._add_relation(frame, RelationPart("swapped", objects))

    def _surround(self, frame: Frame) -> None:
        center = self.objects.objects(frame.objects)
        ring = self.objects.objects(frame.second) if frame.second else None
        keys = StructureKeys(self.text, self._reference_of(frame))
        values = keys.read(frame)
        values["shape"] = values.get("shape") or "circle"
        if not isinstance(center, tuple):
            raise ReadingError(f"{shortened(self.text)!r} does not say what is to be surrounded")
        if values["around"] is not None and ring is None:  # "circle the blue cups around the can"
            center, ring = values["around"], center
        values["around"] = center
        self.unread += keys.unread
        self.notes += keys.notes
        self._add_structure(frame, values, ring)

    def _flank(self, frame: Frame) -> None:
        """Read "flank the plate with the cups", and "the cups flank the plate"."""
        if len(frame.second) == 0 or frame.predicates:
            self._unread(frame)
            return
        said = Predicate("either side", True, frame.verb_said, frame.first, frame.end)
        center, sides = self.objects.objects(frame.objects), self.objects.objects(frame.second)
        self._either_side(replace(frame, objects=frame.second), said, sides, center, None)

    # Structures and relations

    def _placed(self, frame: Frame) -> None:
        unused = self.known.unused
        pronoun = (
            len(frame.objects) == 1
            and frame.objects[0].kind == "pronoun"
            and frame.objects[0].text.lower() not in ("it", "this", "that")
        )
        if unused is not None and unused.listed and len(unused.objects) > 1 and (pronoun or not frame.objects):
            frame.objects, frame.listed = unused.objects, True  # "the box first, then the jar, all in a row"
            self.known.unused = None
        keys = StructureKeys(self.text, self._reference_of(frame))
        values = keys.read(frame)
        self.unread += keys.unread
        self.notes += keys.notes
        objects = self.objects.objects(frame.objects) if frame.objects else self._unnamed(frame)
        self.find.subject = objects if isinstance(objects, tuple) else None
        if isinstance(objects, PartReference):
            number, objects = objects.part, None
            self._relations(frame, PartReference(number), keys)
            return
        count = len(objects) if objects is not None else None
        many = (
            any(phrase.many for phrase in frame.objects)
            or len(frame.objects) > 1
            or (not frame.objects and objects is None)
        )
        many = many or (count or 0) > 1
        relations = [
            each
            for each in frame.predicates
            if each.kind in RELATIONAL and each.value != "around"
        ]
        if (
            keys.verb_shape_only
            and values["shape"] == "tower"
            and not many
            and any(each.value in ("on", "in") for each in relations)
        ):
            values["shape"] = None
        if frame.has("beside each other") and values["shape"] is None:
            placed = values["x_position"] is not None or values["y_position"] is not None
            if count == 2 and objects is not None and not placed:
                self._add_relation(frame, RelationPart("next to", objects[:1], objects[1:], keys.distance))
                if len(frame.predicates) == 1:
                    return
            else:
                values["shape"] = "line"
        if (
            values["shape"] is None
            and values.get("gap") is not None
            and count == 2
            and not relations
            and objects is not None
        ):
            self._add_relation(frame, RelationPart("next to", objects[:1], objects[1:], values["gap"]))
            return
        if objects is None and self.parts:
            refuse_another_shape(frame, values["shape"], self.parts[-1], self.text)
        if objects is None and (relations or frame.has("move")) and values["shape"] is None and not keys.asks(values):
            self._which(frame)
        if values["rotation"] is not None and values["shape"] is None and not many:
            raise ReadingError(f"a single object cannot be turned to face somewhere, as {shortened(self.text)!r} asks")
        placed = values["x_position"] is not None or values["y_position"] is not None
        structure = keys.asks(values) or (placed and many)
        if structure:
            if values["shape"] is None and values.get("gap") is not None:
                raise ReadingQuestion(
                    Question(
                        "shape",
                        f"which shape should have the gaps in {shortened(self.text)!r}: line, circle or grid?",
                        ("line", "circle", "grid"),
                    )
                )
            if not many and count == 1 and values["shape"] is not None:
                raise ReadingError(
                    f"a {values['shape']} needs several objects, but {shortened(self.text)!r} names one"
                )
            found = self.objects.references(frame)  # "behind it" is said of what came before
            objects = self._without(objects, (values["around"], *found.values()))
            self._add_structure(frame, values, objects)
            own = PartReference(len(self.parts) - 1) if values["shape"] or objects is None else objects
            self._relations(frame, own, keys, found)
            return
        if many and isinstance(objects, tuple):
            objects = self._without(objects, tuple(self.objects.references(frame).values()))
        if placed and objects is not None:
            self._own(frame, objects)
            self._add_relation(
                frame, RelationPart("at", objects, x_position=values["x_position"], y_position=values["y_position"])
            )
        for move in frame.get("move"):
            self._add_relation(
                frame, RelationPart("moved", self._certain(objects, frame), distance=move.metres, direction=move.value)
            )
        self._relations(frame, objects, keys)

    def _without(self, objects: Any, others: tuple[Any, ...]) -> Any:
        """Leave out what a structure is laid around, or stands by: "the blocks in a square around the orange block"."""
        if not isinstance(objects, tuple) or not objects or isinstance(objects[0], str):
            return objects
        out = {one for other in others if isinstance(other, tuple) for one in other}
        left = tuple(one for one in objects if one not in out)
        return left if len(left) > 1 or (left and len(objects) == 2) else objects

    def _own(self, frame: Frame, objects: tuple[Any, ...]) -> None:
        """Refuse a place of one object within a structure ("with the red one at the bottom"), and take out of a structure
        what is placed for itself ("and put the orange one at the front")."""
        for part in self.parts:
            if part.values is None or part.objects is None or not set(objects) & set(part.objects):
                continue
            left = tuple(one for one in part.objects if one not in objects)
            if not frame.verb or len(left) < 2:
                words = (
                    " ".join((frame.objects[0].text, frame.predicates[0].said))
                    if frame.objects
                    else frame.predicates[0].said
                )
                raise ReadingError(
                    f"{words!r} in {shortened(self.text)!r} asks for a place of one object within a structure, which cannot be built yet"
                )
            part.objects = left

    def _which(self, frame: Frame) -> None:
        self.objects.ask_which(frame.objects[0].text if frame.objects else frame.predicates[0].said)

    def _certain(self, objects: Any, frame: Frame) -> Any:
        if objects is None:
            self._which(frame)
        return objects

    def _relations(
        self, frame: Frame, objects: Any, keys: StructureKeys, found: dict[int, Objects] | None = None
    ) -> None:
        found = self.objects.references(frame) if found is None else found
        for each in frame.predicates:
            if each.first not in found:
                continue
            reference = found[each.first]
            relation = each.value
            if relation == "between" and self.find.catalogue and isinstance(reference, tuple):
                reference = reference[:2]
            if relation == "in the middle of":
                relation = "between" if isinstance(reference, tuple) and len(reference) == 2 else relation
                relation = "in" if isinstance(reference, PartReference) else relation
            if relation == "in the middle of":
                raise ReadingError(
                    f"{each.said!r} is not understood in {shortened(self.text)!r}: say between which two objects"
                )
            if (
                relation == "between"
                and isinstance(reference, tuple)
                and len(reference) != 2
                and not isinstance(reference[0], str)
            ):
                raise ReadingError(
                    f"between needs two objects, and {each.said!r} in {shortened(self.text)!r} names {len(reference)}"
                )
            if objects is None and relation:
                self._which(frame)
            distance = keys.distances.get(each.first)
            if is_paired(frame, each) and self.find.count is not None and not self.find.catalogue:
                self._paired(frame, each, distance)
                continue
            if each.kind == "either side":
                self._either_side(frame, each, objects, reference, distance)
                continue
            self._add_relation(frame, RelationPart(relation, objects, reference, distance))
        if frame.has("relation?"):
            doubt = frame.get("relation?")[0]
            raise ReadingQuestion(
                Question(
                    "relation",
                    f"{doubt.said!r} in {shortened(self.text)!r} is not clear on a flat table: on top of it, behind it or in front of it?",
                    ("on", "behind", "in front of"),
                )
            )

    def _paired(self, frame: Frame, said: Predicate, distance: float | None) -> None:
        """Put one object by each of several others: "a spoon in each mug"."""
        self.paired = True
        for one, other in pairs(frame, said, self.find, self.text):
            self._add_relation(frame, RelationPart(said.value, (one,), (other,), distance))

    def _either_side(
        self, frame: Frame, said: Predicate, objects: Any, reference: Objects, distance: float | None
    ) -> None:
        """Put one of two objects on the left and the other on the right: "the cups on either side of the plate"."""
        for_each = len(frame.objects) == 1 and frame.objects[0].text.lower().startswith(("one ", "a ", "an "))
        if for_each and isinstance(objects, tuple) and self.find.objects is not None:
            objects = tuple(self.find.fitting(frame.objects[0]))  # "one ball on each side"
        if not isinstance(objects, tuple) or len(objects) != 2 or isinstance(objects[0], str):
            raise ReadingError(f"{said.said!r} in {shortened(self.text)!r} needs two objects, one for each side")
        for one, side in zip(objects, ("left of", "right of"), strict=True):
            self._add_relation(frame, RelationPart(side, (one,), reference, distance))

    def _add_structure(self, frame: Frame, values: dict[str, Any], objects: Any) -> None:
        self.parts.append(Draft(frame, values, objects=objects))
        self.known.structure = len(self.parts) - 1
        self.known.unused = None
        if isinstance(objects, tuple):
            self.known.last = objects

    def _add_relation(self, frame: Frame, relation: RelationPart) -> None:
        self.parts.append(Draft(frame, relation=relation))
        self.known.unused = None
        if not isinstance(relation.objects, PartReference):
            self.known.last = relation.objects
            self.known.structure = None

    # Noun phrases

    def _unnamed(self, frame: Frame) -> Any:
        if self.known.unused is not None and self.known.unused.objects:
            objects, self.known.unused = self.known.last, None
            return objects
        return None

    def _reference_of(self, frame: Frame):
        return lambda predicate: self.objects.reference(frame, predicate)
