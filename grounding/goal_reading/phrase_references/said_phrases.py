"""Keep the phrases of one goal with where they were said and what they were found to mean."""

from __future__ import annotations

from dataclasses import dataclass, field

from grounding.goal_reading.phrase_references.phrase import Phrase


@dataclass
class SaidPhrase:
    """One phrase of a goal.

    Attributes:
        phrase: what it says.
        group: the number of its group.
        place: where the instruction says it.
        kept: whether its objects are to stay.
        found: its objects; `None` until they are found.
        part: the number of its part of the goal; -1 where it is not known.
        role: of its group.
        inner: the objects of phrases within it, "of the same colour as the far cup".
    """

    phrase: Phrase
    group: int
    place: int
    kept: bool = False
    found: list[int] | None = None
    part: int = -1
    role: str = ""
    inner: list[list[int]] = field(default_factory=list)


class SaidPhrases:
    """All phrases of one goal, of which one is being resolved.

    Attributes:
        all: the phrases, as the goal has them.
        current: the one whose objects are looked for.
    """

    def __init__(self) -> None:
        self.all: list[SaidPhrase] = []
        self.current: SaidPhrase | None = None

    def of_group(self, number: int) -> list[SaidPhrase]:
        """List the phrases of a group."""
        return [each for each in self.all if each.group == number]

    def beside_current(self) -> list[Phrase]:
        """List the phrases of the group of the current one, itself among them."""
        return [each.phrase for each in self.of_group(self.current.group)] if self.current is not None else []

    def in_part(self, other: SaidPhrase) -> bool:
        """Tell whether another phrase stands beside the current one in a part: "the mug left of it" is not the mug."""
        current = self.current
        return current is not None and other.part == current.part >= 0 and other.group != current.group

    def beside_in_part(self) -> set[int]:
        """Return the objects of the other places of the current phrase's part, which it cannot mean as well."""
        return {i for each in self.all if self.in_part(each) for i in each.found or ()}

    def before(self) -> list[SaidPhrase]:
        """List the phrases that were said before the current one, and whose objects are known."""
        place = self.current.place if self.current is not None else 0
        known = (each for each in self.all if each.found is not None and each is not self.current)
        return sorted((each for each in known if each.place < place), key=lambda each: each.place)

    def mentioned(self) -> list[list[int]]:
        """List what was named before the current phrase, also within other phrases; the last one last."""
        own = self.current.inner if self.current is not None else []
        return [*(found for each in self.before() for found in (*each.inner, each.found or [])), *own[:-1]]

    def last_one(self) -> list[int]:
        """Return the object that was named last alone; empty where none was."""
        return list(next((found for found in reversed(self.mentioned()) if len(found) == 1), []))

    def named(self) -> set[int]:
        """Return the objects that other phrases name; "everything" and pronouns name none."""
        return {
            i for each in self.all
            if each is not self.current and each.found is not None and each.phrase.kind not in ("all", "pronoun")
            for i in each.found
        }  # fmt: skip

    def alone(self) -> bool:
        """Tell whether no other group but what is to stay was found to mean something."""
        group = self.current.group if self.current is not None else -1
        return not any(each.group != group and each.found and not each.kept for each in self.all)
