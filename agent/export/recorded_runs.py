"""Find the recordings of runs in a folder; what cannot be read is named and left out."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from agent.errors import BadInput
from agent.reporting.build_recording import RECORDING, BuildRecording, read_recording

RUN_FILES = ("report.json", "session.jsonl")  # a folder with one of these is that of a run


@dataclass(frozen=True, eq=False)
class RecordedRun:
    """A run with its recording.

    Attributes:
        name: the run's folder, seen from the folder in which it was looked for.
        recording: the recording.
    """

    name: str
    recording: BuildRecording


@dataclass(frozen=True)
class LeftOut:
    """A run that cannot be exported, with the reason in a sentence."""

    name: str
    reason: str


def recorded_runs(folder: Path) -> Iterator[RecordedRun | LeftOut]:
    """Yield the runs in a folder and its subfolders, in the order of their names, one in memory at a time.

    All runs have the arm of the first one.

    Raises:
        BadInput: if there is no such folder, or no run in it.
    """
    if not folder.is_dir():
        raise BadInput(f"--runs must be a folder with runs, but there is no folder {str(folder)!r}")
    found = {path.parent for name in (*RUN_FILES, RECORDING) for path in folder.rglob(name)}
    # A batch that was killed leaves a hidden folder of unfinished rows.
    places = sorted(place for place in found if not any(part[0] == "." for part in place.relative_to(folder).parts))
    if not places:
        raise BadInput(f"no run is in {str(folder)!r}: `run --record` and `batch --record` make some")
    first: RecordedRun | None = None
    for place in places:
        name = place.relative_to(folder).as_posix()
        if not (place / RECORDING).exists():
            yield LeftOut(name, f"it has no {RECORDING}: it was made without --record, or the arm never moved")
            continue
        try:
            run = RecordedRun(name, read_recording(place / RECORDING))
        except BadInput as error:
            yield LeftOut(name, str(error))
            continue
        if first is not None and run.recording.names != first.recording.names:
            arms = run.recording.about["model"], first.recording.about["model"]
            yield LeftOut(name, f"its arm is a {arms[0]}, and that of {first.name} a {arms[1]}")
            continue
        first = first or run
        yield run
