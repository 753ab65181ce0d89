"""Build a structure with the simulated Jaco: search, pick and place, and a look by the camera after each placement.

The arm moves by position motors within the maker's joint speeds; the fingers close with the maker's effort, each waits
where it touches, their tips fold, and what they hold they hold by friction. With `SimulatedArm.hold` "weld" a fixed
constraint joins the object to the hand once the thumb and at least one opposite finger touch it, until the fingers have
opened clear of it (the paper's own planning assumes that a grasped object is attached rigidly). A grasp without contact
on both sides, or whose object is no longer between the fingers after the lift, has failed, and the next is tried.

Where things are is known from the camera alone (`agent.arm.eyes`), and what is in the hand from the fingers. After each
placement, and after each pick that failed, one picture is compared with what should be; where something is otherwise,
what is left is planned again around what stands (`agent.arm.work_planner`).
"""

from __future__ import annotations

import time
from collections.abc import Generator, Sequence
from dataclasses import replace

import numpy as np

from agent.arm.build_listeners import BuildListeners
from agent.arm.clearing import Obstruction
from agent.arm.controller import ArmDriver
from agent.arm.events import ArmEvent, Noticed, Picked, PickFailed, Placed, PlaceFailed, SetAside
from agent.arm.eyes import Eyes
from agent.arm.handling import LOST, Handling
from agent.arm.monitor import Monitor
from agent.arm.motion_planner import PlanningScene
from agent.arm.object_planner import ObjectPlan
from agent.arm.place_watch import PlaceWatch
from agent.arm.placement_rules import PlacementRules
from agent.arm.plan_selection import PLANNING_CHECKS, find_plan
from agent.arm.recovery import is_folded, leave_start
from agent.arm.remainder import EndsHere
from agent.arm.simulated_arm import SimulatedArm
from agent.arm.task_planner import Search
from agent.arm.work_planner import Step, WorkPlanner
from structdiffusion.completion.surface import completed_scene
from structdiffusion.evaluation_protocol import MAX_TILT
from structdiffusion.geometry import tilt_between, transform_points, turn_of
from structdiffusion.observation import Arrangement, Scene
from structdiffusion.simulation.world import TABLE, TabletopWorld

PICK_ATTEMPTS = 3
STALE = 0.003  # m that an object may have moved before the plan around it is made again


def build_structure(
    world: TabletopWorld,
    arm: SimulatedArm,
    scene: Scene,
    arrangements: Sequence[Arrangement],
    *,
    rng: np.random.Generator,
    planning_checks: int = PLANNING_CHECKS,
    rules: PlacementRules = PlacementRules(),
    listeners: BuildListeners = BuildListeners(),
) -> Generator[ArmEvent, None, None]:
    """Find the first arrangement with a plan for every object, build it, and yield the events of each step.

    Args:
        world: the true objects; they are only acted on and pictured, their poses and models are not looked at.
        arm: the arm, loaded into `world.client`, its hand empty (`agent.arm.recovery.tidy_up` sees to that).
        scene: what was perceived before anything moved.
        arrangements: proposed goals, best first; an object whose motion is the identity stays.
        planning_checks: the most configurations that the search over all arrangements may check.
        rules: what else is known of the placements.
        listeners: those that follow the build, besides whoever takes its events.

    Yields:
        `PlanFailed` for every arrangement without a plan, `Planned` for the one that is built, then per
        object `PickFailed`, `Picked`, `Placed` or `PlaceFailed`, and after each of them `StandingChanged` for what was
        placed before and has fallen since, and `Noticed` for all that is otherwise than it should be. An arrangement
        that is laid out anew is numbered after all that were given before, and has its `Planned` too. Without
        `Planned`, nothing was moved.

    Raises:
        KeyboardInterrupt: if somebody interrupts it; while the arm is at work, `Stopped` comes first: what was in
            the hand is set down, and the arm folds.
    """
    with PlanningScene(rng.spawn(1)[0], arm.kinematics, listeners.on_check) as planning:
        planning.arm.hold_by(arm.hold)
        search, solid = Search(planning, rng, scene.table, rules), completed_scene(scene)
        plans = yield from find_plan(search, solid, arrangements, planning_checks)
        if plans is None:
            return
        rank, steps = plans
        driver = ArmDriver(world, arm, listeners.on_step, listeners.log)
        hand = Handling(driver, search.scene)
        driver.let_sleep(True)
        try:
            if not is_folded(arm):  # an earlier build was interrupted, or it was recorded in another pose
                clouds = [np.asarray(cloud.points, dtype=np.float64) for cloud in (*scene.objects, *scene.distractors)]
                count = len(scene.objects)
                search.set_out(clouds[:count], clouds[count:], [cloud.bottom for cloud in scene.objects])
                leave_start(driver, search.scene)
            eyes = Eyes(world, arm, scene, solid, rng.spawn(1)[0])
            work = WorkPlanner(eyes, search, list(arrangements), rank, listeners.replanner)
            builder = _Builder(hand, eyes, work, listeners.ends_here)
            yield from builder.run([Step(plan.object, plan) for plan in steps])
        except KeyboardInterrupt:
            yield hand.stop()
            raise
        finally:
            driver.let_sleep(False)


class _Builder:
    """An executor of steps, which looks after each and plans again where something is otherwise than it should be."""

    def __init__(self, hand: Handling, eyes: Eyes, work: WorkPlanner, ends_here: EndsHere | None = None) -> None:
        self.hand, self.eyes, self.work, self.ends_here = hand, eyes, work, ends_here
        self.monitor = Monitor(eyes)

    def run(self, steps: Sequence[Step]) -> Generator[ArmEvent, None, None]:
        """Carry out steps, and whatever else it takes until everything stands that can."""
        agenda = list(steps)
        while True:
            if self.ends_here is not None and self.ends_here(self.work.remainder):
                return
            if not agenda and not self.work.is_unfinished():
                self.eyes.look({})  # once more: anybody may have come by since the last picture
                changed = yield from self._compare({}, "the arm was done")
                if not changed and not self.work.is_unfinished():
                    if missed := self.work.missed():
                        detail = f"stands, but not as asked: {'; '.join(missed)}"
                        yield Noticed(None, "what was built", "off", detail, "end")
                    return
            # Where there was no plan for all, what cannot be put where it should is told, one after the other.
            stale = not agenda or (agenda[0].plan is not None and self.work.support_is_off(agenda[0]))
            if not stale:
                stale = yield from self._step(agenda.pop(0))
            if stale:
                agenda = yield from self.work.plan_again()
                if not agenda:
                    return

    def _step(self, step: Step) -> Generator[ArmEvent, None, bool]:
        """Pick and place one object; return whether the plans of the other steps are void now."""
        if step.clears is not None:
            return (yield from self._set_aside(step, step.clears))
        began, work, index = time.monotonic(), self.work, step.object
        name = self.eyes.names[index]
        # now_from_initial once it is placed: its goal, or the place aside.
        target = step.plan.goal_from_now @ work.expected[index] if step.plan and step.plan.aside else None
        current: ObjectPlan | None = step.plan if self._still_holds() and not work.is_off(step) else None
        if current is not None and work.has_failed(index, current.grasp):
            current = None
        watched = True  # whether its goal is, on the way: until that was a false alarm
        reason, blocked = work.missing_support(step), False
        for attempt in range(1, 1 if reason else PICK_ATTEMPTS + 1):
            if current is None:
                again, reason = work.plan_one(index, target, self.hand.arm.configuration())
                if again is None:
                    blocked = target is None
                    break
                current = replace(again, aside=target is not None)
            result = self.hand.pick(current, name, attempt, self.eyes.bottom(index))
            if isinstance(result, Picked):
                yield result
                work.watch.take_away(index)
                watch = PlaceWatch(self.eyes.camera, current, self.eyes.solid(index)) if watched else None
                reason = self.hand.place(current, name, watch)
                if not reason:
                    return (yield from self._placed(step, current, target, began))
                if reason == LOST:
                    yield Noticed(index, name, "not in the hand", reason, "place again")
                else:
                    watched = False
                    yield PlaceFailed(index, name, reason)
            else:
                reason = result
                yield PickFailed(index, name, current.grasp.kind, attempt, reason)
                work.remember_failed(index, current.grasp)
            self.eyes.look({}, index if reason == LOST else None)
            if (yield from self._compare({}, f"{name} was moved", index)):
                return True
            current = None
        yield PlaceFailed(index, name, reason)
        if step.plan is not None:  # the plans of the other steps take it to be there
            work.expected[index] = step.plan.goal_from_now @ work.expected[index]
        change = work.give_up(index, reason if blocked else "")
        if change is not None:
            yield Noticed(index, name, change.what, change.detail, work.answer_failure(change))
        return change is not None

    def _set_aside(self, step: Step, thing: Obstruction) -> Generator[ArmEvent, None, bool]:
        """Take what is in the way to a free place; return that the plans of the other steps are void now."""
        began, eyes, plan, reason = time.monotonic(), self.eyes, step.plan, ""
        assert plan is not None
        taken = self.hand.pick(plan, thing.name, 1, thing.bottom)
        if isinstance(taken, Picked):
            reason = self.hand.place(plan, thing.name)
        else:
            reason = taken
        put: dict[int, np.ndarray] = {}
        if not reason and thing.index is not None:
            put[thing.index] = plan.goal_from_now @ eyes.motions[thing.index]
        elif not reason:
            self.monitor.expect(transform_points(plan.goal_from_now, thing.cloud))
        eyes.look(put)
        if reason:
            self.work.count_slip(thing, plan.grasp)
        yield SetAside(thing.index, thing.name, thing.detail, reason, time.monotonic() - began)
        yield from self._compare(put, f"{thing.name} was set aside")
        return True

    def _placed(
        self, step: Step, plan: ObjectPlan, target: np.ndarray | None, began: float
    ) -> Generator[ArmEvent, None, bool]:
        """Look where a released object is; return whether the plans of the other steps are void now."""
        work, eyes, index = self.work, self.eyes, step.object
        name = eyes.names[index]
        goal = work.goal(index) if target is None else target
        put = plan.goal_from_now @ eyes.motions[index]  # a round object may have been turned on the way
        if step.plan is not None:
            work.expected[index] = step.plan.goal_from_now @ work.expected[index]
        eyes.look({index: put})
        trouble, on = work.watch.place(index, goal, TABLE if plan.aside else work.support(index))
        again = work.reason_to_move(index)
        work.count_placement(index, plan.aside, tilt_between(plan.goal_from_now, np.eye(4)) > MAX_TILT)
        now = eyes.measured[index]
        off = eyes.middle(index, now) - eyes.middle(index, goal)
        angle = tilt_between(now, goal) if plan.spun else turn_of(goal[:3, :3].T @ now[:3, :3])
        yield Placed(
            index, name, plan.aside, float(np.hypot(*off[:2])), angle, eyes.pose(index), time.monotonic() - began,
            trouble, again, on,
        )  # fmt: skip
        return (yield from self._compare({index: put}, f"{name} was placed"))

    def _compare(
        self, placed: dict[int, np.ndarray], during: str, touched: int | None = None
    ) -> Generator[ArmEvent, None, bool]:
        """Tell what the last picture shows otherwise than it should be; return whether plans are void by it."""
        yield from self.work.watch.changes(during)
        changes = self.monitor.changes(placed, touched)
        for change in changes:
            index = change.index if change.index is not None and change.index < self.eyes.count else None
            yield Noticed(index, change.name, change.what, change.detail, self.work.answer(change))
        return bool(changes)

    def _still_holds(self) -> bool:
        """Return whether every object is where the plans assume it."""
        for i in range(self.eyes.count):
            cloud, now = self.eyes.clouds[i], self.eyes.motions[i]
            moved = transform_points(now, cloud) - transform_points(self.work.expected[i], cloud)
            if i not in self.eyes.gone and np.linalg.norm(moved, axis=1).max() > STALE:
                return False
        return True
