"""Define the settings of an evaluation of the environment besides policies and episodes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import agent.arm
import agent.environment
from agent.environment.registration import MOST_ACTIONS
from agent.errors import UsageError
from agent.evaluation.planner_config import PlannerConfig
from agent.evaluation.report import command_line
from grounding.spec import FIRST_SHAPES
from structdiffusion.objects.model import ObjectModel
from structdiffusion.planners.registry import PLANNERS, legal_instead_of

RANDOM = "random"
BASELINES = (RANDOM, "geometric", "diffusion")


@dataclass(frozen=True)
class EnvironmentConfig(PlannerConfig):
    """The options on which a row depends, in addition to those of `PlannerConfig`.

    Attributes:
        mode: one of `agent.environment.episode.MODES`.
        hold: how the hand holds objects, one of `agent.arm.simulated_arm.HOLDS`.
        actions: the most of an episode.
        structures: the shapes that are asked for, of those that the parser of slots was taught.
    """

    mode: str = "place"
    hold: str = "friction"
    actions: int = MOST_ACTIONS
    structures: tuple[str, ...] = FIRST_SHAPES

    def command(self, policies: Sequence[str], episodes: int) -> str:
        """Return the command that makes these rows."""
        return command_line(
            "environment", objects=self.objects, episodes=episodes, seed=self.seed,
            policy=None if tuple(policies) == BASELINES else list(policies), weights=self.weights,
            structure=None if self.structures == FIRST_SHAPES else self.structures,
            candidates=self.candidates, mode=self.mode, hold=self.hold if self.mode == "arm" else None,
            actions=self.actions, allow_unverified=self.allow_unverified,
        )  # fmt: skip

    def fingerprint(self, library: Sequence[ObjectModel], policies: Sequence[str]) -> dict[str, Any]:
        """Return the inputs that two commands must share for their rows to be compared."""
        planners = [name for name in policies if name != RANDOM]
        packages = (agent.environment, *((agent.arm,) if self.mode == "arm" else ()))
        rows = self.rows_fingerprint(library, planners, packages)
        return {"evaluation": "environment", **rows, "structures": list(self.structures)}


def checked_policies(names: Sequence[str] | None) -> tuple[str, ...]:
    """Return the policies of these names, each once, or the three baselines if there are none.

    Raises:
        UsageError: for a name that is neither "random" nor that of a planner.
    """
    for name in names or ():
        if name != RANDOM and name not in PLANNERS:
            raise UsageError(f"--policy cannot be {name!r}; legal: {RANDOM}, or a planner: {legal_instead_of(name)}")
    return tuple(dict.fromkeys(names or BASELINES))
