"""Recover after the arm was stopped: set down what it holds, and move its hand out of the way."""

from __future__ import annotations

import numpy as np

from agent.arm.controller import CARTESIAN_SPEED, ArmDriver
from agent.arm.motion_planner import PlanningScene
from agent.arm.simulated_arm import SimulatedArm
from agent.arm.trajectories import straight_line
from structdiffusion.geometry import raised
from structdiffusion.simulation.world import TabletopWorld

LOWERING_STEP, TOUCHING = 0.005, 0.001  # m: an object is lowered in such steps until something is this near
WITHDRAWAL = 0.12  # m
AT_HOME = 0.1  # rad, of every joint
SETTLE_SECONDS = 0.6
OPENING_SECONDS = 1.0  # in which closed fingers open
SLACK = 0.002  # m: an overlap is not measured the same from all sides


def set_down_below(driver: ArmDriver, height: float) -> None:
    """Lower what is in the hand until it touches something, and open the hand.

    Args:
        driver: the driver of the arm.
        height: m, how far the table is below what is in the hand.
    """
    arm = driver.arm
    assert arm.held is not None
    index = driver.world.bodies.index(arm.held)
    pose = arm.world_from_ee()
    depths = np.arange(0.0, height + LOWERING_STEP, LOWERING_STEP)
    path = straight_line(arm.kinematics, arm.configuration(), [raised(pose, -depth) for depth in depths])
    for q in () if path is None else path:
        if driver.world.clearances(index, reach=TOUCHING):
            break
        driver.follow(q[None], "set down", CARTESIAN_SPEED)
    driver.let_go(arm.hand.open)


def withdraw(driver: ArmDriver) -> None:
    """Open the hand and move it back from the object between its fingers: first against its approach direction,
    then up.
    """
    driver.open(driver.arm.hand.open)
    driver.wait(0.3)
    pose = driver.arm.world_from_ee()
    back = pose.copy()
    back[:3, 3] -= WITHDRAWAL * pose[:3, 2]
    for start, target in ((pose, back), (back, raised(back, WITHDRAWAL))):
        path = straight_line(driver.arm.kinematics, driver.arm.configuration(), (start, target))
        if path is not None:
            driver.follow(path, "withdraw", CARTESIAN_SPEED)


def is_folded(arm: SimulatedArm) -> bool:
    """Return whether the arm is in its waiting pose."""
    folded = arm.kinematics.folded
    return bool(np.abs(arm.kinematics.unwind(arm.configuration(), folded) - folded).max() < AT_HOME)


def fold(driver: ArmDriver, scene: PlanningScene) -> None:
    """Move back to the waiting pose by a planned motion, or straight if none is found."""
    start = driver.arm.configuration()
    home = driver.arm.kinematics.unwind(driver.arm.kinematics.folded, start)
    path = scene.plan(start, home)
    driver.follow(np.stack((start, home)) if path is None else path, "fold")
    driver.wait(SETTLE_SECONDS)


def leave_start(driver: ArmDriver, scene: PlanningScene) -> None:
    """Move to the waiting pose from any start by a planned motion; near the start the arm may overlap perceived
    objects.

    If no motion is found with the present finger angles, the fingers open first; if that does not help, the hand moves
    back from the object between its fingers.
    """
    arm = driver.arm
    start = arm.configuration()
    home = arm.kinematics.unwind(arm.kinematics.folded, start)
    for fingers in (arm.finger_angles().tolist(), [arm.hand.open] * len(arm.fingers)):
        scene.set_fingers(fingers)
        path = scene.plan(start, home, overlap=scene.overlap(start) + SLACK)
        if path is not None:
            driver.follow(path, "fold")
            driver.open(arm.hand.open)
            driver.wait(SETTLE_SECONDS)
            return
        driver.open(arm.hand.open)
        driver.wait(OPENING_SECONDS)
    withdraw(driver)
    fold(driver, scene)


def tidy_up(world: TabletopWorld, arm: SimulatedArm, rng: np.random.Generator) -> bool:
    """Empty the hand and fold the arm after its final stop; return whether anything had to be done."""
    if arm.held is None and is_folded(arm):
        return False
    driver = ArmDriver(world, arm)
    if arm.held is not None:
        set_down_below(driver, float(world.pose(world.bodies.index(arm.held))[2, 3]))
    withdraw(driver)
    with PlanningScene(rng, arm.kinematics) as scene:
        fold(driver, scene)
    return True
