"""Collect the table of a run in three dimensions: bodies or clouds, and where they are in candidates and while built.

| key | value |
|---|---|
| `table` | x_min, x_max, y_min, y_max |
| `robot` | x, y, z of the arm's base, or `null` |
| `objects` | for each: `name`, `color` (RGB, 0 to 255), and `vertices` and `faces`, or `points` and `colors` |
| `views` | scene, goal, and build or (without the arm) released: `name`, `start` (the frame shown first), `frames` |
| `frames` | for each: `caption`, `motions`: for each object `null` or the upper three rows of a matrix, row by row |
| `film` | the build over time, as in `agent.reporting.build_film`, or `null` |

Lengths in metres, world frame; objects are where they were seen, and motions begin there. Vertices and points are
base64 of int16, tenths of a millimetre; faces of uint16; colours of uint8, RGB.
"""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from agent import events
from agent.event_base import Event
from agent.rendering.coarse_mesh import coarse_mesh
from agent.rendering.palette import FAINT, RGB, color_of, mean_color
from agent.rendering.text import number
from agent.reporting.build_film import UNITS, describe_film
from structdiffusion.observation import ObjectCloud

CANDIDATES = 20  # frames of the goal
_FACES = 600  # of a body
_POINTS = 500  # of a cloud
_DIGITS = 4  # of a motion
_PICTURED = ", through the camera"  # of the caption of a picture, and no part of what is seen in 3D
_STILL = 5e-5  # entries of a motion that differ by less are those of no motion

_Frame = dict[str, Any]


class TableModel:
    """The table of one run.

    It is made of parts, JSON values that come from live events: recorded events have neither bodies nor clouds, so
    session files hold the parts as well.
    """

    def __init__(self) -> None:
        self._seen: dict[str, Any] = {"table": [], "robot": None, "objects": []}
        self._candidates: list[_Frame] = []
        self._chosen = 0
        self._steps: list[tuple[str, Mapping[str, np.ndarray]]] = []  # captions, and motions (4, 4) of live events
        self._build: list[_Frame] = []
        self._released = False
        self._film: dict[str, Any] | None = None

    def on_event(self, event: Event) -> dict[str, Any] | None:
        """Take what an event says of the table; return it as a part for `take`, `None` if it says nothing."""
        part = self._part(event)
        if part is not None:
            self.take(part)
        return part

    def take(self, part: Mapping[str, Any]) -> None:
        """Take a part, as `on_event` returned it in this process or an earlier one; `part_error` finds none in it."""
        match part:
            case {"seen": seen}:
                self._seen = seen
            case {"candidates": candidates}:
                self._candidates = list(candidates)
            case {"chosen": rank, "frame": frame}:
                if rank > len(self._candidates):
                    self._candidates.append(frame)
                    rank = len(self._candidates)
                self._chosen = rank - 1
            case {"step": frame, "released": released}:
                self._build.append(frame)
                self._released = released
            case {"film": film}:
                self._film = film

    def _part(self, event: Event) -> dict[str, Any] | None:
        match event:
            case events.Perceived():
                base = None if event.base is None else np.round(event.base, _DIGITS).tolist()
                return {"seen": {"table": list(event.table), "robot": base, "objects": _objects(event)}}
            case events.Proposed():
                several = zip(event.candidates[:CANDIDATES], event.arrangements, strict=False)
                return {
                    "candidates": [
                        self._candidate(one.rank, one.scores, arrangement.goal_from_initial, event.scene.objects)
                        for one, arrangement in several
                    ]
                }
            case events.Chosen():
                goals, clouds = event.arrangement.goal_from_initial, event.scene.objects
                return {"chosen": event.rank, "frame": self._candidate(event.rank, event.scores, goals, clouds)}
            case events.Tried():
                self._released = True
            case events.Pictured() if event.motions and self._seen["objects"]:
                caption = event.caption.removesuffix(_PICTURED)
                self._steps.append((caption, event.motions))
                return {"step": self._frame(caption, event.motions), "released": self._released}
            case events.Filmed() if self._seen["objects"]:
                film = describe_film(event, [each["name"] for each in self._seen["objects"]], self._steps)
                return None if film is None else {"film": film}
        return None

    def to_dict(self) -> dict[str, Any] | None:
        """Return the model as JSON values; `None` if nothing was seen."""
        if not self._seen["objects"]:
            return None
        scene = self._frame("the table as it was seen", {})
        steps = self._build or ([scene] if self._film else [])
        views: list[dict[str, Any]] = [
            {"name": "scene", "start": 0, "frames": [scene]},
            {"name": "goal", "start": self._chosen, "frames": self._candidates},
            {"name": "released" if self._released else "build", "start": len(steps) - 1, "frames": steps},
        ]
        return {**self._seen, "views": [view for view in views if view["frames"]], "film": self._film}

    def _candidate(
        self, rank: int, scores: Mapping[str, float], motions: np.ndarray, clouds: Sequence[ObjectCloud]
    ) -> _Frame:
        total = scores.get("total")
        caption = f"candidate {rank}" + ("" if total is None else f", score {number(total, 3)}")
        return self._frame(caption, {cloud.name: motion for cloud, motion in zip(clouds, motions, strict=True)})

    def _frame(self, caption: str, motions: Mapping[str, np.ndarray]) -> _Frame:
        each_motion = [_motion(motions.get(each["name"])) for each in self._seen["objects"]]
        return {"caption": caption, "motions": each_motion}


def _objects(event: events.Perceived) -> list[dict[str, Any]]:
    scene = event.scene
    part = [_object(cloud, color_of(i), event.surfaces) for i, cloud in enumerate(scene.objects)]
    return part + [_object(cloud, FAINT, event.surfaces) for cloud in scene.distractors]


def _object(
    cloud: ObjectCloud, otherwise: RGB, surfaces: Mapping[str, tuple[np.ndarray, np.ndarray]]
) -> dict[str, Any]:
    """Describe an object by its body, or by its cloud where no body is known; `otherwise` where it has no colour."""
    color = mean_color(cloud.colors) or otherwise
    about = {"name": cloud.name, "color": list(color)}
    if cloud.name in surfaces:
        vertices, faces = coarse_mesh(*surfaces[cloud.name], _FACES)
        return about | {"vertices": _lengths(vertices), "faces": _base64(faces, "<u2")}
    chosen = np.linspace(0, len(cloud.points) - 1, min(len(cloud.points), _POINTS)).astype(int)
    colors = np.tile(color, (len(chosen), 1)) if cloud.colors is None else cloud.colors[chosen, :3]
    return about | {"points": _lengths(cloud.points[chosen]), "colors": _base64(colors, "u1")}


def _motion(motion: np.ndarray | None) -> list[float] | None:
    if motion is None or np.abs(motion - np.eye(4)).max() < _STILL or not np.isfinite(motion).all():
        return None
    return [round(value, _DIGITS) for value in motion[:3].ravel().tolist()]


def _lengths(points: np.ndarray) -> str:
    limits = np.iinfo(np.int16)
    return _base64(np.clip(np.round(np.asarray(points) * UNITS), limits.min, limits.max), "<i2")


def lengths_of(packed: str) -> np.ndarray:
    """Return the points (P, 3), metres, of an object's `vertices`."""
    return np.frombuffer(base64.b64decode(packed), "<i2").reshape(-1, 3).astype(np.float64) / UNITS


def _base64(values: np.ndarray, dtype: str) -> str:
    return base64.b64encode(np.ascontiguousarray(values).astype(dtype).tobytes()).decode("ascii")
