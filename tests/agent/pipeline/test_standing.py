"""What falls after it was placed is said at once, and counts as not standing in every record of a run."""

import io
import math

import numpy as np
import pytest
from rich.console import Console

from agent import events
from agent.arm.events import Picked, Placed, Planned, StandingChanged
from agent.chat.view import ChatScreen
from agent.errors import ExecutionFailed
from agent.pipeline.building import build_with_arm
from agent.pipeline.event_builders import perceived_event
from agent.reporting.event_schema import payload_error
from agent.reporting.event_text import arm_sentence
from agent.reporting.html.document import run_page
from agent.reporting.run_report import RunRecord
from agent.reporting.terminal_report import TerminalReport
from agent.scenes.table_scene import TableScene
from grounding.spec import StructureSpec
from structdiffusion.geometry import pose_from_xyz_rpy, pose_from_xyz_yaw
from structdiffusion.objects.procedural import procedural_object
from structdiffusion.observation import Arrangement

BLOCKS = [procedural_object("can", 2), procedural_object("bottle", 1)]
START = np.array([pose_from_xyz_yaw(0.4, y, 0.0, 0.0) for y in (-0.25, -0.05)])
GOALS = np.array([pose_from_xyz_yaw(0.55, y, 0.0, 0.0) for y in (0.0, 0.2)])


def built(disturb):
    """Build a line of two blocks; `disturb(table, event, placed)` may move things. Return the events, and the error."""
    happened: list = []
    with TableScene(BLOCKS, START, 2, np.random.default_rng(0)) as table:
        table.arm.hold_by("weld")
        scene = table.look()
        happened += [events.Started("line up the blocks", {}), perceived_event(scene, 0.1, table)]
        work = build_with_arm(
            table, scene, StructureSpec("line"), [Arrangement(GOALS @ np.linalg.inv(START))], 0, film=False
        )
        placed: list[str] = []
        try:
            for event in work:
                happened.append(event)
                if isinstance(event, Placed):
                    placed.append(event.name)
                disturb(table, event, placed)
        except ExecutionFailed as error:
            happened.append(events.Failed("check", str(error), 5))
            return happened, str(error)
    return happened, ""


def topple_the_first(table, event, placed):
    """Lay the first block on its side while the second is in the hand."""
    if isinstance(event, Picked) and len(placed) == 1:
        index = table.names.index(placed[0])
        goal = GOALS[index].copy()
        lying = pose_from_xyz_rpy((goal[0, 3], goal[1, 3], 0.04), (math.pi / 2, 0.0, 0.0))
        table.world.set_pose(index, lying)


@pytest.fixture(scope="module")
def toppled():
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("agent.arm.work_left.MOST_PLACEMENTS", 1)  # so that the hand does not mend what is felled
        return built(topple_the_first)


def test_what_is_felled_by_another_placement_is_said_at_once_and_by_name(toppled):
    happened, error = toppled
    placed = [event for event in happened if isinstance(event, Placed)]
    (fell,) = [event for event in happened if isinstance(event, StandingChanged)]
    assert not fell.stands and fell.name == placed[0].name and "degrees off" in fell.trouble
    assert fell.during == f"{placed[1].name} was placed"
    assert [event.trouble for event in placed] == ["", ""]
    later = [event for event in happened[happened.index(fell) :] if isinstance(event, events.Pictured | events.Checked)]
    assert later and happened.index(placed[1]) < happened.index(fell)
    assert payload_error(fell.to_dict()) is None and payload_error(placed[0].to_dict()) is None
    assert error.endswith(f"1 of 2 objects stand as placed: {fell.name} {fell.trouble} since {fell.during}")


def test_no_record_contradicts_the_verdict(toppled):
    happened, _ = toppled
    fell = next(event for event in happened if isinstance(event, StandingChanged))
    record, texts = RunRecord(), [io.StringIO(), io.StringIO()]
    screens = [TerminalReport(Console(file=texts[0], width=200)), ChatScreen(Console(file=texts[1], width=200))]
    for event in happened:
        for listener in (record, *screens):
            listener.on_event(event)
    verdict = record.report["verdict"]
    counted = next(check for check in verdict["checks"] if check["name"] == "objects that stand as placed")
    assert not verdict["success"] and counted == counted | {"passed": False, "measured": 1, "limit": "2"}
    said = f"{fell.name} no longer stands: it {fell.trouble} since {fell.during}"
    for text in (*(each.getvalue() for each in texts), run_page(record.turn)):
        assert said in text and "1 of 2 objects stand as placed" in text
        assert "2 of 2 objects" not in text and "stands as asked." not in text
    assert [one["kind"] for one in record.report["arm"]].count("standing_changed") == 1


def test_what_does_not_stand_when_it_is_released_is_not_called_placed(toppled):
    happened, _ = toppled
    placed = next(event for event in happened if isinstance(event, Placed))
    payload = placed.to_dict() | {"trouble": "lies 90 degrees off", "position_error_m": 0.0}
    text = io.StringIO()
    TerminalReport(Console(file=text, width=200)).on_event(_Told(payload))
    assert f"released {placed.name}, but it does not stand: it lies 90 degrees off" in text.getvalue()
    assert "0.0 cm" not in text.getvalue() and "placed" not in text.getvalue()


def test_what_was_pushed_and_is_placed_again_says_why():
    def push(table, event, placed):
        if isinstance(event, Placed) and len(placed) == 2:
            index = table.names.index(placed[0])
            table.world.set_pose(index, pose_from_xyz_yaw(0.4, 0.3, 0.0, 0.0))

    happened, error = built(push)
    placed = [event for event in happened if isinstance(event, Placed)]
    assert error == "" and [event.name for event in placed] == [placed[0].name, placed[1].name, placed[0].name]
    assert [event.again for event in placed[:2]] == ["", ""]
    assert placed[2].again.startswith("stood ") and placed[2].again.endswith(" cm from its goal")
    changed = [event for event in happened if isinstance(event, StandingChanged)]
    assert [event.stands for event in changed] == [False] and happened.index(changed[0]) < happened.index(placed[2])
    assert next(event for event in happened if isinstance(event, events.Checked)).success
    text = io.StringIO()
    TerminalReport(Console(file=text, width=200)).on_event(placed[2])
    assert f"placed {placed[2].name}, which {placed[2].again}: " in text.getvalue()


class _Told:
    def __init__(self, payload):
        self.payload = payload

    def to_dict(self):
        return self.payload


@pytest.mark.parametrize("failure", [None, "intersection", "not upright"])
def test_a_trial_says_what_it_is_and_what_it_is_not(failure):
    verdict = events.Checked(failure is None, failure, (), "why", "released", 0.4, "the twin's bodies")
    out = [io.StringIO(), io.StringIO()]
    record = RunRecord()
    for listener in (
        TerminalReport(Console(file=out[0], width=400)),
        ChatScreen(Console(file=out[1], width=400)),
        record,
    ):
        listener.on_event(events.Started("x", {}))
        listener.on_event(verdict)
    for text in (*(each.getvalue() for each in out), run_page(record.turn).replace("&#x27;", "'")):
        assert "The trial lets the twin's bodies go 3 cm above their goals in physics" in text
        assert "whether the arm can reach and grasp them is not tried" in text
        assert ("may build it nonetheless" in text) == (failure == "intersection")
        assert "built by the arm" not in text


def test_a_plan_says_which_motion_only_makes_room():
    payload = Planned(0, (1, 0, 1), ("side", "rim", "side"), 1.0).to_dict()
    sentence = arm_sentence(payload, ["can 1", "can 2"])
    assert sentence.endswith("can 2 (side, set aside), then can 1 (rim), then can 2 (side)")
