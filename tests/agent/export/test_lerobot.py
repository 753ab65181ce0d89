"""Recorded runs as a LeRobot dataset: the files and schemas of the format, and what is left out."""

import io
import json

import numpy as np
import pytest
from PIL import Image

from agent.cli.app import command_line
from agent.errors import BAD_INPUT, DONE, USAGE
from agent.reporting.build_recording import HEIGHT, RECORDING, WIDTH

pq = pytest.importorskip("pyarrow.parquet", reason="the export needs the package pyarrow")

JOINTS = [f"joint_{number}" for number in range(1, 8)]
FINGERS = [f"joint_finger_{number}" for number in range(1, 4)]


def picture(shade: int, size=(WIDTH, HEIGHT)) -> bytes:
    buffer = io.BytesIO()
    Image.new("RGB", size, (shade, 0, 255)).save(buffer, format="WEBP")
    return buffer.getvalue()


def record(folder, frames: int, *, instruction="stack the cans", success=True, joints=JOINTS, size=(WIDTH, HEIGHT)):
    """A run of that many frames whose joints are where they were told before."""
    folder.mkdir(parents=True)
    about = {
        "schema_version": 1,
        "rate": 10,
        "instruction": instruction,
        "goal": {"parts": [{"kind": "structure"}]},
        "objects": ["can 1", "can 2"],
        "success": success,
        "seed": 3,
        "model": f"j2s{len(joints)}s300",
        "joints": joints,
        "fingers": FINGERS,
    }
    told = np.arange(frames, dtype=np.float32)[:, None]
    pictures = [picture(20 * number, size) for number in range(frames)]
    np.savez(
        folder / RECORDING, about=np.array(json.dumps(about)), joints=np.repeat(told - 1, len(joints), 1),
        fingers=np.repeat(told - 1, 3, 1), commanded_joints=np.repeat(told, len(joints), 1),
        commanded_fingers=np.repeat(told, 3, 1), pictures=np.frombuffer(b"".join(pictures), np.uint8),
        ends=np.cumsum([len(one) for one in pictures]),
    )  # fmt: skip


def export(runs, out, *more: str) -> int:
    return command_line(["export", "lerobot", "--runs", str(runs), "--out", str(out), *more])


def test_the_files_and_schemas_of_the_format(tmp_path, capsys):
    record(tmp_path / "runs/a", 3)
    record(tmp_path / "runs/b", 2, instruction="make a line", success=False)
    record(tmp_path / "runs/c", 4)
    out = tmp_path / "dataset"
    assert export(tmp_path / "runs", out, "--json") == DONE
    assert json.loads(capsys.readouterr().out) == {"episodes": 3, "frames": 9, "successes": 2, "left_out": []}
    info = json.loads((out / "meta/info.json").read_text())
    counts = [info[f"total_{what}"] for what in ("episodes", "frames", "tasks")]
    assert (info["codebase_version"], info["fps"], info["robot_type"], counts) == ("v3.0", 10, "j2s7s300", [3, 9, 2])
    assert info["features"]["action"] == {"dtype": "float32", "shape": [10], "names": [*JOINTS, *FINGERS]}
    assert info["features"]["observation.images.camera"]["shape"] == [HEIGHT, WIDTH, 3]

    episodes = pq.read_table(out / "meta/episodes/chunk-000/file-000.parquet").to_pylist()
    assert [(e["dataset_from_index"], e["dataset_to_index"], e["length"]) for e in episodes] == [
        (0, 3, 3), (3, 5, 2), (5, 9, 4)
    ]  # fmt: skip
    assert [(e["run"], e["success"], e["tasks"]) for e in episodes] == [
        ("a", True, ["stack the cans"]), ("b", False, ["make a line"]), ("c", True, ["stack the cans"])
    ]  # fmt: skip
    assert episodes[1]["objects"] == ["can 1", "can 2"]
    assert json.loads(episodes[0]["goal"])["parts"] == [{"kind": "structure"}]

    files = [info["data_path"].format(chunk_index=0, file_index=k) for k in range(3)]
    frames = [pq.read_table(out / name).to_pylist() for name in files]
    assert set(frames[0][0]) == set(info["features"])
    every = [frame for rows in frames for frame in rows]
    assert [frame["index"] for frame in every] == list(range(9))
    assert [frame["frame_index"] for frame in every] == [0, 1, 2, 0, 1, 0, 1, 2, 3]
    assert [frame["task_index"] for frame in every] == [0] * 3 + [1] * 2 + [0] * 4
    assert [frame["next.success"] for frame in every] == [False, False, True, False, False, False, False, False, True]
    assert [frame["next.done"] for frame in frames[1]] == [False, True]
    assert [frame["timestamp"] for frame in frames[0]] == pytest.approx([0.0, 0.1, 0.2])
    assert [frame["observation.state"][0] for frame in frames[0]] == [-1, 0, 1]
    assert [frame["action"][9] for frame in frames[0]] == [1, 2, 2]  # what is told by the next frame
    with Image.open(io.BytesIO(every[1]["observation.images.camera"]["bytes"])) as image:
        assert image.size == (WIDTH, HEIGHT) and np.asarray(image, float)[0, 0] == pytest.approx((20, 0, 255), abs=12)


def test_statistics_are_those_of_all_frames(tmp_path):
    record(tmp_path / "runs/a", 3)
    record(tmp_path / "runs/b", 2)
    assert export(tmp_path / "runs", tmp_path / "dataset") == DONE
    stats = json.loads((tmp_path / "dataset/meta/stats.json").read_text())
    state = stats["observation.state"]
    assert (state["min"][0], state["max"][0], state["mean"][0], state["count"]) == (-1, 1, pytest.approx(-0.2), [5])
    assert np.shape(stats["observation.images.camera"]["mean"]) == (3, 1, 1)
    assert stats["observation.images.camera"]["max"][2] == [[pytest.approx(1.0, abs=0.02)]]


def test_the_tasks_are_the_index_of_their_table(tmp_path):
    record(tmp_path / "runs/a", 2)
    export(tmp_path / "runs", tmp_path / "dataset")
    table = pq.read_table(tmp_path / "dataset/meta/tasks.parquet")
    assert table.to_pylist() == [{"task_index": 0, "task": "stack the cans"}]
    assert json.loads(table.schema.metadata[b"pandas"])["index_columns"] == ["task"]


def test_a_bad_run_costs_no_other(tmp_path, capsys):
    runs = tmp_path / "runs"
    record(runs / "a", 3)
    record(runs / "d", 2, joints=JOINTS[:6])
    record(runs / "e", 2, size=(64, 48))
    record(runs / "f", 2)
    (runs / "b").mkdir()
    (runs / "b" / RECORDING).write_bytes(b"cut off")
    (runs / "c").mkdir()
    (runs / "c" / "session.jsonl").write_text("")
    assert export(runs, tmp_path / "dataset") == BAD_INPUT
    said = capsys.readouterr()
    assert "2 episodes, 2 of them as asked, 5 frames" in said.out
    reasons = said.err.splitlines()
    assert [line.split()[3] for line in reasons] == ["b", "c", "d", "e"]
    assert "is not a recording of structagent" in reasons[0] and "without --record" in reasons[1]
    assert "its arm is a j2s6s300, and that of a a j2s7s300" in reasons[2] and "64 x 48 pixels" in reasons[3]
    episodes = pq.read_table(tmp_path / "dataset/meta/episodes/chunk-000/file-000.parquet").to_pylist()
    assert [episode["run"] for episode in episodes] == ["a", "f"]


def test_nothing_is_left_behind_where_no_run_can_be_exported(tmp_path, capsys):
    (tmp_path / "runs/a").mkdir(parents=True)
    assert export(tmp_path / "runs", tmp_path / "dataset") == BAD_INPUT
    assert "no run is in" in capsys.readouterr().err
    (tmp_path / "runs/a/report.json").write_text("{}")
    assert export(tmp_path / "runs", tmp_path / "dataset") == BAD_INPUT
    assert "no run can be exported; a: it has no recording.npz" in capsys.readouterr().err
    assert export(tmp_path / "none", tmp_path / "dataset") == BAD_INPUT
    assert [path.name for path in tmp_path.iterdir()] == ["runs"]


def test_a_folder_with_files_is_not_written_to(tmp_path, capsys):
    record(tmp_path / "runs/a", 2)
    (tmp_path / "dataset").mkdir()
    (tmp_path / "dataset/mine.txt").write_text("mine")
    assert export(tmp_path / "runs", tmp_path / "dataset") == USAGE
    assert "is not empty" in capsys.readouterr().err
    (tmp_path / "dataset/mine.txt").unlink()
    assert export(tmp_path / "runs", tmp_path / "dataset") == DONE


def test_unfinished_rows_of_a_killed_batch_are_no_runs(tmp_path, capsys):
    record(tmp_path / "runs/rows/a", 2)
    record(tmp_path / "runs/.work/b", 2)
    assert export(tmp_path / "runs", tmp_path / "dataset", "--json") == DONE
    assert json.loads(capsys.readouterr().out) == {"episodes": 1, "frames": 2, "successes": 1, "left_out": []}
