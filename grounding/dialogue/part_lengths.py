"""Change the lengths of a part: "5 cm more", "gaps of 10 cm", "make that 20 cm", "twice as far"."""

from __future__ import annotations

import re
from dataclasses import replace

from grounding.dialogue.goal_mentions import GoalText, Span
from grounding.goal_reading.measures import lengths_of
from grounding.goal_reading.tokens import split
from grounding.goals.parts import SHAPES_OF_KEY, WITH_DISTANCE, Part, RelationPart, StructurePart

_MORE = re.compile(
    r"\b(?:more|further|farther|extra|additional(?:ly)?|longer|bigger|larger|wider|greater|another|add)\b"
)
_LESS = re.compile(r"\b(?:less|closer|nearer|shorter|smaller|tighter|narrower|fewer|too (?:much|far|long|wide|big))\b")
# Before a length that is what it should be: "closer, 3 cm" is no 3 cm closer.
_TO_BE = re.compile(
    r"\b(?:further|farther|longer|bigger|larger|wider|greater|closer|nearer|shorter|smaller|tighter|narrower|too (?:much|far|long|wide|big))\b"
    r"[^,]*, *(?:(?:about|only|just|say|like|to|maybe|make it) )*$"
)
_SCALED = re.compile(
    r"\b(?:(?P<double>twice|double)|(?P<half>half)|(?P<three>three times|triple))(?: (?:as|the|that))*"
    r"(?: (?:far|much|distance|gaps?|spacing|radius|length|long|wide|big|space))?(?: (?:apart|away))?\b"
)
_KEY_WORDS = {
    "gap": re.compile(r"\b(?:gaps?|apart|spac(?:e|es|ing|ed)|between|distances? between|clearance)\b"),
    "radius": re.compile(r"\b(?:radius|radii)\b"),
    "length": re.compile(r"\b(?:length|long|longer|shorter)\b"),
}
_DIAMETER = re.compile(r"\b(?:diameter|across)\b")
_LENGTH_FILLERS = frozenset("leave by of with at about exactly only distance from each other one another them".split())


class CannotApplyError(Exception):
    """A correction that a part cannot take; the message says why, as in "it has no length so far"."""


class AlreadySoError(CannotApplyError):
    """A correction that a part can take, and that changes nothing in it."""


def length_change(part: Part, text: GoalText, spans: list[Span], built: bool = False) -> Part | None:
    """Apply a change of a length.

    Args:
        part: of the goal.
        text: the correction.
        spans: of what was read; gets those of the length's words.
        built: whether the part stands already: a move goes on from where it ended.

    Returns:
        The part, or `None` where the text says no length.

    Raises:
        CannotApplyError: where the part has no such length, or the result is none that is legal.
        GoalError: where the length is not legal.
    """
    found = _amount(text, spans)
    if found is None:
        return None
    amount, how = found
    key = _key(part, text, spans)
    if key is None:
        raise CannotApplyError("it takes no length")
    now: float | None = getattr(part, key)
    if how == "set":
        value = amount / 2 if key == "radius" and _DIAMETER.search(text.said) else amount
    elif now is None:
        raise CannotApplyError(f"it has no {key} so far: say it in centimetres, as in “{key} of 10 cm”")
    else:
        value = now * amount if how == "scale" else now + amount
    if isinstance(part, RelationPart) and part.relation == "moved" and built and now is not None:
        value -= now  # it stands that far away already
        if value < 0:
            opposite = {"left": "right", "right": "left", "away": "closer", "closer": "away"}[part.direction or "left"]
            return replace(part, direction=opposite, distance=round(-value, 6))
    if value < 0 or (value == 0 and key != "gap"):
        raise CannotApplyError(f"its {key} would be {100 * value:.4g} cm")
    return replace(part, **{key: round(value, 6)})


def _amount(text: GoalText, spans: list[Span]) -> tuple[float, str] | None:
    """Return (metres, "set" or "add") or (factor, "scale")."""
    said = split(text.said)
    lengths = lengths_of(said)
    if len(lengths) > 1:
        raise CannotApplyError("it speaks of several lengths")
    sign = 1 if _MORE.search(text.said) else -1 if _LESS.search(text.said) else 0
    if lengths:
        ((place, (metres, end)),) = lengths.items()
        spans.append((said.spans[place][0], said.spans[end - 1][1]))
        spans += [match.span() for pattern in (_MORE, _LESS) for match in pattern.finditer(text.said)]
        to_be = _TO_BE.search(text.said[: said.spans[place][0]])
        return (sign * metres, "add") if sign and not to_be else (metres, "set")
    if scaled := _SCALED.search(text.said):
        spans.append(scaled.span())
        return (2.0 if scaled["double"] else 0.5 if scaled["half"] else 3.0), "scale"
    return None


def _key(part: Part, text: GoalText, spans: list[Span]) -> str | None:
    """Return which length of the part is meant: the one that is named, otherwise the only one that it has."""
    spans += [
        match.span() for match in re.finditer(r"\b(?:" + "|".join(_LENGTH_FILLERS) + r")\b", text.said)
    ]  # fmt: skip
    if isinstance(part, RelationPart):
        for pattern in (_KEY_WORDS["gap"], re.compile(r"\b(?:distance|away|apart)\b")):
            spans += [match.span() for match in pattern.finditer(text.said)]
        return "distance" if part.relation in WITH_DISTANCE else None
    keys = [key for key in ("gap", "radius", "length") if part.shape in SHAPES_OF_KEY[key]]
    named = [
        key for key in keys if _KEY_WORDS[key].search(text.said) or (key == "radius" and _DIAMETER.search(text.said))
    ]
    for key in named:
        spans += [match.span() for pattern in (_KEY_WORDS[key], _DIAMETER) for match in pattern.finditer(text.said)]
    if len(named) == 1:
        return named[0]
    given = [key for key in keys if getattr(part, key) is not None]
    if len(given) == 1:
        return given[0]
    if not keys:
        return None
    raise CannotApplyError(f"it is not clear which length is meant: {' or '.join(keys)}")


def has_metric_size(part: StructurePart) -> str:
    """Return the key that says the size of a structure in metres, or empty."""
    return next((key for key in ("length", "radius", "gap") if getattr(part, key) is not None), "")
