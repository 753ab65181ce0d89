"""Rerank arrangements by physics rollouts: select arrangements to try, and update the ranking with the results."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from grounding.spec import StructureSpec
from structdiffusion.evaluation_protocol import MAX_DISPLACEMENT, MAX_SPEED, MAX_TILT
from structdiffusion.observation import Arrangement
from structdiffusion.postprocessing.physics_rollout import HYPOTHESES, STACKED, PhysicsRollout, bottom_up
from structdiffusion.protocol.physical_stability import Verdict

ENOUGH = 3  # arrangements that stand under every hypothesis, after which no more are tried
# Mean room of an arrangement that stands under every hypothesis, after which no other is tried: what others could add
# is less than what the completed bodies are uncertain of.
SURE = 0.75
# Scores: of an arrangement that was not tried, which is uncertain, and the lowest, for one that fell.
_UNTRIED, _FELL = 0.5, 0.1
MOST = 120  # largest number of objects that are released over all trials: 60 trials of two, 17 of seven
_GIVE_UP = 2  # falls of one arrangement, after which no further hypotheses are tried
# Arrangements with all objects on the table, after which no other is tried if none stood: then a completed body falls
# over wherever it is put, and says nothing about arrangements.
_HOPELESS = 8
# Share of the protocol's limits by which a later release may move what stands already, before that costs score.
_UNFELT = 0.1
_ROOM = 0.5  # weight of the room to the limits, in shares of hypotheses
_FALLING = 0.8  # m/s: lowest speed of an object released 3 cm above its place
_SAME = 0.6  # factor on the priority of a tower for each tower in the same order that fell


def rerank_by_physics(
    rollout: PhysicsRollout,
    arrangements: Sequence[Arrangement],
    spec: StructureSpec,
    best: int,
    enough: int = ENOUGH,
    sure: float = SURE,
) -> list[Arrangement]:
    """Return the arrangements, best first, after physics rollouts of the best-ranked ones (score "rollout").

    Stacks are tried under several hypotheses about their hidden sides. The order is by the share of hypotheses under
    which an arrangement stood (zero if untried) plus half of its mean room to the limits of the protocol: five of five
    hardly standing rank below four of five with room. Ties are ordered by the total.

    What stands in the end although a later release moved what stood already counts less than one: `steadiness`.

    The score is the share, but at least `_FELL` for tried arrangements, and `_UNTRIED` for others; the total is
    multiplied by it. If no arrangement on the table stands, the untried ones are assumed to fall as well.

    Args:
        rollout: the physics rollout of the scene.
        arrangements: best first, each with a "total".
        spec: the requested structure.
        best: the largest number of arrangements to try.
        enough: arrangements that stand under every hypothesis, after which no more are tried.
        sure: the mean room with which one of them alone is enough.
    """
    motions = [arrangement.goal_from_initial for arrangement in arrangements]
    totals = [arrangement.scores["total"] for arrangement in arrangements]
    orders = [_stacking(row) for row in motions]
    outcomes: dict[int, _Outcome] = {}
    fallen: Counter[tuple[int, ...]] = Counter()
    waiting = list(range(len(arrangements)))
    presumed = dict.fromkeys(orders, _UNTRIED)
    while waiting and len(outcomes) < best:
        stand = [one for one in outcomes.values() if one.share == 1.0]
        if len(stand) >= enough or any(one.room >= sure for one in stand):
            break
        if sum(one.verdicts for one in outcomes.values()) * len(motions[0]) >= MOST:
            break
        number = max(waiting, key=lambda i: totals[i] * _SAME ** fallen[orders[i]])
        waiting.remove(number)
        motions[number] = rollout.set_down(motions[number])
        outcomes[number] = _tried(rollout, motions[number], spec)
        fallen[orders[number]] += bool(orders[number]) and outcomes[number].share < 1.0
        on_table = [outcome.share for tried, outcome in outcomes.items() if not orders[tried]]
        if len(on_table) == _HOPELESS and not any(on_table):
            waiting = [i for i in waiting if orders[i]]
            presumed[()] = _FELL
    rows = []
    for number, (arrangement, moved) in enumerate(zip(arrangements, motions, strict=True)):
        outcome = outcomes.get(number, _Outcome())
        worth = max(_FELL, outcome.share) if number in outcomes else presumed[orders[number]]
        scores = {**arrangement.scores, "rollout": worth, "total": worth * totals[number]}
        rank = (-outcome.share - outcome.room * _ROOM, -scores["total"])
        rows.append((rank, replace(arrangement, goal_from_initial=moved, scores=scores)))
    return [row for _, row in sorted(rows, key=lambda row: row[0])]


@dataclass(frozen=True)
class _Outcome:
    """The outcome of an arrangement's trials.

    Attributes:
        share: the share of the hypotheses under which it stood.
        room: of stacks: distance from the protocol's limits, 0 at a limit, 1 far from all limits.
        verdicts: the number of trials.
    """

    share: float = 0.0
    room: float = 0.0
    verdicts: int = 0


def _tried(rollout: PhysicsRollout, motions: np.ndarray, spec: StructureSpec) -> _Outcome:
    """Try an arrangement (N, 4, 4) under one hypothesis after another, and stop after `_GIVE_UP` falls."""
    hypotheses = HYPOTHESES if _stacking(motions) else 1
    rooms: list[float] = []
    stood = 0.0
    for number in range(hypotheses):
        verdict = rollout.verdict(motions, spec, number)
        rooms.append(_room(verdict) if verdict.success else 0.0)
        stood += steadiness(verdict)
        if not rooms[0] or rooms.count(0.0) >= _GIVE_UP:
            break
    return _Outcome(stood / hypotheses, sum(rooms) / hypotheses if hypotheses > 1 else 0.0, len(rooms))


def steadiness(verdict: Verdict) -> float:
    """Return 1 for an arrangement that stands, less if what stood already moved during later releases, 0 if it fell."""
    if not verdict.success:
        return 0.0
    return 1.0 - max(0.0, min(1.0, verdict.measured.get("disturbed", 0.0)) - _UNFELT) / (1.0 - _UNFELT)


def _room(verdict: Verdict) -> float:
    """Return the distance of a standing arrangement from the limits of the protocol; above 0."""
    measured = verdict.measured
    speed = (MAX_SPEED - measured["speed"]) / (MAX_SPEED - _FALLING)
    return max(1e-3, speed * (1 - measured["tilt"] / MAX_TILT) * (1 - measured["displacement"] / MAX_DISPLACEMENT))


def _stacking(motions: np.ndarray) -> tuple[int, ...]:
    """Return the objects from the bottom up; empty if all stand on the table."""
    return bottom_up(motions) if motions[:, 2, 3].max() >= STACKED else ()
