"""Describe a hand: where the inner sides of its fingers are at every opening, and how strong and fast they are.

Levels are heights along the end effector's +z (the approach), metres: negative towards the palm, positive towards and
beyond the tips. The hand closes along x, by one number, its angle, which grows as the hand closes: that of a finger
joint, radians, or metres where fingers slide. A is the number of `angles`, L that of `levels`, F that of fingers.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

ALIKE = 0.001  # m: widths are known no better
ONTO = 0.03  # m: more overlap than one step of closing makes


@dataclass(frozen=True)
class Follower:
    """A joint that a linkage moves with a finger.

    Attributes:
        name: the joint's name.
        finger: the number of the finger.
        zero: its position when the finger's angle is 0, rad or m.
        rate: how far it moves for each unit of that angle.
    """

    name: str
    finger: int
    zero: float
    rate: float


@dataclass(frozen=True, eq=False)
class Hand:
    """A hand that closes along its x.

    Attributes:
        fingers: the joint of each finger, the one at +x first. zero, rate: (F,) a joint's position is `zero` + `rate`
            times the angle of its finger.
        tips: the joint of each finger's tip, which folds when something stops the rest; none for stiff fingers.
        followers: the joints that a linkage moves with the fingers.
        coupled: whether one drive moves all fingers together; otherwise each waits where it touches something.
        angles: (A,) evenly spaced, from the widest opening to the farthest closing.
        levels: (L,) evenly spaced, from the palm on.
        first_inner, others_inner: (A, L) x of the inner side of the first finger, and of the others; +inf and -inf
            where none of them is.
        lowest: (A,) the farthest level that any of them reaches.
        tip_joints: (A,) the level of the joints of their tips, the least; -inf without such joints.
        open: the angle of the waiting hand.
        tip_level: m, where the tips end when the hand is open.
        palm_level: m, the surface of the palm. palm_width: m from the middle within which something would touch it.
        lateral: m, half the width of the fingers side by side.
        row_clearance: m beside them along their row, where something counts as between them too.
        widest: m, the widest object between the fingers.
        side_clearance, flat_clearance: m kept on each side between the open fingers and an object, and what is flat.
        least_clearance: m, the same where an object is too wide for more.
        narrow, pinch: m; what is shorter than `narrow` along the fingers' row is taken `pinch` beside the middle.
        folds: m along a finger from the joint of its tip; what stops the finger there or before makes the tip fold.
        tip_length: m beyond its joint that a tip touches what it folds onto.
        rim_width: m, how wide a hollow object is at least that a finger fits into beside its wall.
        rim_openings: the angles to come down on its wall, for one of less than 14 cm across, and others.
        rim_reach, rim_closed: the angle from which on the reach of the closing fingers counts there, and about where
            they meet the wall.
        give: how far the angle changes when a tip moves by 1 cm.
        speed: of a finger, rad/s or m/s. effort: of each motor that moves a finger freely, Nm or N.
        grip_effort: that with which a finger presses. squeeze: (F,) how far beyond the contact its motor aims then.
        locked: (F,) bool: which fingers stay where they are when the others press, because they cannot be driven back.
    """

    fingers: tuple[str, ...]
    zero: np.ndarray
    rate: np.ndarray
    tips: tuple[str, ...]
    followers: tuple[Follower, ...]
    coupled: bool
    angles: np.ndarray
    levels: np.ndarray
    first_inner: np.ndarray
    others_inner: np.ndarray
    lowest: np.ndarray
    tip_joints: np.ndarray
    open: float
    tip_level: float
    palm_level: float
    palm_width: float
    lateral: float
    row_clearance: float
    widest: float
    side_clearance: float
    flat_clearance: float
    least_clearance: float
    narrow: float
    pinch: float
    folds: float
    tip_length: float
    rim_width: float
    rim_openings: tuple[float, float]
    rim_reach: float
    rim_closed: float
    give: float
    speed: float
    effort: float
    grip_effort: float
    squeeze: np.ndarray
    locked: np.ndarray

    @property
    def closed(self) -> float:
        """Return the farthest angle."""
        return float(self.angles[-1])

    @cached_property
    def gaps(self) -> np.ndarray:
        """Return the gap, metres, at each of `angles` and `levels` (A, L); infinite beyond the tips."""
        return self.first_inner - self.others_inner

    def joint_positions(self, angles: Sequence[float] | np.ndarray) -> dict[str, float]:
        """Return the positions, rad or m, of the fingers' joints and of their followers, for angles (F,)."""
        fingers = np.asarray(angles, dtype=np.float64)
        positions = dict(zip(self.fingers, (self.zero + self.rate * fingers).tolist(), strict=True))
        return positions | {each.name: each.zero + each.rate * float(fingers[each.finger]) for each in self.followers}

    def reach(self, opening: float, closing: float) -> float:
        """Return the farthest distance, metres, that the closing fingers reach beyond the end effector between two
        angles.
        """
        between = self.angles[(opening < self.angles) & (closing > self.angles)]
        angles = np.append(between, (opening, closing))
        return float(np.interp(angles, self.angles, self.lowest).max())

    @cached_property
    def _reach_table(self) -> np.ndarray:
        """Return `reach` (A, A) from each of `angles` to each later one."""
        return np.stack([np.maximum.accumulate(np.roll(self.lowest, -a)) for a in range(len(self.angles))])

    def reaches(self, openings: np.ndarray, closings: np.ndarray) -> np.ndarray:
        """Return `reach` (B,) of openings and closings (B,) that are among `angles`."""
        first, last = np.searchsorted(self.angles, openings), np.searchsorted(self.angles, closings)
        return self._reach_table[first, last - first]

    def openings_for(self, widths: np.ndarray) -> np.ndarray:
        """Return the largest angles (B,), so the smallest openings, that pass `widths` (B, L) at each of `levels`;
        NaN where none does.
        """
        passes = np.all(self.gaps >= widths[:, None], axis=2)
        last = passes.shape[1] - 1 - passes[:, ::-1].argmax(axis=1)
        return np.where(passes.any(axis=1), self.angles[last], np.nan)

    @cached_property
    def _inclines(self) -> tuple[np.ndarray, np.ndarray]:
        """Return how much wider the gap becomes on each side to one of `levels` and from it on (A, L), m/m.

        A corner of the fingers lies where the two differ; the tips end with one.
        """
        step = 2 * (self.levels[1] - self.levels[0])
        wider = np.diff(np.where(np.isfinite(self.gaps), self.gaps, np.nan)) / step
        before = np.pad(wider, ((0, 0), (1, 0)), constant_values=np.nan)
        after = np.pad(wider, ((0, 0), (0, 1)), constant_values=np.nan)
        return np.where(np.isnan(before), after, before), np.where(np.isnan(after), np.inf, after)

    def contacts(self, widths: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return where closing fingers first touch objects that are `widths` (B, L) wide.

        Zero width means nothing at that level. Fingers that would come down on the object, because
        they reach its level only when they are already closer together than its width, never touch it.

        Returns:
            The angles (B,), NaN where they never touch, and the inclines (B,) of the contacts: the tangent of the
            angle by which the fingers press the object out of the hand, negative where they draw it in.
        """
        meets = np.any((self.gaps <= widths[:, None]) & (widths > 0.0)[:, None], axis=2)
        first = meets.argmax(axis=1)
        near = np.lib.stride_tricks.sliding_window_view(np.pad(widths, ((0, 0), (3, 3))), 7, axis=1)
        around = near.max(axis=2)  # within 1 cm: few points may be seen at one level
        overlap = np.where(widths > 0.0, around - self.gaps[first], -np.inf).max(axis=1)
        angles = np.where(meets.any(axis=1) & (overlap <= ONTO), self.angles[first], np.nan)
        return angles, self._press_out(widths, first)

    def _press_out(self, widths: np.ndarray, first: np.ndarray) -> np.ndarray:
        """Return the inclines (B,) of contacts with objects `widths` (B, L) wide, at the `angles` `first` (B,)."""
        levels = self.levels
        pressing = np.where(widths > 0.0, widths - self.gaps[first], -np.inf)
        # How the object widens away from the palm, from each level to the next but one.
        slopes = (widths[:, 2:] - widths[:, :-2]) / (4 * (levels[1] - levels[0]))
        slopes[(widths[:, 2:] == 0.0) | (widths[:, :-2] == 0.0)] = 0.0
        sides = np.sort(np.stack([each[first] for each in self._inclines]), axis=0)
        joint = self.tip_joints[first]
        row, level = np.arange(len(widths)), pressing.argmax(axis=1)
        # Of levels that press alike, the end of a tip on a shoulder and the face above it, the one that slides counts.
        alike = pressing >= pressing.max(axis=1, keepdims=True) - ALIKE
        inclines = np.where(alike, np.clip(np.pad(slopes, ((0, 0), (2, 0))), *sides), -np.inf).max(axis=1)
        # What stops a finger near the joint of its tip or before is held by the tip, which folds onto the side farther
        # on.
        folded_at = np.minimum(np.searchsorted(levels, joint + self.tip_length), len(levels) - 1)
        along = (levels[level] - joint) * np.hypot(1.0, sides[0, row, level])
        folds = (along < self.folds) & (widths[row, folded_at] > 0.0)
        return np.where(folds, slopes[row, folded_at - 2], inclines)


def inner_sides(
    first: Sequence[np.ndarray], others: Sequence[np.ndarray], levels: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the inner x (A, L) of the first finger and of the others, and the farthest level (A,) of any, from points
    (P, 3) and (Q, 3) on them at each of A angles.
    """
    sides = np.full((2, len(first), len(levels)), [[[np.inf]], [[-np.inf]]])
    for a, (one, other) in enumerate(zip(first, others, strict=True)):
        for level, height in enumerate(levels):
            sides[0, a, level] = one[np.abs(one[:, 2] - height) < 0.003, 0].min(initial=np.inf)
            sides[1, a, level] = other[np.abs(other[:, 2] - height) < 0.003, 0].max(initial=-np.inf)
    lowest = [max(one[:, 2].max(), other[:, 2].max()) for one, other in zip(first, others, strict=True)]
    return sides[0], sides[1], np.array(lowest)
