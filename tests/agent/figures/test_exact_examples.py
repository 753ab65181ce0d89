"""Places to the millimetre, read off scene files, runs, sessions and recordings; what has no poses is refused."""

import json
from types import SimpleNamespace

import numpy as np
import pytest

from agent.cli.app import command_line
from agent.errors import DONE, USAGE, BadInput
from agent.figures.examples import read_example
from agent.scenes.record_bag import record_session
from agent.scenes.sources import FileSource
from grounding.figures.figure import FigureError
from grounding.figures.files import read_figure, write_figure
from grounding.figures.names import figure_named
from structdiffusion.geometry import pose_from_xyz_rpy

# Posts at the reader's left and right, and a brick across them.
GATE = [("post_red", 0.05, 0.0, 0), ("post_blue", -0.02, 0.0, 0), ("brick_green", 0.015, 0.09, 90)]
LAID = [("post_red", 0.3, 0.0, 20), ("post_blue", 0.15, 0.0, 0), ("brick_green", -0.25, 0.0, 30)]


def scene(path, objects):
    rows = [f"- {{mesh: blocks/{mesh}, x: 0.42, y: {y}, z: {z}, yaw: {yaw}}}" for mesh, y, z, yaw in objects]
    path.write_text("version: 1\nobjects:\n" + "\n".join(rows) + "\n")
    return path


def is_the_gate(figure, off=0.001):
    """Check the places of posts and brick, to `off` metres."""
    assert len(figure.places) == 3 and figure.legal == (3,)
    left, right, brick = sorted(figure.places, key=lambda place: (place.z, place.x))
    assert [left.z, right.z] == [0.0, 0.0] and brick.z == pytest.approx(0.09, abs=off)
    assert (right.x - left.x, brick.x - left.x) == pytest.approx((0.07, 0.035), abs=2 * off)
    assert brick.size == pytest.approx((0.08, 0.04, 0.04), abs=4 * off)
    assert left.size == pytest.approx((0.045, 0.045, 0.09), abs=4 * off)
    assert min(brick.turn % 180.0, -brick.turn % 180.0) < 2.0  # along the reader's right


def test_a_scene_file(tmp_path):
    is_the_gate(read_example(scene(tmp_path / "gate.yaml", GATE), "copy", exact=True))


def test_a_recording_tells_what_stands_on_what(tmp_path):
    places = [("cube_65_red", 0.1, 0.0, 0), ("cube_35_blue", 0.1, 0.065, 0), ("cube_50_yellow", -0.1, 0.0, 0)]
    with FileSource(scene(tmp_path / "step.yaml", places)).set_out(0) as table:
        record_session(table, tmp_path / "step.bag", np.random.default_rng(0), rate=2.0)
    assert [block.level for block in read_example(tmp_path / "step.bag", "step").blocks] == [0, 0, 1]
    copy = read_example(tmp_path / "step.bag", "copy", exact=True)
    lower, beside, upper = sorted(copy.places, key=lambda place: (place.z, place.x))
    assert upper.z == pytest.approx(0.065, abs=0.004) and upper.size[2] == pytest.approx(0.035, abs=0.004)
    assert (upper.x - lower.x, beside.x - lower.x) == pytest.approx((0.0, 0.2), abs=0.004)


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """Let the arm copy the gate with what lies elsewhere; return the folder."""
    folder = tmp_path_factory.mktemp("exact")
    like, table = scene(folder / "gate.yaml", GATE), scene(folder / "table.yaml", LAID)
    words = ["run", "the same in the middle of the table", "--like", str(like), "--exact", "--scene", str(table)]
    assert command_line([*words, "--model", "geometric", "--out", str(folder / "out")]) == DONE
    return folder / "out"


def test_a_run_reports_the_largest_error_and_keeps_its_example(run):
    checks = {each["name"]: each for each in json.loads((run / "report.json").read_text())["verdict"]["checks"]}
    assert checks["farthest from its place in the example (m)"]["measured"] <= 0.005
    assert checks["middle: place in the range"]["passed"]
    is_the_gate(read_figure(run / "example.toml"))


def test_a_run_and_a_chat_show_where_bodies_came_to_rest(run, tmp_path):
    """Goals lie 7 mm above contact; the example does not."""
    for path in (run, run / "report.json", run / "session.jsonl"):
        is_the_gate(read_example(path, "copy", exact=True), 0.004)
    assert [block.level for block in read_example(run, "gate").blocks] == [0, 0, 1]
    lines = (run / "session.jsonl").read_text().splitlines()
    another = [line for line in lines if '"kind": "started"' in line or '"kind": "parsed"' in line]
    event = {"kind": "failed", "step": "propose", "message": "no", "exit_code": 4}
    failed = json.dumps({"seconds": 9e3, "event": event})
    (tmp_path / "chat.jsonl").write_text("\n".join([*lines, *another, failed]) + "\n")
    is_the_gate(read_example(tmp_path / "chat.jsonl", "copy", exact=True), 0.004)  # the last turn that stood


def test_a_report_without_its_session_has_no_poses(run, tmp_path):
    (tmp_path / "report.json").write_text((run / "report.json").read_text())
    with pytest.raises(FigureError, match="because its session.jsonl is not beside it; an exact copy"):
        read_example(tmp_path / "report.json", "copy", exact=True)


def test_what_cannot_be_copied_exactly(tmp_path, monkeypatch, capsys):
    write_figure(figure_named("gate"), tmp_path / "gate.toml")
    with pytest.raises(FigureError, match="gate.toml' is a drawing without poses; an exact copy needs a scene file"):
        read_example(tmp_path / "gate.toml", "copy", exact=True)
    many = [("cube_35_red", -0.36 + 0.06 * k, 0.0, 0) for k in range(13)]
    with pytest.raises(FigureError, match="it has 13 objects; an exact copy can have at most 12"):
        read_example(scene(tmp_path / "many.yaml", many), "copy", exact=True)
    with pytest.raises(BadInput, match="there is no"):
        read_example(tmp_path / "missing.yaml", "copy", exact=True)
    leaning = SimpleNamespace(name="red post", world_from_object=pose_from_xyz_rpy((0.4, 0.0, 0.1), (20.0, 0.0, 0.0)))
    monkeypatch.setattr("agent.figures.examples.load_scene", lambda path: (leaning,))
    with pytest.raises(FigureError, match="red post leans, and only what stands level can be copied exactly"):
        read_example(tmp_path / "many.yaml", "copy", exact=True)
    assert command_line(["run", "the same", "--exact"]) == USAGE
    assert "--exact needs an example; name it with --like FILE" in capsys.readouterr().err
