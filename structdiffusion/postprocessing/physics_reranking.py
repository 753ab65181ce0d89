"""Which arrangements are tried out in imagination, in which order, and what it is worth to have stood there."""

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

ENOUGH = 3  # arrangements that stand whatever is assumed: then no more are tried
# What being tried is worth: an arrangement that was not tried is doubted, one that fell is hardly worth a second try.
_UNTRIED, _FELL = 0.5, 0.1
MOST = 150  # trials, all hypotheses counted
_GIVE_UP = 2  # falls of one arrangement, after which it is tried under no further hypothesis
# Arrangements with all on the table, after which no other such is tried if none stood: then a guessed body falls over
# wherever it is put, and says nothing about arrangements.
_HOPELESS = 8
_ROOM = 0.5  # what all of the room is worth, in shares of hypotheses
_FALLING = 0.8  # m/s: what is released 3 cm above its place cannot be slower
_SAME = 0.6  # for each tower that fell, others in the same order are tried that much later


def rerank_by_physics(
    rollout: PhysicsRollout, arrangements: Sequence[Arrangement], spec: StructureSpec, best: int
) -> list[Arrangement]:
    """The arrangements, best first, after the best-ranked have been tried in imagination (score "imagined").

    What is stacked is tried under several hypotheses of what the camera did not see. What decides is the share of them
    under which it stood (none for what was not tried), and half of how far it kept from the limits of the protocol in
    the mean: five of five hardly standing come after four of five with room. Among equals the total decides.

    The score is the share, but at least `_FELL` for what was tried, and `_UNTRIED` for what was not; the total is
    multiplied by it. Where nothing on the table stands, what was not tried is taken to fall like the others.

    Args:
        rollout: of the scene.
        arrangements: best first, each with a "total".
        spec: what was asked for.
        best: how many are tried at most.
    """
    motions = [arrangement.goal_from_initial for arrangement in arrangements]
    totals = [arrangement.scores["total"] for arrangement in arrangements]
    orders = [_stacking(row) for row in motions]
    outcomes: dict[int, _Outcome] = {}
    fallen: Counter[tuple[int, ...]] = Counter()
    waiting = list(range(len(arrangements)))
    presumed = {order: _UNTRIED for order in orders}
    while waiting and len(outcomes) < best:
        known = outcomes.values()
        if sum(one.share == 1.0 for one in known) >= ENOUGH or sum(one.verdicts for one in known) >= MOST:
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
        scores = {**arrangement.scores, "imagined": worth, "total": worth * totals[number]}
        rank = (-outcome.share - outcome.room * _ROOM, -scores["total"])
        rows.append((rank, replace(arrangement, goal_from_initial=moved, scores=scores)))
    return [row for _, row in sorted(rows, key=lambda row: row[0])]


@dataclass(frozen=True)
class _Outcome:
    """How an arrangement fared.

    Attributes:
        share: of the hypotheses under which it stood.
        room: of what is stacked: how far it kept from the protocol's limits, 0 for at one of them, 1 for far from all.
        verdicts: how often it was tried.
    """

    share: float = 0.0
    room: float = 0.0
    verdicts: int = 0


def _tried(rollout: PhysicsRollout, motions: np.ndarray, spec: StructureSpec) -> _Outcome:
    """Tries an arrangement (N, 4, 4) under one hypothesis after another, and gives up after `_GIVE_UP` falls."""
    hypotheses = HYPOTHESES if _stacking(motions) else 1
    rooms: list[float] = []
    for number in range(hypotheses):
        verdict = rollout.verdict(motions, spec, number)
        rooms.append(_room(verdict) if verdict.success else 0.0)
        if not rooms[0] or rooms.count(0.0) >= _GIVE_UP:
            break
    stood = sum(room > 0 for room in rooms)
    return _Outcome(stood / hypotheses, sum(rooms) / hypotheses if hypotheses > 1 else 0.0, len(rooms))


def _room(verdict: Verdict) -> float:
    """How far what stood kept from the limits of the protocol; above 0."""
    measured = verdict.measured
    speed = (MAX_SPEED - measured["speed"]) / (MAX_SPEED - _FALLING)
    return max(1e-3, speed * (1 - measured["tilt"] / MAX_TILT) * (1 - measured["displacement"] / MAX_DISPLACEMENT))


def _stacking(motions: np.ndarray) -> tuple[int, ...]:
    """The objects from the bottom up; empty where all stand on the table."""
    return bottom_up(motions) if motions[:, 2, 3].max() >= STACKED else ()
