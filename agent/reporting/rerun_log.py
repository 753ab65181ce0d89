"""Log a run for the Rerun viewer: clouds, camera, candidates, goal, and during the build the objects and the arm.

Everything is on one timeline, `physics`: the working time of the arm in seconds. Observations and proposals before
anything moved are at 0.

| entity | what |
|---|---|
| `world/table` | the table top |
| `world/camera/image` | the fixed camera and its picture |
| `world/objects/NAME` | a cloud, moving with its object |
| `world/candidates/rank_K` | the five best arrangements, hidden until they are asked for |
| `world/goal` | the chosen arrangement |
| `world/arm/link_K` | the arm's links |
| `story` | the same sentences as in the report |
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from agent import events
from agent.arm.events import ArmEvent
from agent.errors import UsageError
from agent.event_base import Event
from agent.rendering.palette import color_of, mean_color
from agent.reporting.event_text import arm_sentence
from structdiffusion.geometry import transform_points
from structdiffusion.observation import Arrangement, ObjectCloud, Scene

if TYPE_CHECKING:
    from agent.scenes.table_scene import TableScene

CANDIDATES = 5
EVERY = 24  # physics steps of 1/240 s between two looks at the objects and the arm: 0.1 s
_STEP = 1.0 / 240.0
_TIMELINE = "physics"
_POINT, _GOAL_POINT = 0.002, 0.0012  # m
_WOOD, _QUIET = (203, 181, 153), (150, 150, 150)
_TABLE_THICKNESS = 0.04  # m


class RerunLog:
    """Listens to the events of a run, watches its table, and writes both to a .rrd file; use it in a `with` block.

    Args:
        path: the file; one that is there is replaced.

    Raises:
        UsageError: without rerun-sdk, or when the file cannot be written.
    """

    def __init__(self, path: Path) -> None:
        try:
            import rerun
            import rerun.blueprint as blueprint
        except ImportError as error:
            message = "a recording for the Rerun viewer needs rerun-sdk: pip install 'structagent[viz]'"
            raise UsageError(message) from error
        self._rerun = rerun
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.open("wb").close()  # rerun's own error does not say why
        except OSError as error:
            raise UsageError(f"cannot write the recording {str(path)!r}: {error.strerror}") from error
        hidden: dict[Any, Any] = {
            f"world/candidates/rank_{rank}": blueprint.EntityBehavior(visible=False)
            for rank in range(1, CANDIDATES + 1)
        }
        views = blueprint.Horizontal(
            blueprint.Spatial3DView(origin="world", name="table", overrides=hidden),
            blueprint.Vertical(
                blueprint.Spatial2DView(origin="world/camera/image", name="camera"),
                blueprint.TextLogView(origin="story", name="story"),
            ),
            column_shares=[3, 1],
        )
        self._recording = rerun.RecordingStream("structagent")
        self._recording.save(path, default_blueprint=blueprint.Blueprint(views, collapse_panels=True))
        self._names: list[str] = []
        self._steps = 0
        self._seen: list[np.ndarray] | None = None  # where the objects were when they were looked at
        self._has_arm = False

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """End the file."""
        self._recording.flush()
        self._recording.disconnect()

    def on_event(self, event: Event) -> None:
        """Take one live event in."""
        match event:
            case events.Started():
                self._say(f"“{event.instruction}”")
            case events.Perceived():
                self._perceived(event.scene)
            case events.Proposed():
                for rank, arrangement in enumerate(event.arrangements[:CANDIDATES], start=1):
                    self._arrangement(f"world/candidates/rank_{rank}", event.scene, arrangement)
            case events.Chosen():
                self._arrangement("world/goal", event.scene, event.arrangement)
                self._say(f"chose candidate {event.rank}")
            case events.Checked():
                self._say("it stands as asked" if event.success else f"{event.failure_class}: {event.detail}")
            case events.Failed():
                self._say(event.message)
            case ArmEvent():
                self._say(arm_sentence(event.to_dict(), self._names))

    def on_physics_step(self, table: TableScene) -> None:
        """Log the objects and the arm every 0.1 s; to be called after every physics step of a build."""
        poses = table.world.poses() if self._seen is None or self._steps % EVERY == 0 else []
        if self._seen is None:
            self._seen = poses
        if self._steps % EVERY == 0:
            self._arm(table)
            for name, pose, seen in zip(table.names, poses, self._seen, strict=True):
                self._log(["world", "objects", name], self._transform(pose @ np.linalg.inv(seen)))
        self._steps += 1

    def _log(self, path: str | list[Any], *what: Any, static: bool = False) -> None:
        self._recording.set_time(_TIMELINE, duration=self._steps * _STEP)
        first, *rest = what
        self._recording.log(path, first, *rest, static=static)

    def _say(self, sentence: str) -> None:
        self._log("story", self._rerun.TextLog(sentence))

    def _transform(self, pose: np.ndarray) -> Any:
        return self._rerun.Transform3D(translation=pose[:3, 3], mat3x3=pose[:3, :3])

    def _perceived(self, scene: Scene) -> None:
        rerun, table = self._rerun, scene.table
        for stale in ("world/objects", "world/candidates", "world/goal") if self._names else ():
            self._log(stale, rerun.Clear(recursive=True))
        self._names = [cloud.name for cloud in (*scene.objects, *scene.distractors)]
        self._seen = None
        middle = ((table.x_min + table.x_max) / 2, (table.y_min + table.y_max) / 2, -_TABLE_THICKNESS / 2)
        sides = (table.x_max - table.x_min, table.y_max - table.y_min, _TABLE_THICKNESS)
        self._log("world/table", rerun.Boxes3D(centers=[middle], sizes=[sides], colors=[_WOOD], fill_mode="solid"))
        for cloud in (*scene.objects, *scene.distractors):
            path = ["world", "objects", cloud.name]
            self._log(path, self._transform(np.eye(4)))
            colors = _QUIET if cloud.colors is None else cloud.colors
            self._log(path, rerun.Points3D(cloud.points, colors=colors, radii=_POINT))
        if scene.color is not None and scene.intrinsics is not None and scene.world_from_camera is not None:
            height, width = scene.color.shape[:2]
            pinhole = rerun.Pinhole(
                image_from_camera=scene.intrinsics, width=width, height=height,
                camera_xyz=rerun.ViewCoordinates.RDF, image_plane_distance=0.2,
            )  # fmt: skip
            self._log("world/camera", self._transform(scene.world_from_camera))
            picture = np.ascontiguousarray(scene.color[..., :3])
            self._log("world/camera/image", pinhole, rerun.Image(picture).compress(jpeg_quality=90))

    def _arrangement(self, path: str, scene: Scene, arrangement: Arrangement) -> None:
        """Return the clouds of the objects that take part at their goals, in their own colours."""
        points, colors = _moved(scene.objects, arrangement.goal_from_initial)
        self._log(path, self._rerun.Points3D(points, colors=colors, radii=_GOAL_POINT))

    def _arm(self, table: TableScene) -> None:
        from agent.arm.visual_shapes import link_poses, link_shapes

        rerun = self._rerun
        if not self._has_arm:
            for number, shape in enumerate(link_shapes(table.arm)):
                place = {"centers": [shape.position], "quaternions": [shape.quaternion]}
                look: dict[str, Any] = {**place, "colors": [shape.color], "fill_mode": "solid"}
                width, _, length = shape.sides
                solid = (
                    rerun.Cylinders3D(lengths=[length], radii=[width / 2], **look)
                    if shape.round
                    else rerun.Boxes3D(sizes=[shape.sides], **look)
                )
                self._log(f"world/arm/link_{shape.link + 1}/solid_{number}", solid, static=True)
            self._has_arm = True
        for link, pose in link_poses(table.arm).items():
            self._log(f"world/arm/link_{link + 1}", self._transform(pose))


def _moved(clouds: Sequence[ObjectCloud], motions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the moved clouds: points (P, 3), and the colour of each point's object (P, 3)."""
    points = [transform_points(motion, cloud.points) for motion, cloud in zip(motions, clouds, strict=True)]
    colors = [
        np.tile(color_of(index, mean_color(cloud.colors)), (len(cloud.points), 1)) for index, cloud in enumerate(clouds)
    ]
    return np.concatenate(points), np.concatenate(colors).astype(np.uint8)
