"""The frames of a build: taken, written and read again, and what is no recording is named."""

import io
import json

import numpy as np
import pytest
from PIL import Image

from agent.errors import BadInput
from agent.reporting.build_recording import HEIGHT, RECORDING, WIDTH, BuildRecorder, read_recording
from agent.scenes.table_scene import TableScene
from structdiffusion.geometry import pose_from_xyz_yaw
from structdiffusion.objects.procedural import procedural_object

REPORT = {
    "instruction": "stack the cans",
    "parse": {"goal": {"parts": []}, "objects": []},
    "scene": {"objects": [{"name": "can 1", "takes_part": True}, {"name": "box 1", "takes_part": False}]},
    "outcome": {"success": True},
    "options": {"seed": 7},
}


@pytest.fixture(scope="module")
def table():
    """A can beside the arm."""
    poses = np.array([pose_from_xyz_yaw(0.45, 0.1, 0.0, 0.0)])
    with TableScene([procedural_object("can", 0)], poses, 1, np.random.default_rng(0)) as table:
        yield table


@pytest.fixture
def recorder(table):
    """Three frames, in which the arm is told to move and does."""
    recorder = BuildRecorder()
    target = table.arm.configuration() + 0.1
    for step in range(49):
        if step == 1:
            table.arm.command(target)
        table.world.step(1 / 240)
        recorder.on_physics_step(table)
    return recorder


def test_what_is_written_is_read_again(recorder, table, tmp_path):
    path = recorder.write(tmp_path, REPORT)
    assert path == tmp_path / RECORDING
    read = read_recording(path)
    assert read.about["objects"] == ["can 1"]
    assert read.about["instruction"] == "stack the cans" and read.about["success"] and read.about["seed"] == 7
    assert len(read.names) == 10 and read.names[0] == "joint_1" and read.state.shape == read.commanded.shape == (3, 10)
    assert read.commanded[2, :7] == pytest.approx(table.arm.set_point, abs=1e-6)
    assert np.abs(read.state[2] - read.state[0])[:7].max() > 0.001  # the arm moved
    with Image.open(io.BytesIO(read.pictures[0])) as image:
        assert image.size == (WIDTH, HEIGHT) and np.asarray(image).std() > 5


def test_nothing_is_written_of_a_build_that_never_was(tmp_path):
    assert BuildRecorder().write(tmp_path, REPORT) is None
    assert not (tmp_path / RECORDING).exists()


def test_the_objects_of_a_goal_of_several_parts_are_its_own(recorder, tmp_path):
    report = REPORT | {"parse": {"goal": {"parts": []}, "objects": ["bowl 1", "can 1"]}}
    assert read_recording(recorder.write(tmp_path, report)).about["objects"] == ["bowl 1", "can 1"]


def test_a_failed_run_is_no_success(recorder, tmp_path):
    read = read_recording(recorder.write(tmp_path, REPORT | {"outcome": {"success": False}}))
    assert read.about["success"] is False


def changed(path, **columns):
    """The recording with other columns in its file."""
    with np.load(path) as file:
        content = {key: file[key] for key in file.files}
    np.savez(path, **(content | columns))


@pytest.mark.parametrize(
    ("columns", "message"),
    [
        ({"about": np.array("{}")}, "schema version"),
        ({"ends": np.array([1, 2])}, "its arrays are"),
        ({"ends": np.array([1, 2, 3])}, "its pictures are cut off"),
        ({"joints": np.full((3, 7), np.nan, np.float32)}, "not all positions are finite"),
        ({"joints": np.zeros((2, 7), np.float32)}, "is not a recording"),
    ],
)
def test_what_does_not_fit_together_is_named(recorder, tmp_path, columns, message):
    path = recorder.write(tmp_path, REPORT)
    changed(path, **columns)
    with pytest.raises(BadInput, match=message):
        read_recording(path)


def test_a_missing_key_is_named(recorder, tmp_path):
    path = recorder.write(tmp_path, REPORT)
    with np.load(path) as file:
        about = json.loads(str(file["about"]))
    changed(path, about=np.array(json.dumps(about | {"success": "yes"})))
    with pytest.raises(BadInput, match="'success' is missing, or no bool"):
        read_recording(path)


@pytest.mark.parametrize("content", [b"", b"no archive", b"PK\x03\x04 cut off"])
def test_another_file_is_refused(tmp_path, content):
    path = tmp_path / RECORDING
    path.write_bytes(content)
    with pytest.raises(BadInput, match="is not a recording of structagent: it is not an .npz file"):
        read_recording(path)
    with pytest.raises(BadInput, match="cannot read"):
        read_recording(tmp_path / "none.npz")
