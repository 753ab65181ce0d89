"""Read what is said of objects after their noun by colour, size or kind: "that are not red", "of the same colour"."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field, replace

from grounding.goal_reading.noun_phrase import NounPhrase
from grounding.goal_reading.tokens import Words
from grounding.references.attributes import COLOR_WORDS, COMPARATIVES, MEASURES, SUPERLATIVES
from grounding.references.phrases import ANY, Mention

_IS = r"(?:is|are|was|were|looks?|happens? to be)"
_LINK = re.compile(
    rf"(?:,? ?(?:that's|which's|who's)|,? ?(?:that|which|who) {_IS})(?: (?:either|coloured|colour))?(?= )"
)
_NEGATED = re.compile(
    r"(?:,? ?(?:that|which|who) (?:isn't|aren't|is not|are not|ain't|is no|are no|wasn't|weren't|don't look|are neither|is neither)"
    r"|,? ?that's (?:not|neither|no))(?= )"
)
_WHATEVER = re.compile(rf"{_IS}(?= )")
_WHATEVER_NOT = re.compile(r"(?:isn't|aren't|is not|are not|is neither|are neither)(?= )")
_NOT = re.compile(r"(?:not|neither)(?= )")
_ALIKE = re.compile(
    r"(?:of|with|in|having|that has|which has|that have) (?:the |exactly the )?same colour(?: as)?"
    r"|(?:that is|which is|that's|that has) the same colour(?: as)?|(?:matching|same) colour(?: as)?"
)
_COMPARED = re.compile(r"(?:,? ?(?:that|which) (?:is|are) |,? ?that's )?(?P<how>[a-z]+er) than(?= )")
_GOES = frozenset("goes gets go should must is in on at to stays moves comes".split())
_JOINTS = frozenset((",", "and", "or", "nor", "&"))


@dataclass
class _Said:
    """What a clause says: adjectives, and noun phrases for kinds, with the words that join them."""

    end: int
    adjectives: list[str] = field(default_factory=list)
    kinds: list[NounPhrase] = field(default_factory=list)
    joints: set[str] = field(default_factory=set)


def with_attributes(
    said: Words, phrase: NounPhrase, phrase_at: Callable[[int], NounPhrase | None], whatever: bool = False
) -> NounPhrase:
    """Add the clause of attributes that follows a noun phrase; the phrase itself where none does.

    Args:
        said: the words.
        phrase: for objects, or for everything.
        phrase_at: reads the noun phrase that begins at a place.
        whatever: whether the clause begins without "that": "whatever is red".
    """
    if (alike := said.match(_ALIKE, phrase.end)) and (not phrase.many or alike[0].group().endswith(" as")):
        return _alike(said, phrase, alike[0].group(), alike[1], phrase_at)
    if (compared := said.match(_COMPARED, phrase.end)) and (word := COMPARATIVES.get(compared[0].group("how"))):
        other = phrase_at(compared[1])
        if other is not None and other.kind == "objects":
            return _ended(said, replace(_described(said, phrase), relation=f"{word} than", landmark=other), other.end)
    bare = phrase.kind == "all" or (phrase.mention is not None and phrase.mention.noun == ANY and not phrase.borrowed)
    negated = said.match(_WHATEVER_NOT if whatever else _NEGATED, phrase.end) or (
        said.match(_NOT, phrase.end) if bare else None
    )
    if negated:
        listed = _listed(said, negated[1], phrase_at)
        if listed is None and phrase.kind == "all" and said.word(negated[1]) in _GOES:
            return replace(_ended(said, phrase, negated[1]), kind="rest")  # "... and everything that isn't goes there"
        if listed is None:
            return phrase
        out = [*(those_of(phrase, said, word) for word in listed.adjectives), *map(_any_of, listed.kinds)]
        return _ended(said, replace(_described(said, phrase), without=(*phrase.without, *out)), listed.end)
    link = said.match(_WHATEVER if whatever else _LINK, phrase.end)
    if not (link or (phrase.kind == "all" and _judged(said.word(phrase.end)))):
        return phrase
    listed = _listed(said, link[1] if link else phrase.end, phrase_at)
    if listed is None or listed.kinds:
        return phrase
    return _ended(said, _with_adjectives(_described(said, phrase), listed), listed.end)


def _alike(
    said: Words, phrase: NounPhrase, words: str, end: int, phrase_at: Callable[[int], NounPhrase | None]
) -> NounPhrase:
    other = phrase_at(end) if words.endswith(" as") else None
    if words.endswith(" as") and (other is None or other.kind not in ("objects", "pronoun")):
        return phrase
    named = other if other is not None and other.kind == "objects" else None
    after = other.end if other is not None else end
    return _ended(said, replace(_described(said, phrase), alike="colour", landmark=named), after)


def _listed(said: Words, at: int, phrase_at: Callable[[int], NounPhrase | None]) -> _Said | None:
    """Read adjectives or nouns that are joined by "or", "nor" and "and"; `None` where none stands here."""
    found = _Said(at)
    while True:
        place = found.end
        joint = []
        while said.word(place) in _JOINTS and (found.adjectives or found.kinds):
            joint.append(said.word(place))
            place += 1
        place += said.word(place) in ("a", "an", "the") and _judged(said.word(place + 1))
        kind = phrase_at(place) if not _judged(said.word(place)) else None
        if _judged(said.word(place)) and not _noun_follows(said, place + 1, phrase_at):
            found.adjectives.append(said.word(place))
            found.end = place + 1 + (said.word(place + 1) in ("one", "ones"))
        elif kind is not None and kind.kind == "objects" and not found.adjectives and (joint or not found.kinds):
            found.kinds.append(kind)
            found.end = kind.end
        else:
            return found if found.adjectives or found.kinds else None
        found.joints.update(joint)
        if said.word(found.end) not in _JOINTS:
            return found


def _noun_follows(said: Words, at: int, phrase_at: Callable[[int], NounPhrase | None]) -> bool:
    """Return whether the adjective before this place belongs to a noun: "red cups"."""
    following = phrase_at(at)
    return following is not None and following.kind == "objects" and said.word(at) not in ("one", "ones")


def _judged(word: str) -> bool:
    """Return whether a scene knows which objects an adjective fits; what it cannot judge must not be passed over."""
    return word in COLOR_WORDS or word in SUPERLATIVES or word in MEASURES


def _described(said: Words, phrase: NounPhrase) -> NounPhrase:
    """Return a phrase of objects: "everything" becomes objects of any kind."""
    if phrase.mention is not None:
        return phrase
    span = (said.spans[phrase.first][0], said.spans[phrase.end - 1][1])
    return replace(phrase, kind="objects", mention=Mention(ANY, (), None, False, "target", True, True, (), None, span))


def _with_adjectives(phrase: NounPhrase, listed: _Said) -> NounPhrase:
    """Add adjectives: "red or blue" are alternatives, "tall and red" are both meant."""
    mention, words = phrase.mention, listed.adjectives
    assert mention is not None  # the caller has seen to it
    of_one_class = all(word in COLOR_WORDS for word in words) or "or" in listed.joints
    if not of_one_class or len(words) == 1:
        return replace(phrase, mention=replace(mention, modifiers=(*mention.modifiers, *words)))
    each = [replace(mention, modifiers=(*mention.modifiers, word)) for word in words]
    return replace(phrase, mention=each[0], either=tuple(each[1:]))


def those_of(phrase: NounPhrase, said: Words, word: str) -> NounPhrase:
    """Return the phrase for those of a phrase's objects that an adjective fits."""
    mention = _described(said, phrase).mention
    assert mention is not None  # of objects
    some = replace(mention, modifiers=(*mention.modifiers, word), count=None, exact=False, plural=True)
    return replace(phrase, kind="objects", text=word, mention=some, without=(), either=())


def _any_of(kind: NounPhrase) -> NounPhrase:
    """Return the phrase for all objects of a kind: "not a cup" leaves out every cup."""
    assert kind.mention is not None  # of objects
    return replace(kind, mention=replace(kind.mention, count=None, exact=False, plural=True))


def _ended(said: Words, phrase: NounPhrase, end: int) -> NounPhrase:
    return replace(phrase, end=end, text=said.quote(phrase.first, end))
