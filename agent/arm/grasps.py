"""Find grasps from the partial clouds of unseen objects, without object models.

There are three kinds, all with the hand pointing down or tilted by up to 40 degrees about its closing axis:

- "across": antipodal, the fingers on both sides of a cross-section of the cloud;
- "flat": the same for objects lower than 3 cm (cutlery): the fingers straddle the object, close to the table;
- "rim": one side of the hand inside, the other outside the rim of a hollow object (bowl, plate, cup).

What the fingers cannot lift by friction alone, such as a plate or a book that lies flat, they can slide along the
table, which carries it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain

import numpy as np

from agent.arm.hand import Hand
from agent.arm.hand_fit import FLAT, FLOOR_CLEARANCE, PALM_CLEARANCE, Contacts, fit_hands

NARROW_LOSS = 0.1  # of quality: what is round rolls out of two fingers
LEANING, LEANING_FLAT = 0.25, 1.0  # of quality for each radian: of leaning fingers, one is too high for what is flat
DEPTHS = (0.06, 0.05, 0.035, 0.022)  # m below the top that the tips end; at 6 cm they fold around wide things
FEWEST_POINTS = 10  # of a cloud that a hand can be fitted to
# The friction between a finger and a usual object, 0.5, less what its weight takes: fingers that press further outwards
# slide along it.
MOST_INCLINE = 0.4
# m of a hollow object's wall outwards for each m upwards: on shallower ones the fingers inside come down.
MOST_LEAN = 0.8
SHALLOWEST = 0.008  # m below a rim
TABLE_LEVEL = 0.005  # m: what stands no higher stands on the table
YAWS = 12
TILTS = (0.0, math.radians(20), math.radians(-20), math.radians(40), math.radians(-40))


@dataclass(frozen=True, eq=False)
class Grasp:
    """A hand pose at which closing the fingers should hold the object.

    Attributes:
        world_from_ee: (4, 4) the hand when the fingers close: approach +z, closing along x.
        width: the width of the object between the fingers, metres.
        opening: finger joint angle, radians, while approaching.
        closing: the same where the fingers first touch the object, or close around a rim.
        kind: "across", "flat" or "rim".
        quality: larger is better.
        slides: whether it is for sliding the object along the table, and not for lifting it.
    """

    world_from_ee: np.ndarray
    width: float
    opening: float
    closing: float
    kind: str
    quality: float
    slides: bool = False


def hand_pose(point: Sequence[float] | np.ndarray, yaw: float, tilt: float = 0.0) -> np.ndarray:
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


def grasps_of(
    points: np.ndarray, hand: Hand, support: float = 0.0, friction: bool = False, limit: int = 120
) -> list[Grasp]:
    """Return the grasps of one object, best first; those that only slide it come after those that lift it.

    Args:
        points: (P, 3) its cloud, world frame, metres.
        hand: what takes it.
        support: z of the surface that it stands on.
        friction: whether they must hold by friction alone.
        limit: the most grasps to lift it, and to slide it.
    """
    lifts = _best(_grasps(points, hand, support, "friction" if friction else "weld"), limit)
    return lifts + _best(_slides(points, hand, support), limit) if friction else lifts


def _best(grasps: Iterable[Grasp], limit: int) -> list[Grasp]:
    # Rounded, so that rounding does not decide between grasps of the same quality: the first one stays first.
    return sorted(grasps, key=lambda grasp: -round(grasp.quality, 9))[:limit]


def can_be_grasped(points: np.ndarray, hand: Hand, support: float = 0.0, friction: bool = True) -> bool:
    """Return whether the object has any grasp, if only to slide it; stops at the first."""
    lifts = _grasps(points, hand, support, "friction" if friction else "weld")
    return next(chain(lifts, _slides(points, hand, support) if friction else ()), None) is not None


def _slides(points: np.ndarray, hand: Hand, support: float) -> Iterator[Grasp]:
    """Yield grasps to slide what stands on the table."""
    if support >= TABLE_LEVEL or len(points) < FEWEST_POINTS:
        return
    tip, half = hand.reach(0.0, hand.closed), 0.5 * np.ptp(np.percentile(points[:, :2], [1, 99], axis=0), axis=0).min()
    for grasp in _grasps(points, hand, support, "slide"):
        # What is pushed higher above the table than half its width topples if the table's friction is 1.
        if grasp.world_from_ee[2, 3] - tip - support < half:
            yield replace(grasp, slides=True)


def _grasps(points: np.ndarray, hand: Hand, support: float, hold: str) -> Iterator[Grasp]:
    """Yield grasps for a `hold`: "weld" and "slide" take what the fingers meet,
    "friction" what they do not slip off.
    """
    points = np.asarray(points, dtype=np.float64)
    if len(points) >= FEWEST_POINTS:
        yield from _across(points, hand, support, hold)
        yield from _rim(points, hand, support, hold)


def _across(points: np.ndarray, hand: Hand, support: float, hold: str) -> Iterator[Grasp]:
    low, high = np.percentile(points[:, 2], [1, 99])
    top, middle = float(high), np.median(points[:, :2], axis=0)
    corners = np.percentile(points[:, :2], [2, 98], axis=0)
    middle = 0.5 * middle + 0.5 * corners.mean(axis=0)
    height = top - support
    kind = "flat" if height < FLAT else "across"
    depths = (height + 0.02,) if kind == "flat" else DEPTHS
    for yaw in np.arange(YAWS) * math.pi / YAWS:
        closing = np.array([math.cos(yaw), math.sin(yaw)])
        side = np.array([math.sin(yaw), -math.cos(yaw)])
        local = np.column_stack(((points[:, :2] - middle) @ closing, (points[:, :2] - middle) @ side, points[:, 2]))
        places = _contacts(local, top, depths, hand)
        if places is None:
            continue
        contacts, offsets, narrow = places
        fitted = fit_hands(hand, local, contacts, support)
        quality = (
            1.0
            - 3.0 * fitted.width
            - 3.0 * np.abs(offsets)
            - (LEANING_FLAT if kind == "flat" else LEANING) * np.abs(contacts.tilt)
            - NARROW_LOSS * narrow
            + 3.0 * np.minimum(contacts.depth, 0.05)
            - 1.5 * np.hypot(contacts.across, contacts.along)
        )
        fits = fitted.fits
        if hold == "friction":
            fits = fits & (fitted.incline <= MOST_INCLINE)
            quality -= 0.5 * np.maximum(fitted.incline, 0.0)
        for k in np.flatnonzero(fits):
            position = (*(middle + closing * contacts.across[k] + side * fitted.along[k]), fitted.height[k])
            pinch, tilt = hand.pinch if narrow[k] else 0.0, float(contacts.tilt[k])
            for turn in (0.0, math.pi):  # the same fingers' line, thumb on either side
                turned = hand_pose(position, yaw + turn, tilt if turn == 0.0 else -tilt)
                turned[:3, 3] -= pinch * turned[:3, 1]
                angles = float(fitted.opening[k]), float(fitted.closing[k])
                yield Grasp(turned, float(fitted.width[k]), *angles, kind, float(quality[k]))


def _contacts(
    local: np.ndarray, top: float, depths: Sequence[float], hand: Hand
) -> tuple[Contacts, np.ndarray, np.ndarray] | None:
    """Return where hands may come down on a cloud (P, 3) of across, along and height; `None` if nowhere.

    With them two (B,): how far along each is off the middle, and whether the object is narrow there.
    """
    across, along = local[:, 0], local[:, 1]
    half = 0.5 * np.subtract(*np.percentile(along, [97, 3]))
    rows, sections = [], []
    # Long things can also be taken off their middle.
    for offset in (0.0,) if half < 0.05 else (0.0, 0.3 * half, -0.3 * half):
        slab = np.abs(along - offset) < hand.lateral + hand.row_clearance
        for depth in depths:
            section = slab & (local[:, 2] > top - depth - 0.01)
            if section.sum() < 6:
                continue
            ends = np.percentile(across[section], [2, 98])
            narrow = np.abs(along[section] - offset).max() < hand.narrow
            local_top = np.percentile(local[section, 2], 97)
            rows += [(ends.mean(), offset, local_top, depth, tilt, narrow) for tilt in TILTS]
            sections += [section] * len(TILTS)
    if not rows:
        return None
    across_at, along_at, tops, depth, tilt, narrow = np.array(rows).T
    return Contacts(across_at, along_at, tops, depth, tilt, np.array(sections)), along_at, narrow > 0


def _rim(points: np.ndarray, hand: Hand, support: float, hold: str) -> Iterator[Grasp]:
    """Yield grasps that pinch the wall of a hollow object into which a finger fits, from above."""
    top = float(np.percentile(points[:, 2], 98))
    rim = points[points[:, 2] > top - 0.008]
    if len(rim) < 20 or top - support < 0.012:
        return
    low, high = np.percentile(rim[:, :2], [2, 98], axis=0)
    middle = 0.5 * (low + high)
    if (high - low).min() < hand.rim_width:
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
        # Of the wall only what is near the rim counts: the fingers stop where they touch.
        sideways = np.abs((points[:, :2] - contact[:2]) @ np.array([-math.sin(yaw), math.cos(yaw)]))
        outward = (points[:, :2] - contact[:2]) @ np.array([math.cos(yaw), math.sin(yaw)])
        near = (sideways < hand.lateral) & (outward < 0.012)
        depth = _rim_depth(points[near, 2] - top, outward[near], min(0.03, _deepest(hollow, hold)), hold)
        if depth is None:
            continue
        for turn in (0.0, math.pi):
            pose = hand_pose(contact, yaw + turn)
            pose[2, 3] = max(top - depth, support + FLOOR_CLEARANCE) + hand.reach(hand.rim_reach, hand.closed)
            if ((points - pose[:3, 3]) @ pose[:3, 2]).min() < hand.palm_level + PALM_CLEARANCE:
                continue
            opening = hand.rim_openings[0] if radius < 0.07 else hand.rim_openings[1]
            yield Grasp(pose, 0.02, opening, hand.rim_closed, "rim", 0.72 + (0.02 if turn == 0.0 else 0.0))


def _deepest(hollow: float, hold: str) -> float:
    """Return how deep the fingers may reach below the rim of something hollow, metres.

    A weld holds where they come down on its floor; to slide it, they must not come down on the slope behind the rim,
    but be deep enough to be behind it when they are closed, and so higher.
    """
    return {"weld": hollow + 0.004, "friction": hollow - 0.002, "slide": max(hollow / 2, min(hollow, 0.009))}[hold]


def _rim_depth(heights: np.ndarray, outward: np.ndarray, deepest: float, hold: str) -> float | None:
    """Return how deep below a rim the fingers pinch its wall, metres, or `None` if there is no wall, or only one that
    leans so far outwards that the fingers inside come down on it, and do not close against it.

    Args:
        heights: (P,) m from the rim, of the points between the fingers. outward: (P,) likewise.
        deepest: m that they may reach.
        hold: "weld", "friction" or "slide".
    """
    if ((heights > -deepest) & (np.abs(outward) < 0.012)).sum() < 3:
        return None
    if hold != "friction":
        return deepest
    for depth in np.arange(deepest, SHALLOWEST, -0.003):
        above, at_tips = heights > -depth, np.abs(heights + depth) < 0.006
        if max(_lean(heights, outward, above), _lean(heights, outward, at_tips)) < MOST_LEAN:
            return float(depth)
    return None


def _lean(heights: np.ndarray, outward: np.ndarray, part: np.ndarray) -> float:
    """Return how far a part (P,) of a wall leans outwards, m for each m upwards; infinite where too little is seen."""
    wall = part & (outward > -0.05)
    return math.inf if wall.sum() < 5 else float(np.polyfit(heights[wall], outward[wall], 1)[0])
