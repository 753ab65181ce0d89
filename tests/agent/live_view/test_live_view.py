"""What the page is told of a run: the clouds, the arm, arrangements, progress and the text, whole and in order."""

import base64
import io
import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image

from agent import events
from agent.arm.events import Picked, Placed, Planned, StandingChanged
from agent.live_view.live_view import LiveView
from agent.pipeline.event_builders import chosen_event, perceived_event
from structdiffusion.geometry import matrix_from_quaternion, pose_from_xyz_yaw
from structdiffusion.observation import Arrangement
from tests.agent.live_view.conftest import words_of


class Sent(list):
    """A server that keeps what it would send."""

    watched = True

    def publish(self, kind, payload):
        self.append((kind, payload))

    def last(self, kind):
        return next(payload for name, payload in reversed(self) if name == kind)

    def all(self, kind):
        return [payload for name, payload in self if name == kind]


@pytest.fixture
def sent() -> Sent:
    return Sent()


@pytest.fixture
def view(sent) -> LiveView:
    return LiveView(sent, transcript=False)


def array(text: str, kind: str = "<f4") -> np.ndarray:
    return np.frombuffer(base64.b64decode(text), kind)


def matrix_of(pose) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = matrix_from_quaternion(np.array(pose[3:])), pose[:3]
    return matrix


def text_of(sent) -> str:
    return "\n".join(words_of(payload) for payload in sent.all("entry"))


def test_the_clouds_arrive_whole(view, sent, run_events, scene):
    view.on_event(run_events[2])
    message = sent.last("scene")
    assert [one["name"] for one in message["objects"]] == ["cup 1", "cup 2", "cup 3", "banana"]
    assert [one["takes_part"] for one in message["objects"]] == [True, True, True, False]
    assert message["table"] == [0.18, 0.72, -0.45, 0.45]
    for one, cloud in zip(message["objects"], (*scene.objects, *scene.distractors), strict=True):
        assert np.array_equal(array(one["points"]).reshape(-1, 3), cloud.points)
        assert np.array_equal(array(one["colors"], np.uint8).reshape(-1, 3), cloud.colors)


def test_every_arrangement_can_be_stepped_to(view, sent, run_events, scene):
    motions = np.array([np.tile(pose_from_xyz_yaw(0.01 * k, 0, 0, 0.1 * k), (3, 1, 1)) for k in range(12)])
    proposed = replace(run_events[3], arrangements=tuple(Arrangement(each, {"total": 0.5}) for each in motions))
    for event in (run_events[2], proposed, replace(run_events[4], rank=4)):
        view.on_event(event)
    message = sent.last("candidates")
    assert (message["count"], message["names"]) == (12, ["cup 1", "cup 2", "cup 3"])
    assert np.allclose(array(message["motions"]).reshape(12, 3, 3, 4), motions[:, :, :3], atol=1e-6)
    assert message["scores"] == [0.9] * 12 and message["words"][0] == "the best"
    assert sent.last("chosen")["rank"] == 4
    assert {message["scene"], sent.last("chosen")["scene"]} == {sent.last("scene")["scene"]}


def test_a_preview_moves_the_clouds_to_the_sample(view, sent, run_events, scene):
    view.on_event(run_events[2])
    places, turns = ((0.5, 0.1, 0.03), (0.4, 0.0, 0.03), (0.3, -0.1, 0.03)), (0.0, 1.0, -2.0)
    view.on_event(events.Previewed(4, 25, (places,), (turns,)))
    motions = array(sent.last("preview")["motions"]).reshape(3, 3, 4)
    for motion, cloud, place in zip(motions, scene.objects, places, strict=True):
        assert np.allclose(motion[:, :3] @ cloud.centroid + motion[:, 3], place, atol=1e-5)


def test_poses_move_the_clouds_as_the_objects_moved(view, sent, table):
    view.on_table(table)
    view.on_event(perceived_event(table.look(), 0.1, table))
    first = table.names[0]
    rest = sent.last("poses")["objects"]
    assert all(np.allclose(pose, [0, 0, 0, 0, 0, 0, 1], atol=1e-3) for pose in rest.values())
    motion = pose_from_xyz_yaw(0.05, -0.02, 0.1, 0.7)
    table.world.set_pose(0, motion @ table.poses()[first])
    view.on_event(Picked(0, first, "side", 1, 3, "friction"))
    moved = matrix_of(sent.last("poses")["objects"][first])
    assert np.allclose(moved, motion, atol=1e-3)


def test_the_arm_is_described_by_its_solids_and_the_poses_of_their_links(view, sent, table):
    view.on_table(table)
    links = {str(shape["link"]) for shape in sent.last("arm")["shapes"]}
    assert len(sent.last("arm")["shapes"]) > 10 and links <= sent.last("poses")["links"].keys()


def test_nothing_is_computed_of_the_moving_arm_while_nobody_watches(view, sent, table):
    view.on_table(table)
    sent.watched, told = False, len(sent)
    for _ in range(100):
        view.on_physics_step(table)
    assert len(sent) == told


def test_the_moving_arm_is_shown_at_a_limited_rate(view, sent, table, monkeypatch):
    now = [100.0]
    monkeypatch.setattr("agent.live_view.live_view.time.monotonic", lambda: now[0])
    view.on_table(table)
    told = len(sent.all("poses"))
    for _ in range(1000):
        now[0] += 0.01
        view.on_physics_step(table)
    assert 100 <= len(sent.all("poses")) - told <= 130


def test_a_picture_of_the_camera_is_sent(view, sent, run_events):
    view.on_event(run_events[8])
    message = sent.last("picture")
    image = np.asarray(Image.open(io.BytesIO(base64.b64decode(message["jpeg"]))))
    assert image.shape == (48, 64, 3) and abs(int(image.mean()) - 90) <= 1
    assert message["caption"] == "after placement 1: the cup 1"


def test_the_progress_of_a_build(view, sent, run_events):
    for event in run_events:
        view.on_event(event)
    told = [(one["stage"], one["placed"], one["motions"], one["outcome"]) for one in sent.all("progress")]
    assert told == [
        ("reading the instruction", 0, 0, ""),
        ("looking at the table", 0, 0, ""),
        ("proposing arrangements", 0, 0, ""),
        ("arrangements are proposed", 0, 0, ""),
        ("building", 0, 3, ""),
        ("cup 1 is in the hand", 0, 3, ""),
        ("cup 1 is in its place", 1, 3, ""),
        ("checked", 1, 3, ""),
        ("the structure was built but does not stand as asked", 1, 3, "failure"),
    ]


def test_more_motions_than_planned_are_counted_too(view, sent):
    view.on_event(events.Started("x", {}))
    view.on_event(Planned(0, (0,), ("side",), 1.0))
    for _ in range(2):
        view.on_event(Placed(0, "cup 1", False, 0.0, 0.0, np.eye(4), 1.0))
    assert (sent.last("progress")["placed"], sent.last("progress")["motions"]) == (2, 2)


def test_beside_a_terminal_the_text_of_the_chat_is_shown_too(sent, run_events):
    view = LiveView(sent, transcript=True)
    for event in run_events:
        view.on_event(event)
    shown = text_of(sent)
    assert '> put the cups in a small circle <script>alert("x")</script>' in shown
    assert "12 arrangements proposed" in shown and "placed cup 1" in shown and "semantic" in shown
    assert {entry["type"] for entry in sent.all("entry")} == {"said", "title", "rows", "line", "check"}
    assert [entry["rows"][0] for entry in sent.all("entry") if entry["type"] == "rows"][0][:2] == ["shape", "circle"]
    assert [entry["passed"] for entry in sent.all("entry") if entry["type"] == "check"].count(False) == 1
    assert {entry["style"] for entry in sent.all("entry") if entry["type"] == "line"} <= {"", "dim", "red", "bold red"}
    assert not re.search("[\x1b\u2500-\u259f]", shown), "no line, box or block drawn with characters"


def test_control_characters_of_a_text_are_made_visible(sent):
    LiveView(sent, transcript=True).on_event(events.Noted("red \x1b[31mtext \u202eand back"))
    assert text_of(sent) == r"red \u001b[31mtext \u202eand back"


def test_a_new_scene_makes_what_is_shown_void(view, sent, run_events):
    for event in run_events[:5]:
        view.on_event(event)
    number = sent.last("scene")["scene"]
    view.on_event(run_events[2])
    assert sent.last("scene")["scene"] == number + 1
    told = len(sent.all("candidates"))
    view.on_event(run_events[3])
    assert len(sent.all("candidates")) == told + 1 and sent.last("candidates")["scene"] == number + 1


def test_a_proposal_about_other_objects_than_were_seen_brings_its_own_clouds(view, sent, run_events, scene):
    view.on_event(run_events[2])
    fewer = replace(scene, objects=scene.objects[:2], distractors=(*scene.objects[2:], *scene.distractors))
    arrangement = Arrangement(np.tile(np.eye(4), (2, 1, 1)), {"total": 1.0})
    view.on_event(replace(run_events[3], scene=fewer, arrangements=(arrangement,) * 12))
    view.on_event(chosen_event(1, arrangement, fewer))
    assert [one["takes_part"] for one in sent.last("scene")["objects"]] == [True, True, False, False]
    assert sent.last("candidates")["scene"] == sent.last("scene")["scene"]


def talk_about(table, proposal=None, question=None):
    """A conversation, as far as the view looks at it."""
    return SimpleNamespace(table=table, situation=SimpleNamespace(proposal=proposal), question=question)


def test_beside_an_open_question_no_proposal_is_stepped_through(view, sent, table, run_events):
    view.on_table(table)
    proposal = SimpleNamespace(proposed=run_events[3], rank=1)
    view.on_waiting(talk_about(table, proposal))
    assert sent.last("candidates")["count"] == 12
    view.on_event(events.Asked("shape", "Which shape?", ("circle", "line")))
    assert sent.last("candidates")["count"] == 0
    told = len(sent.all("candidates"))
    view.on_waiting(talk_about(table, proposal, question="Which shape?"))
    assert len(sent.all("candidates")) == told, "the proposal does not come back while the question is open"
    view.on_waiting(talk_about(table, proposal))
    assert sent.last("candidates")["count"] == 12


@pytest.mark.parametrize("line", [events.Commanded("/objects"), events.Answered("what do you see?", "two boxes")])
def test_how_a_turn_ended_is_gone_when_the_next_one_begins(view, sent, line):
    view.on_event(events.Started("put the elephants in a ring", {}))
    view.on_event(events.Failed("parse", "there are no elephants", 3))
    assert sent.last("progress")["outcome"] == "failure"
    view.on_event(line)
    assert (sent.last("progress")["stage"], sent.last("progress")["outcome"]) == ("", "")


def test_how_a_turn_ended_is_gone_after_a_line_that_was_no_turn(view, sent, table):
    """Such as "7" where nothing can be chosen, which only the screen answers."""
    view.on_table(table)
    view.on_event(events.Started("put the elephants in a ring", {}))
    view.on_event(events.Failed("parse", "there are no elephants", 3))
    view.on_waiting(talk_about(table))
    assert sent.last("progress")["outcome"] == "failure", "it is shown until a line is said"
    view.on_waiting(talk_about(table))
    assert sent.last("progress")["outcome"] == ""


def test_what_fell_is_not_counted_by_the_bar(sent):
    """The second placement fells the first object, which then stands again."""
    view = LiveView(sent, transcript=False)
    view.on_event(events.Started("x", {}))
    view.on_event(Planned(0, (0, 1), ("side", "side"), 1.0))
    for index in range(2):
        view.on_event(Placed(index, f"cup {index + 1}", False, 0.0, 0.0, np.eye(4), 1.0))
    assert sent.last("progress")["placed"] == 2
    view.on_event(StandingChanged(0, "cup 1", False, "lies 90 degrees off", "cup 2 was placed"))
    told = sent.last("progress")
    assert (told["placed"], told["motions"]) == (1, 2)
    assert told["stage"] == "cup 1 no longer stands: it lies 90 degrees off since cup 2 was placed"
    view.on_event(Placed(0, "cup 1", False, 0.0, 0.0, np.eye(4), 1.0, trouble="lies 90 degrees off"))
    assert sent.last("progress")["placed"] == 2 and "does not stand" in sent.last("progress")["stage"]
    view.on_event(StandingChanged(0, "cup 1", True, "", "the arm was done"))
    assert (sent.last("progress")["placed"], sent.last("progress")["motions"]) == (3, 3)
