"""Change a relation of a goal: "on the other side", "behind it instead", "next to the green cup, not the blue one"."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace

from grounding.dialogue.act_words import RELATIONS_SAID
from grounding.dialogue.goal_changes import exchanged, objects_of
from grounding.dialogue.goal_mentions import GoalText, Span
from grounding.dialogue.part_lengths import AlreadySoError, CannotApplyError, length_change
from grounding.goals.parts import DIRECTIONAL, Objects, PartReference, RelationPart

_OPPOSITE = {
    "left of": "right of", "right of": "left of", "in front of": "behind", "behind": "in front of", "left": "right",
    "right": "left", "top": "bottom", "bottom": "top", "away": "closer", "closer": "away",
}  # fmt: skip
_OTHER_SIDE = re.compile(
    r"\b(?:(?:on|to|at|over to) )?(?:the |its )?(?:other|opposite) (?:side|end|way"
    r"|direction)(?: (?:a)?round)?(?: of (?:it|that))?\b"
    r"|\bflip(?: (?:it|them))?\b|\bmirror(?:ed)?\b"
)
_SAID = {**RELATIONS_SAID, "in back of": "behind", "ahead of": "in front of", "before": "in front of", "by": "next to",
         "into": "in", "onto": "on", "alongside": "next to", "in between": "between"}  # fmt: skip
_FREE = sorted((said for said in _SAID if said not in ("at", "near to")), key=len, reverse=True)
_PHRASE = re.compile(rf"\b(?P<relation>{'|'.join(_FREE)})\b")
_SIDE = r"(?P<{}>left|right|middle|center|front|back|rear|top|bottom)"
_PLACE = re.compile(
    r"\b(?:(?:more |over |further )*(?:on|at|in|to|into|towards?) (?:the |my |your )?)?(?:far |very |same )?"
    rf"{_SIDE.format('first')}(?:(?: and |[ -]){_SIDE.format('second')})?"
    r"(?: hand)?(?: (?:side|edge|end|half|part|corner))?(?: of the (?:table|desk))?\b(?! of\b)"
)
_X = {"left": "left", "right": "right"}
_Y = {"front": "bottom", "back": "top", "rear": "top", "top": "top", "bottom": "bottom"}
_BARE_RELATION = re.compile(r"\b(?P<where>behind|in front|beside|next door|on top|inside|between)\b(?! of)")
_BARE = {"behind": "behind", "in front": "in front of", "beside": "next to", "on top": "on", "inside": "in"}
_AWAY = re.compile(r"\b(?P<way>away(?: from (?:me|you|us))?|closer(?: to (?:me|you|us))?|towards? (?:me|you|us)"
                   r"|back(?:wards?)?"
                   r"|forwards?)\b")  # fmt: skip
_PRONOUN = re.compile(r"\b(?:it|that|them|there|this|the same)\b")
FILLERS = frozenset(
    "a an the please it its it's them they this that these those make put move set place should be is are goes "
    "go going want i i'd would like you could can shall must has have to on at in and but also so now then "
    "just ok okay well no nope yes yeah actually sorry hmm hm oh ah wait thanks thank instead rather better "
    "let lets let's bring keep get as one ones of thing for me my stand stands sit sits lie lies not by with "
    "over more my want need mean meant change turn into there here still only from , hey hi robot i meant said "
    "prefer do does if possible mind up out part parts side sides each other both".split()
)


def relation_change(part: RelationPart, number: int, text: GoalText, built: bool = False) -> RelationPart | None:
    """Apply a correction to a relation.

    Args:
        part: the relation.
        number: its place among the parts.
        text: the correction, about the whole goal.
        built: whether the part stands already.

    Returns:
        The relation, or `None` where the text says nothing that it can take.

    Raises:
        CannotApplyError: where it says what this relation cannot take.
        GoalError: where the result is not legal.
    """
    spans: list[Span] = [one.span for one in text.parts if number in one.numbers]
    subjects = set(objects_of(text.goal, part.objects))
    changed: RelationPart = part
    exchange = objects_exchanged(part, number, text, spans)
    if exchange:
        changed = exchanged(changed, exchange)  # type: ignore[assignment]
    placed = _relation_said(part, number, text, spans)
    named = {index for said in text.mentions for index in said.indices} & subjects
    if placed is not None and part.relation == "swapped" and named and named != subjects:
        return None  # the other one of the two goes nowhere: "the hammer in the box"
    if placed is not None:
        relation, reference = placed
        changed = _with_relation(changed, relation, reference if not exchange else None)
    elif (flipped := _OTHER_SIDE.search(text.said)) is not None:
        references = [one.span for one in text.parts] + [
            said.span
            for said in text.mentions
            if said.indices and set(said.indices) <= set(objects_of(text.goal, part.reference))
        ]
        spans += [flipped.span(), *(span for span in references if text.said[: span[0]].endswith((" of ", " of the ")))]
        changed = _flipped(changed)
    elif (said := _sides_said(part, text, spans)) is not None:
        changed = said
    by_length = length_change(changed, text, spans, built) if not built or placed is None else None
    if by_length is not None:
        changed = by_length  # type: ignore[assignment]
    spans += [said.span for said in text.mentions if set(said.indices) <= subjects and said.indices]
    if changed == part:
        return None
    if left := text.left_over(spans, FILLERS):
        raise CannotApplyError(f"{' '.join(left)!r} was not understood")
    if built and part.relation == "moved" and changed.direction != part.direction and by_length is None:
        raise CannotApplyError("it was moved already: say how far it should go from where it is now")
    return changed


def _with_relation(part: RelationPart, relation: str, reference: Objects | None) -> RelationPart:
    if relation == "under":
        raise CannotApplyError("nothing can be put under something")
    if part.relation in ("moved", "swapped") and relation not in ("moved", "swapped"):
        if reference is None:
            raise CannotApplyError("it has no object that it is placed by")
        return RelationPart(relation, part.objects, reference)
    distance = part.distance if relation in (*DIRECTIONAL, "next to") else None
    return RelationPart(relation, part.objects, reference if reference is not None else part.reference, distance)


def _relation_said(
    part: RelationPart, number: int, text: GoalText, spans: list[Span]
) -> tuple[str, Objects | None] | None:
    """Return the relation that the text asks for, and the reference where it names another one."""
    for match in _PHRASE.finditer(text.said):
        after = match.end()
        behind = [
            said for said in text.mentions if said.span[0] >= after and said.indices and said.mention.role != "left out"
        ]
        behind = [
            said for said in behind if re.fullmatch(r"[ ,]*(?:the |a |an |my |that )?", text.said[after : said.span[0]])
        ]
        parts = [one for one in text.parts if one.span[0] in (after, after + 1) and len(one.numbers) == 1]
        pronoun = _PRONOUN.match(text.said, after + 1)
        relation = _SAID[match["relation"]]
        if relation == "nearest":
            continue
        if behind:
            reference = behind[0].indices
            if relation == "between":
                following = [said for said in text.mentions if said.span[0] > behind[0].span[1] and said.indices][:1]
                reference = (*reference, *(following[0].indices if following else ()))
                spans += [said.span for said in following]
            elif len(reference) > 1 and not behind[0].mention.plural:
                raise CannotApplyError(
                    f"{text.said[slice(*behind[0].span)]!r} can be each of: "
                    f"{', '.join(text.names[index] for index in reference)}"
                )
            spans += [match.span(), behind[0].span]
            return relation, reference
        if parts and parts[0].numbers[0] != number:
            spans += [match.span(), parts[0].span]
            return relation, PartReference(parts[0].numbers[0])
        if pronoun and part.reference is not None and relation != "between":
            spans += [match.span(), pronoun.span()]
            return relation, None
    bare = _BARE_RELATION.search(text.said)
    if bare and bare["where"] in _BARE and part.reference is not None:
        spans.append(bare.span())
        return _BARE[bare["where"]], None
    return None


def _flipped(part: RelationPart) -> RelationPart:
    if part.relation in DIRECTIONAL:
        return replace(part, relation=_OPPOSITE[part.relation])
    if part.relation == "moved":
        return replace(part, direction=_OPPOSITE[part.direction or "left"])
    if part.relation == "at" and part.x_position in _OPPOSITE:
        return replace(part, x_position=_OPPOSITE[part.x_position])
    if part.relation == "at" and part.x_position is None and part.y_position in _OPPOSITE:
        return replace(part, y_position=_OPPOSITE[part.y_position])
    raise CannotApplyError(f"“{part.relation}” has no other side")


def _sides_said(part: RelationPart, text: GoalText, spans: list[Span]) -> RelationPart | None:
    """Return the relation with the side of the table, or of its reference, that the text says; `None` for none."""
    if part.relation == "moved" and (way := _AWAY.search(text.said)):
        spans.append(way.span())
        said = way["way"]
        return replace(part, direction="closer" if said.startswith(("closer", "toward", "forward")) else "away")
    match = _PLACE.search(text.said)
    if match is None:
        return None
    words = [word for word in (match["first"], match["second"]) if word]
    spans.append(match.span())
    if part.relation == "at":
        return _placed(part, words)
    if len(words) > 1 or words[0] not in (*_X, "front", "back", "rear"):
        return None
    if part.relation == "moved":
        direction = {"front": "closer", "back": "away", "rear": "away"}.get(words[0], words[0])
        return replace(part, direction=direction)
    if part.relation in (*DIRECTIONAL, "next to"):
        sides = {"left": "left of", "right": "right of", "front": "in front of", "back": "behind", "rear": "behind"}
        return replace(part, relation=sides[words[0]])
    return None


def _placed(part: RelationPart, words: list[str]) -> RelationPart:
    x = next((_X[word] for word in words if word in _X), None)
    y = next((_Y[word] for word in words if word in _Y), None)
    if {"middle", "center"} & set(words):
        if x is None and y is None:
            return replace(part, x_position="center", y_position="middle" if part.y_position else None)
        x, y = (x, "middle") if x else ("center", y)
    if x is not None and y is not None:
        return replace(part, x_position=x, y_position=y)
    return replace(part, x_position=x) if x else replace(part, y_position=y)


def objects_exchanged(part: RelationPart, number: int, text: GoalText, spans: list[Span]) -> Mapping[int, int]:
    """Return which objects of a part the text puts others in the place of: "no, the red one"."""
    own = {*objects_of(text.goal, part.objects), *objects_of(text.goal, part.reference)}
    said = [each for each in text.mentions if each.indices]
    denied = [each for each in said if each.mention.role == "left out" or re.search(
        r"(?:\bnot|\binstead of|\brather than|\bno longer) (?:the |a |an )?$", text.said[: each.span[0]])]  # fmt: skip
    wanted = [each for each in said if each not in denied]
    out = [index for each in denied for index in each.indices if index in own]
    comes = [each for each in wanted if not set(each.indices) & own] or (
        [each for each in wanted if len(set(each.indices) - own) == 1] if out else [])  # fmt: skip
    if denied and len(out) == 1 and len(comes) == 1:
        fitting = [index for index in comes[0].indices if index not in own]
        if len(fitting) == 1:
            spans += [each.span for each in (*denied, *comes)]
            spans += [match.span() for match in re.finditer(r"\b(?:not|instead of|rather than)\b", text.said)]
            return {out[0]: fitting[0]}
    alone = re.fullmatch(
        r"(?:(?:no|nope|not that(?: one)?|sorry|wait|actually|i meant?|rather|use|take|with|make (?:it|that)"
        r"|instead)[ ,]+)*"
        r"(?:the |a |an )?(?P<what>.+?)(?:[ ,]+(?:instead|please|rather|i meant?|not that(?: one)?))*", text.said,
    )  # fmt: skip
    if denied or len(said) != 1 or alone is None or alone["what"] != text.said[slice(*said[0].span)]:
        return {}
    if len(said[0].indices) == 1 and said[0].indices[0] in own:
        raise AlreadySoError(f"it is {text.names[said[0].indices[0]]} already")
    candidates = [
        (index, one) for index in said[0].indices if index not in own for one in own if _alike(text, one, index)
    ]
    if len(candidates) != 1:
        return {}
    spans.append((0, len(text.said)))
    return {candidates[0][1]: candidates[0][0]}


def _alike(text: GoalText, one: int, other: int) -> bool:
    """Return whether two objects are of one kind: "the red one" stands for another cup, not for a plate."""
    return text.kind(one) == text.kind(other)
