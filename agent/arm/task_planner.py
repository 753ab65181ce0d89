"""Run the nested search of paper section V.D: ranked arrangements, objects in an executable order, grasps.

For every object the search finds a grasp, and the poses before, at and after pick and place, with a
collision-free motion to each; only perceived clouds are used.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from agent.arm.motion_planner import PlanningScene
from agent.arm.object_planner import ONLY_SLIDES, OUT_OF_REACH, ObjectPlan, ObjectPlanner
from agent.arm.placement_order import asides, bottom_at, precedence, staying, stopovers
from agent.arm.placement_rules import PlacementRules, moving
from agent.arm.sliding import is_along_table, keep_ways_free, way_along_table
from structdiffusion.geometry import transform_points
from structdiffusion.observation import Table


class Search(ObjectPlanner):
    """A planner of whole arrangements among perceived clouds.

    Args:
        scene: the planning scene.
        rng: draws the restarts of the inverse kinematics, and free places.
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
        super().__init__(scene, rng, rules)
        self.rng, self.table = rng, table

    def arrangement(
        self,
        clouds: Sequence[np.ndarray],
        distractors: Sequence[np.ndarray],
        goal_from_initial: np.ndarray,
        limit: float,
        bottoms: Sequence[float] | None = None,
        stop_over: bool = False,
    ) -> tuple[list[ObjectPlan], int | None, str]:
        """Plan for all objects in an executable order.

        Args:
            clouds, distractors: (P, 3) each, in their initial places.
            goal_from_initial: (N, 4, 4); an object whose motion is the identity stays, unless what it will stand on is
                moved: then it is set aside meanwhile.
            limit: the number of the scene's `checks` after which the search ends.
            bottoms: z of the surface that each object stands on at first; by default the table.
            stop_over: set an object down on the way and take it by another grasp, where no grasp serves for both its
                place and its goal.

        Returns:
            The plans, `None` and ""; or no plans, the index of an object that could not be moved
            (`None` when time ran out), and why.
        """
        count = len(clouds)
        current = [np.asarray(cloud, dtype=np.float64) for cloud in clouds]
        bottoms = [0.0] * count if bottoms is None else list(bottoms)
        motions = list(goal_from_initial)  # goal_from_now, of the objects that still wait
        plans: list[ObjectPlan] = []
        done = staying(set(range(count)) - set(moving(goal_from_initial)), precedence(current, motions, bottoms)[0])
        moved_aside = 0
        failed: set[int] = set()
        for i in sorted(set(range(count)) - done):
            # Before any motion is planned, as that takes longer; what is found is used below.
            standing = self.standing_of(i, current[i], bottoms[i])
            if standing.slides and not is_along_table(motions[i]):
                return [], i, ONLY_SLIDES
            if not stop_over and not self.within_reach(i, standing, motions[i]) and standing.grasps:
                return [], i, OUT_OF_REACH
        while len(done) < count:
            under, in_the_way, _ = precedence(current, motions, bottoms)
            under = [below | self.rules.after.get(i, frozenset()) for i, below in enumerate(under)]
            lowest = [bottom_at(motions[i], current[i], bottoms[i]) for i in range(count)]
            far = [transform_points(motions[i], current[i])[:, 0].mean() for i in range(count)]
            slides = {i for i in set(range(count)) - done if self.standing_of(i, current[i], bottoms[i]).slides}
            ways = {i: way_along_table(motions[i], current[i]) for i in slides}
            keep_ways_free(ways, done, current, motions, in_the_way)
            # What is slid needs the way free; then low goals, then far ones, so that the arm need not reach over what
            # it has built; what was blocked before comes last.
            waiting = sorted(
                set(range(count)) - done, key=lambda i: (i in failed, i not in slides, round(lowest[i], 2), -far[i])
            )
            steps = [(i, motions[i], False) for i in waiting if under[i] | in_the_way[i] <= done]
            if not steps:
                if moved_aside == 2 * count:
                    return [], waiting[0], "the objects block each other's goals in a ring"
                steps = asides(
                    waiting, under, in_the_way, done, current, [*distractors, *ways.values()], motions, bottoms,
                    self.table, self.rng,
                )  # fmt: skip
                moved_aside += 1
            elif stop_over and moved_aside < 2 * count:
                steps = [self._by_way(*step, current, distractors, motions, bottoms) for step in steps]
                moved_aside += 1
            reason = "its goal is blocked, and there is no free place to move what blocks it"
            for i, motion, aside in steps:
                if self.scene.checks > limit:
                    return [], None, "the search was given up: it took too long"
                plan, reason = self.object(i, current, distractors, bottoms, motion, limit)
                if plan is None:
                    failed.add(i)
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

    def _by_way(
        self,
        index: int,
        motion: np.ndarray,
        aside: bool,
        current: Sequence[np.ndarray],
        distractors: Sequence[np.ndarray],
        motions: Sequence[np.ndarray],
        bottoms: Sequence[float],
    ) -> tuple[int, np.ndarray, bool]:
        """Return a step itself if its goal is within reach, and else a step to a place from which it is, if there is
        one.
        """
        standing = self.standing_of(index, current[index], bottoms[index])
        at_goal = transform_points(motion, current[index])
        ending = self.standing_of(index, at_goal, bottom_at(motion, current[index], bottoms[index]))
        if self.within_reach(index, standing, motion) or not self.within_reach(index, ending, np.eye(4)):
            return index, motion, aside
        goals = [transform_points(each, cloud) for each, cloud in zip(motions, current)]
        for stop in stopovers(index, current, distractors, goals, bottoms[index], self.table, self.rng):
            if not self.within_reach(index, standing, stop):
                continue
            there = self.standing_of(index, transform_points(stop, current[index]), 0.0)
            if self.within_reach(index, there, motion @ np.linalg.inv(stop)):
                return index, stop, True
        return index, motion, aside
