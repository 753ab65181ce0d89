"""Load planners by name, and filter their proposals."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from agent.errors import NoValidGoal, UsageError
from agent.model_cards.provenance import Provenance, provenance_of, require_cards
from structdiffusion.observation import Arrangement
from structdiffusion.planners.registry import PLANNERS, legal_instead_of

if TYPE_CHECKING:
    from structdiffusion.planners.factory import Planner
    from structdiffusion.planners.goal_planner import GoalArrangement

# An arrangement that its own scores give less than this is not worth a try.
LEAST_SCORE = 0.05


def check_planner(name: str, weights: Path | None, allow_unverified: bool = False) -> dict[str, Provenance]:
    """Check a planner's name and the cards of its checkpoints, without loading them.

    Returns:
        What is known of the files of its networks, by network.

    Raises:
        UsageError: for an unknown name.
        NotVerified: for checkpoints that are not what their cards say, unless that is allowed.
    """
    if name not in PLANNERS:
        raise UsageError(f"--model cannot be {name!r}; {legal_instead_of(name)}")
    found = provenance_of(name, weights)
    if not allow_unverified:
        require_cards(found)
    return found


def checked_planner(name: str, weights: Path | None, allow_unverified: bool = False) -> Planner:
    """Load a planner by name, with the checkpoints in a folder, or the shipped ones if it is `None`.

    Raises:
        UsageError, NotVerified: as `check_planner`.
        CheckpointError: for a checkpoint that is missing or does not fit.
    """
    check_planner(name, weights, allow_unverified)
    # it imports torch, which a chat loads while the user types
    from structdiffusion.planners.factory import load_planner

    return load_planner(name, weights)


def is_viable(arrangement: Arrangement | GoalArrangement) -> bool:
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
