"""Define the settings of an evaluation of figures besides methods, families and scenes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import agent.arm
import grounding.figures
from agent.evaluation.planner_config import PlannerConfig
from agent.evaluation.report import command_line
from structdiffusion.benchmark.figure_examples import METHODS
from structdiffusion.benchmark.figure_families import COUNTS
from structdiffusion.objects.model import ObjectModel


@dataclass(frozen=True)
class FiguresConfig(PlannerConfig):
    """The options on which a row depends.

    Attributes:
        model: the planner.
        arm: also build the best-ranked arrangements with the arm.
        hold: how its hand holds objects, one of `agent.arm.simulated_arm.HOLDS`.
    """

    model: str = "diffusion"
    arm: bool = False
    hold: str = "friction"

    def command(self, methods: Sequence[str], families: Sequence[str], scenes: int) -> str:
        """Return the command that makes these rows."""
        return command_line(
            "figures", objects=self.objects, scenes=scenes, seed=self.seed, model=self.model,
            method=None if tuple(methods) == tuple(METHODS) else list(methods),
            family=None if tuple(families) == tuple(COUNTS) else list(families), weights=self.weights,
            candidates=self.candidates, arm=self.arm, hold=self.hold if self.arm else None,
            allow_unverified=self.allow_unverified,
        )  # fmt: skip

    def fingerprint(self, library: Sequence[ObjectModel]) -> dict[str, Any]:
        """Return the inputs that two commands must share for their rows to be compared."""
        packages = (grounding.figures, agent.arm) if self.arm else (grounding.figures,)
        return {"evaluation": "figures"} | self.rows_fingerprint(library, (self.model,), packages)
