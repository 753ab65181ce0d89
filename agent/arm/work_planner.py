"""Plan what is left of a build around what stands.

What stands where it should stays. Everything else is planned again by one search, whatever has happened: an object that
was pushed is taken from where it is now, a tower whose lower part is off is taken down from the top, what stands in the
way is set aside. Where something is gone or the place of something is taken, the goal is laid out anew first.
"""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from agent.arm.clearing import Obstruction, plan_aside
from agent.arm.events import ArmEvent, Noticed, PlanFailed, Planned
from agent.arm.eyes import STILL, Eyes
from agent.arm.grasps import Grasp
from agent.arm.object_planner import ObjectPlan, alike
from agent.arm.placement_order import bottom_at
from agent.arm.plan_selection import PLANNING_CHECKS, find_plan
from agent.arm.remainder import Replanner
from agent.arm.standing_watch import standing_at
from agent.arm.task_planner import Search
from agent.arm.work_left import MOST_PLACEMENTS, WorkLeft
from structdiffusion.footprints import stands_above
from structdiffusion.observation import Arrangement

MISSES = 0.006  # m: three times what a measured place and height err by
REPLANNING_CHECKS = PLANNING_CHECKS // 4  # for one object, when the world is not as planned


@dataclass(frozen=True, eq=False)
class Step:
    """One motion of an object that is to come.

    Attributes:
        object: its index.
        plan: how; `None` where it is planned when its turn comes.
        clears: what is only set aside by this, instead of an object of the structure.
    """

    object: int
    plan: ObjectPlan | None = None
    clears: Obstruction | None = None


class WorkPlanner(WorkLeft):
    """A planner of what is left of a build.

    Args:
        eyes, search, arrangements, rank, replanner: as for `WorkLeft`.
    """

    def __init__(
        self, eyes: Eyes, search: Search, arrangements: list[Arrangement], rank: int, replanner: Replanner | None
    ) -> None:
        super().__init__(eyes, search, arrangements, rank, replanner)
        self._rounds = 0
        self._failed: dict[int, list[Grasp]] = {}  # object -> grasps that failed, on it as it was at first

    def support_is_off(self, step: Step) -> bool:
        """Return whether what an object is to be put on has to be moved first."""
        under = None if step.plan is not None and step.plan.aside else self.stands_on[step.object]
        return under is not None and under in self.watch and under in self._not_done()

    def is_off(self, step: Step) -> bool:
        """Return whether the plan of a step would miss what the object is to be put on, as that was measured."""
        if step.plan is None or step.plan.aside:
            return False
        eyes, index = self._eyes, step.object
        planned = eyes.middle(index, step.plan.goal_from_now @ self.expected[index])
        return float(np.linalg.norm(eyes.middle(index, self.goal(index)) - planned)) > MISSES

    def missing_support(self, step: Step) -> str:
        """Say why an object cannot be brought to its goal because of what it was to stand on; empty if it can."""
        if step.plan is not None and step.plan.aside:
            return ""
        under = self.stands_on[step.object]
        if under is not None and self._is_missing(under):
            return f"{self._eyes.names[under]}, on which it was to stand, is not in place"
        before = next(filter(self._is_missing, sorted(self._search.rules.after.get(step.object, ()))), None)
        return "" if before is None else f"{self._eyes.names[before]}, which has to stand before it, is not in place"

    def _is_missing(self, index: int) -> bool:
        """Return whether an object that is to be moved is not in its place."""
        in_place = index in self.watch and index not in self._aside and not self.watch.trouble(index)
        return index in self._moves and not in_place

    def remember_failed(self, index: int, grasp: Grasp) -> None:
        """Take it that a grasp failed on an object where it is known to be, and that similar ones would."""
        on_initial = np.linalg.inv(self._eyes.motions[index]) @ grasp.world_from_ee
        self._failed.setdefault(index, []).append(replace(grasp, world_from_ee=on_initial))

    def _avoided(self, index: int) -> list[Grasp]:
        """Return the grasps of an object that failed, on where it is now."""
        motion = self._eyes.motions[index]
        return [replace(each, world_from_ee=motion @ each.world_from_ee) for each in self._failed.get(index, ())]

    def has_failed(self, index: int, grasp: Grasp) -> bool:
        """Return whether a similar grasp of an object failed before."""
        return any(alike(grasp, other, self._eyes.solid(index)) for other in self._avoided(index))

    def plan_one(self, index: int, target: np.ndarray | None, start: np.ndarray) -> tuple[ObjectPlan | None, str]:
        """Return a plan for one object from where everything is now, or `None` and the reason.

        Args:
            target: goal_from_initial (4, 4) if it is only set aside; by default its goal.
            start: (n,) the arm's configuration.
        """
        search, eyes = self._search, self._eyes
        now = eyes.scene_now(solid=True)
        clouds = [np.asarray(cloud.points, dtype=np.float64) for cloud in (*now.objects, *now.distractors)]
        goal_from_now = (self.goal(index) if target is None else target) @ np.linalg.inv(eyes.motions[index])
        start = search.kinematics.unwind(start, search.kinematics.folded)
        limit = search.scene.checks + REPLANNING_CHECKS
        return search.object_at_last(
            index, clouds[: eyes.count], clouds[eyes.count :], [cloud.bottom for cloud in now.objects],
            goal_from_now, limit, start, self._avoided(index),
        )  # fmt: skip

    def plan_again(self) -> Generator[ArmEvent, None, list[Step]]:
        """Plan whatever is left from where everything is now; yield the events of another arrangement, if it takes one.

        Returns:
            The steps; none if there is nothing left to do, or things change more often than can be followed.
        """
        self._rounds += 1
        if self._rounds > MOST_PLACEMENTS * self._eyes.count:
            yield Noticed(None, "the table", "moved", f"has changed {self._rounds} times", "end")
            return []
        if self._anew is not None:
            change, self._anew = self._anew, None
            steps = yield from self._lay_out_anew()
            if steps is not None:
                return steps
            index = change.index if change.index in self._left_out else None
            action = "leave out" if index is not None else "go on"
            yield Noticed(index, change.name, change.what, f"{change.detail}, and nothing else can be laid out", action)
        steps = yield from self._clear_the_way()
        if steps:
            return steps
        left = self._not_done()
        self._remember_why(left)
        if not left:
            return []
        plans = self._planned(self._motions(left))
        if plans:
            return [Step(plan.object, plan) for plan in plans]
        # There is no plan for all of them: one by one, what nothing stands on first, and of that what goes low.
        self.expected = list(self._eyes.motions[: self._eyes.count])
        outlines = [self._eyes.outline(i) for i in range(self._eyes.count)]
        bottoms = [self._eyes.bottom(i) for i in range(self._eyes.count)]

        def turn(index: int) -> tuple[int, bool, float]:
            covered = any(stands_above(other, index, outlines, bottoms) for other in left)
            before = len(self._search.rules.after.get(index, ()))
            return (
                before,
                covered,
                bottom_at(self.goal_from_initial[index], self._eyes.clouds[index], self._bottoms[index]),
            )

        return [Step(index) for index in sorted(left, key=turn)]

    def _clear_the_way(self) -> Generator[ArmEvent, None, list[Step]]:
        """Return the step that sets aside what is in the way, if anything is; what cannot be taken is built around."""
        for thing in self.obstructions():
            failed, goals = self.slipped_from(thing), self.goals_left()
            plan, reason = None, "it slipped out of the fingers"
            if len(failed) < MOST_PLACEMENTS:
                plan, reason = plan_aside(self._eyes, self._search, thing, goals, failed, REPLANNING_CHECKS)
            if plan is not None:
                return [Step(plan.object, plan, thing)]
            self._stuck.append(thing.cloud)
            detail = f"is {thing.detail} and cannot be set aside: {reason}"
            if self._replanner is None:
                yield Noticed(None, thing.name, "in the way", detail, "go on")
                continue
            yield Noticed(None, thing.name, "in the way", detail, "lay out anew")
            steps = yield from self._lay_out_anew()
            if steps is not None:
                return steps
            yield Noticed(None, thing.name, "in the way", f"{detail}; nothing else can be laid out", "go on")
        return []

    def _remember_why(self, left: set[int]) -> None:
        for index in left & set(self._placements):
            if index in self.watch and index not in self._aside:
                way = standing_at(self._eyes, index, self.goal(index), self.support(index))
                self._why[index] = (
                    f"stood {100 * way.displacement:.1f} cm from its goal" if way.displacement > STILL
                    else "did not stand" if not way.stands else "stood on what had to be moved"
                )  # fmt: skip

    def _motions(self, left: set[int]) -> np.ndarray:
        """Return goal_from_now (N, 4, 4) of every object: the identity for what stays."""
        motions = np.tile(np.eye(4), (self._eyes.count, 1, 1))
        for index in left:
            under = self.stands_on[index]
            goal = self.goal_from_initial[index] if under in left else self.goal(index)
            motions[index] = goal @ np.linalg.inv(self._eyes.motions[index])
        return motions

    def _planned(self, motions: np.ndarray) -> list[ObjectPlan]:
        """Return the plans for motions goal_from_now (N, 4, 4); none if there is no plan for all of them."""
        found = self._found([Arrangement(motions)])
        while True:
            try:
                next(found)
            except StopIteration as end:
                return [] if end.value is None else end.value[1]

    def _lay_out_anew(self) -> Generator[ArmEvent, None, list[Step] | None]:
        """Ask for other arrangements, and return the steps of the first that can be built, or `None`."""
        replanner, count = self._replanner, self._eyes.count
        assert replanner is not None
        remainder = self.remainder()
        left, standing, now = remainder.left, remainder.standing, remainder.now_from_initial
        proposed = list(replanner.lay_out(remainder))
        offset = len(self._arrangements)
        self._arrangements += proposed
        choices = [each.goal_from_initial @ np.linalg.inv(now) for each in proposed]
        for motions in choices:
            motions[np.isclose(motions, np.eye(4), atol=1e-9).all(axis=(1, 2))] = np.eye(4)  # they stay
            motions[[i for i in range(count) if i not in left]] = np.eye(4)
        found = self._found([Arrangement(motions) for motions in choices])
        while True:
            try:
                event = next(found)
            except StopIteration as end:
                if end.value is None:
                    return None
                rank, plans = end.value
                break
            assert isinstance(event, Planned | PlanFailed)
            yield replace(event, arrangement=event.arrangement + offset)
        self._follow(proposed[rank])
        for index in standing & {i for i in range(count) if i in self.watch}:
            self.watch.place(index, self.goal_from_initial[index], self.support(index))
        self._remember_why(self._not_done())
        return [Step(plan.object, plan) for plan in plans]

    def _found(
        self, arrangements: Sequence[Arrangement]
    ) -> Generator[ArmEvent, None, tuple[int, list[ObjectPlan]] | None]:
        """Search a plan for the first of the arrangements, from where everything is now, that has one."""
        self.expected = list(self._eyes.motions[: self._eyes.count])
        limit = self._search.scene.checks + REPLANNING_CHECKS * max(1, self._eyes.count)
        return find_plan(self._search, self._eyes.scene_now(solid=True), arrangements, limit)
