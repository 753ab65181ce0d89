"""Load planners by name, and filter their proposals."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from agent.errors import NoValidGoal, UsageError
from agent.model_cards.provenance import Provenance, provenance_of, require_cards
from structdiffusion.observation import Arrangement
from structdiffusion.planners.registry import PLANNERS, legal_instead_of

if TYPE_CHECKING:
    from grounding.spec import StructureSpec
    from structdiffusion.observation import Scene
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


def filter_viable(
    arrangements: Sequence[Arrangement], scene: Scene | None = None, spec: StructureSpec | None = None
) -> list[Arrangement]:
    """Keep the arrangements that are worth a try, best first.

    Args:
        arrangements: best first.
        scene: of whose objects, and
        spec: of which structure they are, to say what is impossible; `None` if that is not of interest, or they are of
            a goal of several parts.

    Raises:
        NoValidGoal: if there is none.
    """
    good = [arrangement for arrangement in arrangements if is_viable(arrangement)]
    if good:
        return good
    from structdiffusion.fitting_shapes import why_it_does_not_fit

    none = f"none of {len(arrangements)} proposed arrangements is good enough"
    if scene is not None and spec is not None and (reason := why_it_does_not_fit(scene, spec, _rng())):
        raise NoValidGoal(f"{none}: {reason}{what_fits(scene, spec)}")
    best = max((arrangement.scores for arrangement in arrangements), key=lambda scores: scores["total"], default={})
    factors = sorted((score, name) for name, score in best.items() if name != "total")
    most = f"; what costs it most is {factors[0][1]!r}, {factors[0][0]:.2g}" if factors else ""
    raise NoValidGoal(
        f"{none}: the best scores {best.get('total', 0.0):.2g}, and at least {LEAST_SCORE} is needed{most}"
    )


def what_fits(scene: Scene, spec: StructureSpec) -> str:
    """Return what can be built of the same objects instead, as the end of a sentence; empty if nothing is known."""
    from grounding.spec import StructureSpec
    from structdiffusion.fitting_shapes import shapes_that_fit, values_in_the_way

    values = [f"without {value!r}" for value in values_in_the_way(scene, spec, _rng())]
    shapes, left = shapes_that_fit(scene, spec, _rng()), ""
    asked = [value for slot, value in spec.tokens() if slot != "shape"]
    if asked and not (values or shapes):
        shapes, left = shapes_that_fit(scene, StructureSpec(spec.shape), _rng()), f" without {' and '.join(asked)}"
    offers = [f"it fits {_either(values)}"] if values else []
    offers += [f"{_either([_called(name) for name in shapes])} of them fits{left}"] if shapes else []
    return "".join(f"; {offer}" for offer in offers)


def _called(shape: str) -> str:
    """Return what people call a structure, with its article: "a grid", "a double line"."""
    from agent.rendering.text import with_indefinite_article
    from grounding.structure_words import words_of
    from structdiffusion.structures.structure import a_structure

    figure = words_of(shape).figure
    return a_structure(shape) if figure is None else with_indefinite_article(figure.nouns[0])


def _either(choices: list[str]) -> str:
    return " or ".join(filter(None, (", ".join(choices[:-1]), choices[-1])))


def _rng() -> np.random.Generator:
    """Return the generator of layouts that are drawn to explain a refusal: the same every time."""
    return np.random.default_rng(0)
