"""Replay the episodes of a LeRobot dataset in the simulation: `python -m tests.agent.export.replay DATASET RUNS`.

Every episode begins on its run's table, set anew from its seed. Its actions go to the arm as they would go to a real
one: joints as trajectories, and fingers that are told otherwise as grips, because a hand that holds presses on, and ten
angles a second do not say how hard. Prints a row for each episode, and in the end how many agree with their runs.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq

from agent.pipeline.resources import ResourceCache
from agent.pipeline.run import RunOptions, run_instruction
from agent.reporting.build_recording import RATE, RECORDING, read_recording
from agent.robots.simulation import SimulatedLink
from agent.robots.trajectory import Grip, Trajectory
from agent.scenes.table_scene import TableScene
from structdiffusion.evaluation_protocol import MAX_TILT
from structdiffusion.geometry import pose_from_position_quaternion, tilt_between

RESTS = 1e-6  # rad: what moves less does not move
AGREES = 0.002  # m between where an object ends and where it ended in the run
SECONDS = 1.0  # after the last action, for everything to come to rest


@dataclass(frozen=True)
class Replayed:
    """An episode that was replayed.

    Attributes:
        run: its folder.
        offsets: name -> m between where the object ends and where it ended in the run.
        upright: whether no object has tilted otherwise than in the run.
    """

    run: str
    offsets: dict[str, float]
    upright: bool

    @property
    def agrees(self) -> bool:
        """Return whether everything ends as in the run."""
        return self.upright and max(self.offsets.values()) <= AGREES


class _TableUsed(BaseException):
    """Ends a run of which the table alone was needed; nothing between catches it. `table_poses` are those now."""

    def __init__(self, table_poses: Mapping[str, np.ndarray]) -> None:
        super().__init__()
        self.table_poses = table_poses


def act(table: TableScene, state: np.ndarray, actions: np.ndarray) -> None:
    """Send the actions (T, n + F) of an episode to the arm of a table, from the first state (n + F,), rad."""
    arm, count = SimulatedLink(table.world, table.arm), len(table.arm.joints)
    told = np.vstack((state, actions))
    grips = np.abs(np.diff(told[:, count:], axis=0)).max(axis=1) > RESTS
    ends = [*(np.flatnonzero(np.diff(grips)) + 1).tolist(), len(actions)]
    for first, end in zip([0, *ends[:-1]], ends, strict=True):
        part = told[first : end + 1]
        if grips[first]:
            _carry_out(arm, Grip("", part[-1, count:].copy()))
        if np.ptp(part[:, :count], axis=0).max() > RESTS or not grips[first]:
            _carry_out(arm, Trajectory("", np.arange(len(part)) / RATE, part[:, :count]))
    arm.wait(SECONDS)


def _carry_out(arm: SimulatedLink, motion: Grip | Trajectory) -> None:
    arm.send(motion)
    while arm.outcome() is None:
        arm.wait(1.0 / RATE)


def replayed(dataset: Path, runs: Path, model: str = "geometric") -> Iterator[Replayed]:
    """Replay the episodes of a data set on the tables of their runs, which that model built."""
    cache = ResourceCache()
    info = json.loads((dataset / "meta/info.json").read_text())
    for episode in pq.read_table(dataset / "meta/episodes/chunk-000/file-000.parquet").to_pylist():
        place = {"chunk_index": episode["data/chunk_index"], "file_index": episode["data/file_index"]}
        rows = pq.read_table(dataset / info["data_path"].format(**place))
        actions = np.array(rows["action"].to_pylist())
        options = RunOptions(model=model, seed=episode["seed"])
        act_on = partial(_act_on, np.array(rows["observation.state"][0].as_py()), actions)
        try:
            for _ in run_instruction(episode["tasks"][0], options, cache, on_table=act_on):
                pass
        except _TableUsed as used:
            yield _compared(episode["run"], used.table_poses, runs / episode["run"] / RECORDING)


def _act_on(state: np.ndarray, actions: np.ndarray, table: TableScene) -> None:
    act(table, state, actions)
    raise _TableUsed(table.poses())


def _compared(run: str, poses: Mapping[str, np.ndarray], recording: Path) -> Replayed:
    """Compare where objects are with the last frame of a recording."""
    scene = read_recording(recording).scene
    assert scene is not None
    ends = {body.name: row for body, row in zip(scene.bodies, scene.poses[-1], strict=True)}
    recorded = {name: pose_from_position_quaternion(row[:3], row[3:]) for name, row in ends.items()}
    offsets = {name: float(np.linalg.norm(poses[name][:3, 3] - recorded[name][:3, 3])) for name in recorded}
    return Replayed(run, offsets, all(tilt_between(poses[name], recorded[name]) < MAX_TILT for name in recorded))


def main() -> None:
    """Print a row for each episode, and what they come to."""
    rows: list[Replayed] = []
    for row in replayed(Path(sys.argv[1]), Path(sys.argv[2])):
        rows.append(row)
        worst = max(row.offsets, key=row.offsets.__getitem__)
        print(json.dumps({"run": row.run, "upright": row.upright, worst: round(row.offsets[worst], 4)}), flush=True)
    upright, agree = sum(row.upright for row in rows), sum(row.agrees for row in rows)
    print(f"{len(rows)} episodes: {upright} with nothing tilted otherwise than in the run, {agree} within 2 mm of it")


if __name__ == "__main__":
    main()
