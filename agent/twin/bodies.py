"""Partly seen objects as rigid bodies: what the twin of a recorded scene is made of."""

from __future__ import annotations

import numpy as np

from agent.twin.completion import BEST, complete
from structdiffusion.geometry import pose_from_xyz_yaw
from structdiffusion.objects.model import ObjectModel, footprint_centroid
from structdiffusion.objects.solids import assemble
from structdiffusion.observation import ObjectCloud

DENSITY = 400.0  # kg/m^3: between an empty carton and a full can
FRICTION = 0.5
_GRAY = (0.62, 0.63, 0.65)


def body_of(
    cloud: ObjectCloud, world_from_camera: np.ndarray | None, method: str = BEST
) -> tuple[ObjectModel, np.ndarray]:
    """A rigid body for an object, and its pose world_from_object (4, 4): upright, and on its support.

    Args:
        cloud: what was seen of it.
        world_from_camera: (4, 4), or `None`.
        method: one of `agent.twin.completion.METHODS`.
    """
    parts = complete(cloud, world_from_camera, method).parts
    points = np.concatenate(parts)
    color = _GRAY
    if cloud.colors is not None and len(cloud.colors):
        color = tuple((np.median(cloud.colors, axis=0) / 255).tolist())
    model = assemble(
        cloud.name, cloud.category, parts, density=DENSITY, friction=FRICTION, color=color, source="recorded",
        rng=np.random.default_rng(0),
    )  # fmt: skip
    x, y = footprint_centroid(points[:, :2])
    return model, pose_from_xyz_yaw(x, y, float(points[:, 2].min()), 0.0)
