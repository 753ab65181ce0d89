"""Plan motions among perceived objects: RRT-Connect over the arm's joints.

The planning scene lives in a physics client of its own, with a copy of the arm, the floor, and a
convex hull per perceived object; it never sees a true model. Times in seconds, angles in radians.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from typing import Self

import numpy as np
import pybullet
from ompl import base, geometric
from ompl import util as ompl_util
from scipy.spatial import ConvexHull, QhullError

from agent.arm.kinematics import Kinematics
from agent.arm.simulated_arm import SimulatedArm
from agent.arm.trajectories import interpolate, trajectory
from structdiffusion.geometry import quaternion_from_matrix

CLEARANCE = 0.004  # m kept between the arm and everything else
CHECK_STEP = 0.04  # rad between the states of a motion that are checked
FINE_STEP = 0.01  # rad, the same for a path that is found
ROUNDED_STEP = 0.05  # s between the checked states of a rounded motion: 3 cm of the hand at most
FLOOR = 1.5  # m that the floor reaches to every side
LEDGE = 0.1  # m ahead of a base that is lower than the table, where its edge is taken to be
LEAVING = 0.35  # rad from a start within which the arm may be as near to things as it was there
EDGE_LOSS = 0.002  # m that the camera loses all around an object, at its depth edges
SIMPLIFYING_CHECKS = 6_000  # collision checks spent on making a found path shorter
HELD_OVERLAP = 0.008  # m that the hull of a held object may overlap others: hulls are rough and fill hollows

ompl_util.noOutputHandler()


def solid_hull(points: np.ndarray, support: float = 0.0) -> np.ndarray:
    """Return the vertices (V, 3) of the convex hull of a partial cloud (P, 3), continued down to `support`.

    The camera sees tops and front sides; the hidden part is assumed to reach down to z = `support`.
    """
    low, high = np.percentile(points, [0.5, 99.5], axis=0)
    kept = points[((points >= low - 1e-3) & (points <= high + 1e-3)).all(axis=1)].astype(np.float64)
    outward = kept[:, :2] - 0.5 * (low + high)[:2]
    kept[:, :2] += EDGE_LOSS * outward / np.maximum(np.linalg.norm(outward, axis=1), 1e-6)[:, None]
    below = kept.copy()
    below[:, 2] = support
    cloud = np.concatenate((kept, below)).astype(np.float64)
    cloud[:, 2] = np.maximum(cloud[:, 2], support)
    try:
        vertices = cloud[ConvexHull(cloud).vertices]
    except QhullError:  # too few or flat points: their bounding box, at least 4 mm thick
        low, high = cloud.min(axis=0) - 0.002, cloud.max(axis=0) + 0.002
        vertices = np.array(list(itertools.product(*zip(low, high))))
    if len(vertices) > 60:
        # Extreme points in 60 directions: a hull as good for planning, and much faster to check.
        golden = np.arange(60) + 0.5
        polar, turn = np.arccos(1 - 2 * golden / 60), math.pi * (1 + math.sqrt(5)) * golden
        directions = np.stack((np.cos(turn) * np.sin(polar), np.sin(turn) * np.sin(polar), np.cos(polar)), axis=1)
        vertices = vertices[np.unique((directions @ vertices.T).argmax(axis=1))]
    return vertices


class PlanningScene:
    """A copy of the arm among the hulls of perceived objects. Close it, or use it as a context manager.

    Args:
        rng: the random numbers of the searches.
        kinematics: the kinematics of the arm at its mounting place.
        on_check: called for every configuration that is checked; what it raises ends the planning.

    Attributes:
        kinematics: as given.
        checks: the number of configurations checked so far: the cost of planning, independent of the machine.
        held_overlap: m that the hull of a held object may overlap others.
    """

    def __init__(
        self,
        rng: np.random.Generator,
        kinematics: Kinematics = Kinematics(),
        on_check: Callable[[], None] | None = None,
    ) -> None:
        self._rng, self._on_check = rng, on_check or (lambda: None)
        self.kinematics = kinematics
        self.checks = 0
        self.held_overlap = HELD_OVERLAP
        self.client = pybullet.connect(pybullet.DIRECT)
        self.arm = SimulatedArm(self.client, kinematics)
        self._obstacles: dict[object, int] = {}
        self._held: int | None = None
        # Beside an arm that stands lower there is no floor at the table's height: it begins at the table's edge.
        near = LEDGE if kinematics.lowered else -FLOOR
        floor = pybullet.createCollisionShape(
            pybullet.GEOM_BOX, halfExtents=[(FLOOR - near) / 2, FLOOR, 0.05], physicsClientId=self.client
        )
        self.floor = pybullet.createMultiBody(
            0, floor, basePosition=[(FLOOR + near) / 2, 0, -0.05], physicsClientId=self.client
        )
        self.arm.stand_on(self.floor)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Free the physics client."""
        pybullet.disconnect(self.client)

    def _body(self, vertices: np.ndarray, mass: float) -> int:
        shape = pybullet.createCollisionShape(
            pybullet.GEOM_MESH, vertices=vertices.tolist(), physicsClientId=self.client
        )
        return pybullet.createMultiBody(mass, shape, physicsClientId=self.client)

    def set_obstacle(self, key: object, vertices: np.ndarray) -> None:
        """Add the convex hull of `vertices` (V, 3), world frame, as an obstacle; it replaces the earlier one with
        the same `key`.
        """
        self.remove_obstacle(key)
        self._obstacles[key] = self._body(vertices, 0.0)

    def remove_obstacle(self, key: object) -> None:
        """Remove the obstacle `key`, if it exists."""
        body = self._obstacles.pop(key, None)
        if body is not None:
            pybullet.removeBody(body, physicsClientId=self.client)

    def set_fingers(self, angles: Sequence[float]) -> None:
        """Check motions with the fingers at `angles` (F,)."""
        self.arm.set_fingers(angles)

    def open_fingers(self, opening: float) -> None:
        """Check motions with all fingers at the angle `opening`."""
        self.set_fingers([opening] * len(self.arm.fingers))

    def hold(self, vertices_in_ee: np.ndarray) -> None:
        """Check motions with the hull of `vertices_in_ee` (V, 3), end_effector frame, held in the hand."""
        self.release()
        self._held = self._body(vertices_in_ee, 0.1)
        self._let_hand_touch(self._held, True)

    def release(self) -> None:
        """Plan with an empty hand again."""
        if self._held is not None:
            # The engine gives the number of a removed body to the next one, and keeps what was set for it.
            self._let_hand_touch(self._held, False)
            pybullet.removeBody(self._held, physicsClientId=self.client)
            self._held = None

    def _let_hand_touch(self, body: int, allowed: bool) -> None:
        for link in self.arm.hand_links:
            pybullet.setCollisionFilterPair(
                body, self.arm.body, -1, link, int(not allowed), physicsClientId=self.client
            )

    def collides(
        self, q: np.ndarray, clearance: float = CLEARANCE, floor: float | None = None, only_floor: bool = False
    ) -> bool:
        """Return whether the arm at q (n,) comes closer than `clearance` to anything, or the held object hits
        something.

        Args:
            clearance: metres; a negative value is the allowed overlap, also with the arm's own links.
            floor: the clearance to the floor, if different; fingers nearly touch it in a grasp.
            only_floor: ignore obstacles.
        """
        self._on_check()
        self.checks += 1
        floor = clearance if floor is None else floor
        arm = self.arm
        pybullet.resetJointStatesMultiDof(
            arm.body, arm.joints, [[v] for v in q], [[0.0]] * len(arm.joints), physicsClientId=self.client
        )
        if self._held is not None:
            pose = arm.world_from_ee()
            pybullet.resetBasePositionAndOrientation(
                self._held, pose[:3, 3].tolist(), quaternion_from_matrix(pose).tolist(), physicsClientId=self.client
            )
        pybullet.performCollisionDetection(physicsClientId=self.client)
        for contact in pybullet.getContactPoints(arm.body, physicsClientId=self.client):
            # Neighbouring shapes of the arm touch by design; only overlap of its own links counts.
            if contact[1] == contact[2]:
                limit = min(clearance, 0.0)
            elif self.floor in (contact[1], contact[2]):
                limit = floor
            elif only_floor:
                continue
            else:
                limit = clearance
            if contact[8] < limit and self._held not in (contact[1], contact[2]):
                return True
        if self._held is None:
            return False
        return any(
            contact[8] < (0.0 if arm.body in (contact[1], contact[2]) else -self.held_overlap)
            for contact in pybullet.getContactPoints(self._held, physicsClientId=self.client)
        )

    def path_collides(self, path: np.ndarray, clearance: float = CLEARANCE, floor: float | None = None) -> bool:
        """Return whether any state of the path (T, n), interpolated to `CHECK_STEP`, collides."""
        return any(self.collides(q, clearance, floor) for q in interpolate(path, CHECK_STEP))

    def closing_collides(
        self, q: np.ndarray, opening: float, closing: float, clearance: float = CLEARANCE, floor: float | None = None
    ) -> bool:
        """Return whether the arm at q (n,) collides while its fingers move between two angles;
        they stay at `opening`.
        """
        count = 1 + math.ceil(abs(closing - opening) / self.arm.hand.give)  # the tips move by 1 cm each time
        try:
            for angle in np.linspace(opening, closing, count):
                self.open_fingers(float(angle))
                if self.collides(q, clearance, floor):
                    return True
        finally:
            self.open_fingers(opening)
        return False

    def overlap(self, q: np.ndarray) -> float:
        """Return how deep, in metres, the arm at q (n,) reaches into anything, including its own links; 0 if it is
        free.
        """
        if not self.collides(q, 0.0):
            return 0.0
        return -min(contact[8] for contact in pybullet.getContactPoints(self.arm.body, physicsClientId=self.client))

    def plan(
        self, start: np.ndarray, goal: np.ndarray, checks: int = 20_000, overlap: float = 0.0
    ) -> np.ndarray | None:
        """Plan a collision-free path (T, n) by RRT-Connect, shortened; `None` if none was found.

        The straight line in joint space is tried first: it often is free, and it is the shortest.
        The search ends after `checks` collision checks (about a second for 20,000), and not by the
        clock, so that a busy machine finds what an idle one finds.

        Args:
            start, goal: (n,).
            checks: the limit of the search.
            overlap: metres by which the arm may reach into obstacles near its start, for a start that was not planned.
        """
        # A looser clearance lets the arm leave a start where it is close to what it has just released.
        if self.collides(start, -overlap) or self.collides(goal, 0.0):
            return None
        straight = np.stack((start, goal))
        if not self.path_collides(straight) and self._holds_finely(straight, overlap):
            return straight
        # Coarse checks are quick and mostly enough; a path that cuts a corner between them, or on which the arm would
        # as it rounds its corners, is searched again.
        found = None
        for step in (CHECK_STEP, FINE_STEP):
            path = self._search(start, goal, step, checks, overlap)
            if path is not None and self._holds_finely(path, overlap):
                found = path
                if not any(
                    self.collides(q, -overlap) for q in trajectory(path, ROUNDED_STEP, self.kinematics.model.velocity)
                ):
                    return path
        return found

    def _holds_finely(self, path: np.ndarray, overlap: float) -> bool:
        def allowed(q: np.ndarray) -> float:
            return -overlap if overlap and np.abs(q - path[0]).max() < LEAVING else 0.0

        return not any(self.collides(q, allowed(q)) for q in interpolate(path, FINE_STEP))

    def _search(
        self, start: np.ndarray, goal: np.ndarray, step: float, checks: int, overlap: float
    ) -> np.ndarray | None:
        """Run RRT-Connect once, checking motions every `step` radians; return a shortened path or `None`."""
        # OMPL seeds by the clock, and takes a seed for its whole process alone; what a search draws with is made below,
        # from this one. OMPL complains when it is seeded again.
        ompl_util.RNG.setSeed(int(self._rng.integers(1, 2**31)))
        model = self.kinematics.model
        lower = np.where(model.continuous, np.minimum(start, goal) - math.pi, model.lower)
        upper = np.where(model.continuous, np.maximum(start, goal) + math.pi, model.upper)
        joints = len(start)
        space = base.RealVectorStateSpace(joints)
        bounds = base.RealVectorBounds(joints)
        for k in range(joints):
            bounds.setLow(k, float(lower[k]))
            bounds.setHigh(k, float(upper[k]))
        space.setBounds(bounds)
        setup = geometric.SimpleSetup(space)
        near_ends = (start, goal)
        spent = 0

        def valid(state: base.State) -> bool:
            nonlocal spent
            spent += 1
            q = np.array([state[k] for k in range(joints)])
            if overlap and np.abs(q - start).max() < LEAVING:
                return not self.collides(q, -overlap)
            at_end = min(np.abs(q - end).max() for end in near_ends) < 0.05
            return not self.collides(q, 0.0 if at_end else CLEARANCE)

        setup.setStateValidityChecker(valid)
        information = setup.getSpaceInformation()
        information.setStateValidityCheckingResolution(step / space.getMaximumExtent())
        planner = geometric.RRTConnect(information)
        planner.setRange(0.8)
        setup.setPlanner(planner)
        states = []
        for q in near_ends:
            state = space.allocState()
            for k in range(joints):
                state[k] = float(q[k])
            states.append(state)
        setup.setStartAndGoalStates(*states)
        setup.solve(base.PlannerTerminationCondition(lambda: spent > checks))
        if not setup.haveExactSolutionPath():
            return None
        spent = 0
        setup.simplifySolution(base.PlannerTerminationCondition(lambda: spent > SIMPLIFYING_CHECKS))
        found = setup.getSolutionPath().getStates()
        return np.array([[state[k] for k in range(joints)] for state in found])
