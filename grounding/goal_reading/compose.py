"""Compose the goal of an instruction from its frames: structures with their keys, and relations."""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace
from typing import Any

from grounding.goal_reading.frames import Frame, Predicate
from grounding.goal_reading.noun_phrase import NounPhrase
from grounding.goal_reading.scene_references import ReadingError, ReadingQuestion, SceneReferences
from grounding.goal_reading.structure_keys import StructureKeys
from grounding.goals.goal import Goal
from grounding.goals.parts import Objects, Part, PartReference, RelationPart, StructurePart
from grounding.parse_result import OBJECT, Question, shortened

# How many objects a shape needs (evaluation protocol).
_LEAST = {
    "circle": 3, "line": 2, "tower": 2, "cluster": 2, "rectangle": 4, "square": 4, "triangle": 3, "arc": 3, "grid": 4, "cross": 5,
    "pyramid": 3,
}  # fmt: skip
_OPPOSITES = {"left of": "right of", "right of": "left of", "in front of": "behind", "behind": "in front of"}


_SOME_OF = re.compile(r"(?:\d+|one|two|three|four|five|six|some|a few|a couple) of\b", re.IGNORECASE)


class ImpossibleError(ReadingError):
    """A structure that these objects cannot form."""


@dataclass
class Composed:
    """A part with the frame that it came from; `keys` of a structure are collected before it is made."""

    frame: Frame
    values: dict[str, Any] | None = None  # of a structure
    relation: RelationPart | None = None
    objects: tuple[Any, ...] | None = None


@dataclass
class Antecedents:
    """What "it" and "them" can mean.

    Attributes:
        structure: the number of the last structure; `None` where something else was said since.
        mentioned: the objects that were mentioned, the last ones last, each with whether several may be meant.
        before: how many were mentioned before the present frame.
        last: the objects that the last frame was about.
    """

    structure: int | None = None
    mentioned: list[tuple[tuple[Any, ...], bool]] = field(default_factory=list)
    before: int = 0
    last: tuple[Any, ...] | None = None
    unused: Frame | None = None


class Composer:
    """The composition of one goal.

    Args:
        text: the instruction.
        frames: of the instruction.
        references: finds the objects that noun phrases mean.
    """

    def __init__(self, text: str, frames: list[Frame], references: SceneReferences) -> None:
        self.text, self.frames, self.find = text, frames, references
        self.parts: list[Composed] = []
        self.known = Antecedents()
        self.left_out: set[Any] = set()
        self.unread: list[str] = []
        self.notes: list[str] = []
        self.unused: list[NounPhrase] = []  # that are named, and of which nothing is said
        self._previous: Frame | None = None
        self._owner: Objects = None  # what "its left" was said of last
        self._meant: dict[tuple[tuple[int, int], ...], Objects] = {}  # pronouns by their places in the text

    def goal(self) -> Goal:
        """Compose the goal.

        Raises:
            ReadingError: for what cannot be said in a goal.
            ReadingQuestion: for a doubt.
            GoalError: for parts that are not legal.
        """
        for frame in self.frames:
            self.known.before = len(self.known.mentioned)
            self._frame(frame)
        if self.known.unused is not None:
            self._unread(self.known.unused)
        return Goal(tuple(self._made(part) for part in self.parts))

    def _made(self, part: Composed) -> Part:
        if part.relation is not None:
            return part.relation
        values = dict(part.values or {})
        objects = part.objects
        if objects is None and self.left_out and self.find.count is not None:
            objects = tuple(
                i for i in range(self.find.count) if i not in self.left_out and i not in self._named_elsewhere(part)
            )
        elif isinstance(objects, tuple) and self.left_out & set(
            objects
        ):  # "line up the cups but keep the red one where it is"
            objects = tuple(one for one in objects if one not in self.left_out)
            if not objects:
                raise ImpossibleError(f"{shortened(self.text)!r} leaves alone all the objects that it asks to move")
        self._enough(values, objects)
        return StructurePart(**values, objects=objects)

    def _enough(self, values: dict[str, Any], objects: Any) -> None:
        """Refuse a shape that needs more objects than it gets, and a grid that they cannot fill."""
        if self.find.count is None or self.find.catalogue or objects is None and self.find.count == 0:
            return
        count = len(objects) if objects is not None else self.find.count
        shape, rows, columns = values.get("shape"), values.get("rows"), values.get("columns")
        least = _LEAST.get(shape or "", 1)
        if count < least:
            raise ImpossibleError(
                f"a {shape} needs {least} objects or more, and {shortened(self.text)!r} has {count} for it"
            )
        if rows and columns and objects is not None and not (rows - 1) * columns < count <= rows * columns:
            raise ImpossibleError(
                f"{rows} rows of {columns} need {rows * columns} objects, and {shortened(self.text)!r} has {count} for them"
            )

    def _named_elsewhere(self, part: Composed) -> set[Any]:
        named: set[Any] = set()
        for other in self.parts:
            if other is part:
                continue
            for objects in (
                other.objects,
                (other.values or {}).get("around"),
                *((other.relation.objects, other.relation.reference) if other.relation else ()),
            ):
                named.update(objects if isinstance(objects, tuple) else ())
        named.update((part.values or {}).get("around") or ())
        return named

    def _unread(self, frame: Frame) -> None:
        words = " ".join(phrase.text for phrase in frame.objects) or " ".join(each.said for each in frame.predicates)
        self.unread.append(words or frame.verb_said)
        self.unused += frame.objects

    # One frame

    def _frame(self, frame: Frame) -> None:
        if frame.verb == "mention":
            self._mention(frame)
            return
        if frame.stays or frame.verb == "leave":
            self._leave(frame)
            return
        if frame.negated:
            raise ReadingError(
                f"{shortened(self.text)!r} says what must not be built, and only what stands in the end can be asked for"
            )
        if self._ellipsis(frame) or self._inner(frame) or self._continued(frame):
            return
        if frame.verb == "swap":
            self._swap(frame)
        elif frame.verb == "surround":
            self._surround(frame)
        elif not frame.predicates:
            self._only_objects(frame)
        else:
            self._placed(frame)
        self._previous = frame

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
                self.left_out.update(objects)
                self.known.mentioned.append((objects, phrase.many))
            elif phrase.kind in ("rest", "all"):
                continue
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
        objects = self._objects(frame, frame.objects)
        if isinstance(objects, tuple):
            self.known.last = objects
        self.known.structure = None
        self.known.unused = frame

    def _ellipsis(self, frame: Frame) -> bool:
        """Read "..., and the blue ones too" and "... and the knife to the right", which leave out what was said before."""
        before = self._previous
        if before is None or not frame.objects or frame.verb:
            return False
        if frame.also and not frame.predicates and before.predicates:
            frame.predicates, frame.verb, frame.verb_said, frame.also = (
                list(before.predicates),
                before.verb,
                before.verb_said,
                False,
            )
            self._frame(frame)
            return True
        verbs = before.get("verb shape")
        many = len(frame.objects) > 1 or frame.objects[0].many
        if (
            verbs
            and many
            and frame.predicates
            and not frame.has("shape", "verb shape", "relation", "grid", "order")
            and frame.sentence == before.sentence
        ):
            frame.predicates.insert(0, verbs[0])  # "stack the red ones on the left and the blue ones on the right"
            frame.verb, frame.verb_said = before.verb, before.verb_said
        bare = [each for each in frame.get("place") if each.said.lower() == "in front"]
        if (
            bare
            and (before.has("relation", "shape", "verb shape"))
            and not any(each.value.y_position for each in before.get("place"))
        ):
            frame.predicates = [
                replace(each, kind="relation it", value="in front of") if each in bare else each
                for each in frame.predicates
            ]
        last = [each for each in before.get("relation") if each.value in _OPPOSITES and each.reference]
        for number, each in enumerate(frame.predicates):
            if (
                each.kind == "relation it" and last and _OPPOSITES[last[-1].value] == each.value
            ):  # "... and the knife to its right"
                frame.predicates[number] = replace(each, reference=last[-1].reference)
        spots = frame.get("place")
        if len(frame.predicates) == 1 and spots and frame.sentence == before.sentence:
            x, y = spots[0].value.x_position, spots[0].value.y_position
            wanted = (
                {"left": "left of", "right": "right of"}.get(x or "")
                if y is None
                else {"top": "behind", "bottom": "in front of"}.get(y)
                if x is None
                else None
            )
            if wanted and last and _OPPOSITES[last[-1].value] == wanted:
                frame.predicates = [replace(spots[0], kind="relation", value=wanted, reference=last[-1].reference)]
        return False

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
            center = self._objects(frame, frame.objects)
            if not isinstance(center, tuple) or len(center) != 1:
                raise ReadingError(
                    f"{frame.objects[0].text!r} in the middle of the {structure.values['shape']} must be one object"
                )
            structure.values["around"] = center
            self.known.mentioned.append((center, False))
            return True
        if explicit:
            raise ReadingError(
                f"{inner[0].said!r} is not understood in {shortened(self.text)!r}: say in the middle of what"
            )
        from grounding.goal_reading.places import Place

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
            number = self._structure_of(frame.objects[0])
        bare = not frame.objects and not frame.verb and frame.predicates
        if not (pronoun or bare) or number is None or not frame.predicates or frame.verb in ("swap", "surround"):
            return False
        several = frame.objects and frame.objects[0].text.lower().split()[0] in ("both", "all", "each")
        numbers = [i for i in range(number + 1) if self.parts[i].values is not None] if several else [number]
        for each in numbers[:-1]:
            self._more(each, frame)
        return self._more(number, frame)

    def _more(self, number: int, frame: Frame) -> bool:
        part = self.parts[number]
        if part.values is None:
            return False
        keys = StructureKeys(self.text, self._reference_of(frame))
        more = keys.read(frame, shape=part.values.get("shape"))
        for key, value in more.items():
            if value is None or key == "shape" and value == part.values.get("shape"):
                continue
            if part.values.get(key) is not None and part.values[key] != value:
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
        objects = self._objects(frame, phrases)
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
        center = self._objects(frame, frame.objects)
        ring = self._objects(frame, frame.second) if frame.second else None
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
        objects = self._objects(frame, frame.objects) if frame.objects else self._unnamed(frame)
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
            if each.kind in ("relation", "apart", "relation it") and each.value != "around"
        ]
        if (
            keys.verb_shape_only
            and values["shape"] == "tower"
            and not many
            and any(each.value in ("on", "in") for each in relations)
        ):
            values["shape"] = None
        if frame.has("beside each other") and values["shape"] is None:
            if count == 2 and objects is not None:
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
        if objects is None and (relations or frame.has("move")) and values["shape"] is None and not keys.asks(values):
            self._need_objects(frame, "it")
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
                    f"a {values['shape']} needs several objects, and {shortened(self.text)!r} names one for it"
                )
            found = self._references(frame)  # "behind it" is said of what came before
            objects = self._without(objects, (values["around"], *found.values()))
            self._add_structure(frame, values, objects)
            own = PartReference(len(self.parts) - 1) if values["shape"] or objects is None else objects
            self._relations(frame, own, keys, found)
            return
        if many and isinstance(objects, tuple):
            objects = self._without(objects, tuple(self._references(frame).values()))
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
        if not isinstance(objects, tuple) or isinstance(objects[0], str):
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

    def _certain(self, objects: Any, frame: Frame) -> Any:
        if objects is None:
            self._need_objects(frame, "it")
        return objects

    def _need_objects(self, frame: Frame, word: str) -> None:
        words = frame.objects[0].text if frame.objects else frame.predicates[0].said
        options = tuple(self.find.candidates.names) if self.find.candidates is not None else ()
        raise ReadingQuestion(
            Question(OBJECT, f"which object is meant with {words!r} in {shortened(self.text)!r}?", options)
        )

    def _references(self, frame: Frame) -> dict[int, Objects]:
        return {
            each.first: self._reference(frame, each) for each in frame.predicates
            if each.kind in ("relation", "apart", "relation it") and each.value != "around"
        }  # fmt: skip

    def _relations(
        self, frame: Frame, objects: Any, keys: StructureKeys, found: dict[int, Objects] | None = None
    ) -> None:
        found = self._references(frame) if found is None else found
        for each in frame.predicates:
            if each.first not in found:
                continue
            reference = found[each.first]
            relation = each.value
            if relation == "between" and self.find.catalogue and isinstance(reference, tuple):
                reference = reference[:2]
            if relation == "in the middle of":
                relation = "between" if isinstance(reference, tuple) and len(reference) == 2 else relation
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
                self._need_objects(frame, "it")
            distance = keys.distances.get(each.first)
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

    def _add_structure(self, frame: Frame, values: dict[str, Any], objects: Any) -> None:
        self.parts.append(Composed(frame, values, objects=objects))
        self.known.structure = len(self.parts) - 1
        self.known.unused = None
        if isinstance(objects, tuple):
            self.known.last = objects

    def _add_relation(self, frame: Frame, relation: RelationPart) -> None:
        self.parts.append(Composed(frame, relation=relation))
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
        return lambda predicate: self._reference(frame, predicate)

    def _reference(self, frame: Frame, predicate: Predicate) -> Objects:
        phrases = predicate.reference
        if not phrases:
            before = self._previous
            if (
                predicate.kind == "relation it"
                and self._owner is not None
                and before is not None
                and before.has("relation it")
                and before.sentence == frame.sentence
            ):
                return self._owner  # "the fork to its left, the knife to its right"
            found = self._pronoun(
                NounPhrase("pronoun", 0, 0, "them" if predicate.value == "between" else "it"), reference=True
            )
            self._owner = found if predicate.kind == "relation it" else self._owner
        else:
            # "left of it ... and to its right": the same pronoun, said of a second part, still means the same
            key = tuple((phrase.first, phrase.end) for phrase in phrases if phrase.kind == "pronoun")
            if key and key in self._meant:
                return self._meant[key]
            found = self._objects(frame, list(phrases), reference=True, pairs=predicate.value == "between")
            if key and found is not None:
                self._meant[key] = found
        if found is None:
            raise ReadingQuestion(
                Question(
                    OBJECT,
                    f"{predicate.said!r} in {shortened(self.text)!r}: of which object?",
                    tuple(self.find.candidates.names) if self.find.candidates else (),
                )
            )
        return found

    def _objects(self, frame: Frame, phrases: list[NounPhrase], reference: bool = False, pairs: bool = False) -> Any:
        """Find the objects of several noun phrases: a tuple, the structure of a part, or `None` for all that is left."""
        found: list[Any] = []
        for phrase in phrases:
            if phrase.kind in ("all", "rest"):
                if len(phrases) > 1:
                    raise ReadingError(
                        f"{phrase.text!r} cannot be joined with other objects in {shortened(self.text)!r}"
                    )
                return self._everything(phrase)
            if phrase.kind == "structure":
                return PartReference(self._structure_of(phrase))
            if phrase.kind == "pronoun":
                if found and phrase.many:
                    continue  # "the cups, all of them, in a row"
                meant = self._pronoun(phrase, reference, pairs)
                if isinstance(meant, PartReference) or meant is None:
                    if meant is None and phrase.text.lower() in ("it", "itself", "that", "this"):
                        self._need_objects(Frame(objects=[phrase]), phrase.text)
                    return meant
                found += [one for one in meant if one not in found]
                continue
            objects = self.find.find(phrase)
            found += [one for one in objects if one not in found]
            self.known.mentioned.append((objects, phrase.many))
        return tuple(found) or None

    def _everything(self, phrase: NounPhrase) -> Any:
        left_out: set[Any] = set()
        for without in phrase.without:
            if _SOME_OF.match(without.text):  # which two, and whether the rest is of the same kind, is not said
                raise ImpossibleError(
                    f"it is not clear which objects {without.text!r} leaves out in {shortened(self.text)!r}; name them"
                )
            out = self._objects(Frame(objects=[without]), [without])
            if isinstance(out, PartReference):
                out = self.parts[out.part].objects
            if out is None:
                raise ReadingError(
                    f"it is not clear which objects {without.text!r} leaves out in {shortened(self.text)!r}; name them"
                )
            left_out.update(out)
        if phrase.mention is not None and phrase.kind == "rest":
            same = self.find.find(phrase)
            taken = {one for part in self.parts for one in (*(part.objects or ()), *_tuple(part.relation))}
            rest = tuple(one for one in same if one not in taken)
            if not rest:
                raise ReadingError(f"nothing is left for {phrase.text!r} in {shortened(self.text)!r}")
            return rest
        if phrase.left is not None and (
            others := self.find.rest(
                phrase,
                {one for part in self.parts for one in (*(part.objects or ()), *_tuple(part.relation))} | left_out,
            )
        ):
            return others
        if not left_out:
            return None
        if self.find.count is None:
            return (f"everything but {' and '.join(map(str, sorted(left_out, key=str)))}",)
        return tuple(i for i in range(self.find.count) if i not in left_out)

    def _structure_of(self, phrase: NounPhrase) -> int:
        for number in range(len(self.parts) - 1, -1, -1):
            values = self.parts[number].values
            if values is not None and values.get("shape") == phrase.text:
                return number
        raise ReadingError(f"{shortened(self.text)!r} speaks of a {phrase.text} that it does not ask for")

    def _pronoun(self, phrase: NounPhrase, reference: bool = False, pairs: bool = False) -> Any:
        known, one = self.known, phrase.text.lower() in ("it", "this", "that", "itself")
        if pairs and known.last is not None and len(known.last) == 2:
            return known.last
        if known.structure is not None and not pairs:
            return PartReference(known.structure)
        mentioned = known.mentioned[: known.before]
        if one and known.unused is not None and known.last is not None and len(known.last) == 1:
            known.unused = None
            return known.last
        if one:
            return next((objects for objects, many in reversed(mentioned) if not many and len(objects) == 1), None)
        if known.unused is not None and known.last is not None:
            known.unused = None
            return known.last
        if known.last is not None and len(known.last) > 1:
            return known.last
        several = next((objects for objects, many in reversed(mentioned) if many or len(objects) > 1), None)
        return several or (
            tuple(one for objects, _ in mentioned[-2:] for one in objects) if len(mentioned) > 1 else None
        )


def _tuple(relation: RelationPart | None) -> tuple[Any, ...]:
    if relation is None:
        return ()
    return tuple(
        one for objects in (relation.objects, relation.reference) if isinstance(objects, tuple) for one in objects
    )
