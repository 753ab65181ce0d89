"""Compose the structures of a goal, with what is said of them after they were asked for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from grounding.goal_reading.drafts import Draft, TwoValuesError
from grounding.goal_reading.frame import Frame
from grounding.goal_reading.frame_objects import FrameObjects
from grounding.goal_reading.members import ORDERED, is_member, ordered, other_end, spot_of
from grounding.goal_reading.noun_phrase import NounPhrase
from grounding.goal_reading.places import Place
from grounding.goal_reading.relation_parts import RelationParts
from grounding.goal_reading.scene_references import ReadingError
from grounding.goal_reading.structure_keys import StructureKeys
from grounding.goals.parts import PartReference
from grounding.parse_result import shortened

_AROUND_OBJECTS = ("circle", "arc", "rectangle", "square", "triangle")


class StructureParts:
    """The structures of one goal.

    Args:
        objects: finds the objects of frames; its drafts grow.
        relations: of the same goal.

    Attributes:
        unread: words of frames that no key could take.
        notes: what has to be said about what was left out, a sentence each.
    """

    def __init__(self, objects: FrameObjects, relations: RelationParts) -> None:
        self.objects, self.relations, self.text = objects, relations, objects.text
        self.drafts, self.find, self.known = objects.drafts, objects.find, objects.known
        self.unread: list[str] = []
        self.notes: list[str] = []
        self._given = len(self.drafts)  # of what was asked for before: its keys may be said anew

    def add(self, frame: Frame, values: dict[str, Any], objects: Any) -> None:
        """Add a structure that a frame asks for."""
        self.drafts.append(Draft(frame, values, objects=objects))
        self.known.structure = len(self.drafts) - 1
        self.known.unused = None
        if isinstance(objects, tuple):
            self.known.last = objects

    def keys(self, frame: Frame, shape: str | None = None) -> tuple[StructureKeys, dict[str, Any]]:
        """Read the slots and keys of a frame; return their reader and the values.

        Args:
            frame: what is said.
            shape: of the structure that more is said of.
        """
        keys = StructureKeys(self.text, lambda predicate: self.objects.reference(frame, predicate))
        values = keys.read(frame, shape)
        self.unread += keys.unread
        self.notes += keys.notes
        return keys, values

    def surround(self, frame: Frame) -> None:
        """Read "surround the plate with the cups", "circle the cups around the plate"."""
        center = self.objects.objects(frame.objects)
        ring = self.objects.objects(frame.second) if frame.second else None
        _, values = self.keys(frame)
        values["shape"] = values.get("shape") or "circle"
        if not isinstance(center, tuple):
            raise ReadingError(f"{shortened(self.text)!r} does not say what is to be surrounded")
        if values["around"] is not None and ring is None:  # "circle the blue cups around the can"
            center, ring = values["around"], center
        values["around"] = center
        self.add(frame, values, ring)

    def take_out(self, frame: Frame, objects: tuple[Any, ...]) -> None:
        """Take out of the structures what is placed for itself: "and put the orange one at the front".

        Raises:
            ReadingError: for a place of one object within a structure ("with the red one at the bottom").
        """
        for part in self.drafts:
            if part.values is None or part.objects is None or not set(objects) & set(part.objects):
                continue
            left = tuple(one for one in part.objects if one not in objects)
            if not frame.verb or len(left) < 2:
                said = [*(one.text for one in frame.objects[:1]), frame.predicates[0].said]
                raise self._inside(" ".join(said))
            part.objects = left

    def _inside(self, words: str) -> ReadingError:
        return ReadingError(
            f"{words!r} in {shortened(self.text)!r} asks for a place of one object within a structure, which cannot be "
            "built yet"
        )

    # More of a structure

    def take_inner(self, frame: Frame) -> bool:
        """Read "a circle of cups with the bowl in the middle": the bowl is what the circle is laid around.

        Args:
            frame: where it says something else, its predicates are changed to that.

        Returns:
            Whether that is all that the frame says.
        """
        inner = frame.get("inner")
        if not inner:
            return False
        said = inner[0].said.lower()
        last = self.drafts[-1].values if self.drafts else None
        takes = last is not None and last.get("shape") in _AROUND_OBJECTS
        if takes and frame.objects and len(frame.predicates) == 1 and frame.objects[0].kind == "objects":
            center = self.objects.objects(frame.objects)
            if not isinstance(center, tuple) or len(center) != 1:
                raise ReadingError(
                    f"{frame.objects[0].text!r} in the middle of the {last['shape']} must be one object"
                )
            last["around"] = center
            self.known.mentioned.append((center, False))
            return True
        if said != "inside it" and (" of " in said or "inside" in said):
            raise ReadingError(
                f"{inner[0].said!r} is not understood in {shortened(self.text)!r}: say in the middle of what"
            )
        frame.predicates = [
            each if each.kind != "inner"
            else replace(each, kind="relation it", value="in") if said == "inside it"
            else replace(each, kind="place", value=_middle(each.said))
            for each in frame.predicates
        ]  # fmt: skip
        return False

    def take_more(self, frame: Frame) -> bool:
        """Add what is said of a structure after it: "put the cups in a circle. On the left.", "... put them there".

        Returns:
            Whether the frame is of a structure.
        """
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
        numbers = [i for i in range(number + 1) if self.drafts[i].values is not None] if several else [number]
        for each in numbers[:-1]:
            self._more(each, frame)
        return self._more(number, frame)

    def _again(self, frame: Frame) -> int | None:
        """Return the structure whose objects a frame names again, to say more of it: "the cups should be apart"."""
        named = all(one.kind == "objects" for one in frame.objects) and bool(frame.objects)
        shaped = frame.has("shape", "verb shape", "grid", "stacked", "side by side", "group")
        if not named or shaped or frame.verb or not self.drafts or self.find.objects is None or self.find.catalogue:
            return None
        if any(one.borrowed or not one.many for one in frame.objects):
            return None
        objects = {one for phrase in frame.objects for one in self.find.fitting(phrase)}
        structures = [(i, part) for i, part in enumerate(self.drafts) if part.values is not None]
        same = [i for i, part in structures if set(part.objects or ()) == objects]
        return same[0] if same and self.drafts[same[0]].values.get("shape") is not None else None

    def _more(self, number: int, frame: Frame) -> bool:
        part = self.drafts[number]
        if part.values is None:
            return False
        keys, more = self.keys(frame, part.values.get("shape"))
        for key, value in more.items():
            if value is None or key == "shape" and value == part.values.get("shape"):
                continue
            if number >= self._given and part.values.get(key) is not None and part.values[key] != value:
                before = f"{key.replace('_', ' ')} {part.values[key]}"
                raise TwoValuesError(f"{shortened(self.text)!r} contradicts itself: {before} and {value}")
            part.values[key] = value
        self.relations.read(frame, PartReference(number), keys)
        return True

    # Members of a structure

    def members(self, frame: Frame, following: Sequence[Frame]) -> int:
        """Read the frames after a structure that say where single objects stand in it; return how many there are.

        Args:
            frame: that of the structure.
            following: the frames after it.
        """
        part = self.drafts[-1] if self.drafts and self.drafts[-1].frame is frame else None
        shape = part.values.get("shape") if part is not None and part.values is not None else None
        if shape not in ORDERED or not isinstance(part.objects, tuple):
            return 0
        members: list[tuple[Any, str | None]] = []
        count = 0
        for one in following:
            if not is_member(one, shape) or not one.predicates and not one.objects:
                break
            said = [self._member(part, phrase) for phrase in one.objects]
            if any(len(objects) != 1 for objects in said):
                break
            spot = spot_of(one.predicates[0], shape) if one.predicates else None
            members += [(objects[0], spot if objects is said[-1] else None) for objects in said]
            count += 1
        if not any(spot for _, spot in members):
            return 0
        if self._any_of(part) and len(members) == len(part.objects):
            part.objects = tuple(one for one, _ in members)  # "three blocks: the red one at the bottom, ..."
        self._order(part, shape, members, following[0])
        return count

    def _any_of(self, part: Draft) -> bool:
        """Return whether a structure is of any objects of a number: "stack three blocks"."""
        phrases = part.frame.objects
        said = phrases[0].mention if len(phrases) == 1 else None
        counted = said is not None and said.exact and not said.definite and not said.modifiers
        return counted and self.find.objects is not None

    def _member(self, part: Draft, phrase: NounPhrase) -> tuple[Any, ...]:
        """Find which object of a structure a phrase means."""
        if not self._any_of(part):
            return self.objects.among(part.objects, phrase)
        kinds = replace(part.frame.objects[0], mention=replace(part.frame.objects[0].mention, count=None))
        found = self.objects.among(self.find.fitting(kinds), phrase)
        return found[:1] if phrase.text.lower().startswith(("a ", "an ")) else found

    def _order(self, part: Draft, shape: str, members: list[tuple[Any, str | None]], frame: Frame) -> None:
        """Order a structure by the places of its members."""
        order = part.values.get("order")
        if order is not None and order.by == "listed" and order.start is None and len(members) == 1:
            (one, spot) = members[0]
            if spot != "middle" and one in (part.objects[0], part.objects[-1]):  # "in this order, the fork on the left"
                part.values["order"] = replace(order, start=spot if one == part.objects[0] else other_end(spot))
                return
        found = ordered(part.objects, shape, members) if order is None else None
        if found is None:
            said = [frame.objects[0].text, *(each.said for each in frame.predicates[:1])]
            raise self._inside(" ".join(said).strip())
        part.objects, part.values["order"] = found


def _middle(said: str) -> Place:
    return Place(y_position="middle") if "middle" in said.lower() else Place(x_position="center")
