"""Limit how many objects can take part in a structure."""

from __future__ import annotations

from collections.abc import Sequence

from grounding.spec import StructureSpec
from structdiffusion.data.scene_sampling import SceneError

FEWEST_OBJECTS, MOST_OBJECTS = 2, 12  # what makes a structure, and what the models know


def check_count(selected: Sequence[str], there: int, spec: StructureSpec) -> None:
    """Refuse an instruction that means too few or too many objects.

    Args:
        selected: the names of the objects that it means, and that the arm can take.
        there: how many the scene has.
        spec: the requested slots.

    Raises:
        SceneError: with the names and the legal numbers.
    """
    if not FEWEST_OBJECTS <= len(selected) <= MOST_OBJECTS:
        which = ", ".join(map(repr, selected))
        raise SceneError(
            f"cannot make a {spec.shape or 'structure'} of {len(selected)} of the scene's {there} objects ({which}); "
            f"legal: {FEWEST_OBJECTS} to {MOST_OBJECTS}"
        )
