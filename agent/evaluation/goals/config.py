"""Define the settings of an evaluation of goals besides families and scenes: as options, command and fingerprint."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import agent.arm
import grounding.goals
from agent.evaluation.planner_config import PlannerConfig, checked_names
from agent.evaluation.report import command_line
from structdiffusion.benchmark.goal_families import FAMILIES
from structdiffusion.objects.model import ObjectModel
from structdiffusion.planners.registry import PLANNERS


@dataclass(frozen=True)
class GoalsConfig(PlannerConfig):
    """The options on which a row depends, in addition to those of `PlannerConfig`.

    Attributes:
        arm: also build with the arm if the arrangement stands without it.
        hold: how its hand holds objects, one of `agent.arm.simulated_arm.HOLDS`.
    """

    arm: bool = False
    hold: str = "friction"

    def command(self, models: Sequence[str], families: Sequence[str], scenes: int) -> str:
        """Return the command that makes these rows; `models` may include "disturbed reference"."""
        planners = [name for name in models if name in PLANNERS]
        return command_line(
            "goals", objects=self.objects, scenes=scenes, seed=self.seed, model=planners,
            disturbed=len(planners) < len(models),
            family=None if tuple(families) == tuple(FAMILIES) else list(families), weights=self.weights,
            candidates=self.candidates, arm=self.arm, hold=self.hold if self.arm else None,
            allow_unverified=self.allow_unverified,
        )  # fmt: skip

    def fingerprint(self, library: Sequence[ObjectModel], models: Sequence[str]) -> dict[str, Any]:
        """Return the inputs that two commands must share for their rows to be compared."""
        packages = (grounding.goals, agent.arm) if self.arm else (grounding.goals,)
        return {"evaluation": "goals"} | self.rows_fingerprint(library, models, packages)


def checked_families(names: Sequence[str] | None) -> tuple[str, ...]:
    """Return the families of these names in their order; all if there are none.

    Raises:
        UsageError: for an unknown one.
    """
    return checked_names("family", names, tuple(FAMILIES))
