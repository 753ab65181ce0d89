"""Determine the world frame from the table's plane and what is known of the camera's pose.

World: z = 0 is the table's surface, x points from the arm across the table, y to its left; the arm's base stands at
x = y = 0, as high above or below the table as it is.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from agent.arm.arm_model import WORLD_FROM_BASE
from agent.recordings.recording import Recording
from structdiffusion.geometry import pose_from_xyz_yaw, tilt_between, transform_points
from structdiffusion.observation import Table

_WORTH_TELLING = math.radians(0.5)  # and 5 mm: less is what any calibration leaves
_WORTH_TELLING_M = 0.005
_DISAGREES = math.radians(5.0)
_MIDDLE = (0.45, 0.0)  # m: the middle of what the arm reaches
_SIDES = {
    "on the camera's side": 0,
    "at the table's right side as the camera sees it": 1,
    "at the table's left side as the camera sees it": -1,
    "opposite the camera": 2,
}  # -> quarter turns to the left of the camera's direction of view
_BASE_CLEARANCE = 0.2  # m from the middle of an object to the middle of the arm's base
_STEP = 0.02  # m, in which a place for objects that spread too wide is sought


@dataclass(frozen=True)
class Frames:
    """Where the camera and the arm stand.

    Attributes:
        world_from_camera: (4, 4).
        world_from_base: (4, 4), upright.
        notes: what was assumed or corrected.
    """

    world_from_camera: np.ndarray
    world_from_base: np.ndarray
    notes: tuple[str, ...]


def base_from_camera(recording: Recording) -> np.ndarray | None:
    """Return the camera's pose relative to the arm's `link_base`, if known: given by hand, otherwise by tf."""
    if recording.world_from_camera is not None:
        return np.linalg.inv(WORLD_FROM_BASE) @ recording.world_from_camera
    return recording.base_from_camera


def world_frame(recording: Recording, level_from_camera: np.ndarray, places: np.ndarray) -> Frames:
    """Return the world frame of a recording.

    Args:
        recording: the recording, with or without the camera's pose.
        level_from_camera: (4, 4) to the frame in the table's plane.
        places: (N, 2) the objects' places in that frame; the middle of the table if there are none.
    """
    if recording.world_from_camera is not None:
        return _by_hand(recording.world_from_camera, level_from_camera, places)
    if recording.base_from_camera is not None:
        return _by_arm(recording.base_from_camera, level_from_camera, places)
    return _by_view(level_from_camera, places)


def _by_arm(base_from_camera: np.ndarray, level_from_camera: np.ndarray, places: np.ndarray) -> Frames:
    """Take the place of the base from tf, and the up direction and height from the plane."""
    level_from_base = level_from_camera @ np.linalg.inv(base_from_camera)
    lean, base_yaw = _lean_and_yaw(level_from_base)
    notes = []
    if lean > _DISAGREES:
        notes.append(
            f"tf and the table disagree: the table leans by {math.degrees(lean):.1f} degrees against the arm's base; "
            "the base's place is tf's, up is the table's normal"
        )
    elif lean > _WORTH_TELLING:
        notes.append(f"up is the table's normal: tf was corrected by {math.degrees(lean):.1f} degrees")
    base = level_from_base[:3, 3]
    ahead = places.mean(axis=0) - base[:2]
    # The quarter turn of the base after which the objects lie most nearly ahead.
    quarters = round((math.atan2(ahead[1], ahead[0]) - base_yaw) / (math.pi / 2))
    yaw = base_yaw + quarters * math.pi / 2
    world_from_level = np.linalg.inv(pose_from_xyz_yaw(base[0], base[1], 0.0, yaw))
    return Frames(
        world_from_level @ level_from_camera,
        pose_from_xyz_yaw(0.0, 0.0, base[2], _plain_quarter(-quarters)),
        tuple(notes),
    )


def _lean_and_yaw(level_from_other: np.ndarray) -> tuple[float, float]:
    """Return the tilt of another frame's z axis, and the turn about z that is closest to its rotation, radians."""
    turn = level_from_other[:3, :3]
    return tilt_between(turn, np.eye(3)), math.atan2(turn[1, 0] - turn[0, 1], turn[0, 0] + turn[1, 1])


def _plain_quarter(quarters: int) -> float:
    """Return a number of quarter turns as an angle in (-pi, pi]."""
    return (((quarters + 1) % 4) - 1) * math.pi / 2


def _by_hand(world_from_camera: np.ndarray, level_from_camera: np.ndarray, places: np.ndarray) -> Frames:
    """Take place and direction from the pose given by hand, and the up direction and height from the plane."""
    level_from_world = level_from_camera @ np.linalg.inv(world_from_camera)
    lean, yaw = _lean_and_yaw(level_from_world)
    middle = np.append(places.mean(axis=0), 0.0)
    given = transform_points(np.linalg.inv(level_from_world), middle)
    # Turned about the middle of what lies there: x and y of the objects stay as the pose has them.
    x, y = level_from_world[:2, 3]
    level_from_corrected = pose_from_xyz_yaw(x, y, 0.0, yaw)
    level_from_corrected[:2, 3] += middle[:2] - transform_points(level_from_corrected, np.append(given[:2], 0.0))[:2]
    notes = []
    if lean > _WORTH_TELLING or abs(given[2]) > _WORTH_TELLING_M:
        notes.append(
            f"the camera's pose was corrected by the table's plane: by {math.degrees(lean):.1f} degrees and "
            f"{-given[2] * 1000:+.0f} mm of height"
        )
    notes.append("the arm's base is taken to stand at the world's origin, on the table")
    return Frames(np.linalg.inv(level_from_corrected) @ level_from_camera, WORLD_FROM_BASE.copy(), tuple(notes))


def _by_view(level_from_camera: np.ndarray, places: np.ndarray) -> Frames:
    """Assume that the arm stands at the side of the table from which it reaches most objects; nothing says where it is.

    The camera's side comes first where others are no better.
    """
    reached = {side: _standing(places, quarters) for side, quarters in _SIDES.items()}
    counts = {side: count for side, (_, count) in reached.items()}
    side = max(counts, key=counts.__getitem__)
    note = (
        "the camera's pose is unknown: up is the table's normal, x the camera's direction of view, and the arm is "
        "taken to stand on the table where it reaches the objects"
    )
    first = next(iter(_SIDES))
    if side != first:
        note = (
            f"the arm's pose is unknown: up is the table's normal, and the arm is taken to stand {side}, where it "
            f"reaches {counts[side]} of {len(places)} objects; from the camera's side it would reach {counts[first]}; "
            "left and right are as the arm sees them"
        )
    return Frames(reached[side][0] @ level_from_camera, WORLD_FROM_BASE.copy(), (note,))


def _standing(places: np.ndarray, quarters: int) -> tuple[np.ndarray, int]:
    """Return world_from_level (4, 4) of an arm that looks `quarters` quarter turns left of the camera, and its reach.

    Args:
        places: (N, 2) level frame.
        quarters: how the arm is turned against the camera's direction of view.

    Returns:
        The pose, and how many of the places the arm reaches.
    """
    turned = pose_from_xyz_yaw(0.0, 0.0, 0.0, -quarters * math.pi / 2)
    seen = places @ turned[:2, :2].T
    x, y = _reachable_middle(seen)
    turned[:2, 3] = _MIDDLE[0] - x, _MIDDLE[1] - y
    return turned, int(_within_reach(seen, np.array([[x, y]]))[0])


def _reachable_middle(places: np.ndarray) -> np.ndarray:
    """Return the point (2,) to put in the middle of the arm's reach, so that it reaches most of the places (N, 2).

    The arm's base then stands on no object, unless there is no other way.
    """
    low, high = places.min(axis=0), places.max(axis=0)
    if _within_reach(places, (low + high)[None] / 2)[0] == len(places):
        return (low + high) / 2
    x, y = np.meshgrid(*(np.arange(a, b + _STEP, _STEP) for a, b in zip(low, high, strict=True)), indexing="ij")
    tried = np.stack((x.ravel(), y.ravel()), axis=1)
    bases = tried - _MIDDLE
    on_base = (np.linalg.norm(places[None] - bases[:, None], axis=2) < _BASE_CLEARANCE).sum(axis=1)
    off = np.linalg.norm(tried - places.mean(axis=0), axis=1)
    return tried[np.lexsort((off, -_within_reach(places, tried), on_base))[0]]


def _within_reach(places: np.ndarray, middles: np.ndarray) -> np.ndarray:
    """Return how many of the places (N, 2) the arm reaches for each middle (M, 2) of its reach: (M,)."""
    reach = Table()
    half = np.array([reach.x_max - reach.x_min, reach.y_max - reach.y_min]) / 2
    return (np.abs(places[None] - middles[:, None]) <= half + 1e-9).all(axis=2).sum(axis=1)
