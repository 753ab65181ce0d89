"""What belongs to another goal is left out, and only what the driver says counts as the end of one."""

import pytest

from agent.robots.actions import BridgeActions, TopicActions
from agent.robots.interfaces import KinovaRos, Ros2Kortex
from agent.robots.link import CANCELED, FAILED, REFUSED, SUCCEEDED

KINOVA, KORTEX = KinovaRos("left"), Ros2Kortex()


class Sent(list):
    """A connection that keeps what is sent."""

    def send(self, message):
        self.append(message)
        return True


def topic_result(sent, status, key=None, result=None, topic=None):
    of = {"goal_id": {"id": sent[-1]["msg"]["goal_id"]["id"] if key is None else key}, "status": status, "text": "said"}
    message = {"op": "publish", "topic": topic or f"{KINOVA.arm.name}/result"}
    return message | {"msg": {"status": of, "result": result or {}}}


@pytest.mark.parametrize(
    ("status", "kind"), ((2, CANCELED), (3, SUCCEEDED), (4, FAILED), (5, REFUSED), (8, CANCELED), (9, FAILED))
)
def test_the_results_of_actionlib(status, kind):
    sent = Sent()
    actions = TopicActions(sent, (KINOVA.arm, KINOVA.hand))
    actions.send(KINOVA.arm, {})
    actions.on_message(topic_result(sent, status))
    assert (actions.outcome.kind, actions.outcome.detail) == (kind, "said")


def test_the_results_of_other_goals_and_topics_are_left_out():
    sent = Sent()
    actions = TopicActions(sent, (KINOVA.arm, KINOVA.hand))
    actions.send(KINOVA.arm, {})
    late = topic_result(sent, 3)
    actions.send(KINOVA.arm, {})
    for message in (
        late,
        topic_result(sent, 3, topic=f"{KINOVA.hand.name}/result"),
        topic_result(sent, 1),
        topic_result(sent, "3"),
        {"op": "publish", "topic": f"{KINOVA.arm.name}/result", "msg": None},
        {"op": "publish", "topic": f"{KINOVA.arm.name}/result", "msg": {"status": [], "result": 1}},
        {"op": 3},
    ):
        actions.on_message(message)
        assert actions.outcome is None
    actions.on_message(topic_result(sent, 3))
    assert actions.outcome.kind == SUCCEEDED


def test_a_cancel_names_the_goal():
    sent = Sent()
    actions = TopicActions(sent, (KINOVA.arm, KINOVA.hand))
    assert actions.cancel() and not sent  # there is nothing to cancel
    actions.send(KINOVA.hand, {})
    goal = sent[-1]["msg"]["goal_id"]
    actions.cancel()
    assert sent[-1] == {"op": "publish", "topic": f"{KINOVA.hand.name}/cancel", "msg": goal} and goal["id"]


@pytest.mark.parametrize(
    ("message", "kind"),
    (
        ({"op": "action_result", "status": 4, "result": True, "values": {"error_code": 0}}, SUCCEEDED),
        ({"op": "action_result", "status": 4, "result": True, "values": {"error_code": -4}}, FAILED),
        ({"op": "action_result", "status": 5, "result": True, "values": {}}, CANCELED),
        ({"op": "action_result", "status": 6, "result": True, "values": {}}, FAILED),
        ({"op": "action_result", "status": 4, "result": False, "values": "No action server available"}, REFUSED),
        ({"op": "action_result", "status": 4, "result": "true", "values": {}}, REFUSED),
        ({"op": "action_result", "status": 77, "result": True, "values": {}}, FAILED),
        ({"op": "status", "level": "error", "msg": "no such type"}, REFUSED),
        ({"op": "status", "level": "warning", "msg": "slow"}, None),
        ({"op": "action_feedback", "values": {}}, None),
    ),
)
def test_the_results_of_rosbridge(message, kind):
    sent = Sent()
    actions = BridgeActions(sent)
    actions.send(KORTEX.arm, {})
    first = sent[-1]["id"]
    actions.send(KORTEX.arm, {})
    actions.on_message(message | {"id": first})  # of an earlier goal
    assert actions.outcome is None
    actions.on_message(message | {"id": sent[-1]["id"]})
    assert (actions.outcome and actions.outcome.kind) == kind
    actions.cancel()
    assert sent[-1] == {"op": "cancel_action_goal", "id": sent[-2]["id"], "action": KORTEX.arm.name}
