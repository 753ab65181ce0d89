"""An arm in physics behind the rosbridge server: time passes for it as fast as it is computed, within limits."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import numpy as np
from websockets.sync.server import ServerConnection

from agent.arm.simulated_arm import SimulatedArm
from agent.robots.link import CANCELED, SUCCEEDED
from agent.robots.simulation import SimulatedLink
from agent.robots.trajectory import Grip, Trajectory
from structdiffusion.simulation.world import TabletopWorld
from tests.agent.robots.rosbridge_server import StandInArm

STEP = 0.05  # s of physics between two states
TOLD_SECONDS = 0.5  # of a clock on the wall that physics waits for a state to arrive
# Of the wall's clock, at most: what the two ends of a connection take to answer each other counts by this clock too.
PACE = 1.5
MOVES = 0.01  # rad/s: a joint that turns faster moves


class PhysicsArm(StandInArm):
    """The arm of a table in physics, and the clock of its physics. A goal that comes while another lasts replaces it.

    Args:
        world, arm: the table and the arm on it.
        names, fingers: the joints as its driver names them, in the order of the model.

    Attributes:
        go: time passes while this is set.
        last_motion: s of its clock at which a joint moved last.
    """

    def __init__(self, world: TabletopWorld, arm: SimulatedArm, names: Sequence[str], fingers: Sequence[str]) -> None:
        super().__init__(names, arm.configuration(), fingers)
        self._link = SimulatedLink(world, arm)
        self._told, self._stepped = threading.Event(), threading.Event()
        self.go, self._over = threading.Event(), threading.Event()
        self.go.set()
        self.last_motion = -math.inf
        self._read()

    def now(self) -> float:
        """Return the time of its physics, s."""
        return self._link.now()

    def sleep(self, seconds: float) -> None:
        """Return after `seconds` of that time."""
        end = self.now() + seconds
        while self.now() < end and not self._over.is_set():
            self._stepped.wait(TOLD_SECONDS)

    def begin(self, times: Sequence[float], positions: np.ndarray, names: Sequence[str]) -> float:
        """Begin to move; return how long it takes."""
        order = [list(names).index(name) for name in self.names]
        with self._lock:
            self.goals += 1
            if self.fault != "does not move":
                self._link.send(Trajectory("", np.array(times), self._led_astray(positions[:, order])))
        return float(times[-1])

    def close_fingers(self, angles: Sequence[float]) -> float:
        """Begin to move the fingers; return 0, because what stops them is not known."""
        with self._lock:
            self.goals += 1
            if self.fault != "does not move":
                self._link.send(Grip("", np.array(angles)))
        return 0.0

    def ended(self, seconds: float, canceled: threading.Event) -> str:
        """Wait until the motion is over; return how it ended."""
        while not canceled.is_set() and not self._over.is_set():
            outcome = self._link.outcome()
            if outcome is not None:
                return {SUCCEEDED: "done", CANCELED: "canceled"}[outcome.kind]
            self._stepped.wait(TOLD_SECONDS)
        return "canceled"

    def halt(self) -> None:
        """Stop where it is."""
        with self._lock:
            self._link.cancel()

    def pause(self, socket: ServerConnection) -> None:
        """Let physics go on once the last state has arrived, and wait until it has made a step."""
        socket.ping().wait(TOLD_SECONDS)
        self._stepped.clear()
        self._told.set()
        self._stepped.wait(TOLD_SECONDS)

    def report(self) -> dict[str, float]:
        """Return what the driver reports now."""
        return dict(self.positions)

    def _read(self) -> None:
        self.positions = dict(zip((*self.names, *self.fingers), self._link.state().angles.values(), strict=True))

    def _run(self) -> None:
        while not self._over.is_set():
            if not self.go.wait(TOLD_SECONDS):
                continue
            began = time.monotonic()
            with self._lock:
                before = np.array([self.positions[name] for name in self.names])
                self._link.wait(STEP)
                self._read()
                speeds = np.abs(np.array([self.positions[name] for name in self.names]) - before) / STEP
                if speeds.max() > MOVES:
                    self.moved, self.last_motion = True, self.now()
            self._stepped.set()
            self._told.wait(TOLD_SECONDS)
            self._told.clear()
            time.sleep(max(0.0, STEP / PACE - (time.monotonic() - began)))

    @contextmanager
    def passing(self) -> Iterator[None]:
        """Let time pass while the `with` block lasts."""
        thread = threading.Thread(target=self._run, daemon=True)
        thread.start()
        try:
            yield
        finally:
            self._over.set()
            thread.join()
