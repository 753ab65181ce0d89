"""Find the objects of a scene that a written goal names in the instruction's words.

A language model or the goal network writes goals with noun phrases of the instruction; they are read here like those of
the grammar's reader.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import Any

from grounding.goal_reading.noun_phrase import NounPhrase
from grounding.goal_reading.noun_phrases import NounPhraseReader
from grounding.goal_reading.phrase_references.choice_errors import Doubt, NothingFits
from grounding.goal_reading.phrase_references.goal_phrases import GoalPhrases
from grounding.goal_reading.phrase_references.phrase import PhraseGroup
from grounding.goal_reading.phrase_references.properties import PROPERTIES
from grounding.goal_reading.scene_references import ReadingError, ReadingQuestion, SceneReferences
from grounding.goal_reading.standing_rows import standing_row
from grounding.goal_reading.tokens import split
from grounding.goal_reading.use_descriptions import described_objects
from grounding.goals.goal import Goal
from grounding.goals.part_numbers import laid_around
from grounding.goals.parts import StructurePart
from grounding.references.attributes import TELLING_ADJECTIVES
from grounding.references.candidates import SelectionError
from grounding.references.phrases import ANY, Vocabulary
from grounding.spec import SpecError

_LEFT_OUT = re.compile(r"\b(?:except|but|apart|aside|without|minus|other than|besides|save|excluding|bar|not|that)\b")
# What the second resolver passes over: "the non-green mug", "the matching cups".
_PASSED_OVER = re.compile(r"\b(?:non|odd|unique|identical|matching|paired|twin)\b", re.IGNORECASE)
_OBJECT_KEYS = ("objects", "reference", "around")


class UnusableGoalError(ValueError):
    """A goal of a language model that is not used; the message says why, and follows "it"."""


class WrittenReferences:
    """The objects of a scene in place of a goal's words.

    Args:
        parts: of the goal, as JSON values, with words of the instruction for objects and lengths in metres.
        find: what is there.
        nouns: the words for what is there.
        kept: words for objects that are to stay as they are, or that are left out of the structures.
        text: the instruction; "blue" may be a cup by its other words.
        known: phrases whose objects are known, as those of the goal that a correction speaks of.
    """

    def __init__(
        self,
        parts: Sequence[dict[str, Any]],
        find: SceneReferences,
        nouns: Vocabulary,
        kept: Sequence[str] = (),
        text: str = "",
        known: Mapping[str, tuple[int, ...]] = MappingProxyType({}),
    ) -> None:
        self.parts, self.find, self.nouns, self.kept, self.text = parts, find, nouns, kept, text
        self.known = known

    def goal(self) -> Goal:
        """Return the goal.

        Raises:
            UnusableGoalError: for words that are no noun phrase, objects that are not there, and parts that are not
                legal.
            ReadingQuestion: for words that several objects fit.
        """
        try:
            *found, kept = self._found()
            goal = Goal.from_dict({"parts": [self._usual(values) for values in self._less(found, kept)]})
        except ReadingQuestion:
            raise
        except (ReadingError, SelectionError, SpecError) as error:
            raise UnusableGoalError(f"cannot be used: {error}") from error
        return laid_around(Goal(tuple(self._written_out(part) for part in goal.parts)))

    def _found(self) -> list[Any]:
        """Put objects in the place of words: each part, and the list of what is kept at last."""
        groups, places = list[PhraseGroup](), list[tuple[int, str]]()
        for number, part in enumerate(self.parts):
            structure = part["kind"] == "structure"
            for key in _OBJECT_KEYS:
                if isinstance(part.get(key), (list, tuple)):
                    role = "structure" if structure and key == "objects" else key
                    groups.append(PhraseGroup(tuple(part[key]), role, structure and part.get("shape") is not None, number))
                    places.append((number, key))
        named = len(groups)
        groups += [PhraseGroup((text,), "kept") for text in self.kept]
        objects = self._with_known(groups)
        parts = [dict(part) for part in self.parts]
        for (number, key), each in zip(places, objects, strict=False):
            if isinstance(each, Exception):
                raise each
            parts[number][key] = each
        kept: list[Any] = []
        for each in objects[named:]:
            if isinstance(each, Exception):
                raise each
            kept += [one for one in each or () if one not in kept]
        return [*(self._apart(part) for part in parts), kept]

    def _with_known(self, groups: Sequence[PhraseGroup]) -> list[list[Any] | None | Exception]:
        """Find the objects of all phrases, of which some are known."""
        if not self.known:
            return self.objects(groups)
        unknown = [replace(group, texts=tuple(t for t in group.texts if t not in self.known)) for group in groups]
        read = iter(self.objects([group for group in unknown if group.texts]))
        found: list[list[Any] | None | Exception] = []
        for group, other in zip(groups, unknown, strict=True):
            more = next(read) if other.texts else []
            if isinstance(more, list):
                own = [index for text in group.texts for index in self.known.get(text, ())]
                more = list(dict.fromkeys((*own, *more)))
            found.append(more)
        return found

    def objects(self, groups: Sequence[PhraseGroup]) -> list[list[Any] | None | Exception]:
        """Find the objects of all phrases of a goal.

        Args:
            groups: the phrases of each place for objects.

        Returns:
            For each group its objects, `None` for all that no other part names, or the error that says what is in the
            way: `ReadingQuestion`, `ReadingError` or `UnusableGoalError`.
        """
        known = self.find.count is not None and not self.find.catalogue
        read = (
            GoalPhrases(self.find, self.nouns, self.text).resolve(groups) if known else [NothingFits("")] * len(groups)
        )
        found: list[list[Any] | None | Exception] = []
        for group, each in zip(groups, read, strict=True):
            if isinstance(each, Doubt):
                found.append(self._described(group.texts) or self.find.doubt(" and ".join(group.texts), each.found))
            elif not isinstance(each, NothingFits):
                found.append(each)
            else:
                try:
                    found.append(self._objects(group.texts))
                except (ReadingError, SelectionError, UnusableGoalError) as error:
                    found.append(self._described(group.texts) or error)
        return found

    def _described(self, texts: Sequence[str]) -> list[Any] | ReadingQuestion | None:
        """Find the objects of phrases of which one or more describe a use, or name a row that stands; `None` where none
        does, or another phrase means nothing.
        """
        try:
            described = [standing_row(text, self.find) or described_objects(text, self.find) for text in texts]
            if not any(described):
                return None
            each = [special or self._objects((text,)) for text, special in zip(texts, described, strict=True)]
        except ReadingQuestion as doubt:
            return doubt
        except (ReadingError, SelectionError, UnusableGoalError):
            return None
        return None if None in each else list(dict.fromkeys(one for objects in each for one in objects or ()))

    def _apart(self, part: dict[str, Any]) -> dict[str, Any]:
        """Leave the reference of a relation out of its objects: "the box gets everything" but itself."""
        objects, reference = part.get("objects"), part.get("reference")
        if not isinstance(objects, list) or not isinstance(reference, list):
            return part
        return part | {"objects": [one for one in objects if one not in reference] or objects}

    def _less(self, parts: Sequence[dict[str, Any]], kept: Sequence[Any]) -> list[dict[str, Any]]:
        """Leave out of the parts what is to stay as it is."""
        if not kept:
            return list(parts)
        named = {one for part in parts for key in _OBJECT_KEYS if isinstance(part.get(key), list) for one in part[key]}
        found = []
        for part in parts:
            objects = part["objects"]
            if objects is None and self.find.count is not None:
                objects = [one for one in range(self.find.count) if one not in kept and one not in named]
            elif isinstance(objects, list):
                objects = [one for one in objects if one not in kept]
            if objects == []:
                raise UnusableGoalError("leaves alone all the objects that it moves")
            found.append(part | {"objects": objects})
        return found

    def _objects(self, phrases: Sequence[str]) -> list[Any] | None:
        found: list[Any] = []
        for text in phrases:
            if _PASSED_OVER.search(text):
                raise UnusableGoalError(f"has {text!r} for objects, which is not understood")
            for phrase in self._phrases(text):
                if phrase.kind in ("all", "rest") and phrase.mention is not None and phrase.mention.noun != ANY:
                    raise UnusableGoalError(f"does not say which {text!r} are")
                if phrase.kind in ("all", "rest"):
                    left_out = [one for each in phrase.without for one in self.find.find(each)]
                    if len(phrases) > 1:
                        raise UnusableGoalError(f"has {text!r} among other objects")
                    if words := _choosing(text):
                        raise UnusableGoalError(f"does not say which objects are {words[0]!r}")
                    if not left_out:
                        return None
                    if self.find.count is None:
                        return [text]
                    return [one for one in range(self.find.count) if one not in left_out]
                if phrase.kind != "objects":
                    raise UnusableGoalError(f"does not say what {text!r} means")
                found += [one for one in self.find.find(phrase) if one not in found]
        return found

    def _phrases(self, text: str) -> list[NounPhrase]:
        """Read the noun phrases of some words: "the mug and the bowl" are two."""
        said = split(text)
        reader = NounPhraseReader(said, self.nouns)
        place, found = 0, []
        while place < len(said.words):
            if found and said.word(place) in ("and", ","):
                place += 1
                continue
            phrase = reader.at(place)
            if phrase is None or phrase.end <= place:
                raise UnusableGoalError(f"has {text!r} for objects, which is no noun phrase")
            if said.word(phrase.end) in ("except", "but"):
                phrase, end = self._without(reader, phrase)
            else:
                end = phrase.end
            found.append(phrase)
            place = end
        return found

    def _without(self, reader: NounPhraseReader, phrase: NounPhrase) -> tuple[NounPhrase, int]:
        place = phrase.end + 1
        place += reader.said.word(place) == "for"
        without = []
        while (other := reader.at(place)) is not None and other.end > place:
            without.append(other)
            place = other.end
            place += reader.said.word(place) in ("and", ",")
        return replace(phrase, without=tuple(without)), place

    def _usual(self, part: dict[str, Any]) -> dict[str, Any]:
        """Spell a place on the table in the usual way: one object is "at" it, several are a shapeless structure."""
        objects = part.get("objects")
        places = {key: part.get(key) for key in ("x_position", "y_position")}
        if part["kind"] == "relation" and part["relation"] == "at" and isinstance(objects, list) and len(objects) > 1:
            return {"kind": "structure", "objects": objects} | places
        if (
            part["kind"] == "structure"
            and part.get("shape") is None
            and isinstance(objects, list)
            and len(objects) == 1
        ):
            if any(places.values()) and isinstance(objects[0], int):
                return {"kind": "relation", "relation": "at", "objects": objects} | places
        return part

    def _written_out(self, part: Any) -> Any:
        if isinstance(part, StructurePart) and part.objects is not None and not part.objects:
            raise UnusableGoalError(f"leaves no object for the {part.shape or 'structure'}")
        return part


def _choosing(text: str) -> list[str]:
    """Return the adjectives by which "everything edible" is not everything; what it leaves out may have some."""
    words = re.findall(r"[a-z]+", _LEFT_OUT.split(text.lower(), maxsplit=1)[0])
    return [word for word in words if word in TELLING_ADJECTIVES or word in PROPERTIES]
