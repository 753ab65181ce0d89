"""Find grasps from the partial clouds of unseen objects, without object models.

There are three kinds, all with the hand pointing down or tilted by up to 40 degrees about its closing axis:

- "across": antipodal, the fingers on both sides of a cross-section of the cloud;
- "flat": the same for objects lower than 3 cm (cutlery): the fingers straddle the object, close to the table;
- "rim": one side of the hand inside, the other outside the rim of a hollow object (bowl, plate, cup).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from agent.arm.gripper import ANGLES, LEVELS, PALM_LEVEL, contact_angle, opening_for, reach

SIDE_CLEARANCE = 0.008  # m kept on each side between open fingers and the object
PALM_CLEARANCE = 0.006  # m
FLAT_SIDE_CLEARANCE = 0.005  # m, the same for flat things, so that the fingers need not sweep the table
FLOOR_CLEARANCE = 0.0005  # m between the lowest finger and what the object stands on
LATERAL = 0.032  # m: half the width of the hand's fingers side by side
WIDEST = 0.165  # m between the fingers
FLAT = 0.03  # m: lower than this is flat
NARROW = 0.022  # m: what is shorter than this along the fingers' row would slip between fingers 2 and 3,
PINCH = 0.015  # m: so it is taken between the thumb and finger 2, this far beside the hand's middle
FEWEST_POINTS = 10  # of a cloud that a hand can be fitted to
YAWS = 12
TILTS = (0.0, math.radians(20), math.radians(-20), math.radians(40), math.radians(-40))


@dataclass(frozen=True)
class Grasp:
    """A hand pose at which closing the fingers should hold the object.

    Attributes:
        world_from_ee: (4, 4) the hand when the fingers close: approach +z, closing along x.
        width: the width of the object between the fingers, metres.
        opening: finger joint angle, radians, while approaching.
        kind: "across", "flat" or "rim".
        quality: larger is better.
    """

    world_from_ee: np.ndarray
    width: float
    opening: float
    kind: str
    quality: float


def hand_pose(point: np.ndarray, yaw: float, tilt: float = 0.0) -> np.ndarray:
    """Return world_from_ee (4, 4) of a hand at `point` (3,) that closes along `yaw` and approaches from above.

    `tilt` turns it about its closing axis, so that it leans by that angle.
    """
    # Number by number: a search for grasps makes thousands of poses, and `np.cross` takes longer than all the rest.
    cos_yaw, sin_yaw, sin_tilt = math.cos(yaw), math.sin(yaw), math.sin(tilt)
    down_x, down_y, down_z = sin_tilt * sin_yaw, -sin_tilt * cos_yaw, -math.cos(tilt)
    return np.array(
        (
            (cos_yaw, -down_z * sin_yaw, down_x, point[0]),
            (sin_yaw, down_z * cos_yaw, down_y, point[1]),
            (0.0, down_x * sin_yaw - down_y * cos_yaw, down_z, point[2]),
            (0.0, 0.0, 0.0, 1.0),
        )
    )


def is_round(points: np.ndarray) -> bool:
    """Return whether the cloud (P, 3) is round: its extents in all horizontal directions agree within 12 %.

    Seen from above; a handle or a spout makes it not round.
    """
    angles = np.arange(12) * math.pi / 12
    along = points[:, :2] @ np.stack((np.cos(angles), np.sin(angles)))
    low, high = np.percentile(along, [1, 99], axis=0)
    extents = high - low
    return bool(extents.max() < 1.12 * extents.min() + 0.002)


def grasps_of(points: np.ndarray, support: float = 0.0, limit: int = 60) -> list[Grasp]:
    """Return the grasps of one object, best first.

    Args:
        points: (P, 3) its partial cloud, world frame, metres.
        support: z of the surface that it stands on.
        limit: the most grasps to return.
    """
    return sorted(_grasps(points, support), key=lambda grasp: -grasp.quality)[:limit]


def can_be_grasped(points: np.ndarray, support: float = 0.0) -> bool:
    """Return whether the object has any grasp, as `grasps_of` takes it; stops at the first."""
    return next(_grasps(points, support), None) is not None


def _grasps(points: np.ndarray, support: float) -> Iterator[Grasp]:
    points = np.asarray(points, dtype=np.float64)
    if len(points) >= FEWEST_POINTS:
        yield from _across(points, support)
        yield from _rim(points, support)


def _in_hand(points: np.ndarray, pose: np.ndarray) -> np.ndarray:
    """Transform the points (P, 3) into the end_effector frame."""
    return (points - pose[:3, 3]) @ pose[:3, :3]


def _widths(inside: np.ndarray, clearance: float) -> tuple[np.ndarray, np.ndarray]:
    """Return two (L,), metres, for each of `LEVELS`: the width that the open hand must pass, and that of the object
    there.

    Going down, the hand's level l passes everything that ends up at levels below l's height, that
    is between the palm and l.
    """
    there = np.zeros(len(LEVELS))
    bins = np.rint((inside[:, 2] - LEVELS[0]) / (LEVELS[1] - LEVELS[0])).astype(int)
    seen = (bins >= 0) & (bins < len(LEVELS))
    # Twice the farther side: the hand closes about its own middle.
    np.maximum.at(there, bins[seen], 2 * np.abs(inside[seen, 0]))
    there = np.maximum(there, np.maximum(np.append(there[1:], 0.0), np.append(0.0, there[:-1])))
    passing = np.maximum.accumulate(there)
    return np.where(passing > 0.0, passing + 2 * clearance, 0.0), there


def _fitted(
    points: np.ndarray, near: np.ndarray, contact: np.ndarray, yaw: float, tilt: float, depth: float, support: float
) -> tuple[np.ndarray, float, float] | None:
    """Return a hand pose whose finger tips end `depth` below `contact` (3,), with its opening and width; `None` if
    none fits.

    Args:
        points: the whole object's cloud, which must stay clear of the palm.
        near: the part of it that comes between the fingers.
    """
    approach = hand_pose(contact, yaw, tilt)[:3, 2]
    # Leaning fingers reach lower on one side.
    lean = LATERAL * abs(math.sin(tilt))
    clearance = FLAT_SIDE_CLEARANCE if contact[2] - support < FLAT else SIDE_CLEARANCE
    farthest = reach(0.0, ANGLES[-1])
    for attempt in range(4):
        position = contact + approach * (depth - 0.006 * attempt - 0.040)
        for _ in range(2):  # how low the fingers reach depends on how far they close, and that on the height
            lowest = position[2] - farthest * math.cos(tilt) - lean
            position[2] += max(0.0, support + FLOOR_CLEARANCE - lowest)
            pose = hand_pose(position, yaw, tilt)
            levels = _in_hand(points, pose)
            above_palm = levels[np.abs(levels[:, 0]) < 0.045, 2]
            room = PALM_LEVEL + PALM_CLEARANCE
            if len(above_palm) and above_palm.min() < room and np.percentile(above_palm, 1) < room:
                break
            inside = _in_hand(near, pose)
            passing, there = _widths(inside, clearance)
            opening, closing = opening_for(passing), contact_angle(there)
            if opening is None or closing is None or closing < opening or there.max() > WIDEST:
                break
            lower = farthest - reach(opening, closing)
            if contact[2] - support >= FLAT or lower < 5e-4:
                return pose, opening, float(there.max())
            farthest -= lower
            position[2] -= lower
        else:
            return pose, opening, float(there.max())
    return None


def _across(points: np.ndarray, support: float) -> Iterator[Grasp]:
    low, high = np.percentile(points[:, 2], [1, 99])
    top, middle = float(high), np.median(points[:, :2], axis=0)
    corners = np.percentile(points[:, :2], [2, 98], axis=0)
    middle = 0.5 * middle + 0.5 * corners.mean(axis=0)
    height = top - support
    kind = "flat" if height < FLAT else "across"
    depths = (height + 0.02,) if kind == "flat" else (0.05, 0.035, 0.022)
    for yaw in np.arange(YAWS) * math.pi / YAWS:
        closing = np.array([math.cos(yaw), math.sin(yaw)])
        side = np.array([math.sin(yaw), -math.cos(yaw)])
        across, along = (points[:, :2] - middle) @ closing, (points[:, :2] - middle) @ side
        half = 0.5 * np.subtract(*np.percentile(along, [97, 3]))
        # Long things can also be taken off their middle.
        offsets = (0.0,) if half < 0.05 else (0.0, 0.3 * half, -0.3 * half)
        for offset in offsets:
            slab = np.abs(along - offset) < LATERAL
            for depth in depths:
                section = slab & (points[:, 2] > top - depth - 0.01)
                if section.sum() < 6:
                    continue
                local_top = float(np.percentile(points[section, 2], 97))
                ends = np.percentile(across[section], [2, 98])
                center = middle + closing * ends.mean() + side * offset
                contact = np.array([*center, local_top])
                narrow = np.abs(along[section] - offset).max() < NARROW
                for tilt in TILTS:
                    fitted = _fitted(points, points[section], contact, yaw, tilt, depth, support)
                    if fitted is None:
                        continue
                    pose, opening, width = fitted
                    quality = (
                        1.0
                        - 3.0 * width
                        - 3.0 * abs(offset)
                        - 0.25 * abs(tilt)
                        + 3.0 * min(depth, 0.05)
                        - 1.5 * np.linalg.norm(center - middle)
                    )
                    pinch = PINCH if narrow else 0.0
                    for turn in (0.0, math.pi):  # the same fingers' line, thumb on either side
                        turned = hand_pose(pose[:3, 3], yaw + turn, tilt if turn == 0.0 else -tilt)
                        turned[:3, 3] -= pinch * turned[:3, 1]
                        yield Grasp(turned, width, opening, kind, float(quality))


def _rim(points: np.ndarray, support: float) -> Iterator[Grasp]:
    """Yield grasps that pinch the wall of a hollow object at least 9 cm wide, from above."""
    top = float(np.percentile(points[:, 2], 98))
    rim = points[points[:, 2] > top - 0.008]
    if len(rim) < 20 or top - support < 0.012:
        return
    low, high = np.percentile(rim[:, :2], [2, 98], axis=0)
    middle = 0.5 * (low + high)
    if (high - low).min() < 0.09:
        return
    inner = points[np.linalg.norm(points[:, :2] - middle, axis=1) < 0.3 * (high - low).min()]
    if len(inner) < 5:
        return
    hollow = top - float(np.median(inner[:, 2]))
    if hollow < 0.008:
        return
    offsets = rim[:, :2] - middle
    angles, radii = np.arctan2(offsets[:, 1], offsets[:, 0]), np.linalg.norm(offsets, axis=1)
    for yaw in np.arange(16) * math.pi / 8:
        sector = np.abs((angles - yaw + math.pi) % (2 * math.pi) - math.pi) < 0.2
        if sector.sum() < 3:
            continue
        radius = float(np.median(radii[sector]))
        contact = np.array([*(middle + radius * np.array([math.cos(yaw), math.sin(yaw)])), top])
        depth = min(0.03, hollow + 0.004)
        # Of the wall only what is near the rim counts: the fingers stop where they touch.
        sideways = np.abs((points[:, :2] - contact[:2]) @ np.array([-math.sin(yaw), math.cos(yaw)]))
        outward = (points[:, :2] - contact[:2]) @ np.array([math.cos(yaw), math.sin(yaw)])
        wall = points[(sideways < LATERAL) & (np.abs(outward) < 0.012) & (points[:, 2] > top - depth)]
        if len(wall) < 3:
            continue
        lowest_tip = max(top - depth, support + FLOOR_CLEARANCE)
        for turn in (0.0, math.pi):
            pose = hand_pose(contact, yaw + turn)
            pose[2, 3] = lowest_tip + reach(0.5, ANGLES[-1])
            if _in_hand(points, pose)[:, 2].min() < PALM_LEVEL + PALM_CLEARANCE:
                continue
            opening = 0.8 if radius < 0.07 else 0.65
            yield Grasp(pose, 0.02, opening, "rim", 0.72 + (0.02 if turn == 0.0 else 0.0))
