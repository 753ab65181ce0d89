"""Take and release single objects as planned; the fingers alone tell what is in the hand."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from agent.arm.controller import CARTESIAN_SPEED, FLAT_SQUEEZE, SLIDING_SPEED, TRANSFER_SPEED, ArmDriver, both_sides
from agent.arm.events import Picked, Stopped
from agent.arm.motion_planner import PlanningScene
from agent.arm.object_planner import ObjectPlan
from agent.arm.recovery import SETTLE_SECONDS, fold, set_down_below, withdraw

HOLDING_SECONDS = 0.2  # for which an object is held after the lift before it counts
LISTENING_STEPS = 5  # of physics: a contact may be missing in one of them
LOST = "was lost on the way"
BLOCKED = "was put back, because somebody has changed something where it was to go"


class Handling:
    """The hand at work. Whatever stands between the fingers is taken for the object of the plan.

    Args:
        driver: the driver of the arm.
        scene: the planning scene, for motions back to the waiting pose.
    """

    def __init__(self, driver: ArmDriver, scene: PlanningScene) -> None:
        self.driver, self.arm, self._scene = driver, driver.arm, scene
        self.object: int | None = None  # in the hand, as far as known
        self._name = ""  # of it
        self._closed = self.arm.finger_angles()  # when it took the object
        self._caught = False  # whether the object is only caught between the fingers, which do not press
        self._above = 0.0  # m: z of the hand when it took the object, less that of what the object stood on

    def pick(self, plan: ObjectPlan, name: str, attempt: int, bottom: float) -> Picked | str:
        """Take an object and lift it; return why that failed, and fold the arm then.

        Args:
            plan: its plan.
            name: of the object.
            attempt: 1 for the first.
            bottom: z of what the object stands on.
        """
        driver, arm = self.driver, self.arm
        driver.open(plan.grasp.opening)
        driver.follow(plan.reach, f"reach {name}")
        meets = self._meets(plan.grasp.opening)
        way = driver.follow(plan.approach, f"approach {name}", CARTESIAN_SPEED, meets)
        if meets():
            driver.follow(way[::-1], "retreat", CARTESIAN_SPEED)
            fold(driver, self._scene)
            return "the fingers met something on the way down"
        grasp = plan.grasp
        # A rim that is slid is caught between the fingers without pressing, which would drive them out of it.
        self._caught = grasp.slides and grasp.kind == "rim"
        squeeze = 0.0 if self._caught else FLAT_SQUEEZE if grasp.kind == "flat" else 1.0
        body, touching = driver.close(*driver.world.bodies, squeeze=squeeze)
        reason = "the fingers met no contact on both sides"
        if both_sides(touching):
            self._above = float(arm.world_from_ee()[2, 3]) - bottom
            driver.take(body)
            self.object, self._name, self._closed = plan.object, name, arm.finger_angles()
            driver.follow(plan.lift, f"lift {name}", CARTESIAN_SPEED)
            driver.wait(0.0 if arm.welds else HOLDING_SECONDS)
            if self.holds():
                by_friction = "the table, friction" if grasp.slides else "friction"
                hold = "weld after contact on both sides" if arm.welds else by_friction
                return Picked(plan.object, name, grasp.kind, attempt, len(touching), hold)
            reason = "it slipped out of the fingers"
        self._let_go(grasp.opening)
        driver.follow(plan.approach[::-1], "retreat", CARTESIAN_SPEED)
        fold(driver, self._scene)
        return reason

    def _meets(self, opening: float) -> Callable[[], bool]:
        """Return a function that tells whether something pushes a finger away from the angle `opening`.

        Places are known to millimetres only: a finger that comes down on what stands beside must not press it away; its
        tip is 1 cm off then.
        """
        give = self.arm.hand.give
        return lambda: bool(np.abs(self.arm.finger_angles() - opening).max() > give)

    def holds(self) -> bool:
        """Return whether something is in the hand: the fingers have not opened, and without a weld they touch it from
        both sides.
        """
        body = self.arm.held
        # All fingers give way only if the hand opens: what stands near may push one of them.
        if body is None or (self.arm.finger_angles() < self._closed - self.arm.hand.give).all():
            return False
        if self.arm.welds or self._caught:
            return True
        for _ in range(LISTENING_STEPS):
            if both_sides(self.arm.touching(body)):
                return True
            self.driver.step()
        return False

    def place(self, plan: ObjectPlan, name: str, blocked: Callable[[], bool] | None = None) -> str:
        """Bring what is in the hand to its goal, release it and fold the arm.

        Args:
            plan: its plan.
            name: of the object.
            blocked: asked after every step on the way whether it cannot be put there any more; then it is put back
                where it was taken or, if it is slid, let go where it is.

        Returns:
            Why it is not there, `LOST` or `BLOCKED`; empty if it was in the hand to the end.
        """
        driver, grasp = self.driver, plan.grasp
        doing, speed = (f"slide {name}", SLIDING_SPEED) if grasp.slides else (f"transfer {name}", TRANSFER_SPEED)
        way = driver.follow(plan.transfer, doing, speed, blocked)
        if blocked is not None and blocked():
            return self._put_back(plan, name, way)
        if not self.holds():
            return self._lost()
        driver.follow(plan.lower, f"lower {name}", CARTESIAN_SPEED)
        driver.wait(0.15)
        held = self.holds()
        self._let_go(grasp.opening)
        driver.wait(0.25)
        driver.follow(plan.retreat, "retreat", CARTESIAN_SPEED)
        driver.follow(plan.fold, "fold")
        driver.open(self.arm.hand.open)
        driver.wait(SETTLE_SECONDS)
        return "" if held else LOST

    def _lost(self) -> str:
        self._let_go(self.arm.hand.open)
        fold(self.driver, self._scene)
        return LOST

    def _put_back(self, plan: ObjectPlan, name: str, way: np.ndarray) -> str:
        """Return along a way (T, n), release what is in the hand and fold the arm; return what became of it."""
        driver = self.driver
        if plan.grasp.slides:
            self._let_go(plan.grasp.opening)
            withdraw(driver)
        else:
            driver.follow(way[::-1], f"put {name} back")
            if not self.holds():
                return self._lost()
            driver.follow(plan.lift[::-1], f"lower {name}", CARTESIAN_SPEED)
            self._let_go(plan.grasp.opening)
            driver.follow(plan.approach[::-1], "retreat", CARTESIAN_SPEED)
        fold(driver, self._scene)
        return BLOCKED

    def _let_go(self, opening: float) -> None:
        self.driver.let_go(opening)
        self.object, self._name = None, ""

    def stop(self) -> Stopped:
        """Stop the arm, set down what is in the hand, and fold; after a second stop the arm stays where it is."""
        index, name, set_down = self.object, self._name, False
        if self.arm.held is None:  # it was just being let go
            index, name = None, ""
        try:
            self.driver.halt()
            if index is not None:
                height = float(self.arm.world_from_ee()[2, 3]) - self._above
                set_down_below(self.driver, height)
                set_down = True
            withdraw(self.driver)
            fold(self.driver, self._scene)
        except KeyboardInterrupt:
            self.driver.halt()
            return Stopped(index, name, set_down, False)
        return Stopped(index, name, set_down, True)
