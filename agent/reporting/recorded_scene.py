"""Describe the table in a recording of a build: bodies and where they are in every frame, the camera, and a log.

A recording has two arrays (T frames, float32): `poses` (T, K, 7) of the K objects and `links` (T, L, 7) of the arm's
links, both in the world frame: x, y, z in metres, and a quaternion x, y, z, w. An object that is not on the table yet
has NaN. The rest is JSON, under the key `scene` of `about`:

| key | value |
|---|---|
| `table` | x_min, x_max, y_min, y_max of the table top, m |
| `camera` | `intrinsics` (3, 3) of the pictures, pixels; `world_from_camera` (4, 4), z forward, x right, y down |
| `objects` | of each: `name`, `color` (RGB, 0 to 1), and its surface: `vertices` in its frame, m, and `faces` |
| `links` | the numbers of the arm's links |
| `solids` | the arm's solids, as `agent.arm.visual_shapes.LinkShape` has them |
| `log` | what happened: `time` (s of the arm's time), `kind`, `text` |
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.spatial.transform import Rotation

from agent.event_base import json_value
from agent.rendering.coarse_mesh import coarse_mesh
from agent.rendering.text import slot_label
from agent.reporting.event_text import arm_sentence, remark_sentence, verdict_sentence

if TYPE_CHECKING:
    from agent.event_base import Event
    from agent.scenes.table_scene import TableScene

_FACES = 600  # of a body
_DIGITS = 5  # of a vertex, m
_REMARKS = ("asked", "answered", "noted", "commanded", "interjected", "forked", "restored")
_UNSAID = ("pictured", "filmed", "previewed", "finished")  # nothing to be read in a log


@dataclass(frozen=True, eq=False)
class Body:
    """An object of a recording.

    Attributes:
        name: its name on the table.
        color: RGB, 0 to 1.
        vertices: (V, 3) float64, in its own frame, metres.
        faces: (F, 3) int64 indices of vertices.
    """

    name: str
    color: tuple[float, float, float]
    vertices: np.ndarray
    faces: np.ndarray


@dataclass(frozen=True)
class LogLine:
    """One thing that happened: seconds of the arm's time since the first frame, the event's kind, and a sentence."""

    time: float
    kind: str
    text: str


@dataclass(frozen=True, eq=False)
class RecordedScene:
    """What stood on the table in every frame.

    Attributes:
        table: x_min, x_max, y_min, y_max, metres.
        intrinsics: (3, 3) of the pictures, pixels.
        world_from_camera: (4, 4), z forward, x right, y down.
        bodies: the K objects.
        poses: (T, K, 7) float32 world_from_object: position, metres, and quaternion x, y, z, w; NaN for an object that
            is not there yet.
        links: the numbers of the arm's L links.
        link_poses: (T, L, 7) float32 world_from_link, likewise.
        solids: the arm's solids, each with the keys of `agent.arm.visual_shapes.LinkShape`.
        log: what happened, in order.
    """

    table: tuple[float, ...]
    intrinsics: np.ndarray
    world_from_camera: np.ndarray
    bodies: tuple[Body, ...]
    poses: np.ndarray
    links: tuple[int, ...]
    link_poses: np.ndarray
    solids: tuple[Mapping[str, Any], ...]
    log: tuple[LogLine, ...]

    @classmethod
    def read(cls, about: Mapping[str, Any], poses: np.ndarray, links: np.ndarray) -> RecordedScene:
        """Read the scene of a recording.

        Args:
            about: the JSON under `scene`.
            poses, links: the arrays of a recording.

        Raises:
            ValueError, KeyError, TypeError: if they are none, or do not fit together.
        """
        bodies = tuple(
            Body(
                str(each["name"]),
                _numbers(each["color"], (3,)),
                np.array(each["vertices"], np.float64).reshape(-1, 3),
                np.array(each["faces"], np.int64).reshape(-1, 3),
            )
            for each in about["objects"]
        )
        for body in bodies:
            if len(body.faces) and not 0 <= body.faces.min() <= body.faces.max() < len(body.vertices):
                raise ValueError(f"a face of {body.name!r} has no such vertex")
        numbers = tuple(int(link) for link in about["links"])
        for name, array, count in (("poses", poses, len(bodies)), ("links", links, len(numbers))):
            if array.ndim != 3 or array.shape[1:] != (count, 7):
                raise ValueError(f"{name!r} is {array.shape}, and should be (T, {count}, 7)")
        solids = tuple(about["solids"])
        for solid in solids:
            if int(solid["link"]) not in numbers:
                raise ValueError(f"a solid of the arm belongs to the link {solid['link']}, which has no pose")
            for key, size in (("sides", 3), ("position", 3), ("quaternion", 4), ("color", 3)):
                _numbers(solid[key], (size,))
        camera = about["camera"]
        return cls(
            _numbers(about["table"], (4,)),
            np.array(_numbers(camera["intrinsics"], (3, 3))),
            np.array(_numbers(camera["world_from_camera"], (4, 4))),
            bodies,
            poses.astype(np.float32),
            numbers,
            links.astype(np.float32),
            solids,
            tuple(LogLine(float(one["time"]), str(one["kind"]), str(one["text"])) for one in about["log"]),
        )


def _numbers(values: Any, shape: tuple[int, ...]) -> Any:
    """Return nested tuples of numbers of a shape.

    Raises:
        ValueError: if they are not.
    """
    array = np.array(values, np.float64)
    if array.shape != shape or not np.isfinite(array).all():
        raise ValueError(f"{values!r} should be {' x '.join(map(str, shape))} numbers")
    return tuple(map(tuple, array.tolist())) if array.ndim == 2 else tuple(array.tolist())


class SceneRecorder:
    """Collects what is on the table in every frame, and what happens.

    Args:
        width, height: of the pictures, pixels.
    """

    def __init__(self, width: int, height: int) -> None:
        self._width, self._height = width, height
        self._about: dict[str, Any] = {}
        self._bodies: dict[str, dict[str, Any]] = {}
        self._poses: list[Mapping[str, np.ndarray]] = []
        self._links: list[Mapping[int, np.ndarray]] = []
        self._log: list[dict[str, Any]] = []
        self._names: list[str] = []  # of the scene's objects, those that take part first

    def take_frame(self, table: TableScene) -> None:
        """Take the present poses."""
        moment = table.film_camera.moment()
        self._poses.append(moment.objects)
        self._links.append(moment.links)
        for name, model in zip(table.names, table.models, strict=True):
            if name not in self._bodies:
                vertices, faces = coarse_mesh(model.mesh_vertices, model.mesh_faces, _FACES)
                surface = {"vertices": np.round(vertices, _DIGITS).tolist(), "faces": faces.tolist()}
                self._bodies[name] = {"name": name, "color": [float(part) for part in model.color], **surface}
        if not self._about:
            camera, area = replace(table.world.camera, width=self._width, height=self._height), table.world.table
            self._about = {
                "table": [area.x_min, area.x_max, area.y_min, area.y_max],
                "camera": {
                    "intrinsics": camera.intrinsics.tolist(),
                    "world_from_camera": camera.world_from_camera.tolist(),
                },
                "links": list(moment.links),
                "solids": [json_value(solid) for solid in table.film_camera.shapes],
            }

    def take_event(self, event: Event, time: float) -> None:
        """Take what happened at `time`, seconds of the arm's time."""
        payload = event.to_dict()
        if payload["kind"] == "perceived":
            self._names = [one["name"] for one in payload["objects"]]
        if payload["kind"] not in _UNSAID:
            text = _sentence(payload, self._names)
            self._log.append({"time": round(time, 4), "kind": payload["kind"], "text": text})

    def arrays(self) -> dict[str, np.ndarray]:
        """Return `poses` and `links`."""
        names, links = list(self._bodies), self._about["links"]
        return {"poses": _rows(self._poses, names), "links": _rows(self._links, links)}

    def about(self) -> dict[str, Any]:
        """Return the rest, as JSON values."""
        return {**self._about, "objects": list(self._bodies.values()), "log": self._log}


def _rows(moments: list[Mapping[Any, np.ndarray]], keys: list[Any]) -> np.ndarray:
    """Return the poses (4, 4) of each moment as rows (T, K, 7) float32; NaN where a moment has none."""
    rows = np.full((len(moments), len(keys), 7), np.nan, np.float32)
    for column, key in enumerate(keys):
        there = [index for index, moment in enumerate(moments) if key in moment]
        poses = np.stack([moments[index][key] for index in there])
        rows[there, column, :3] = poses[:, :3, 3]
        rows[there, column, 3:] = Rotation.from_matrix(poses[:, :3, :3]).as_quat()
    return rows


def _sentence(payload: Mapping[str, Any], names: list[str]) -> str:
    """Return an event's JSON form in a sentence."""
    match payload["kind"]:
        case "started":
            return f"instruction: {payload['instruction']}"
        case "parsed":
            slots = ", ".join(f"{slot_label(slot)} {value}" for slot, value in payload["spec"].items() if value)
            return f"understood: {'; '.join(payload.get('parts') or ()) or slots or 'any structure'}"
        case "perceived":
            return f"seen: {', '.join(one['name'] for one in payload['objects'])}"
        case "proposed":
            return f"{len(payload['candidates'])} arrangements proposed by {payload['model']}"
        case "chosen":
            return f"chose candidate {payload['rank']}"
        case "checked":
            return verdict_sentence(payload)
        case "failed":
            return payload["message"]
        case kind if kind in _REMARKS:
            return remark_sentence(payload)
    return arm_sentence(payload, names)
