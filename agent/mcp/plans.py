"""Keep the plans that clients may build: each is made from a proposal, used once, and void when the table changes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from threading import Lock

import numpy as np

from agent import events
from agent.errors import UsageError
from agent.mcp.quoting import quoted

_REMEMBERED = 1000  # plans whose fate is known; older ones are forgotten
_SAME_PLACE = 1e-6  # m, and of a rotation's entries


@dataclass(frozen=True)
class Plan:
    """An arrangement that was proposed to a client.

    Attributes:
        id: its name, such as "plan-3".
        proposed: the proposal that it is from.
        rank: of its arrangement, from 1.
        wish: what is wanted, in words.
        moves: the names of the objects that it moves.
        poses: name -> world_from_object (4, 4) of every object when it was proposed.
    """

    id: str
    proposed: events.Proposed
    rank: int
    wish: str
    moves: tuple[str, ...]
    poses: Mapping[str, np.ndarray]

    def fits(self, poses: Mapping[str, np.ndarray]) -> bool:
        """Return whether every object still is where it was when this was proposed."""
        return poses.keys() == self.poses.keys() and all(
            np.abs(pose - self.poses[name]).max() <= _SAME_PLACE for name, pose in poses.items()
        )


class PlanLedger:
    """The plans by their ids; several threads may use it."""

    def __init__(self) -> None:
        self._lock = Lock()
        self._open: dict[str, Plan] = {}
        self._spent: dict[str, str] = {}  # id -> why it cannot be built
        self._count = 0

    def issue(
        self,
        proposed: events.Proposed,
        rank: int,
        wish: str,
        moves: tuple[str, ...],
        poses: Mapping[str, np.ndarray],
    ) -> Plan:
        """Return a new plan."""
        with self._lock:
            self._count += 1
            plan = Plan(f"plan-{self._count}", proposed, rank, wish, moves, poses)
            self._open[plan.id] = plan
            return plan

    def look_up(self, plan_id: str) -> Plan:
        """Return a plan that can be built.

        Raises:
            UsageError: if there is no such plan, it was used, or it is void.
        """
        with self._lock:
            return self._known(plan_id)

    def take(self, plan_id: str) -> Plan:
        """Return a plan that can be built, and spend it: nobody gets it again.

        Raises:
            UsageError: as `look_up`.
        """
        with self._lock:
            plan = self._known(plan_id)
            self._spend(plan_id, "was already used, and a plan can be used only once")
            return plan

    def drop(self, plan_id: str, why: str) -> None:
        """Make one plan void.

        Args:
            plan_id: its id; a plan that is spent already stays as it is.
            why: what happened, as in "is void because ...".
        """
        with self._lock:
            if plan_id in self._open:
                self._spend(plan_id, f"is void because {why}")

    def drop_all(self, why: str) -> None:
        """Make every plan void; `why` as in `drop`."""
        with self._lock:
            for plan_id in list(self._open):
                self._spend(plan_id, f"is void because {why}")

    def _known(self, plan_id: str) -> Plan:
        plan = self._open.get(plan_id)
        if plan is not None:
            return plan
        why = self._spent.get(plan_id)
        if why is not None:
            raise UsageError(f"{plan_id} {why}; call propose for a new one")
        known = f"legal: {', '.join(self._open)}" if self._open else "there is none now; call propose for one"
        raise UsageError(f"there is no plan {quoted(plan_id)}; {known}")

    def _spend(self, plan_id: str, why: str) -> None:
        del self._open[plan_id]
        self._spent[plan_id] = why
        while len(self._spent) > _REMEMBERED:
            del self._spent[next(iter(self._spent))]
