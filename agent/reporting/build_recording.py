"""Record what the arm saw, felt and was told while it built: `recording.npz` of a run, with `--record`.

Ten frames a second of the arm's time, T in all, n joints:

| key | dtype, shape | what |
|---|---|---|
| `about` | str | JSON: schema_version, instruction, goal, objects, success, seed, model, joints, fingers, rate (Hz) |
| `joints` | float32 (T, n) | positions, rad |
| `fingers` | float32 (T, 3) | positions, rad; 0.0 is open |
| `commanded_joints` | float32 (T, n) | what the motors were told at that time, rad |
| `commanded_fingers` | float32 (T, 3) | likewise, rad |
| `pictures` | uint8 (B,) | all pictures of the fixed camera (240, 320, 3), WebP files one after the other |
| `ends` | int64 (T,) | where each of them ends |

`objects` are the names of the objects that the goal counts. The success is that of the whole run: one that was
interrupted has none. Since schema version 2 there are also the poses of all objects and links, and a log
(`agent.reporting.recorded_scene`).
"""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from agent.errors import BadInput, NotWritten
from agent.rendering.image_files import webp_of
from agent.reporting.recorded_scene import RecordedScene, SceneRecorder
from agent.runtime.output_ownership import OwnFolder

if TYPE_CHECKING:
    from agent.event_base import Event
    from agent.scenes.table_scene import TableScene

RECORDING = "recording.npz"
SCHEMA_VERSION = 2
READABLE_VERSIONS = (1, 2)
RATE = 10  # Hz
HEIGHT, WIDTH = 240, 320  # pixels
_STEPS_PER_SECOND = 240
_EVERY = _STEPS_PER_SECOND // RATE  # physics steps between two frames
_ABOUT = {
    "instruction": str, "goal": dict, "objects": list, "success": bool, "seed": int, "model": str, "joints": list,
    "fingers": list,
}  # fmt: skip
_MOST_BYTES = 2**30  # of a recording: hours of work


@dataclass(frozen=True, eq=False)
class BuildRecording:
    """The frames of one build.

    Attributes:
        about: instruction, goal, objects, success, seed, model of the arm, names of its joints and fingers.
        state: (T, n + 3) float32 positions of joints and fingers, rad.
        commanded: (T, n + 3) float32 what they were told, rad.
        pictures: T WebP files.
        scene: the objects and the arm in every frame; `None` in a recording of schema version 1.
    """

    about: Mapping[str, Any]
    state: np.ndarray
    commanded: np.ndarray
    pictures: tuple[bytes, ...]
    scene: RecordedScene | None = None

    @property
    def names(self) -> list[str]:
        """Return the names of the joints, then of the fingers."""
        return [*self.about["joints"], *self.about["fingers"]]


class BuildRecorder:
    """Watches the table while the arm builds, and takes the frames."""

    def __init__(self) -> None:
        self._steps = 0
        self._rows: list[tuple[np.ndarray, ...]] = []
        self._pictures: list[bytes] = []
        self._arm: dict[str, Any] = {}
        self._scene = SceneRecorder(WIDTH, HEIGHT)

    def on_event(self, event: Event) -> None:
        """Take what happens into the log, at the arm's present time."""
        self._scene.take_event(event, self._steps / _STEPS_PER_SECOND)

    def on_physics_step(self, table: TableScene) -> None:
        """Take a frame if one is due; to be called after every physics step."""
        if self._steps % _EVERY == 0:
            arm = table.arm
            model = arm.kinematics.model
            self._arm = {"model": model.name, "joints": list(model.joints), "fingers": list(model.hand.fingers)}
            row = (arm.configuration(), arm.finger_angles(), arm.set_point, arm.finger_set_point)
            self._rows.append(tuple(np.array(values, np.float32) for values in row))
            self._pictures.append(webp_of(table.world.picture(width=WIDTH, height=HEIGHT)))
            self._scene.take_frame(table)
        self._steps += 1

    def write(self, folder: Path, report: Mapping[str, Any]) -> Path | None:
        """Write the recording into the folder of a run; return its path, or `None` if the arm never moved.

        Args:
            folder: of the run.
            report: what became of it, as `agent.reporting.run_report` describes it.

        Raises:
            NotWritten: if it cannot be written.
        """
        if not self._rows or report["parse"] is None:
            return None
        about = {
            "schema_version": SCHEMA_VERSION,
            "rate": RATE,
            "instruction": report["instruction"],
            "goal": report["parse"]["goal"],
            "objects": report["parse"]["objects"] or _participants(report),
            "success": bool(report["outcome"] and report["outcome"]["success"]),
            "seed": report["options"]["seed"],
            **self._arm,
            "scene": self._scene.about(),
        }
        keys = ("joints", "fingers", "commanded_joints", "commanded_fingers")
        columns: dict[str, Any] = {
            key: np.stack(rows) for key, rows in zip(keys, zip(*self._rows, strict=True), strict=True)
        }
        columns |= self._scene.arrays()
        columns["about"] = np.array(json.dumps(about))
        columns["pictures"] = np.frombuffer(b"".join(self._pictures), np.uint8)
        columns["ends"] = np.cumsum([len(picture) for picture in self._pictures])
        buffer = io.BytesIO()
        np.savez(buffer, **columns)
        try:
            return OwnFolder(folder, "run").write(RECORDING, buffer.getvalue())
        except OSError as error:
            raise NotWritten(f"cannot write the recording into {str(folder)!r}: {error.strerror}") from error


def _participants(report: Mapping[str, Any]) -> list[str]:
    """Return the objects that take part: those that the goal of one structure counts."""
    return [one["name"] for one in report["scene"]["objects"] if one["takes_part"]] if report["scene"] else []


def read_recording(path: Path) -> BuildRecording:
    """Read the recording of a run.

    Raises:
        BadInput: if it cannot be read, or is none; the message names the reason.
    """
    try:
        if path.stat().st_size > _MOST_BYTES:
            raise BadInput(f"the recording {str(path)!r} has more than {_MOST_BYTES} bytes, and no more are read")
        if not zipfile.is_zipfile(path):
            raise BadInput(f"{str(path)!r} is not a recording of structagent: it is not an .npz file")
        with np.load(path, allow_pickle=False) as file:
            about = json.loads(str(file["about"]))
            state, commanded = (
                np.concatenate((file[f"{who}joints"], file[f"{who}fingers"]), axis=1) for who in ("", "commanded_")
            )
            data, ends = file["pictures"].tobytes(), file["ends"].tolist()
            scene = None
            if isinstance(about, dict) and "scene" in about:
                scene = RecordedScene.read(about["scene"], file["poses"], file["links"])
    except OSError as error:
        raise BadInput(f"cannot read the recording {str(path)!r}: {error.strerror or error}") from error
    except (ValueError, KeyError, TypeError, EOFError, zipfile.BadZipFile, IndexError) as error:
        raise BadInput(f"{str(path)!r} is not a recording of structagent: {error}") from error
    problem = _problem(about, state, commanded, data, ends)
    if scene is not None and not len(scene.poses) == len(scene.link_poses) == len(ends):
        problem = problem or f"it has {len(ends)} frames, and poses of {len(scene.poses)} and {len(scene.link_poses)}"
    if problem:
        raise BadInput(f"{str(path)!r} is not a recording of this structagent: {problem}")
    starts = [0, *ends[:-1]]
    pictures = tuple(data[start:end] for start, end in zip(starts, ends, strict=True))
    return BuildRecording(about, state.astype(np.float32), commanded.astype(np.float32), pictures, scene)


def _problem(about: Any, state: np.ndarray, commanded: np.ndarray, data: bytes, ends: list[int]) -> str:
    """Return what is wrong with the content of a recording; empty if nothing is."""
    known = isinstance(about, dict) and about.get("schema_version") in READABLE_VERSIONS
    if not known or about.get("rate") != RATE:
        versions = " or ".join(map(str, READABLE_VERSIONS))
        return f"it does not have the schema version {versions}, or not {RATE} frames a second"
    for key, kind in _ABOUT.items():
        if not isinstance(about.get(key), kind):
            return f"{key!r} is missing, or no {kind.__name__}"
    columns = len(about["joints"]) + len(about["fingers"])
    if not ends or state.shape != commanded.shape or state.shape != (len(ends), columns):
        return f"its arrays are {state.shape} and {commanded.shape}, and should be {(len(ends), columns)}"
    if not (np.isfinite(state).all() and np.isfinite(commanded).all()):
        return "not all positions are finite"
    if min(np.diff([0, *ends])) <= 0 or ends[-1] != len(data):
        return "its pictures are cut off"
    return ""
