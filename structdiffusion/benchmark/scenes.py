"""Scenes for evaluation: drawn from a seed, solvable, and observed by the simulated camera.

The reference arrangement of each scene passes the physical protocol, and the camera sees every object that takes part.
The conditions, seed, structure, number and draw determine a scene completely.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from grounding.spec import FIRST_SHAPES, SHAPES, StructureSpec
from structdiffusion.data.scene_sampling import DrawnScene, SceneError, draw_scene, full_spec
from structdiffusion.objects.model import ObjectModel
from structdiffusion.observation import Scene, Table
from structdiffusion.parallel import Lost, in_parallel
from structdiffusion.protocol.physical_stability import Verdict, place_and_check
from structdiffusion.protocol.release import TabletopBodies
from structdiffusion.simulation.depth_camera import DepthCamera
from structdiffusion.simulation.visible_points import ObservationError
from structdiffusion.simulation.world import TabletopWorld
from structdiffusion.structures import STRUCTURES

ANY_SHAPE = "structure"  # the name of a scene's structure if its spec leaves the shape open
CAMERA_SIDES = ("robot", "opposite", "left", "right")
_MAX_DRAWS = 100
_TRIES = 10  # draws per number of objects, after which a stack gets one object fewer
_BEYOND_EDGE = 0.40  # m, from a table's left or right edge to the camera above
# Seeds count on these places: what comes later comes last.
_KINDS = (*FIRST_SHAPES, ANY_SHAPE, *SHAPES[len(FIRST_SHAPES) :])
_DRAWING, _SENSING, _PLANNING = range(3)  # purposes of a scene's random generators


@dataclass(frozen=True)
class Conditions:
    """Conditions under which scenes are drawn; the defaults are those of the training data.

    Attributes:
        table: the table top's rectangle.
        objects: the minimum and maximum number of objects that take part; `None` for numbers that suit each structure.
            A table setting has ten places; a tower gets as many objects as can stand.
        camera: the depth camera.
    """

    table: Table = Table()
    objects: tuple[int, int] | None = None
    camera: DepthCamera = DepthCamera()


def camera_beside(side: str, table: Table = Table()) -> DepthCamera:
    """Return a depth camera above one side of a table: "robot" (the default side), "opposite", "left" (+y) or "right".

    The cameras on the left and right stand farther back, because the table is wider than deep and all of it has to be
    in the picture.

    Raises:
        ValueError: for another side.
    """
    usual = DepthCamera()
    if side == "robot":
        return usual
    x, y, _ = usual.target
    if side == "opposite":
        return replace(usual, eye=(2 * x - usual.eye[0], 2 * y - usual.eye[1], usual.eye[2]))
    if side == "left":
        return replace(usual, eye=(x, table.y_max + _BEYOND_EDGE, usual.eye[2]))
    if side == "right":
        return replace(usual, eye=(x, table.y_min - _BEYOND_EDGE, usual.eye[2]))
    raise ValueError(f"there is no camera on the side {side!r}; legal values: {', '.join(CAMERA_SIDES)}")


@dataclass(frozen=True)
class EvaluationScene:
    """One scene to solve.

    Attributes:
        drawn: the objects, their initial poses, and the spec.
        structure: the shape of the spec, or `ANY_SHAPE`.
        number: the index of the scene among those of this structure, from 0.
        seed: the base seed; seed, structure, number and draw determine the scene.
        draw: how many earlier draws were rejected, because they had no valid arrangement or a hidden object.
        words: the instruction, or `None`.
        embedding: (384,) of the words, or `None`.
        parsed: the spec that a parser read from the words; planners that take words get nothing else. With `None` they
            get the true spec.
        camera: the depth camera that observes the scene.
    """

    drawn: DrawnScene
    structure: str
    number: int
    seed: int
    draw: int
    words: str | None = None
    embedding: np.ndarray | None = None
    parsed: StructureSpec | None = None
    camera: DepthCamera = DepthCamera()

    @property
    def spec(self) -> StructureSpec:
        """Return the true spec."""
        return self.drawn.spec

    @property
    def planning_seed(self) -> int:
        """Return the seed of a planner's generator, in [0, 2**62)."""
        return int(_generator(self.seed, self.structure, self.number, self.draw, _PLANNING).integers(2**62))

    def observed(self) -> Scene:
        """Return the depth camera's observation; the scene's seed determines the noise."""
        drawn = self.drawn
        rng = _generator(self.seed, self.structure, self.number, self.draw, _SENSING)
        with TabletopWorld(drawn.models, list(drawn.world_from_initial), drawn.table, self.camera) as world:
            return world.observe(rng, range(drawn.count), range(drawn.count, len(drawn.models)))

    def verdict(self, goal_from_initial: np.ndarray) -> Verdict:
        """Check in physics, against the true spec, the motions (N, 4, 4) of the objects that take part."""
        drawn, n = self.drawn, self.drawn.count
        poses = drawn.world_from_initial
        others = list(zip(drawn.models[n:], poses[n:]))
        bodies = TabletopBodies(drawn.models[:n], poses[:n], drawn.table, others)
        return place_and_check(bodies, goal_from_initial, drawn.spec)


def draw_evaluation_scenes(
    models: Sequence[ObjectModel],
    scenes: int,
    *,
    shapes: Sequence[str] = FIRST_SHAPES,
    seed: int = 0,
    workers: int = 0,
    conditions: Conditions = Conditions(),
) -> Iterator[EvaluationScene | Lost]:
    """Draw `scenes` scenes of each shape with every slot specified; yield them in order, as they are drawn.

    If a worker died, a `Lost` is yielded instead, whose job is the scene's shape and number.

    Args:
        models: the object library.
        scenes: the number of scenes per shape.
        shapes: the structures.
        seed: the base seed.
        workers: the number of worker processes; 0 to use this process alone.
        conditions: the conditions under which to draw.

    Raises:
        SceneError: no scene of a shape can be drawn from these objects.
    """
    jobs = [(shape, number) for shape in shapes for number in range(scenes)]
    yield from in_parallel(partial(_drawn, seed, conditions), tuple, (tuple(models),), jobs, workers)


def _drawn(seed: int, conditions: Conditions, models: Sequence[ObjectModel], job: tuple[str, int]) -> EvaluationScene:
    shape, number = job
    return draw_evaluation_scene(models, shape, number, seed=seed, conditions=conditions)


def draw_evaluation_scene(
    models: Sequence[ObjectModel],
    shape: str | None,
    number: int,
    *,
    seed: int,
    spec: StructureSpec | None = None,
    conditions: Conditions = Conditions(),
    accepted: int | None = None,
) -> EvaluationScene:
    """Draw one scene.

    Args:
        models: the object library.
        shape: the structure; `None` for any that the spec allows.
        number: the index of the scene among those of this shape.
        seed: seed, shape and number determine the scene.
        spec: the requested spec, of this shape; by default every slot of the shape is drawn.
        conditions: the conditions under which to draw.
        accepted: the `EvaluationScene.draw` that an earlier call with the same arguments found; earlier draws and the
            checks of this one are skipped.

    Raises:
        SceneError: no such scene can be drawn from these objects.
    """
    reason = ""
    for draw in range(_MAX_DRAWS) if accepted is None else (accepted,):
        rng = _generator(seed, shape, number, draw, _DRAWING)
        try:
            drawn_spec = spec if spec is not None or shape is None else full_spec(shape, rng)
            assert drawn_spec is not None
            count = _count(shape, conditions, draw, rng)
            drawn = draw_scene(models, drawn_spec, rng, count=count, table=conditions.table)
            if shape is not None and STRUCTURES[shape].exact_count and count is not None and drawn.count < count:
                raise SceneError(f"{drawn.count} of {count} objects that suit it")
            scene = EvaluationScene(drawn, shape or ANY_SHAPE, number, seed, draw, camera=conditions.camera)
            if accepted is not None:
                return scene
            scene.observed()
        except (SceneError, ObservationError) as error:
            reason = str(error)
            continue
        reference = scene.verdict(drawn.reference_goal_from_initial())
        if reference.success:
            return scene
        reason = f"the reference arrangement fails: {reference.detail}"
    raise SceneError(f"no {shape or ANY_SHAPE} in {_MAX_DRAWS} draws from {len(models)} objects: {reason}")


def _count(shape: str | None, conditions: Conditions, draw: int, rng: np.random.Generator) -> int | None:
    """Return the number of objects that take part; `None` leaves it to the structure."""
    if conditions.objects is None:
        return None
    low, high = conditions.objects
    count = int(rng.integers(low, high + 1))
    if shape is None or not STRUCTURES[shape].stacks:
        return count
    return max(STRUCTURES[shape].least, count - draw // _TRIES)


def _generator(seed: int, shape: str | None, number: int, draw: int, purpose: int) -> np.random.Generator:
    kind = _KINDS.index(shape or ANY_SHAPE)
    return np.random.default_rng((seed, kind, number, draw, purpose))
