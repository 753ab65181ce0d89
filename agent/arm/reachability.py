"""Find the joint angles at which objects can be taken and released, and remember them.

What concerns the taking of an object stays the same from candidate to candidate: its grasps, the joint angles at them,
and the straight lines to and from them. All of it is computed when it is first needed.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from agent.arm.grasps import Grasp, grasps_of, is_round
from agent.arm.hand import Hand
from agent.arm.motion_planner import PlanningScene, solid_hull
from agent.arm.trajectories import straight_lines
from structdiffusion.geometry import pose_from_xyz_yaw, raised, transform_points

APPROACH = 0.10  # m of straight line before a grasp, after it, and before and after a release
TOUCHING = -0.001  # m of overlap with the floor that is allowed: in a grasp the fingers nearly touch it
UP = np.array([0.0, 0.0, 1.0])
SPINS = 8  # turns about the upright axis that are tried at the goal of a round object
_BLOCK = 30  # grasps, best first, whose joint angles are computed together
_RESTARTS = 4  # of the inverse kinematics of a grasp; the first starts from the waiting pose
_KEPT = 2  # configurations of a grasp, those nearest to the waiting pose
_ITERATIONS = 30  # after which 96 % of the solutions are found that 100 find


@dataclass(frozen=True, eq=False)
class Reach:
    """A configuration at a hand pose, and the straight lines (T, n) from it, as far as they can be followed.

    Attributes:
        q: (n,) the joint angles.
        back: against the approach direction. up: upwards.
    """

    q: np.ndarray
    back: np.ndarray
    up: np.ndarray


@dataclass(frozen=True, eq=False)
class Pick:
    """A grasp with the joint angles q (n,) at it."""

    grasp: Grasp
    q: np.ndarray


@dataclass(frozen=True, eq=False)
class Pair:
    """A pick and a release that fit together.

    Attributes:
        pick: how the object is taken.
        goal_motion: (4, 4) the motion of the object, without the release height.
        q: (n,) the joint angles at the release.
    """

    pick: Pick
    goal_motion: np.ndarray
    q: np.ndarray


class Standing:
    """An object in one place, and what is known so far of taking it from there.

    Attributes:
        cloud: (P, 3). bottom: z of the surface that it stands on. hand: what takes it.
        friction: whether the grasps must hold by friction alone.
        picks: block by block of the grasps. pairs: likewise, for each goal and release height.
        reaches: the lines from each pick.
    """

    def __init__(self, cloud: np.ndarray, bottom: float, hand: Hand, friction: bool = False) -> None:
        self.cloud, self.bottom, self.hand, self.friction = cloud, bottom, hand, friction
        self.picks: list[list[Pick]] = []
        self.pairs: dict[tuple[bytes, float], list[list[Pair]]] = {}
        self.reaches: dict[Pick, Reach] = {}

    @cached_property
    def hull(self) -> np.ndarray:
        """Return the vertices (V, 3) of its solid."""
        return solid_hull(self.cloud, self.bottom)

    @cached_property
    def spun(self) -> bool:
        """Return whether it is round, so that its rotation at the goal is free."""
        return is_round(self.cloud)

    @cached_property
    def grasps(self) -> list[Grasp]:
        """Return its grasps, best first."""
        return grasps_of(self.cloud, self.hand, self.bottom, self.friction)

    @property
    def slides(self) -> bool:
        """Return whether it can only be slid along the table."""
        return self.friction and bool(self.grasps) and all(grasp.slides for grasp in self.grasps)

    @property
    def hangs(self) -> bool:
        """Return whether it is lifted by its rim, so that its other side hangs down: it is rather slid."""
        return self.friction and bool(self.grasps) and self.grasps[0].kind == "rim"


class Reachability:
    """A finder of joint angles for taking and releasing objects.

    Args:
        scene: only its floor is looked at.
        rng: draws the restarts of the inverse kinematics.
    """

    def __init__(self, scene: PlanningScene, rng: np.random.Generator) -> None:
        self._scene, self._kinematics, self._rng = scene, scene.kinematics, rng

    def pairs(self, standing: Standing, goal_from_now: np.ndarray, release: float) -> Iterator[Pair]:
        """Yield the ways to bring an object to its goal: block by block of its grasps, in each block the best first.

        Args:
            standing: the object.
            goal_from_now: (4, 4) its motion; the turn of a round object is free.
            release: m above the goal where it is released.
        """
        for number in range(math.ceil(len(standing.grasps) / _BLOCK)):
            yield from self.block(standing, number, goal_from_now, release)

    def block(self, standing: Standing, number: int, goal_from_now: np.ndarray, release: float) -> list[Pair]:
        """Return the pairs of one block of grasps, best first; the earlier blocks have been asked for before."""
        found = standing.pairs.setdefault((goal_from_now.tobytes(), release), [])
        if number == len(standing.picks):
            standing.picks.append(self._picks(standing.grasps[number * _BLOCK : (number + 1) * _BLOCK]))
        if number == len(found):
            found.append(self._pairs(standing, standing.picks[number], goal_from_now, release))
        return found[number]

    def at_pick(self, standing: Standing, pick: Pick) -> Reach:
        """Return the lines from a pick."""
        if pick not in standing.reaches:
            standing.reaches[pick] = self.lines(pick.q, pick.grasp.world_from_ee)
        return standing.reaches[pick]

    def lines(self, q: np.ndarray, pose: np.ndarray) -> Reach:
        """Return the lines from a configuration (n,) with the hand at `pose` (4, 4)."""
        directions = np.stack((-pose[:3, 2], UP))
        back, up = straight_lines(self._kinematics, np.stack((q, q)), np.stack((pose, pose)), directions, APPROACH)
        return Reach(q, back, up)

    def _picks(self, grasps: list[Grasp]) -> list[Pick]:
        """Return the configurations of some grasps in which the open hand is clear of the floor."""
        kinematics, folded = self._kinematics, self._kinematics.folded
        poses = np.repeat(np.stack([grasp.world_from_ee for grasp in grasps]), _RESTARTS, axis=0)
        seeds = kinematics.random(self._rng, len(poses))
        seeds[::_RESTARTS] = folded
        q, solved = kinematics.inverse(poses, seeds, _ITERATIONS)
        q = kinematics.unwind(q, folded)
        effort = np.where(solved, np.abs(q - folded).max(axis=1), np.inf)
        picks = []
        for g, grasp in enumerate(grasps):
            self._scene.open_fingers(grasp.opening)
            kept: list[int] = []
            for row in g * _RESTARTS + np.argsort(effort[g * _RESTARTS : (g + 1) * _RESTARTS], kind="stable"):
                if len(kept) == _KEPT or not solved[row]:
                    break
                new = all(np.abs(q[row] - q[other]).max() > 0.02 for other in kept)  # restarts may end in the same
                if new and not self._scene.collides(q[row], floor=TOUCHING, only_floor=True):
                    kept.append(int(row))
            picks += [Pick(grasp, q[row]) for row in kept]
        return picks

    def _pairs(self, standing: Standing, picks: list[Pick], goal_from_now: np.ndarray, release: float) -> list[Pair]:
        """Return the picks with which the object can be released at its goal, best first."""
        if not picks:
            return []
        kinematics, folded = self._kinematics, self._kinematics.folded
        motions = _turned(standing, goal_from_now, SPINS if standing.spun else 1)
        rows = [(pick, motion) for pick in picks for motion in motions]
        targets = np.stack([raised(motion @ pick.grasp.world_from_ee, release) for pick, motion in rows])
        near = np.stack([pick.q for pick, _ in rows])
        q, reached = kinematics.inverse(targets, near, _ITERATIONS)
        q = kinematics.unwind(q, near)
        effort = np.abs(q - near).max(axis=1) + np.abs(near - folded).max(axis=1)
        worth = np.array([pick.grasp.quality for pick, _ in rows]) - 0.05 * effort
        order = [k for k in np.argsort(-worth.round(9), kind="stable") if reached[k]]
        return [Pair(rows[k][0], rows[k][1], q[k]) for k in order]


def _turned(standing: Standing, goal_from_now: np.ndarray, spins: int) -> list[np.ndarray]:
    """Return the motion (4, 4), turned in so many steps about the object's upright axis at the goal."""
    cloud = standing.cloud
    center = transform_points(goal_from_now, 0.5 * (cloud.min(axis=0) + cloud.max(axis=0)))
    there = pose_from_xyz_yaw(center[0], center[1], center[2], 0.0)
    back = np.linalg.inv(there)
    return [there @ pose_from_xyz_yaw(0, 0, 0, 2 * math.pi * k / spins) @ back @ goal_from_now for k in range(spins)]
