"""Define the settings that the evaluations of planners, without and with the arm, have in common."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

from agent.errors import UsageError
from agent.evaluation.result_store import fingerprint
from structdiffusion.objects.model import ObjectModel

_NOT_IN_ROWS = ("weights", "allow_unverified")  # networks are identified by their checksums


@dataclass(frozen=True)
class PlannerConfig:
    """The options of an evaluation of planners on which a row depends.

    Attributes:
        objects: as for `load_objects`.
        weights: folder of the checkpoints; `None` for the shipped ones.
        seed: of scenes, sensor noise and sampling.
        candidates: arrangements that a planner proposes per scene.
        allow_unverified: use checkpoints that differ from their model cards. Rows are distinguished by the checksums of
            the networks in any case.
    """

    objects: str
    weights: Path | None = None
    seed: int = 0
    candidates: int = 64
    allow_unverified: bool = False

    def rows_fingerprint(
        self, library: Sequence[ObjectModel], models: Sequence[str], packages: Sequence[ModuleType] = ()
    ) -> dict[str, Any]:
        """Return the inputs that two commands must share for their rows to be compared, JSON-ready.

        Args:
            library: the objects.
            models: names of planners.
            packages: other packages besides `structdiffusion` whose code affects the rows.
        """
        options = {key: value for key, value in asdict(self).items() if key not in _NOT_IN_ROWS}
        return fingerprint(options, library, models, self.weights, packages)


@dataclass(frozen=True)
class BuildConfig(PlannerConfig):
    """The options of an evaluation in which the arm builds what one planner proposes.

    Attributes:
        model: the planner.
        hold: how the hand holds objects, one of `agent.arm.simulated_arm.HOLDS`.
    """

    model: str = "diffusion"
    hold: str = "friction"


def checked_names(option: str, names: Sequence[str] | None, legal: Sequence[str]) -> tuple[str, ...]:
    """Return the names in the order of the legal ones; all if there are none.

    Args:
        option: without its dashes.
        names: what was asked for.
        legal: all there are.

    Raises:
        UsageError: for an unknown one.
    """
    for name in names or ():
        if name not in legal:
            raise UsageError(f"--{option} cannot be {name!r}; legal values: {', '.join(legal)}")
    return tuple(name for name in legal if not names or name in names)
