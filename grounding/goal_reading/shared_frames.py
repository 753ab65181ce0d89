"""Give frames what they share with others: "respectively", one reference said for two, one on either side."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from grounding.goal_reading.frame import Frame, Predicate
from grounding.goal_reading.noun_phrase import NounPhrase

_SIDES = {"left": "left of", "right": "right of", "top": "behind", "bottom": "in front of"}
_OPPOSITES = {"left of": "right of", "right of": "left of", "in front of": "behind", "behind": "in front of"}
# Kinds of which a frame has one value.
_FAMILIES = {
    **dict.fromkeys(("place", "along", "inner"), "place"),
    **dict.fromkeys(("shape", "verb shape", "grid", "rows", "columns", "stacked", "side by side", "table setting"), "shape"),
    **dict.fromkeys(("relation", "relation it", "apart"), "relation"),
}  # fmt: skip


def shared(frames: Sequence[Frame]) -> list[Frame]:
    """Return the frames with what they leave out because another frame says it.

    Args:
        frames: of one instruction; some are changed.
    """
    found = _one_reference(list(frames))
    found = [part for frame in found for part in _separate(frame)]
    return _either_side(_respective(found))


def side_relation(predicate: Predicate) -> str | None:
    """Return the relation that a place on one side of the table would be beside an object: "left" -> "left of"."""
    value = predicate.value
    if predicate.kind != "place" or value.corner or (value.x_position is None) == (value.y_position is None):
        return None
    return _SIDES.get(value.x_position or value.y_position)


def _family(predicate: Predicate) -> str:
    return _FAMILIES.get(predicate.kind, predicate.kind)


# One reference for two: "fork left, knife right of the plate"


def _one_reference(frames: list[Frame]) -> list[Frame]:
    for frame, after in zip(frames, frames[1:], strict=False):
        related = [one for one in after.predicates if one.kind == "relation" and one.value in _OPPOSITES and one.reference]
        joined = frame.sentence == after.sentence and len(frame.predicates) == 1 and bool(frame.objects)
        if joined and related and side_relation(frame.predicates[0]) == _OPPOSITES[related[0].value]:
            frame.predicates[0] = _beside(frame.predicates[0], related[0])
    for frame in frames:
        for number, (one, other) in enumerate(zip(frame.predicates, frame.predicates[1:], strict=False)):
            if other.kind == "relation" and other.reference and side_relation(one) == _OPPOSITES.get(other.value, ""):
                frame.predicates[number] = _beside(one, other)
                frame.respectively = frame.respectively or len(frame.objects) == 2
    return frames


def _beside(place: Predicate, relation: Predicate) -> Predicate:
    """Turn a place into the relation to what the other one is said of."""
    return replace(place, kind="relation", value=side_relation(place), reference=relation.reference)


# "The cans and the cups in a tower and a circle respectively"


def _respective(frames: list[Frame]) -> list[Frame]:
    found: list[Frame] = []
    at = 0
    while at < len(frames):
        end = at + 1
        while end < len(frames) and _goes_on(frames[at], frames[end]):
            end += 1
        group = frames[at:end]
        told = any(one.respectively for one in group)
        parts = _distributed(group) if told or _two_shapes(group) else None
        found += group if parts is None else parts
        at = end
    return found


def _goes_on(frame: Frame, after: Frame) -> bool:
    """Return whether a frame only says more of the objects of the one before."""
    return not after.objects and after.verb in ("", frame.verb) and frame.sentence == after.sentence


def _two_shapes(group: list[Frame]) -> bool:
    shapes = {each.value.name for frame in group for each in frame.get("shape") if not each.value.definite}
    return len(group) == 2 == len(group[0].objects) and len(shapes) == 2 and len(group[1].predicates) == 1


def _distributed(group: list[Frame]) -> list[Frame] | None:
    """Give each noun phrase its own of several values; `None` where the numbers do not fit."""
    first, predicates = group[0], [each for frame in group for each in frame.predicates]
    count = len(first.objects)
    values = {family: [one for one in predicates if _family(one) == family] for family in map(_family, predicates)}
    if count < 2 or any(len(found) not in (1, count) for found in values.values()) or max(map(len, values.values()), default=0) < 2:
        return None
    return [
        replace(
            first,
            objects=[phrase],
            predicates=[found[number] if len(found) == count else found[0] for found in values.values()],
            second=list(first.second),
        )
        for number, phrase in enumerate(first.objects)
    ]


# "Line up the cups and the cans separately"


def _separate(frame: Frame) -> list[Frame]:
    alone = frame.has("each alone") and len(frame.objects) > 1
    if not alone or not frame.has("shape", "verb shape"):
        return [frame]
    predicates = [each for each in frame.predicates if each.kind != "each alone"]
    return [replace(frame, objects=[phrase], predicates=list(predicates)) for phrase in frame.objects]


# "... with one ball on either side, the blue one on the left and the red one on the right"


def _either_side(frames: list[Frame]) -> list[Frame]:
    found: list[Frame] = []
    at = 0
    while at < len(frames):
        frame = frames[at]
        sides = [one for one in frame.predicates if one.kind == "either side"]
        told = [one for one in frames[at + 1 : at + 3] if len(one.predicates) == 1 and one.objects]
        relations = [side_relation(one.predicates[0]) for one in told]
        if sides and len(frame.predicates) == 1 and len(told) == 2 and _OPPOSITES.get(relations[0] or "") == relations[1]:
            for one, relation in zip(told, relations, strict=True):
                kind = "relation" if sides[0].reference else "relation it"
                one.predicates[0] = replace(one.predicates[0], kind=kind, value=relation, reference=sides[0].reference)
                one.objects = [_of_kind(phrase, frame.objects) for phrase in one.objects]
        else:
            found.append(frame)
        at += 1
    return found


def _of_kind(phrase: NounPhrase, group: Sequence[NounPhrase]) -> NounPhrase:
    """Give "the blue one" the noun of the group that it is one of."""
    if not phrase.borrowed or phrase.mention is None or len(group) != 1 or group[0].mention is None:
        return phrase
    noun = group[0].mention
    return replace(phrase, borrowed=False, mention=replace(phrase.mention, noun=noun.noun, known=noun.known))
