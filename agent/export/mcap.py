"""Write recorded runs as MCAP files with the schemas of Foxglove, one file for each run.

| topic | schema | messages |
|---|---|---|
| `/camera/image` | CompressedImage (WebP) | every frame |
| `/camera/calibration` | CameraCalibration | one, at the beginning |
| `/joints`, `/gripper` | JointStates: positions of the arm's joints, of the fingers, rad | every frame |
| `/joints/commanded`, `/gripper/commanded` | JointStates: what they were told | every frame |
| `/tf` | FrameTransforms: world to `object/NAME`, `arm/base`, `arm/link_N`, `camera` | every frame |
| `/scene` | SceneUpdate: the table, and the bodies in their frames | one, at the beginning |
| `/log` | Log: what happened, in sentences; the name is the event's kind | one for each event |

Times are the arm's, from 0 at the first frame. The metadata record `run` has the instruction, the goal, the objects
that it counts, the success, the seed, and the model of the arm.
"""

from __future__ import annotations

import json
import math
import os
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import foxglove
import numpy as np
from foxglove import channels, messages

from agent.errors import BadInput, NotWritten, UsageError
from agent.export.recorded_runs import LeftOut, RecordedRun
from agent.reporting.build_recording import HEIGHT, RATE, WIDTH
from agent.reporting.recorded_scene import LogLine, RecordedScene
from structdiffusion.geometry import quaternion_from_matrix

SUFFIX = ".mcap"
LAYOUT = Path(__file__).with_name("foxglove_layout.json")  # shows these topics in Foxglove
WORLD, CAMERA = "world", "camera"
_NANOSECONDS = 1_000_000_000
_LEVELS = {"failed": messages.LogLevel.Error, "plan_failed": messages.LogLevel.Warning}
_TABLE_THICKNESS, _TABLE_COLOR = 0.02, (0.76, 0.64, 0.49)  # m
_OLD = "its recording has no poses: it was made before recordings had them; record the run again"


@dataclass(frozen=True)
class Exported:
    """What was exported.

    Attributes:
        files: one for each run, in the order of their names.
        frames, events: how many, of all runs together.
        left_out: the runs that could not be exported.
    """

    files: tuple[Path, ...]
    frames: int
    events: int
    left_out: tuple[LeftOut, ...]


def export_mcap(runs: Iterable[RecordedRun | LeftOut], out: Path) -> Exported:
    """Write runs as MCAP files; nothing is there before all of it is.

    Args:
        runs: one after the other; only one is kept in memory.
        out: a file that ends in .mcap, for one run; otherwise a folder, which must not exist, or be empty, with a file
            for each run.

    Raises:
        BadInput: if no run can be exported.
        UsageError: if there are several runs for one file.
        NotWritten: if it cannot be written.
    """
    written: list[tuple[str, RecordedScene]] = []
    left_out: list[LeftOut] = []
    single = out.suffix == SUFFIX
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=f".{out.name}-", dir=out.parent) as place:
            folder = Path(place) / "runs"
            for run in runs:
                if isinstance(run, LeftOut):
                    left_out.append(run)
                elif run.recording.scene is None:
                    left_out.append(LeftOut(run.name, _OLD))
                elif single and written:
                    raise UsageError(
                        f"--out {str(out)!r} is one file, and there are several runs, such as {written[0][0]} and "
                        f"{run.name}: name the folder of one with --runs, or a folder with --out"
                    )
                else:
                    path = _file(folder, run.name, out)
                    path.parent.mkdir(parents=True, exist_ok=True)
                    _write(run, run.recording.scene, path)
                    written.append((run.name, run.recording.scene))
            if not written:
                raise BadInput(f"no run can be exported; {left_out[0].name}: {left_out[0].reason}")
            os.replace(_file(folder, written[0][0], out) if single else folder, out)
    except OSError as error:
        raise NotWritten(f"cannot write {str(out)!r}: {error.strerror or error}") from error
    files = (out,) if single else tuple(_file(out, name, out) for name, _ in written)
    frames, events = (sum(map(len, parts)) for parts in zip(*((one.poses, one.log) for _, one in written), strict=True))
    return Exported(files, frames, events, tuple(left_out))


def _file(folder: Path, name: str, out: Path) -> Path:
    """Return the file of a run; the run of the folder itself is called as `out` is."""
    return folder / f"{out.stem if name == '.' else name}{SUFFIX}"


def _write(run: RecordedRun, scene: RecordedScene, path: Path) -> None:
    """Write one run, its messages in the order of their times."""
    context = foxglove.Context()
    with foxglove.open_mcap(path, context=context) as writer:
        writer.write_metadata("run", _described(run.recording.about))
        channels.CameraCalibrationChannel("/camera/calibration", context=context).log(_calibration(scene), log_time=0)
        channels.SceneUpdateChannel("/scene", context=context).log(_bodies(scene), log_time=0)
        frames = _Frames(run, scene, context)
        log = channels.LogChannel("/log", context=context)
        waiting = list(scene.log)
        for number in range(len(scene.poses)):
            time = number * _NANOSECONDS // RATE
            while waiting and _nanoseconds(waiting[0]) <= time:
                _log(log, waiting.pop(0))
            frames.write(number, time)
        for line in waiting:
            _log(log, line)


class _Frames:
    """Writes the messages of every frame."""

    def __init__(self, run: RecordedRun, scene: RecordedScene, context: foxglove.Context) -> None:
        self._run, self._scene = run, scene
        self._image = channels.CompressedImageChannel("/camera/image", context=context)
        self._tf = channels.FrameTransformsChannel("/tf", context=context)
        topics = ("/joints", "/gripper", "/joints/commanded", "/gripper/commanded")
        self._joints = {topic: channels.JointStatesChannel(topic, context=context) for topic in topics}
        self._camera = _row(scene.world_from_camera)

    def write(self, number: int, time: int) -> None:
        """Write the messages of a frame; `time` in nanoseconds."""
        recording, stamp = self._run.recording, _timestamp(time)
        image = messages.CompressedImage(
            timestamp=stamp, frame_id=CAMERA, data=recording.pictures[number], format="webp"
        )
        self._image.log(image, log_time=time)
        arm = len(recording.about["joints"])
        for topic, channel in self._joints.items():
            values = (recording.commanded if topic.endswith("/commanded") else recording.state)[number]
            part = slice(None, arm) if topic.startswith("/joints") else slice(arm, None)
            joints = [
                messages.JointState(name=name, position=position)
                for name, position in zip(recording.names[part], values[part].tolist(), strict=True)
            ]
            channel.log(messages.JointStates(timestamp=stamp, joints=joints), log_time=time)
        transforms = [_transform(WORLD, frame, row, stamp) for frame, row in self._moving(number)]
        transforms.append(_transform(WORLD, CAMERA, self._camera, stamp))
        self._tf.log(messages.FrameTransforms(transforms=transforms), log_time=time)

    def _moving(self, number: int) -> Iterator[tuple[str, list[float]]]:
        """Yield the frames that are there, and their poses."""
        for body, row in zip(self._scene.bodies, self._scene.poses[number].tolist(), strict=True):
            if all(map(math.isfinite, row)):
                yield object_frame(body.name), row
        for link, row in zip(self._scene.links, self._scene.link_poses[number].tolist(), strict=True):
            yield link_frame(link), row


def object_frame(name: str) -> str:
    """Return the name of an object's frame."""
    return f"object/{name}"


def link_frame(link: int) -> str:
    """Return the name of the frame of a link of the arm."""
    return "arm/base" if link < 0 else f"arm/link_{link}"


def _described(about: Mapping[str, Any]) -> dict[str, str]:
    """Return what is known of the run, as texts."""
    keys = ("instruction", "goal", "objects", "success", "seed", "model")
    return {key: about[key] if isinstance(about[key], str) else json.dumps(about[key]) for key in keys}


def _calibration(scene: RecordedScene) -> messages.CameraCalibration:
    lens = scene.intrinsics
    return messages.CameraCalibration(
        timestamp=_timestamp(0),
        frame_id=CAMERA,
        width=WIDTH,
        height=HEIGHT,
        distortion_model="plumb_bob",
        D=[0.0] * 5,
        K=lens.ravel().tolist(),
        R=np.eye(3).ravel().tolist(),
        P=np.hstack((lens, np.zeros((3, 1)))).ravel().tolist(),
    )


def _bodies(scene: RecordedScene) -> messages.SceneUpdate:
    """Return the table, the objects and the arm's solids, each in its own frame."""
    x_min, x_max, y_min, y_max = scene.table
    middle = [(x_min + x_max) / 2, (y_min + y_max) / 2, -_TABLE_THICKNESS / 2, 0.0, 0.0, 0.0, 1.0]
    size = _vector([x_max - x_min, y_max - y_min, _TABLE_THICKNESS])
    table = messages.CubePrimitive(pose=_pose(middle), size=size, color=_color(_TABLE_COLOR))
    entities = [_entity("table", WORLD, cubes=[table])]
    for body in scene.bodies:
        surface = messages.TriangleListPrimitive(
            pose=_pose([0.0] * 6 + [1.0]),
            points=[messages.Point3(x=x, y=y, z=z) for x, y, z in body.vertices.tolist()],
            indices=body.faces.ravel().tolist(),
            color=_color(body.color),
        )
        entities.append(_entity(object_frame(body.name), object_frame(body.name), triangles=[surface]))
    for number, solid in enumerate(scene.solids):
        frame = link_frame(int(solid["link"]))
        about: dict[str, Any] = {
            "pose": _pose([*solid["position"], *solid["quaternion"]]),
            "size": _vector(solid["sides"]),
            "color": _color([part / 255 for part in solid["color"]]),
        }
        if solid["round"]:
            shape: Any = messages.CylinderPrimitive(bottom_scale=1.0, top_scale=1.0, **about)
        else:
            shape = messages.CubePrimitive(**about)
        kind = "cylinders" if solid["round"] else "cubes"
        entities.append(_entity(f"{frame}/solid_{number}", frame, **{kind: [shape]}))
    return messages.SceneUpdate(entities=entities)


def _entity(name: str, frame: str, **primitives: Any) -> messages.SceneEntity:
    """Return an entity that stays in its frame, wherever the frame goes."""
    return messages.SceneEntity(timestamp=_timestamp(0), frame_id=frame, id=name, frame_locked=True, **primitives)


def _log(channel: channels.LogChannel, line: LogLine) -> None:
    time, level = _nanoseconds(line), _LEVELS.get(line.kind, messages.LogLevel.Info)
    entry = messages.Log(timestamp=_timestamp(time), level=level, message=line.text, name=line.kind)
    channel.log(entry, log_time=time)


def _nanoseconds(line: LogLine) -> int:
    return round(line.time * _NANOSECONDS)


def _timestamp(time: int) -> messages.Timestamp:
    return messages.Timestamp(*divmod(time, _NANOSECONDS))


def _transform(parent: str, child: str, row: list[float], stamp: messages.Timestamp) -> messages.FrameTransform:
    return messages.FrameTransform(
        timestamp=stamp,
        parent_frame_id=parent,
        child_frame_id=child,
        translation=_vector(row[:3]),
        rotation=_quaternion(row[3:]),
    )


def _row(pose: np.ndarray) -> list[float]:
    """Return a pose (4, 4) as position and quaternion x, y, z, w."""
    return [*pose[:3, 3].tolist(), *quaternion_from_matrix(pose).tolist()]


def _pose(row: list[float]) -> messages.Pose:
    return messages.Pose(position=_vector(row[:3]), orientation=_quaternion(row[3:]))


def _vector(values: Any) -> messages.Vector3:
    x, y, z = map(float, values)
    return messages.Vector3(x=x, y=y, z=z)


def _quaternion(values: Any) -> messages.Quaternion:
    x, y, z, w = map(float, values)
    return messages.Quaternion(x=x, y=y, z=z, w=w)


def _color(values: Any) -> messages.Color:
    red, green, blue = map(float, values)
    return messages.Color(r=red, g=green, b=blue, a=1.0)
