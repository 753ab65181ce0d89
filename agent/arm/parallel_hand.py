"""Measure a hand with two fingers in its URDF: move its joints, and look where the inner sides of the fingers are.

Metres, radians.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from agent.arm.arm_model import Joint, Solid, poses_on
from agent.arm.hand import Follower, Hand, inner_sides
from structdiffusion.geometry import pose_from_xyz_yaw, transform_points

ANGLES = 31  # at which it is measured
LEVEL = 0.003  # m between levels
# N that each pad presses with: the least of the usual hands of this kind, and about what a finger of the Jaco does
GRIP_FORCE = 20.0
# m between the pads that come down on a hollow object's wall, less than 14 cm across and others, and about where they
# meet it
RIM_OPENINGS, RIM_CLOSED = (0.04, 0.074), 0.01
RIM_ROOM = 0.005  # m between the finger in a hollow object and its other side
SIDE_CLEARANCE, FLAT_CLEARANCE, LEAST_CLEARANCE = 0.008, 0.005, 0.003  # m kept on each side of an object
ROW_CLEARANCE = 0.005  # m along the pads, which must not come down on what is wider just beside them
RIM_DEPTH = 0.03  # m that the fingers reach below a rim at most
PALM_DEPTH = 0.02  # m: what ends within it is the palm too
SAMPLES = 9  # points along each side of a solid


@dataclass(frozen=True, eq=False)
class FingerJoints:
    """The moving joints of a hand, which one number moves: its angle, 0 when it is open.

    Attributes:
        zero, rate: by the joint's name, its position (rad or m) when the hand is open, and how far it moves for each
            unit of the angle.
        span: the angle when it is closed. speed, effort: of the joint that is commanded first, rad/s or m/s, Nm or N.
    """

    zero: Mapping[str, float]
    rate: Mapping[str, float]
    span: float
    speed: float
    effort: float

    def at(self, angle: float) -> dict[str, float]:
        """Return the positions of the joints at an angle."""
        return {name: zero + self.rate[name] * angle for name, zero in self.zero.items()}


class HandError(ValueError):
    """A hand that cannot be used."""


def centred(wrist_from_end: np.ndarray, pads: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """Return wrist_from_end (4, 4) moved across its z, and turned about it, so that it is midway between two pads, and
    the first is at +x.

    Args:
        wrist_from_end: its z is the approach.
        pads: (3,) the middle of each, in the wrist's frame.

    Raises:
        HandError: if the pads are one behind the other along the approach.
    """
    one, other = (np.linalg.inv(wrist_from_end) @ np.append(pad, 1.0) for pad in pads)
    x, y, _ = (one - other)[:3]
    if np.hypot(x, y) < LEVEL:
        raise HandError("the pads do not stand apart across the approach, which is the z of the hand's frame")
    middle = (one + other) / 2
    return wrist_from_end @ pose_from_xyz_yaw(middle[0], middle[1], 0.0, float(np.arctan2(y, x)))


def surface_of(solid: Solid) -> np.ndarray:
    """Return points (P, 3) all over a solid's outline, in its link's frame, close together for the levels of a hand."""
    half = solid.sides / 2
    counts = np.maximum(SAMPLES, np.ceil(solid.sides / (LEVEL / 2)).astype(int) + 1)
    axes = [np.linspace(-each, each, count) for each, count in zip(half, counts, strict=True)]
    faces = []
    for axis in range(3):
        ends = list(axes)
        ends[axis] = np.array([-half[axis], half[axis]])
        faces.append(np.stack(np.meshgrid(*ends, indexing="ij"), axis=-1).reshape(-1, 3))
    points = np.concatenate(faces)
    if solid.round:
        far = np.hypot(points[:, 0], points[:, 1]) / half[0]
        points[:, :2] /= np.maximum(far, 1.0)[:, None]
    return transform_points(solid.link_from_solid, points)


@dataclass(frozen=True, eq=False)
class Fingers:
    """The solids of a hand with two fingers, which one number moves.

    Attributes:
        chain, solids: of the whole arm, as `ArmModel` has them.
        wrist: the last link of the arm, which carries the hand.
        wrist_from_end: (4, 4) the end effector, as `centred` returns it.
        pads: the links in the chain that carry the pads, the one at +x first. pad_solids: the pads themselves.
        joints: its moving joints.
    """

    chain: tuple[Joint, ...]
    solids: tuple[Solid, ...]
    wrist: str
    wrist_from_end: np.ndarray
    pads: tuple[str, str]
    pad_solids: tuple[tuple[Solid, ...], tuple[Solid, ...]]
    joints: FingerJoints

    @cached_property
    def angles(self) -> np.ndarray:
        """Return the angles (A,) at which the hand is measured."""
        return np.linspace(0.0, self.joints.span, ANGLES)

    @cached_property
    def names(self) -> tuple[str, str]:
        """Return the joint of each finger, the first that moves its pad.

        Raises:
            HandError: if no joint moves a pad, or one joint both.
        """
        one, other = (self._first_joint(pad) for pad in self.pads)
        if one == other:
            raise HandError(f"both pads move with the joint {one!r}; each needs a finger of its own")
        return one, other

    @cached_property
    def sides(self) -> dict[str, int]:
        """Return the number of the finger that each moving link belongs to: that which carries it, or the one on its
        side."""
        end_from_wrist, sides = np.linalg.inv(self.wrist_from_end), {}
        for link, pose in poses_on(self.chain, self.wrist, self.joints.at(0.0)).items():
            if link != self.wrist:
                first = self._first_joint(link)
                on_left = (end_from_wrist @ pose)[0, 3] < 0.0
                sides[link] = self.names.index(first) if first in self.names else int(on_left)
        return sides

    @property
    def followers(self) -> tuple[Follower, ...]:
        """Return the joints that move with the fingers'."""
        zero, rate = self.joints.zero, self.joints.rate
        return tuple(
            Follower(joint.name, self.sides[joint.child], zero[joint.name], rate[joint.name])
            for joint in self.chain
            if joint.name in zero and joint.name not in self.names
        )

    def points(self, solids: Sequence[Solid], *angles: float) -> list[np.ndarray]:
        """Return points (P, 3) all over some solids, in the end effector's frame, at each of some angles."""
        end_from_wrist = np.linalg.inv(self.wrist_from_end)
        poses = [poses_on(self.chain, self.wrist, self.joints.at(angle)) for angle in angles]
        return [
            np.concatenate([transform_points(end_from_wrist @ pose[each.link], surface_of(each)) for each in solids])
            for pose in poses
        ]

    def _first_joint(self, link: str) -> str:
        """Return the first moving joint on the way from the wrist to a link."""
        above = {joint.child: joint for joint in self.chain}
        while link in above and above[link].parent != self.wrist:
            link = above[link].parent
        if link not in above:
            raise HandError(f"no joint of the hand moves the pad on {link!r}")
        return above[link].name


def parallel_hand(fingers: Fingers) -> Hand:
    """Return a hand, measured by moving its fingers.

    Raises:
        HandError: if nothing can be planned for it.
    """
    angles, joints = fingers.angles, fingers.joints
    palm, palm_width = _palm([fingers.points([each], 0.0)[0] for each in fingers.solids if each.link == fingers.wrist])
    points = [
        fingers.points([each for each in fingers.solids if fingers.sides.get(each.link) == side], *angles)
        for side in (0, 1)
    ]
    farthest = max(float(each[:, 2].max()) for some in points for each in some)
    if farthest < palm + 0.01:
        raise HandError("the fingers do not reach beyond the palm along the approach, the z of the hand's frame")
    levels = np.arange(palm, farthest + 1.5 * LEVEL, LEVEL)
    first_inner, others_inner, lowest = inner_sides(points[0], points[1], levels)
    gaps, lateral = _between([fingers.points(some, *angles) for some in fingers.pad_solids])
    quickest = float(np.abs(np.diff(gaps)).max() / (angles[1] - angles[0])) / 2  # m of each pad for a unit of the angle
    grip = min(GRIP_FORCE * quickest, joints.effort)
    on_rim, on_wide_rim, on_wall = (int(np.abs(gaps - gap).argmin()) for gap in (*RIM_OPENINGS, RIM_CLOSED))
    return Hand(
        fingers=fingers.names,
        zero=np.array([joints.zero[name] for name in fingers.names]),
        rate=np.array([joints.rate[name] for name in fingers.names]),
        tips=(),
        followers=fingers.followers,
        coupled=True,
        angles=angles,
        levels=levels,
        first_inner=first_inner,
        others_inner=others_inner,
        lowest=lowest,
        tip_joints=np.full(len(angles), -np.inf),
        open=0.0,
        tip_level=float(lowest[0]),
        palm_level=palm,
        palm_width=palm_width,
        lateral=lateral,
        row_clearance=ROW_CLEARANCE,
        widest=float(gaps[0]),
        side_clearance=SIDE_CLEARANCE,
        flat_clearance=FLAT_CLEARANCE,
        least_clearance=LEAST_CLEARANCE,
        narrow=0.0,
        pinch=0.0,
        folds=0.0,
        tip_length=0.0,
        rim_width=RIM_ROOM + _outside([some[on_rim] for some in points], float(lowest[on_rim]) - RIM_DEPTH),
        rim_openings=(float(angles[on_rim]), float(angles[on_wide_rim])),
        rim_reach=0.0,
        rim_closed=float(angles[on_wall]),
        give=0.01 / quickest,
        speed=joints.speed,
        effort=min(2 * grip, joints.effort),
        grip_effort=grip,
        squeeze=np.full(2, 0.02 / quickest),
        locked=np.zeros(2, dtype=bool),
    )


def _between(pads: list[list[np.ndarray]]) -> tuple[np.ndarray, float]:
    """Return the gaps (A,) between two pads, and half their width, from points (P, 3) on each at each of A angles."""
    gaps = np.array([one[:, 0].min() - other[:, 0].max() for one, other in zip(*pads, strict=True)])
    if not (np.diff(gaps) < 0.0).all():
        raise HandError("its pads do not come nearer all the way from open to closed")
    return gaps, max(float(np.abs(some[0][:, 1]).max()) for some in pads)


def _palm(still: list[np.ndarray]) -> tuple[float, float]:
    """Return the level of the palm, and how far it reaches from the middle, from points (P, 3) on what carries the
    fingers.
    """
    if not still:
        raise HandError("no link before the fingers has a collision shape, so nothing says where the palm is")
    level = max(float(points[:, 2].max()) for points in still)
    near = [points for points in still if points[:, 2].max() > level - PALM_DEPTH]
    return level, max(float(np.abs(points[:, 0]).max()) for points in near)


def _outside(fingers: list[np.ndarray], level: float) -> float:
    """Return how far, metres, fingers, points (P, 3) of each, reach outwards from the hand's middle beyond a level."""
    return max(float(np.abs(points[points[:, 2] > level, 0]).max()) for points in fingers)
