"""Describe the Jaco's hand: a thumb (+x) and two fingers (-x), each with a tip that folds. Metres, radians, Nm."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from agent.arm.hand import Hand, inner_sides
from structdiffusion.geometry import pose_from_xyz_yaw, transform_points

FINGERS = tuple(f"joint_finger_{k}" for k in (1, 2, 3))  # the thumb first
FINGER_TIPS = tuple(f"joint_finger_tip_{k}" for k in (1, 2, 3))
FINGER_EFFORT = 2.0  # Nm
FINGER_SPEED = 1.0  # rad/s
FINGER_OPEN = 0.2  # rad
FINGER_CLOSED = 1.51  # rad
PALM_LEVEL = -0.049  # m, the palm's surface
# m along a finger from the joint of its tip: what stops the finger there or before makes the tip fold (at 29 mm the two
# torques are even, see `agent.arm.controller.TIP_SHARE`).
FOLDS = 0.02
NARROW = 0.022  # m: what is shorter than this along the fingers' row would slip between fingers 2 and 3,
PINCH = 0.017  # m: so it is taken between the thumb and finger 2, this far beside the hand's middle
# The boxes of the URDF: (centre x, centre y, size x, size y, size z) in the link frame.
_PROXIMAL = (0.021, -0.002, 0.046, 0.014, 0.017)
_DISTAL = (0.014, 0.0, 0.028, 0.010, 0.016)
_TIP = (0.0335, 0.003, 0.019, 0.004, 0.014)  # on the inner side, so that the tip is thin


def jaco_hand(origins: Mapping[str, np.ndarray], end_effector: str) -> Hand:
    """Return the hand.

    Args:
        origins: parent_from_joint (4, 4) of every joint by name; the last link of the arm is the fingers' parent.
        end_effector: the name of the joint of the end effector, on the same parent.
    """
    angles, levels = np.arange(0.0, 1.501, 0.05), np.arange(PALM_LEVEL, 0.0451, 0.003)
    ee_from_last = np.linalg.inv(origins[end_effector])
    thumb, others, tip_joints = zip(*(_points(origins, ee_from_last, angle) for angle in angles), strict=True)
    first_inner, others_inner, lowest = inner_sides(thumb, others, levels)
    return Hand(
        fingers=FINGERS,
        zero=np.zeros(3),
        rate=np.ones(3),
        tips=FINGER_TIPS,
        followers=(),
        coupled=False,
        angles=angles,
        levels=levels,
        first_inner=first_inner,
        others_inner=others_inner,
        lowest=lowest,
        tip_joints=np.array(tip_joints),
        open=FINGER_OPEN,
        tip_level=0.040,
        palm_level=PALM_LEVEL,
        palm_width=0.045,
        lateral=0.032,
        row_clearance=0.0,  # its row is so wide that it passes what is beside it too
        widest=0.165,
        side_clearance=0.008,
        flat_clearance=0.005,  # so that the fingers need not sweep the table
        least_clearance=0.008,
        narrow=NARROW,
        pinch=PINCH,
        folds=FOLDS,
        tip_length=0.03,
        rim_width=0.09,
        rim_openings=(0.8, 0.65),
        rim_reach=0.5,
        rim_closed=1.0,
        give=0.1,
        speed=FINGER_SPEED,
        effort=FINGER_EFFORT,
        # Fingers 2 and 3 press with half of a finger's effort each, against the thumb: the screw that drives a finger
        # cannot be driven back.
        grip_effort=FINGER_EFFORT / 2,
        squeeze=np.array([0.0, 0.2, 0.2]),
        locked=np.array([True, False, False]),
    )


def _surface(box: tuple[float, ...]) -> np.ndarray:
    """Sample points (P, 3) on a box's outline, close enough together for the levels."""
    cx, cy, sx, sy, sz = box
    x, y, z = np.meshgrid(
        cx + np.linspace(-sx, sx, 24) / 2, cy + np.array([-sy, sy]) / 2, np.array([-sz, sz]) / 2, indexing="ij"
    )
    return np.stack((x, y, z), axis=-1).reshape(-1, 3)


def _points(
    origins: Mapping[str, np.ndarray], ee_from_last: np.ndarray, angle: float
) -> tuple[np.ndarray, np.ndarray, float]:
    """Return points (P, 3) on the thumb and (Q, 3) on the fingers, and the least level of the joints of their tips."""
    points, joints = [], []
    for finger, tip in zip(FINGERS, FINGER_TIPS, strict=True):
        proximal = ee_from_last @ origins[finger] @ pose_from_xyz_yaw(0, 0, 0, angle)
        distal = proximal @ origins[tip]
        joints.append(distal[2, 3])
        parts = ((proximal, _PROXIMAL), (distal, _DISTAL), (distal, _TIP))
        points.append(np.concatenate([transform_points(pose, _surface(box)) for pose, box in parts]))
    return points[0], np.concatenate(points[1:]), min(joints)
