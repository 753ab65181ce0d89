"""Define the settings of a success evaluation besides planners and scenes: as options, command and fingerprint."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from agent.evaluation.report import command_line
from agent.evaluation.result_store import fingerprint
from agent.evaluation.scene_conditions import conditions_of
from grounding.spec import FIRST_SHAPES
from structdiffusion.benchmark.scenes import Conditions
from structdiffusion.objects.model import ObjectModel
from structdiffusion.planners.registry import PLANNERS

TOP_K = 5  # arrangements that are tried by default


@dataclass(frozen=True)
class SuccessConfig:
    """The options on which a row depends.

    Attributes:
        objects: as for `load_objects`.
        weights: folder of the checkpoints; `None` for the shipped ones.
        seed: of scenes, sensor noise and sampling.
        candidates: arrangements that a planner proposes per scene.
        top_k: how many of them are tried at most, no more than there are.
        objects_per_scene, table, camera: as for `conditions_of`.
        allow_unverified: use checkpoints that differ from their model cards. Rows are told apart by the checksums of
            the networks in any case.
    """

    objects: str
    weights: Path | None = None
    seed: int = 0
    candidates: int = 64
    top_k: int = TOP_K
    objects_per_scene: str | None = None
    table: str | None = None
    camera: str = "robot"
    allow_unverified: bool = False

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
        """Return what two commands must have in common for their rows to stand in one table."""
        options = {key: value for key, value in asdict(self).items() if key not in ("weights", "allow_unverified")}
        return fingerprint(options, library, models, self.weights)
