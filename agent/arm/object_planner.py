"""Plan how one object is taken and released: a grasp, and a collision-free motion between all poses of the hand."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from agent.arm.containers import WALLS, walls_of
from agent.arm.grasps import Grasp, is_round
from agent.arm.motion_planner import CLEARANCE, HELD_OVERLAP, PlanningScene
from agent.arm.placement_rules import ObstacleKey, PlacementRules
from agent.arm.reachability import APPROACH, TOUCHING, Pair, Pick, Reachability, Standing
from agent.arm.sliding import is_along_table, leads, sliding_path
from agent.arm.trajectories import CARTESIAN_STEP, interpolate, level_path
from structdiffusion.evaluation_protocol import MAX_TILT, RELEASE_HEIGHT
from structdiffusion.geometry import pose_from_xyz_yaw, raised, tilt_between, transform_points, turn_of

SHORT_APPROACH = 0.05  # m, where the longer line is blocked or out of reach, as on top of a high tower
ROOM = 0.02  # m that is kept around what is carried, where there is so much: hulls may overlap a little, and motors lag
RISES = (0.0, 0.1, 0.2)  # m by which the hand is lifted further to carry something level over what stands in the way
LIFTS_TRIED = 2  # after which what slips out of the fingers is slid, if its goal is on the table
PAIRS_TRIED = 24  # ways to release an object that are tried before it is given up
# m above the goal where an object is released, as in the evaluation protocol. From 5 mm or 1 cm less fruit rolls on,
# but the opening hand tips over cups. A hand that does not fit into a container lets go above it.
RELEASES_INTO = (RELEASE_HEIGHT, 0.06, 0.10)
FRICTION_RELEASE = 0.01  # m, the same for what is held by friction, which leaves the opening fingers at once
RELEASES_UPRIGHTED = (0.01, RELEASE_HEIGHT)  # m: what is put upright is held aslant, and would topple from higher
# m, a last resort where nothing else was found: the fingers may touch the hulls of other objects, which are a little
# too large, and the hull of what is held may overlap them further, because it fills hollows.
LOOSE_CLEARANCE, LOOSE_OVERLAP = 0.0, 0.015
OUT_OF_REACH = "no grasp is within reach both now and at the goal"
ONLY_SLIDES = "it can only be slid along the table"


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


def alike(a: Grasp, b: Grasp, cloud: np.ndarray) -> bool:
    """Return whether two grasps of an object differ by less than 1 cm and 15 degrees, so that both are likely to fail;
    of what is round, from whichever side.

    Args:
        cloud: (P, 3) the object where both would take it.
    """
    one, other = a.world_from_ee, b.world_from_ee
    if is_round(cloud):
        x, y, _ = 0.5 * (cloud.min(axis=0) + cloud.max(axis=0))
        turn = math.atan2(one[1, 0], one[0, 0]) - math.atan2(other[1, 0], other[0, 0])
        other = pose_from_xyz_yaw(x, y, 0.0, turn) @ pose_from_xyz_yaw(-x, -y, 0.0, 0.0) @ other
    near = a.slides == b.slides and np.linalg.norm(one[:3, 3] - other[:3, 3]) < 0.01
    return bool(near and turn_of(one[:3, :3].T @ other[:3, :3]) < math.radians(15))


class ObjectPlanner:
    """A planner of single pick-and-place actions among perceived clouds, with its own planning scene.

    Args:
        scene: the planning scene.
        rng: draws the restarts of the inverse kinematics.
        rules: what else is known of the placements.
    """

    finder: Callable[..., Reachability] = Reachability
    standing: Callable[..., Standing] = Standing

    def __init__(
        self, scene: PlanningScene, rng: np.random.Generator, rules: PlacementRules = PlacementRules()
    ) -> None:
        self.scene, self.kinematics, self.rules = scene, scene.kinematics, rules
        self._reachability = self.finder(scene, rng)
        self._known: dict[ObstacleKey, list[Standing]] = {}  # the places in which each object was planned for
        self._layout: dict[ObstacleKey, tuple[Standing, bool]] = {}  # what stands where; whether it is open
        # Of each pick among obstacles, loosely or not: its free lines back and up, or why there are none.
        self._taken: dict[tuple[Pick, frozenset, bool], tuple[np.ndarray, np.ndarray] | str] = {}
        self._loose = False

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
            avoid: grasps that failed before; those that are alike are left out.
        """
        self.set_out(clouds, distractors, bottoms, self.rules.into.get(index, frozenset()))
        standing = self.standing_of(index, clouds[index], bottoms[index])
        failed = [grasp for grasp in standing.grasps if any(alike(grasp, other, standing.cloud) for other in avoid)]
        if len(failed) == len(standing.grasps):
            return None, "no grasp fits the hand"
        along = is_along_table(goal_from_now)
        if standing.slides and not along:
            return None, ONLY_SLIDES
        # What slipped out of the fingers is rather slid than lifted once more.
        rather_slid = standing.hangs or sum(not grasp.slides for grasp in avoid) >= LIFTS_TRIED
        start = self.kinematics.folded if start is None else start
        reason = OUT_OF_REACH
        releases = self._releases(index, standing, goal_from_now)
        for release, lifts in itertools.product(releases, (False, True) if rather_slid else (True,)):
            tried = 0
            for pair in self._reachability.pairs(standing, goal_from_now, release):
                if self.scene.checks > limit:
                    return None, "the search was given up: it took too long"
                if tried == PAIRS_TRIED:
                    break
                grasp = pair.pick.grasp
                suits = along and leads(grasp, standing.cloud, pair.goal_motion) if grasp.slides else lifts
                if not suits or grasp in failed:
                    continue
                taken = self._take(index, standing, pair.pick)
                if isinstance(taken, str):
                    reason = taken
                    continue
                tried += 1
                plan, reason = self._motions(index, standing, pair, taken, start, release)
                if plan is not None:
                    return plan, ""
        return None, reason

    def object_at_last(self, *action: Any) -> tuple[ObjectPlan | None, str]:
        """Return a plan to move one object, as `object` does; where there is none, one that touches others lightly."""
        try:
            for last_resort in (False, True):
                self.loosen(last_resort)
                plan, reason = self.object(*action)
                if plan is not None:
                    break
        finally:
            self.loosen(False)
        return plan, reason

    def _releases(self, index: int, standing: Standing, goal_from_now: np.ndarray) -> tuple[float, ...]:
        if standing.slides:
            return (0.0,)
        if tilt_between(goal_from_now, np.eye(4)) > MAX_TILT:
            return RELEASES_UPRIGHTED
        if index in self.rules.into:
            return RELEASES_INTO
        return (RELEASE_HEIGHT if self.scene.arm.welds else FRICTION_RELEASE,)

    def within_reach(self, index: int, standing: Standing, goal_from_now: np.ndarray) -> bool:
        """Return whether the object can be brought to its goal if nothing is in the way."""
        return any(
            next(self._reachability.pairs(standing, goal_from_now, release), None) is not None
            for release in self._releases(index, standing, goal_from_now)
        )

    def standing_of(self, key: ObstacleKey, cloud: np.ndarray, bottom: float) -> Standing:
        """Return what is known of an object in this place."""
        known = self._known.setdefault(key, [])
        for standing in known:
            if standing.bottom == bottom and np.array_equal(standing.cloud, cloud):
                return standing
        known.append(self.standing(cloud, bottom, self.scene.arm.hand, friction=not self.scene.arm.welds))
        return known[-1]

    def loosen(self, loose: bool) -> None:
        """Set whether other objects may be touched lightly from now on, as a last resort."""
        self._loose = loose
        self.scene.held_overlap = LOOSE_OVERLAP if loose else HELD_OVERLAP

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
        for key in self._layout.keys() - {key for key, _, _ in placed}:  # it is there no more
            del self._layout[key]
            for part in (key, *((key, number) for number in range(WALLS))):
                self.scene.remove_obstacle(part)
        for key, cloud, bottom in placed:
            now = self.standing_of(key, cloud, bottom), key in open_ones
            if self._layout.get(key) == now:
                continue
            self._layout[key] = now
            walls = walls_of(cloud, bottom) if key in open_ones else []
            for number in range(WALLS):
                if number < len(walls):
                    self.scene.set_obstacle((key, number), walls[number])
                else:
                    self.scene.remove_obstacle((key, number))
            if walls:
                self.scene.remove_obstacle(key)
            else:
                self.scene.set_obstacle(key, now[0].hull)

    def _free(self, line: np.ndarray) -> np.ndarray | None:
        """Return the start of a straight line (T, n) that is free: long, or else short; `None` if it is blocked."""
        long, short = (1 + math.ceil(length / CARTESIAN_STEP) for length in (APPROACH, SHORT_APPROACH))
        free = 1
        clearance = LOOSE_CLEARANCE if self._loose else CLEARANCE
        while free < len(line) and not self.scene.path_collides(line[free - 1 : free + 1], clearance, floor=TOUCHING):
            free += 1
        return line[:long] if free >= long else line[:short] if free >= short else None

    def _fingers_meet(self, q: np.ndarray, grasp: Grasp) -> bool:
        """Return whether the fingers at q (n,) meet another object while they close or open."""
        clearance = LOOSE_CLEARANCE if self._loose else CLEARANCE
        return self.scene.closing_collides(q, grasp.opening, grasp.closing, clearance, floor=TOUCHING)

    def _take(self, index: int, standing: Standing, pick: Pick) -> tuple[np.ndarray, np.ndarray] | str:
        """Return the free lines back from a pick and up from it with the object, or what is in the way.

        The answer is kept for the next arrangement: until it moves something, everything stands where it stood.
        """
        others = frozenset(one for key, one in self._layout.items() if key != index)
        case = pick, others, self._loose
        if case not in self._taken:
            scene, lines = self.scene, self._reachability.at_pick(standing, pick)
            found: str | tuple[np.ndarray, np.ndarray]
            scene.open_fingers(pick.grasp.opening)
            scene.remove_obstacle(index)
            try:
                back = self._free(lines.back)
                if back is not None and self._fingers_meet(pick.q, pick.grasp):
                    found = "another object is in the way of the closing fingers"
                elif back is None:
                    found = "the straight approach to the object is blocked or out of reach"
                elif pick.grasp.slides:
                    found = back, pick.q[None]
                else:
                    scene.hold(self._held(standing, pick))
                    lift = self._free(lines.up)
                    found = "lifting the object is blocked or out of reach" if lift is None else (back, lift)
            finally:
                scene.release()
                scene.set_obstacle(index, standing.hull)
            self._taken[case] = found
        return self._taken[case]

    @staticmethod
    def _held(standing: Standing, pick: Pick) -> np.ndarray:
        """Return the object's hull (V, 3) in the hand."""
        return transform_points(np.linalg.inv(pick.grasp.world_from_ee), standing.hull)

    def _motions(
        self,
        index: int,
        standing: Standing,
        pair: Pair,
        taken: tuple[np.ndarray, np.ndarray],
        start: np.ndarray,
        release: float,
    ) -> tuple[ObjectPlan | None, str]:
        """Plan all motions for one way to take and release; without one, return `None` and the obstacle."""
        scene, grasp, (back, lift) = self.scene, pair.pick.grasp, taken
        scene.open_fingers(grasp.opening)
        scene.remove_obstacle(index)
        try:
            carried = self._carried(standing, pair, lift[-1], release)
            if isinstance(carried, str):
                return None, carried
            retreat, transfer, lower = carried
            scene.release()
            scene.set_obstacle(index, transform_points(pair.goal_motion, standing.hull))
            fold = scene.plan(retreat[-1], self.kinematics.unwind(self.kinematics.folded, retreat[-1]))
            if fold is None:
                return None, "no free motion back from the goal was found"
            scene.set_obstacle(index, standing.hull)
            reach = scene.plan(start, self.kinematics.unwind(back[-1], start))
            if reach is None:
                return None, "no free motion to the object was found"
        finally:
            scene.release()
            scene.set_obstacle(index, standing.hull)
        fold = interpolate(fold, 1.0)
        return (
            ObjectPlan(
                index,
                grasp,
                reach,
                back[::-1],
                lift,
                transfer,
                lower,
                retreat,
                fold,
                pair.goal_motion,
                standing.spun,
                release=0.0 if grasp.slides else release,
            ),
            "",
        )

    def _transfer(self, held: np.ndarray, start: np.ndarray, goal: np.ndarray) -> np.ndarray | None:
        """Return a motion with an object (V, 3) in the hand, if possible level and with room around it."""
        from_middle = held - held.mean(axis=0)
        away = from_middle / np.maximum(np.linalg.norm(from_middle, axis=1, keepdims=True), 1e-9)
        for room in (ROOM, 0.0):
            self.scene.hold(held + room * away)
            for rise in RISES:
                path = level_path(self.kinematics, start, goal, rise)
                if path is not None and not self.scene.path_collides(path):
                    return path
            path = self.scene.plan(start, goal)
            if path is not None:
                break
        return path

    def _carried(
        self, standing: Standing, pair: Pair, lifted: np.ndarray, release: float
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray] | str:
        """Return the retreat from the goal, the motion to above it and the lowering, or the obstacle to one of them."""
        scene, grasp = self.scene, pair.pick.grasp
        slid, q = None, pair.q
        if grasp.slides:
            middle = 0.5 * (standing.cloud.min(axis=0) + standing.cloud.max(axis=0))
            slid = sliding_path(self.kinematics, pair.pick.q, grasp.world_from_ee, pair.goal_motion, middle)
            if slid is None:
                return "the way along the table is out of reach"
            q = slid[-1]
        height = 0.0 if grasp.slides else release
        place = self._reachability.lines(q, raised(pair.goal_motion @ grasp.world_from_ee, height))
        retreat = self._free(place.back)
        if retreat is None:
            return "the straight retreat from the goal is blocked or out of reach"
        if self._fingers_meet(q, grasp):
            return "another object is in the way of the opening fingers"
        held = self._held(standing, pair.pick)
        scene.hold(held)
        if slid is not None:
            if scene.path_collides(slid, LOOSE_CLEARANCE, floor=TOUCHING):
                return "something stands in the way along the table"
            return retreat, slid, slid[-1:]
        above = self._free(place.up)
        if above is None:
            return "lowering the object is blocked or out of reach"
        transfer = self._transfer(held, lifted, above[-1])
        if transfer is None:
            return "no free motion from the pick to the goal was found"
        return retreat, transfer, above[::-1]
