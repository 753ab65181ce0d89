"""Read the slots and keys of a structure from what is said in a frame."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from grounding.goal_reading.drafts import TwoValuesError
from grounding.goal_reading.frame import RELATIONAL, Frame, Predicate
from grounding.goal_reading.members import spot_of
from grounding.goal_reading.patterns import END_KINDS
from grounding.goal_reading.scene_references import ReadingError, ReadingQuestion
from grounding.goals.parts import KEYS, Order
from grounding.parse_result import Question, shortened
from grounding.spec import SLOTS, SLOTS_OF_SHAPE

_CORNERS = ("front left", "front right", "back left", "back right")
_ORDERED = ("line", "arc", "tower")


class StructureKeys:
    """The slots and keys that one frame asks for.

    Args:
        text: the instruction, for what is said of it.
        reference: finds the objects of what a structure is laid around.

    Attributes:
        unread: words of the frame that no key could take.
        notes: what has to be said about what was left out, a sentence each.
        distances: the first word of a relation -> its distance, metres.
        distance: a distance that belongs to no relation yet.
        verb_shape_only: whether only the verb says the shape.
    """

    def __init__(self, text: str, reference: Callable[[Predicate], Any]) -> None:
        self.text, self._reference = text, reference
        self.unread: list[str] = []
        self.notes: list[str] = []
        self.distances: dict[int, float | None] = {}
        self.distance: float | None = None
        self.verb_shape_only = False

    def read(self, frame: Frame, shape: str | None = None) -> dict[str, Any]:
        """Read the values of all slots and keys; `None` where nothing is said of one.

        Args:
            frame: what is said.
            shape: of the structure that more is said of.
        """
        values: dict[str, Any] = dict.fromkeys((*SLOTS, *KEYS))
        self._shape(frame, values)
        for each in frame.predicates:
            self._key(each, values, frame)
        self._distances(frame)
        single = [
            each for each in frame.predicates if each.kind in ("relation", "relation it") and each.value != "around"
        ]
        if (
            values["gap"] is not None
            and values["shape"] is None
            and shape is None
            and single
            and not any(one.many for one in frame.objects)
        ):
            self.distances[single[-1].first], values["gap"] = values["gap"], None  # "left of the can, 2 cm apart"
        self._implied(frame, values, shape)
        self._order(frame, values, shape)
        shape = values["shape"] or shape
        if values["size"] is not None and shape is not None and "size" not in SLOTS_OF_SHAPE.get(shape, ("size",)):
            values["size"] = None
            self.notes.append(f"a {shape} has no size; what {shortened(self.text)!r} says of it is left out")
        if (
            values["rotation"] is not None
            and shape is not None
            and "rotation" not in SLOTS_OF_SHAPE.get(shape, ("rotation",))
        ):
            raise ReadingError(
                f"a {shape} has no direction in which it faces, and {shortened(self.text)!r} asks for one"
            )
        return values

    def asks(self, values: dict[str, Any]) -> bool:
        """Return whether the values need a structure: a shape, a size, a rotation or a key."""
        return any(value is not None for key, value in values.items() if key not in ("x_position", "y_position"))

    def _set(self, values: dict[str, Any], key: str, value: Any) -> None:
        if value is None:
            return
        if values[key] is not None and values[key] != value:
            raise TwoValuesError(
                f"{shortened(self.text)!r} contradicts itself: {key.replace('_', ' ')} {values[key]} and {value}"
            )
        values[key] = value

    def _shape(self, frame: Frame, values: dict[str, Any]) -> None:
        named = [each for each in frame.get("shape") if each.value.count != 0 or not frame.has("group")]
        for each in named:
            self._set(values, "shape", each.value.name)
            self._set(values, "size", each.value.size)
            self._set(values, "rotation", each.value.rotation)
            if each.value.count != 1 and not (values["shape"] == "cluster" and frame.has("group")):
                raise ReadingError(f"{each.said!r} in {shortened(self.text)!r}: say which objects form each of them")
            if each.value.measured is not None and each.metres is not None:
                self._key(replace(each, kind=each.value.measured, value=True), values, frame)
            rows, columns = each.value.grid
            if rows is not None and each.value.name in ("grid", "rectangle", "square"):
                values["shape"] = "grid" if each.value.name == "grid" else values["shape"]
                self._set(values, "rows", rows)
                self._set(values, "columns", columns)
        if frame.has("table setting"):
            self._set(values, "shape", "table setting")
        if named or frame.has("table setting"):
            return
        for kind, shape in (
            ("grid", "grid"),
            ("rows", "grid"),
            ("columns", "grid"),
            ("stacked", "tower"),
            ("side by side", "line"),
        ):
            if frame.has(kind):
                count = next((each.value for each in frame.get(kind)), None)
                if kind in ("rows", "columns") and count == 1:
                    shape = "line"
                self._set(values, "shape", shape)
                return
        verbs = frame.get("verb shape")
        if verbs and not (
            verbs[0].value.name == "cluster" and frame.has("group", "relation", "place") and frame.verb == "sort"
        ):
            values["shape"] = verbs[0].value.name
            self.verb_shape_only = True

    def _key(self, each: Predicate, values: dict[str, Any], frame: Frame) -> None:
        kind, value = each.kind, each.value
        if kind == "place":
            if value.corner:
                text = f"which corner is meant in {shortened(self.text)!r}: {', '.join(_CORNERS)}?"
                raise ReadingQuestion(Question("corner", text, _CORNERS))
            self._set(values, "x_position", value.x_position)
            self._set(values, "y_position", value.y_position)
        elif kind in ("size", "rotation", "along"):
            self._set(values, kind, value)
        elif kind in ("gap", "radius"):
            self._set(values, kind, each.metres)
        elif kind == "length of":
            self._set(values, "length", each.metres)
        elif kind == "diameter":
            self._set(values, "radius", each.metres / 2)
        elif kind == "wide":
            round_shape = values["shape"] in ("circle", "arc")
            self._set(values, "radius" if round_shape else "length", each.metres / 2 if round_shape else each.metres)
        elif kind == "grid":
            self._set(values, "rows", value[0])
            self._set(values, "columns", value[1])
        elif kind in ("rows", "columns"):
            if value > 1 or values["shape"] == "grid":
                self._set(values, kind, value)
        elif kind == "group":
            self._set(values, "group_by", value)
        elif kind == "relation" and value == "around":
            around = self._reference(each)
            if not isinstance(around, tuple):
                raise ReadingError(
                    f"{each.said!r} in {shortened(self.text)!r}: a structure can be laid around one object"
                )
            self._set(values, "around", around)
        elif kind in ("groups", "each alone"):
            if not frame.has("group"):
                raise ReadingError(f"{each.said!r} in {shortened(self.text)!r}: say which objects form each of them")
        elif kind == "one side":
            raise ReadingQuestion(
                Question("side", f"which side is meant with {each.said!r} in {shortened(self.text)!r}?", ("left", "right"))
            )
        elif kind == "move?":
            raise ReadingQuestion(
                Question(
                    "distance", f"how far is {each.said!r} in {shortened(self.text)!r}, and in which direction?", ()
                )
            )

    def _distances(self, frame: Frame) -> None:
        relations = [
            each
            for each in frame.predicates
            if each.kind in RELATIONAL and each.value != "around"
        ]
        for each in relations:
            if each.kind == "apart":
                self.distances[each.first] = each.metres
        for each in frame.predicates:
            if each.kind not in ("away", "length"):
                continue
            after = [one for one in relations if one.first == each.end]
            before = [one for one in relations if one.end <= each.first and one.first not in self.distances]
            free = [one for one in relations if one.first not in self.distances and each.kind == "away"]
            if chosen := (after[:1] if each.kind == "length" and after else before[-1:] or after[:1] or free[:1]):
                self.distances[chosen[0].first] = each.metres
            elif frame.has("beside each other"):
                self.distance = each.metres
            else:
                self.unread.append(each.said)

    def _implied(self, frame: Frame, values: dict[str, Any], shape: str | None) -> None:
        said = frame.verb_said.split()
        spread = frame.verb == "spread" and values["gap"] is None and values["size"] is None
        if spread and (said[:1] and said[0].startswith(("spread", "scatter", "spreading")) or "out" in said):
            values["size"] = "large"
        known = values["shape"] or shape
        if known is None:
            if values["group_by"] is not None:
                values["shape"] = "cluster"
            elif values["around"] is not None or values["radius"] is not None:
                values["shape"] = "circle"
            elif values["along"] is not None or values["length"] is not None:
                values["shape"] = "line"
            elif frame.has("together") and (frame.verb != "sort" or frame.verb_said.startswith("group")):
                values["shape"] = "cluster"
            elif frame.has("order", "order end"):
                starts = {each.value.get("from") for each in (*frame.get("order"), *frame.get("order end"))}
                values["shape"] = "tower" if starts & {"bottom", "top"} else "line"
            elif (frame.has("direction", "listed") or frame.listed) and len(frame.objects) > 1:
                values["shape"] = (
                    "tower" if any(each.value in ("bottom", "top") for each in frame.get("direction")) else "line"
                )
        elif values["group_by"] is not None and known == "cluster":
            values["shape"] = "cluster"

    def _order(self, frame: Frame, values: dict[str, Any], shape: str | None) -> None:
        order: dict[str, Any] = {}
        for each in (*frame.get("order"), *frame.get("order end")):
            if shape is None and not self._of_these(each.said, frame):
                raise ReadingError(
                    f"{each.said!r} in {shortened(self.text)!r} names one object as the end of an order: say what the others are"
                )
            self._merge(order, each)
        shape = values["shape"] or shape
        starts = frame.get("direction") or self._first_place(frame, values, shape)
        listed = frame.listed or bool(frame.get("listed")) or (bool(starts) and len(frame.objects) > 1 and not order)
        if order and "by" not in order:
            raise ReadingQuestion(
                Question(
                    "order",
                    f"by what should the objects be ordered in {shortened(self.text)!r}: height, width or size?",
                    ("height", "width", "volume"),
                )
            )
        if listed and not order and len(frame.objects) > 1 and shape in _ORDERED:
            order = {"by": "listed"}
        if not order:
            if starts and shape == "line" and starts[0].value in ("near", "far"):
                self._set(values, "rotation", "east")
            elif (starts and shape not in ("line", "arc")) or (frame.get("listed") and len(frame.objects) < 2):
                self.unread += [each.said for each in (*starts, *frame.get("listed"))]
            return
        if starts:
            order["from"] = starts[0].value if order.get("from") is None else order["from"]
        values["order"] = Order(order["by"], order.get("direction"), order.get("from"))

    def _of_these(self, said: str, frame: Frame) -> bool:
        """Return whether "the biggest can at the top" orders what is built: of cans, or it names no kind."""
        kinds = END_KINDS & set(said.lower().split())
        named = {word for phrase in frame.objects for word in phrase.text.lower().split()}
        others = self.text.lower()
        return all(kind in named or re.search(rf"\b{kind}(?:s|es)\b", others) for kind in kinds)

    def _first_place(self, frame: Frame, values: dict[str, Any], shape: str | None) -> list[Predicate]:
        """Read the place of the first of a sequence as its start: "on the left the can, then the cup, then the jar"."""
        if not frame.listed or len(frame.objects) < 2 or shape not in ("line", "arc", "tower"):
            return []
        first = [each for each in frame.get("place") if each.end == frame.objects[0].first]
        start = spot_of(first[0], shape) if first else None
        if start is None or start == "middle":
            return []
        values["x_position" if first[0].value.x_position is not None else "y_position"] = None
        return [replace(first[0], kind="direction", value=start)]

    def _merge(self, order: dict[str, Any], each: Predicate) -> None:
        said = dict(each.value)
        flipped = {"left": "right", "right": "left", "near": "far", "far": "near", "bottom": "top", "top": "bottom"}
        ways = {"ascending": "descending", "descending": "ascending"}
        if order.get("from") and said.get("from") == flipped[order["from"]]:  # "tallest left, shortest right"
            said |= {"from": order["from"], "direction": ways.get(said.get("direction"), said.get("direction"))}
        for key, value in said.items():
            known = order.get(key)
            if key == "by" and known is not None and known != value and {known, value} == {"height", "volume"}:
                continue
            if known is not None and value is not None and known != value:
                raise ReadingError(f"{shortened(self.text)!r} asks for two orders that contradict each other")
            order[key] = value if value is not None else known
