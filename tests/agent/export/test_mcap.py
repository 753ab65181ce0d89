"""A recorded build as an MCAP file: what its reader gives back, what cannot be exported, and the layout."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from foxglove import layouts
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

from agent import events
from agent.arm.events import Picked
from agent.cli.app import command_line
from agent.errors import BAD_INPUT, DONE, USAGE
from agent.export.mcap import LAYOUT, link_frame, object_frame
from agent.reporting.build_recording import HEIGHT, RECORDING, WIDTH, BuildRecorder, read_recording
from agent.scenes.table_scene import TableScene
from structdiffusion.geometry import pose_from_xyz_yaw, transform_points
from structdiffusion.objects.procedural import procedural_object
from structdiffusion.simulation.depth_camera import project

REPORT = {
    "instruction": "stack the cans",
    "parse": {"goal": {"parts": []}, "objects": ["can", "box"]},
    "scene": None,
    "outcome": {"success": True},
    "options": {"seed": 7},
}
STEPS_BEFORE_PICK = 30


@pytest.fixture(scope="module")
def table():
    """A can in the air, which falls, and a box."""
    poses = np.array([pose_from_xyz_yaw(0.45, 0.1, 0.05, 0.3), pose_from_xyz_yaw(0.5, -0.2, 0.0, 0.0)])
    objects = [procedural_object("can", 0), procedural_object("box", 1)]
    with TableScene(objects, poses, 2, np.random.default_rng(0)) as table:
        yield table


@pytest.fixture(scope="module")
def runs(table, tmp_path_factory) -> Path:
    """A folder with one run of three frames."""
    folder = tmp_path_factory.mktemp("runs")
    recorder = BuildRecorder()
    recorder.on_event(events.Started("stack the cans", {}))
    for step in range(49):
        if step == STEPS_BEFORE_PICK:
            recorder.on_event(Picked(0, "can", "across", 1, 3, "friction"))
        table.world.step(1 / 240)
        recorder.on_physics_step(table)
    recorder.on_event(events.Failed("run", "the can fell", 5))
    recorder.write(folder / "cans", REPORT)
    return folder


@pytest.fixture(scope="module")
def recording(runs):
    return read_recording(runs / "cans" / RECORDING)


@pytest.fixture(scope="module")
def exported(runs, tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("exported")
    assert export(runs, folder / "cans.mcap", "--layout", str(folder / "layout.json")) == DONE
    return folder / "cans.mcap"


def export(runs: Path, out: Path, *more: str) -> int:
    return command_line(["export", "mcap", "--runs", str(runs), "--out", str(out), *more])


def read(path: Path) -> dict[str, list]:
    """Topic -> (seconds, message) of every message, and the schema's name, in the file's order."""
    found: dict[str, list] = {}
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        for schema, channel, message, content in reader.iter_decoded_messages(log_time_order=False):
            assert message.log_time == message.publish_time
            found.setdefault(channel.topic, []).append((message.log_time / 1e9, schema.name, content))
    return found


def stamp(message) -> float:
    return message.timestamp.seconds + message.timestamp.nanos / 1e9


def test_counts_and_times_are_those_of_the_recording(exported, recording):
    found = read(exported)
    every_frame = {"/camera/image", "/joints", "/joints/commanded", "/gripper", "/gripper/commanded", "/tf"}
    assert set(found) == every_frame | {"/camera/calibration", "/scene", "/log"}
    for topic in every_frame:
        assert [time for time, *_ in found[topic]] == pytest.approx([0.0, 0.1, 0.2], abs=1e-9)
    for topic in ("/camera/image", "/joints", "/gripper"):
        assert [stamp(message) for *_, message in found[topic]] == pytest.approx([0.0, 0.1, 0.2], abs=1e-9)
    assert [time for time, *_ in found["/log"]] == pytest.approx([line.time for line in recording.scene.log], abs=1e-9)
    assert len(found["/camera/calibration"]) == len(found["/scene"]) == 1
    times = [message.log_time for *_, message in make_reader(exported.open("rb")).iter_messages(log_time_order=False)]
    assert times == sorted(times)


def test_poses_are_those_of_the_recording_and_of_the_simulation(exported, recording, table):
    scene = recording.scene
    assert [body.name for body in scene.bodies] == list(table.names) and scene.poses.shape == (3, 2, 7)
    assert scene.poses[0, 0, 2] - scene.poses[2, 0, 2] > 0.01  # it fell
    final = {body.name: row for body, row in zip(scene.bodies, scene.poses[2], strict=True)}
    for name, pose in table.poses().items():
        assert final[name][:3] == pytest.approx(pose[:3, 3], abs=2e-3)  # the last frame is that of step 48 of 49
    for number, (_, name, message) in enumerate(read(exported)["/tf"]):
        assert name == "foxglove.FrameTransforms"
        assert {each.parent_frame_id for each in message.transforms} == {"world"}
        given = {each.child_frame_id: each for each in message.transforms}
        expected = dict(zip((object_frame(body.name) for body in scene.bodies), scene.poses[number], strict=True))
        expected |= dict(zip(map(link_frame, scene.links), scene.link_poses[number], strict=True))
        assert set(given) == {*expected, "camera"} and "arm/base" in given
        for frame, row in expected.items():
            place, turn = given[frame].translation, given[frame].rotation
            assert (place.x, place.y, place.z) == tuple(row[:3].tolist())
            assert (turn.x, turn.y, turn.z, turn.w) == tuple(row[3:].tolist())


def test_joints_fingers_and_pictures_are_those_of_the_recording(exported, recording):
    found = read(exported)
    for topic, rows, part in (
        ("/joints", recording.state, slice(0, 7)),
        ("/joints/commanded", recording.commanded, slice(0, 7)),
        ("/gripper", recording.state, slice(7, 10)),
        ("/gripper/commanded", recording.commanded, slice(7, 10)),
    ):
        for number, (_, name, message) in enumerate(found[topic]):
            assert name == "foxglove.JointStates"
            assert [joint.name for joint in message.joints] == recording.names[part]
            assert [joint.position for joint in message.joints] == rows[number, part].tolist()
    for number, (_, name, message) in enumerate(found["/camera/image"]):
        assert (name, message.format, message.frame_id) == ("foxglove.CompressedImage", "webp", "camera")
        assert message.data == recording.pictures[number]


def test_the_camera_sees_the_objects_where_they_are(exported, recording, table):
    """The calibration and the frame of the camera project an object to where the simulated camera sees it."""
    ((_, _, lens),) = read(exported)["/camera/calibration"]
    assert (lens.width, lens.height, lens.frame_id) == (WIDTH, HEIGHT, "camera")
    box = recording.scene.poses[0, 1, :3].astype(float)
    own = project(box[None], recording.scene.world_from_camera, np.array(lens.K).reshape(3, 3))[0]
    assert own * 2 == pytest.approx(table.world.camera.pixels(box[None])[0])


def test_bodies_are_those_of_the_objects(exported, table):
    ((_, name, scene),) = read(exported)["/scene"]
    assert name == "foxglove.SceneUpdate" and all(entity.frame_locked for entity in scene.entities)
    entities = {entity.id: entity for entity in scene.entities}
    assert entities["table"].frame_id == "world" and any(entity.frame_id == "arm/link_2" for entity in scene.entities)
    for model, pose, body in zip(table.models, table.world.poses(), table.names, strict=True):
        (surface,) = entities[object_frame(body)].triangles
        points = np.array([(point.x, point.y, point.z) for point in surface.points])
        assert min(surface.indices) >= 0 and max(surface.indices) < len(points) and len(surface.indices) % 3 == 0
        there, true = transform_points(pose, points), transform_points(pose, model.mesh_vertices)
        assert there.min(axis=0) == pytest.approx(true.min(axis=0), abs=3e-3)
        assert there.max(axis=0) == pytest.approx(true.max(axis=0), abs=3e-3)


def test_the_log_says_what_happened_and_when(exported):
    lines = [(time, line.name, line.message, line.level) for time, _, line in read(exported)["/log"]]
    info, error = 2, 4
    assert lines == [
        (0.0, "started", "instruction: stack the cans", info),
        (pytest.approx(STEPS_BEFORE_PICK / 240), "picked", "picked can (grasp: across): 3 fingers touch it", info),
        (pytest.approx(49 / 240, abs=1e-4), "failed", "the can fell", error),
    ]
    (about,) = make_reader(exported.open("rb")).iter_metadata()
    assert about.name == "run" and about.metadata["instruction"] == "stack the cans"
    assert json.loads(about.metadata["objects"]) == ["can", "box"] and about.metadata["success"] == "true"


def copied(runs: Path, folder: Path, *names: str, version: int = 2) -> Path:
    """The run under other names, in `folder`."""
    for name in names:
        (folder / name).mkdir(parents=True)
        with np.load(runs / "cans" / RECORDING) as file:
            content = {key: file[key] for key in file.files}
        if version == 1:
            about = json.loads(str(content["about"]))
            del about["scene"], content["poses"], content["links"]
            content["about"] = np.array(json.dumps(about | {"schema_version": 1}))
        np.savez(folder / name / RECORDING, **content)
    return folder


def test_several_runs_are_a_file_each(runs, tmp_path, capsys):
    several = copied(runs, tmp_path / "runs", "rows/a", "rows/b")
    assert export(several, tmp_path / "one.mcap") == USAGE
    assert "one file, and there are several runs, such as rows/a and rows/b" in capsys.readouterr().err
    assert not (tmp_path / "one.mcap").exists()
    assert export(several, tmp_path / "out", "--json") == DONE
    said = json.loads(capsys.readouterr().out)
    files = [tmp_path / "out" / "rows" / f"{name}.mcap" for name in "ab"]
    assert said == {"files": list(map(str, files)), "frames": 6, "events": 6, "left_out": []}
    assert all(len(read(file)["/tf"]) == 3 for file in files)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["out", "runs"]


def test_the_folder_of_one_run_can_be_named(runs, tmp_path, capsys):
    assert export(runs / "cans", tmp_path / "out") == DONE
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["out.mcap"]
    assert "1 run, 3 frames, 3 events" in capsys.readouterr().out


def test_a_recording_without_poses_is_left_out(runs, tmp_path, capsys):
    old = copied(runs, tmp_path / "runs", "a", version=1)
    assert read_recording(old / "a" / RECORDING).scene is None
    assert export(old, tmp_path / "out") == BAD_INPUT
    assert "no run can be exported; a: its recording has no poses" in capsys.readouterr().err
    copied(runs, old, "b")
    assert export(old, tmp_path / "out") == BAD_INPUT
    assert "the run a is left out: its recording has no poses" in capsys.readouterr().err
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["b.mcap"]


def test_nothing_is_replaced(runs, tmp_path, capsys):
    (tmp_path / "mine.mcap").write_text("mine")
    (tmp_path / "layout.json").write_text("mine")
    assert export(runs, tmp_path / "mine.mcap") == USAGE
    assert "--out must be a new file, and" in capsys.readouterr().err
    assert export(runs, tmp_path / "new.mcap", "--layout", str(tmp_path / "layout.json")) == USAGE
    assert "--layout must be a new file, and" in capsys.readouterr().err
    assert export(runs, tmp_path) == USAGE
    assert sorted(path.name for path in tmp_path.iterdir()) == ["layout.json", "mine.mcap"]
    assert (tmp_path / "mine.mcap").read_text() == "mine"


CONFIGS = {
    "3D": layouts.ThreeDeeConfig, "Image": layouts.ImageConfig, "Plot": layouts.PlotConfig, "RosOut": layouts.LogConfig
}  # fmt: skip


def panels(node) -> list[str]:
    """The panels of a layout's tree, in which every branch has two sides."""
    if isinstance(node, str):
        return [node]
    assert node["direction"] in ("row", "column") and 0 < node["splitPercentage"] < 100
    assert set(node) == {"direction", "splitPercentage", "first", "second"}
    return panels(node["first"]) + panels(node["second"])


def test_the_layout_has_the_form_and_the_keys_that_foxglove_reads(exported):
    layout = json.loads((exported.parent / "layout.json").read_text())
    assert layout == json.loads(LAYOUT.read_text())
    assert set(layout) == {"configById", "globalVariables", "userNodes", "playbackConfig", "layout"}
    assert sorted(panels(layout["layout"])) == sorted(layout["configById"])
    for panel, config in layout["configById"].items():
        kind, _, name = panel.partition("!")
        assert name and set(config) - {"foxglovePanelTitle", "cameraState"} <= set(CONFIGS[kind]()._to_dict())
    image = layout["configById"]["Image!camera"]["imageMode"]
    assert set(image) <= set(layouts.ImageModeConfig()._to_dict())
    camera = layout["configById"]["3D!scene"]["cameraState"]
    assert set(camera) <= set(layouts.ThreeDeeCameraState()._to_dict())
    for series in (layout["configById"][name]["paths"] for name in ("Plot!joints", "Plot!gripper")):
        assert all(set(one) <= set(layouts.PlotSeries()._to_dict()) for one in series)


def test_the_layout_shows_topics_and_fields_that_are_there(exported):
    found, text = read(exported), LAYOUT.read_text()
    assert set(re.findall(r'"(/[\w/]+)["\.]', text)) <= set(found)
    paths = re.findall(r'"value": "(/[\w/]+)\.joints\[(\d)\]\.position"', text)
    assert len(paths) == 13
    for topic, number in paths:
        assert found[topic][0][2].joints[int(number)].name
