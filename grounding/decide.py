"""Decide what becomes of the goals that were proposed for a text: build one, ask, or refuse.

The thresholds were chosen once on held-back instructions (docs/results.md): the probability that a goal is what was
meant from which on it is built, and from which on it is offered in a question; and the probability that a word is lost
from which on that is asked about.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from grounding.goals.goal import Goal
from grounding.propose.proposal import Proposal

BUILD = 0.6
BUILD_MORE = 0.7  # of what is said of a goal: a question costs little there, and a wish that changes unseen costs much
OFFER = 0.15
# A word that is lost more surely than this is asked about; one that is likelier lost than held is remarked. With 0.85,
# 12 of 620 held-out instructions that are read rightly are asked about besides, and 3 of 160 unheld wishes, which are
# remarked now.
LOST = 0.95
MOST_OFFERED = 2
LEAST_ASKED = 0.005  # certainty of a wish from which on it is asked about, if something is absent or no word is lost
_LEAST = 1e-6


@dataclass(frozen=True)
class Candidate:
    """A proposed goal with all that is known of it.

    Attributes:
        proposal: the goal.
        logit: the verifier's.
        lost: the words that the verifier takes for lost, those that follow one another together.
        doubt: the highest probability of a word to be lost.
        agreement: how sure the parser of the five slots is of the same plain structure, 0 to 1; the negative of it
            where it reads something else; 0 of goals that five slots cannot hold.
        unknown: words of the text that nobody knows.
        numbers: of the text that the goal does not hold: often of a story, and sometimes of the wish.
        unused: noun phrases of the text of which no object is in the goal: often left out on purpose, and sometimes
            lost.
    """

    proposal: Proposal
    logit: float = 0.0
    lost: tuple[str, ...] = ()
    doubt: float = 0.0
    agreement: float = 0.0
    unknown: tuple[str, ...] = ()
    numbers: tuple[str, ...] = ()
    unused: tuple[str, ...] = ()

    @property
    def holds_all(self) -> bool:
        """Return whether every word is likelier held than lost."""
        return self.doubt < 0.5 and not any((self.lost, self.unknown, self.numbers, self.unused))


@dataclass(frozen=True)
class Decision:
    """What becomes of a text.

    Attributes:
        status: "ok", "ask" or "refused".
        chosen: the candidate that is built, or the likeliest one; `None` where there is none.
        offered: goals to choose from, the likeliest first.
        probability: that the chosen goal is what was meant.
        nothing: the certainty that nothing is asked for, nothing that can be built, or nothing clear.
    """

    status: str
    chosen: Candidate | None = None
    offered: tuple[Goal, ...] = ()
    probability: float = 0.0
    nothing: float = 0.0


@dataclass(frozen=True)
class Circumstances:
    """What is known besides the candidates.

    Attributes:
        nothing: the certainty that nothing is asked for, nothing that can be built, or nothing clear.
        scene: whether it is known what is there.
    """

    nothing: float = 0.0
    scene: bool = True


def features(candidates: Sequence[Candidate], number: int, known: Circumstances) -> list[float]:
    """Return what the probability of a candidate is computed from: the judgements, the certainties and the
    circumstances.

    Where the parser reads the same text, of one structure in no known scene, its agreement counts: it was taught
    without scenes.
    """
    one = candidates[number]
    own, others = one.proposal.certainty, [each for place, each in enumerate(candidates) if place != number]
    surest = max((each.proposal.certainty for each in others if each.proposal.certainty != own), default=0.0)
    agreement = math.copysign(_logit(abs(one.agreement)), one.agreement) if one.agreement else 0.0
    return [
        1.0, one.logit, _logit(own), max((each.logit for each in others), default=-8.0), _logit(known.nothing),
        float(one.agreement > 0), float(one.agreement < 0), _logit(one.doubt),
        _logit(own / (own + surest)) if own > 0.0 else 0.0, agreement, float(not known.scene),
        _logit(own) if one.agreement else 0.0, float(bool(one.unused)),
        float(bool(one.unused) and not all(each.unused for each in others)),
    ]  # fmt: skip


def decide(
    candidates: Sequence[Candidate],
    proposals: Sequence[Proposal],
    weights: Sequence[float],
    follows: bool = False,
    scene: bool = True,
) -> Decision:
    """Decide about a text.

    Args:
        candidates: the goals that can be built here.
        proposals: all, with those that have no goal.
        weights: of the `features`, in their order, of an instruction or of what is said of a goal.
        follows: whether there is a goal so far.
        scene: whether it is known what is there.
    """
    nothing = sum(each.certainty for each in proposals if each.answer)
    known = Circumstances(nothing, scene)
    shares = [
        _sigmoid(sum(w * x for w, x in zip(weights, features(candidates, number, known), strict=True)))
        for number in range(len(candidates))
    ]
    order = sorted(range(len(candidates)), key=lambda number: -shares[number])
    doubt = next((each for each in proposals if each.question is not None), None)
    best = candidates[order[0]] if order else None
    # What was likelier meant cannot be had: something else that can be is no answer to it.
    barred = best is not None and any(each.problem and each.certainty > best.proposal.certainty for each in proposals)
    if best is not None and shares[order[0]] >= (BUILD_MORE if follows else BUILD) and not barred:
        best = replace(best, lost=tuple(dict.fromkeys((*best.lost, *best.unknown, *best.numbers))))
        # Most of what is said about a goal are a few words, each of which counts.
        asks = (follows and bool(best.unknown)) or (scene and best.doubt > LOST and bool(best.lost))
        goals = (best.proposal.goal,) if asks and best.proposal.goal is not None else ()
        return Decision("ask" if asks else "ok", best, goals, shares[order[0]], nothing)
    likeliest = max(proposals, key=lambda each: each.certainty, default=None)
    # A question about one of several readings is no answer where a likelier one cannot be had.
    rivals = [each.certainty for each in proposals if each.goal is not None or each.problem]
    # What is unclear to the proposer is what the question asks, and where it is not sure of its answer, a question
    # costs little. "Mugs" where there are cups alone is impossible as said: what is meant instead is asked.
    replaced = doubt is not None and doubt.absent and doubt.certainty >= max(rivals, default=LEAST_ASKED)
    if likeliest is not None and likeliest.answer != "unclear" and nothing >= BUILD and not replaced:
        rivals.append(nothing)
    if doubt is not None and doubt.certainty >= max(rivals, default=0.0):
        return Decision("ask", Candidate(doubt), (), 0.0, nothing)
    unclear = likeliest is not None and likeliest.answer == "unclear"  # a question helps
    if not follows and (shapeless := _shapeless(candidates, proposals)) is not None:
        # "put the cups": which shape, is asked where a goal has none
        return Decision("ok", shapeless, (), 0.0, nothing)
    # "stack two cups" of four: where no word is lost, that may be meant, although the proposer thinks otherwise.
    denied = not follows and likeliest is not None and bool(likeliest.answer)
    held = {
        number for number, one in enumerate(candidates)
        if denied and one.holds_all and one.proposal.certainty >= LEAST_ASKED
    }  # fmt: skip
    likely = (
        candidates[number].proposal.goal
        for number in order
        if (unclear and not follows) or number in held or shares[number] >= OFFER
    )
    offered = tuple(goal for goal in likely if goal is not None and not (unclear and goal.is_open))[:MOST_OFFERED]
    surest = shares[order[0]] if order else 0.0
    # A wish that likelier cannot be built is refused, with what might be meant; in a conversation a question costs
    # little.
    doubtful = nothing < BUILD if follows else nothing <= surest
    asks = bool(offered) and not barred and (unclear or bool(held) or doubtful)
    return Decision("ask" if asks else "refused", best, offered, surest, nothing)


def _shapeless(candidates: Sequence[Candidate], proposals: Sequence[Proposal]) -> Candidate | None:
    """Return the likeliest candidate if it says nothing but its objects,
    where it is not certain that nothing can be built.
    """
    surest = max(candidates, key=lambda each: each.proposal.certainty, default=None)
    if surest is None or surest.proposal.goal is None or not surest.proposal.goal.is_open:
        return None
    unclear = sum(each.certainty for each in proposals if each.answer == "unclear")
    answered = sum(each.certainty for each in proposals if each.answer) - unclear
    return surest if unclear and answered < BUILD else None


def _logit(share: float) -> float:
    share = min(max(share, _LEAST), 1.0 - _LEAST)
    return math.log(share / (1.0 - share))


def _sigmoid(value: float) -> float:
    return 1.0 / (1.0 + math.exp(-max(min(value, 60.0), -60.0)))
