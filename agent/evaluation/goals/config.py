"""Define the settings of an evaluation of goals besides families and scenes: as options, command and fingerprint."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import agent.arm
import grounding.goals
from agent.errors import UsageError
from agent.evaluation.report import command_line
from agent.evaluation.result_store import fingerprint
from structdiffusion.benchmark.goal_families import FAMILIES
from structdiffusion.objects.model import ObjectModel
from structdiffusion.planners.registry import PLANNERS


@dataclass(frozen=True)
class GoalsConfig:
    """The options on which a row depends.

    Attributes:
        objects: as for `load_objects`.
        weights: folder of the checkpoints; `None` for the shipped ones.
        seed: of scenes, sensor noise and sampling.
        candidates: arrangements that a planner proposes per scene.
        arm: build with the arm too, where the arrangement stands without it.
        allow_unverified: use checkpoints that differ from their model cards. Rows are told apart by the checksums of
            the networks in any case.
    """

    objects: str
    weights: Path | None = None
    seed: int = 0
    candidates: int = 64
    arm: bool = False
    allow_unverified: bool = False

    def command(self, models: Sequence[str], families: Sequence[str], scenes: int) -> str:
        """Return the command that makes these rows; "disturbed reference" stands for a planner among them."""
        planners = [name for name in models if name in PLANNERS]
        return command_line(
            "goals", objects=self.objects, scenes=scenes, seed=self.seed, model=planners,
            disturbed=len(planners) < len(models),
            family=None if tuple(families) == tuple(FAMILIES) else list(families), weights=self.weights,
            candidates=self.candidates, arm=self.arm, allow_unverified=self.allow_unverified,
        )  # fmt: skip

    def fingerprint(self, library: Sequence[ObjectModel], models: Sequence[str]) -> dict[str, Any]:
        """Return what two commands must have in common for their rows to stand in one table."""
        options = {key: value for key, value in asdict(self).items() if key not in ("weights", "allow_unverified")}
        packages = (grounding.goals, agent.arm) if self.arm else (grounding.goals,)
        return {"evaluation": "goals"} | fingerprint(options, library, models, self.weights, packages)


def checked_families(names: Sequence[str] | None) -> tuple[str, ...]:
    """Return the families of these names in their order; all if there are none.

    Raises:
        UsageError: for an unknown one.
    """
    for name in names or ():
        if name not in FAMILIES:
            raise UsageError(f"--family cannot be {name!r}; legal values: {', '.join(FAMILIES)}")
    return tuple(family for family in FAMILIES if not names or family in names)
