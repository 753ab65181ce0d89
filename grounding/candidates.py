"""Make candidates of proposals: goals whose objects were found, judged by the verifier."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from itertools import groupby

from grounding.decide import Candidate
from grounding.goals.comparison import compare_goals
from grounding.goals.goal import Goal
from grounding.goals.parts import StructurePart
from grounding.parse_result import Parse
from grounding.propose.proposal import Proposal
from grounding.propose.stand_ins import StandIns
from grounding.resolve.attributes import SceneObject
from grounding.resolve.tokens import words_of
from grounding.spec import FIRST_SHAPES, SpecError, StructureSpec
from grounding.verify.named_objects import NamedObjects, unused
from grounding.verify.said_numbers import lost_numbers
from grounding.verify.unknown_words import unknown_words
from grounding.verify.verifier import Judgement, Pair, Verifier, pair_of


def judged(
    text: str,
    proposals: Sequence[Proposal],
    verifier: Verifier,
    objects: Sequence[SceneObject] | None,
    before: Goal = Goal(),
    parse: Parse | None = None,
) -> list[Candidate]:
    """Judge the proposals that can be built, and the likeliest of them with the slots that the parser reads instead.

    Args:
        text: what was said.
        proposals: with the objects found.
        verifier: judges them.
        objects: of the scene; `None` where they are not known.
        before: the goal so far.
        parse: the five slots of an instruction in no known scene; `None` otherwise.
    """
    ones = [each for each in proposals if each.goal is not None and not each.problem and each.goal != before]
    if parse is not None and (other := _with_slots(parse, ones)) is not None:
        ones = [*(each for each in ones if each.goal != other.goal), other]
    pairs = [_pair(text, each, objects or (), before) for each in ones]
    return [
        Candidate(
            one,
            found.logit,
            tuple(map(_stand_ins(one).in_own_words, _lost_words(pair.words[pair.first : pair.end], found))),
            float(found.lost.max(initial=0.0)),
            _agreement(parse, one),
        )
        for one, pair, found in zip(ones, pairs, verifier.judge(pairs), strict=True)
    ]


def checked(
    one: Candidate, text: str, before: Goal, named: Sequence[NamedObjects], known_words: Collection[str]
) -> Candidate:
    """Return a candidate with what its goal does not hold of the text: words that nobody knows, numbers, objects.

    Args:
        one: that was judged.
        text: what was said, in the words of the taught shapes.
        before: the goal so far.
        named: the objects that its noun phrases mean for certain.
        known_words: of the encoder.
    """
    goal, worded = one.proposal.goal, one.proposal.worded
    assert goal is not None  # no other is judged
    phrases, kept = ((), ()) if worded is None else (worded.phrases, worded.kept)
    copied = {word for phrase in phrases for word in words_of(phrase)}
    return replace(
        one,
        unknown=unknown_words(text, copied, known_words),
        numbers=lost_numbers(text, goal, phrases, before),
        unused=unused(named, goal, before, kept),
    )


def _pair(text: str, one: Proposal, objects: Sequence[SceneObject], before: Goal) -> Pair:
    """Return what the verifier reads of a proposal, in the words of the shapes that it knows, as the goal network."""
    assert one.goal is not None  # the caller has looked
    taught = _stand_ins(one)
    return pair_of(taught.text if taught.shapes else text, taught.goal(one.goal), objects, taught.goal(before))


def _stand_ins(one: Proposal) -> StandIns:
    return StandIns() if one.worded is None else one.worded.stand_ins


def added_up(proposals: Sequence[Proposal], count: int | None) -> list[Proposal]:
    """Return proposals of one text, those that come to the same as one, the most certain first."""
    found = list[Proposal]()
    for one in proposals:
        like = next((number for number, each in enumerate(found) if _alike(each, one, count)), None)
        if like is None:
            found.append(one)
        else:
            found[like] = replace(found[like], certainty=found[like].certainty + one.certainty)
    return sorted(found, key=lambda each: -each.certainty)


def _alike(one: Proposal, other: Proposal, count: int | None) -> bool:
    """Return whether two proposals come to the same goal, or to the same answer in place of one."""
    if one.goal is None or other.goal is None:
        return one.goal is other.goal and bool(one.answer) and one.answer == other.answer
    return one.goal == other.goal if count is None else compare_goals(one.goal, other.goal, count).exact


def _plain(goal: Goal | None) -> StructureSpec | None:
    """Return the slots of a goal that five slots can hold, as the parser knows them."""
    spec = None if goal is None else goal.plain_spec
    return spec if spec is not None and spec.shape in (None, *FIRST_SHAPES) else None


def _agreement(parse: Parse | None, one: Proposal) -> float:
    """Return how surely the parser of the five slots reads the same plain structure; see `Candidate`."""
    spec = _plain(one.goal)
    if parse is None or spec is None:
        return 0.0
    certainty = min(parse.confidence.values(), default=0.5)
    return certainty if parse.status != "refused" and spec == parse.spec else -certainty


def _with_slots(parse: Parse, proposals: Sequence[Proposal]) -> Proposal | None:
    """Return the likeliest proposal of a plain structure with the slots that the parser reads; `None` where there is
    none, or these are the same.
    """
    one = next((each for each in proposals if _plain(each.goal) is not None), None)
    if (
        one is None
        or one.goal is None
        or one.worded is None
        or parse.status == "refused"
        or _plain(one.goal) == parse.spec
    ):
        return None
    try:
        goal = Goal((StructurePart.of(parse.spec, one.goal.parts[0].objects),))  # type: ignore[arg-type]
    except SpecError:
        return None
    parts = tuple(
        {"kind": "structure", "objects": part["objects"], **parse.spec.to_dict()} for part in one.worded.parts
    )
    return replace(one, goal=goal, worded=replace(one.worded, parts=parts))


def _lost_words(words: Sequence[str], judged: Judgement) -> tuple[str, ...]:
    """Return the words that are likelier lost than held, those that follow one another together."""
    lost = [word[0].isalnum() and share > 0.5 for word, share in zip(words, judged.lost, strict=True)]
    runs = groupby(range(len(words)), key=lost.__getitem__)
    return tuple(" ".join(words[place] for place in places) for is_lost, places in runs if is_lost)
