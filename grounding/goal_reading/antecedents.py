"""Keep what an instruction spoke of, and find what "it" and "them" mean."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from grounding.goal_reading.frame import Frame
from grounding.goal_reading.noun_phrase import NounPhrase
from grounding.goals.goal import Goal
from grounding.goals.parts import PartReference, StructurePart


@dataclass
class Antecedents:
    """What "it" and "them" can mean.

    Attributes:
        structure: the number of the last structure; `None` where something else was said since.
        mentioned: the objects that were mentioned, or a part that a pronoun meant, the last ones last, each with whether
            several may be meant.
        before: how many were mentioned before the present frame.
        last: the objects that the last frame was about.
        unused: a frame that only names objects, of which nothing is said yet.
        frame: the frame before the present one.
        left_out: objects that must stay as they are, or take no part in a structure.
        untouched: those of them that must not be touched or moved.
        again: the places in `mentioned` of what only a pronoun meant.
    """

    structure: int | None = None
    mentioned: list[tuple[Any, bool]] = field(default_factory=list)
    before: int = 0
    last: tuple[Any, ...] | None = None
    unused: Frame | None = None
    frame: Frame | None = None
    left_out: set[Any] = field(default_factory=set)
    untouched: set[Any] = field(default_factory=set)
    again: set[int] = field(default_factory=set)

    def meant(
        self, phrase: NounPhrase, pairs: bool = False, fits: Callable[[tuple[Any, ...]], bool] | None = None
    ) -> Any:
        """Return what a pronoun means: objects, the structure of a part, or `None`.

        Args:
            phrase: the pronoun.
            pairs: whether two objects are needed, as for "between them".
            fits: tells whether objects can be what is meant; where none can, all are possible.
        """
        if phrase.text.lower() in ("the former", "the latter"):
            return self._of_two(phrase.text.lower() == "the former")
        if pairs and self.last is not None and len(self.last) == 2:
            return self.last
        if self.structure is not None and not pairs:
            return PartReference(self.structure)
        if phrase.many:
            return self._mentioned_several()
        return self._mentioned_one(fits, fresh=phrase.text.lower() in ("that", "that one"))

    def keep(self, meant: Any, pronoun: NounPhrase) -> None:
        """Keep what a pronoun meant for the next one: "the banana behind it and the spoon in front of it"."""
        if meant is not None:
            self.again.add(len(self.mentioned))
            self.mentioned.append((meant, pronoun.many))

    def _of_two(self, first: bool) -> Any:
        """Return the first or the second of the last two things that were mentioned before."""
        two = self.mentioned[: self.before][-2:]
        if len(two) < 2 and len(self.mentioned) > 1:  # "put the former in the latter"
            two = self.mentioned[-2:]
        self.unused = None
        return two[0 if first else 1][0] if len(two) == 2 else None

    def _mentioned_one(self, fits: Callable[[tuple[Any, ...]], bool] | None, fresh: bool) -> Any:
        """Return the last single thing; "that" is none that only a pronoun meant."""
        if self.unused is not None and self.last is not None and len(self.last) == 1:
            self.unused = None
            return self.last
        single = [
            objects
            for place, (objects, many) in reversed(list(enumerate(self.mentioned[: self.before])))
            if not (many or fresh and place in self.again) and (isinstance(objects, PartReference) or len(objects) == 1)
        ]
        fitting = [one for one in single if fits is None or (isinstance(one, tuple) and fits(one))]
        return next(iter(fitting or single), None)

    def _mentioned_several(self) -> Any:
        if self.unused is not None and self.last is not None:
            self.unused = None
            return self.last
        mentioned = self.mentioned[: self.before]
        if mentioned and isinstance(mentioned[-1][0], PartReference):
            return mentioned[-1][0]
        if self.last is not None and len(self.last) > 1:
            return self.last
        several = next(
            (each for each, many in reversed(mentioned) if many or isinstance(each, PartReference) or len(each) > 1), None
        )
        named = [objects for objects, _ in mentioned[-2:] if isinstance(objects, tuple)]
        return several or (tuple(one for objects in named for one in objects) if len(named) > 1 else None)


def antecedents_of(goal: Goal, about: int | None = None) -> Antecedents:
    """Return what "it" and "them" can mean after a goal.

    Args:
        goal: that was asked for.
        about: the part that is spoken of, where that is known.
    """
    found = Antecedents()
    order = [n for n in range(len(goal.parts)) if n != about] + ([about] if about is not None else [])
    for number in order:
        part = goal.parts[number]
        second = part.around if isinstance(part, StructurePart) else part.reference
        for objects in (part.objects, second):
            if isinstance(objects, (tuple, PartReference)):
                found.mentioned.append((objects, isinstance(objects, tuple) and len(objects) > 1))
        structure = isinstance(part, StructurePart)
        found.structure = number if structure else None
        found.last = part.objects if isinstance(part.objects, tuple) else None
    return found
