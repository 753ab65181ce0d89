"""Define the settings of a success evaluation besides planners and scenes: as options, command and fingerprint."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from agent.evaluation.planner_config import PlannerConfig
from agent.evaluation.report import command_line
from agent.evaluation.scene_conditions import conditions_of
from grounding.spec import FIRST_SHAPES
from structdiffusion.benchmark.scenes import Conditions
from structdiffusion.objects.model import ObjectModel
from structdiffusion.planners.registry import PLANNERS

TOP_K = 5  # arrangements that are tried by default


@dataclass(frozen=True)
class SuccessConfig(PlannerConfig):
    """The options on which a row depends, in addition to those of `PlannerConfig`.

    Attributes:
        top_k: the largest number of arrangements to try, at most `candidates`.
        objects_per_scene, table, camera: as for `conditions_of`.
    """

    top_k: int = TOP_K
    objects_per_scene: str | None = None
    table: str | None = None
    camera: str = "robot"

    @property
    def conditions(self) -> Conditions:
        """Return the conditions under which scenes are drawn.

        Raises:
            UsageError: for an illegal value.
        """
        return conditions_of(self.objects_per_scene, self.table, self.camera)

    def candidates_of(self, model: str) -> int:
        """Return how many arrangements a planner proposes: only as many as are tried if it neither ranks nor searches.

        The proposals of such a planner are independent draws in the order of drawing, so that the first few have the
        same distribution however many follow.
        """
        parts = PLANNERS[model]
        chooses = parts.ranked or parts.cem or parts.rollouts
        return parts.candidates or (self.candidates if chooses else min(self.candidates, self.top_k))

    def command(self, models: Sequence[str], structures: Sequence[str], scenes: int) -> str:
        """Return the command that makes these rows."""
        return command_line(
            "success", objects=self.objects, scenes=scenes, seed=self.seed, model=list(models),
            structure=None if tuple(structures) == FIRST_SHAPES else list(structures), weights=self.weights,
            candidates=self.candidates, top_k=self.top_k, objects_per_scene=self.objects_per_scene, table=self.table,
            camera=None if self.camera == "robot" else self.camera, allow_unverified=self.allow_unverified,
        )  # fmt: skip

    def fingerprint(self, library: Sequence[ObjectModel], models: Sequence[str]) -> dict[str, Any]:
        """Return the inputs that two commands must share for their rows to be compared."""
        return self.rows_fingerprint(library, models)
