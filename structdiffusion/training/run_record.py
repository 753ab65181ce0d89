"""The record of a training run: `training.json`, written beside the weights whenever they are saved.

Facts are recorded when they arise, so that a model card needs no manual input.
"""

from __future__ import annotations

import json
import platform
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import torch

from grounding.atomic_files import write_whole
from structdiffusion.data.npz_files import SHEET_NAME, DataFolderError
from structdiffusion.models.checkpoint import Checkpointed, CheckpointError, file_facts, parameter_count

RECORD_NAME = "training.json"
SCHEMA = "structagent-training/1"
# Fields that grow during a session; the others distinguish one session from the next.
_GROWING = ("last_step", "seconds", "steps_per_second", "examples_per_second")


@dataclass(frozen=True)
class RunMetadata:
    """Facts about a run that the training loop does not know.

    Attributes:
        version: of the program that trains.
        data: a description of the training data; JSON-ready.
        batch: how many examples each device takes per step.
        examples: what an example is, such as "scenes".
        precision: the precision of the network's computations; weights and geometry are always float32.
        start: sizes and checksums of the checkpoint that the first weights are from (`checkpoint.file_facts`); `None`
            for random ones.
    """

    version: str
    data: Mapping[str, Any]
    batch: int
    examples: str = "scenes"
    precision: str = "float32"
    start: Mapping[str, Any] | None = None


def about_data(folder: Path) -> dict[str, Any]:
    """Return the facts about the data to record: the folder's name and the core of its datasheet, if it has one.

    Raises:
        DataFolderError: for a datasheet that cannot be read.
    """
    path = folder / SHEET_NAME
    try:
        sheet = json.loads(path.read_text()) if path.is_file() else {}
    except ValueError as error:
        again = f"`structagent generate --out {folder}` writes it anew"
        raise DataFolderError(f"{path} is not a datasheet; {again}") from error
    known = ("scenes", "seed", "library", "objects", "version", "sha256")
    return {"name": folder.resolve().name, **{name: sheet[name] for name in known if name in sheet}}


class TrainingRecord:
    """The record of one run, with a session for each period of training under the same conditions.

    Args:
        folder: of the run; a record there is continued.
        model: the model.
        options: of the training (`structdiffusion.training.loop.TrainingOptions`), JSON-ready.
        metadata: see `RunMetadata`.
        device: the device of the model.
        devices: how many train distributed.
        step: the first step of the session.
        spent: seconds of training before it, whether they are in the record or not.

    Raises:
        CheckpointError: for a record there that cannot be read.
    """

    def __init__(
        self,
        folder: Path,
        model: Checkpointed,
        options: Mapping[str, Any],
        metadata: RunMetadata,
        device: torch.device,
        devices: int,
        step: int,
        spent: float,
    ) -> None:
        self._path, self._model = folder / RECORD_NAME, model
        self._first_step, self._batch = step, metadata.batch * devices
        self._earlier = _sessions(self._path) if step and self._path.is_file() else []
        self._session = {
            "first_step": step,
            **asdict(metadata),
            "options": dict(options),
            "torch": torch.__version__,
            "device": torch.cuda.get_device_name(device) if device.type == "cuda" else f"CPU, {platform.machine()}",
            "devices": devices,
            "threads": torch.get_num_threads(),
        }
        self._seconds = spent
        last = self._earlier[-1] if self._earlier else {}
        if last.get("last_step", -1) >= step and _circumstances(last) == _circumstances(self._session):
            # The same run went on: one stretch. If it was killed before its state was saved, the record is ahead.
            self._earlier.pop()
            self._first_step = self._session["first_step"] = last["first_step"]
            self._seconds -= last["seconds"]

    def write(self, step: int, seconds: float, losses: Mapping[str, float]) -> None:
        """Write the record, with the checksums of the weights beside it.

        Args:
            step: how far the run is.
            seconds: the time of training so far, including earlier sessions.
            losses: the last row of the log.
        """
        seconds_here = seconds - self._seconds
        rate = (step - self._first_step) / max(seconds_here, 1e-9)
        session = {
            **self._session,
            "last_step": step,
            "seconds": round(seconds_here, 1),
            "steps_per_second": round(rate, 3),
            "examples_per_second": round(rate * self._batch, 1),
        }
        record = {
            "schema": SCHEMA,
            "kind": self._model.kind,
            "parameters": parameter_count(self._model),
            "steps": step,
            "seconds": round(seconds, 1),
            "losses": {name: round(value, 6) for name, value in losses.items()},
            "sessions": [*self._earlier, session],
            "files": file_facts(self._path.parent),
        }
        write_whole(self._path, json.dumps(record, indent=2) + "\n")


def _sessions(path: Path) -> list[dict[str, Any]]:
    try:
        return list(json.loads(path.read_text())["sessions"])
    except (ValueError, KeyError, TypeError) as error:
        raise CheckpointError(f"{path} is not a training record: move it away, or choose another folder") from error


def _circumstances(session: Mapping[str, Any]) -> dict[str, Any]:
    same = {name: value for name, value in session.items() if name not in (*_GROWING, "first_step")}
    return json.loads(json.dumps(same))  # what was read back has lists where tuples were written
