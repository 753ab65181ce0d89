"""Trying arrangements out in imagination: what the camera did not see is guessed, and physics says what would happen.

Nothing but the partial clouds, the camera's place and the table is used. The guessed bodies go through the same
protocol as the true ones do when success is measured (`physical.place_and_check`).
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cached_property

import numpy as np

from grounding.spec import StructureSpec
from structdiffusion.completion.bodies import bodies_of_scene
from structdiffusion.geometry import pose_from_xyz_yaw, transform_points
from structdiffusion.objects.model import ObjectModel
from structdiffusion.observation import Scene
from structdiffusion.protocol.physical_stability import Verdict, executable_order, place_and_check
from structdiffusion.simulation.world import TabletopWorld

HYPOTHESES = 5  # of what the camera did not see; the first is the likeliest
# How far the others are from it, roughly: radius and height of bodies (m), their masses (factor e to this), and where
# things land (m, rad).
_SIZE, _MASS, _SHIFT, _TURN = 0.0015, 0.5, 0.003, 0.03
_MISFIT = 0.0025  # m that the radius of one may be larger, and that of the next smaller
# What is stacked is released from this much, metres, above where guessed surfaces touch. Where a thing touches a vessel
# is guessed to a centimetre: higher by more than 2 cm, with the 3 cm of the protocol, it would fall too fast; lower
# than the true contact, it would be inside of something.
_LOWEST, _HIGHEST = 0.006, 0.009
STACKED = 0.01  # m above the table, from where on a thing is stacked
_INSIDE = 0.001  # m of overlap that counts as none
_REACH = 0.05  # m, within which distances to what is below are asked for
_STEP, _STEPS = 0.0005, 40  # of lowering: m that count as contact, and how often


class PhysicsRollout:
    """The guessed bodies of a scene, made when they are first needed.

    Args:
        scene: what was perceived.
    """

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self._assumed: dict[tuple[int, tuple[int, ...]], tuple[list[ObjectModel], np.ndarray]] = {}

    @cached_property
    def _bodies(self) -> tuple[list[ObjectModel], np.ndarray, list[tuple[ObjectModel, np.ndarray]]]:
        return bodies_of_scene(self.scene)

    def _hypothesis(self, number: int, order: tuple[int, ...]) -> tuple[list[ObjectModel], np.ndarray]:
        """The N bodies otherwise than guessed, and errors (N, 4, 4) of where they land.

        First every second body of a tower is broader and the others are narrower, then the other way round, since it
        is what goes into a vessel that depends on it; then all differ at random. Masses always do.
        """
        if (number, order) in self._assumed:
            return self._assumed[number, order]
        rng = np.random.default_rng(number)
        models, errors = [], []
        for level in np.argsort(order):
            broad, high = _SIZE * rng.standard_normal(2)
            if number <= 2:
                broad = _MISFIT * (-1) ** (level + number)
            model = self._bodies[0][len(models)]
            stretch = np.array([1 + broad / model.radius] * 2 + [1 + high / model.height])
            hulls = tuple(hull * np.clip(stretch, 0.8, 1.25) for hull in model.hulls)
            models.append(replace(model, hulls=hulls, mass=model.mass * math.exp(_MASS * rng.standard_normal())))
            errors.append(pose_from_xyz_yaw(*_SHIFT * rng.standard_normal(2), 0.0, _TURN * rng.standard_normal()))
        self._assumed[number, order] = models, np.array(errors)
        return self._assumed[number, order]

    def verdict(self, motions: np.ndarray, spec: StructureSpec, hypothesis: int = 0) -> Verdict:
        """What would become of the objects, moved by (N, 4, 4), if they looked from behind as guessed.

        Args:
            motions: (N, 4, 4), world frame.
            spec: what was asked for.
            hypothesis: 0 for the likeliest bodies, landing exactly; below `HYPOTHESES` for others, that land a few
                millimetres off.
        """
        models, poses, others = self._bodies
        if hypothesis:
            models, errors = self._hypothesis(hypothesis, bottom_up(motions))
            at = motions @ poses
            at[:, :3, :3] = at[:, :3, :3] @ errors[:, :3, :3]
            at[:, :2, 3] += errors[:, :2, 3]
            motions = at @ np.linalg.inv(poses)
        names = [cloud.name for cloud in (*self.scene.objects, *self.scene.distractors)]
        # What falls, falls at once: to wait for 2 s as the protocol does would double the time.
        return place_and_check(models, poses, motions, spec, self.scene.table, others, names, until_rest=True)

    def set_down(self, motions: np.ndarray) -> np.ndarray:
        """The motions (N, 4, 4), with what is stacked a little above where it would touch what is below it.

        Straight up or down, object by object, supports first.
        """
        if motions[:, 2, 3].max() < STACKED:  # everything stands on the table
            return motions
        models, poses, others = self._bodies
        goals = motions @ poses
        result = motions.copy()
        with TabletopWorld(*zip(*others), table=self.scene.table) as world:
            for number in executable_order(models, goals):
                index, goal = world.add(models[number], goals[number]), goals[number].copy()
                bottom = float(transform_points(goal, np.concatenate(models[number].hulls))[:, 2].min())
                if bottom > STACKED:
                    lift = _lift(world, index, goal)
                    goal[2, 3] += lift
                    fall = _free_fall(world, index, goal, bottom + lift)
                    goal[2, 3] -= fall
                    result[number, 2, 3] += lift - fall + np.clip(fall - lift, _LOWEST, _HIGHEST)
                world.set_pose(index, goal)
        return result


def bottom_up(motions: np.ndarray) -> tuple[int, ...]:
    """The objects of a tower by their motions (N, 4, 4), the lowest first."""
    return tuple(np.argsort(motions[:, 2, 3], kind="stable").tolist())


def _lift(world: TabletopWorld, index: int, goal: np.ndarray) -> float:
    """How far, metres, an object has to go straight up from its goal until it is inside of nothing."""
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
    """How far, metres, an object can go straight down from its goal before it touches something; at most `most`.

    It goes by its distance to the nearest surface, which can never be too far.
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
