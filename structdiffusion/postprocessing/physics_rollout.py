"""Physics rollouts of proposed arrangements: unseen parts of the objects are completed, and physics predicts the
outcome.

Only the partial clouds, the camera's pose and the table are used. The completed bodies go through the same protocol as
the true ones when success is measured (`physical_stability.place_and_check`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np

from grounding.goals.goal import Goal
from grounding.spec import StructureSpec
from structdiffusion.completion.bodies import bodies_of_scene
from structdiffusion.evaluation_protocol import RELEASE_HEIGHT
from structdiffusion.geometry import pose_from_xyz_yaw, transform_points
from structdiffusion.objects.model import ObjectModel
from structdiffusion.observation import Scene
from structdiffusion.postprocessing.build_order import BuildOrder
from structdiffusion.protocol.physical_stability import Verdict, carried_after, executable_order, place_and_check
from structdiffusion.protocol.release import Release, TabletopBodies
from structdiffusion.simulation.world import TabletopWorld

HYPOTHESES = 5  # number of hypotheses about what the camera did not see; the first is the likeliest
# Approximate deviations of the others from it: radius and height of bodies (m), mass (log), and landing position (m,
# rad).
_SIZE, _MASS, _SHIFT, _TURN = 0.0015, 0.5, 0.003, 0.03
_MISFIT = 0.0025  # m by which the radius of one may be larger, and that of the next smaller
# m above the contact of completed surfaces, from where stacked objects are released. Contact with a vessel is known to
# about a centimetre: from more than 2 cm higher, plus the 3 cm of the protocol, an object would fall too fast; below
# the true contact, it would intersect something.
_LOWEST, _HIGHEST = 0.006, 0.009
# m more for every object below the first: a top is known to a few millimetres, and rims and lids stand higher than
# what is seen of them, so that the errors of a stack add up. The most that is added keeps the fall below 1 m/s.
_PER_LEVEL, _MOST_ADDED = 0.0025, 0.006
STACKED = 0.01  # m above the table, from which an object counts as stacked
_INSIDE = 0.001  # m of overlap that counts as none
_REACH = 0.05  # m within which distances to objects below are computed
_STEP, _STEPS = 0.0005, 40  # of lowering an object: m that count as contact, and the largest number of steps


class PhysicsRollout:
    """Physics rollouts on the completed bodies of a scene, which are made when first needed.

    Args:
        scene: the observed scene.
        bodies: the completed bodies of its objects, then of its distractors, each with its pose world_from_object (4,
            4), where they are known already.
    """

    def __init__(self, scene: Scene, bodies: Sequence[tuple[ObjectModel, np.ndarray]] | None = None) -> None:
        self.scene, self._given = scene, bodies
        self._assumed: dict[tuple[int, tuple[int, ...]], tuple[list[ObjectModel], np.ndarray]] = {}

    @cached_property
    def bodies(self) -> tuple[list[ObjectModel], np.ndarray, list[tuple[ObjectModel, np.ndarray]]]:
        """Return the completed bodies of the objects, their poses (N, 4, 4), and the distractors with theirs."""
        if self._given is None:
            return bodies_of_scene(self.scene)
        own = self._given[: len(self.scene.objects)]
        poses = np.array([pose for _, pose in own])
        return [model for model, _ in own], poses, list(self._given[len(own) :])

    def _hypothesis(self, number: int, order: tuple[int, ...]) -> tuple[list[ObjectModel], np.ndarray]:
        """Return N bodies that vary the completed ones, and errors (N, 4, 4) of their landing poses.

        First every second body of a tower is wider and the others are narrower, then vice versa, because this decides
        what fits into a vessel; further hypotheses vary all bodies at random. Masses always vary.
        """
        if (number, order) in self._assumed:
            return self._assumed[number, order]
        rng = np.random.default_rng(number)
        models: list[ObjectModel] = []
        errors = []
        for level in np.argsort(order):
            broad, high = _SIZE * rng.standard_normal(2)
            if number <= 2:
                broad = _MISFIT * (-1) ** (level + number)
            model = self.bodies[0][len(models)]
            stretch = np.array([1 + broad / model.radius] * 2 + [1 + high / model.height])
            hulls = tuple(hull * np.clip(stretch, 0.8, 1.25) for hull in model.hulls)
            models.append(replace(model, hulls=hulls, mass=model.mass * math.exp(_MASS * rng.standard_normal())))
            x, y = _SHIFT * rng.standard_normal(2)
            errors.append(pose_from_xyz_yaw(x, y, 0.0, _TURN * rng.standard_normal()))
        self._assumed[number, order] = models, np.array(errors)
        return self._assumed[number, order]

    def verdict(
        self,
        motions: np.ndarray,
        spec: StructureSpec | Goal,
        hypothesis: int = 0,
        stays: Sequence[int] = (),
        aside: Sequence[int] = (),
        colors: Sequence[str] | None = None,
        order: tuple[int, ...] = (),
    ) -> Verdict:
        """Predict the outcome of moving the objects by (N, 4, 4), with their completed bodies.

        Args:
            motions: (N, 4, 4), world frame.
            spec: the requested structure, or the goal.
            hypothesis: 0 for the most likely bodies, which land exactly; 1 to `HYPOTHESES` - 1 for others, which land a
                few millimetres off.
            stays: under a goal, the objects that do not move: their motion is the identity.
            aside, colors: under a goal, see `place_and_check` and `TabletopBodies`.
            order: in which they are set down at their goals, as the arm does; by default they are released above
                them, supports first.
        """
        models, poses, others = self.bodies
        if hypothesis:
            models, errors = self._hypothesis(hypothesis, bottom_up(motions))
            errors = errors.copy()
            errors[list(stays)] = np.eye(4)
            at = motions @ poses
            at[:, :3, :3] = at[:, :3, :3] @ errors[:, :3, :3]
            at[:, :2, 3] += errors[:, :2, 3]
            motions = at @ np.linalg.inv(poses)
            motions[list(stays)] = np.eye(4)
        names = [cloud.name for cloud in (*self.scene.objects, *self.scene.distractors)]
        flat = isinstance(spec, StructureSpec) and motions[:, 2, 3].max() < STACKED
        # Unstable objects fall at once: waiting for 2 s as in the protocol would double the time.
        above = 0.0 if order else RELEASE_HEIGHT
        release = Release(until_rest=True, together=flat, far_first=True, order=order, above=above)
        bodies = TabletopBodies(models, poses, self.scene.table, others, names, colors=colors)
        return place_and_check(bodies, motions, spec, aside, release)

    def build_orders(self, motions: np.ndarray, stays: Sequence[int] = ()) -> list[tuple[int, ...]]:
        """Return orders in which the objects that move (N, 4, 4) can be placed so that all stands after each.

        Raises:
            NoOrderError: if there is none.
        """
        models, poses, others = self.bodies
        names = [cloud.name for cloud in self.scene.objects]
        moved = [i for i in range(len(motions)) if i not in set(stays)]
        there = [*others, *((models[i], poses[i]) for i in stays)]
        return BuildOrder(models, motions @ poses, moved, names, there, self.scene.table).find()

    def set_down(self, motions: np.ndarray, stays: Sequence[int] = (), goal: Goal | None = None) -> np.ndarray:
        """Return the motions (N, 4, 4), with stacked objects a little above contact with the object below.

        Objects move straight up or down one by one, supports first.

        Args:
            motions: (N, 4, 4), world frame.
            stays: the objects that do not move.
            goal: a resolved goal in which some objects stand on others.
        """
        lifts = motions[:, 2, 3] + [cloud.bottom for cloud in self.scene.objects]
        moved = [i for i in range(len(motions)) if i not in set(stays)]
        if not moved or lifts[moved].max() < STACKED:  # everything stands on the table
            return motions
        models, poses, others = self.bodies
        goals = motions @ poses
        result = motions.copy()
        there = [*others, *((models[i], poses[i]) for i in stays)]
        after = {} if goal is None else carried_after(goal)
        order = [number for number in executable_order(models, goals, after) if number in set(moved)]
        below: dict[int, int] = {}  # object in the world -> how many of a stack are below it
        around, where = [model for model, _ in there], [pose for _, pose in there]
        with TabletopWorld(around, where, self.scene.table) as world:
            for number in order:
                index, pose = world.add(models[number], goals[number]), goals[number].copy()
                bottom = float(transform_points(pose, np.concatenate(models[number].hulls))[:, 2].min())
                if bottom > STACKED:
                    lift = _lift(world, index, pose)
                    pose[2, 3] += lift
                    fall = _free_fall(world, index, pose, bottom + lift)
                    pose[2, 3] -= fall
                    world.set_pose(index, pose)
                    touched = world.clearances(index, 2 * _STEP)
                    below[index] = 1 + max((below.get(other, 0) for other in touched), default=0)
                    more = min(_PER_LEVEL * (below[index] - 1), _MOST_ADDED)
                    result[number, 2, 3] += lift - fall + np.clip(fall - lift, _LOWEST + more, _HIGHEST + more)
                world.set_pose(index, pose)
        return result


def bottom_up(motions: np.ndarray) -> tuple[int, ...]:
    """Return the objects of a tower by their motions (N, 4, 4), the lowest first."""
    return tuple(np.argsort(motions[:, 2, 3], kind="stable").tolist())


def _lift(world: TabletopWorld, index: int, goal: np.ndarray) -> float:
    """Return how far, metres, an object has to move straight up from its goal until it intersects nothing."""
    lift, pose = 0.0, goal.copy()
    for _ in range(_STEPS):
        deepest = -min(world.clearances(index, _REACH).values(), default=0.0)
        if deepest < _INSIDE:
            break
        lift += deepest
        pose[2, 3] = goal[2, 3] + lift
        world.set_pose(index, pose)
    return lift


def _free_fall(world: TabletopWorld, index: int, goal: np.ndarray, most: float) -> float:
    """Return how far, metres, an object can move straight down from its goal before contact; at most `most`.

    Each step is the distance to the nearest surface, which can never overshoot.
    """
    fallen, pose = 0.0, goal.copy()
    world.set_pose(index, pose)
    for _ in range(_STEPS):
        near = world.clearances(index, _REACH)
        free = min(near.values(), default=_REACH)
        if free < _STEP:
            break
        fallen = min(fallen + free, most)
        pose[2, 3] = goal[2, 3] - fallen
        world.set_pose(index, pose)
        if fallen >= most:
            break
    return fallen
