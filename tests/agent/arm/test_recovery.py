"""Stopping the arm while it is at work: what it holds is set down, the hand is empty and the arm folds."""

import math
from collections.abc import Callable, Iterator

import numpy as np
import pytest

from agent.arm.build_listeners import BuildListeners
from agent.arm.controller import ArmDriver
from agent.arm.events import ArmEvent, Noticed, Picked, PickFailed, Placed, Planned, Stopped
from agent.arm.executor import build_structure
from agent.arm.grasps import hand_pose
from agent.arm.jaco_hand import FINGER_OPEN
from agent.arm.recovery import WITHDRAWAL, is_folded, tidy_up, withdraw
from agent.arm.simulated_arm import SimulatedArm
from agent.arm.task_planner import Search
from structdiffusion.geometry import pose_from_xyz_yaw, tilt_between
from structdiffusion.objects.procedural import procedural_object
from structdiffusion.observation import Arrangement, Scene
from structdiffusion.simulation.world import TABLE, TabletopWorld

START = pose_from_xyz_yaw(0.42, -0.15, 0.0, 0.3)
GOAL = pose_from_xyz_yaw(0.47, 0.15, 0.0, 0.3)


class Bench:
    """One block on a table, the folded arm, and somebody who interrupts when `when` holds."""

    def __init__(self, world: TabletopWorld) -> None:
        self.world, self.arm = world, SimulatedArm(world.client)
        world.settle()
        self.when: list[Callable[[], bool]] = []  # each interrupts once
        self.happened: list[ArmEvent] = []

    def scene(self) -> Scene:
        return self.world.observe(np.random.default_rng(0))

    def watch(self) -> None:
        if self.when and self.when[0]():
            del self.when[0]
            raise KeyboardInterrupt

    def build(self, seed: int = 0) -> None:
        """Moves the block to `GOAL`; `happened` has its events, whatever ends it."""
        self.happened = []
        arrangement = Arrangement(np.array([GOAL @ np.linalg.inv(self.world.pose(0))]))
        rng, listeners = np.random.default_rng(seed), BuildListeners(on_step=self.watch)
        work = build_structure(self.world, self.arm, self.scene(), [arrangement], rng=rng, listeners=listeners)
        for event in work:
            self.happened.append(event)

    @property
    def away(self) -> float:
        """How far the arm is from its waiting pose, rad, of the joint that is farthest."""
        kinematics = self.arm.kinematics
        q = kinematics.unwind(self.arm.configuration(), kinematics.folded)
        return float(np.abs(q - kinematics.folded).max())

    @property
    def height(self) -> float:
        return float(self.world.pose(0)[2, 3])

    def stands(self) -> bool:
        """Whether the block stands on the table, upright and at rest, and nothing of the arm is near it."""
        before = self.world.pose(0)
        self.world.step(0.5)
        after = self.world.pose(0)
        still = np.abs(after - before).max() < 0.002 and abs(after[2, 3]) < 0.003
        upright = tilt_between(after, START) < math.radians(5)
        return bool(still and upright and self.world.supports() == [(TABLE,)] and not self.arm.touching(self.body))

    @property
    def body(self) -> int:
        return self.world.bodies[0]


@pytest.fixture
def bench() -> Iterator[Bench]:
    with TabletopWorld([procedural_object("block", 1)], [START]) as world:
        yield Bench(world)


def test_stopped_before_anything_is_in_the_hand(bench):
    bench.when = [lambda: bench.away > 0.5]
    with pytest.raises(KeyboardInterrupt):
        bench.build()
    assert [type(event) for event in bench.happened] == [Planned, Stopped]
    assert bench.happened[-1] == Stopped(None, "", False, True)
    assert bench.away < 0.05 and bench.stands()
    assert np.linalg.norm(bench.world.pose(0)[:2, 3] - START[:2, 3]) < 0.002


def test_stopped_between_the_fingers(bench):
    """The hand stands around the block when it is stopped: it is drawn back without taking the block along."""
    bench.when = [lambda: bool(bench.arm.touching(bench.body))]
    with pytest.raises(KeyboardInterrupt):
        bench.build()
    assert bench.happened[-1] == Stopped(None, "", False, True)
    assert bench.away < 0.05 and bench.stands()
    assert np.linalg.norm(bench.world.pose(0)[:2, 3] - START[:2, 3]) < 0.03


@pytest.mark.parametrize("height", [0.02, 0.08])
def test_stopped_with_an_object_in_the_hand(bench, height):
    bench.when = [lambda: bench.height > height]
    with pytest.raises(KeyboardInterrupt):
        bench.build()
    assert bench.happened[-1] == Stopped(0, "block", True, True)
    assert bench.away < 0.05 and bench.stands()
    assert bench.arm.finger_angles() == pytest.approx([FINGER_OPEN] * 3, abs=0.1)
    stopped_at = bench.world.pose(0)[:2, 3]
    assert np.linalg.norm(stopped_at - GOAL[:2, 3]) > 0.05  # set down where it was, not brought to its goal
    bench.build()  # and another build picks it up from there
    assert [type(event) for event in bench.happened if type(event) in (Planned, Placed)] == [Planned, Placed]
    assert np.linalg.norm(bench.world.pose(0)[:2, 3] - GOAL[:2, 3]) < 0.03


def test_whoever_takes_the_events_may_interrupt_too(bench):
    """The interruption is thrown in where an event was sent, as when the listener is interrupted."""
    arrangement = Arrangement(np.array([GOAL @ np.linalg.inv(bench.world.pose(0))]))
    scene, rng = bench.scene(), np.random.default_rng(0)
    work = build_structure(bench.world, bench.arm, scene, [arrangement], rng=rng)
    assert [type(next(work)), type(next(work))] == [Planned, Picked]
    assert bench.height > 0.02
    assert work.throw(KeyboardInterrupt()) == Stopped(0, "block", True, True)
    with pytest.raises(KeyboardInterrupt):
        next(work)
    assert bench.away < 0.05 and bench.stands()


def test_stopped_again_while_it_sets_down_the_arm_stays(bench):
    bench.when = [lambda: bench.height > 0.1, lambda: bench.height < 0.05]
    with pytest.raises(KeyboardInterrupt):
        bench.build()
    assert bench.when == [] and bench.happened[-1] == Stopped(0, "block", False, False)
    there = bench.arm.configuration()
    assert bench.away > 0.3
    bench.world.step(0.5)
    np.testing.assert_allclose(bench.arm.configuration(), there, atol=0.01)


def test_what_a_second_stop_left_in_the_hand_is_set_down_by_tidying_up(bench):
    bench.when = [lambda: bench.height > 0.1, lambda: bench.height < 0.09]
    with pytest.raises(KeyboardInterrupt):
        bench.build()
    assert bench.arm.held == bench.body
    assert bench.height > 0.02 and not is_folded(bench.arm)
    assert tidy_up(bench.world, bench.arm, np.random.default_rng(0))
    assert bench.arm.held is None and is_folded(bench.arm) and bench.stands()
    tidy = bench.arm.configuration()
    assert not tidy_up(bench.world, bench.arm, np.random.default_rng(0))  # nothing is left to do, and nothing moves
    np.testing.assert_array_equal(bench.arm.configuration(), tidy)
    bench.build()
    assert isinstance(bench.happened[-1], Placed) and np.linalg.norm(bench.world.pose(0)[:2, 3] - GOAL[:2, 3]) < 0.03


def test_stopped_again_while_it_folds_the_next_build_folds_first(bench):
    away: list[float] = []
    bench.when = [lambda: bench.height > 0.02, lambda: bool(away) and bench.away < away[0] - 0.3]
    original = bench.watch

    def watch() -> None:
        if len(bench.when) == 1 and not away and bench.height < 0.001 and not bench.arm.touching(bench.body):
            away.append(bench.away)
        original()

    bench.watch = watch
    with pytest.raises(KeyboardInterrupt):
        bench.build()
    assert bench.happened[-1] == Stopped(0, "block", True, False)
    assert bench.away > 0.1 and bench.stands()
    folded_at: list[float] = []

    def first_folded() -> None:
        if not folded_at and bench.away < 0.05:
            folded_at.append(bench.world.pose(0)[2, 3])

    bench.watch = first_folded
    bench.build()
    assert folded_at and folded_at[0] < 0.003  # before it took the block
    # The camera saw half of the block behind the arm: a grasp may fail, and the block may be placed once more; what
    # matters here is that the arm had folded before it.
    done = [type(event) for event in bench.happened if type(event) not in (PickFailed, Noticed)]
    assert done[:3] == [Planned, Picked, Placed]
    assert bench.away < 0.05 and np.linalg.norm(bench.world.pose(0)[:2, 3] - GOAL[:2, 3]) < 0.03


def test_interrupted_while_it_plans_nothing_moves(bench, monkeypatch):
    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(Search, "arrangement", interrupted)
    with pytest.raises(KeyboardInterrupt):
        bench.build()
    assert bench.happened == [] and bench.away < 0.01


def test_the_hand_withdraws_against_the_way_it_points_then_up(bench):
    pose = hand_pose(np.array([0.45, 0.1, 0.1]), 0.4, math.radians(30))
    q = bench.arm.kinematics.solve(pose, np.random.default_rng(0))
    bench.arm.teleport(q)
    bench.arm.command(q)
    before = bench.arm.world_from_ee()
    withdraw(ArmDriver(bench.world, bench.arm))
    after = bench.arm.world_from_ee()
    expected = before[:3, 3] - WITHDRAWAL * before[:3, 2] + (0.0, 0.0, WITHDRAWAL)
    assert np.linalg.norm(after[:3, 3] - expected) < 0.01
    assert bench.arm.finger_angles() == pytest.approx([FINGER_OPEN] * 3, abs=0.05)
