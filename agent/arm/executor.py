"""Build a structure with the simulated Jaco: search, pick and place, and a measurement after each placement.

The arm moves by position motors within the maker's joint speeds; the fingers close with the maker's effort, each waits
where it touches, and what they hold they hold by friction. With `JacoArm.hold` "weld" a fixed constraint joins the
object to the hand once the thumb and at least one opposite finger touch it, until the fingers have opened clear of it
(the paper's own planning assumes that a grasped object is attached rigidly). A grasp without contact on both sides, or
whose object has not come along after the lift, has failed, and the next is tried. Each placement, each slip while the
fingers close, and each object that was pushed is measured on the simulation's poses: this stands in for tracking by the
camera.
"""

from __future__ import annotations

import time
from collections.abc import Collection, Generator, Iterator, Sequence
from dataclasses import replace

import numpy as np

from agent.arm.arm_model import FINGER_OPEN
from agent.arm.build_listeners import BuildListeners
from agent.arm.controller import CARTESIAN_SPEED, FLAT_SQUEEZE, SLIDING_SPEED, ArmDriver
from agent.arm.events import ArmEvent, Picked, PickFailed, Placed, PlaceFailed, Stopped
from agent.arm.grasps import Grasp
from agent.arm.kinematics import JacoArm
from agent.arm.motion_planner import PlanningScene
from agent.arm.object_planner import ObjectPlan
from agent.arm.placement_order import bottom_at, precedence
from agent.arm.placement_rules import PlacementRules
from agent.arm.plan_selection import PLANNING_CHECKS, find_plan
from agent.arm.recovery import SETTLE_SECONDS, fold, is_folded, leave_start, set_down_below, withdraw
from agent.arm.standing_watch import StandingWatch
from agent.arm.task_planner import Search
from agent.arm.trajectories import straight_line
from structdiffusion.completion.surface import completed_clouds
from structdiffusion.geometry import raised, tilt_between, transform_points, turn_of
from structdiffusion.observation import Arrangement, Scene
from structdiffusion.simulation.world import FALLEN, TABLE, TabletopWorld

PICK_ATTEMPTS = 3
REPLANNING_CHECKS = PLANNING_CHECKS // 4  # for one object, when the world is not as planned
STALE = 0.003  # m that an object may have moved before the plan around it is made again
HELD_RISE, HOLDING_SECONDS = 0.03, 0.2  # m that a held object has risen, and s for which it is held there, before it counts
LARGEST_SLIP, LARGEST_SLIP_ANGLE = 0.03, 0.25  # m, rad while the fingers close: more is no grasp
ON_TABLE = 0.02  # m: what goes no higher and on no other object goes on the table
PUSHED = 0.02  # m from its goal: worth another move
LARGEST_CORRECTION = 0.02  # m by which an object follows the real place of the one it will stand on


def _both_sides(touching: Collection[int]) -> bool:
    """Return whether the thumb (0) and at least one opposite finger are among `touching`."""
    return 0 in touching and len(touching) >= 2


def build_structure(
    world: TabletopWorld,
    arm: JacoArm,
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
        world: the true objects; `world.bodies[i]` is `scene.objects[i]`. Planning never looks at its models.
        arm: the arm, loaded into `world.client`, its hand empty (`agent.arm.recovery.tidy_up` sees to that).
        scene: what was perceived before anything moved.
        arrangements: proposed goals, best first; an object whose motion is the identity stays.
        planning_checks: the most configurations that the search over all arrangements may check.
        rules: what else is known of the placements.
        listeners: those that follow the build, besides whoever takes its events.

    Yields:
        `PlanFailed` for every arrangement without a plan, `Planned` for the one that is built, then per
        object `PickFailed`, `Picked`, `Placed` or `PlaceFailed`, and after each of them `StandingChanged` for what was
        placed before and has fallen since. Without `Planned`, nothing was moved.

    Raises:
        KeyboardInterrupt: if somebody interrupts it; while the arm is at work, `Stopped` comes first: what was in
            the hand is set down, and the arm folds.
    """
    with PlanningScene(rng.spawn(1)[0], arm.kinematics, listeners.on_check) as planning:
        planning.arm.hold_by(arm.hold)
        search = Search(planning, rng, scene.table, rules)
        plans = yield from find_plan(search, scene, arrangements, planning_checks)
        if plans is None:
            return
        rank, steps = plans
        driver = ArmDriver(world, arm, listeners.on_step, listeners.log)
        builder = _Builder(driver, scene, arrangements[rank], search)
        try:
            builder.begin()
            for step in steps:
                yield from builder.move(step)
            for step, why in builder.displaced(steps):
                yield from builder.move(step, why)
        except KeyboardInterrupt:
            yield builder.stop()
            raise
        finally:
            builder.driver.let_sleep(False)


class _Builder:
    """An executor of the plans of one arrangement, which plans again where the world has changed."""

    def __init__(self, driver: ArmDriver, scene: Scene, arrangement: Arrangement, search: Search) -> None:
        self.driver, self.scene, self.search = driver, scene, search
        self.world, self.arm = driver.world, driver.arm
        self.distractors = [np.asarray(cloud.points, dtype=np.float64) for cloud in scene.distractors]
        self.goal_from_initial = arrangement.goal_from_initial
        self.count = len(scene.objects)
        self.start_clouds = completed_clouds(scene)
        self.start_bottoms = [cloud.bottom for cloud in scene.objects]
        self.start_poses = self.world.poses()[: self.count]
        *_, self.stands_on = precedence(self.start_clouds, list(self.goal_from_initial), self.start_bottoms)
        for index, containers in search.rules.into.items():
            self.stands_on[index] = next((key for key in containers if isinstance(key, int)), self.stands_on[index])
        self.expected = [np.eye(4)] * self.count  # now_from_initial as planned so far
        self.watch = StandingWatch(self.world, [cloud.name for cloud in scene.objects])
        self.set_aside: set[int] = set()
        self.driver.let_sleep(True)
        self._pose_before = np.eye(4)  # of the object being moved, when its plan was made

    # --- what a look shows -------------------------------------------------------------------

    def _motions_so_far(self) -> list[np.ndarray]:
        """Measure now_from_initial (4, 4) of every object."""
        return [self.world.pose(i) @ np.linalg.inv(self.start_poses[i]) for i in range(self.count)]

    def _goal(self, index: int) -> np.ndarray:
        """Return goal_from_initial (4, 4), shifted with the object that it will stand on, by 2 cm at most."""
        goal = self.goal_from_initial[index].copy()
        under = self.stands_on[index]
        if under is not None:
            center = self.start_clouds[under].mean(axis=0)
            offset = transform_points(self._motions_so_far()[under], center) - transform_points(
                self.goal_from_initial[under], center
            )
            distance = float(np.linalg.norm(offset[:2]))
            if distance < 2 * LARGEST_CORRECTION:
                goal[:2, 3] += offset[:2] * min(1.0, LARGEST_CORRECTION / max(distance, 1e-9))
        return goal

    # --- beginning and being stopped ---------------------------------------------------------

    def begin(self) -> None:
        """Fold the arm if it is not folded, because an earlier build was interrupted or it was recorded in another
        pose.
        """
        if not is_folded(self.arm):
            self.search.set_out(self.start_clouds, self.distractors, self.start_bottoms)
            leave_start(self.driver, self.search.scene)

    def stop(self) -> Stopped:
        """Stop the arm, set down what is in the hand, and fold; after a second stop the arm stays where it is."""
        index = None if self.arm.held is None else self.world.bodies.index(self.arm.held)
        name = "" if index is None else self.scene.objects[index].name
        set_down = False
        try:
            self.driver.halt()
            if index is not None:
                set_down_below(self.driver, index)
                set_down = True
            withdraw(self.driver)
            fold(self.driver, self.search.scene)
        except KeyboardInterrupt:
            self.driver.halt()
            return Stopped(index, name, set_down, False)
        return Stopped(index, name, set_down, True)

    def displaced(self, plans: Sequence[ObjectPlan]) -> Iterator[tuple[ObjectPlan, str]]:
        """Yield the plan of each object that is not at its goal, because it was pushed or could not be placed before,
        and why it is moved again.

        Only upright objects with nothing to be placed on them are included, because moving the others does not help.
        """
        for plan in {plan.object: plan for plan in plans}.values():
            pose = self.world.pose(plan.object)
            goal = self.goal_from_initial[plan.object] @ self.start_poses[plan.object]
            distance = float(np.linalg.norm(pose[:3, 3] - goal[:3, 3]))
            stands = tilt_between(pose, goal) < LARGEST_SLIP_ANGLE and pose[2, 3] > FALLEN
            if distance > PUSHED and stands and plan.object not in self.stands_on:
                yield plan, f"stood {100 * distance:.1f} cm from its goal" if plan.object in self.watch else ""

    # --- one object --------------------------------------------------------------------------

    def move(self, plan: ObjectPlan, why: str = "") -> Iterator[ArmEvent]:
        """Pick and place one object; yield every attempt, the result, and what stands otherwise since.

        Args:
            plan: its plan.
            why: it is moved once more, in words that follow its name.
        """
        did = "was moved"
        for event in self._moved(plan, why):
            yield event
            did = "was placed" if isinstance(event, Placed) else "was picked up" if isinstance(event, Picked) else did
        yield from self.watch.changes(f"{self.scene.objects[plan.object].name} {did}")

    def _moved(self, plan: ObjectPlan, why: str) -> Iterator[ArmEvent]:
        began = time.monotonic()
        index = plan.object
        name = self.scene.objects[index].name
        # now_from_initial once it is placed: its goal, or the place aside.
        target = plan.goal_from_now @ self.expected[index] if plan.aside else None
        current: ObjectPlan | None = plan if self._still_holds() else None
        failed: list[Grasp] = []
        reason = ""
        for attempt in range(1, PICK_ATTEMPTS + 1):
            if current is None:
                again, reason = self._plan_again(index, target, failed)
                if again is None:
                    break
                current = replace(again, aside=plan.aside)
            reason, picked = self._pick(current, name, attempt)
            if picked is not None:
                yield picked
                self.watch.take_away(index)
                self._place(current, name)
                self.expected[index] = self.goal_from_initial[index] if target is None else target
                why = why or ("had been set aside" if index in self.set_aside else "")
                self.set_aside |= {index} if plan.aside else set()
                yield replace(self._look(index, name, current, time.monotonic() - began), again=why)
                return
            yield PickFailed(index, name, current.grasp.kind, attempt, reason)
            failed.append(current.grasp)
            current = None
        yield PlaceFailed(index, name, reason)

    def _still_holds(self) -> bool:
        """Return whether every object is where the plans assume it."""
        for i, motion in enumerate(self._motions_so_far()):
            cloud = self.start_clouds[i]
            planned = transform_points(self.expected[i], cloud)
            moved = np.linalg.norm(transform_points(motion, cloud) - planned, axis=1)
            if moved.max() > STALE:
                return False
        return True

    def _plan_again(
        self, index: int, target: np.ndarray | None, failed: Sequence[Grasp]
    ) -> tuple[ObjectPlan | None, str]:
        motions = self._motions_so_far()
        clouds = [transform_points(motion, cloud) for motion, cloud in zip(motions, self.start_clouds)]
        bottoms = [max(0.0, bottom_at(*each)) for each in zip(motions, self.start_clouds, self.start_bottoms)]
        goal_from_now = (self._goal(index) if target is None else target) @ np.linalg.inv(motions[index])
        kinematics = self.search.kinematics
        start = kinematics.unwind(self.arm.configuration(), kinematics.folded)
        limit = self.search.scene.checks + REPLANNING_CHECKS
        try:
            for last_resort in (False, True):
                self.search.loosen(last_resort)
                plan, reason = self.search.object(
                    index, clouds, self.distractors, bottoms, goal_from_now, limit, start, failed
                )
                if plan is not None:
                    break
        finally:
            self.search.loosen(False)
        return plan, reason

    def _pick(self, plan: ObjectPlan, name: str, attempt: int) -> tuple[str, Picked | None]:
        body = self.world.bodies[plan.object]
        self._pose_before = self.world.pose(plan.object)
        self.driver.open(plan.grasp.opening)
        self.driver.follow(plan.reach, f"reach {name}")
        self.driver.follow(plan.approach, f"approach {name}", CARTESIAN_SPEED)
        before = self._pose_before
        slides = plan.grasp.slides
        # Between the fingers a rim is caught without pressing, which would drive them out of it.
        caught = slides and plan.grasp.kind == "rim"
        squeeze = 0.0 if caught else FLAT_SQUEEZE if plan.grasp.kind == "flat" else 1.0
        touching = self.driver.close(body, squeeze)
        after = self.world.pose(plan.object)
        slip = float(np.linalg.norm(after[:3, 3] - before[:3, 3]))
        slip_angle = turn_of(before[:3, :3].T @ after[:3, :3])
        reason = "the fingers met no contact on both sides"
        if _both_sides(touching):
            reason = "it turned or slid while the fingers closed"
            if slip < LARGEST_SLIP and slip_angle < LARGEST_SLIP_ANGLE:
                self.driver.take(body)
                self.driver.follow(plan.lift, f"lift {name}", CARTESIAN_SPEED)
                self.driver.wait(0.0 if self.arm.welds else HOLDING_SECONDS)
                rise = self.world.pose(plan.object)[2, 3] - after[2, 3]
                if slides or (rise > HELD_RISE and self._grips(body)):
                    hold = "the table, friction" if slides else "friction"
                    hold = "weld after contact on both sides" if self.arm.welds else hold
                    return "", Picked(
                        plan.object, name, plan.grasp.kind, attempt, len(touching), hold, slip, slip_angle
                    )
                reason = "it slipped out of the fingers"
        self.driver.let_go(plan.grasp.opening)
        self.driver.follow(plan.approach[::-1], "retreat", CARTESIAN_SPEED)
        fold(self.driver, self.search.scene)
        return reason, None

    def _grips(self, body: int) -> bool:
        return self.arm.welds or _both_sides(self.arm.touching(body))

    def _place(self, plan: ObjectPlan, name: str) -> None:
        if plan.grasp.slides:
            self.driver.follow(plan.transfer, f"slide {name}", SLIDING_SPEED)
        else:
            self.driver.follow(plan.transfer, f"transfer {name}")
            self.driver.follow(self._corrected(plan), f"lower {name}", CARTESIAN_SPEED)
        self.driver.wait(0.15)
        self.driver.let_go(plan.grasp.opening)
        self.driver.wait(0.25)
        self.driver.follow(plan.retreat, "retreat", CARTESIAN_SPEED)
        self.driver.follow(plan.fold, "fold")
        self.driver.open(FINGER_OPEN)
        self.driver.wait(SETTLE_SECONDS)

    def _corrected(self, plan: ObjectPlan) -> np.ndarray:
        """Correct the lowering path by the measured pose of the object in the hand."""
        hand_from_object = np.linalg.inv(self.arm.world_from_ee()) @ self.world.pose(plan.object)
        planned_pick = plan.grasp.world_from_ee
        goal = raised(plan.goal_from_now, plan.release) @ self._pose_before
        release = goal @ np.linalg.inv(hand_from_object)
        planned = raised(plan.goal_from_now @ planned_pick, plan.release)
        offset = release @ np.linalg.inv(planned)
        angle = turn_of(offset)
        if np.linalg.norm(release[:3, 3] - planned[:3, 3]) > 0.03 or angle > 0.25:
            return plan.lower
        above = raised(release, float(self.search.kinematics.forward(plan.lower[0])[2, 3] - planned[2, 3]))
        q, solved = self.search.kinematics.inverse(above[None], plan.lower[:1])
        if not solved[0] or np.abs(q[0] - plan.lower[0]).max() > 0.6:
            return plan.lower
        down = straight_line(self.search.kinematics, q[0], (above, release))
        return plan.lower if down is None else np.concatenate((plan.lower[:1], down))

    def _look(self, index: int, name: str, plan: ObjectPlan, seconds: float) -> Placed:
        pose = self.world.pose(index)
        goal = self.expected[index] @ self.start_poses[index]
        error = float(np.linalg.norm(pose[:2, 3] - goal[:2, 3]))
        angle = tilt_between(pose, goal) if plan.spun else turn_of(goal[:3, :3].T @ pose[:3, :3])
        trouble, on = self.watch.place(index, goal, TABLE if plan.aside else self._support(index))
        return Placed(index, name, plan.aside, error, angle, pose, seconds, trouble, on=on)

    def _support(self, index: int) -> int | None:
        """Return what an object rests on at its goal: another one, `TABLE`, or `None` where the scene does not tell."""
        if self.stands_on[index] is not None or index in self.search.rules.into:
            return self.stands_on[index]
        bottom = bottom_at(self.goal_from_initial[index], self.start_clouds[index], self.start_bottoms[index])
        return TABLE if bottom < ON_TABLE else None
