"""The scenes that planners are measured on: drawn from a seed, solvable, and in full view of the camera.

The reference arrangement of each passes the physical protocol, and the camera sees every object that takes part.
Everything about a scene follows from its seed, structure, number and draw.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from grounding.spec import SHAPES, StructureSpec
from structdiffusion.objects.model import ObjectModel
from structdiffusion.observation import Scene
from structdiffusion.physical import Verdict, place_and_check
from structdiffusion.scenes import DrawnScene, SceneError, draw_scene, full_spec
from structdiffusion.tabletop import ObservationError, TabletopWorld
from structdiffusion.workers import in_parallel

_MAX_DRAWS = 100
_DRAWING, _SENSING, _PLANNING = range(3)  # what a scene's generators are for


@dataclass(frozen=True)
class EvaluationScene:
    """One scene to be solved.

    Attributes:
        drawn: the objects, where they stand at first, and the spec.
        structure: the shape of the spec.
        number: counts the scenes of this structure from 0.
        seed: the base seed; with structure, number and draw it determines everything.
        draw: how many draws before this one had no valid arrangement or an object out of sight.
        words: the instruction, or `None`.
        embedding: (384,) of the words, or `None`.
        heard: what a parser made of the words, which is all that a planner told in words may know; `None` tells
            it the true spec.
    """

    drawn: DrawnScene
    structure: str
    number: int
    seed: int
    draw: int
    words: str | None = None
    embedding: np.ndarray | None = None
    heard: StructureSpec | None = None

    @property
    def spec(self) -> StructureSpec:
        """What is asked for."""
        return self.drawn.spec

    @property
    def planning_seed(self) -> int:
        """What a planner's generator starts from, in [0, 2**62)."""
        return int(_generator(self.seed, self.structure, self.number, self.draw, _PLANNING).integers(2**62))

    def observed(self) -> Scene:
        """What the depth camera sees, its noise drawn from the scene's seed."""
        drawn = self.drawn
        rng = _generator(self.seed, self.structure, self.number, self.draw, _SENSING)
        with TabletopWorld(drawn.models, list(drawn.world_from_initial), drawn.table) as world:
            return world.observe(rng, range(drawn.count), range(drawn.count, len(drawn.models)))

    def verdict(self, goal_from_initial: np.ndarray) -> Verdict:
        """What becomes, in physics, of the motions (N, 4, 4) of the objects that take part, by the true spec."""
        drawn, n = self.drawn, self.drawn.count
        poses = drawn.world_from_initial
        others = list(zip(drawn.models[n:], poses[n:]))
        return place_and_check(drawn.models[:n], poses[:n], goal_from_initial, drawn.spec, drawn.table, others)


def draw_evaluation_scenes(
    models: Sequence[ObjectModel],
    scenes: int,
    *,
    shapes: Sequence[str] = SHAPES,
    seed: int = 0,
    workers: int = 1,
) -> Iterator[EvaluationScene]:
    """`scenes` scenes of each shape with every slot specified, in order; yields them as they are drawn.

    Args:
        models: the object library.
        scenes: how many per shape.
        shapes: which structures.
        seed: of everything.
        workers: processes.

    Raises:
        SceneError: no scene of a shape can be drawn from these objects.
    """
    jobs = [(shape, number) for shape in shapes for number in range(scenes)]
    yield from in_parallel(partial(_drawn, seed), tuple, (tuple(models),), jobs, workers)


def _drawn(seed: int, models: Sequence[ObjectModel], job: tuple[str, int]) -> EvaluationScene:
    shape, number = job
    reason = ""
    for draw in range(_MAX_DRAWS):
        rng = _generator(seed, shape, number, draw, _DRAWING)
        try:
            drawn = draw_scene(models, full_spec(shape, rng), rng)
            scene = EvaluationScene(drawn, shape, number, seed, draw)
            scene.observed()
        except (SceneError, ObservationError) as error:
            reason = str(error)
            continue
        reference = scene.verdict(drawn.reference_goal_from_initial())
        if reference.success:
            return scene
        reason = f"the reference arrangement fails: {reference.detail}"
    raise SceneError(f"no {shape} in {_MAX_DRAWS} draws from {len(models)} objects: {reason}")


def _generator(seed: int, shape: str, number: int, draw: int, purpose: int) -> np.random.Generator:
    return np.random.default_rng((seed, SHAPES.index(shape), number, draw, purpose))
