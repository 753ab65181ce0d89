"""Find the objects of all copied phrases of one goal, each with what the others and the instruction say."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from grounding.goal_reading.phrase_references.choice_errors import Doubt, NothingFits
from grounding.goal_reading.phrase_references.coordination import coordinated
from grounding.goal_reading.phrase_references.known_words import KNOWN_WORDS
from grounding.goal_reading.phrase_references.phrase import Phrase, PhraseGroup
from grounding.goal_reading.phrase_references.phrase_objects import PhraseObjects
from grounding.goal_reading.phrase_references.phrase_parser import PhraseParser
from grounding.goal_reading.phrase_references.phrase_words import plain_words
from grounding.goal_reading.phrase_references.said_phrases import SaidPhrase, SaidPhrases
from grounding.goal_reading.phrase_references.scene_nouns import SceneNouns
from grounding.goal_reading.phrase_references.selection import Selection
from grounding.goal_reading.scene_references import SceneReferences
from grounding.goal_reading.spelling import corrected
from grounding.references.phrases import Vocabulary

_SHORT = 5  # letters: shorter words are right as they are, "sour" is no soup


class GoalPhrases:
    """The copied phrases of one goal in one scene.

    Args:
        find: the scene, with known objects.
        vocabulary: the nouns that are known.
        text: the instruction, from which bare adjectives take their nouns; may be empty.
    """

    def __init__(self, find: SceneReferences, vocabulary: Vocabulary, text: str = "") -> None:
        assert find.candidates is not None  # of a scene
        self._vocabulary, self._said = vocabulary, SaidPhrases()
        self._nouns = SceneNouns(find.candidates, vocabulary)
        words = plain_words(text, self._spelled)
        self._objects = PhraseObjects(self._nouns, self._said, words, partial(Selection, find, self._nouns))

    def read(self, groups: Sequence[PhraseGroup]) -> list[list[Phrase] | None]:
        """Read the phrases of all groups; `None` for a group with a word that is not understood."""
        found: list[list[Phrase] | None] = []
        for group in groups:
            read = [PhraseParser(plain_words(text, self._spelled), self._nouns).phrases() for text in group.texts]
            phrases = [phrase for each in read for phrase in each or ()]
            found.append(coordinated(phrases, self._takes) if phrases and None not in read else None)
        return found

    def resolve(self, groups: Sequence[PhraseGroup]) -> list[list[int] | None | Exception]:
        """Find the objects of each group.

        Returns:
            For each group its objects; `None` for everything that no other part names; or what was in the way:
            `Doubt` with the objects of which one is meant, or `NothingFits`.
        """
        read = self.read(groups)
        self._said.all = []
        place = 0
        for number, phrases in enumerate(read):
            for phrase in phrases or ():
                place = self._objects.contexts.place_of(phrase, place)
                role, part = groups[number].role, groups[number].part
                self._said.all.append(SaidPhrase(phrase, number, place, role == "kept", part=part, role=role))
        problems = {n: NothingFits("a word is not understood") for n, each in enumerate(read) if each is None}
        problems |= self._find_all(groups, problems)
        found = [problems.get(n) or self._united(n, groups[n]) for n in range(len(groups))]
        return [each if isinstance(each, Exception) else self._less(n, each, groups) for n, each in enumerate(found)]

    def _find_all(self, groups: Sequence[PhraseGroup], known: dict[int, NothingFits]) -> dict[int, Exception]:
        """Find the objects of all phrases: first of those that depend on no other phrase, last of "the rest"."""
        problems: dict[int, Exception] = {}
        for step in range(3):
            for said in sorted(self._said.all, key=lambda each: each.place) if step else self._said.all:
                if _step(said.phrase) != step or said.group in problems or said.group in known:
                    continue
                try:
                    said.found = self._objects.find(said, groups[said.group])
                except (Doubt, NothingFits) as error:
                    problems[said.group] = error
        return problems

    def _united(self, number: int, group: PhraseGroup) -> list[int] | None:
        """Return the objects of a group together; `None` for a structure of everything that no other part names."""
        own = self._said.of_group(number)
        if group.role == "structure" and len(own) == 1 and own[0].phrase.kind in ("all", "rest", "pronoun"):
            phrase = own[0].phrase
            everything = phrase.kind == "rest" or len(own[0].found or ()) == self._nouns.count
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
        mixed = len({self._nouns.head(i) for i in found}) > 1
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
        meant = self._nouns.meanings(model.noun[-1])
        return any(self._objects.selection.fitting(Phrase("", tests=colours), base) for base in meant)

    def _spelled(self, word: str) -> str:
        """Correct a typing error, but to no noun that nothing here is called: "sofas" are no sodas."""
        found = word if len(word) < _SHORT else corrected(word, self._vocabulary, KNOWN_WORDS)
        return found if found == word or not self._nouns.is_noun(found) or self._nouns.named(found) else word


def _step(phrase: Phrase) -> int:
    return 2 if phrase.kind == "rest" else int(_depends(phrase))


def _depends(phrase: Phrase) -> bool:
    """Tell whether the meaning of a phrase depends on what other phrases of the goal name."""
    if phrase.kind in ("rest", "pronoun", "twin") or phrase.other or phrase.demonstrative:
        return True
    tests = [test for each in phrase.tests for test in each]
    if any(test.kind == "contrast" or (test.kind == "alike" and test.other is None) for test in tests):
        return True
    inner = [*(test.other for test in tests), phrase.among, *phrase.without]
    return any(_depends(each) for each in inner if each is not None)
