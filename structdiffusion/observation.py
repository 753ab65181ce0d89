"""Record types that pass between perception, planners and the arm, with their shapes, frames and units.

| key | dtype, shape | frame, unit | range |
|---|---|---|---|
| `Table.x_min` ... `y_max` | float | world, m | the table top's rectangle; its surface is z = 0 |
| `ObjectCloud.points` | float32 (P, 3) | world, m | the points that the camera saw of one object |
| `ObjectCloud.colors` | uint8 (P, 3) | RGB | 0 to 255; `None` if the camera has no colour |
| `ObjectCloud.bottom` | float | world, m | z of what it stands on; 0 is the table |
| `Scene.world_from_camera` | float64 (4, 4) | camera: z forward, x right, y down | |
| `Scene.color` | uint8 (H, W, 3) | RGB | 0 to 255 |
| `Scene.intrinsics` | float64 (3, 3) | pixels | of the pinhole camera that took `color` |
| `Arrangement.goal_from_initial` | float64 (N, 4, 4) | world to world, m | rigid motion of each object |

The world frame: the Jaco's mounting point projected on the table top; x away from the robot,
y to its left, z up.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from grounding.spec import StructureSpec


@dataclass(frozen=True)
class Table:
    """The table top's rectangle in the world frame, metres. The default is what the arm reaches."""

    x_min: float = 0.18
    x_max: float = 0.72
    y_min: float = -0.45
    y_max: float = 0.45

    def overhang(self, points_xy: np.ndarray) -> float:
        """Return how far, in metres, the points (P, 2) reach beyond the edge; 0 if all lie on the table."""
        low, high = points_xy.min(axis=0), points_xy.max(axis=0)
        return float(max(0.0, self.x_min - low[0], self.y_min - low[1], high[0] - self.x_max, high[1] - self.y_max))


@dataclass(frozen=True)
class ObjectCloud:
    """One segmented object as the camera saw it.

    Attributes:
        name: its name in reports, unique in its scene, such as "mug 2".
        category: its noun, such as "mug"; "object" if unknown.
        points: (P, 3) float32, world frame, metres; a partial view.
        colors: (P, 3) uint8 RGB, or `None`.
        bottom: z of what it stands on, world frame, metres; 0 is the table.
    """

    name: str
    category: str
    points: np.ndarray
    colors: np.ndarray | None = None
    bottom: float = 0.0

    @property
    def centroid(self) -> np.ndarray:
        """Return the mean point (3,): the position of the initial pose of paper section IV, whose rotation is zero."""
        return self.points.mean(axis=0)

    def on_the_table(self) -> ObjectCloud:
        """Return the cloud as if the object stood on the table: lowered straight down."""
        if self.bottom == 0.0:
            return self
        points = self.points - np.array([0.0, 0.0, self.bottom], dtype=self.points.dtype)
        return replace(self, points=points, bottom=0.0)


@dataclass(frozen=True)
class Scene:
    """The observed scene before anything moves.

    Attributes:
        objects: the N objects that take part, in the order of every array about them.
        table: the table top.
        distractors: objects that stay where they are and must not be touched.
        world_from_camera: (4, 4), or `None` for a cloud without a known camera.
        color: (H, W, 3) uint8 camera image, or `None`.
        intrinsics: (3, 3) of that image, pixels, or `None`.
        fixed: the indices of the objects that take part where they are, such as those that no hand can hold.
    """

    objects: tuple[ObjectCloud, ...]
    table: Table = field(default_factory=Table)
    distractors: tuple[ObjectCloud, ...] = ()
    world_from_camera: np.ndarray | None = None
    color: np.ndarray | None = None
    intrinsics: np.ndarray | None = None
    fixed: tuple[int, ...] = ()

    def on_the_table(self) -> Scene:
        """Return the scene as if everything stood on the table."""
        return replace(
            self,
            objects=tuple(cloud.on_the_table() for cloud in self.objects),
            distractors=tuple(cloud.on_the_table() for cloud in self.distractors),
        )

    def select(self, indices: Sequence[int]) -> Scene:
        """Select `indices` as the objects that take part; the others become distractors."""
        rest = tuple(cloud for i, cloud in enumerate(self.objects) if i not in set(indices))
        objects = tuple(self.objects[i] for i in indices)
        fixed = tuple(place for place, i in enumerate(indices) if i in self.fixed)
        return replace(self, objects=objects, distractors=self.distractors + rest, fixed=fixed)


@dataclass(frozen=True)
class StructureGoal:
    """The request to a planner: the slots, and the sentence with its embedding if there is one.

    Attributes:
        spec: the five slots.
        sentence: the instruction, or `None`.
        embedding: (384,) float32 sentence embedding, or `None`; sentence-conditioned models need it.
    """

    spec: StructureSpec
    sentence: str | None = None
    embedding: np.ndarray | None = None


@dataclass(frozen=True)
class Arrangement:
    """One proposed goal: where every object of the scene goes.

    Attributes:
        goal_from_initial: (N, 4, 4) float64, world frame: an initial point p of object i goes to
            `goal_from_initial[i] @ p` (paper section IV: goal_pose @ inverse(initial_pose)).
        scores: the ranking scores, each in [0, 1], larger is better; "total" decides, and `rerank_by_physics` decides
            among arrangements that were tried in physics.
        world_from_structure: (4, 4) the structure's frame, or `None`.
        order: the objects in the order in which they have to be placed; () for any order with supports first.
    """

    goal_from_initial: np.ndarray
    scores: Mapping[str, float] = field(default_factory=dict)
    world_from_structure: np.ndarray | None = None
    order: tuple[int, ...] = ()
