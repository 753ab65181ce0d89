"""Complete frames that leave out what was said in the frame before."""

from __future__ import annotations

from dataclasses import replace

from grounding.goal_reading.frame import PLACING, Frame

OPPOSITES = {"left of": "right of", "right of": "left of", "in front of": "behind", "behind": "in front of"}
RELATION_OF_SIDE = {"left": "left of", "right": "right of", "top": "behind", "bottom": "in front of"}

# Kinds of what is said that take each other's place.
_ALIKE = (
    frozenset(("shape", "verb shape", "stacked", "side by side", "grid", "rows", "columns", "table setting", "together")),
    frozenset((*PLACING, "beside each other")),
)


def _group_of(kind: str) -> frozenset[str] | str:
    return next((group for group in _ALIKE if kind in group), kind)


def completed(frame: Frame, before: Frame | None) -> bool:
    """Add to a frame what it leaves out: "..., and the blue ones too", "... and the knife to the right".

    Args:
        frame: is changed.
        before: the frame before it.

    Returns:
        Whether it is the frame before once more, of other objects.
    """
    if frame.same and frame.objects and before is not None and before.predicates:
        own = {_group_of(each.kind) for each in frame.predicates}
        frame.predicates += [each for each in before.predicates if _group_of(each.kind) not in own]
        frame.verb, frame.verb_said, frame.same = frame.verb or before.verb, frame.verb_said or before.verb_said, False
        return True
    if before is not None:
        _other_side(frame, before)
    if before is None or not frame.objects or frame.verb:
        return False
    if frame.also and not frame.predicates and before.predicates:
        frame.predicates, frame.verb, frame.verb_said, frame.also = (
            list(before.predicates),
            before.verb,
            before.verb_said,
            False,
        )
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
    last = [each for each in before.get("relation") if each.value in OPPOSITES and each.reference]
    for number, each in enumerate(frame.predicates):
        if (
            each.kind == "relation it" and last and OPPOSITES[last[-1].value] == each.value
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
        if wanted and last and OPPOSITES[last[-1].value] == wanted:
            frame.predicates = [replace(spots[0], kind="relation", value=wanted, reference=last[-1].reference)]
    return False


def _other_side(frame: Frame, before: Frame) -> None:
    """Say which side "the other side" is: the one opposite to what was said before."""
    for number, each in enumerate(frame.predicates):
        if each.value != "other side of":
            continue
        related = [one for one in before.predicates if one.kind in ("relation", "relation it") and one.value in OPPOSITES]
        places = [one for one in before.get("place") if one.value.opposite is not None]
        if related:
            reference = each.reference or related[-1].reference
            kind = "relation" if reference else "relation it"
            frame.predicates[number] = replace(each, kind=kind, value=OPPOSITES[related[-1].value], reference=reference)
        elif places and not each.reference:
            frame.predicates[number] = replace(each, kind="place", value=places[-1].value.opposite)
