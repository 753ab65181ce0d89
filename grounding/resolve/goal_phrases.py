"""Find the objects of all phrases of one goal, each with what the others and the instruction say."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType

from grounding.resolve.attributes import TELLING_ADJECTIVES
from grounding.resolve.errors import Doubt, ResolveError
from grounding.resolve.function_words import FUNCTION_WORDS
from grounding.resolve.object_names import as_named, meant_noun
from grounding.resolve.phrase import Phrase, PhraseGroup, SaidPhrase, SaidPhrases
from grounding.resolve.phrase_objects import PhraseObjects
from grounding.resolve.phrase_parser import PhraseParser, coordinated
from grounding.resolve.phrase_words import plain_words
from grounding.resolve.referents import Referents
from grounding.resolve.spelling import KNOWN_WORDS, corrected
from grounding.resolve.word_forms import plural, singular


class GoalPhrases:
    """The copied phrases of one goal in one scene.

    Args:
        there: what is there.
        text: the instruction, from which bare adjectives take their nouns; may be empty.
        known: phrases whose objects are known, as those of the goal that a correction speaks of.

    Attributes:
        words: of the instruction.
        notes: remarks on what words are taken for, a sentence each.
    """

    def __init__(
        self, there: Referents, text: str = "", known: Mapping[str, tuple[int, ...]] = MappingProxyType({})
    ) -> None:
        self._there, self._known, self._said = there, known, SaidPhrases()
        self.words = self._words(text)
        self._objects = PhraseObjects(there, self._said, self.words, known)
        self.notes = self._objects.choice.notes

    @property
    def phrases(self) -> list[Phrase]:
        """List the phrases that were read last."""
        return [each.phrase for each in self._said.all]

    def read(self, texts: Sequence[str]) -> list[Phrase]:
        """Read the phrases of one place of a goal; one that is not understood is of the kind "unread"."""
        return coordinated([phrase for text in texts for phrase in self._read(text)], self._takes)

    def _read(self, text: str) -> list[Phrase]:
        if text in self._known:
            return [Phrase(text, "known", objects=self._known[text])]
        words = self._words(text)
        read = PhraseParser(words, self._there).phrases()
        if read is not None:
            return read
        guessed = {word: found for word in words if (found := self._guess(word))}
        read = PhraseParser([guessed.get(word, word) for word in words], self._there).phrases() if guessed else None
        if read is None:
            return [Phrase(text, "unread")]
        self.notes += [f"{word!r} is read as {noun!r}" for word, noun in guessed.items()]
        return read

    def _words(self, text: str) -> tuple[str, ...]:
        return plain_words(as_named(text, self._there.names), self._spelled)

    def _guess(self, word: str) -> str:
        """Return the noun of something here that a word of no table means; empty where none is near."""
        if not self._strange(word):
            return ""
        heads = sorted({self._there.head(i) for i in self._there.everything()} - {""})
        found = meant_noun(singular(word), heads, self._there.encoder)
        if not found or not self._there.meanings(found):
            return ""
        return plural(found) if singular(word) != word else found

    def _strange(self, word: str) -> bool:
        known = word in FUNCTION_WORDS or word in KNOWN_WORDS or word in TELLING_ADJECTIVES or self._there.is_noun(word)
        return word.isalpha() and len(word) > 2 and not known

    def resolve(self, groups: Sequence[PhraseGroup]) -> list[list[int] | None | Exception]:
        """Find the objects of each group.

        Returns:
            For each group its objects; `None` for everything that no other part names; or what was in the way:
            `Doubt` with the objects of which one is meant, or `ResolveError`.
        """
        self._said.all = []
        place = 0
        for number, group in enumerate(groups):
            read = self.read(group.texts)
            for phrase in read:
                place = self._objects.contexts.place_of(phrase, place)
                source = group.texts[0] if len(read) == 1 else phrase.text
                said = SaidPhrase(phrase, number, place, group.role == "kept", part=group.part, role=group.role)
                said.source = source
                self._said.all.append(said)
        problems = self._find_all(groups)
        found = [problems.get(n) or self._united(n, groups[n]) for n in range(len(groups))]
        return [each if isinstance(each, Exception) else self._less(n, each, groups) for n, each in enumerate(found)]

    def objects_of(self, phrase: Phrase) -> list[int]:
        """Return the objects of a phrase that was read elsewhere; none where they are in doubt."""
        try:
            return self._objects.find(SaidPhrase(phrase, 0, 0), PhraseGroup((phrase.text,), "structure"))
        except (Doubt, ResolveError):
            return []

    def _find_all(self, groups: Sequence[PhraseGroup]) -> dict[int, Exception]:
        """Find the objects of all phrases: first of those that depend on no other phrase, last of "the rest"."""
        problems: dict[int, Exception] = {}
        for step in range(3):
            in_order = sorted(self._said.all, key=lambda each: each.place if step else not each.kept)
            for said in in_order:  # what is left out first: "three cups, none of them yellow" chooses among the others
                if _step(said.phrase) != step or said.group in problems:
                    continue
                try:
                    said.found = self._objects.find(said, groups[said.group])
                except (Doubt, ResolveError) as problem:
                    problems[said.group] = self._explained(said, problem)
        return problems

    def _explained(self, said: SaidPhrase, error: Exception) -> Exception:
        """Name the words of a phrase that nothing here is called."""
        if said.phrase.kind != "unread":
            return error
        words = plain_words(said.source, str)
        strange = [word for word in words if self._strange(word)]
        if any(self._there.is_noun(word) and self._there.meanings(word) for word in words):
            return error
        return ResolveError(f"nothing here is called {' '.join(strange)!r}") if strange else error

    def _united(self, number: int, group: PhraseGroup) -> list[int] | None:
        """Return the objects of a group together; `None` for a structure of everything that no other part names."""
        own = self._said.of_group(number)
        if group.role == "structure" and len(own) == 1 and own[0].phrase.kind in ("all", "rest", "pronoun"):
            phrase = own[0].phrase
            everything = phrase.kind == "rest" or len(own[0].found or ()) == self._there.count
            if everything and not phrase.without and not phrase.tests:
                return None
        return list(dict.fromkeys(i for said in own for i in said.found or ()))

    def _less(self, number: int, found: list[int] | None, groups: Sequence[PhraseGroup]) -> list[int] | None:
        """Leave out of "the toys" those that another part moves: "a ring of toys, and the car in front of it"."""
        own = self._said.of_group(number)
        if found is None or groups[number].role != "structure" or len(own) != 1:
            return found
        phrase = own[0].phrase
        if phrase.count is not None or not phrase.plural or phrase.without or not phrase.noun:
            return found
        mixed = len({self._there.head(i) for i in found}) > 1
        roles = ("objects", "around", "structure") if mixed else ("objects", "around")
        out = {
            i for each in self._said.all
            if each.group != number and groups[each.group].role in roles and not each.phrase.other
            for i in each.found or () if len(each.found or ()) < len(found)
        }  # fmt: skip
        left = [i for i in found if i not in out]
        return left if len(left) > 1 else found

    def _takes(self, phrase: Phrase, model: Phrase) -> bool:
        """Tell whether there is something of another phrase's noun that a bare phrase can mean."""
        if not model.noun:
            return True
        colours = tuple(each for each in phrase.tests if each[0].kind == "colour")
        rank = phrase.rank if phrase.rank is not None and phrase.rank.place != 1 else None
        said = Phrase("", tests=colours, rank=rank)
        return any(self._objects.choice.fitting(said, base) for base in self._there.meanings(model.noun[-1]))

    def _spelled(self, word: str) -> str:
        """Correct a typing error, but to no noun that nothing here is called: "sofas" are no sodas."""
        known = self._there.encoder.whole_words if self._there.encoder is not None else ()
        found = corrected(word, self._there.vocabulary, known)
        return found if found == word or not self._there.is_noun(found) or self._there.named(found) else word


def _step(phrase: Phrase) -> int:
    return 2 if phrase.kind == "rest" else int(_depends(phrase))


def _depends(phrase: Phrase) -> bool:
    """Tell whether the meaning of a phrase depends on what other phrases of the goal name."""
    if phrase.kind in ("rest", "pronoun") or phrase.other or phrase.demonstrative or phrase.number_alone:
        return True
    tests = [test for each in phrase.tests for test in each]
    inner = [*(each for test in tests for each in (test.other, test.second)), phrase.among, *phrase.without]
    return any(_depends(each) for each in inner if each is not None)
