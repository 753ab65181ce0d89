"""Define the settings of an evaluation of figures besides methods, families and scenes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

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
    """

    model: str = "diffusion"

    def command(self, methods: Sequence[str], families: Sequence[str], scenes: int) -> str:
        """Return the command that makes these rows."""
        return command_line(
            "figures", objects=self.objects, scenes=scenes, seed=self.seed, model=self.model,
            method=None if tuple(methods) == tuple(METHODS) else list(methods),
            family=None if tuple(families) == tuple(COUNTS) else list(families), weights=self.weights,
            candidates=self.candidates, allow_unverified=self.allow_unverified,
        )  # fmt: skip

    def fingerprint(self, library: Sequence[ObjectModel]) -> dict[str, Any]:
        """Return the inputs that two commands must share for their rows to be compared."""
        return {"evaluation": "figures"} | self.rows_fingerprint(library, (self.model,), (grounding.figures,))
