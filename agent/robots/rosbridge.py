"""Reach an arm through a rosbridge server."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping
from typing import Any

from agent.errors import RobotRefused
from agent.robots.actions import BridgeActions, TopicActions
from agent.robots.connection import Connection, check_installed, number
from agent.robots.interfaces import Interface
from agent.robots.link import JointState, Outcome
from agent.robots.trajectory import Grip, Trajectory

READY_SECONDS = 3.0  # in which the action servers have to report
AGAIN_SECONDS = 1.0  # in which a lost connection is opened again, for the stop alone
TOLD_SECONDS = 0.5  # for which a stop is repeated on a new connection: its first message may find no subscriber yet


class RosbridgeLink:
    """A way to the arm behind a rosbridge server.

    Args:
        address: "ws://HOST:PORT".
        interface: of the arm's driver.
        names: the joints of the arm, from the base on, as its driver names them.
        clock: tells the time by which the arm is watched, s; it never goes back.
    """

    def __init__(
        self,
        address: str,
        interface: Interface,
        names: tuple[str, ...],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        check_installed()
        self._interface, self._names, self._clock = interface, names, clock
        self._connection = Connection(address, self._on_message)
        both = (interface.arm, interface.hand)
        self._actions = TopicActions(self._connection, both) if interface.ros == 1 else BridgeActions(self._connection)
        self._state, self._stamps = JointState(), dict[tuple[str, ...], object]()
        self._complaint, self._lost = "", ""
        self._halted = threading.Event()

    def connect(self) -> None:
        """See `Link`."""
        self._connection.open()
        self._subscribe()
        end = self.now() + READY_SECONDS
        while self._actions.missing() and self.now() < end and not self._connection.lost:
            self.wait(0.1)
        if missing := self._actions.missing():
            why = f" ({self._complaint})" if self._complaint else ""
            raise RobotRefused(
                f"no server of the action {missing[0]} reports at {self._connection.address} in {READY_SECONDS:g} s"
                f"{why}"
            )

    def _subscribe(self) -> None:
        topic, kind = self._interface.states
        self._connection.send({"op": "subscribe", "topic": topic, "type": kind, "queue_length": 1})
        self._actions.announce()

    def state(self) -> JointState:
        """See `Link`."""
        return self._state

    def send(self, motion: Trajectory | Grip) -> None:
        """See `Link`."""
        if isinstance(motion, Grip):
            self._actions.send(self._interface.hand, self._interface.hand_goal(motion))
        else:
            self._actions.send(self._interface.arm, self._interface.arm_goal(self._names, motion))

    def outcome(self) -> Outcome | None:
        """See `Link`."""
        return self._actions.outcome

    def cancel(self) -> str:
        """See `Link`. A lost connection is opened once more, for this alone."""
        if self._actions.cancel():
            return ""
        self._lost = self._connection.lost
        try:
            self._connection.open(AGAIN_SECONDS)
        except RobotRefused:
            return "the stop could not be sent"
        self._subscribe()
        end = self.now() + TOLD_SECONDS
        while self.now() < end and self._actions.cancel() and self._actions.outcome is None:
            time.sleep(0.05)
        return "the stop was sent over a new connection"

    def halt(self) -> str:
        """See `Link`."""
        service = self._interface.halt
        self._halted.clear()
        if not service or not self._connection.send(
            {"op": "call_service", "id": "halt", "service": service, "args": {}}
        ):
            return ""
        self._halted.wait(0.5)
        answered = "" if self._halted.is_set() else ", which did not answer,"
        return f"the service {service} was called{answered} ({self._interface.after_halt})"

    def trouble(self) -> str:
        """See `Link`."""
        return self._lost or self._connection.lost

    def now(self) -> float:
        """See `Link`."""
        return self._clock()

    def wait(self, seconds: float) -> None:
        """See `Link`."""
        self._connection.wait(seconds)

    def close(self) -> None:
        """See `Link`."""
        self._connection.close()

    def _on_message(self, message: Mapping[str, Any]) -> None:
        op = message.get("op")
        if op == "publish" and message.get("topic") == self._interface.states[0]:
            self._take_state(message.get("msg"))
        elif op == "service_response" and message.get("id") == "halt":
            if message.get("result") is True:
                self._halted.set()
        elif op == "status" and message.get("level") == "error":
            self._complaint = " ".join(str(message.get("msg")).split())[:200]
        self._actions.on_message(message)

    def _take_state(self, message: object) -> None:
        """Take a JointState, which may tell of some joints only; one with the stamp of the last is no news."""
        if not isinstance(message, dict):
            return
        names, positions = message.get("name"), message.get("position")
        if not isinstance(names, list) or not isinstance(positions, list):
            return
        if len(names) != len(positions):  # whose they are is not known
            positions = [None] * len(names)
        names, header = tuple(map(str, names)), message.get("header")
        stamp = header.get("stamp") if isinstance(header, dict) else None
        if isinstance(stamp, dict) and any(stamp.values()) and self._stamps.get(names) == stamp:
            return
        self._stamps[names] = stamp
        now, angles = self.now(), map(number, positions)
        self._state = JointState(
            {**self._state.angles, **dict(zip(names, angles, strict=True))},
            {**self._state.times, **dict.fromkeys(names, now)},
        )
