"""Compute the gap between the Jaco's fingers at every opening and height, from the dimensions in the URDF.

Levels are heights along the end_effector's +z (the approach): negative towards the palm, positive
towards and beyond the tips. The gap is between the inner surfaces of the thumb (+x) and of fingers
2 and 3 (-x).
"""

from __future__ import annotations

from functools import cache

import numpy as np

from agent.arm.arm_model import DEFAULT_MODEL, END_EFFECTOR, FINGER_TIPS, FINGERS, arm_model
from structdiffusion.geometry import pose_from_xyz_yaw, transform_points

PALM_LEVEL = -0.049  # m, the palm's surface
ANGLES = np.arange(0.0, 1.501, 0.05)  # rad, finger joint
LEVELS = np.arange(PALM_LEVEL, 0.0451, 0.003)
# m along a finger from the joint of its tip: what stops the finger there or before makes the tip fold (at 29 mm the two
# torques are even, see `agent.arm.controller.TIP_SHARE`).
FOLDS = 0.02
TIP = 0.03  # m beyond its joint that a tip touches what it folds onto
ALIKE = 0.001  # m: widths are known no better
ONTO = 0.03  # m: more overlap than one step of closing makes
# The boxes of the URDF: (centre x, centre y, size x, size y, size z) in the link frame.
_PROXIMAL = (0.021, -0.002, 0.046, 0.014, 0.017)
_DISTAL = (0.014, 0.0, 0.028, 0.010, 0.016)
_TIP = (0.0335, 0.003, 0.019, 0.004, 0.014)  # on the inner side, so that the tip is thin


def _surface(box: tuple[float, ...]) -> np.ndarray:
    """Sample points (P, 3) on a box's outline, close enough together for `LEVELS`."""
    cx, cy, sx, sy, sz = box
    x, y, z = np.meshgrid(
        cx + np.linspace(-sx, sx, 24) / 2, cy + np.array([-sy, sy]) / 2, np.array([-sz, sz]) / 2, indexing="ij"
    )
    return np.stack((x, y, z), axis=-1).reshape(-1, 3)


@cache
def _profile() -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return the thumb's inner x (A, L), the fingers' inner x (A, L), the farthest level that any of them reaches (A,),
    and that of the joints of their tips (A,), of all the least.
    """
    origins = arm_model(DEFAULT_MODEL).origins  # all models carry the same hand
    ee_from_last = np.linalg.inv(origins[END_EFFECTOR])
    thumb = np.full((len(ANGLES), len(LEVELS)), np.inf)
    others = np.full((len(ANGLES), len(LEVELS)), -np.inf)
    lowest, joints = np.empty(len(ANGLES)), np.full(len(ANGLES), np.inf)
    for a, angle in enumerate(ANGLES):
        reach = []
        for finger, tip in zip(FINGERS, FINGER_TIPS, strict=True):
            proximal = ee_from_last @ origins[finger] @ pose_from_xyz_yaw(0, 0, 0, angle)
            distal = proximal @ origins[tip]
            joints[a] = min(joints[a], distal[2, 3])
            points = np.concatenate(
                (
                    transform_points(proximal, _surface(_PROXIMAL)),
                    transform_points(distal, _surface(_DISTAL)),
                    transform_points(distal, _surface(_TIP)),
                )
            )
            reach.append(points[:, 2].max())
            for level, height in enumerate(LEVELS):
                near = points[np.abs(points[:, 2] - height) < 0.003, 0]
                if len(near) and finger == FINGERS[0]:
                    thumb[a, level] = near.min()
                elif len(near):
                    others[a, level] = max(others[a, level], near.max())
        lowest[a] = max(reach)
    return thumb, others, lowest, joints


@cache
def gaps() -> np.ndarray:
    """Return the gap, metres, at each of `ANGLES` and `LEVELS`; infinite beyond the tips."""
    thumb, others, *_ = _profile()
    return thumb - others


def reach(opening: float, closing: float) -> float:
    """Return the farthest distance, metres, that the closing fingers reach beyond the end effector between two
    angles.
    """
    angles = np.append(ANGLES[(opening < ANGLES) & (closing > ANGLES)], (opening, closing))
    return float(np.interp(angles, ANGLES, _profile()[2]).max())


@cache
def _reach_table() -> np.ndarray:
    """Return `reach` (A, A) from each of `ANGLES` to each later one."""
    lowest = _profile()[2]
    return np.stack([np.maximum.accumulate(np.roll(lowest, -a)) for a in range(len(ANGLES))])


def reaches(openings: np.ndarray, closings: np.ndarray) -> np.ndarray:
    """Return `reach` (B,) of openings and closings (B,) that are among `ANGLES`."""
    first, last = np.searchsorted(ANGLES, openings), np.searchsorted(ANGLES, closings)
    return _reach_table()[first, last - first]


def openings_for(widths: np.ndarray) -> np.ndarray:
    """Return the largest finger angles (B,), so the smallest openings, that pass `widths` (B, L) at each of `LEVELS`;
    NaN where none does.
    """
    passes = np.all(gaps() >= widths[:, None], axis=2)
    last = passes.shape[1] - 1 - passes[:, ::-1].argmax(axis=1)
    return np.where(passes.any(axis=1), ANGLES[last], np.nan)


@cache
def _inclines() -> tuple[np.ndarray, np.ndarray]:
    """Return how much wider the gap becomes on each side to one of `LEVELS` and from it on (A, L), m/m.

    A corner of the fingers lies where the two differ; the tips end with one.
    """
    step = 2 * (LEVELS[1] - LEVELS[0])
    wider = np.diff(np.where(np.isfinite(gaps()), gaps(), np.nan)) / step
    before = np.pad(wider, ((0, 0), (1, 0)), constant_values=np.nan)
    after = np.pad(wider, ((0, 0), (0, 1)), constant_values=np.nan)
    return np.where(np.isnan(before), after, before), np.where(np.isnan(after), np.inf, after)


def contacts(widths: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return where closing fingers first touch objects that are `widths` (B, L) wide.

    Zero width means nothing at that level. Fingers that would come down on the object, because
    they reach its level only when they are already closer together than its width, never touch it.

    Returns:
        The finger angles (B,), NaN where they never touch, and the inclines (B,) of the contacts: the tangent of the
        angle by which the fingers press the object out of the hand, negative where they draw it in.
    """
    meets = np.any((gaps() <= widths[:, None]) & (widths > 0.0)[:, None], axis=2)
    first = meets.argmax(axis=1)
    near = np.lib.stride_tricks.sliding_window_view(np.pad(widths, ((0, 0), (3, 3))), 7, axis=1)
    around = near.max(axis=2)  # within 1 cm: few points may be seen at one level
    overlap = np.where(widths > 0.0, around - gaps()[first], -np.inf).max(axis=1)
    angles = np.where(meets.any(axis=1) & (overlap <= ONTO), ANGLES[first], np.nan)
    return angles, _press_out(widths, first)


def _press_out(widths: np.ndarray, first: np.ndarray) -> np.ndarray:
    """Return the inclines (B,) of contacts with objects that are `widths` (B, L) wide, at the `ANGLES` `first` (B,)."""
    pressing = np.where(widths > 0.0, widths - gaps()[first], -np.inf)
    # How the object widens away from the palm, from each level to the next but one.
    slopes = (widths[:, 2:] - widths[:, :-2]) / (4 * (LEVELS[1] - LEVELS[0]))
    slopes[(widths[:, 2:] == 0.0) | (widths[:, :-2] == 0.0)] = 0.0
    sides = np.sort(np.stack([each[first] for each in _inclines()]), axis=0)
    joint = _profile()[3][first]
    row, level = np.arange(len(widths)), pressing.argmax(axis=1)
    # Of levels that press alike, the end of a tip on a shoulder and the face above it, the one that slides counts.
    alike = pressing >= pressing.max(axis=1, keepdims=True) - ALIKE
    inclines = np.where(alike, np.clip(np.pad(slopes, ((0, 0), (2, 0))), *sides), -np.inf).max(axis=1)
    # What stops a finger near the joint of its tip or before is held by the tip, which folds onto the side farther on.
    folded_at = np.minimum(np.searchsorted(LEVELS, joint + TIP), len(LEVELS) - 1)
    along = (LEVELS[level] - joint) * np.hypot(1.0, sides[0, row, level])
    folds = (along < FOLDS) & (widths[row, folded_at] > 0.0)
    return np.where(folds, slopes[row, folded_at - 2], inclines)
