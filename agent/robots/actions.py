"""Ask for the goals of ROS actions through rosbridge: by the topics of actionlib (ROS 1), or by its own ops (ROS 2)."""

from __future__ import annotations

import secrets
from collections.abc import Mapping
from typing import Any, Protocol

from agent.robots.connection import Connection
from agent.robots.interfaces import ActionName
from agent.robots.link import CANCELED, FAILED, REFUSED, SUCCEEDED, Outcome

# actionlib_msgs/GoalStatus and action_msgs/msg/GoalStatus: what ends a goal.
_ENDS_1 = {2: CANCELED, 3: SUCCEEDED, 4: FAILED, 5: REFUSED, 8: CANCELED, 9: FAILED}
_ENDS_2 = {4: SUCCEEDED, 5: CANCELED, 6: FAILED}


class Actions(Protocol):
    """The goals of one arm, one at a time; what belongs to an earlier goal is left out."""

    outcome: Outcome | None

    def announce(self) -> None:
        """Tell the server what will be published and is waited for."""

    def send(self, action: ActionName, goal: Mapping[str, Any]) -> None:
        """Ask for a goal."""

    def cancel(self) -> bool:
        """Cancel the last goal; return whether that was possible."""

    def on_message(self, message: Mapping[str, Any]) -> None:
        """Take what arrives."""


class TopicActions:
    """Actions of ROS 1."""

    def __init__(self, connection: Connection, actions: tuple[ActionName, ...]) -> None:
        self._connection, self._actions = connection, actions
        self._running: ActionName | None = None
        self._id = ""
        self.outcome: Outcome | None = None
        self.ready = set[str]()  # the actions whose server has reported its status

    def announce(self) -> None:
        """See `Actions`."""
        for action in self._actions:
            for end, kind in (("goal", f"{action.type}ActionGoal"), ("cancel", "actionlib_msgs/GoalID")):
                self._connection.send({"op": "advertise", "topic": f"{action.name}/{end}", "type": kind})
            for end, kind in (
                ("result", f"{action.type}ActionResult"),
                ("status", "actionlib_msgs/GoalStatusArray"),
            ):
                self._connection.send({"op": "subscribe", "topic": f"{action.name}/{end}", "type": kind})

    def missing(self) -> list[str]:
        """Return the names of the actions whose server has not reported its status yet."""
        return [action.name for action in self._actions if action.name not in self.ready]

    def send(self, action: ActionName, goal: Mapping[str, Any]) -> None:
        """See `Actions`."""
        self._running, self._id, self.outcome = action, f"structagent-{secrets.token_hex(8)}", None
        message = {"goal_id": self._goal_id(), "goal": goal}
        self._connection.send({"op": "publish", "topic": f"{action.name}/goal", "msg": message})

    def cancel(self) -> bool:
        """See `Actions`."""
        return self._running is None or self._connection.send(
            {"op": "publish", "topic": f"{self._running.name}/cancel", "msg": self._goal_id()}
        )

    def _goal_id(self) -> dict[str, Any]:
        return {"stamp": {"secs": 0, "nsecs": 0}, "id": self._id}

    def on_message(self, message: Mapping[str, Any]) -> None:
        """See `Actions`."""
        if message.get("op") != "publish":
            return
        topic, content = message.get("topic"), message.get("msg")
        self.ready |= {action.name for action in self._actions if topic == f"{action.name}/status"}
        if self._running is None or topic != f"{self._running.name}/result" or not isinstance(content, dict):
            return
        status = _dict(content.get("status"))
        if _dict(status.get("goal_id")).get("id") == self._id and status.get("status") in _ENDS_1:
            kind = _ENDS_1[status["status"]]
            self.outcome = _outcome(kind, str(status.get("text") or ""), _dict(content.get("result")))


class BridgeActions:
    """Actions of ROS 2."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._running: ActionName | None = None
        self._id = ""
        self.outcome: Outcome | None = None

    def announce(self) -> None:
        """See `Actions`; there is nothing to tell."""

    def missing(self) -> list[str]:
        """Return none: a server that is missing is told when a goal is sent."""
        return []

    def send(self, action: ActionName, goal: Mapping[str, Any]) -> None:
        """See `Actions`."""
        self._running, self._id, self.outcome = action, f"structagent-{secrets.token_hex(8)}", None
        self._connection.send(
            {
                "op": "send_action_goal",
                "id": self._id,
                "action": action.name,
                "action_type": action.type,
                "args": goal,
                "feedback": False,
            }
        )

    def cancel(self) -> bool:
        """See `Actions`."""
        return self._running is None or self._connection.send(
            {"op": "cancel_action_goal", "id": self._id, "action": self._running.name}
        )

    def on_message(self, message: Mapping[str, Any]) -> None:
        """See `Actions`."""
        if message.get("id") != self._id or self._running is None:
            return
        values = message.get("values")
        if message.get("op") == "status" and message.get("level") == "error":
            self.outcome = Outcome(REFUSED, str(message.get("msg") or ""))
        elif message.get("op") != "action_result":
            return
        elif message.get("result") is not True:
            self.outcome = Outcome(REFUSED, values if isinstance(values, str) else "")
        else:
            self.outcome = _outcome(_ENDS_2.get(message.get("status") or 0, FAILED), "", _dict(values))


def _dict(value: object) -> Mapping[str, Any]:
    return value if isinstance(value, dict) else {}


def _outcome(kind: str, text: str, result: Mapping[str, Any]) -> Outcome:
    """Return an outcome; a trajectory with an error code has not succeeded, whatever its status."""
    code = result.get("error_code", 0)
    said = "; ".join(filter(None, (text, str(result.get("error_string") or ""))))
    if code and kind == SUCCEEDED:
        return Outcome(FAILED, said or f"error code {code}")
    return Outcome(kind, said)
