"""Compose the relations of a goal: what is said of objects in a frame, swaps, and what stands on either side."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from grounding.goal_reading.drafts import Draft
from grounding.goal_reading.frame import Frame, Predicate
from grounding.goal_reading.frame_objects import FrameObjects
from grounding.goal_reading.pairings import is_paired, pairs
from grounding.goal_reading.scene_references import ReadingError, ReadingQuestion
from grounding.goal_reading.structure_keys import StructureKeys
from grounding.goals.parts import Objects, PartReference, RelationPart
from grounding.parse_result import Question, shortened


class RelationParts:
    """The relations of one goal.

    Args:
        objects: finds the objects of frames; its drafts grow.

    Attributes:
        paired: whether a relation holds one by one between objects.
    """

    def __init__(self, objects: FrameObjects) -> None:
        self.objects, self.text = objects, objects.text
        self.drafts, self.find, self.known = objects.drafts, objects.find, objects.known
        self.paired = False

    def add(self, frame: Frame, relation: RelationPart) -> None:
        """Add a relation that a frame asks for."""
        self.drafts.append(Draft(frame, relation=relation))
        self.known.unused = None
        if not isinstance(relation.objects, PartReference):
            self.known.last = relation.objects
            self.known.structure = None

    def read(
        self, frame: Frame, objects: Any, keys: StructureKeys, found: dict[int, Objects] | None = None
    ) -> None:
        """Read the relations of a frame.

        Args:
            frame: what is said.
            objects: what it is said of: objects, the structure of a part, or `None` where that is not known.
            keys: of the frame, which have its distances.
            found: what each relation is said of, where that was found before.

        Raises:
            ReadingError: for a relation that these objects cannot have.
            ReadingQuestion: for a doubt.
        """
        found = self.objects.references(frame) if found is None else found
        for each in frame.predicates:
            if each.first not in found:
                continue
            relation, reference = self._related(each, found[each.first])
            if objects is None and relation:
                self.ask_which(frame)
            distance = keys.distances.get(each.first)
            if is_paired(frame, each) and self.find.count is not None and not self.find.catalogue:
                self._paired(frame, each, distance)
            elif each.kind == "either side":
                self._either_side(frame, each, objects, reference, distance)
            else:
                self.add(frame, RelationPart(relation, objects, reference, distance))
        if frame.has("relation?"):
            doubt = frame.get("relation?")[0]
            raise ReadingQuestion(
                Question(
                    "relation",
                    f"{doubt.said!r} in {shortened(self.text)!r} is not clear on a flat table: on top of it, behind it "
                    "or in front of it?",
                    ("on", "behind", "in front of"),
                )
            )

    def swap(self, frame: Frame) -> None:
        """Read "swap the mug with the bowl", "the scissors and the tape trade places"."""
        objects = self.objects.objects([*frame.objects, *frame.second])
        if objects is None and self.find.count == 2:
            objects = (0, 1)
        if not isinstance(objects, tuple):
            raise ReadingError(f"{shortened(self.text)!r} does not say which two objects trade places")
        objects = objects[:2] if self.find.catalogue else objects
        if len(objects) != 2 and not isinstance(objects[0], str):
            raise ReadingError(f"two objects can trade places, and {shortened(self.text)!r} names {len(objects)}")
        self.add(frame, RelationPart("swapped", objects))

    def flank(self, frame: Frame) -> None:
        """Read "flank the plate with the cups", and "the cups flank the plate"."""
        said = Predicate("either side", True, frame.verb_said, frame.first, frame.end)
        center, sides = self.objects.objects(frame.objects), self.objects.objects(frame.second)
        self._either_side(replace(frame, objects=frame.second), said, sides, center, None)

    def ask_which(self, frame: Frame) -> None:
        """Ask which object a frame means.

        Raises:
            ReadingQuestion: always.
        """
        self.objects.ask_which(frame.objects[0].text if frame.objects else frame.predicates[0].said)

    def _related(self, said: Predicate, reference: Objects) -> tuple[Any, Objects]:
        """Return which relation is meant, and to what."""
        relation = said.value
        if relation == "between" and self.find.catalogue and isinstance(reference, tuple):
            reference = reference[:2]
        if relation == "in the middle of":
            relation = "between" if isinstance(reference, tuple) and len(reference) == 2 else relation
            relation = "in" if isinstance(reference, PartReference) else relation
        if relation == "in the middle of":
            raise ReadingError(
                f"{said.said!r} is not understood in {shortened(self.text)!r}: say between which two objects"
            )
        several = isinstance(reference, tuple) and len(reference) != 2 and not isinstance(reference[0], str)
        if relation == "between" and several:
            raise ReadingError(
                f"between needs two objects, and {said.said!r} in {shortened(self.text)!r} names {len(reference)}"
            )
        return relation, reference

    def _paired(self, frame: Frame, said: Predicate, distance: float | None) -> None:
        """Put one object by each of several others: "a spoon in each mug"."""
        self.paired = True
        for one, other in pairs(frame, said, self.find, self.text):
            self.add(frame, RelationPart(said.value, (one,), (other,), distance))

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
            self.add(frame, RelationPart(side, (one,), reference, distance))
