"""The environment `structagent/Build-v0` of Gymnasium: a picture and an instruction in, a pick and a goal pose out."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces

from agent.arm.simulated_arm import HOLDS
from agent.environment.episode import MODES, Episode, Move, Outcome, Seen
from agent.errors import UsageError
from grounding.corpus.grammar import sentences
from grounding.spec import FIRST_SHAPES, SHAPES
from structdiffusion.benchmark.scenes import EvaluationScene, draw_evaluation_scene
from structdiffusion.objects.libraries import load_objects
from structdiffusion.objects.model import SURFACE_POINTS, ObjectModel
from structdiffusion.observation import Table
from structdiffusion.simulation.depth_camera import DepthCamera

OBSERVATIONS = ("color", "depth", "cloud")
MOST_OBJECTS = 12  # no scene of the benchmark has more
MOST_BYTES = 128  # of an instruction
HIGHEST = 0.5  # m, of a place to put something on
NONE, STAYS, TAKES_PART = range(3)  # what an object of the observation is
_RENDER_MODES = ("rgb_array",)
_REACH = 2.0  # m around the origin, in which everything is that is seen


@lru_cache(maxsize=2)
def _library(objects: str) -> tuple[ObjectModel, ...]:
    return tuple(load_objects(objects))


class BuildEnv(gymnasium.Env[dict[str, Any], dict[str, Any]]):
    """Build what an instruction asks for, object by object.

    docs/environment.md describes observations, actions, rewards and ends of episodes.

    Args:
        objects: as for `load_objects`.
        structures: shapes that are asked for, some of `grounding.spec.SHAPES`.
        observation: one of `OBSERVATIONS`.
        mode: "place" releases objects above their goals; "arm" lets the arm pick and place them, which takes longer.
        hold: with the mode "arm", how the hand holds objects, one of `agent.arm.simulated_arm.HOLDS`.
        render_mode: "rgb_array", or `None`.

    Raises:
        UsageError: for an argument that is not legal.
        ObjectError: for objects that cannot be loaded.
    """

    metadata = {"render_modes": list(_RENDER_MODES), "render_fps": 1}

    def __init__(
        self,
        objects: str = "ycb",
        structures: Sequence[str] = FIRST_SHAPES,
        observation: str = "color",
        mode: str = "place",
        hold: str = "friction",
        render_mode: str | None = None,
    ) -> None:
        structures = (structures,) if isinstance(structures, str) else tuple(structures)
        checked: tuple[tuple[str, tuple[str | None, ...], tuple[str | None, ...]], ...] = (
            ("a structure", structures or (None,), SHAPES),
            ("observation", (observation,), OBSERVATIONS),
            ("mode", (mode,), MODES),
            ("hold", (hold,), HOLDS),
            ("render_mode", (render_mode,), (None, *_RENDER_MODES)),
        )
        for name, values, legal in checked:
            for value in values:
                if value not in legal:
                    raise UsageError(f"{name} cannot be {value!r}; legal: {', '.join(map(str, legal))}")
        self._models, self._structures = _library(objects), structures
        self._observation, self._mode, self._hold, self.render_mode = observation, mode, hold, render_mode
        self._episode: Episode | None = None
        self._over = False
        self.observation_space = _observation_space(observation)
        table = Table()
        self.action_space = spaces.Dict({
            "object": spaces.Discrete(MOST_OBJECTS),
            "pose": spaces.Box(
                np.array([table.x_min, table.y_min, 0.0, -np.pi], np.float32),
                np.array([table.x_max, table.y_max, HIGHEST, np.pi], np.float32),
            ),
        })  # fmt: skip

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Draw a scene, and return what is seen of it.

        Args:
            seed: decides the scene.
            options: "structure": one of the environment's structures, in place of a drawn one.

        Raises:
            UsageError: for an option that is not legal.
        """
        super().reset(seed=seed)
        shape = (options or {}).get("structure", self._structures[self.np_random.integers(len(self._structures))])
        if shape not in self._structures:
            raise UsageError(f"the option 'structure' cannot be {shape!r}; legal: {', '.join(self._structures)}")
        number, scene_seed = (int(value) for value in self.np_random.integers(2**31, size=2))
        scene = draw_evaluation_scene(self._models, shape, number, seed=scene_seed)
        self.close()
        self._episode, self._over = Episode(scene, self._mode, self._hold), False
        self._words = instruction_of(scene)
        return self._seen(self._episode.look()), self._info(None)

    def step(self, action: dict[str, Any]) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        """Carry out a pick and place, and judge the table: the reward is 1 if everything stands as asked, otherwise 0.

        Raises:
            UsageError: for an action that is not of the action space, and after the end of the episode.
        """
        if self._episode is None or self._over:
            raise UsageError("the episode is over; call reset() first")
        pose = np.asarray(action["pose"], np.float32)
        if not self.action_space.contains({"object": np.int64(action["object"]), "pose": pose}):
            raise UsageError(f"an action cannot be {action!r}; legal: {self.action_space}")
        outcome = self._episode.move(Move(int(action["object"]), *map(float, pose)))
        self._over = outcome.ended
        reward = float(outcome.success)
        return self._seen(self._episode.look()), reward, outcome.ended, False, self._info(outcome)

    def render(self) -> np.ndarray | None:
        """Return a picture (480, 640, 3) uint8 of the table, and of the arm in the mode "arm"."""
        if self._episode is None or self.render_mode is None:
            return None
        return self._episode.picture()

    def close(self) -> None:
        """Give the physics back."""
        if self._episode is not None:
            self._episode.close()
            self._episode = None

    def _seen(self, seen: Seen) -> dict[str, Any]:
        assert self._episode is not None
        count, here = self._episode.count, [cloud is not None for cloud in seen.clouds]
        objects, positions = np.zeros(MOST_OBJECTS, np.int64), np.zeros((MOST_OBJECTS, 3), np.float32)
        for index in np.flatnonzero(here):
            objects[index] = TAKES_PART if index < count else STAYS
            positions[index] = seen.positions[index].clip(-_REACH, _REACH)
        given: dict[str, Any] = {"instruction": bytes_of(self._words), "objects": objects, "positions": positions}
        if self._observation == "cloud":
            clouds = np.zeros((MOST_OBJECTS, SURFACE_POINTS, 3), np.float32)
            for index in np.flatnonzero(here):
                points = seen.clouds[index].points  # type: ignore[union-attr]
                clouds[index] = np.resize(points, (SURFACE_POINTS, 3)).clip(-_REACH, _REACH)
            return {**given, "clouds": clouds}
        numbers = np.zeros(seen.image.segmentation.shape, np.uint8)
        for number, body in enumerate(self._episode.bodies, start=1):
            numbers[seen.image.segmentation == body] = number
        if self._observation == "color":
            return {**given, "segmentation": numbers, "color": seen.image.color}
        depth = np.nan_to_num(seen.image.depth, nan=0.0).clip(0.0, DepthCamera.far).astype(np.float32)
        return {**given, "segmentation": numbers, "depth": depth}

    def _info(self, outcome: Outcome | None) -> dict[str, Any]:
        assert self._episode is not None
        scene = self._episode.scene
        info = {
            "instruction": self._words,
            "structure": scene.structure,
            "names": list(self._episode.names),
            "nouns": [model.category for model in scene.drawn.models],
        }
        if outcome is None:
            return info
        return {
            **info,
            "success": outcome.success,
            "failure": outcome.failure or "",
            "detail": outcome.detail,
            "refused": outcome.refused,
            "checks": [check_values(check) for check in outcome.checks],
        }


def instruction_of(scene: EvaluationScene) -> str:
    """Return the instruction of a scene: one of the corpus's sentences for its slots, in turn."""
    templates = sentences(scene.spec)
    return templates[scene.number % len(templates)]


def bytes_of(text: str) -> np.ndarray:
    """Return a text as an observation: (128,) uint8, UTF-8 followed by zeros."""
    return np.frombuffer(text.encode().ljust(MOST_BYTES, b"\0"), np.uint8).copy()


def check_values(check: Any) -> dict[str, Any]:
    """Return a check of the protocol as plain values."""
    return {
        "name": check.name, "passed": bool(check.passed), "measured": float(check.measured), "limit": check.limit,
    }  # fmt: skip


def _observation_space(observation: str) -> spaces.Dict:
    camera = DepthCamera()
    size = (camera.height, camera.width)
    numbers = spaces.Box(0, MOST_OBJECTS, size, np.uint8)
    shown: dict[str, dict[str, spaces.Space[Any]]] = {
        "color": {"segmentation": numbers, "color": spaces.Box(0, 255, (*size, 3), np.uint8)},
        "depth": {"segmentation": numbers, "depth": spaces.Box(0.0, camera.far, size, np.float32)},
        "cloud": {"clouds": spaces.Box(-_REACH, _REACH, (MOST_OBJECTS, SURFACE_POINTS, 3), np.float32)},
    }
    return spaces.Dict({
        # No Text space: AsyncVectorEnv (gymnasium 1.4) never reads it anew from its shared memory.
        "instruction": spaces.Box(0, 255, (MOST_BYTES,), np.uint8),
        "objects": spaces.MultiDiscrete(np.full(MOST_OBJECTS, 3)),
        "positions": spaces.Box(-_REACH, _REACH, (MOST_OBJECTS, 3), np.float32),
        **shown[observation],
    })  # fmt: skip
