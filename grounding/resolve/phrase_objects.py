"""Find the objects of one copied phrase, with what the other phrases of the goal name."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from grounding.resolve.choice import Choice
from grounding.resolve.errors import AbsentError, Doubt, ResolveError
from grounding.resolve.lexicon import LIKE_KINDS
from grounding.resolve.noun_contexts import NounContexts, ToldObjects
from grounding.resolve.phrase import Phrase, PhraseGroup, SaidPhrase, SaidPhrases
from grounding.resolve.referents import Referents
from grounding.resolve.word_forms import singular

_TELLING = ("colour", "property", "use", "kind")


class PhraseObjects:
    """A finder of the objects of single phrases.

    Args:
        there: what is there.
        said: the phrases of the goal.
        words: of the instruction.
        known: phrases whose objects are known, also within other phrases.
    """

    def __init__(
        self, there: Referents, said: SaidPhrases, words: Sequence[str], known: Mapping[str, tuple[int, ...]]
    ) -> None:
        self._there, self._said, self._known = there, said, known
        self.choice = Choice(there, self._inner)
        self.contexts = NounContexts(words, there, self.choice)
        self._told = ToldObjects(words, there, said, self._objects)
        self._open: set[Phrase] = set()  # phrases whose objects are being found: none holds itself

    def find(self, said: SaidPhrase, group: PhraseGroup) -> list[int]:
        """Find the objects of a phrase of a group.

        Raises:
            ResolveError: where there are none, or too few.
            Doubt: where several fit a phrase that speaks of one.
        """
        self._said.current = said
        phrase = said.phrase
        own = self._said.of_group(said.group)
        same = [each for each in own if each.phrase == phrase]
        if len(same) > 1 and not phrase.plural:  # "ball, ball, block"
            every = self._objects(replace(phrase, plural=True, count=len(same), definite=True))
            place = [each is said for each in same].index(True)
            if place >= len(every):
                raise ResolveError(f"fewer objects fit {phrase.text!r} than are named")
            return [every[place]]
        return self._objects(_of_several(phrase, group, len(own) == 1))

    # Kinds of phrases

    def _inner(self, phrase: Phrase) -> list[int]:
        """Find the objects of a phrase within the current one, and keep them for "that one"."""
        found = self._objects(phrase)
        if self._said.current is not None:
            self._said.current.inner.append(found)
        return found

    def _objects(self, phrase: Phrase) -> list[int]:
        if phrase.text in self._known:
            return list(self._known[phrase.text])
        if phrase in self._open:
            raise ResolveError(f"{phrase.text!r} refers to itself")
        self._open.add(phrase)
        try:
            return self._meant(phrase)
        finally:
            self._open.discard(phrase)

    def _meant(self, phrase: Phrase) -> list[int]:
        if phrase.kind == "unread":
            raise ResolveError(f"it is not clear which objects {phrase.text!r} means")
        if phrase.kind == "known":
            return list(phrase.objects)
        if phrase.kind in ("all", "rest", "pronoun"):
            found = self._general(phrase)
        else:
            whole = phrase.without and phrase.count != 1  # the number is that of what is left
            found = self._best(replace(phrase, count=None, plural=True) if whole else phrase)
        for without in phrase.without:
            out = self._left_out(phrase, without)
            found = [i for i in found if i not in out]
        if not found:
            raise AbsentError(phrase.text)
        return self._counted(phrase, found) if phrase.without and phrase.kind == "objects" else found

    def _left_out(self, phrase: Phrase, without: Phrase) -> list[int]:
        """Find an exception, among what it is excepted from if it has no noun: "all cups except the red one"."""
        if without.borrowed and (phrase.noun or phrase.tests):
            whole = self._best(replace(phrase, without=(), plural=True))
            try:
                out = self._counted(without, self.choice.fitting(without, whole))
            except (ResolveError, Doubt):
                return self._inner(without)
            if self._said.current is not None:
                self._said.current.inner.append(out)
            return out
        return self._inner(without)

    def _general(self, phrase: Phrase) -> list[int]:
        """Find what "everything", "the rest" and "these" mean."""
        everything = self._there.everything()
        if phrase.kind == "rest":
            return [i for i in everything if i not in self._said.named()]
        if phrase.kind == "all":
            found = self.choice.fitting(phrase, everything)
            several = phrase.count is not None and phrase.count != len(found) and not phrase.tests
            if several and (told := self._told.several(phrase.count)):
                return told  # "the three of them"
            return self._counted(phrase, found) if phrase.count is not None else found
        if again := self._said.again():
            return again  # "a jar left of it, a cup in front": of the same thing
        if phrase.plural:
            place = self._said.current.place if self._said.current is not None else 0
            if self._said.alone() and not self.contexts.told_before(place):
                return list(everything)
            if phrase.text != "this" and (told := self._told.several(phrase.count)):
                return told  # "the pots in a heap, and the can to the right of them"
        elif one := self._told.one():
            return one
        raise ResolveError(f"it is not clear what {phrase.text!r} refers to")

    def _best(self, phrase: Phrase) -> list[int]:
        """Find the objects in the first meaning of the noun in which as many fit as the phrase speaks of."""
        pointing = (phrase.demonstrative or phrase.definite) and phrase.borrowed and not (phrase.tests or phrase.other)
        if pointing and phrase.count not in (None, 1) and (told := self._told.several(phrase.count)):
            return told  # "those three", "the pair", "between the two"
        problem: ResolveError | None = None
        few: list[int] = []
        for base in self._bases(phrase):
            try:
                found = self.choice.fitting(phrase, base)
                found = self._counted(phrase, self._others(found) if phrase.other else found)
            except ResolveError as error:
                problem = problem or error
                continue
            open_number = phrase.plural and phrase.count is None and not phrase.every and not phrase.bare
            if not open_number or len(found) > 1:
                return found
            few = few or found  # "the cartons": another meaning may have several
        if few:
            return few
        if unnamed := self._unnamed(phrase):
            raise Doubt(phrase.text, unnamed, instead=phrase.text.removeprefix("the "))
        raise problem or AbsentError(phrase.text)

    def _unnamed(self, phrase: Phrase) -> list[int]:
        """Find the object without a noun whose number a phrase says: "cup 3" may be object 3."""
        numbers = {int(each[0].word) for each in phrase.tests if each[0].kind == "number" and len(each) == 1}
        everything = self._there.everything() if phrase.noun and len(numbers) == 1 else ()
        return [i for i in everything if not self._there.head(i) and self._there.number(i) in numbers]

    def _others(self, found: list[int]) -> list[int]:
        """Leave out what other phrases name, or the goal so far; what those before it name where all are named."""
        left = [i for i in found if i not in self._said.named()]
        if len(left) == len(found):
            so_far = {i for objects in self._known.values() for i in objects}
            left = [i for i in found if i not in so_far] or left
        before = {i for each in self._said.before() for i in each.found or ()}
        return left or [i for i in found if i not in before]

    # Nouns

    def _bases(self, phrase: Phrase) -> Iterator[Sequence[int]]:
        """List the sets of objects that the noun of a phrase can mean, the likeliest first."""
        everything = self._there.everything()
        if phrase.noun:
            noun = singular(phrase.noun[-1])
            like = LIKE_KINDS.get(noun)
            if like is not None and not self._there.of_kinds((noun,)) and (others := self._there.of_kinds((like,))):
                raise Doubt(phrase.text, self._fitting_or_all(phrase, others), instead=noun)
            if not (meant := self._there.meanings(phrase.noun[-1])) and (others := self._there.near(noun)):
                raise Doubt(phrase.text, self._fitting_or_all(phrase, others), instead=noun)
            yield from meant
            return
        if phrase.borrowed and phrase.among is None:
            telling = tuple(each for each in phrase.tests if each[0].kind in _TELLING)
            if telling and not phrase.other:
                found = self.choice.fitting(replace(phrase, rank=None, tests=telling, count=None), everything)
                kinds = {self._there.head(i) for i in found}
                if len(found) == 1 or (phrase.plural and len(kinds) == 1):
                    yield everything
            if _compares_two(phrase) and (pair := self._told.several(2)):
                yield pair  # "the bottle and the jar: the shorter one ..."
            yield from self._common_kind(phrase)
            yield from self._contrasted(phrase)
            for each in reversed(self._said.before()) if phrase.other else ():
                if each.phrase.among is not None and each.phrase.among not in self._open:
                    yield self._inner(each.phrase.among)  # "the bigger of the two, the other one"
                yield from (self._there.of_kinds((self._there.head(one),)) for one in (each.found or ())[:1])
            if not (phrase.other and phrase.plural):
                place = self._said.current.place if self._said.current is not None else 0
                yield from self.contexts.around(phrase, place)
        if _compares_two(phrase) and len(everything) > 2:
            raise Doubt(phrase.text, everything)  # "the shorter one", of which two?
        yield everything

    def _fitting_or_all(self, phrase: Phrase, others: Sequence[int]) -> Sequence[int]:
        """Keep those objects of a like kind that the other words of a phrase describe, or all where they fit none."""
        return self.choice.fitting(phrase, others) or others

    def _contrasted(self, phrase: Phrase) -> Iterator[Sequence[int]]:
        """Find what is of the kind of the phrase that stood in the same role with another place on the table.

        "The white cup on the right goes on the green saucer, the one on the left goes on the white saucer."
        """
        current = self._said.current
        placed = phrase.tests and all(each[0].kind == "place" for each in phrase.tests)
        if current is None or not placed or phrase.bare or current.phrase is not phrase and current.phrase != phrase:
            return
        for each in reversed(self._said.before()):
            other = each.phrase
            if each.role == current.role and other.noun and any(test[0].kind == "place" for test in other.tests):
                tests = tuple(test for test in other.tests if test[0].kind != "place")
                whole = replace(other, tests=tests, rank=None, count=None, plural=True, among=None)
                yield self.choice.fitting(whole, self._there.meanings(other.noun[-1])[0])
                return

    def _common_kind(self, phrase: Phrase) -> Iterator[Sequence[int]]:
        """Find the one kind of which there is something of each bare colour of the group: "white, red, blue"."""
        own = [each for each in self._said.beside_current() if each.bare]
        if not phrase.bare or len(own) < 2:
            return
        bases = [self._there.of_kinds((kind,)) for kind in {self._there.head(i) for i in self._there.everything()}]
        fits = [
            base for base in bases if all(self.choice.fitting(replace(each, rank=None), base) for each in own)
        ]  # fmt: skip
        if len(fits) == 1:
            yield fits[0]

    # Numbers

    def _counted(self, phrase: Phrase, found: list[int]) -> list[int]:
        """Compare how many were found with how many a phrase speaks of."""
        if phrase.half and len(found) % 2:
            raise ResolveError(f"{phrase.text!r} is not possible: half of {len(found)} is not a whole number")
        phrase = replace(phrase, half=False, count=len(found) // 2, definite=False) if phrase.half and found else phrase
        if not found or (phrase.count is not None and len(found) < phrase.count):
            if not found:
                raise AbsentError(phrase.text)
            raise ResolveError(f"{phrase.text!r} needs {phrase.count} objects, but there are {len(found)}")
        wanted = phrase.count if phrase.count is not None else (None if phrase.plural or phrase.every else 1)
        if wanted is None or len(found) == wanted:
            return found
        left = [i for i in found if i not in self._said.kept()]
        if wanted <= len(left) < len(found):
            return self._counted(phrase, left)  # "three cups, none of them yellow"
        if wanted == 1 and phrase.definite and not phrase.other and (phrase.demonstrative or not phrase.tests):
            mentioned = [*map(list, self._known.values()), *self._said.mentioned()]
            again = [i for i in found if any(i in each for each in mentioned)]
            alone = [each for each in mentioned if len(each) == 1 and each[0] in found]
            if len(again) == 1:
                return again  # "put the red mug on the plate, then turn to the mug"
            if phrase.demonstrative and alone:
                return list(alone[-1])
            if phrase.demonstrative and (told := self._told.one(found)):
                return told
        if phrase.definite:
            if len({self._there.description(i) for i in found}) == 1:
                return found[:wanted]  # they cannot be told apart in words: any will do
            raise Doubt(phrase.text, found, count=wanted)
        fresh = [i for i in found if i not in self._said.named()]
        if phrase.number_alone and len(fresh) != wanted:
            raise Doubt(phrase.text, found, count=wanted)
        return (fresh if len(fresh) >= wanted else found)[:wanted]


def _compares_two(phrase: Phrase) -> bool:
    """Tell whether a phrase without a noun is the "taller one" of two."""
    alone = not phrase.noun and not phrase.plural and phrase.among is None and len(phrase.tests) == 1
    return alone and phrase.rank is None and phrase.tests[0][0].kind == "size" and phrase.tests[0][0].value > 0


def _of_several(phrase: Phrase, group: PhraseGroup, alone: bool) -> Phrase:
    """Return the phrase with the number that its place in the goal asks for: a tower is not made of one can."""
    placed = phrase.rank is not None or any(each[0].kind in ("place", "nearest", "stands") for each in phrase.tests)
    if phrase.open:
        one = group.role in ("reference", "around") or (group.role != "structure" and placed)
        return phrase if one else replace(phrase, plural=True)
    plain = all(each[0].kind == "colour" and not each[0].negated for each in phrase.tests)
    free = phrase.every and not phrase.definite and phrase.plural is not True and plain
    if group.role not in ("structure", "kept") and free:
        return replace(phrase, every=False, count=1)  # "any red mug" goes on the plate: one
    if group.role not in ("structure", "kept") or placed or phrase.other or phrase.kind != "objects":
        return phrase
    whole = group.shaped and alone
    unsaid = phrase.plural is None and phrase.count is None and (phrase.bare or whole) and (phrase.definite or alone)
    single = whole and phrase.plural is False and phrase.count in (None, 1) and not phrase.every
    return replace(phrase, plural=True, count=None) if unsaid or single else phrase
