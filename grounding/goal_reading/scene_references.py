"""Find the objects of a scene that noun phrases mean: by noun, colour, size, number, place and neighbours."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from grounding.goal_reading.noun_phrase import NounPhrase
from grounding.parse_result import OBJECT, Question
from grounding.references.attributes import SUPERLATIVES, SceneObject
from grounding.references.candidates import Candidates
from grounding.references.phrases import ANY, Mention

_NAMES = {"left": "left", "right": "right", "near": "front", "far": "back", "middle": "middle"}
_NEAR = 0.08  # m, clear gap up to which something is next to something else (evaluation protocol, part two)


class ReadingError(ValueError):
    """An instruction that cannot be read into a goal; the message says why."""


class ReadingQuestion(ReadingError):
    """An instruction with a doubt; `question` is what must be known."""

    def __init__(self, question: Question) -> None:
        self.question = question
        super().__init__(question.text)


class SceneReferences:
    """The meaning of noun phrases in one scene, or without one.

    Args:
        objects: what is there; `None` where no scene is known: then the words stand for the objects.
        encoder: finds what a noun means that neither the tables nor the names know.
        catalogue: whether they are a library that a scene can be drawn from: any of several may be meant then.
        opposite: whether the speaker sits across the table.
    """

    def __init__(self, objects: Sequence[SceneObject] | None, encoder: object, catalogue: bool, opposite: bool) -> None:
        self.objects, self.catalogue = objects, catalogue
        self._sign = -1 if opposite else 1
        self.candidates = Candidates(objects, encoder, catalogue) if objects is not None else None
        self.described = False
        self.notes: list[str] = []
        self.nouns: list[str] = []
        self._chosen: dict[str, tuple[int, ...]] = {}
        self._nouns: list[Mention] = []  # that were said, the last one last, for "the blue one"

    @property
    def count(self) -> int | None:
        """Return how many objects are there; `None` where no scene is known."""
        return None if self.objects is None else len(self.objects)

    def find(self, phrase: NounPhrase) -> tuple[int, ...] | tuple[str, ...]:
        """Find the objects that a phrase with a noun means.

        Raises:
            ReadingError: where none or too few fit, with what is there.
            ReadingQuestion: where several fit a phrase that speaks of one.
        """
        if phrase.kind not in ("objects", "rest") or phrase.mention is None:
            raise ReadingError(f"it is not clear which objects {phrase.text!r} means here; name them")
        if self.objects is None:
            return (_words(phrase),)
        found = self.fitting(phrase)
        mention = phrase.mention
        assert mention is not None
        too_few = mention.exact and mention.count is not None and len(found) < mention.count and not self.catalogue
        if not found or too_few:
            raise ReadingError(self._missing(phrase))
        for without in phrase.without:
            out = set(self.find(without))
            found = [i for i in found if i not in out]
        return tuple(self._counted(phrase, found))

    def fitting(self, phrase: NounPhrase) -> list[int]:
        """List the objects that a phrase fits, however many it speaks of; the best first where it compares them."""
        assert self.candidates is not None and phrase.mention is not None
        mention = phrase.mention
        found = self._of_noun(phrase, mention)
        self._remember(phrase, mention)
        if self.candidates.judged(mention):
            self.described = True
        if mention.noun != ANY or self.candidates.judged(mention):
            self.nouns.append(self.candidates.label(mention))
        self.notes += self.candidates.notes([mention])
        if phrase.landmark is not None and not self.catalogue:
            found = self._beside(phrase, found)
        if (phrase.side is not None or phrase.ordinal is not None) and not self.catalogue:
            found = self._placed(phrase, found)
        return found

    def ambiguous(self, phrase: NounPhrase) -> bool:
        """Tell whether a phrase for one object fits several, as far as its noun and adjectives say."""
        said = phrase.mention
        if phrase.kind != "objects" or said is None or said.plural or not said.known or phrase.side or phrase.landmark:
            return False
        if self.candidates is None or self.catalogue:
            return phrase.borrowed and not said.modifiers
        return not self.candidates.superlative(said) and len(self._of_noun(phrase, said)) > 1

    def _remember(self, phrase: NounPhrase, mention: Mention) -> None:
        if not phrase.borrowed and mention.noun != ANY:
            self._nouns.append(mention)

    def _of_noun(self, phrase: NounPhrase, mention: Mention) -> list[int]:
        """Find the objects of the noun and its adjectives; "the blue one" has the last noun of which there are several."""
        assert self.candidates is not None
        several: list[int] = []
        for noun in reversed(self._nouns) if phrase.borrowed else ():
            borrowed = replace(mention, noun=noun.noun, known=noun.known)
            kinds = self.candidates.kinds_of(borrowed)
            found = self.candidates.matching(borrowed)
            if found and len(kinds) > 1:
                return found
            several = several or found
        return several or self.candidates.matching(mention)

    def rest(self, phrase: NounPhrase, taken: set[int]) -> tuple[int, ...] | None:
        """Find what "the other three" means: those of the last noun that are left, or else all that is left.

        Args:
            phrase: with the number of objects that it speaks of.
            taken: objects of other parts.

        Raises:
            ReadingError: where another number is left.
        """
        if self.objects is None or phrase.left is None or self.catalogue:
            return None
        left = [i for i in range(len(self.objects)) if i not in taken]
        for noun in reversed(self._nouns):
            same = [i for i in self.candidates.kinds_of(replace(noun, count=None)) if i in left]
            if len(same) == phrase.left:
                return tuple(same)
        if len(left) != phrase.left:
            raise ReadingError(
                f"{phrase.text!r} speaks of {phrase.left} objects, and {len(left)} are left: {'; '.join(self._descriptions(left)) or 'none'}"
            )
        return tuple(left)

    # Places

    def position(self, index: int) -> tuple[float, float]:
        """Return where an object stands, (away, to the left) as the speaker sees it, metres.

        Raises:
            ReadingError: where that is not known.
        """
        attributes = self.objects[index].attributes
        if attributes is None or attributes.position is None:
            raise ReadingError("it is not known where the objects stand, so that none can be chosen by its place")
        x, y = attributes.position
        return self._sign * x, self._sign * y

    def _placed(self, phrase: NounPhrase, found: list[int]) -> list[int]:
        side, mention = phrase.side, phrase.mention
        if len(found) < 2 or mention is None:
            return found
        if side is None:  # "the second block": as they are numbered
            place = phrase.ordinal or 1
            return found[-1:] if place < 0 else found[place - 1 : place]
        if any(word in SUPERLATIVES for word in mention.modifiers):
            return found
        if side == "middle":
            middle = sorted(found, key=lambda i: self.position(i)[1])
            return (
                [middle[len(middle) // 2]] if len(middle) % 2 else middle[len(middle) // 2 - 1 : len(middle) // 2 + 1]
            )
        order = sorted(found, key=lambda i: self._along(side, i))
        if phrase.ordinal is not None:
            return order[-1:] if phrase.ordinal < 0 else order[phrase.ordinal - 1 : phrase.ordinal]
        if not mention.plural or (mention.count or 0) > 0:
            return order[: mention.count or 1]
        steps = [self._along(side, b) - self._along(side, a) for a, b in zip(order, order[1:], strict=False)]
        widest = max(range(len(steps)), key=steps.__getitem__)
        return sorted(order[: widest + 1])

    def _along(self, side: str, index: int) -> float:
        away, left = self.position(index)
        away_from_robot = self._sign * away
        return {
            "left": -left, "right": left, "near": away, "far": -away, "robot near": away_from_robot, "robot far": -away_from_robot,
        }[side]  # fmt: skip

    def _beside(self, phrase: NounPhrase, found: list[int]) -> list[int]:
        landmark = self.find(phrase.landmark)
        others = [i for i in found if i not in landmark]
        if phrase.relation in ("nearest", "farthest"):
            sign = 1 if phrase.relation == "nearest" else -1
            others.sort(key=lambda i: sign * min(math.dist(self.position(i), self.position(j)) for j in landmark))
            count = phrase.mention.count or 1
            return others if phrase.mention.plural and phrase.mention.count is None else others[:count]
        kept = [i for i in others if all(self._stands(i, phrase.relation, j) for j in landmark)]
        kept = kept or [i for i in others if all(self._stands(i, phrase.relation, j, least=0.2) for j in landmark)]
        if len(kept) > 1 and phrase.mention is not None and not phrase.mention.plural:
            kept.sort(key=lambda i: math.dist(self.position(i), self.position(landmark[0])))
            if phrase.relation in ("next to",):
                return kept[:1]
        return kept

    def _stands(self, index: int, relation: str | None, landmark: int, least: float = 1.0) -> bool:
        (x, y), (to_x, to_y) = self.position(index), self.position(landmark)
        away, left = x - to_x, y - to_y
        if relation == "next to":
            return True
        if relation in ("on", "in"):
            size = self.objects[landmark].attributes.size
            return size is not None and math.hypot(away, left) < max(size[:2]) / 2
        along = {"left of": left, "right of": -left, "behind": away, "in front of": -away}.get(relation or "")
        across = away if relation in ("left of", "right of") else left
        return along is not None and along > 0 and along >= least * abs(across)

    # Numbers

    def _counted(self, phrase: NounPhrase, found: list[int]) -> list[int]:
        mention = phrase.mention
        if mention.count is None:
            return sorted(found)
        if mention.count < 0:
            return found[: len(found) + mention.count]
        compared = phrase.side is not None or any(word in SUPERLATIVES for word in mention.modifiers)
        if self.catalogue:
            return self._of_library(phrase, found)
        if len(found) <= mention.count or (not mention.definite and mention.exact):
            return found[: mention.count]
        if not mention.definite and _indefinite(phrase):
            return found[: mention.count]
        if compared and not self.candidates.superlative(mention):
            return found[: mention.count]
        if words := self.candidates.unjudged(mention):
            raise ReadingError(
                f"it is not known which of the objects here are {words[0]!r}, so that {phrase.text!r} can be each of: "
                + "; ".join(self._descriptions(found))
            )
        raise ReadingQuestion(self._question(phrase, found))

    def _of_library(self, phrase: NounPhrase, found: list[int]) -> list[int]:
        """Choose objects of a library, others for other words: "the mug next to the red mug" are two."""
        words = _words(phrase).lower()
        if words not in self._chosen:
            fresh = [i for i in found if not any(i in taken for taken in self._chosen.values())]
            self._chosen[words] = tuple((fresh or found)[: phrase.mention.count])
        return list(self._chosen[words])

    def _question(self, phrase: NounPhrase, found: list[int]) -> Question:
        listed = self._descriptions(found)
        text = f"{phrase.text!r} can be each of {len(found)} objects: {'; '.join(listed)}; which one?"
        return Question(OBJECT, text, tuple(self.candidates.names[i] for i in found))

    def _descriptions(self, found: Sequence[int]) -> list[str]:
        return [self.candidates.description(i) for i in found]

    def _missing(self, phrase: NounPhrase) -> str:
        kinds = [] if self.catalogue else self._of_noun(phrase, phrase.mention)
        if kinds and (phrase.landmark is not None or phrase.ordinal is not None):
            return f"nothing here is {phrase.text!r}; of that kind there is: {'; '.join(self._descriptions(kinds))}"
        return self.candidates.missing(phrase.mention, "names")


def _indefinite(phrase: NounPhrase) -> bool:
    first = phrase.text.lower().split()[:3]
    return bool(first) and (first[0] in ("a", "an", "any", "some", "another") or first[:2] == ["one", "of"])


def _words(phrase: NounPhrase) -> str:
    words = phrase.text.split()
    while len(words) > 1 and words[0].lower() in ("the", "a", "an", "my", "all", "your", "our"):
        words = words[1:]
    return " ".join(words)
