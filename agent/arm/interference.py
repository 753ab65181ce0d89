"""Interfere with the objects on the table, as a person would: push one, take it away, lay it on its side.

Every act is a generator that does a little after each physics step and returns the event that tells of it; `None` where
there is no object, or no free way, for it now. Nothing is done within reach of the arm, and nothing is pushed into
anything else.
"""

from __future__ import annotations

import math
from collections.abc import Generator, Mapping, Sequence
from typing import TypeAlias

import numpy as np
import pybullet
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from agent.arm.events import Disturbed
from agent.arm.simulated_arm import SimulatedArm
from agent.errors import BadInput
from structdiffusion.footprints import clear_gap
from structdiffusion.geometry import pose_from_xyz_yaw, raised, tilt_between, transform_points
from structdiffusion.objects.model import ObjectModel
from structdiffusion.simulation.world import TABLE, TIME_STEP, TabletopWorld

PUSHES = (0.03, 0.08)  # m, the shortest and the longest push of the protocol
PUSHING_SPEED = 0.15  # m/s: a hand's, and slow enough that what is pushed does not slide on
TOPPLING_SECONDS = 0.4  # in which an object is laid down: it does not roll away from that
FALLING_SECONDS = 0.5  # after the hand has opened: a fall from the height at which things are carried takes .3
GAP, EDGE = 0.01, 0.01  # m that has to be free around a way, and to the table's edge
ARM_GAP = 0.04  # m between a way and the boxes around the arm's links: half a hand
TOUCHING = 0.002  # m between what carries and what is carried
LEVEL = 0.01  # m by which the height of a place may differ from what stands there
AWAY = pose_from_xyz_yaw(0.0, 0.0, -20.0, 0.0)  # beyond what any camera measures, and below the table
SPARE_RADIUS = 0.05  # m: it fits where something else of the usual size was to go
TRIES = 24  # ways that are drawn for an object
UPRIGHT = math.radians(10.0)  # a larger tilt is no standing object any more

Deed: TypeAlias = Generator[None, None, Disturbed]


def keep_away(world: TabletopWorld, model: ObjectModel) -> int:
    """Add an object to the world out of everybody's sight; return its index, the last."""
    index = world.add(model, AWAY)
    world.hold(index)
    return index


def spare_model(library: Sequence[ObjectModel], there: Sequence[ObjectModel], rng: np.random.Generator) -> ObjectModel:
    """Draw an object of a library that can be put among others, if possible one that is not there yet.

    Raises:
        BadInput: if the library has none.
    """
    suited = [model for model in library if model.flat_bottom and model.radius < SPARE_RADIUS]
    names = {model.name for model in there}
    others = [model for model in suited if model.name not in names] or suited
    if not others:
        raise BadInput("the library has no object that is small enough to be put among the others")
    return others[rng.integers(len(others))]


class Interference:
    """What a person could do to the objects on the table.

    Args:
        world: the true objects.
        arm: the arm, in `world.client`.
        names: of the objects of the world.
        rng: draws objects and ways.
    """

    def __init__(self, world: TabletopWorld, arm: SimulatedArm, names: Sequence[str], rng: np.random.Generator) -> None:
        self.world, self.arm, self.names, self.rng = world, arm, names, rng

    # --- the acts ----------------------------------------------------------------------------

    def push(self, objects: Sequence[int], in_hand: int | None) -> Deed | None:
        """Push one of the objects that stand free on the table by 3 to 8 cm along it."""
        for index in self._shuffled(self._free(objects)):
            points = self._points(index)
            for _ in range(TRIES):
                angle = self.rng.uniform(-math.pi, math.pi)
                way = self.rng.uniform(*PUSHES) * np.array([math.cos(angle), math.sin(angle), 0.0])
                if self._clear(np.concatenate((points, points + way)), (index,), in_hand):
                    return self._pushing(index, way)
        return None

    def remove(self, objects: Sequence[int], in_hand: int | None) -> Deed | None:
        """Take one of the objects off the table, on which nothing stands."""
        bare = [index for index in objects if not self._carries(index)]
        for index in self._shuffled(bare):
            if self._reachable(self._points(index), in_hand):
                return self._removing(index)
        return None

    def topple(self, objects: Sequence[int], in_hand: int | None) -> Deed | None:
        """Lay one of the tall objects that stand free on the table on its side."""
        tall = [index for index in self._free(objects) if self.world.models[index].tall]
        for index in self._shuffled(tall):
            for _ in range(TRIES):
                angle = self.rng.uniform(-math.pi, math.pi)
                poses = self._falling(index, np.array([math.cos(angle), math.sin(angle), 0.0]))
                ends = [transform_points(pose, self._hulls(index)) for pose in (poses[0], poses[-1])]
                if self._clear(np.concatenate(ends), (index,), in_hand):
                    return self._toppling(index, poses)
        return None

    def swap(self, waiting: Sequence[int], in_hand: int | None) -> Deed | None:
        """Let two objects that stand free on the table and wait for the arm change places."""
        free = self._free(waiting)
        pairs = [(one, other) for k, one in enumerate(free) for other in free[k + 1 :]]
        for one, other in (pairs[k] for k in self.rng.permutation(len(pairs))):
            swapped = self._exchanged(one, other)
            clouds = [transform_points(pose, self._hulls(index)) for index, pose in swapped.items()]
            clouds += [self._points(one), self._points(other)]
            if all(self._clear(points, (one, other), in_hand) for points in clouds):
                return self._swapping(swapped)
        return None

    def drop(self, in_hand: int) -> Deed | None:
        """Let the hand open that carries an object, with nothing close below."""
        return None if self.world.clearances(in_hand, 2 * GAP) else self._dropping(in_hand)

    def add(self, spare: int, places: Mapping[int, np.ndarray], in_hand: int | None) -> Deed | None:
        """Put the spare object where another is to go: object -> world_from_goal (4, 4)."""
        others = [index for index in range(len(self.world.bodies)) if index not in (spare, in_hand)]
        for index in self._shuffled(list(places)):
            x, y, z = places[index][:3, 3]
            pose = pose_from_xyz_yaw(x, y, 0.0, self.rng.uniform(-math.pi, math.pi))
            points = transform_points(pose, self._hulls(spare))
            outline = _outline(points)
            clouds = [cloud for cloud in map(self._points, others) if clear_gap(outline, _outline(cloud)) < GAP / 2]
            top = max((float(cloud[:, 2].max()) for cloud in clouds), default=0.0)
            points = raised(np.eye(4), top)[:3, 3] + points
            on_table = not self.world.table.overhang(outline)
            if abs(top - z) < LEVEL and on_table and self._reachable(points, in_hand):
                return self._adding(spare, raised(pose, top + TOUCHING), index)
        return None

    # --- how they are done -------------------------------------------------------------------

    def _pushing(self, index: int, way: np.ndarray) -> Deed:
        start = self.world.pose(index)
        count = math.ceil(float(np.linalg.norm(way)) / (PUSHING_SPEED * TIME_STEP))
        for number in range(1, count + 1):
            if pybullet.getClosestPoints(
                self.world.bodies[index], self.arm.body, GAP, physicsClientId=self.world.client
            ):
                break  # the arm has come to where it is pushed
            pose = start.copy()
            pose[:3, 3] += way * number / count
            self._put(index, pose)
            yield
        moved = float(np.linalg.norm((self.world.pose(index) - start)[:2, 3]))
        return Disturbed("push", index, self.names[index], f"was pushed by {100 * moved:.1f} cm")

    def _removing(self, index: int) -> Deed:
        self._put(index, AWAY)
        self.world.hold(index)
        yield
        return Disturbed("remove", index, self.names[index], "was taken off the table")

    def _toppling(self, index: int, poses: Sequence[np.ndarray]) -> Deed:
        for pose in poses:
            self._put(index, pose)
            yield
        return Disturbed("topple", index, self.names[index], "was laid on its side")

    def _swapping(self, swapped: Mapping[int, np.ndarray]) -> Deed:
        for index, pose in swapped.items():
            self._put(index, pose)
        yield
        one, other = swapped
        return Disturbed("swap", one, self.names[one], f"has changed places with {self.names[other]}")

    def _dropping(self, index: int) -> Deed:
        believed = self.arm.held
        self.arm.drop()
        self.arm.held = believed  # what is lost has to be noticed
        self.arm.command_fingers([self.arm.hand.open] * len(self.arm.fingers))
        for _ in range(round(FALLING_SECONDS / TIME_STEP)):
            yield
        return Disturbed("drop", index, self.names[index], "fell out of the hand, which had opened on the way")

    def _adding(self, spare: int, pose: np.ndarray, instead: int) -> Deed:
        self._put(spare, pose)
        self.world.free(self.world.bodies[spare])
        yield
        return Disturbed("add", None, self.names[spare], f"was put where {self.names[instead]} is to go")

    def _put(self, index: int, pose: np.ndarray) -> None:
        """Put an object at a pose, and wake everything that sleeps: its support may be gone."""
        self.world.set_pose(index, pose)
        for body in self.world.bodies:
            pybullet.changeDynamics(
                body, -1, activationState=pybullet.ACTIVATION_STATE_WAKE_UP, physicsClientId=self.world.client
            )

    # --- where they can be done --------------------------------------------------------------

    def _shuffled(self, objects: Sequence[int]) -> list[int]:
        return [objects[k] for k in self.rng.permutation(len(objects))]

    def _hulls(self, index: int) -> np.ndarray:
        return np.concatenate(self.world.models[index].hulls)

    def _points(self, index: int) -> np.ndarray:
        """Return the corners (P, 3) of an object where it is now."""
        return transform_points(self.world.pose(index), self._hulls(index))

    def _carries(self, index: int) -> bool:
        """Return whether something stands on an object."""
        height = self.world.pose(index)[2, 3]
        near = self.world.clearances(index, TOUCHING)
        return any(other != TABLE and self.world.pose(other)[2, 3] > height + LEVEL for other in near)

    def _free(self, objects: Sequence[int]) -> list[int]:
        """Return which of the objects stand upright on the table with nothing on them."""

        def stands(index: int) -> bool:
            upright = tilt_between(self.world.pose(index), np.eye(4)) < UPRIGHT
            return upright and bool(self.world.clearances(index, TOUCHING, [TABLE])) and not self._carries(index)

        return [index for index in objects if stands(index)]

    def _clear(self, points: np.ndarray, own: Sequence[int], in_hand: int | None) -> bool:
        """Return whether the hull of points (P, 3) is on the table, and clear of the arm and of all but `own`."""
        outline, table = _outline(points), self.world.table
        edge = np.array(((EDGE, EDGE), (EDGE, -EDGE), (-EDGE, EDGE), (-EDGE, -EDGE)))
        if table.overhang((outline[:, None] + edge).reshape(-1, 2)):
            return False
        others = (index for index in range(len(self.world.bodies)) if index not in (*own, in_hand))
        apart = all(clear_gap(outline, _outline(self._points(index))) > GAP for index in others)
        return apart and self._reachable(points, in_hand)

    def _reachable(self, points: np.ndarray, in_hand: int | None) -> bool:
        """Return whether neither the arm nor what is in its hand is near the box around points (P, 3)."""
        moving = {self.arm.body} | (set() if in_hand is None else {self.world.bodies[in_hand]})
        low, high = (points.min(axis=0) - ARM_GAP).tolist(), (points.max(axis=0) + ARM_GAP).tolist()
        near = pybullet.getOverlappingObjects(low, high, physicsClientId=self.world.client) or ()
        return not any(body in moving for body, _ in near)

    def _falling(self, index: int, direction: np.ndarray) -> list[np.ndarray]:
        """Return the poses (4, 4), step by step, of an object that is tipped over its lower edge and lies in the end.

        Args:
            index: the object.
            direction: (3,) where its top goes, horizontal.
        """
        start, hulls = self.world.pose(index), self._hulls(index)
        reach = float(((transform_points(start, hulls) - start[:3, 3]) @ direction).max())
        pivot = start[:3, 3] + reach * direction
        poses = []
        for angle in np.linspace(0.0, math.pi / 2, round(TOPPLING_SECONDS / TIME_STEP)):
            tipped = np.eye(4)
            tipped[:3, :3] = Rotation.from_rotvec(angle * np.cross((0.0, 0.0, 1.0), direction)).as_matrix()
            tipped[:3, 3] = pivot - tipped[:3, :3] @ pivot
            pose = tipped @ start
            # An edge that is not straight would reach below what the object stands on.
            poses.append(raised(pose, start[2, 3] - float(transform_points(pose, hulls)[:, 2].min())))
        return poses

    def _exchanged(self, one: int, other: int) -> dict[int, np.ndarray]:
        """Return the poses (4, 4) of two objects, each in the other's place, headed as before."""
        poses = {one: self.world.pose(one), other: self.world.pose(other)}
        here, there = (pose[:2, 3].copy() for pose in poses.values())
        poses[one][:2, 3], poses[other][:2, 3] = there, here
        return poses


def _outline(points: np.ndarray) -> np.ndarray:
    """Return the convex outline (K, 2) of points (P, 3), seen from above."""
    return points[ConvexHull(points[:, :2]).vertices, :2]
