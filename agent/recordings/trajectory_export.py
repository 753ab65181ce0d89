"""Export the commands of the arm on the twin as files that a real Jaco can replay through ROS.

The .json file, in radians, seconds since the beginning, and rad/s:

| key | what |
|---|---|
| `schema_version` | 1 |
| `model` | "j2s7s300", "j2n6s300" or "j2s6s300" |
| `joints`, `fingers` | the names of the arm's joints and of the fingers, with their prefix |
| `segments` | in order, each beginning where the previous one ended |
| `segments[].name` | what for: "reach mug 1", "close hand", ... |
| `segments[].start`, `.duration` | when it begins, and how long it takes |
| `segments[].arm` | `times` since its start, `positions` and `velocities` per time; `null` while the arm rests |
| `segments[].hand` | the same of the fingers, with `turns`, the driver's unit: 0 open to 6800 closed |

A bag (.bag for ROS 1, .mcap or a folder for ROS 2) holds the same, stamped with when each segment begins:

| topic | type | what |
|---|---|---|
| `/PREFIX_driver/trajectory_controller/command` | trajectory_msgs/JointTrajectory | the arm, one message a segment |
| `/PREFIX_driver/fingers/command` | trajectory_msgs/JointTrajectory | the fingers, rad; the driver has no such topic |
| `/PREFIX_driver/out/joint_state` | sensor_msgs/JointState | how the twin moved, for RViz |

No joint exceeds the manufacturer's speed limit, and continuous joints continue from their recorded turns.
"""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from agent.arm.arm_model import ArmModel
from agent.arm.jaco_hand import FINGER_TIPS, FINGERS
from agent.errors import BadInput, UsageError
from structdiffusion.simulation.world import TIME_STEP

if TYPE_CHECKING:
    from agent.arm.simulated_arm import SimulatedArm
    from agent.recordings.bag_writer import BagWriter

SCHEMA_VERSION = 1
SUFFIXES = (".json", ".bag", ".mcap", "")
_ARM, _HAND, _MOVED = "trajectory_controller/command", "fingers/command", "out/joint_state"  # after the driver's name
EVERY = 12  # physics steps of 1/240 s between two points: 20 Hz
MARGIN = 0.999  # of the speed limits that is used, so that no rounding exceeds them
CLOSED_TURNS, CLOSED_DEGREES = 6800.0, 80.0  # of a finger, in the driver's unit and as its joint


@dataclass(frozen=True, eq=False)
class Motion:
    """One commanded motion of the arm.

    Attributes:
        name: what for.
        start: s since the beginning of the log.
        times: (T,) s since `start`, increasing from 0.
        joints: (T, n) rad, commanded. fingers: (T, 3) rad, commanded.
        moved: (T, n + 3) rad, the positions of the twin's joints and fingers at these times.
    """

    name: str
    start: float
    times: np.ndarray
    joints: np.ndarray
    fingers: np.ndarray
    moved: np.ndarray


@dataclass(frozen=True, eq=False)
class _Sample:
    steps: int
    joints: np.ndarray
    fingers: np.ndarray
    moved: np.ndarray


class TrajectoryLog:
    """A record of the commands of the arm: pass it to one or more calls of `agent.arm.executor.build_structure`."""

    def __init__(self) -> None:
        self._begun: list[tuple[str, list[_Sample]]] = []
        self._steps = 0

    def begin(self, doing: str, arm: SimulatedArm) -> None:
        """Begin a motion; one of the same name continues."""
        now = self._sample(arm)
        if self._begun:
            self._begun[-1][1].append(now)
        if not self._begun or self._begun[-1][0] != doing:
            self._begun.append((doing, [now]))

    def step(self, arm: SimulatedArm) -> None:
        """Record that a physics step is done."""
        self._steps += 1
        if self._begun and self._steps % EVERY == 0:
            self._begun[-1][1].append(self._sample(arm))

    def _sample(self, arm: SimulatedArm) -> _Sample:
        moved = np.concatenate((arm.configuration() + arm.wound, arm.finger_angles()))
        return _Sample(self._steps, arm.set_point + arm.wound, arm.finger_set_point.copy(), moved)

    def motions(self, model: ArmModel) -> list[Motion]:
        """Return all motions so far that take time, in order, no faster than the model's limits.

        Commands that the simulation executes at once, such as opening the hand, take the time that a real arm needs.
        """
        motions: list[Motion] = []
        start = 0.0
        for name, samples in self._begun:
            joints, fingers = (np.array([getattr(each, key) for each in samples]) for key in ("joints", "fingers"))
            needed = [
                np.diff([each.steps for each in samples]) * TIME_STEP,
                np.abs(np.diff(joints, axis=0) / (MARGIN * model.velocity)).max(axis=1),
                np.abs(np.diff(fingers, axis=0) / (MARGIN * model.hand.speed)).max(axis=1),
            ]
            times = np.concatenate(([0.0], np.cumsum(np.max(needed, axis=0))))
            later = np.concatenate(([True], np.diff(times) > 0.0))
            if times[-1] > 0.0:
                moved = np.array([each.moved for each in samples])
                motions.append(Motion(name, start, times[later], joints[later], fingers[later], moved[later]))
            start += float(times[-1])
        return motions


def check_export(path: Path) -> None:
    """Check early whether a trajectory can be written there; only an existing trajectory may be replaced.

    Raises:
        UsageError: for a suffix that is not known, or something else that is there.
        BadInput: if nothing can be written.
    """
    if path.suffix.lower() not in SUFFIXES:
        raise UsageError(
            f"a trajectory cannot be written to {str(path)!r}; legal: a file that ends in .json, .bag (ROS 1) or "
            ".mcap (ROS 2), or the name of a folder (ROS 2)"
        )
    if os.path.lexists(path) and not _is_trajectory(path):
        raise UsageError(
            f"a trajectory must be a new file, or replace another one, but {str(path)!r} is something else"
        )
    with _writing(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=path.parent):
            pass


def _is_trajectory(path: Path) -> bool:
    """Return whether a file was written by `write_trajectory`, and is not a recording."""
    if path.suffix.lower() == ".json":
        try:
            content = json.loads(path.read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return False
        return isinstance(content, dict) and {"schema_version", "joints", "segments"} <= set(content)
    from agent.recordings.bag_reader import open_bag

    try:
        with open_bag(path) as bag:
            topics = [stream.topic for stream in bag.streams]
    except BadInput:
        return False
    commanded = [topic.endswith((_ARM, _HAND)) for topic in topics]
    return any(commanded) and all(
        known or topic.endswith(_MOVED) for known, topic in zip(commanded, topics, strict=True)
    )


@contextmanager
def _writing(path: Path) -> Iterator[None]:
    """Convert errors of writing to `BadInput` with one sentence."""
    try:
        yield
    except OSError as error:
        raise BadInput(f"cannot write {str(path)!r}: {error.strerror or error}") from error


def write_trajectory(log: TrajectoryLog, path: Path, prefix: str, model: ArmModel) -> bool:
    """Write the commands of the arm; return whether there were any.

    Args:
        log: listened to the arm.
        path: .json, .bag, .mcap, or no suffix for the folder of a ROS 2 bag, as for `check_export`.
        prefix: of the joints' names in the recording, such as "j2s7s300_".
        model: which arm it was.

    Raises:
        UsageError, BadInput: if it cannot be written.
    """
    check_export(path)
    motions = log.motions(model)
    if not motions:
        return False
    if path.suffix.lower() == ".json":
        with _writing(path):
            path.write_text(json.dumps(_document(motions, prefix, model)) + "\n", encoding="utf-8")
        return True
    from agent.recordings.bag_writer import BagWriter

    with BagWriter(path, force=True) as writer:
        _write_bag(writer, motions, prefix, model)
    return True


def _document(motions: list[Motion], prefix: str, model: ArmModel) -> dict[str, Any]:
    return {
        "schema_version": SCHEMA_VERSION,
        "model": model.name,
        "joints": [prefix + name for name in model.joints],
        "fingers": [prefix + name for name in FINGERS],
        "segments": [
            {
                "name": motion.name,
                "start": round(motion.start, 6),
                "duration": round(float(motion.times[-1]), 6),
                "arm": _points(motion.times, motion.joints),
                "hand": _hand(motion),
            }
            for motion in motions
        ],
    }


def _hand(motion: Motion) -> dict[str, Any] | None:
    points = _points(motion.times, motion.fingers)
    if points is not None:
        turns = np.degrees(motion.fingers) * CLOSED_TURNS / CLOSED_DEGREES
        points["turns"] = np.clip(turns, 0.0, CLOSED_TURNS).round(1).tolist()
    return points


def _points(times: np.ndarray, positions: np.ndarray) -> dict[str, Any] | None:
    if not np.ptp(positions, axis=0).any():
        return None
    return {
        "times": times.round(6).tolist(),
        "positions": positions.round(6).tolist(),
        "velocities": _velocities(times, positions).round(6).tolist(),
    }


def _velocities(times: np.ndarray, positions: np.ndarray) -> np.ndarray:
    """Return the velocity at each point; every motion begins and ends at rest."""
    velocities = np.gradient(positions, times, axis=0)
    velocities[[0, -1]] = 0.0
    return velocities


def _write_bag(writer: BagWriter, motions: list[Motion], prefix: str, model: ArmModel) -> None:
    from agent.recordings.message_builders import joints_message

    node = f"/{prefix or model.name + '_'}driver"
    arm_names, finger_names = ([prefix + name for name in names] for names in (model.joints, FINGERS))
    names = [*arm_names, *finger_names, *(prefix + name for name in FINGER_TIPS)]
    for motion in motions:
        for topic, moving, positions in (
            (f"{node}/{_ARM}", arm_names, motion.joints),
            (f"{node}/{_HAND}", finger_names, motion.fingers),
        ):
            if np.ptp(positions, axis=0).any():
                message = _trajectory_message(writer, moving, motion.start, motion.times, positions)
                writer.write(topic, message, motion.start)
        for time, moved in zip(motion.times, motion.moved, strict=True):
            angles = [*moved, 0.0, 0.0, 0.0]  # the driver cannot measure the finger tips
            when = motion.start + float(time)
            writer.write(f"{node}/{_MOVED}", joints_message(writer, names, angles, when), when)


def _trajectory_message(
    writer: BagWriter, names: list[str], start: float, times: np.ndarray, positions: np.ndarray
) -> Any:
    points = []
    for time, position, velocity in zip(times, positions, _velocities(times, positions), strict=True):
        seconds, nanoseconds = divmod(round(float(time) * 1e9), 10**9)
        points.append(
            writer.message(
                "trajectory_msgs/msg/JointTrajectoryPoint", positions=position, velocities=velocity,
                accelerations=np.zeros(0), effort=np.zeros(0),
                time_from_start=writer.message("builtin_interfaces/msg/Duration", sec=seconds, nanosec=nanoseconds),
            )
        )  # fmt: skip
    return writer.message(
        "trajectory_msgs/msg/JointTrajectory", header=writer.header(start), joint_names=names, points=points
    )
