"""Read relations that hold one by one between objects: "a spoon in each mug", "each can behind a cup"."""

from __future__ import annotations

import re
from collections.abc import Sequence

from grounding.goal_reading.drafts import ImpossibleError
from grounding.goal_reading.frame import Frame, Predicate
from grounding.goal_reading.noun_phrase import NounPhrase
from grounding.goal_reading.scene_references import SceneReferences
from grounding.parse_result import shortened

_RELATIONS = ("relation", "apart")
_EACH = ("each", "every")
_ONE = ("a", "an", "one", "another")
_SIDE_BY = (
    r"(?:on|on top of|onto|in|into|inside|next to|beside|behind|in front of|near|(?:to the )?(?:left|right) of)"
)
# What may be said between the objects and the relation: "each can (should stand) (10 cm) behind a cup".
_WORDS = r"(?:\w+ ){1,5}?"
_NO_OBJECT = r"(?! (?:side|end|other|pair|colour|color|kind|type|row|line|circle|pile|group|cluster|place|tower))"
_PAIRED = re.compile(
    rf"\b(?:(?:one|an?) (?:{_WORDS}{_SIDE_BY}|\w+ (?:by|at|for|between)) (?:each|every)\b{_NO_OBJECT}"
    rf"|(?:each|every) (?:{_WORDS}{_SIDE_BY}|\w+ (?:by|at|for|between)) (?:an?|one|its own)\b{_NO_OBJECT}"
    r"|(?:one|an?) \w+ (?:per|apiece)\b)",
    re.IGNORECASE,
)


def paired_words(text: str) -> tuple[str, ...]:
    """Return the phrases of an instruction that ask for one object for each of several others."""
    return tuple(match.group() for match in _PAIRED.finditer(text))


def is_paired(frame: Frame, said: Predicate) -> bool:
    """Return whether a relation holds one by one: one side is "each" or "every", the other "a" or "one", or several
    objects go on or into several others.
    """
    if len(frame.objects) != 1 or len(said.reference) != 1 or said.kind not in _RELATIONS or said.value == "between":
        return False
    placed, reference = frame.objects[0], said.reference[0]
    carried = said.value in ("on", "in") and _several(placed) and _several(reference)
    return carried or (_each(placed) and _single(reference)) or (_single(placed) and _each(reference))


def pairs(frame: Frame, said: Predicate, find: SceneReferences, text: str) -> list[tuple[int, int]]:
    """Return which object goes with which: the first with the first, in the order of the scene.

    Args:
        frame: its only noun phrase is of what is placed.
        said: the relation.
        find: of a known scene.
        text: the instruction, for errors.

    Raises:
        ImpossibleError: where there are too few of the objects of which each other one gets one.
        ReadingError: where no object fits a noun phrase.
    """
    placed, reference = frame.objects[0], said.reference[0]
    objects, others = list(find.find(placed)), list(find.find(reference))
    words = f"{placed.text} {said.said}" + ("" if said.said.endswith(reference.text) else f" {reference.text}")
    if not _single(placed) and not _single(reference):
        if len(objects) != len(others):
            raise ImpossibleError(
                f"{words!r} in {shortened(text)!r} leaves open which goes where: there are {len(objects)} objects for "
                f"{len(others)}; name them one by one"
            )
        return list(zip(objects, others, strict=True))  # type: ignore[arg-type]
    if _each(placed):
        others = [one for one in find.fitting(reference) if one not in objects]
        kind, needed, there = reference, len(objects), len(others)
    else:
        objects = [one for one in find.fitting(placed) if one not in others]
        kind, needed, there = placed, len(others), len(objects)
    if there < needed:
        raise ImpossibleError(
            f"{words!r} in {shortened(text)!r} needs {needed} of {kind.mention.noun!r}, one for each, "
            f"and there are {there}"
        )
    return list(zip(objects, others, strict=False))  # type: ignore[arg-type]


def _first(phrase: NounPhrase) -> str:
    words: Sequence[str] = phrase.text.lower().split()
    return words[0] if words and phrase.kind == "objects" else ""


def _each(phrase: NounPhrase) -> bool:
    return _first(phrase) in _EACH


def _several(phrase: NounPhrase) -> bool:
    return phrase.kind == "objects" and phrase.many


def _single(phrase: NounPhrase) -> bool:
    return _first(phrase) in _ONE and phrase.mention is not None and phrase.mention.count in (None, 1)
