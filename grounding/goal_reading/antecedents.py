"""Keep what an instruction spoke of, and find what "it" and "them" mean."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from grounding.goal_reading.frame import Frame
from grounding.goal_reading.noun_phrase import NounPhrase
from grounding.goals.parts import PartReference


@dataclass
class Antecedents:
    """What "it" and "them" can mean.

    Attributes:
        structure: the number of the last structure; `None` where something else was said since.
        mentioned: the objects that were mentioned, the last ones last, each with whether several may be meant.
        before: how many were mentioned before the present frame.
        last: the objects that the last frame was about.
        unused: a frame that only names objects, of which nothing is said yet.
        frame: the frame before the present one.
        left_out: objects that must stay as they are.
    """

    structure: int | None = None
    mentioned: list[tuple[tuple[Any, ...], bool]] = field(default_factory=list)
    before: int = 0
    last: tuple[Any, ...] | None = None
    unused: Frame | None = None
    frame: Frame | None = None
    left_out: set[Any] = field(default_factory=set)

    def meant(self, phrase: NounPhrase, pairs: bool = False) -> Any:
        """Return what a pronoun means: objects, the structure of a part, or `None`.

        Args:
            phrase: the pronoun.
            pairs: whether two objects are needed, as for "between them".
        """
        one = phrase.text.lower() in ("it", "this", "that", "itself")
        if pairs and self.last is not None and len(self.last) == 2:
            return self.last
        if self.structure is not None and not pairs:
            return PartReference(self.structure)
        mentioned = self.mentioned[: self.before]
        if one and self.unused is not None and self.last is not None and len(self.last) == 1:
            self.unused = None
            return self.last
        if one:
            return next((objects for objects, many in reversed(mentioned) if not many and len(objects) == 1), None)
        if self.unused is not None and self.last is not None:
            self.unused = None
            return self.last
        if self.last is not None and len(self.last) > 1:
            return self.last
        several = next((objects for objects, many in reversed(mentioned) if many or len(objects) > 1), None)
        return several or (
            tuple(one for objects, _ in mentioned[-2:] for one in objects) if len(mentioned) > 1 else None
        )
