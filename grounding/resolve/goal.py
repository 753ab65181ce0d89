"""Put the objects of a scene in the place of the words of a written goal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from grounding.goals.goal import Goal
from grounding.goals.part_numbers import laid_around
from grounding.goals.parts import GoalError
from grounding.goals.taken_objects import owned_once
from grounding.parse_result import OBJECT, Question
from grounding.resolve.catalogue import CataloguePhrases
from grounding.resolve.errors import Doubt, ResolveError, UnclearObjectsError
from grounding.resolve.goal_phrases import GoalPhrases
from grounding.resolve.phrase import Phrase, PhraseGroup
from grounding.resolve.referents import Referents
from grounding.resolve.words import WordPhrases
from grounding.spec import SpecError

_OBJECT_KEYS = ("objects", "reference", "around")
_UNTOLD = ("colour", "size", "place", "more", "measure")  # tests by which a scene tells objects of a kind apart
NO_OBJECTS: Mapping[str, tuple[int, ...]] = MappingProxyType({})


@dataclass(frozen=True)
class ResolvedGoal:
    """A goal with the objects that its words mean.

    Attributes:
        goal: its objects are indices, or words where nothing is known.
        nouns: that chose the objects, singular.
        described: whether more than nouns chose them.
        notes: remarks on the choice, a sentence each.
        singly: whether each phrase speaks of one object.
    """

    goal: Goal
    nouns: tuple[str, ...] = ()
    described: bool = False
    notes: tuple[str, ...] = ()
    singly: bool = False


@dataclass(frozen=True)
class ResolvedPhrase:
    """The objects that words mean; the attributes are those of `ResolvedGoal`.

    Attributes:
        indices: of the objects, in the order of the words.
    """

    indices: tuple[int, ...]
    nouns: tuple[str, ...] = ()
    described: bool = False
    notes: tuple[str, ...] = ()
    singly: bool = False


def resolve_goal(
    parts: Sequence[Mapping[str, Any]],
    there: Referents,
    text: str = "",
    kept: Sequence[str] = (),
    known: Mapping[str, tuple[int, ...]] = NO_OBJECTS,
    before: Goal = Goal(),
) -> ResolvedGoal:
    """Find the objects of a written goal.

    In a library every object of a noun may be meant by a plural, and any of them by a singular. Where nothing is known,
    the words stay.

    Args:
        parts: of the goal, as JSON values, with words of the instruction for objects and lengths in metres.
        there: what is there.
        text: the instruction; "blue" may be a cup by its other words.
        kept: words for objects that are to stay as they are, or that are left out of the structures.
        known: phrases whose objects are known, as those of the goal that a correction speaks of.
        before: that goal.

    Raises:
        UnclearObjectsError: for words that several objects fit.
        ResolveError: for words that nothing here fits, or that are not understood, and for parts that are not legal.
    """
    groups, places = list[PhraseGroup](), list[tuple[int, str]]()
    for number, part in enumerate(parts):
        structure = part["kind"] == "structure"
        for key in _OBJECT_KEYS:
            if isinstance(part.get(key), (list, tuple)):
                role = "structure" if structure and key == "objects" else key
                groups.append(PhraseGroup(tuple(part[key]), role, structure and part.get("shape") is not None, number))
                places.append((number, key))
    named = len(groups)
    reader = _reader(there, text, known)
    objects = _objects(reader, there, [*groups, *(PhraseGroup((words,), "kept") for words in kept)])
    made = [dict(part) for part in parts]
    for (number, key), each in zip(places, objects, strict=False):
        made[number][key] = each
    out = [index for each in objects[named:] for index in each or ()]
    try:
        whole = [_usual(part) for part in _less([_apart(part) for part in made], out, there)]
        goal = laid_around(Goal.from_dict({"parts": owned_once(whole, before)}))
    except SpecError as error:
        said = error.spoken(there.names) if isinstance(error, GoalError) else str(error)
        raise ResolveError(said) from error
    nouns, described, notes, singly = _chosen_by(reader, there)
    return ResolvedGoal(goal, nouns, described, notes, singly and not kept)


def resolve_phrase(phrase: str, there: Referents, text: str = "") -> ResolvedPhrase:
    """Find the objects of one phrase.

    Args:
        phrase: any string.
        there: what is there.
        text: the sentence that it stands in, from which bare adjectives take their nouns.

    Raises:
        UnclearObjectsError: where several objects fit a phrase that speaks of one; its `indices` have them.
        ResolveError: where nothing here fits, or the words are not understood.
    """
    reader = _reader(there, text or phrase, NO_OBJECTS)
    (found,) = _objects(reader, there, [PhraseGroup((phrase,))])
    return ResolvedPhrase(tuple(found or ()), *_chosen_by(reader, there))


def _reader(
    there: Referents, text: str, known: Mapping[str, tuple[int, ...]]
) -> GoalPhrases | CataloguePhrases | WordPhrases:
    if not there.known:
        return WordPhrases(there)
    return CataloguePhrases(there, text) if there.catalogue else GoalPhrases(there, text, known)


def _objects(
    reader: GoalPhrases | CataloguePhrases | WordPhrases, there: Referents, groups: Sequence[PhraseGroup]
) -> list[list[Any] | None]:
    """Find the objects of all phrases, or raise what is in the way of the first."""
    found = list[list[Any] | None]()
    for each in reader.resolve(groups):
        if isinstance(each, Doubt):
            raise _question(each, there) from each
        if isinstance(each, Exception):
            raise ResolveError(f"{each}; there is only: {there.inventory()}") from each
        found.append(each)
    return found


def _question(doubt: Doubt, there: Referents) -> UnclearObjectsError:
    """Ask which of several objects is meant."""
    listed = "; ".join(map(there.description, doubt.found))
    if doubt.instead:
        text = f"there is no {doubt.instead} here; does {doubt.phrase!r} mean: {listed}?"
    elif doubt.count > 1:
        text = f"{doubt.phrase!r} means {doubt.count} of these {len(doubt.found)} objects: {listed}; which ones?"
    else:
        text = f"{doubt.phrase!r} fits {len(doubt.found)} objects: {listed}; which one?"
    question = Question(OBJECT, text, tuple(there.names[i] for i in doubt.found))
    return UnclearObjectsError(question, doubt.phrase, doubt.found, doubt.count, bool(doubt.instead))


def _chosen_by(
    reader: GoalPhrases | CataloguePhrases | WordPhrases, there: Referents
) -> tuple[tuple[str, ...], bool, tuple[str, ...], bool]:
    """Return the nouns that chose objects, whether more than nouns did, what there is to note,
    and whether each phrase is for one.
    """
    nouns = [_label(phrase, there) for phrase in reader.phrases if phrase.noun]
    described = any(_told(phrase) for phrase in reader.phrases)
    singly = bool(reader.phrases) and not any(
        one.plural or one.every or (one.count or 1) > 1 or one.kind in ("all", "rest") for one in reader.phrases
    )
    return tuple(dict.fromkeys(nouns)), described, tuple(dict.fromkeys(reader.notes)), singly


def _label(phrase: Phrase, there: Referents) -> str:
    """Return the noun of a phrase, singular, with its colours."""
    noun = phrase.noun[-1]
    colours = [each[0].word for each in phrase.tests if each[0].kind == "colour" and not each[0].negated]
    return " ".join((*colours, there.vocabulary.forms.get(noun, (noun,))[0]))


def _told(phrase: Phrase) -> bool:
    return phrase.rank is not None or any(test.kind in _UNTOLD for each in phrase.tests for test in each)


def _apart(part: dict[str, Any]) -> dict[str, Any]:
    """Leave the reference of a relation out of its objects: "the box gets everything" but itself."""
    objects, reference = part.get("objects"), part.get("reference")
    if not isinstance(objects, list) or not isinstance(reference, list):
        return part
    return part | {"objects": [one for one in objects if one not in reference] or objects}


def _less(parts: Sequence[dict[str, Any]], kept: Sequence[Any], there: Referents) -> list[dict[str, Any]]:
    """Leave out of the parts what is to stay as it is."""
    if not kept:
        return list(parts)
    named = {one for part in parts for key in _OBJECT_KEYS if isinstance(part.get(key), list) for one in part[key]}
    found = []
    for part in parts:
        objects = part["objects"]
        if objects is None and there.known:
            objects = [one for one in there.everything() if one not in kept and one not in named]
        elif isinstance(objects, list):
            objects = [one for one in objects if one not in kept]
        if objects == []:
            raise ResolveError("the instruction moves the same objects that it says to leave alone")
        found.append(part | {"objects": objects})
    return found


def _usual(part: dict[str, Any]) -> dict[str, Any]:
    """Spell a place on the table in the usual way: one object is "at" it, several are a shapeless structure."""
    objects = part.get("objects")
    several = isinstance(objects, list) and len(objects) > 1
    places = {key: part.get(key) for key in ("x_position", "y_position")}
    if part["kind"] == "relation" and part["relation"] == "at" and several:
        return {"kind": "structure", "objects": objects} | places
    alone = isinstance(objects, list) and len(objects) == 1 and isinstance(objects[0], int)
    if part["kind"] == "structure" and part.get("shape") is None and alone and any(places.values()):
        return {"kind": "relation", "relation": "at", "objects": objects} | places
    if objects == []:
        raise ResolveError(f"the instruction leaves no object for the {part.get('shape') or 'structure'}")
    return part
