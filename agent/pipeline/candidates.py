"""Load planners by name, and filter their proposals."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from agent.errors import NoValidGoal, UsageError
from agent.model_cards.provenance import provenance_of, require_cards
from structdiffusion.observation import Arrangement
from structdiffusion.planners.factory import Planner, load_planner
from structdiffusion.planners.registry import PLANNERS, legal_instead_of

# An arrangement that its own scores give less than this is not worth a try.
LEAST_SCORE = 0.05


def checked_planner(name: str, weights: Path | None, allow_unverified: bool = False) -> Planner:
    """Load a planner by name, with the checkpoints in a folder, or the shipped ones if it is `None`.

    Raises:
        UsageError: for an unknown name.
        NotVerified: for checkpoints that are not what their cards say, unless that is allowed.
        CheckpointError: for a checkpoint that is missing or does not fit.
    """
    if name not in PLANNERS:
        raise UsageError(f"--model cannot be {name!r}; {legal_instead_of(name)}")
    if not allow_unverified:
        require_cards(provenance_of(name, weights))
    return load_planner(name, weights)


def is_viable(arrangement: Arrangement) -> bool:
    """Return whether its total score is at least `LEAST_SCORE`, or it stood when it was tried in physics.

    The more objects there are, the smaller is the product of all scores, good as they may be.
    """
    return arrangement.scores["total"] >= LEAST_SCORE or arrangement.scores.get("rollout") == 1.0


def filter_viable(arrangements: Sequence[Arrangement]) -> list[Arrangement]:
    """Keep the arrangements that are worth a try, best first.

    Raises:
        NoValidGoal: if there is none.
    """
    good = [arrangement for arrangement in arrangements if is_viable(arrangement)]
    if not good:
        best = max((arrangement.scores["total"] for arrangement in arrangements), default=0.0)
        raise NoValidGoal(
            f"none of {len(arrangements)} proposed arrangements is good enough: the best scores {best:.2g}, "
            f"and at least {LEAST_SCORE} is needed"
        )
    return good
