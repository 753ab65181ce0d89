"""Build a scene of the closed loop once, with a disturbance or without, and say what came of it."""

from __future__ import annotations

import time
from collections.abc import Collection, Sequence
from itertools import groupby
from typing import Any

import numpy as np

from agent.arm.build_listeners import BuildListeners
from agent.arm.disturbances import DISTURBANCES, Disturbance, Disturber
from agent.arm.events import Placed, PlaceFailed, PlanFailed, Planned
from agent.arm.executor import build_structure
from agent.arm.interference import keep_away, spare_model
from agent.arm.remainder import Replanner
from agent.arm.simulated_arm import SimulatedArm
from agent.evaluation.goals.solve import scene_row
from agent.evaluation.loop.account import account_of
from agent.evaluation.loop.verdict import failed_checks
from agent.event_base import Event, kind_of
from agent.pipeline.table_goal import TableGoal
from structdiffusion.benchmark.goals import GoalScene
from structdiffusion.evaluation_protocol import FINAL_SECONDS
from structdiffusion.objects.model import ObjectModel
from structdiffusion.observation import Arrangement, Scene
from structdiffusion.planners.goal_planner import GoalArrangement
from structdiffusion.protocol.standing import standing
from structdiffusion.simulation.world import TIME_STEP, TabletopWorld

Row = dict[str, Any]
UNDISTURBED = "none"
KINDS = (UNDISTURBED, *DISTURBANCES)
AS_HIGH = 0.02  # m: what is no farther off rests on something as high as what it was to rest on
LEAVES_OUT = ("remove", "topple")  # after which an object may be left out if that is said, and the rest stands


class LoopBuild:
    """One build of a scene.

    Args:
        scene: the scene.
        observed: the observation of it.
        arrangements: best first.
        hold: how the hand holds objects, one of `agent.arm.simulated_arm.HOLDS`.
        library: the objects of which "add" brings one.

    Attributes:
        replanner: lays out anew what is left; `None` for nobody.
    """

    def __init__(
        self,
        scene: GoalScene,
        observed: Scene,
        arrangements: Sequence[GoalArrangement],
        hold: str,
        library: Sequence[ObjectModel],
    ) -> None:
        self.scene, self.hold, self._spares = scene, hold, library
        self.replanner: Replanner | None = None
        goal = scene.goal.resolved(len(scene.models))
        self.wanted = TableGoal(goal, tuple(scene.names), scene.world_from_initial, scene.colors or ())
        touched = sorted({*self.wanted.movable, *(index for one in arrangements for index in one.moved)})
        self.order = [*touched, *(index for index in range(len(scene.models)) if index not in touched)]
        self.part = observed.select(touched)
        motions = [np.asarray(one.goal_from_initial)[touched] for one in arrangements]
        self.motions = np.array(motions).reshape(-1, len(touched), 4, 4)  # there may be no arrangement
        self.choices = [Arrangement(*pair) for pair in zip(self.motions, (dict(one.scores) for one in arrangements))]

    def row(self, kind: str) -> Row:
        """Build once; return JSON values.

        Args:
            kind: of the disturbance, one of `KINDS`.

        Returns:
            The keys of the scene; "disturbance"; "to_place"; "planned"; "disturbed", what happened in words, or
            "why_not"; "said", how many objects the tool says stand; "success" of the goal, or of the rest of it where
            the tool rightly says what is lost and that the rest stands; "false_done"; "noticed"; "replans";
            "failed_checks"; "happened", the events in short, repeated ones once; "arm_seconds" of physics; "seconds".
        """
        started = time.perf_counter()
        row = scene_row(self.scene) | {"disturbance": kind, "to_place": len(self.wanted.movable)}
        happened: list[Event] = []
        with TabletopWorld(self.scene.models, list(self.scene.world_from_initial), self.scene.table) as world:
            world.reorder(self.order)
            disturber, steps = self._build(world, kind, happened)
            world.settle(FINAL_SECONDS, until_rest=False)
            row |= self._judged(world, kind, happened)
        return row | {
            "why_not": "" if disturber is None else disturber.why_not,
            "happened": [line for line, _ in groupby(map(_short, happened))],
            "arm_seconds": round(steps * TIME_STEP, 2),
            "seconds": round(time.perf_counter() - started, 2),
        }

    def _build(self, world: TabletopWorld, kind: str, happened: list[Event]) -> tuple[Disturber | None, int]:
        """Build, and add the events to `happened`; return who disturbed it, and the steps of physics."""
        arm = SimulatedArm(world.client)
        arm.hold_by(self.hold)
        disturber, steps = None, 0
        if kind != UNDISTURBED:
            rng = np.random.default_rng((self.scene.planning_seed, DISTURBANCES.index(kind)))
            disturber = self._disturber(world, arm, kind, rng)

        def after_step() -> None:
            nonlocal steps
            steps += 1
            if disturber is not None:
                disturber.on_step()

        work = build_structure(
            world,
            arm,
            self.part,
            self.choices,
            rng=np.random.default_rng((self.scene.seed, self.scene.number, len(self.part.objects))),
            rules=self.wanted.placement_rules(self.part),
            listeners=BuildListeners(after_step, replanner=self.replanner),
        )
        for event in work:
            happened += [event] if disturber is None else disturber.events(event)
        happened += [] if disturber is None else disturber.rest()
        return disturber, steps

    def _disturber(self, world: TabletopWorld, arm: SimulatedArm, kind: str, rng: np.random.Generator) -> Disturber:
        names, spare = [self.scene.names[index] for index in self.order], None
        if kind == "add":
            model = spare_model(self._spares, self.scene.models, rng)
            spare, names = keep_away(world, model), [*names, f"new {model.category}"]
        initial = self.scene.world_from_initial[self.order[: len(self.part.objects)]]
        return Disturber(Disturbance(kind), world, arm, names, self.motions @ initial, rng, spare)

    def _judged(self, world: TabletopWorld, kind: str, happened: Sequence[Event]) -> Row:
        """Return what the tool says of the build, and the verdict on it."""
        planned = next((event for event in happened if isinstance(event, Planned)), None)
        wanted = {k for k, index in enumerate(self.order) if index in self.wanted.movable}
        account = account_of(happened, wanted - set(planned.order) if planned is not None else ())
        moved = {self.order[event.object] for event in happened if isinstance(event, Placed)}
        failed = failed_checks(world, self.scene, self.order, moved)
        disturbed, lost = account.disturbed, set[int]()
        if failed and kind in LEAVES_OUT and disturbed is not None and disturbed.object is not None:
            lost = {disturbed.object} - account.stands
        told = wanted - lost <= account.stands
        if lost and planned is not None and told:
            failed = failed_checks(world, self.scene, self.order, moved, {self.order[k] for k in lost})
            if kind == "topple" and self._in_place(world, planned.arrangement, wanted - lost):
                failed = []
        return {
            "planned": planned is not None,
            "disturbed": None if disturbed is None else f"{disturbed.name} {disturbed.detail}",
            "said": len(account.stands & wanted),
            "success": planned is not None and not failed,
            "false_done": not account.gave_up and wanted <= account.stands | account.left_out & lost and bool(failed),
            "noticed": account.noticed,
            "replans": account.replans,
            "failed_checks": failed,
        }

    def _in_place(self, world: TabletopWorld, arrangement: int, objects: Collection[int]) -> bool:
        """Return whether objects stand where an arrangement puts them, each by itself."""
        for index in objects:
            goal = self.motions[arrangement][index] @ self.scene.world_from_initial[self.order[index]]
            high = abs(world.pose(index)[2, 3] - goal[2, 3]) > AS_HIGH
            if high or not standing(world, index, goal).stands:
                return False
        return True


def _short(event: Event) -> str:
    """Describe an event of a build in a few words."""
    words = [kind_of(event).replace("_", " "), getattr(event, "name", "")]
    if isinstance(event, PlanFailed | PlaceFailed):
        words.append(f"({event.reason})")
    else:
        words += [getattr(event, key, "") for key in ("what", "detail", "action", "trouble", "again")]
    return " ".join(filter(None, words))
