"""Return the visual shapes of the arm: the cylinders and boxes of its links, and the poses of the links."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pybullet

from agent.arm.simulated_arm import SimulatedArm
from structdiffusion.geometry import pose_from_position_quaternion

_IN_A_JOINT = 0.96  # share of a link's diameter that its joint has: it stays within the links
_JOINT_LENGTH = 1.02  # of its diameter, as much as the links across it hide
BASE = -1  # stands for the base wherever links are counted, as in PyBullet


@dataclass(frozen=True)
class LinkShape:
    """A solid that belongs to a link.

    Attributes:
        link: the link's index, `BASE` for the base.
        sides: (3,) of a box, metres; of a cylinder about z its diameter twice, then its length.
        round: whether it is a cylinder.
        position: (3,) its middle in the link's frame, metres.
        quaternion: (4,) x, y, z, w: its rotation in the link's frame.
        color: RGB, 0 to 255.
    """

    link: int
    sides: tuple[float, float, float]
    round: bool
    position: tuple[float, float, float]
    quaternion: tuple[float, float, float, float]
    color: tuple[int, int, int]


def link_shapes(arm: SimulatedArm) -> list[LinkShape]:
    """Return every solid of the arm."""
    shapes = []
    for _, link, kind, size, _, position, quaternion, color, *_ in pybullet.getVisualShapeData(
        arm.body, physicsClientId=arm.client
    ):
        is_round = kind == pybullet.GEOM_CYLINDER
        length, radius, _ = size  # of a cylinder
        sides = (2 * radius, 2 * radius, length) if is_round else tuple(size)
        shapes.append(LinkShape(link, sides, is_round, position, quaternion, tuple(round(255 * c) for c in color[:3])))
    return shapes


def joint_shapes(arm: SimulatedArm) -> list[LinkShape]:
    """Return a cylinder for each joint between two links, which fills the gap where their solids do not meet."""
    found = []
    for link in arm.joints[1:]:
        round_ones = [shape for shape in link_shapes(arm) if shape.link == link and shape.round]
        if not round_ones:
            continue
        thinnest = min(round_ones, key=lambda shape: shape.sides[0])
        diameter = _IN_A_JOINT * thinnest.sides[0]
        sides = (diameter, diameter, _JOINT_LENGTH * diameter)
        found.append(LinkShape(link, sides, True, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), thinnest.color))
    return found


def link_poses(arm: SimulatedArm) -> dict[int, np.ndarray]:
    """Return the present world_from_link (4, 4) of every link, `BASE` first."""
    here = {"physicsClientId": arm.client}
    world_from_inertial = pose_from_position_quaternion(
        *map(np.array, pybullet.getBasePositionAndOrientation(arm.body, **here))
    )
    _, _, _, position, quaternion, *_ = pybullet.getDynamicsInfo(arm.body, BASE, **here)
    base_from_inertial = pose_from_position_quaternion(np.array(position), np.array(quaternion))
    poses = {BASE: world_from_inertial @ np.linalg.inv(base_from_inertial)}
    links = range(pybullet.getNumJoints(arm.body, **here))
    states = pybullet.getLinkStates(arm.body, list(links), computeForwardKinematics=True, **here)
    for link, state in zip(links, states, strict=True):
        poses[link] = pose_from_position_quaternion(np.array(state[4]), np.array(state[5]))
    return poses
