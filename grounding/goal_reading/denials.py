"""Tell which frames say what is not wanted only to say what is, and which say a place as if it chose objects."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from grounding.goal_reading.frame import PLACING, Frame, Predicate
from grounding.goal_reading.noun_phrase import NounPhrase
from grounding.goal_reading.places import Place

_STANDING = ("left of", "right of", "in front of", "behind", "next to", "on", "in")
_SIDES = {"left": Place("left"), "right": Place("right"), "near": Place(None, "bottom"), "far": Place(None, "top")}


def is_replaced(frame: Frame, following: Sequence[Frame]) -> bool:
    """Tell whether a frame that is denied is only what the next one replaces: "not in a row, I want them in a circle"."""
    after = next((one for one in following if one.verb != "mention"), None)
    if after is None or after.negated or after.stays or after.verb == "leave" or not after.predicates:
        return False
    if not frame.objects:  # "don't build a tower, lay the blocks in a row"
        denied, wanted = ([each.value for each in one.get("shape")] for one in (frame, after))
        return len(denied) == len(frame.predicates) and bool(wanted) and not any(shape in wanted for shape in denied)
    if frame.has(*PLACING) and not after.has(*PLACING):
        return False  # "never put a cup near the bowl; line the cups up"
    if not after.objects:
        return after.verb != ""
    return len(after.objects) == 1 and (after.objects[0].kind == "pronoun" or _same(frame.objects[0], after.objects[0]))


def _same(one: NounPhrase, other: NounPhrase) -> bool:
    if one.mention is None or other.mention is None:
        return False
    return (one.mention.noun, one.mention.modifiers) == (other.mention.noun, other.mention.modifiers)


def stated(frame: Frame) -> Frame:
    """Return a frame in which "have the banana lying beside the mug" says where the banana should lie.

    A clause after a noun tells which object is meant; where nothing else is said of it, it is what is asked for.
    """
    if frame.verb != "place" or frame.predicates or len(frame.objects) != 1:
        return frame
    phrase = frame.objects[0]
    if phrase.relation in _STANDING and phrase.landmark is not None:
        said = Predicate("relation", phrase.relation, phrase.text, phrase.first, phrase.end, None, (phrase.landmark,))
        return replace(frame, objects=[replace(phrase, relation=None, landmark=None)], predicates=[said])
    if phrase.side in _SIDES and phrase.text.lower().split()[-1] in ("left", "right", "front", "back", "side"):
        said = Predicate("place", _SIDES[phrase.side], phrase.text, phrase.first, phrase.end)
        return replace(frame, objects=[replace(phrase, side=None)], predicates=[said])
    return frame
