"""Name what may disturb a build, and bring it about in the true world while the arm is at work.

The tool is never told: what it knows of a disturbance it has to see.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from agent.arm.events import Disturbed, Picked, PickFailed, Placed, PlaceFailed, Planned
from agent.arm.interference import LEVEL, Deed, Interference
from agent.arm.simulated_arm import SimulatedArm
from agent.errors import UsageError
from agent.event_base import Event
from structdiffusion.simulation.world import TIME_STEP, TabletopWorld

DISTURBANCES = ("push", "remove", "add", "drop", "topple", "swap")
LONGEST_WAIT = 2.0  # s from a pick or a placement to the disturbance: in that time the arm is on its way in any build
RETRY = round(0.1 / TIME_STEP)  # steps until what was not possible is tried again: the arm moves a few cm meanwhile


@dataclass(frozen=True)
class Disturbance:
    """A disturbance of a build.

    Attributes:
        kind: one of `DISTURBANCES`.
        at: after how many placements; `None` for a random moment between the first pick and the last placement.
    """

    kind: str
    at: int | None = None

    @classmethod
    def parse(cls, text: str) -> Disturbance:
        """Read "push" or "push@2".

        Raises:
            UsageError: for anything else, with the legal values.
        """
        kind, mark, number = text.partition("@")
        whole = number.isascii() and number.isdigit() and len(number) <= 3
        if kind not in DISTURBANCES or (mark and not (whole and int(number) > 0)):
            raise UsageError(
                f"--disturb cannot be {text[:40]!r}; legal values: {', '.join(DISTURBANCES)}, alone or with @K for "
                "after the K-th placement, K from 1, such as push@2"
            )
        return cls(kind, int(number) if mark else None)

    def __str__(self) -> str:
        return self.kind if self.at is None else f"{self.kind}@{self.at}"


class Disturber:
    """Brings about one disturbance of a build, and tells of it.

    Call `on_step` after every physics step, and take the events of the build from `events`, in order.

    Args:
        disturbance: what happens.
        world: the true objects, those that take part first.
        arm: the arm, in `world.client`.
        names: of the objects of the world.
        world_from_goals: (A, N, 4, 4) where each arrangement that may be built puts the objects that take part.
        rng: draws the moment, the object and the way.
        spare: the object that is brought by "add", kept out of sight until then (`agent.arm.interference.keep_away`).
    """

    def __init__(
        self,
        disturbance: Disturbance,
        world: TabletopWorld,
        arm: SimulatedArm,
        names: Sequence[str],
        world_from_goals: np.ndarray,
        rng: np.random.Generator,
        spare: int | None = None,
    ) -> None:
        if disturbance.kind == "add" and spare is None:
            raise ValueError("to add an object takes a spare one")
        self.disturbance, self._goals, self._rng, self._spare = disturbance, world_from_goals, rng, spare
        self._acts = Interference(world, arm, names, rng)
        self._order: tuple[int, ...] = ()
        self._arrangement: int | None = None
        self._in_hand: int | None = None
        self._placed: list[int] = []
        self._counts = {"pick": 0, "placement": 0}
        self._moment: tuple[str, int] | None = None  # after which pick or placement
        self._wait, self._steps = 0, 0  # steps after the moment, and those that have passed
        self._deed: Deed | None = None
        self._begun = False
        self._told: list[Disturbed] = []

    @property
    def why_not(self) -> str:
        """Say why nothing has happened, in a sentence without its end; empty if something has, or is about to."""
        if self._begun:
            return ""
        why = "nothing was there to which it could be done while the arm was at work"
        if self._arrangement is None:
            why = "nothing was built"
        elif self._moment is None:
            why = "there will be nothing to which it could be done"
        elif self._counts[self._moment[0]] < self._moment[1]:
            count = self._counts[self._moment[0]]
            why = f"there {'was' if count == 1 else 'were'} only {count} {self._moment[0]}{'s' * (count != 1)}"
        return f"the disturbance {self.disturbance} did not happen: {why}"

    def on_step(self) -> None:
        """Do what is due now; to be called after every physics step of the build."""
        if self._deed is not None:
            try:
                next(self._deed)
            except StopIteration as done:
                self._told.append(done.value)
                self._deed = None
        elif self._due:
            late = self._steps - self._wait
            self._steps += 1
            if late >= 0 and late % RETRY == 0:
                self._deed = self._possible()
                self._begun = self._deed is not None

    def events(self, event: Event) -> Iterator[Event]:
        """Follow an event of the build; yield what happened before it, and the event."""
        yield from self.rest()
        yield event
        match event:
            case Planned() if self._arrangement is None:
                self._arrangement, self._order = event.arrangement, tuple(dict.fromkeys(event.order))
                self._draw_moment()
            case Picked():
                self._in_hand = event.object
                self._counts["pick"] += 1
            case Placed():
                self._in_hand = None
                if not event.aside:
                    self._placed.append(event.object)
                    self._counts["placement"] += 1
                if self._due and not self._waiting:
                    self._do_at_once()
            case PickFailed() | PlaceFailed():
                self._in_hand = None

    def rest(self) -> Iterator[Disturbed]:
        """Yield what happened and was not told yet; to be called once more after the last event."""
        told, self._told = self._told, []
        yield from told

    @property
    def _due(self) -> bool:
        """Whether the moment has come, and the build that it was drawn for is not over."""
        if self._begun or self._moment is None or self._counts[self._moment[0]] < self._moment[1]:
            return False
        return bool(self.disturbance.at is not None or self._waiting or self._in_hand is not None)

    @property
    def _waiting(self) -> list[int]:
        """The objects that are still to be placed and not in the hand."""
        return [index for index in self._order if index not in self._placed and index != self._in_hand]

    def _do_at_once(self) -> None:
        """Do it while the arm rests: after the last placement it may not move again."""
        self._deed = self._possible()
        self._begun = self._deed is not None
        while self._deed is not None:
            self._acts.world.step(TIME_STEP)
            self.on_step()

    def _draw_moment(self) -> None:
        """Draw after which pick or placement it happens, and how many steps later, among those when it can."""
        if self.disturbance.at is not None:
            self._moment = "placement", self.disturbance.at
            return
        order, moments = self._order, list[tuple[str, int]]()
        for number in range(1, len(order) + 1):
            waiting = order[number:]
            if self._offers(waiting, order[: number - 1], True):
                moments.append(("pick", number))
            if waiting and self._offers(waiting, order[:number], False):
                moments.append(("placement", number))
        if moments:
            self._moment = moments[self._rng.integers(len(moments))]
            self._wait = int(self._rng.uniform(0.0, LONGEST_WAIT) / TIME_STEP)

    def _offers(self, waiting: Sequence[int], placed: Sequence[int], in_hand: bool) -> bool:
        """Return whether there will be an object to which it can be done, if all goes as planned.

        Args:
            waiting, placed: the objects then.
            in_hand: whether there is another one in the hand.
        """
        goals = self._goals[self._arrangement]
        free = [
            *waiting,
            *(index for index in placed if goals[index][2, 3] < LEVEL and not self._covered(index, placed)),
        ]
        match self.disturbance.kind:
            case "drop":
                return in_hand
            case "swap":
                return len(waiting) >= 2
            case "add":
                return len(waiting) >= 1
            case "topple":
                return any(self._acts.world.models[index].tall for index in free)
            case _:
                return bool(free)

    def _covered(self, index: int, placed: Sequence[int]) -> bool:
        """Return whether something else that is placed stands on an object."""
        goals = self._goals[self._arrangement]
        above = (goals[other][:3, 3] - goals[index][:3, 3] for other in placed if other != index)
        radius = self._acts.world.models[index].radius
        return any(way[2] > LEVEL and np.hypot(way[0], way[1]) < radius for way in above)

    def _possible(self) -> Deed | None:
        """Return the deed of this kind for which there is an object and a way now; `None` if there is none."""
        acts, waiting, hand = self._acts, self._waiting, self._in_hand
        match self.disturbance.kind:
            case "push":
                return acts.push([*waiting, *self._placed], hand)
            case "remove":
                return acts.remove([*waiting, *self._placed], hand)
            case "topple":
                return acts.topple([*waiting, *self._placed], hand)
            case "swap":
                return acts.swap(waiting, hand)
            case "drop":
                return None if hand is None else acts.drop(hand)
            case _:
                return acts.add(self._spare, self._free_places(), hand)  # type: ignore[arg-type]

    def _free_places(self) -> Mapping[int, np.ndarray]:
        """Return where what is not placed yet is to go: object -> world_from_goal (4, 4)."""
        goals = self._goals[self._arrangement]
        return {index: goals[index] for index in self._order if index not in self._placed}
