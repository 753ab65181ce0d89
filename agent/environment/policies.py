"""The baselines of the environment: random moves, and planners whose best arrangement is built move by move.

They see what every agent sees: observations, and the names of the objects.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from agent.environment.build_env import HIGHEST, MOST_OBJECTS, NONE, STAYS, TAKES_PART
from agent.environment.move_order import ordered_moves
from structdiffusion.completion.surface import completed_points
from structdiffusion.observation import ObjectCloud, Scene, StructureGoal, Table
from structdiffusion.simulation.depth_camera import DepthCamera

if TYPE_CHECKING:
    from gymnasium import spaces

    from grounding.parsers.embedding import EmbeddingParser
    from structdiffusion.planners.factory import Planner

Values = Mapping[str, Any]


class Policy(Protocol):
    """Anyone who acts in the environment, with the observation "cloud"."""

    def begin(self, observation: Values, info: Values, seed: int) -> None:
        """Look at the first observation of an episode."""

    def act(self, observation: Values) -> dict[str, Any] | None:
        """Return the next action, or `None` to give up."""


class RandomPolicy:
    """Moves an object that takes part to any place and height, by any turn.

    Args:
        space: of actions.
    """

    def __init__(self, space: spaces.Dict) -> None:
        self._space = space

    def begin(self, observation: Values, info: Values, seed: int) -> None:
        """Look at the first observation of an episode."""
        self._space.seed(seed)

    def act(self, observation: Values) -> dict[str, Any]:
        """Return the next action."""
        able = (observation["objects"] == TAKES_PART).astype(np.int8)
        return self._space.sample(mask={"object": able, "pose": None})


class PlannerPolicy:
    """Reads the instruction, lets a planner propose arrangements, and builds the best one move by move.

    Args:
        planner: takes the slots that the parser reads, and the sentence.
        parser: reads the instruction.
        candidates: arrangements that the planner proposes.
    """

    def __init__(self, planner: Planner, parser: EmbeddingParser, candidates: int = 64) -> None:
        self._planner, self._parser, self._candidates = planner, parser, candidates

    def begin(self, observation: Values, info: Values, seed: int) -> None:
        """Look at the first observation of an episode, and plan all of it.

        Raises:
            LayoutError: if no arrangement exists.
            SpecError: if the parser reads slots that no structure can have together.
        """
        import torch

        words = info["instruction"]
        goal = StructureGoal(self._parser.parse(words).spec, words, self._parser.encoder.encode([words])[0])
        scene, self._members = _scene_of(observation, info)
        generator = torch.Generator().manual_seed(seed)
        found = self._planner.propose(scene, goal, count=self._candidates, generator=generator)
        moves: list[tuple[int, np.ndarray]] = []
        if found:
            clouds = [completed_points(cloud, scene.world_from_camera) for cloud in scene.objects]
            others = [cloud.points for cloud in scene.distractors]
            moves = ordered_moves(clouds, found[0].goal_from_initial, others, scene.table)
        self._moves = iter(moves)

    def act(self, observation: Values) -> dict[str, Any] | None:
        """Return the next action, or `None` after the last one."""
        member, motion = next(self._moves, (None, np.eye(4)))
        if member is None:
            return None
        index = self._members[member]
        x, y, z = observation["positions"][index].astype(np.float64)
        place = motion[:3, :3] @ (x, y, 0.0) + motion[:3, 3]
        yaw = float(np.arctan2(motion[1, 0], motion[0, 0]))
        table = Table()
        low, high = (table.x_min, table.y_min, 0.0, -np.pi), (table.x_max, table.y_max, HIGHEST, np.pi)
        pose = np.clip((*place[:2], z + motion[2, 3], yaw), low, high)
        return {"object": np.int64(index), "pose": pose.astype(np.float32)}


def _scene_of(observation: Values, info: Values) -> tuple[Scene, list[int]]:
    """Return the scene as planners take it, and the indices of the objects that take part."""
    kinds = observation["objects"]
    clouds = {
        index: ObjectCloud(info["names"][index], info["nouns"][index], observation["clouds"][index])
        for index in range(MOST_OBJECTS)
        if kinds[index] != NONE
    }
    members = [index for index in clouds if kinds[index] == TAKES_PART]
    others = tuple(cloud for index, cloud in clouds.items() if kinds[index] == STAYS)
    objects = tuple(clouds[index] for index in members)
    return Scene(objects, Table(), others, DepthCamera().world_from_camera), members
