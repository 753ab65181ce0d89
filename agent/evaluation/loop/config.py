"""Define the settings of an evaluation of the closed loop: as options, command and fingerprint."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import agent.arm
import agent.evaluation.loop
import grounding.goals
from agent.arm.disturbances import DISTURBANCES
from agent.evaluation.planner_config import BuildConfig
from agent.evaluation.report import command_line
from structdiffusion.benchmark.goal_names import LOOP_FAMILIES
from structdiffusion.objects.model import ObjectModel


@dataclass(frozen=True)
class LoopConfig(BuildConfig):
    """The options on which a row depends."""

    def command(self, disturbances: Sequence[str], families: Sequence[str], scenes: int) -> str:
        """Return the command that makes these rows."""
        return command_line(
            "loop", objects=self.objects, scenes=scenes, seed=self.seed, model=self.model, weights=self.weights,
            disturb=None if tuple(disturbances) == DISTURBANCES else list(disturbances),
            family=None if tuple(families) == LOOP_FAMILIES else list(families),
            candidates=self.candidates, hold=self.hold, allow_unverified=self.allow_unverified,
        )  # fmt: skip

    def fingerprint(self, library: Sequence[ObjectModel]) -> dict[str, Any]:
        """Return the inputs that two commands must share for their rows to be compared."""
        packages = (grounding.goals, agent.arm, agent.evaluation.loop)
        return {"evaluation": "loop"} | self.rows_fingerprint(library, [self.model], packages)
