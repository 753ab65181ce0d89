"""Fit known bodies to the points of a depth picture: their poses from a first guess, and first guesses from nothing."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from agent.arm.sight import Evidence, Sight, hue_distance, of_palette
from agent.arm.tracked_shape import TrackedShape
from structdiffusion.geometry import pose_from_xyz_yaw, tilt_between, transform_points, turn_of

# m within which points count at first, and in the end: what an object may have been pushed, and four times the noise.
FAR_GATE, NEAR_GATE = 0.03, 0.008
ROUNDS = 10  # from the one to the other: the last ones move a pose by less than 0.1 mm
SOFT = 0.5  # of the gate: residuals beyond it lose their weight
EMPTY_WEIGHT = 0.5  # of a sample in empty space, beside a point: they are about as many
LEVEL_WEIGHT = 0.3  # of all points: what stands upright stands on something, and where it is completed wrongly may sink
DAMPING = 3.0  # points by which each step is held back: what the points do not tell stays as guessed
LEAST_POINTS = 8  # fewer tell no pose
MOST_POINTS = 400  # of one object that are used: more do not make it better
STRAYS = (0.015, 0.985)  # shares of the points below and above which they do not tell how far an object reaches
ON_TABLE = 0.01  # m: what would stand no higher stands on the table
TRIED_POINTS = 80  # of them for first guesses
GUESSED_TURNS = 12  # about the vertical, 30 degrees apart: a fit turns by half of that
HOPELESS = 0.015  # m from a first guess are the points, on average, of something else
LIKELIEST = 40  # first guesses of which different ones are taken
SAME_SPOT, SAME_TURN = 0.02, math.radians(45)  # m, rad between first guesses that lead to the same fit
UPRIGHT = np.array([True, True, True, False, False, True])  # of x, y, z and the turns about them
WITHOUT_TURN = np.array([True, True, True, False, False, False])
TILTED = math.radians(5)  # as standing things do not, and measured tilts do
FREE = np.ones(6, dtype=bool)


@dataclass(frozen=True, eq=False)
class Fit:
    """A body at a pose, and how well it fits.

    Attributes:
        world_from_shape: (4, 4).
        residual: mean distance of its points from its surface, metres; infinite without points.
        points: indices of the points that lie on it.
        off_color: mean distance of their colours from its palette, whatever the light.
        evidence: what the picture says about it.
    """

    world_from_shape: np.ndarray
    residual: float
    points: np.ndarray
    off_color: float
    evidence: Evidence


@dataclass(frozen=True, eq=False)
class _Own:
    """The points of one body: their indices (P,), distances (P,) from it, metres, and nearest planes (P,)."""

    points: np.ndarray
    distances: np.ndarray
    planes: np.ndarray


def free_turns(shape: TrackedShape, pose: np.ndarray) -> np.ndarray:
    """Return which of x, y, z and the turns about them (6,) a fit from a pose (4, 4) may change: no tilt of what stands
    upright, and no turn of what is round.
    """
    if tilt_between(pose, np.eye(4)) > TILTED:
        return FREE
    return WITHOUT_TURN if shape.rounded else UPRIGHT


def fit_together(
    sight: Sight,
    shapes: Sequence[TrackedShape],
    guesses: Sequence[np.ndarray],
    free: Sequence[np.ndarray],
    among: np.ndarray | None = None,
    gate: float = FAR_GATE,
) -> list[Fit]:
    """Fit bodies to a picture from guessed poses; each point draws only the body that it is nearest to.

    Args:
        sight: the picture.
        shapes: N bodies.
        guesses: world_from_shape (4, 4) of each.
        free: (6,) of each, from `free_turns`.
        among: (P,) bool, the points that may belong to them; by default all.
        gate: metres within which points count at first.
    """
    poses = [np.array(guess) for guess in guesses]
    allowed = np.ones(len(sight.points), dtype=bool) if among is None else among
    colored = [allowed & of_palette(sight.features, shape.palette) for shape in shapes]
    for width in np.geomspace(max(gate, NEAR_GATE), NEAR_GATE, ROUNDS):
        owned = _owned(sight, shapes, poses, colored, width)
        for k, (shape, mine) in enumerate(zip(shapes, owned)):
            level = None if free[k][3] else float(guesses[k][2, 3])
            poses[k] = _step(sight, shape, poses[k], mine, free[k], width, level)
    owned = _owned(sight, shapes, poses, colored, NEAR_GATE)
    return [_judged(sight, *each) for each in zip(shapes, poses, owned)]


def explained(sight: Sight, shapes: Sequence[TrackedShape], poses: Sequence[np.ndarray]) -> np.ndarray:
    """Return which points (P,) of the picture lie on or in one of the bodies at their poses, whatever their colour."""
    anywhere = [np.ones(len(sight.points), dtype=bool)] * len(shapes)
    taken = np.zeros(len(sight.points), dtype=bool)
    for own in _owned(sight, shapes, poses, anywhere, NEAR_GATE):
        taken[own.points] = True
    return taken


def _owned(
    sight: Sight,
    shapes: Sequence[TrackedShape],
    poses: Sequence[np.ndarray],
    allowed: Sequence[np.ndarray],
    width: float,
) -> list[_Own]:
    """Return the points of each body: those nearest to it, not farther from it than `width`."""
    points = sight.points
    least = np.full(len(points), width)
    owner = np.full(len(points), -1)
    near: list[_Own] = []
    for k, (shape, pose, mine) in enumerate(zip(shapes, poses, allowed)):
        at, rotation = pose[:3, 3], pose[:3, :3]
        about = np.flatnonzero(mine & (np.abs(points - at).max(axis=1) < shape.radius + width))
        own = _Own(about, *shape.distances_seen((points[about] - at) @ rotation, (sight.eye - at) @ rotation))
        closer = np.abs(own.distances) < least[about]
        least[about[closer]] = np.abs(own.distances[closer])
        owner[about[closer]] = k
        near.append(own)
    kept = [owner[own.points] == k for k, own in enumerate(near)]
    return [_Own(own.points[m], own.distances[m], own.planes[m]) for own, m in zip(near, kept)]


def _step(
    sight: Sight,
    shape: TrackedShape,
    pose: np.ndarray,
    own: _Own,
    free: np.ndarray,
    width: float,
    level: float | None,
) -> np.ndarray:
    """Return the pose after one step of damped least squares: onto its points, out of empty space, and near the height
    `level` on which it should stand.
    """
    if len(own.points) < LEAST_POINTS:
        return pose
    few = slice(None, None, math.ceil(len(own.points) / MOST_POINTS))
    points, distance = sight.points[own.points[few]], own.distances[few]
    slopes = shape.planes[own.planes[few], :3] @ pose[:3, :3].T
    jacobian = [-np.concatenate((slopes, np.cross(points - pose[:3, 3], slopes)), axis=1)]
    residual = [distance]
    weight = [1.0 / (1.0 + (distance / (SOFT * width)) ** 2) ** 2]
    empty = transform_points(pose, shape.samples[sight.empty(shape, pose)])
    if len(empty):
        apart, nearest = cKDTree(points).query(empty)
        close = (apart < FAR_GATE) & (apart > 1e-6)
        away = (empty[close] - points[nearest[close]]) / apart[close, None]
        jacobian.append(np.concatenate((away, np.cross(empty[close] - pose[:3, 3], away)), axis=1))
        residual.append(apart[close])
        share = len(points) / max(1, len(shape.samples))
        weight.append(EMPTY_WEIGHT * share / (1.0 + (apart[close] / FAR_GATE) ** 2) ** 2)
    if level is not None:
        off = pose[2, 3] - level
        jacobian.append(np.array([[0.0, 0.0, 1.0, 0.0, 0.0, 0.0]]))
        residual.append(np.array([off]))
        weight.append(np.array([LEVEL_WEIGHT * len(points) / (1.0 + (off / NEAR_GATE) ** 2) ** 2]))
    j, r, w = np.concatenate(jacobian)[:, free], np.concatenate(residual), np.concatenate(weight)
    hold = DAMPING * np.array([1.0, 1.0, 1.0, *[shape.radius**2] * 3])[free]
    change = np.zeros(6)
    change[free] = np.linalg.solve(j.T @ (w[:, None] * j) + np.diag(hold), -j.T @ (w * r))
    moved = pose.copy()
    moved[:3, :3] = Rotation.from_rotvec(change[3:]).as_matrix() @ pose[:3, :3]
    moved[:3, 3] += change[:3]
    return moved


def _judged(sight: Sight, shape: TrackedShape, pose: np.ndarray, own: _Own) -> Fit:
    residual = float(np.abs(own.distances).mean()) if len(own.points) else math.inf
    off_color = hue_distance(sight.features[own.points], shape.palette)
    return Fit(pose, residual, own.points, off_color, sight.evidence(shape, pose))


def judge(sight: Sight, shape: TrackedShape, pose: np.ndarray) -> Fit:
    """Return how well a body fits at a pose (4, 4), which stays as it is."""
    colored = of_palette(sight.features, shape.palette)
    return _judged(sight, shape, pose, _owned(sight, [shape], [pose], [colored], NEAR_GATE)[0])


def lowest(shape: TrackedShape, pose: np.ndarray) -> float:
    """Return the height of the lowest point of a body at a pose (4, 4), metres."""
    return float((shape.samples @ pose[2, :3]).min() + pose[2, 3])


def guesses_from_points(
    shape: TrackedShape, points: np.ndarray, before: np.ndarray, lying: bool, count: int
) -> list[np.ndarray]:
    """Return the likeliest poses (4, 4) of a body that some points (P, 3) of a picture may show.

    Args:
        shape: the body.
        points: world frame, metres.
        before: (4, 4) its pose so far: of equally likely rotations, the nearest to that is taken.
        lying: whether it may lie on its side or head; otherwise it stands.
        count: of the poses.
    """
    few = points[:: math.ceil(len(points) / TRIED_POINTS)]
    low, high = np.quantile(points, STRAYS, axis=0)
    facing = before[:3, :3]
    upright = facing if tilt_between(before, np.eye(4)) < TILTED else np.eye(3)
    turns = [pose_from_xyz_yaw(0, 0, 0, 2 * math.pi * k / GUESSED_TURNS)[:3, :3] for k in range(GUESSED_TURNS)]
    bases = _lying() if lying else [upright]
    if shape.rounded and not lying:
        turns = turns[:1]
    rotations = np.array([turn @ base for base in bases for turn in turns])
    spots = [(low + high) / 2, points.mean(axis=0), *(low + (high - low) * np.array(t) for t in _QUARTERS)]
    spread = shape.samples @ rotations.transpose(0, 2, 1)  # (R, S, 3)
    least, most = spread.min(axis=1), spread.max(axis=1)
    top = float(high[2])
    places = []
    for spot in spots if (high - low)[:2].max() > 2 * shape.radius else spots[:2]:
        place = np.empty((len(rotations), 3))
        place[:, :2] = spot[:2] - (least + most)[:, :2] / 2
        place[:, 2] = top - most[:, 2]
        on_table = place[:, 2] + least[:, 2] < ON_TABLE
        place[on_table, 2] = -least[on_table, 2]
        places.append(place)
    place = np.concatenate(places)
    rotation = np.tile(rotations, (len(places), 1, 1))
    inside = np.einsum("rpi,rij->rpj", few[None] - place[:, None], rotation)
    distance = np.abs(shape.distances(inside.reshape(-1, 3))[0]).reshape(len(place), -1)
    turned = np.arccos(np.clip((np.einsum("rij,ij->r", rotation, facing) - 1) / 2, -1, 1))
    cost = np.minimum(distance, FAR_GATE).mean(axis=1) + 1e-4 * turned
    poses = np.tile(np.eye(4), (len(place), 1, 1))
    poses[:, :3, :3], poses[:, :3, 3] = rotation, place
    likely = np.argsort(cost)[:LIKELIEST]
    return _different(poses[likely[cost[likely] < HOPELESS]], count)


def _different(poses: np.ndarray, count: int) -> list[np.ndarray]:
    """Return the first `count` of the poses (H, 4, 4) that are not nearly the same:
    a fit finds from one to the other.
    """
    chosen: list[np.ndarray] = []
    for pose in poses:
        near = (np.linalg.norm(pose[:3, 3] - one[:3, 3]) < SAME_SPOT for one in chosen)
        alike = (turn_of(one[:3, :3].T @ pose[:3, :3]) < SAME_TURN for one in chosen)
        if not any(a and b for a, b in zip(near, alike)):
            chosen.append(pose)
        if len(chosen) == count:
            break
    return chosen


_QUARTERS = [(x, y, 0.5) for x in (0.25, 0.75) for y in (0.25, 0.75)]


def _lying() -> list[np.ndarray]:
    """Return rotations (3, 3) that lay a body on its side, in eight directions, or on its head."""
    sides = [
        Rotation.from_rotvec(math.pi / 2 * np.array([math.cos(a), math.sin(a), 0.0])).as_matrix()
        for a in np.arange(8) * math.pi / 4
    ]
    return [*sides, np.diag([1.0, -1.0, -1.0])]
