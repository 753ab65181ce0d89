"""Say a short correction in full: with its unit, with the structure, or with the object that it is about."""

from __future__ import annotations

import re

from grounding.dialogue.goal_changes import objects_of
from grounding.dialogue.goal_mentions import SHAPE_OF_NOUN
from grounding.dialogue.goal_revision import Turn
from grounding.dialogue.object_exchanges import sentence_template
from grounding.goals.goal import Goal
from grounding.goals.parts import RelationPart

_IT = re.compile(r"\bit\b")
_WAIVED = re.compile(
    r"(?:(?:no|nope|ok|okay|actually|oh|wait|well|and|but)[ ,.!]+)*(?:never ?mind|forget|ignore|skip)(?: about)? "
    r"(?:the |my )?<0>[,;.:]+ .*\bit\b.*"
)
_BARE_NUMBER = re.compile(
    r"(?:(?:no|nope|actually|please|just|now|then)[ ,]+)*(?:make|say) (?:it|that|them) (?:about )?\d+(?:\.\d+)?[ .!]*",
    re.IGNORECASE,
)
_ONLY_A_SHAPE = re.compile(
    r"(?:(?:now|then|ok|okay|rather|and|but|please)[ ,]+)*(?:(?:in|as|into) )?an? "
    rf"(?P<noun>{'|'.join(sorted(SHAPE_OF_NOUN, key=len, reverse=True))})(?:[ ,]+(?:now|then|please))*",
    re.IGNORECASE,
)
_LENGTHS = re.compile(r"\d cm\b")


def in_full(text: str, last: Goal) -> str:
    """Return "make it 8" with the unit that it has, and "now a circle" with the verb that it lacks.

    Args:
        text: the correction.
        last: the goal that it changes.
    """
    return _about_it(_with_unit(text, last), last)


def without_waived(turn: Turn) -> Turn:
    """Return "never mind the pan, put it on the left", said of what was placed by the pan, as "put the cup on the left"."""
    match = _WAIVED.fullmatch(sentence_template(turn)[0]) if turn.last.parts else None
    only = turn.last.parts[0] if len(turn.last.parts) == 1 else None
    if match is None or not isinstance(only, RelationPart) or not isinstance(only.objects, tuple):
        return turn
    waived, end = set(turn.said.mentions[0].indices), turn.said.mentions[0].span[1]
    one = only.objects[0]
    if len(only.objects) != 1 or not isinstance(one, int) or not waived & set(objects_of(turn.last, only.reference)):
        return turn
    name = turn.said.names[one]
    return turn.after(turn.last, f"no, {_IT.sub(f'the {name}', turn.said.said[end:].lstrip(' ,;.:'), count=1)}")


def _with_unit(text: str, last: Goal) -> str:
    """Return "make it 8" with the unit of the length that it changes: in centimetres where the goal has a length."""
    return f"{text.rstrip(' .!')} cm" if _BARE_NUMBER.fullmatch(text.strip()) and _LENGTHS.search(str(last)) else text


def _about_it(text: str, last: Goal) -> str:
    """Return "now a circle" as what is to be made of a structure that a plain specification cannot hold."""
    only = _ONLY_A_SHAPE.fullmatch(text.strip(" ."))
    return f"make it a {only['noun']}" if only is not None and last.plain_spec is None else text
