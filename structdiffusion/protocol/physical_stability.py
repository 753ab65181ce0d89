"""Check whether an arrangement stands: the physical protocol of the paper, section V, followed by the semantic checks.

The objects are released one after another, supports first, from 3 cm above their predicted poses, and simulated. The
first problem determines the failure class:

1. "intersection": set down at its predicted pose the object penetrates something by more than 2 mm;
2. "abnormal velocity": something moves faster than 1 m/s, leaves the table, or ends more than 4 cm
   (in the plane) from its predicted place;
3. "not upright": something ends tilted by more than 15 degrees from its predicted orientation;
4. "semantic": the structure does not match the spec (`structdiffusion.protocol.semantic`), or the table does not match
the
   goal (`structdiffusion.protocol.goal_semantic`).

Of a goal of several parts, only the objects that move are released; the others are on the table all the time.
"""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np
from scipy.spatial import ConvexHull

from grounding.goals.goal import Goal
from grounding.spec import StructureSpec
from structdiffusion.evaluation_protocol import (
    ABNORMAL_VELOCITY,
    FINAL_SECONDS,
    INTERSECTION,
    MAX_DISPLACEMENT,
    MAX_PENETRATION,
    MAX_SPEED,
    MAX_TILT,
    MAX_TILT_DEGREES,
    NOT_UPRIGHT,
    RELEASE_HEIGHT,
    SEMANTIC,
    SETTLE_SECONDS,
)
from structdiffusion.geometry import tilt_between, transform_points
from structdiffusion.objects.model import ObjectModel, unique_names
from structdiffusion.protocol.goal_checks import asked_checks
from structdiffusion.protocol.release import Release, TabletopBodies
from structdiffusion.relations.bonds import bonds_of, require_indices
from structdiffusion.simulation.world import REST_SECONDS, TABLE, TabletopWorld
from structdiffusion.structures.checks import Check


@dataclass(frozen=True)
class Verdict:
    """The outcome of one arrangement.

    Attributes:
        success: whether none of the four failures happened.
        failure: one of `structdiffusion.evaluation_protocol.FAILURE_CLASSES`, or `None`.
        failed_object: the name of the object that failed, or `None` (semantic failures concern all).
        penetrated: the body that it would penetrate, "table" or the name of an object, or `None`.
        detail: one sentence with the value and its limit.
        checks: the semantic checks; empty when physics failed before.
        measured: "penetration" (m), "speed" (m/s), "displacement" (m), "tilt" (rad): the largest of each; "disturbed":
            by how much of those limits an object that stood already was moved, at most, while later ones were released.
        order: indices of the objects in the order in which they were placed.
        world_from_final: (N, 4, 4) the final poses of the objects; NaN for those never placed.
        seconds: the time that the computation took.
    """

    success: bool
    failure: str | None
    failed_object: str | None
    detail: str
    checks: tuple[Check, ...] = ()
    measured: Mapping[str, float] = field(default_factory=dict)
    order: tuple[int, ...] = ()
    world_from_final: np.ndarray | None = None
    seconds: float = 0.0
    penetrated: str | None = None

    def to_dict(self) -> dict[str, Any]:
        """Return the verdict as JSON-ready values, without the poses."""
        return {
            "success": self.success,
            "failure": self.failure,
            "failed_object": self.failed_object,
            "penetrated": self.penetrated,
            "detail": self.detail,
            "checks": [asdict(check) for check in self.checks],
            "measured": dict(self.measured),
            "order": list(self.order),
            "seconds": round(self.seconds, 4),
        }


_STAYS = 1e-9  # an object whose motion differs from the identity by less stays where it is


class _Failure(Exception):
    def __init__(self, failure: str, name: str | None, detail: str, penetrated: str | None = None) -> None:
        super().__init__(detail)
        self.failure, self.name, self.detail, self.penetrated = failure, name, detail, penetrated


def executable_order(
    models: Sequence[ObjectModel],
    world_from_goal: np.ndarray,
    after: Mapping[int, Sequence[int]] | None = None,
    far_first: bool = False,
) -> tuple[int, ...]:
    """Order objects so that supports come first: by the goal's lowest point, in steps of 1 cm; among equals the widest
    first.

    So a plate comes before the bowl on it even where their predicted bottoms differ by less than
    the prediction's error.

    Args:
        models: the N objects.
        world_from_goal: (N, 4, 4) where each goes.
        after: object -> those that must be placed before it, such as the mug that a spoon goes into.
        far_first: among equals the farthest first instead.
    """

    def rank(index: int) -> tuple[int, float]:
        points = transform_points(world_from_goal[index], np.concatenate(models[index].hulls))
        lowest = round(float(points[:, 2].min()) / 0.01)
        if far_first:
            return lowest, -float(points[:, 0].mean())
        area = round(float(ConvexHull(points[:, :2]).volume), 6)  # rounded, so that equals stay in order
        return lowest, -area

    order = sorted(range(len(models)), key=rank)
    if not after:
        return tuple(order)
    placed: list[int] = []
    while order:  # in a circle of supports, which no world has, the next in rank comes first
        ready = [i for i in order if not set(after.get(i, ())) & set(order)]
        placed.append((ready or order)[0])
        order.remove(placed[-1])
    return tuple(placed)


def carried_after(goal: Goal) -> dict[int, list[int]]:
    """Return for each object that is placed "on" or "in" others in a resolved goal the indices of its supports."""
    after: dict[int, list[int]] = {}
    for bond in bonds_of(goal):
        if bond.relation.carried:
            for index in bond.members:
                after.setdefault(index, []).extend(bond.related)
    return after


def place_and_check(
    bodies: TabletopBodies,
    goal_from_initial: np.ndarray,
    spec: StructureSpec | Goal,
    aside: Sequence[int] = (),
    release: Release = Release(),
) -> Verdict:
    """Place an arrangement under the evaluation protocol and judge it. Deterministic.

    Args:
        bodies: the N objects and what else is on the table.
        goal_from_initial: (N, 4, 4) the predicted motion of each (`Arrangement.goal_from_initial`). Under a goal, those
            whose motion is the identity stay where they are.
        spec: the requested structure, or the goal.
        aside: for a goal, the objects that only make room.
        release: how the objects are released.

    Raises:
        ValueError: if the motions are not those of N objects.
        GoalError: for a goal that these objects cannot be checked for.
    """
    started = time.perf_counter()
    world_from_goal = np.asarray(goal_from_initial) @ np.asarray(bodies.world_from_initial)
    models, count = bodies.models, len(bodies.models)
    if world_from_goal.shape != (count, 4, 4):
        raise ValueError(f"the motions of {count} objects are ({count}, 4, 4), got {world_from_goal.shape}")
    order = release.order or _release_order(models, goal_from_initial, world_from_goal, spec, release.far_first)
    stays = [i for i in range(count) if i not in order]
    there = [*bodies.others, *((models[i], world_from_goal[i]) for i in stays)]
    with TabletopWorld(
        [model for model, _ in there], [pose for _, pose in there], bodies.table, ground=bodies.ground
    ) as world:
        trial = _Trial(world, bodies, world_from_goal, stays, release.above)
        checks: tuple[Check, ...] = ()
        failure: _Failure | None = None
        try:
            for batch in [order] if release.together else [(index,) for index in order]:
                trial.place(batch)
            trial.wait(release.until_rest)
            checks = trial.checks(spec, aside)
            trial.check_places()
        except _Failure as caught:
            failure = caught
        final = trial.final_poses()
        if release.on_end is not None:
            release.on_end(world)
    failure = failure or _semantic_failure(checks)
    return Verdict(
        success=failure is None,
        failure=failure.failure if failure else None,
        failed_object=failure.name if failure else None,
        detail=failure.detail if failure else "everything stands as asked",
        checks=checks,
        measured=trial.measured,
        order=order,
        world_from_final=final,
        seconds=time.perf_counter() - started,
        penetrated=failure.penetrated if failure else None,
    )


def _release_order(
    models: Sequence[ObjectModel],
    goal_from_initial: np.ndarray,
    world_from_goal: np.ndarray,
    spec: StructureSpec | Goal,
    far_first: bool,
) -> tuple[int, ...]:
    """Return the objects that are released, supports first: all of a structure, under a goal those that move.

    Raises:
        GoalError: for a goal that counts other objects.
    """
    moved, after = list(range(len(models))), {}
    if isinstance(spec, Goal):
        after = carried_after(require_indices(spec, len(models)))
        moved = [i for i in moved if not np.allclose(goal_from_initial[i], np.eye(4), atol=_STAYS)]
    ranks = executable_order([models[i] for i in moved], world_from_goal[moved], _renumbered(after, moved), far_first)
    return tuple(moved[k] for k in ranks)


def _renumbered(after: Mapping[int, Sequence[int]], moved: Sequence[int]) -> dict[int, list[int]]:
    """Return the order constraints with indices among the moved objects."""
    place = {index: k for k, index in enumerate(moved)}
    return {place[i]: [place[j] for j in before if j in place] for i, before in after.items() if i in place}


def _semantic_failure(checks: Sequence[Check]) -> _Failure | None:
    """Return the first check that failed, as a failure."""
    first = next((check for check in checks if not check.passed), None)
    if first is None:
        return None
    return _Failure(SEMANTIC, None, first.sentence)


class _Trial:
    """One run of the protocol in a world whose first objects are the distractors, then those that stay."""

    def __init__(
        self,
        world: TabletopWorld,
        bodies: TabletopBodies,
        world_from_goal: np.ndarray,
        stays: Sequence[int] = (),
        height: float = RELEASE_HEIGHT,
    ) -> None:
        self.world, self.bodies, self.world_from_goal, self.height = world, bodies, world_from_goal, height
        models, others = bodies.models, [model for model, _ in bodies.others]
        for place, number in enumerate((*range(len(models), len(models) + len(others)), *stays)):
            if number in bodies.held:
                world.hold(place)
        # All lists below follow the world's indices: the distractors, then the objects as placed.
        self.expected = world.poses()
        every_name = unique_names([*models, *others]) if bodies.names is None else list(bodies.names)
        self.own_names, self.names = every_name[: len(models)], every_name[len(models) :]
        self.names += [self.own_names[i] for i in stays]
        # Number of the object -> its index in the world.
        self.placed: dict[int, int] = {number: len(others) + k for k, number in enumerate(stays)}
        self.measured = dict.fromkeys(("penetration", "speed", "displacement", "tilt", "disturbed"), 0.0)
        self._rested = dict(enumerate(self.expected))  # index in the world -> the pose in which it came to rest first

    def place(self, numbers: Sequence[int]) -> None:
        """Check the predicted poses, release above them, wait for rest, and check where everything is."""
        for number in numbers:
            self._add(number)
        for number in numbers:
            above = self.world_from_goal[number].copy()
            above[2, 3] += self.height
            self.world.set_pose(self.placed[number], above)
        self._run(SETTLE_SECONDS, until_rest=True)
        self.check_places()
        for index in self.placed.values():
            self._rested.setdefault(index, self.world.pose(index))

    def _add(self, number: int) -> None:
        """Add an object at its predicted pose, where it may penetrate nothing."""
        goal = self.world_from_goal[number]
        index = self.world.add(self.bodies.models[number], goal)
        self.placed[number] = index
        self.expected.append(goal)
        self.names.append(self.own_names[number])
        for other, clearance in self.world.clearances(index).items():
            self._record("penetration", -clearance)
            if clearance < -MAX_PENETRATION:
                thing = "table" if other == TABLE else self.names[other]
                depth = f"{-clearance * 1000:.1f} mm, allowed {MAX_PENETRATION * 1000:g} mm"
                raise self._failure(INTERSECTION, index, f"would penetrate the {thing} by {depth}", thing)

    def wait(self, until_rest: bool) -> None:
        """Run two more seconds, or less where everything rests before."""
        self._run(FINAL_SECONDS - REST_SECONDS, until_rest)

    def _run(self, seconds: float, until_rest: bool) -> None:
        def watch(speeds: np.ndarray) -> None:
            fastest = int(speeds.argmax())
            self._record("speed", speeds[fastest])
            if speeds[fastest] > MAX_SPEED:
                motion = f"moves at {speeds[fastest]:.2f} m/s, allowed {MAX_SPEED:g} m/s"
                raise self._failure(ABNORMAL_VELOCITY, fastest, motion)

        self.world.settle(seconds, watch, until_rest)

    def checks(self, spec: StructureSpec | Goal, aside: Sequence[int]) -> tuple[Check, ...]:
        """Return the semantic checks of the world; physics runs in it while contacts are recorded."""
        count, others = len(self.bodies.models), self.bodies.others
        return asked_checks(
            self.world,
            [*(self.placed[k] for k in range(count)), *range(len(others))],
            spec,
            np.array([*self.bodies.world_from_initial, *(pose for _, pose in others)]),
            [*self.own_names, *self.names[: len(others)]],
            count=count,
            aside=aside,
            colors=self.bodies.colors,
        )

    def final_poses(self) -> np.ndarray:
        """Return the poses (N, 4, 4) of the objects; NaN for those never placed."""
        final = np.full(self.world_from_goal.shape, np.nan)
        for number, index in self.placed.items():
            final[number] = self.world.pose(index)
        return final

    def check_places(self) -> None:
        """Check that every object is on the table, upright, and near its goal."""
        table = self.world.ground
        for index, center in enumerate(self.world.centers_of_mass()):
            on_table = table.x_min <= center[0] <= table.x_max and table.y_min <= center[1] <= table.y_max
            if center[2] < 0 or not on_table:
                raise self._failure(ABNORMAL_VELOCITY, index, "leaves the table")
        poses = self.world.poses()
        for index, rested in self._rested.items():
            shift = float(np.linalg.norm(poses[index][:2, 3] - rested[:2, 3]))
            self._record("disturbed", max(shift / MAX_DISPLACEMENT, tilt_between(poses[index], rested) / MAX_TILT))
        for index, goal in enumerate(self.expected):
            displacement = float(np.linalg.norm(poses[index][:2, 3] - goal[:2, 3]))
            self._record("displacement", displacement)
            if displacement > MAX_DISPLACEMENT:
                where = (
                    f"ends {displacement * 100:.1f} cm from its predicted place, allowed {MAX_DISPLACEMENT * 100:g} cm"
                )
                raise self._failure(ABNORMAL_VELOCITY, index, where)
        for index, goal in enumerate(self.expected):
            tilt = tilt_between(poses[index], goal)
            self._record("tilt", tilt)
            if tilt > MAX_TILT:
                what = f"ends tilted by {math.degrees(tilt):.0f} degrees, allowed {MAX_TILT_DEGREES:g}"
                raise self._failure(NOT_UPRIGHT, index, what)

    def _failure(self, failure: str, index: int, what: str, penetrated: str | None = None) -> _Failure:
        return _Failure(failure, self.names[index], f"the {self.names[index]} {what}", penetrated)

    def _record(self, what: str, value: float) -> None:
        self.measured[what] = max(self.measured[what], float(value))
