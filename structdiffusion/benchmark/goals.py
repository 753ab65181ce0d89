"""Scenes of the benchmark of goals: drawn from a seed, solvable, and seen by the simulated camera.

The reference arrangement of each scene passes the evaluation protocol, every check of the goal included. The library,
seed, family, number and draw determine a scene completely.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull

from grounding.goals.goal import Goal
from structdiffusion.benchmark.figure_families import FIGURE_FAMILIES
from structdiffusion.benchmark.goal_families import FAMILIES, color_of, draw_goal
from structdiffusion.benchmark.goal_references import NoReferenceError, ReferenceSearch
from structdiffusion.benchmark.loop_families import LOOP_FAMILIES
from structdiffusion.benchmark.rival_checks import RIVALS
from structdiffusion.data.scene_sampling import SceneError
from structdiffusion.footprints import clear_gap, turned
from structdiffusion.geometry import pose_from_xyz_yaw, transform_points
from structdiffusion.objects.model import ObjectModel, footprint_centroid, unique_names
from structdiffusion.observation import Scene, Table
from structdiffusion.protocol.physical_stability import Verdict, place_and_check
from structdiffusion.protocol.release import TabletopBodies
from structdiffusion.simulation.visible_points import ObservationError
from structdiffusion.simulation.world import TabletopWorld
from structdiffusion.structures.bodies import PlacedBody

_MAX_DRAWS = 200
_INITIAL_GAP, _EDGE = 0.02, 0.01  # m, between initial footprints, and to the table's edge
_FAMILIES = {**FAMILIES, **LOOP_FAMILIES, **FIGURE_FAMILIES}  # their order counts in every seed
_DRAWING, _SENSING, _PLANNING = range(3)  # purposes of a scene's random generators


@dataclass(frozen=True)
class GoalScene:
    """One scene to solve.

    Attributes:
        family: one of `FAMILIES`, `LOOP_FAMILIES` or `FIGURE_FAMILIES`.
        kind: which of its kinds it is.
        number: its index among those of the family, from 0.
        seed: the base seed.
        draw: how many earlier draws were rejected.
        models: the N objects; the goal's indices count them.
        world_from_initial: (N, 4, 4) their initial poses.
        goal: the goal.
        reference: (N, 4, 4) motions that meet it; the identity for what stays.
        table: the table top.
    """

    family: str
    kind: str
    number: int
    seed: int
    draw: int
    models: tuple[ObjectModel, ...]
    world_from_initial: np.ndarray
    goal: Goal
    reference: np.ndarray
    table: Table = Table()

    @property
    def planning_seed(self) -> int:
        """Return the seed of a planner's generator, in [0, 2**62)."""
        return int(_generator(self.seed, self.family, self.number, self.draw, _PLANNING).integers(2**62))

    @property
    def sensor_rng(self) -> np.random.Generator:
        """Return the generator of the sensor's noise."""
        return _generator(self.seed, self.family, self.number, self.draw, _SENSING)

    @property
    def names(self) -> list[str]:
        """Return the names of the objects."""
        return unique_names(self.models)

    @property
    def colors(self) -> tuple[str, ...] | None:
        """Return the names of the objects' colours; `None` if they have several."""
        return tuple(map(color_of, self.models)) if all(map(color_of, self.models)) else None

    def observed(self) -> Scene:
        """Return the depth camera's observation of all objects, in the order of the goal's indices."""
        with TabletopWorld(self.models, list(self.world_from_initial), self.table) as world:
            return world.observe(self.sensor_rng, names=self.names)

    def verdict(self, goal_from_initial: np.ndarray, aside: Sequence[int] = ()) -> Verdict:
        """Check the motions (N, 4, 4) of all objects in physics; some of them only make room."""
        bodies = TabletopBodies(self.models, self.world_from_initial, self.table, names=self.names, colors=self.colors)
        return place_and_check(bodies, goal_from_initial, self.goal, aside)

    def rival_verdicts(self, world_from_final: np.ndarray) -> dict[str, bool | None]:
        """Return the verdicts of the rivals' checks on final poses (N, 4, 4); `None` if they have no check."""
        bodies = self.bodies_at(world_from_final)
        goal = self.goal.resolved(len(self.models))
        return {name: accepts(bodies, goal) for name, accepts in RIVALS.items()}

    def bodies_at(self, world_from_final: np.ndarray) -> list[PlacedBody]:
        """Return the objects at final poses (N, 4, 4), without what they rest on."""
        return [_body(*one) for one in zip(self.names, self.models, world_from_final, strict=True)]


def draw_goal_scene(
    library: Sequence[ObjectModel],
    family: str,
    number: int,
    *,
    seed: int,
    table: Table = Table(),
    accepted: int | None = None,
) -> GoalScene:
    """Draw one scene.

    Args:
        library: the objects.
        family: one of `FAMILIES`, `LOOP_FAMILIES` or `FIGURE_FAMILIES`.
        number: the index of the scene among those of this family.
        seed: library, seed, family and number determine the scene.
        table: the table top.
        accepted: the `GoalScene.draw` that an earlier call with the same arguments found; earlier draws and the checks
            of this one are skipped.

    Raises:
        SceneError: no such scene can be drawn from these objects.
    """
    reason = ""
    for draw in range(_MAX_DRAWS) if accepted is None else (accepted,):
        rng = _generator(seed, family, number, draw, _DRAWING)
        try:
            drawn = draw_goal(_FAMILIES[family], library, number, rng)
            poses = _scatter(drawn.models, table, rng)
            motions = ReferenceSearch(drawn.models, poses, drawn.goal, table, rng).motions()
            scene = GoalScene(family, drawn.kind, number, seed, draw, drawn.models, poses, drawn.goal, motions, table)
            if accepted is not None:
                return scene
            scene.observed()
        except (SceneError, NoReferenceError, ObservationError) as error:
            reason = str(error)
            continue
        verdict = scene.verdict(motions)
        if verdict.success:
            return scene
        reason = f"the reference arrangement fails: {verdict.detail}"
    raise SceneError(f"no scene of the family {family!r} in {_MAX_DRAWS} draws from {len(library)} objects: {reason}")


def _scatter(models: Sequence[ObjectModel], table: Table, rng: np.random.Generator) -> np.ndarray:
    """Draw initial poses (N, 4, 4), clear of each other."""
    standing: list[np.ndarray] = []
    poses = []
    for model in models:
        yaw = float(rng.uniform(-np.pi, np.pi))
        outline = turned(model.footprint, yaw)
        low = np.array([table.x_min, table.y_min]) - outline.min(axis=0) + _EDGE
        high = np.array([table.x_max, table.y_max]) - outline.max(axis=0) - _EDGE
        for _ in range(100):
            at = rng.uniform(low, high)
            if all(clear_gap(outline + at, other) > _INITIAL_GAP for other in standing):
                break
        else:
            raise SceneError("there is no free place left on the table for the objects at first")
        standing.append(outline + at)
        poses.append(pose_from_xyz_yaw(at[0], at[1], 0.0, yaw))
    return np.array(poses)


def _body(name: str, model: ObjectModel, pose: np.ndarray) -> PlacedBody:
    """Return an object in the form of the rivals' checks, without what it rests on."""
    points = transform_points(pose, np.concatenate(model.hulls))
    low, high = float(points[:, 2].min()), float(points[:, 2].max())
    outline = points[ConvexHull(points[:, :2]).vertices, :2]
    return PlacedBody(name, model.category, outline, footprint_centroid(outline), low, high, 0.0)


def _generator(seed: int, family: str, number: int, draw: int, purpose: int) -> np.random.Generator:
    return np.random.default_rng((seed, list(_FAMILIES).index(family), number, draw, purpose))
