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
interrupted has none.
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

from agent.arm.arm_model import FINGERS
from agent.errors import BadInput, NotWritten
from agent.rendering.image_files import webp_of
from agent.runtime.output_ownership import OwnFolder

if TYPE_CHECKING:
    from agent.scenes.table_scene import TableScene

RECORDING = "recording.npz"
SCHEMA_VERSION = 1
RATE = 10  # Hz
HEIGHT, WIDTH = 240, 320  # pixels
_EVERY = 24  # physics steps of 1/240 s between two frames
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
    """

    about: Mapping[str, Any]
    state: np.ndarray
    commanded: np.ndarray
    pictures: tuple[bytes, ...]

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

    def on_physics_step(self, table: TableScene) -> None:
        """Take a frame if one is due; to be called after every physics step."""
        if self._steps % _EVERY == 0:
            arm = table.arm
            model = arm.kinematics.model
            self._arm = {"model": model.name, "joints": list(model.joints), "fingers": list(FINGERS)}
            row = (arm.configuration(), arm.finger_angles(), arm.set_point, arm.finger_set_point)
            self._rows.append(tuple(np.array(values, np.float32) for values in row))
            self._pictures.append(webp_of(table.world.picture(width=WIDTH, height=HEIGHT)))
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
        }
        keys = ("joints", "fingers", "commanded_joints", "commanded_fingers")
        columns: dict[str, Any] = {
            key: np.stack(rows) for key, rows in zip(keys, zip(*self._rows, strict=True), strict=True)
        }
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
            raise BadInput(f"{str(path)!r} is not a recording of structagent: it is no .npz file")
        with np.load(path, allow_pickle=False) as file:
            about = json.loads(str(file["about"]))
            state, commanded = (
                np.concatenate((file[f"{who}joints"], file[f"{who}fingers"]), axis=1) for who in ("", "commanded_")
            )
            data, ends = file["pictures"].tobytes(), file["ends"].tolist()
    except OSError as error:
        raise BadInput(f"cannot read the recording {str(path)!r}: {error.strerror or error}") from error
    except (ValueError, KeyError, EOFError, zipfile.BadZipFile, IndexError) as error:
        raise BadInput(f"{str(path)!r} is not a recording of structagent: {error}") from error
    problem = _problem(about, state, commanded, data, ends)
    if problem:
        raise BadInput(f"{str(path)!r} is not a recording of this structagent: {problem}")
    starts = [0, *ends[:-1]]
    pictures = tuple(data[start:end] for start, end in zip(starts, ends, strict=True))
    return BuildRecording(about, state.astype(np.float32), commanded.astype(np.float32), pictures)


def _problem(about: Any, state: np.ndarray, commanded: np.ndarray, data: bytes, ends: list[int]) -> str:
    """Return what is wrong with the content of a recording; empty if nothing is."""
    if not isinstance(about, dict) or about.get("schema_version") != SCHEMA_VERSION or about.get("rate") != RATE:
        return f"it does not have the schema version {SCHEMA_VERSION}, or not {RATE} frames a second"
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
