"""Move an arm under watch: nothing without approval or beyond limits, and a stop at whatever is not as planned."""

from __future__ import annotations

from collections.abc import Callable
from types import TracebackType
from typing import Self

import numpy as np

from agent.arm.jaco_hand import FINGER_SPEED
from agent.errors import RobotRefused, RobotStopped
from agent.robots.limits import JointLimits, Workspace
from agent.robots.link import CANCELED, REFUSED, SUCCEEDED, JointState, Link, Outcome
from agent.robots.trajectory import Grip, Trajectory
from agent.robots.watch import Tolerances, path_trouble, rest_trouble, stale_trouble

TICK = 0.02  # s between two looks at the state, at most
FIRST_STATE_SECONDS = 3.0
STILL_SECONDS = 0.2  # for which an arm has to stand still to count as stopped
RESTING_SECONDS = 0.1  # after a result, in which nothing may move any more
FINGER_SECONDS = 5.0  # that the fingers may take beyond the way at their speed


class Robot:
    """An arm. Use it in a `with` block, which disconnects.

    Args:
        link: the way to it.
        limits: its joints.
        workspace: where its hand may be; `None` for anywhere within its joints' ranges.
        tolerances: what is still taken for as planned.
    """

    def __init__(
        self,
        link: Link,
        limits: JointLimits,
        workspace: Workspace | None = None,
        tolerances: Tolerances = Tolerances(),
    ) -> None:
        self._link, self.limits, self._workspace, self._tolerances = link, limits, workspace, tolerances
        self._approved = False

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._approved = False
        self._link.close()

    def connect(self) -> None:
        """Connect, and wait for the first joint state.

        Raises:
            RobotRefused: if the arm cannot be reached, or does not report all of its joints as finite numbers.
        """
        self._link.connect()
        end = self._link.now() + FIRST_STATE_SECONDS
        needed = (*self.limits.names, *self.limits.fingers)
        while self._link.now() < end and not set(needed) <= set(self._link.state().angles):
            self._link.wait(TICK)
        if not self._link.state().angles:
            raise RobotRefused(self._link.trouble() or f"the arm reported no joint state in {FIRST_STATE_SECONDS:g} s")
        self._link.state().of(needed)

    def state(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the angles of the joints (n,) and of the fingers (m,) now, rad.

        Raises:
            RobotRefused: if they are not known: lost connection, no fresh state, a missing joint, or no number.
        """
        problem = self._link.trouble() or self._stale(self._link.state())
        if problem:
            raise RobotRefused(problem)
        state = self._link.state()
        return state.of(self.limits.names), state.of(self.limits.fingers)

    def check(self, trajectory: Trajectory) -> None:
        """Check a motion against the limits and the workspace.

        Raises:
            RobotRefused: if it leaves them.
        """
        self.limits.check(trajectory)
        if self._workspace is not None:
            self._workspace.check(trajectory)

    def check_rest(self, planned: np.ndarray) -> None:
        """Check that the arm stands as planned (n,).

        Raises:
            RobotRefused: if it does not; names the joint, its value and the planned one.
        """
        problem = rest_trouble(self.state()[0], planned, self.limits, self._tolerances.at_rest)
        if problem:
            raise RobotRefused(f"the arm is not where the motion begins: {problem}")

    def approve(self) -> None:
        """Allow motions until the next stop. Call it only when a person has agreed to the motions that follow."""
        self._approved = True

    def follow(self, trajectory: Trajectory) -> None:
        """Carry out a motion of the joints, watched by their states; return when the arm has arrived.

        Raises:
            RobotRefused: if nothing was moved: not approved, beyond limits, or the arm is not where the motion begins.
            RobotStopped: if the arm was stopped on the way.
        """
        self._check_approval()
        self.check(trajectory)
        self.check_rest(trajectory.start)
        turns = 2 * np.pi * np.round((self.state()[0] - trajectory.start) / (2 * np.pi))
        trajectory = trajectory.turned(np.where(self.limits.continuous, turns, 0.0))
        names, tolerances = self.limits.names, self._tolerances

        def on_the_way(state: JointState, elapsed: float) -> str:
            return path_trouble(state.of(names), elapsed, trajectory, self.limits, tolerances)

        def in_the_end(state: JointState) -> str:
            return rest_trouble(state.of(names), trajectory.goal, self.limits, tolerances.at_rest)

        seconds = 2 * trajectory.duration + tolerances.late
        self._carry_out(trajectory, seconds, on_the_way, in_the_end, (SUCCEEDED,))

    def grip(self, grip: Grip) -> np.ndarray:
        """Drive the fingers to angles, or until something stops them; return where they are (m,), rad.

        Fingers that open have to arrive; those that close may be stopped by what they grip, but have to move.

        Raises:
            RobotRefused: if nothing was moved.
            RobotStopped: if the arm was stopped: it moved, or the fingers did not.
        """
        self._check_approval()
        joints, fingers = self.state()
        limits, tolerances = self.limits, self._tolerances
        way = grip.angles - fingers

        def on_the_way(state: JointState, elapsed: float) -> str:
            problem = rest_trouble(state.of(limits.names), joints, limits, tolerances.at_rest)
            return f"the arm moved with the fingers: {problem}" if problem else ""

        def in_the_end(state: JointState) -> str:
            now = state.of(limits.fingers)
            away, far = np.abs(now - grip.angles), way > tolerances.finger
            opened = (away[way < 0.0] <= tolerances.finger).all()
            closed = not far.any() or (now - fingers)[far].max() > tolerances.finger / 2
            if opened and closed:
                return ""
            worst = int(np.where(opened, away, np.where(way < 0.0, away, 0.0)).argmax())
            return f"{limits.fingers[worst]} is at {now[worst]:.3f} rad, asked for: {grip.angles[worst]:.3f} rad"

        seconds = 2 * float(np.abs(way).max()) / FINGER_SPEED + FINGER_SECONDS
        # What meets resistance ends as "canceled" in kinova-ros.
        self._carry_out(grip, seconds, on_the_way, in_the_end, (SUCCEEDED, CANCELED))
        return self.state()[1]

    def stop(self) -> str:
        """Stop the arm, and forbid all motions until they are approved again; return what is known of it, in words.

        The cancel is sent before anything else. Where the driver does not answer it, or the arm goes on, a stronger
        stop follows.
        """
        self._approved = False
        failed = self._link.cancel()
        still = self._stands_still(answered=True)
        if still and self._link.outcome() is not None:
            return "the arm stands still"
        told = failed or "the driver did not answer the stop"
        if self._link.outcome() is not None:
            stale = self._stale(self._link.state())
            told = "the driver has ended the motion" if stale else "the arm went on after the stop"
        done = self._link.halt()
        if done:
            told, still = f"{told}; {done}", self._stands_still(answered=False)
        if still:
            return f"{told}; the arm stands still"
        return f"{told}; IT IS NOT KNOWN WHETHER THE ARM STANDS STILL: look at it, and use its emergency stop"

    def _stands_still(self, answered: bool) -> bool:
        """Wait until the arm stands still and, if wanted, its driver has ended the motion; return whether it stands."""
        link, names = self._link, self.limits.names
        end = link.now() + self._tolerances.stopping
        since, place = link.now(), None
        still = False
        while link.now() < end and not (still and (not answered or link.outcome() is not None)):
            link.wait(TICK)
            state = link.state()
            try:
                joints = state.of(names)
            except RobotRefused:
                return False
            if self._stale(state) or place is None or np.abs(joints - place).max() > self._tolerances.still:
                since, place = link.now(), joints
            still = state.since(names) - since >= STILL_SECONDS
        return still

    def _stale(self, state: JointState) -> str:
        return stale_trouble(state, self.limits, self._link.now(), self._tolerances)

    def _check_approval(self) -> None:
        if not self._approved:
            raise RobotRefused("nothing moves before a person has approved it; after a stop, anew")

    def _carry_out(
        self,
        motion: Trajectory | Grip,
        seconds: float,
        on_the_way: Callable[[JointState, float], str],
        in_the_end: Callable[[JointState], str],
        good: tuple[str, ...],
    ) -> None:
        """Ask for a motion and watch it to its end; stop at whatever is not as planned, an interruption included."""
        try:
            problem = self._watched(motion, seconds, on_the_way, in_the_end, good)
        except BaseException as error:  # Ctrl-C and signals too: whatever ends the watching ends the motion
            told = self.stop()
            if isinstance(error, RobotRefused):
                raise RobotStopped(f"{motion.purpose}: stopped, because {error}; {told}") from error
            error.add_note(told)
            raise
        if problem:
            raise RobotStopped(f"{motion.purpose}: stopped, because {problem}; {self.stop()}")

    def _watched(
        self,
        motion: Trajectory | Grip,
        seconds: float,
        on_the_way: Callable[[JointState, float], str],
        in_the_end: Callable[[JointState], str],
        good: tuple[str, ...],
    ) -> str:
        """Return why a motion has to be stopped; empty once it has ended where it should."""
        link = self._link
        began = link.now()
        link.send(motion)
        while (outcome := link.outcome()) is None:
            now, state = link.now(), link.state()
            problem = link.trouble() or self._stale(state) or on_the_way(state, now - began)
            if problem:
                return problem
            if now - began > seconds:
                return f"no result came in {seconds:.1f} s"
            link.wait(TICK)
        if outcome.kind not in good:
            return _told(outcome)
        names = (*self.limits.names, *self.limits.fingers)
        ended = since = link.now()
        place = link.state().of(names)
        while True:
            now, state = link.now(), link.state()
            problem = link.trouble() or self._stale(state)
            if problem:
                return problem
            angles = state.of(names)
            if np.abs(angles - place).max() > self._tolerances.still:
                since, place = now, angles
            problem = in_the_end(state)
            if not problem and state.since(names) - since > RESTING_SECONDS:
                return ""
            if now - ended > self._tolerances.settle:
                return f"the driver reports {outcome.kind!r}, but {problem or 'the arm or its fingers still move'}"
            link.wait(TICK)


def _told(outcome: Outcome) -> str:
    what = "refused the motion" if outcome.kind == REFUSED else f"ended the motion as {outcome.kind!r}"
    return f"the driver {what}" + (f" ({outcome.detail})" if outcome.detail else "")
