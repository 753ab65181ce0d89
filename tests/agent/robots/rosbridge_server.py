"""A rosbridge server for tests: it speaks the protocol of version 2, ROS 1 and ROS 2, with a stand-in for an arm.

The stand-in integrates nothing but time: a joint is where its trajectory says, a finger goes at its speed and stops
`thing` before its angle when it closes beyond 0.5 rad, as on an object. It can be told to fail.
"""

from __future__ import annotations

import json
import math
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from socket import SHUT_RDWR
from typing import Any

import numpy as np
from websockets.exceptions import ConnectionClosed
from websockets.sync.server import ServerConnection, serve

from agent.robots.interfaces import CLOSED_RADIANS, CLOSED_TURNS, Interface

_STATUS = {1: {"done": 3, "canceled": 2, "refused": 5, "failed": 4}, 2: {"done": 4, "canceled": 5, "failed": 6}}


class StandInArm:
    """The joints of an arm that does what it is told, and the ways in which it does not.

    Attributes:
        positions: name -> rad now, as the driver reports them.
        moved: whether any goal has moved anything. goals, cancels, halts: how often each was asked for.
        fault: what goes wrong, one of the words below, or empty.
        thing: rad before their angles at which closing fingers stop.
        cancelled_at: when the first cancel arrived, s of its clock.
    """

    def __init__(self, names: Sequence[str], positions: Sequence[float], fingers: Sequence[str]) -> None:
        self.positions = dict(zip(names, map(float, positions), strict=True)) | dict.fromkeys(fingers, 0.2)
        self.names, self.fingers = tuple(names), tuple(fingers)
        self.moved, self.goals, self.cancels, self.halts = False, 0, 0, 0
        self.fault, self.thing = "", 0.15
        self.cancelled_at = math.nan
        self.accept = threading.Event()  # a result that is held back is given when this is set
        self._way: tuple[float, np.ndarray, np.ndarray, tuple[str, ...]] | None = None
        self._lock = threading.Lock()

    def now(self) -> float:
        """Return the time, s."""
        return time.monotonic()

    def sleep(self, seconds: float) -> None:
        """Return after `seconds`."""
        time.sleep(seconds)

    def begin(self, times: Sequence[float], positions: np.ndarray, names: Sequence[str]) -> float:
        """Begin to move; return how long it takes."""
        with self._lock:
            self.goals += 1
            if self.fault != "does not move":
                positions = self._led_astray(positions)
                self._way = (self.now(), np.array(times), positions, tuple(names))
        return float(times[-1])

    def _led_astray(self, positions: np.ndarray) -> np.ndarray:
        if self.fault != "goes elsewhere":
            return positions
        return positions + 0.6 * np.arange(len(positions))[:, None] / max(1, len(positions) - 1)

    def close_fingers(self, angles: Sequence[float]) -> float:
        """Begin to move the fingers; return how long it takes."""
        now = np.array([self.positions[name] for name in self.fingers])
        goal = np.array(angles)
        goal = np.where(goal > np.maximum(now + self.thing, 0.5), goal - self.thing, goal)
        seconds = max(0.05, float(np.abs(goal - now).max()))
        return self.begin((0.0, seconds), np.stack((now, goal)), self.fingers)

    def halt(self) -> None:
        """Stop where it is."""
        with self._lock:
            self._advance()
            self._way = None

    def ended(self, seconds: float, canceled: threading.Event) -> str:
        """Wait until a motion that takes `seconds` is over; return how it ended."""
        return "canceled" if canceled.wait(seconds + 0.05) else "done"

    def pause(self, socket: ServerConnection) -> None:
        """Wait until there is something to report again to the other end of a connection."""
        time.sleep(0.01)

    def report(self) -> dict[str, float]:
        """Return what the driver reports now."""
        with self._lock:
            self._advance()
            return dict(self.positions)

    def _advance(self) -> None:
        if self._way is None:
            return
        began, times, positions, names = self._way
        elapsed = self.now() - began
        for name, column in zip(names, positions.T, strict=True):
            value = float(np.interp(elapsed, times, column))
            self.moved |= abs(value - self.positions[name]) > 1e-4
            self.positions[name] = value


class RosbridgeServer:
    """The server; `fault` of its arm decides what goes wrong."""

    def __init__(self, interface: Interface, arm: StandInArm) -> None:
        self.interface, self.arm = interface, arm
        self._open = set[ServerConnection]()
        self._canceled = dict[str, threading.Event]()
        self._stamp = 0
        self.silent = threading.Event()  # no more joint states
        self.seen: list[Mapping[str, Any]] = []

    def serve(self, socket: ServerConnection) -> None:
        """Serve one connection."""
        self._open.add(socket)
        ended = threading.Event()
        try:
            for text in socket:
                message = json.loads(text)
                self.seen.append(message)
                threading.Thread(target=self._answer, args=(socket, message, ended), daemon=True).start()
        except ConnectionClosed:
            pass
        finally:
            ended.set()
            self._open.discard(socket)

    def drop(self) -> None:
        """Lose every connection."""
        for socket in list(self._open):
            with suppress(OSError):  # it is closed already
                socket.socket.shutdown(SHUT_RDWR)

    def _answer(self, socket: ServerConnection, message: Mapping[str, Any], ended: threading.Event) -> None:
        with suppress(ConnectionClosed, OSError):
            self._act(socket, message, ended)

    def _act(self, socket: ServerConnection, message: Mapping[str, Any], ended: threading.Event) -> None:
        op, topic = message["op"], message.get("topic", "")
        arm, interface = self.interface.arm, self.interface
        if op == "subscribe" and topic == interface.states[0]:
            while not ended.is_set():
                if not self.silent.is_set():
                    socket.send(json.dumps({"op": "publish", "topic": topic, "msg": self._state()}))
                self.arm.pause(socket)
        elif op == "subscribe" and topic.endswith("/status") and self.arm.fault != "no action server":
            while not ended.is_set():
                socket.send(json.dumps({"op": "publish", "topic": topic, "msg": {"status_list": []}}))
                time.sleep(0.2)
        elif op == "publish" and topic.endswith("/goal"):
            goal, key = message["msg"]["goal"], message["msg"]["goal_id"]["id"]
            self._carry_out(socket, topic.removesuffix("/goal") == arm.name, goal, key, topic.removesuffix("/goal"))
        elif op == "send_action_goal":
            self._carry_out(socket, message["action"] == arm.name, message["args"], message["id"], message["action"])
        elif op == "cancel_action_goal" or (op == "publish" and topic.endswith("/cancel")):
            self._cancel(message["id"] if op == "cancel_action_goal" else message["msg"]["id"])
        elif op == "call_service" and message["service"] == interface.halt:
            self.arm.halts += 1
            self.arm.halt()
            answer = {"op": "service_response", "id": message["id"], "service": message["service"], "result": True}
            socket.send(json.dumps(answer))

    def _cancel(self, key: str) -> None:
        self.arm.cancels += 1
        if math.isnan(self.arm.cancelled_at):
            self.arm.cancelled_at = self.arm.now()
        if self.arm.fault != "ignores cancel":
            self.arm.halt()
            self._canceled.setdefault(key, threading.Event()).set()

    def _carry_out(self, socket: ServerConnection, of_arm: bool, goal: Any, key: str, action: str) -> None:
        canceled = self._canceled.setdefault(key, threading.Event())
        fault = self.arm.fault
        if fault == "refuses":
            self.arm.goals += 1
            self._result(socket, key, action, "refused")
            return
        seconds = self._begin(of_arm, goal)
        if fault in ("does not move", "early"):
            self._result(socket, key, action, "done")
            return
        if fault == "loses the connection":
            self.arm.sleep(seconds / 4)
            self.drop()
            return
        if fault == "falls silent":
            self.arm.sleep(seconds / 4)
            self.silent.set()
        if fault == "late":  # its result comes when the test asks for it, and then for a goal that is over
            self.arm.accept.wait(60.0)
        ended = self.arm.ended(0.0 if fault == "late" else seconds, canceled)
        if fault == "fails" and ended == "done":
            ended = "failed"
        self._result(socket, key, action, ended)

    def _begin(self, of_arm: bool, goal: Mapping[str, Any]) -> float:
        if of_arm:
            way = goal["trajectory"]
            clock = ("secs", "nsecs") if self.interface.ros == 1 else ("sec", "nanosec")
            times = [
                each["time_from_start"][clock[0]] + 1e-9 * each["time_from_start"][clock[1]] for each in way["points"]
            ]
            return self.arm.begin(times, np.array([each["positions"] for each in way["points"]]), way["joint_names"])
        if self.interface.ros == 1:
            turns = [goal["fingers"][f"finger{k}"] for k in (1, 2, 3)]
            return self.arm.close_fingers([each * CLOSED_RADIANS / CLOSED_TURNS for each in turns])
        return self.arm.close_fingers([goal["command"]["position"]] * len(self.arm.fingers))

    def _result(self, socket: ServerConnection, key: str, action: str, ended: str) -> None:
        if self.interface.ros == 2 and ended == "refused":
            message = {"op": "action_result", "id": key, "action": action, "status": 0, "result": False}
            socket.send(json.dumps(message | {"values": "Action goal was rejected"}))
            return
        status = _STATUS[self.interface.ros][ended]
        if self.interface.ros == 2:
            message = {"op": "action_result", "id": key, "action": action, "status": status, "result": True}
            socket.send(json.dumps(message | {"values": {"error_code": 0, "error_string": ""}}))
            return
        content = {"status": {"goal_id": {"id": key}, "status": status, "text": ""}, "result": {}}
        socket.send(json.dumps({"op": "publish", "topic": f"{action}/result", "msg": content}))

    def _state(self) -> dict[str, Any]:
        angles = self.arm.report()
        if self.arm.fault == "degrees":
            angles = {name: math.degrees(angle) for name, angle in angles.items()}
        names = list(angles)
        if self.arm.fault == "other order":
            names.reverse()
        if self.arm.fault == "joint missing":
            names.remove(self.arm.names[1])
        values: list[float | None] = [angles[name] for name in names]
        if self.arm.fault in ("NaN", "null"):
            values[1] = math.nan if self.arm.fault == "NaN" else None
        if self.arm.fault != "frozen":
            self._stamp += 1
        clock = ("secs", "nsecs") if self.interface.ros == 1 else ("sec", "nanosec")
        return {"header": {"stamp": {clock[0]: self._stamp, clock[1]: 1}}, "name": names, "position": values}


@contextmanager
def running(interface: Interface, arm: StandInArm, port: int = 0) -> Iterator[tuple[RosbridgeServer, str]]:
    """Run a server while the `with` block lasts; yield it and its address."""
    server = RosbridgeServer(interface, arm)
    with ExitStack() as ends:
        listening = ends.enter_context(serve(server.serve, "127.0.0.1", port, close_timeout=0.1, ping_interval=None))
        threading.Thread(target=listening.serve_forever, daemon=True).start()
        ends.pop_all()  # its own end may wait for ever
        try:
            yield server, f"ws://127.0.0.1:{listening.socket.getsockname()[1]}"
        finally:
            server.drop()
            ending = threading.Thread(target=listening.shutdown, daemon=True)
            ending.start()
            ending.join(5.0)
