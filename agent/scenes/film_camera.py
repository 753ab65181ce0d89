"""Take pictures of a table as a person sees it who stands at the robot's right."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from threading import Lock
from typing import TYPE_CHECKING

import numpy as np

from agent.arm.simulated_arm import SimulatedArm
from agent.arm.visual_shapes import LinkShape, joint_shapes, link_poses, link_shapes
from agent.rendering.surfaces import Surface, box, cylinder
from structdiffusion.geometry import pose_from_position_quaternion, transform_points
from structdiffusion.objects.model import ObjectModel
from structdiffusion.simulation.depth_camera import BESIDE, VIEWS
from structdiffusion.simulation.world import TabletopWorld

if TYPE_CHECKING:
    from agent.rendering.ray_tracing import Stage

_OBJECT_GLOSS, _ARM_GLOSS = 0.12, 0.35
_BLACK = 60  # of 255: a darker part of the arm is shown as dark grey, so that its shape is visible
_GROWN = 0.004  # share by which every second and third part of the arm grows: surfaces in one place flicker


@dataclass(frozen=True, eq=False)
class Moment:
    """Where everything is at a moment.

    Attributes:
        objects: name -> world_from_object (4, 4).
        links: link of the arm -> world_from_link (4, 4), as in `agent.arm.visual_shapes`.
    """

    objects: Mapping[str, np.ndarray]
    links: Mapping[int, np.ndarray]


class FilmCamera:
    """A camera beside the arm, wherever the arm stands.

    What never moves is drawn once, for the first picture. Pictures may be taken in several threads.

    Args:
        world: the objects and the table.
        arm: the arm.
        models: the models of the objects by name.
        poses: returns world_from_object (4, 4) of each of them, by name.

    Attributes:
        lens: its place and its field of view.
        shapes: the solids of the arm.
    """

    def __init__(
        self,
        world: TabletopWorld,
        arm: SimulatedArm,
        models: Mapping[str, ObjectModel],
        poses: Callable[[], Mapping[str, np.ndarray]],
    ) -> None:
        self._arm, self._ground, self._models, self._poses = arm, world.ground, dict(models), poses
        motion = arm.kinematics.world_from_base @ np.linalg.inv(arm.model.mounted)
        usual = VIEWS[BESIDE]
        eye, target = transform_points(motion, np.array((usual.eye, usual.target))).tolist()
        self.lens = replace(usual, eye=tuple(eye), target=tuple(target))
        self.shapes: tuple[LinkShape, ...] = (*link_shapes(arm), *joint_shapes(arm))
        self._stage: Stage | None = None
        self._setting = Lock()

    def moment(self) -> Moment:
        """Return where everything is now."""
        return Moment(self._poses(), link_poses(self._arm))

    def picture(self, moment: Moment) -> np.ndarray:
        """Return a picture (H, W, 3) uint8 of a moment.

        Raises:
            ImportError, OSError: if Open3D cannot be loaded on this machine.
        """
        with self._setting:
            if self._stage is None:
                self._stage = self._set()
        links = [moment.links[shape.link] for shape in self.shapes]
        return self._stage.picture([*links, *(moment.objects[name] for name in self._models)])

    def _set(self) -> Stage:
        from agent.rendering.ray_tracing import Stage  # imports Open3D, which takes a second

        parts = [_part(shape, 1 + _GROWN * (number % 3)) for number, shape in enumerate(self.shapes)]
        models = self._models.values()
        objects = [Surface(model.mesh_vertices, model.mesh_faces, model.color, _OBJECT_GLOSS) for model in models]
        base = self._arm.kinematics.world_from_base[:3, 3].tolist()
        return Stage(self.lens, self._ground, base, parts + objects)


def _part(shape: LinkShape, size: float) -> Surface:
    """Return the surface of a part of the arm in its link's frame, `size` times as large."""
    if shape.round:
        vertices, faces = cylinder(shape.sides[0] / 2, shape.sides[2])
    else:
        half = [side / 2 for side in shape.sides]
        vertices, faces = box([-side for side in half], half)
    link_from_part = pose_from_position_quaternion(np.array(shape.position), np.array(shape.quaternion))
    color = np.array(shape.color) / 255
    if max(shape.color) < _BLACK:
        color = 0.10 + 0.85 * color
    return Surface(transform_points(link_from_part, size * vertices), faces, tuple(color.tolist()), _ARM_GLOSS)
