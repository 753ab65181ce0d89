"""Take pictures of the table while the arm builds, and tell what of them is the arm."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from agent.arm.self_filter import distance_to_solids
from agent.arm.simulated_arm import SimulatedArm
from structdiffusion.geometry import transform_points
from structdiffusion.simulation.depth_camera import CameraImage
from structdiffusion.simulation.world import TabletopWorld

ARM_MARGIN = 0.03  # m around the arm's collision solids, which are simpler than what the camera sees of it


class TableCamera:
    """The depth camera above the table, and the arm in its view.

    Args:
        world: takes the pictures.
        arm: is in them.
        rng: draws the sensor's noise.
    """

    def __init__(self, world: TabletopWorld, arm: SimulatedArm, rng: np.random.Generator) -> None:
        self._world, self._arm, self._rng = world, arm, rng
        self._depth, self._points = np.empty((0, 0)), np.empty((0, 0, 3))  # of the last picture

    def picture(self) -> CameraImage:
        """Take a picture in which nothing is measured where the arm is."""
        picture = self._world.look(self._rng)
        arm = ~self.off_arm(picture.points.reshape(-1, 3))
        depth, seen = picture.depth.copy(), picture.points.copy()
        depth.flat[arm] = np.nan
        seen.reshape(-1, 3)[arm] = np.nan
        self._depth, self._points = depth, seen
        return replace(picture, depth=depth, points=seen)

    def glance(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Take a picture with the arm in view, after a `picture` without it.

        Returns:
            Its points (H, W, 3), world frame, those of the last `picture`, and by how many metres (H, W) they are
            nearer now; NaN where either does not tell.
        """
        depth, points = self._world.measure(self._rng)
        return points, self._points, self._depth - depth

    def off_arm(self, points: np.ndarray) -> np.ndarray:
        """Return which points (P, 3) of a picture taken now do not show the arm."""
        kinematics = self._arm.kinematics
        joints = dict(zip(kinematics.model.joints, self._arm.configuration().tolist(), strict=True))
        joints |= self._arm.hand.joint_positions(self._arm.finger_angles())
        points = transform_points(np.linalg.inv(kinematics.world_from_base), points)
        near = np.flatnonzero(in_box(points, self._reach(joints)))
        off = np.ones(len(points), dtype=bool)
        off[near[distance_to_solids(points[near], kinematics.model, joints) < ARM_MARGIN]] = False
        return off

    def world_from_ee(self) -> np.ndarray:
        """Return the pose (4, 4) of the hand now, as the joints have it."""
        return self._arm.world_from_ee()

    def _reach(self, joints: Mapping[str, float]) -> np.ndarray:
        """Return the corners (2, 3) of a box around the arm in the frame of its base."""
        model = self._arm.kinematics.model
        poses = model.link_poses(joints)
        middles = np.array([(poses[solid.link] @ solid.link_from_solid)[:3, 3] for solid in model.solids])
        radii = np.array([np.linalg.norm(solid.sides) / 2 + ARM_MARGIN for solid in model.solids])[:, None]
        return np.stack(((middles - radii).min(axis=0), (middles + radii).max(axis=0)))


def in_box(points: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Return which points (P, 3) lie in a box with corners (2, 3); none that is NaN."""
    return ((points > corners[0]) & (points < corners[1])).all(axis=1)
