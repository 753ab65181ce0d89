"""Read the places of single objects within a structure as its order: "stack the cans, green at the bottom, blue on top"."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from grounding.goal_reading.frame import Frame, Predicate
from grounding.goal_reading.noun_phrase import NounPhrase
from grounding.goals.parts import Order

ORDERED = ("line", "arc", "tower")
_AXES = (("left", "right"), ("near", "far"), ("bottom", "top"), ("first", "last"))
_OTHER = {one: other for pair in _AXES for one, other in (pair, pair[::-1])}


def spot_of(predicate: Predicate, shape: str) -> str | None:
    """Return where in a structure something stands: an end, "middle", or `None`."""
    value = predicate.value
    if predicate.kind == "rank":
        return str(value)
    if predicate.kind == "inner" or (predicate.kind == "relation" and value == "between"):
        return "middle"
    if predicate.kind == "relation it" and value == "on":
        return "top" if shape == "tower" else None
    if predicate.kind != "place" or value.corner:
        return None
    x, y = value.x_position, value.y_position
    if x is not None and y is not None:
        return None
    if "middle" in (x, y) or "center" in (x, y):
        return "middle"
    if shape == "tower":
        said = predicate.said.lower()
        return {"top": "top", "bottom": "bottom"}.get(y or "") if not any(word in said for word in ("back", "front")) else None
    return x or {"top": "far", "bottom": "near"}.get(y or "")


def is_member(frame: Frame, shape: str) -> bool:
    """Return whether a frame may only say where single objects stand in a structure."""
    single = bool(frame.objects) and all(one.kind == "objects" and not one.many for one in frame.objects)
    spots = [spot_of(each, shape) for each in frame.predicates]
    return single and not (frame.verb or frame.stays or frame.negated or frame.second) and len(spots) < 2 and all(spots)


def ordered(objects: Sequence[Any], shape: str, members: Sequence[tuple[Any, str | None]]) -> tuple[tuple[Any, ...], Order] | None:
    """Order a structure's objects by what is said of single ones; `None` where that does not settle it.

    Args:
        objects: all of the structure.
        shape: its shape.
        members: objects with their spots, in the order of the text.

    Returns:
        The objects from the first end on, and the order.
    """
    spots = {spot for _, spot in members if spot not in (None, "middle")}
    axis = next((pair for pair in _AXES if spots <= set(pair)), None)
    if len({one for one, _ in members}) < len(members) or axis is None or (not spots and len(objects) != 3):
        return None
    start = axis[0] if spots or shape != "tower" else "bottom"
    start = None if start == "first" else start
    count = len(objects)
    places: dict[int, Any] = {}
    index = {axis[0]: 0, axis[1]: count - 1, "middle": (count - 1) // 2 if count % 2 else None}
    for one, spot in members:
        place = index.get(spot) if spot is not None else None
        if place is None or place in places:
            break
        places[place] = one
    else:
        left = [one for one in objects if one not in places.values()]
        free = [place for place in range(count) if place not in places]
        if spots and len(left) <= 1:
            placed = places | dict(zip(free, left, strict=True))
            return tuple(placed[place] for place in range(count)), Order("listed", None, start)
    said = [one for one, _ in members]
    if len(said) != count or not spots:
        return None
    for sequence, way in ((said, list(members)), (said[::-1], list(members)[::-1])):
        fits = all(
            spot is None or (spot == axis[0] and place == 0) or (spot == axis[1] and place == count - 1)
            or (spot == "middle" and 0 < place < count - 1)
            for place, (_, spot) in enumerate(way)
        )  # fmt: skip
        if fits:
            return tuple(sequence), Order("listed", None, start)
    return None


def other_end(end: str) -> str:
    """Return the opposite end of a structure."""
    return _OTHER[end]


def with_members(frames: Sequence[Frame]) -> list[Frame]:
    """Give a structure the objects that are only named with their places in it.

    "A line with the cup on the left and the can on the right" and "the cup on the left, the can on the right, all in a
    row" become a structure of both, and frames that say where in it they stand.
    """
    found: list[Frame] = []
    at = 0
    while at < len(frames):
        apart = _apart(frames[at])
        if apart is not None:
            found += apart
            at += 1
            continue
        end = _last(frames, at)
        first = _first(frames, at, found)
        if end > at + 1:
            found += _opened(frames[at], frames[at + 1 : end])
            at = end
        elif first is not None:
            before, found = found[first:], found[:first]
            phrases = [phrase for one in before for phrase in one.objects]
            found += [replace(frames[at], objects=phrases), *before]
            at += 1
        else:
            found.append(frames[at])
            at += 1
    return found


def _shape(frame: Frame) -> str | None:
    named = next((each.value.name for each in (*frame.get("shape"), *frame.get("verb shape"))), None)
    named = named or ("tower" if frame.has("stacked") else "line" if frame.has("side by side") else None)
    return named if named in ORDERED else None


def _last(frames: Sequence[Frame], at: int) -> int:
    """Return the place after the members that follow a structure which has only the first of them as its object."""
    frame, shape = frames[at], _shape(frames[at])
    own = len(frame.objects) == 1 and frame.objects[0].kind == "objects" and not frame.objects[0].many
    spots = [each for each in frame.predicates if own and each.first >= frame.objects[0].end]
    if shape is None or not own or len(spots) != 1 or spot_of(spots[0], shape) is None:
        return at
    end = at + 1
    while end < len(frames) and frames[end].sentence == frame.sentence and is_member(frames[end], shape):
        end += 1
    return end


def _opened(frame: Frame, members: Sequence[Frame]) -> list[Frame]:
    spot = frame.predicates[-1]
    phrases = [*frame.objects, *(phrase for one in members for phrase in one.objects)]
    whole = replace(frame, objects=phrases, predicates=frame.predicates[:-1])
    return [whole, Frame(objects=list(frame.objects), predicates=[spot], sentence=frame.sentence), *members]


def _first(frames: Sequence[Frame], at: int, found: Sequence[Frame]) -> int | None:
    """Return the place in `found` of the first member before "all in a row"; `None` where there are not several."""
    frame, shape = frames[at], _shape(frames[at])
    everything = not frame.objects or (len(frame.objects) == 1 and frame.objects[0].kind == "pronoun" and frame.objects[0].many)
    if shape is None or not everything or frame.verb not in ("", "place", "make"):
        return None
    first = len(found)
    while first > 0 and found[first - 1].sentence == frame.sentence and is_member(found[first - 1], shape):
        first -= 1
    spots = sum(bool(one.predicates) for one in found[first:])
    return first if len(found) - first > 1 and spots > 1 else None


def _apart(frame: Frame) -> list[Frame] | None:
    """Divide "stack the can and the cup, can at the bottom", and "stack the cans, the red one at the bottom"."""
    shape, phrases = _shape(frame), frame.objects
    if shape is None or len(phrases) < 2 or not frame.predicates:
        return None
    again = next((i for i in range(2, len(phrases)) if _repeats(phrases[i], phrases[:i])), None)
    group = phrases[0].kind == "objects" and phrases[0].many
    if again is None and group and all(one.borrowed and not one.many for one in phrases[1:]):
        again = 1
    if again is None:
        return None
    spots = [each for each in frame.predicates if each.first >= frame.objects[-1].end and spot_of(each, shape) is not None]
    if len(spots) != 1:
        return None
    rest = [each for each in frame.predicates if each is not spots[0]]
    members = Frame(objects=frame.objects[again:], predicates=spots, sentence=frame.sentence)
    return [replace(frame, objects=frame.objects[:again], predicates=rest), members]


def _repeats(phrase: NounPhrase, before: Sequence[NounPhrase]) -> bool:
    said = phrase.mention
    return said is not None and any(
        one.mention is not None and not one.many and one.mention.noun == said.noun and set(said.modifiers) <= set(one.mention.modifiers)
        for one in before
    )  # fmt: skip
