"""What decides the rows of an evaluation, beside models and scenes: as options, as a command, as fingerprints."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from agent.evaluation.result_store import fingerprint
from agent.evaluation.scene_conditions import conditions_of
from grounding.spec import SHAPES
from structdiffusion.benchmark.scenes import Conditions
from structdiffusion.objects.model import ObjectModel
from structdiffusion.planners.registry import PLANNERS

TOP_K = 5  # arrangements that are tried where nobody says how many


@dataclass(frozen=True)
class Asked:
    """The options of which a row depends.

    Attributes:
        objects: as `load_objects` takes it.
        weights: the folder of checkpoints, or `None` for those shipped.
        seed: of scenes, sensor noise and sampling.
        candidates: arrangements that a planner proposes per scene.
        top_k: how many of them are tried at most, no more than there are.
        objects_per_scene, table, camera: as `conditions_of` takes them.
        allow_unverified: take checkpoints that are not what their cards say; a folder's rows are told apart by the
            checksums of the networks, whatever this says.
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
        """What scenes are drawn under.

        Raises:
            UsageError: for a value that is not legal.
        """
        return conditions_of(self.objects_per_scene, self.table, self.camera)

    def candidates_of(self, model: str) -> int:
        """How many arrangements a planner is asked for: no more than are tried of one that neither ranks nor searches.

        Its proposals are independent draws in the order of drawing, so that the first few are the same, in
        distribution, however many follow.
        """
        parts = PLANNERS[model]
        chooses = parts.ranked or parts.cem or parts.imagined
        return parts.candidates or (self.candidates if chooses else min(self.candidates, self.top_k))

    def command(self, models: Sequence[str], structures: Sequence[str], scenes: int) -> str:
        """The command that makes these rows."""
        words = ["structagent", "evaluate", "success", "--objects", self.objects, "--scenes", str(scenes)]
        words += ["--seed", str(self.seed)]
        for model in models:
            words += ["--model", model]
        if tuple(structures) != SHAPES:
            for structure in structures:
                words += ["--structure", structure]
        words += ["--weights", str(self.weights)] if self.weights else []
        words += ["--candidates", str(self.candidates), "--top-k", str(self.top_k)]
        words += ["--objects-per-scene", self.objects_per_scene] if self.objects_per_scene else []
        words += ["--table", self.table] if self.table else []
        words += ["--camera", self.camera] if self.camera != "robot" else []
        words += ["--allow-unverified"] * self.allow_unverified
        return shlex.join(words)

    def fingerprint(self, library: Sequence[ObjectModel], models: Sequence[str]) -> dict[str, Any]:
        """What two commands have in common whose rows may stand in one table."""
        options = {key: value for key, value in asdict(self).items() if key not in ("weights", "allow_unverified")}
        return fingerprint(options, library, models, self.weights)
