"""Word a goal as a person would ask for it, for a sentence that would work in place of one that does not."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from grounding.figures.drawings import without_drawings
from grounding.goal_network.goal_rendition import ObjectPhrase, in_centimetres, object_phrases
from grounding.goals.goal import Goal
from grounding.goals.parts import Objects, Order, Part, PartReference, StructurePart
from grounding.resolve.attributes import SceneObject

_NUMBERS = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten")
_X = {"left": "on the left", "center": "in the center", "right": "on the right"}
_Y = {"top": "at the back", "middle": "in the middle", "bottom": "at the front"}
_FACING = {"north": "facing away from me", "east": "facing right", "south": "facing me", "west": "facing left"}
_WAYS = {"left": "to the left", "right": "to the right", "away": "away from me", "closer": "towards me"}
_BESIDE = {"left of": "to the left of", "right of": "to the right of"}
_ENDS = {"near": "nearest to me", "far": "farthest from me", "bottom": "at the bottom", "top": "at the top"}
_MOST = {"height": ("shortest", "tallest"), "width": ("narrowest", "widest"), "volume": ("smallest", "biggest")}


def with_article(shape: str) -> str:
    """Return a shape's name with its article."""
    return f"{'an' if shape[0] in 'aeiou' else 'a'} {shape}"


def worded_objects(indices: Sequence[int | str], names: Sequence[str] | None) -> str:
    """Word some objects: "the two cups", "the mug, the bowl and cup 2".

    Args:
        indices: of the objects, or the text's words for them.
        names: of the scene's objects, by index; `None` where no scene is known.
    """
    if names is None or any(isinstance(one, str) for one in indices):
        return listed([str(one) for one in indices])
    phrases = object_phrases([one for one in indices if isinstance(one, int)], [SceneObject(name) for name in names])
    return listed([_worded_phrase(each, names) for each in phrases])


def _worded_phrase(phrase: ObjectPhrase, names: Sequence[str]) -> str:
    """Word a group of like objects; "cup 1" only where there is a "cup 2"."""
    if len(phrase.objects) > 1:
        return f"the {_number(len(phrase.objects))} {phrase.words.removeprefix('the ')}"
    bare = phrase.words.removesuffix(" 1")
    return phrase.words if f"{bare} 2" in names else bare


def worded_goal(goal: Goal, names: Sequence[str] | None) -> str:
    """Word a goal: "a small line of the two cups on the left and put the mug next to the bowl";
    see `worded_objects`.
    """
    return " and ".join(_worded_part(part, goal, names) for part in goal.parts)


def _worded_part(part: Part, goal: Goal, names: Sequence[str] | None) -> str:
    def said(objects: Objects | None) -> str:
        if objects is None:
            return "everything" if len(goal.parts) == 1 else "everything else"
        if isinstance(objects, PartReference):
            return f"the {without_drawings(getattr(goal.parts[objects.part], 'shape', None) or 'structure')}"
        return worded_objects(objects, names)

    place = [_X.get(part.x_position or "", ""), _Y.get(part.y_position or "", "")]
    if isinstance(part, StructurePart):
        kind = " ".join(filter(None, (part.size, without_drawings(part.shape or "structure"))))
        return " ".join(filter(None, (
            with_article(kind), "of", _one_by_one(part, names) or said(part.objects), *place,
            _FACING.get(part.rotation or "", ""),
            *(_worded_key(part, key, value, said) for key, value in part.keys.items()),
        )))  # fmt: skip
    if part.relation == "swapped":
        return f"swap {said(part.objects)}"
    length = f"{in_centimetres(part.distance)} " if part.distance is not None else ""
    if part.relation == "moved":
        return f"move {said(part.objects)} {length}{_WAYS[part.direction or 'left']}"
    if part.relation == "at":
        return " ".join(filter(None, ("put", said(part.objects), *place)))
    return f"put {said(part.objects)} {length}{_BESIDE.get(part.relation, part.relation)} {said(part.reference)}"


def _one_by_one(part: StructurePart, names: Sequence[str] | None) -> str:
    """Word the objects of a structure in their order, where it is theirs."""
    if part.order is None or part.order.by != "listed" or part.objects is None:
        return ""
    return listed([worded_objects((one,), names) for one in part.objects])


def _worded_key(part: StructurePart, key: str, value: Any, said: Callable[[Objects], str]) -> str:
    if isinstance(value, Order):
        return _worded_order(value)
    if key == "around":
        return f"around {said(value)}"
    if key == "gap":
        return f"with {in_centimetres(value)} between them"
    if key == "radius":
        return f"with a radius of {in_centimetres(value)}"
    if key == "length":
        return f"{in_centimetres(value)} long"
    if key in ("rows", "columns"):
        return f"{'and' if key == 'columns' and part.rows else 'with'} {value} {key if value != 1 else key[:-1]}"
    return f"along the {value} edge" if key == "along" else f"for each {value}"


def _worded_order(order: Order) -> str:
    end = f" {_ENDS.get(order.start, f'on the {order.start}')}" if order.start else ""
    if order.by == "listed":
        return f"in this order, the first one{end}" if end else "in this order"
    least, most = _MOST[order.by]
    first, last = (most, least) if order.direction == "descending" else (least, most)
    if order.direction is None and not end:
        return f"by {order.by}"
    return f"from {first} to {last}" + (f", the {first}{end}" if end else "")


def _number(count: int) -> str:
    return _NUMBERS[count] if count < len(_NUMBERS) else str(count)


def listed(words: Sequence[str]) -> str:
    """Return words as a list: "a, b and c"."""
    return " and ".join(filter(None, (", ".join(words[:-1]), words[-1]))) if words else "nothing"
