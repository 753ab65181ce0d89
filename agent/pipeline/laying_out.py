"""Lay a goal out anew while the arm builds it, because an object is gone or something stands in the way.

What stands should stay. So the places of the last arrangement are tried first, shared out among the objects that still
wait; then the arrangements that the planner proposes for what is left, each moved as a whole to where most of what
stands need not be touched.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import islice, permutations

import numpy as np
from shapely import MultiPoint

from agent import events
from agent.arm.placement_order import bottom_at
from agent.arm.remainder import Remainder, Replanner
from agent.errors import NotBuildable, NoValidGoal
from agent.pipeline.seen_checks import missed_by_goal, missed_by_structure
from agent.pipeline.table_goal import TableGoal
from grounding.goals.goal import Goal
from grounding.goals.parts import GoalError
from grounding.spec import StructureSpec
from structdiffusion.completion.estimate import estimate
from structdiffusion.evaluation_protocol import MAX_TILT
from structdiffusion.geometry import pose_from_xyz_yaw, tilt_between, transform_points
from structdiffusion.observation import Arrangement, ObjectCloud, Scene
from structdiffusion.postprocessing.estimated_checks import checks_scores
from structdiffusion.postprocessing.settling import settle_each
from structdiffusion.structures import structure_named

CLEAR = 0.01  # m between what is placed anew and what stays, room for a fingertip
STAYS, AS_HIGH = 0.01, 0.02  # m from where it would go, along the table and upwards: what stands is not moved for less
HOLDS = 0.5  # of the score of the checks: more, if they hold
SHARED_OUT = 120  # ways to share out the places among what waits: all of five objects
MOST = 8  # arrangements that are proposed: each costs a search for motions
TURNED = math.radians(10.0)  # by which a structure may be turned as a whole: less than any heading may be off


def layouts_of(
    wanted: StructureSpec | TableGoal,
    propose: Callable[[Scene, StructureSpec | TableGoal], events.Proposed],
    another: bool = False,
) -> Replanner:
    """Return whoever lays a goal out anew.

    Args:
        wanted: the slots of one structure, or a goal of several parts.
        propose: proposes arrangements of such a goal for the objects of a scene; raises `NotBuildable` or `NoValidGoal`
            if there are none.
        another: whether something else was built so far, so that what stands fulfils no part of this goal by itself.
    """
    if isinstance(wanted, TableGoal):
        return GoalLayouts(wanted, propose, another)
    return StructureLayouts(wanted, lambda now: propose(now, wanted).arrangements)


class StructureLayouts:
    """Other arrangements of one structure.

    Args:
        spec: the slots.
        propose: proposes arrangements of the structure for all objects of a scene, best first; raises `NotBuildable` or
            `NoValidGoal` if there are none.
    """

    def __init__(self, spec: StructureSpec, propose: Callable[[Scene], Sequence[Arrangement]]) -> None:
        self._spec, self._propose = spec, propose

    def concerns(self, name: str) -> bool:
        """Return false: a structure is built without regard to what stays."""
        return False

    def missed(self, remainder: Remainder) -> list[str]:
        """Say which checks of the structure fail where its objects are, and would hold where they were to go."""
        return missed_by_structure(remainder, self._spec)

    def lay_out(self, remainder: Remainder, members: Collection[int] | None = None) -> list[Arrangement]:
        """Propose arrangements for what is left, those first that move the fewest of the objects that stand.

        Args:
            remainder: what is left.
            members: the objects that the structure had at first; by default all of those that were to move.
        """
        scene, flat_from_initial = table_of(remainder, flat=True)
        standing = [k for k, index in enumerate(remainder.left) if index in remainder.standing]
        now_from_flat = remainder.now_from_initial[list(remainder.left)] @ np.linalg.inv(flat_from_initial)
        choices = [*islice(_shared_out(remainder, members, flat_from_initial, standing), SHARED_OUT)]
        try:
            proposed = [np.asarray(each.goal_from_initial) for each in self._propose(scene)]
        except (NotBuildable, NoValidGoal):
            proposed = []
        choices += [_aligned(motions, now_from_flat, scene, standing) for motions in proposed] + proposed
        if not choices:
            return []
        estimates = [estimate(cloud) for cloud in scene.objects]
        settled = settle_each(estimates, np.array(choices))
        moved = np.zeros(len(settled))
        for motions, k in ((motions, k) for motions in range(len(settled)) for k in standing):
            off = _middles(scene, settled[motions])[k] - _middles(scene, now_from_flat)[k]
            if np.linalg.norm(off[:2]) < STAYS and abs(off[2]) < AS_HIGH:
                settled[motions, k] = now_from_flat[k]
            else:
                moved[motions] += 1
        scores = checks_scores(estimates, settled, self._spec, scene.table)
        good = [k for k in np.argsort(moved, kind="stable") if scores[k] > HOLDS and _is_clear(settled[k], scene)]
        return [
            _of_all(settled[k] @ flat_from_initial, remainder, {"checks": scores[k], "total": scores[k]})
            for k in good[:MOST]
        ]


def table_of(remainder: Remainder, flat: bool) -> tuple[Scene, np.ndarray]:
    """Return the objects that are left as a planner takes them: upright, as if nothing had fallen over.

    Args:
        remainder: what is left.
        flat: as if everything stood on the table.

    Returns:
        The scene, and how its objects have moved (n, 4, 4) since the build began.
    """
    objects, motions = [], []
    for index in remainder.left:
        cloud, motion = remainder.first.objects[index], remainder.now_from_initial[index].copy()
        points = cloud.points.astype(np.float64)
        if tilt_between(motion, np.eye(4)) > MAX_TILT:
            off = transform_points(motion, points).mean(axis=0) - points.mean(axis=0)
            motion = pose_from_xyz_yaw(off[0], off[1], -cloud.bottom, 0.0)
        bottom = max(0.0, bottom_at(motion, points, cloud.bottom))
        if flat:
            motion[2, 3] -= bottom
        moved = transform_points(motion, points).astype(np.float32)
        objects.append(replace(cloud, points=moved, bottom=0.0 if flat else bottom))
        motions.append(motion)
    return replace(remainder.first, objects=tuple(objects), distractors=remainder.others), np.array(motions)


def _shared_out(
    remainder: Remainder, members: Collection[int] | None, flat_from_initial: np.ndarray, standing: Sequence[int]
) -> Iterator[np.ndarray]:
    """Yield motions (n, 4, 4) from the flat scene that bring what waits to places of the last arrangement that are
    free, in every order, the present one first.
    """
    left, goals = remainder.left, remainder.goal_from_initial
    places = {i: _middle(remainder.first.objects[i], goals[i]) for i in range(len(goals))}
    waiting = [k for k in range(len(left)) if k not in standing]
    own = [left[k] for k in waiting]
    gone = [i for i in places if i not in left and (goals[i] != np.eye(4)).any()]
    free = own + [i for i in gone if members is None or i in members]
    for order in permutations(free, len(waiting)):
        motions = goals[list(left)] @ np.linalg.inv(flat_from_initial)
        for k, place in zip(waiting, order):
            motions[k, :2, 3] += (places[place] - places[left[k]])[:2]
        yield motions


def _aligned(motions: np.ndarray, now_from_flat: np.ndarray, scene: Scene, standing: Sequence[int]) -> np.ndarray:
    """Return motions (n, 4, 4), moved and turned as a whole to where most of what stands would be already."""
    if not standing:
        return motions
    there, here = _middles(scene, motions)[standing, :2], _middles(scene, now_from_flat)[standing, :2]
    from_middle, to_middle = there - there.mean(axis=0), here - here.mean(axis=0)
    cross = from_middle[:, 0] @ to_middle[:, 1] - from_middle[:, 1] @ to_middle[:, 0]
    turn = math.atan2(cross, (from_middle * to_middle).sum())
    turn = turn if abs(turn) < TURNED else 0.0
    rotation = pose_from_xyz_yaw(0.0, 0.0, 0.0, turn)
    rotation[:2, 3] = here.mean(axis=0) - rotation[:2, :2] @ there.mean(axis=0)
    return rotation @ motions


def _is_clear(motions: np.ndarray, scene: Scene) -> bool:
    """Return whether all objects are on the table and clear of the distractors after motions (n, 4, 4)."""
    others = [MultiPoint(cloud.points[:, :2]).convex_hull for cloud in scene.distractors]
    for cloud, motion in zip(scene.objects, motions):
        points = transform_points(motion, cloud.points.astype(np.float64))[:, :2]
        outline = MultiPoint(points).convex_hull
        if scene.table.overhang(points) > 0.0 or any(outline.distance(other) < CLEAR for other in others):
            return False
    return True


def _middle(cloud: ObjectCloud, motion: np.ndarray) -> np.ndarray:
    """Return where a motion (4, 4) takes the middle (3,) of a cloud."""
    return transform_points(motion, cloud.points.astype(np.float64).mean(axis=0))


def _middles(scene: Scene, motions: np.ndarray) -> np.ndarray:
    """Return where motions (n, 4, 4) take the middles (n, 3) of the objects of a scene."""
    return np.array([_middle(cloud, motion) for cloud, motion in zip(scene.objects, motions)])


def _of_all(goal_from_initial: np.ndarray, remainder: Remainder, scores: Mapping[str, float]) -> Arrangement:
    """Return the arrangement of all objects that the build began with, given the motions (n, 4, 4) of those left."""
    motions = np.tile(np.eye(4), (len(remainder.goal_from_initial), 1, 1))
    motions[list(remainder.left)] = goal_from_initial
    for index in remainder.standing:
        if np.allclose(motions[index], remainder.now_from_initial[index], atol=1e-9):
            motions[index] = remainder.now_from_initial[index]
    return Arrangement(motions, dict(scores))


class GoalLayouts:
    """Other arrangements of a goal of several parts: the parts that hold already stay as they are.

    Args:
        wanted: the goal.
        propose: proposes arrangements of a goal for the objects of a scene; raises `NotBuildable` or `NoValidGoal` if
            there are none.
        another: as for `layouts_of`.
    """

    def __init__(
        self, wanted: TableGoal, propose: Callable[[Scene, TableGoal], events.Proposed], another: bool = False
    ) -> None:
        self._wanted, self._propose, self._another = wanted, propose, another

    def concerns(self, name: str) -> bool:
        """Return whether the goal places others by something that stays."""
        return name in self._wanted.names and bool(self._wanted.parts_of(name))

    def lay_out(self, remainder: Remainder) -> list[Arrangement]:
        """Propose arrangements for what is left, those first that move the fewest of the objects that stand."""
        if any(part.shape is not None and structure_named(part.shape).exact for part in self._wanted.goal.structures):
            return []  # only what was tried in physics in its order is built
        scene, now_from_initial = table_of(remainder, flat=False)
        clouds = {cloud.name: cloud for cloud in (*scene.objects, *scene.distractors)}
        gone = [name for name in self._wanted.names if name not in clouds]
        goal = self._wanted.without(gone, self._fulfilled(remainder))
        if goal is None or any(part.relation in ("moved", "swapped") for part in goal.goal.relations):
            return []  # how far from where it stood first cannot be told from where it stands now
        if goal.goal.plain_spec is not None:
            return self._one_structure(remainder, goal)
        everything = tuple(clouds[name] for name in goal.names)
        others = tuple(cloud for name, cloud in clouds.items() if name not in goal.names)
        try:
            proposed = self._propose(replace(scene, objects=everything, distractors=others), goal)
        except (NotBuildable, NoValidGoal, GoalError):
            return []
        names = [cloud.name for cloud in scene.objects]
        here = _middles(scene, np.tile(np.eye(4), (len(names), 1, 1)))
        standing = [k for k, index in enumerate(remainder.left) if index in remainder.standing]
        rows = list[tuple[int, np.ndarray, Mapping[str, float]]]()
        for arrangement in proposed.arrangements:
            moves = dict(zip((cloud.name for cloud in proposed.scene.objects), arrangement.goal_from_initial))
            if any((moves[name] != np.eye(4)).any() for name in moves.keys() - names):
                continue  # what takes no part in the build cannot be moved by it
            motions = np.array([moves.get(name, np.eye(4)) for name in names])
            off = np.linalg.norm(_middles(scene, motions) - here, axis=1)
            motions[[k for k in standing if off[k] < STAYS]] = np.eye(4)
            rows.append(((off[standing] >= STAYS).sum(), motions @ now_from_initial, arrangement.scores))
        return [
            _of_all(motions, remainder, scores) for _, motions, scores in sorted(rows, key=lambda row: row[0])[:MOST]
        ]

    def missed(self, remainder: Remainder) -> list[str]:
        """Say which checks of the goal fail where its objects are, and would hold where they were to go."""
        return missed_by_goal(remainder, self._wanted)

    def _one_structure(self, remainder: Remainder, goal: TableGoal) -> list[Arrangement]:
        """Lay out the one structure that is left of a goal, around everything else."""
        spec, part = goal.goal.plain_spec, goal.goal.parts[0]
        assert spec is not None
        place = {cloud.name: index for index, cloud in enumerate(remainder.first.objects)}
        own = {place[goal.names[index]] for index in part.objects}  # type: ignore[union-attr, index]
        parts = {number for index in own for number in self._wanted.parts_of(remainder.first.objects[index].name)}
        members = [i for i, cloud in enumerate(remainder.first.objects) if parts & {*self._wanted.parts_of(cloud.name)}]
        scene, _ = table_of(remainder, flat=False)
        others = [cloud for cloud, index in zip(scene.objects, remainder.left) if index not in own]
        rest = replace(
            remainder,
            left=tuple(index for index in remainder.left if index in own),
            others=(*remainder.others, *others),
            standing=remainder.standing & own,
        )

        def structures(scene: Scene) -> Sequence[Arrangement]:
            names = tuple(cloud.name for cloud in scene.objects)
            whole = Goal((replace(part, objects=tuple(range(len(names)))),))
            proposed = self._propose(scene, TableGoal(whole, names, np.tile(np.eye(4), (len(names), 1, 1))))
            return [each for each in proposed.arrangements if len(each.goal_from_initial) == len(names)]

        found = StructureLayouts(spec, structures).lay_out(rest, members)
        stay = [index for index in remainder.left if index not in own]
        for arrangement in found:
            arrangement.goal_from_initial[stay] = remainder.now_from_initial[stay]
        return found

    def _fulfilled(self, remainder: Remainder) -> list[int]:
        """Return the numbers of the parts whose objects and references all stand as the last arrangement has them."""
        if self._another:
            return []
        first = {cloud.name: cloud for cloud in remainder.first.distractors}
        stay = {remainder.first.objects[index].name for index in remainder.standing}
        stay |= {
            cloud.name
            for cloud in remainder.others
            if cloud.name in first and np.linalg.norm(cloud.centroid - first[cloud.name].centroid) < STAYS
        }
        concerned = {number for name in set(self._wanted.names) - stay for number in self._wanted.parts_of(name)}
        return [number for number in range(len(self._wanted.goal.parts)) if number not in concerned]
