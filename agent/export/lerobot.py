"""Write recorded runs as a LeRobot dataset, version 3: a run is an episode, its instruction the task.

| file | content |
|---|---|
| `meta/info.json` | frame rate, robot, features with their shapes and names, counts |
| `meta/stats.json` | of each feature, what policies are normalised with |
| `meta/tasks.parquet` | the instructions |
| `meta/episodes/chunk-000/file-000.parquet` | per episode length, frames, file, run, success, goal, objects, seed |
| `data/chunk-CCC/file-FFF.parquet` | the frames of one episode, its pictures inside |

The action of a frame is what the motors are told by the next frame.
"""

from __future__ import annotations

import io
import json
import os
import tempfile
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from PIL import Image

from agent.errors import BadInput, NotWritten
from agent.export.frame_statistics import PictureStatistics, VectorStatistics
from agent.export.recorded_runs import LeftOut, RecordedRun
from agent.reporting.build_recording import HEIGHT, RATE, WIDTH

VERSION = "v3.0"
CAMERA, STATE, ACTION = "observation.images.camera", "observation.state", "action"
_CHUNK = 1000  # files of a chunk
_DATA = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
_FLAGS = ("next.done", "next.success")
_COUNTS = ("frame_index", "episode_index", "index", "task_index")


@dataclass(frozen=True)
class Exported:
    """What was exported.

    Attributes:
        episodes, frames: how many.
        successes: how many episodes end as asked.
        left_out: the runs that could not be exported.
    """

    episodes: int
    frames: int
    successes: int
    left_out: tuple[LeftOut, ...]


def export_lerobot(runs: Iterable[RecordedRun | LeftOut], out: Path) -> Exported:
    """Write runs as a data set; nothing is there before all of it is.

    Args:
        runs: one after the other; only one is kept in memory.
        out: the folder, which must not exist, or be empty.

    Raises:
        BadInput: if no run can be exported.
        NotWritten: if it cannot be written.
    """
    left_out: list[LeftOut] = []
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=f".{out.name}-", dir=out.parent) as place:
            writer = _Writer(Path(place) / "data set")
            for run in runs:
                if isinstance(run, LeftOut):
                    left_out.append(run)
                elif problem := writer.add(run):
                    left_out.append(LeftOut(run.name, problem))
            if not writer.episodes:
                first = left_out[0]
                raise BadInput(f"no run can be exported; {first.name}: {first.reason}")
            writer.finish()
            os.replace(writer.folder, out)
    except OSError as error:
        raise NotWritten(f"cannot write the data set {str(out)!r}: {error.strerror or error}") from error
    successes = sum(episode["success"] for episode in writer.episodes)
    return Exported(len(writer.episodes), writer.frames, successes, tuple(left_out))


class _Writer:
    """Writes one episode after the other into a folder."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.frames = folder, 0
        self.episodes: list[dict[str, Any]] = []
        self._tasks: dict[str, int] = {}
        self._about: dict[str, Any] = {}
        self._vectors = {key: VectorStatistics() for key in (STATE, ACTION)}
        self._pictures = PictureStatistics()

    def add(self, run: RecordedRun) -> str:
        """Add an episode; return why it cannot be, or an empty text."""
        recording = run.recording
        try:
            pictures = [_decoded(picture) for picture in recording.pictures]
        except (OSError, ValueError) as error:
            return f"a picture of its recording cannot be read: {error}"
        about, number, count = recording.about, len(self.episodes), len(pictures)
        action = np.concatenate((recording.commanded[1:], recording.commanded[-1:]))
        task = self._tasks.setdefault(about["instruction"], len(self._tasks))
        chunk, file = divmod(number, _CHUNK)
        last = np.arange(count) == count - 1
        columns = {
            CAMERA: pa.array([{"bytes": picture, "path": None} for picture in recording.pictures], _PICTURE),
            STATE: _vectors(recording.state),
            ACTION: _vectors(action),
            "next.done": pa.array(last),
            "next.success": pa.array(last & about["success"]),
            "timestamp": pa.array((np.arange(count) / RATE).astype(np.float32)),
            "frame_index": pa.array(np.arange(count)),
            "episode_index": pa.array(np.full(count, number)),
            "index": pa.array(np.arange(self.frames, self.frames + count)),
            "task_index": pa.array(np.full(count, task)),
        }
        self._write(pa.table(columns), _DATA.format(chunk_index=chunk, file_index=file))
        self.episodes.append({
            "episode_index": number,
            "tasks": [about["instruction"]],
            "length": count,
            "data/chunk_index": chunk,
            "data/file_index": file,
            "dataset_from_index": self.frames,
            "dataset_to_index": self.frames + count,
            "meta/episodes/chunk_index": 0,
            "meta/episodes/file_index": 0,
            "run": run.name,
            "success": about["success"],
            "goal": json.dumps(about["goal"]),
            "objects": about["objects"],
            "seed": about["seed"],
        })  # fmt: skip
        self._about = {"robot": about["model"], "names": recording.names}
        self.frames += count
        self._pictures.add(pictures)
        for key, rows in ((STATE, recording.state), (ACTION, action)):
            self._vectors[key].add(rows)
        return ""

    def finish(self) -> None:
        """Write what describes the episodes."""
        self._write(pa.Table.from_pylist(self.episodes), "meta/episodes/chunk-000/file-000.parquet")
        self._write(_task_table(self._tasks), "meta/tasks.parquet")
        stats = {key: one.to_dict() for key, one in self._vectors.items()} | {CAMERA: self._pictures.to_dict()}
        for name, content in (("info", self._info()), ("stats", stats)):
            (self.folder / "meta" / f"{name}.json").write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")

    def _info(self) -> dict[str, Any]:
        vector = {"dtype": "float32", "shape": [len(self._about["names"])], "names": self._about["names"]}
        features = {
            CAMERA: {"dtype": "image", "shape": [HEIGHT, WIDTH, 3], "names": ["height", "width", "channels"]},
            STATE: vector,
            ACTION: vector,
            **{key: _single("bool") for key in _FLAGS},
            "timestamp": _single("float32"),
            **{key: _single("int64") for key in _COUNTS},
        }
        return {
            "codebase_version": VERSION,
            "robot_type": self._about["robot"],
            "total_episodes": len(self.episodes),
            "total_frames": self.frames,
            "total_tasks": len(self._tasks),
            "chunks_size": _CHUNK,
            "data_files_size_in_mb": 100,
            "video_files_size_in_mb": 200,
            "fps": RATE,
            "splits": {"train": f"0:{len(self.episodes)}"},
            "data_path": _DATA,
            "video_path": None,
            "features": features,
        }

    def _write(self, table: pa.Table, name: str) -> None:
        path = self.folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        pq.write_table(table, path)


_PICTURE = pa.struct({"bytes": pa.binary(), "path": pa.string()})


def _single(kind: str) -> dict[str, Any]:
    return {"dtype": kind, "shape": [1], "names": None}


def _vectors(rows: np.ndarray) -> pa.Array:
    """Return vectors (T, n) as a column."""
    flat = pa.array(np.ascontiguousarray(rows, np.float32).reshape(-1))
    return pa.FixedSizeListArray.from_arrays(flat, rows.shape[1])


def _decoded(picture: bytes) -> np.ndarray:
    """Return a picture (240, 320, 3) uint8.

    Raises:
        OSError: if it is none.
        ValueError: if it has another size.
    """
    with Image.open(io.BytesIO(picture)) as image:
        if image.size != (WIDTH, HEIGHT):
            raise ValueError(f"it has {image.size[0]} x {image.size[1]} pixels, not {WIDTH} x {HEIGHT}")
        return np.asarray(image.convert("RGB"))


def _task_table(tasks: dict[str, int]) -> pa.Table:
    """Return the tasks as pandas stores a table whose index they are: readers look them up in the index."""
    table = pa.table({"task_index": list(tasks.values()), "task": list(tasks)})
    column = {"pandas_type": "int64", "numpy_type": "int64", "metadata": None}
    text = {"pandas_type": "unicode", "numpy_type": "object", "metadata": None}
    described = {
        "index_columns": ["task"],
        "column_indexes": [],
        "columns": [
            {"name": "task_index", "field_name": "task_index", **column},
            {"name": "task", "field_name": "task", **text},
        ],
        "pandas_version": "2.0.0",
    }
    return table.replace_schema_metadata({"pandas": json.dumps(described)})
