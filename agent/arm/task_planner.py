"""Run the nested search of paper section V.D: ranked arrangements, objects in an executable order, grasps.

For every object the search finds a grasp, and the poses before, at and after pick and place, with a
collision-free motion to each; only perceived clouds are used.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from agent.arm.containers import WALLS, walls_of
from agent.arm.grasps import Grasp, grasps_of, is_round
from agent.arm.motion_planner import PlanningScene, solid_hull
from agent.arm.placement_order import asides, bottom_at, precedence
from agent.arm.placement_rules import ObstacleKey, PlacementRules, moving
from agent.arm.trajectories import interpolate, straight_line
from structdiffusion.evaluation_protocol import RELEASE_HEIGHT
from structdiffusion.geometry import pose_from_xyz_yaw, raised, transform_points
from structdiffusion.observation import Table

APPROACH = 0.10  # m of straight line before a grasp, after it, and before and after a release
SHORT_APPROACH = 0.05  # m, where the longer line is blocked or out of reach, as on top of a high tower
TOUCHING = -0.001  # m of overlap with the floor that is allowed: in a grasp the fingers nearly touch it
UP = np.array([0.0, 0.0, 1.0])
RESTARTS = 4
PAIRS_TRIED = 24
# m above the goal where an object is released; a hand that does not fit into a container lets go above it.
RELEASES_INTO = (RELEASE_HEIGHT, 0.06, 0.10)
SPINS = 8  # turns about the upright axis that are tried at the goal of a round object


@dataclass(frozen=True)
class ObjectPlan:
    """The plan to move one object. Paths are joint angles (T, n); poses are in the world frame.

    Attributes:
        object: index in `Scene.objects`.
        grasp: the chosen grasp.
        reach: folded to pre-grasp. approach: pre-grasp to grasp. lift: grasp to lifted.
        transfer: lifted to above the goal. lower: above the goal to the release.
        retreat: away from what was released. fold: back to the waiting pose.
        goal_from_now: (4, 4) the planned motion of the object, without the release height.
        spun: whether the object is round, so that its rotation at the goal is free.
        aside: whether this only moves the object out of another's way.
        release: m above the goal where it is released.
    """

    object: int
    grasp: Grasp
    reach: np.ndarray
    approach: np.ndarray
    lift: np.ndarray
    transfer: np.ndarray
    lower: np.ndarray
    retreat: np.ndarray
    fold: np.ndarray
    goal_from_now: np.ndarray
    spun: bool
    aside: bool = False
    release: float = RELEASE_HEIGHT


def _alike(a: Grasp, b: Grasp) -> bool:
    """Return whether two grasps differ by less than 1 cm and 15 degrees, so that both are likely to fail."""
    near = np.linalg.norm(a.world_from_ee[:3, 3] - b.world_from_ee[:3, 3]) < 0.01
    turn = a.world_from_ee[:3, :3].T @ b.world_from_ee[:3, :3]
    return bool(near and (np.trace(turn) - 1) / 2 > math.cos(math.radians(15)))


class Search:
    """A planner among perceived clouds, with its own planning scene.

    Args:
        scene: the planning scene.
        rng: draws the restarts of the inverse kinematics.
        table: the table top to which objects can be moved out of the way.
        rules: what else is known of the placements.
    """

    def __init__(
        self,
        scene: PlanningScene,
        rng: np.random.Generator,
        table: Table = Table(),
        rules: PlacementRules = PlacementRules(),
    ) -> None:
        self.scene = scene
        self.kinematics = scene.kinematics
        self.rng, self.table, self.rules = rng, table, rules

    def arrangement(
        self,
        clouds: Sequence[np.ndarray],
        distractors: Sequence[np.ndarray],
        goal_from_initial: np.ndarray,
        limit: float,
        bottoms: Sequence[float] | None = None,
    ) -> tuple[list[ObjectPlan], int | None, str]:
        """Plan for all objects in an executable order.

        Args:
            clouds, distractors: (P, 3) each, in their initial places.
            goal_from_initial: (N, 4, 4); an object whose motion is the identity stays.
            limit: the number of the scene's `checks` after which the search ends.
            bottoms: z of the surface that each object stands on at first; by default the table.

        Returns:
            The plans, `None` and ""; or no plans, the index of an object that could not be moved
            (`None` when time ran out), and why.
        """
        count = len(clouds)
        current = [np.asarray(cloud, dtype=np.float64) for cloud in clouds]
        bottoms = [0.0] * count if bottoms is None else list(bottoms)
        motions = list(goal_from_initial)  # goal_from_now, of the objects that still wait
        plans: list[ObjectPlan] = []
        done = set(range(count)) - set(moving(goal_from_initial))
        moved_aside = 0
        while len(done) < count:
            under, in_the_way, _ = precedence(current, motions, bottoms)
            under = [below | self.rules.after.get(i, frozenset()) for i, below in enumerate(under)]
            lowest = [bottom_at(motions[i], current[i], bottoms[i]) for i in range(count)]
            far = [transform_points(motions[i], current[i])[:, 0].mean() for i in range(count)]
            # Low goals first, then far ones, so that the arm need not reach over what it has built.
            waiting = sorted(set(range(count)) - done, key=lambda i: (round(lowest[i], 2), -far[i]))
            steps = [(i, motions[i], False) for i in waiting if under[i] | in_the_way[i] <= done]
            if not steps:
                if moved_aside == 2 * count:
                    return [], waiting[0], "the objects block each other's goals in a ring"
                steps = asides(
                    waiting, under, in_the_way, done, current, distractors, motions, bottoms, self.table, self.rng
                )
                moved_aside += 1
            reason = "its goal is blocked, and there is no free place to move what blocks it"
            for i, motion, aside in steps:
                if self.scene.checks > limit:
                    return [], None, "the search was given up: it took too long"
                plan, reason = self.object(i, current, distractors, bottoms, motion, limit)
                if plan is None:
                    continue
                plans.append(replace(plan, aside=aside))
                bottoms[i] = bottom_at(motion, current[i], bottoms[i])
                current[i] = transform_points(plan.goal_from_now, current[i])
                if aside:
                    motions[i] = motions[i] @ np.linalg.inv(plan.goal_from_now)
                else:
                    motions[i] = np.eye(4)
                    done.add(i)
                break
            else:
                return [], (steps[0][0] if steps else waiting[0]), reason
        return plans, None, ""

    def object(
        self,
        index: int,
        clouds: Sequence[np.ndarray],
        distractors: Sequence[np.ndarray],
        bottoms: Sequence[float],
        goal_from_now: np.ndarray,
        limit: float = math.inf,
        start: np.ndarray | None = None,
        avoid: Sequence[Grasp] = (),
    ) -> tuple[ObjectPlan | None, str]:
        """Return a plan to move one object, or `None` and the reason.

        Args:
            clouds: every object's cloud (P, 3) now. bottoms: z of the surface that each stands on.
            start: (n,) the arm's configuration, by default folded.
            avoid: grasps that failed before; similar ones are left out.
        """
        scene = self.scene
        self.set_out(clouds, distractors, bottoms, self.rules.into.get(index, frozenset()))
        found = grasps_of(clouds[index], bottoms[index])
        grasps = [grasp for grasp in found if not any(_alike(grasp, other) for other in avoid)]
        if not grasps:
            return None, "no grasp fits the hand"
        start = self.kinematics.folded if start is None else start
        spun, into = is_round(clouds[index]), index in self.rules.into
        hull = solid_hull(clouds[index], bottoms[index])
        goal_hull = transform_points(goal_from_now, hull)
        reason = "no grasp is within reach both now and at the goal"
        for release in RELEASES_INTO if into else (RELEASE_HEIGHT,):
            pairs = self._reachable_pairs(grasps, clouds[index], goal_from_now, SPINS if spun else 1, release)
            for pick, goal_motion, q_pick, q_place in pairs[:PAIRS_TRIED]:
                if scene.checks > limit:
                    return None, "the search was given up: it took too long"
                plan, why = self._motions(index, hull, goal_hull, pick, goal_motion, q_pick, q_place, start, release)
                if plan is not None:
                    return replace(plan, spun=spun), ""
                reason = why or "every grasp within reach collides"
        return None, reason

    def set_out(
        self,
        clouds: Sequence[np.ndarray],
        distractors: Sequence[np.ndarray],
        bottoms: Sequence[float],
        open_ones: Collection[ObstacleKey] = (),
    ) -> None:
        """Add every object as an obstacle in its present place.

        Args:
            clouds, distractors: (P, 3) each, now. bottoms: z of the surface that each of the `clouds` stands on.
            open_ones: which of them are containers that something goes into: only their walls are obstacles.
        """
        placed: list[tuple[ObstacleKey, np.ndarray, float]] = list(zip(range(len(clouds)), clouds, bottoms))
        placed += [(("distractor", j), cloud, 0.0) for j, cloud in enumerate(distractors)]
        for key, cloud, bottom in placed:
            walls = walls_of(cloud, bottom) if key in open_ones else []
            for number in range(WALLS):
                if number < len(walls):
                    self.scene.set_obstacle((key, number), walls[number])
                else:
                    self.scene.remove_obstacle((key, number))
            if walls:
                self.scene.remove_obstacle(key)
            else:
                self.scene.set_obstacle(key, solid_hull(cloud, bottom))

    def _reachable_pairs(
        self, grasps: Sequence[Grasp], cloud: np.ndarray, goal_from_now: np.ndarray, spins: int, release: float
    ) -> list[tuple[Grasp, np.ndarray, np.ndarray, np.ndarray]]:
        """Return tuples, best first: grasp, motion to the goal, joint angles at the pick and at the release."""
        kinematics, folded = self.kinematics, self.kinematics.folded
        picks = np.repeat(np.stack([grasp.world_from_ee for grasp in grasps]), RESTARTS, axis=0)
        seeds = kinematics.random(self.rng, len(picks))
        seeds[::RESTARTS] = folded
        q, solved = kinematics.inverse(picks, seeds)
        q = kinematics.unwind(q, folded)
        # A round thing may stand at any turn about its upright axis.
        center = transform_points(goal_from_now, 0.5 * (cloud.min(axis=0) + cloud.max(axis=0)))
        there = pose_from_xyz_yaw(*center, 0.0)
        motions = [
            there @ pose_from_xyz_yaw(0, 0, 0, 2 * math.pi * k / spins) @ np.linalg.inv(there) @ goal_from_now
            for k in range(spins)
        ]
        rows = []
        for g in range(len(grasps)):
            rows_of_grasp = range(g * RESTARTS, (g + 1) * RESTARTS)
            good = [r for r in rows_of_grasp if solved[r] and not self._hits(q[r], grasps[g])]
            good.sort(key=lambda r: np.abs(q[r] - folded).max())
            rows += [(g, r, m) for r in good[:2] for m in range(spins)]
        if not rows:
            return []
        rows = rows[:160]
        targets = np.stack([raised(motions[m] @ grasps[g].world_from_ee, release) for g, _, m in rows])
        q_place, reached = kinematics.inverse(targets, np.stack([q[r] for _, r, _ in rows]))
        pairs = []
        for k, (g, r, m) in enumerate(rows):
            if reached[k]:
                place = kinematics.unwind(q_place[k], q[r])
                effort = np.abs(place - q[r]).max() + np.abs(q[r] - folded).max()
                pairs.append((grasps[g].quality - 0.05 * effort, (grasps[g], motions[m], q[r], place)))
        pairs.sort(key=lambda pair: -pair[0])
        return [pair for _, pair in pairs]

    def _hits(self, q: np.ndarray, grasp: Grasp) -> bool:
        """Return whether the open hand at the grasp hits the floor; a cheap check before planning."""
        self.scene.set_fingers([grasp.opening] * 3)
        return self.scene.collides(q, floor=TOUCHING, only_floor=True)

    def _line(self, q: np.ndarray, pose: np.ndarray, direction: np.ndarray) -> np.ndarray | None:
        """Return a free straight line (T, n) of the hand from `pose` along `direction` (3,), shortened if
        necessary.
        """
        for length in (APPROACH, SHORT_APPROACH):
            moved = pose.copy()
            moved[:3, 3] += length * direction
            line = straight_line(self.kinematics, q, (pose, moved))
            if line is not None and not self.scene.path_collides(line, floor=TOUCHING):
                return line
        return None

    def _motions(
        self,
        index: int,
        hull: np.ndarray,
        goal_hull: np.ndarray,
        grasp: Grasp,
        goal_motion: np.ndarray,
        q_pick: np.ndarray,
        q_place: np.ndarray,
        start: np.ndarray,
        release: float,
    ) -> tuple[ObjectPlan | None, str]:
        """Plan all motions for one grasp; without one, return `None` and the obstacle."""
        scene = self.scene
        at_pick = grasp.world_from_ee
        at_place = raised(goal_motion @ at_pick, release)
        scene.release()
        scene.set_fingers([grasp.opening] * 3)
        scene.remove_obstacle(index)
        held = transform_points(np.linalg.inv(at_pick), hull)
        try:
            back = self._line(q_pick, at_pick, -at_pick[:3, 2])
            if back is None:
                return None, "the straight approach to the object is blocked or out of reach"
            retreat = self._line(q_place, at_place, -at_place[:3, 2])
            if retreat is None:
                return None, "the straight retreat from the goal is blocked or out of reach"
            scene.hold(held)
            lift = self._line(q_pick, at_pick, UP)
            above = self._line(q_place, at_place, UP)
            if lift is None or above is None:
                return None, "lifting or lowering the object is blocked or out of reach"
            transfer = scene.plan(lift[-1], above[-1])
            if transfer is None:
                return None, "no free motion from the pick to the goal was found"
            scene.release()
            scene.set_obstacle(index, goal_hull)
            fold = scene.plan(retreat[-1], self.kinematics.unwind(self.kinematics.folded, retreat[-1]))
            if fold is None:
                return None, "no free motion back from the goal was found"
            scene.set_obstacle(index, hull)
            reach = scene.plan(start, self.kinematics.unwind(back[-1], start))
            if reach is None:
                return None, "no free motion to the object was found"
        finally:
            scene.release()
            scene.set_obstacle(index, hull)
        return (
            ObjectPlan(
                index, grasp, reach, back[::-1], lift, transfer, above[::-1], retreat, interpolate(fold, 1.0),
                goal_motion, spun=False, release=release,
            ),
            "",
        )
