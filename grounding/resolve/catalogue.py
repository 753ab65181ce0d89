"""Find what phrases can mean in a library, from which a scene is drawn later."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from grounding.resolve.errors import AbsentError, Doubt, ResolveError
from grounding.resolve.goal_phrases import GoalPhrases
from grounding.resolve.phrase import Phrase, PhraseGroup
from grounding.resolve.referents import Referents

# What a library tells: the others compare what stands on a table.
_TOLD = ("colour", "property", "use", "occasion", "kind", "word")


class CataloguePhrases(GoalPhrases):
    """The copied phrases of one goal in a library.

    All objects of a noun can be meant by a phrase for several, and each of them by a phrase for one: different words
    for one object are different objects.

    Args:
        there: the library.
        text: the instruction.
    """

    def __init__(self, there: Referents, text: str = "") -> None:
        super().__init__(there, text)
        self._chosen: dict[str, list[int]] = {}  # the words of a phrase for a number of objects -> the objects
        self._read_phrases: list[Phrase] = []

    @property
    def phrases(self) -> list[Phrase]:
        """List the phrases that were read last."""
        return self._read_phrases

    def resolve(self, groups: Sequence[PhraseGroup]) -> list[list[int] | None | Exception]:
        """Find what each group can mean; `None` for everything; or what is in the way."""
        found = list[list[int] | None | Exception]()
        for group in groups:
            try:
                found.append(self._of_group(group))
            except ResolveError as error:
                found.append(error)
        return found

    def _of_group(self, group: PhraseGroup) -> list[int] | None:
        objects: list[int] = []
        for phrase in self.read(group.texts):
            whole = phrase.kind in ("all", "rest", "pronoun") and not (phrase.tests or phrase.without)
            if whole and group.role == "structure" and len(group.texts) == 1:
                return None
            self._read_phrases.append(phrase)
            objects += [i for i in self._fitting(phrase, group) if i not in objects]
        return objects

    def _fitting(self, phrase: Phrase, group: PhraseGroup) -> list[int]:
        if phrase.kind == "unread":
            raise AbsentError(phrase.text)
        noun = phrase.noun or next((each.noun for each in reversed(self._read_phrases) if each.noun), ())
        bases = self._there.meanings(noun[-1]) if noun else [self._there.everything()]
        if not bases:
            raise AbsentError(phrase.text)
        found = list(bases[0])
        for alternatives in phrase.tests:
            told = replace(phrase, tests=(alternatives,), rank=None, among=None, count=None, plural=True)
            if alternatives[0].kind in _TOLD:
                try:
                    fitting = self._objects.choice.fitting(told, found)
                except (Doubt, ResolveError):
                    continue  # seen when some of them stand on the table
                if not fitting and alternatives[0].kind == "colour":
                    raise AbsentError(phrase.text)
                found = fitting or found
        for without in phrase.without:
            found = [i for i in found if i not in self._fitting(without, PhraseGroup(()))] or found
        several = phrase.plural or phrase.every or phrase.kind in ("all", "rest")
        number = phrase.count or (None if several or (group.role == "structure" and group.shaped) else 1)
        return found if number is None or group.role == "structure" and several else self._some(phrase, found, number)

    def _some(self, phrase: Phrase, found: list[int], number: int) -> list[int]:
        if phrase.text not in self._chosen:
            taken = {i for each in self._chosen.values() for i in each}
            fresh = [i for i in found if i not in taken]
            self._chosen[phrase.text] = (fresh or found)[:number]
        return self._chosen[phrase.text]
