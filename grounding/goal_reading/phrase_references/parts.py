"""Read of what the objects of a copied phrase are made and what they have: "with a handle", "made of tin"."""

from __future__ import annotations

from grounding.goal_reading.phrase_references.adjectives import IDLE, colours_of
from grounding.goal_reading.phrase_references.draft import Draft
from grounding.goal_reading.phrase_references.phrase import Test
from grounding.goal_reading.phrase_references.phrase_text import PhraseReader
from grounding.goal_reading.phrase_references.properties import property_of

_HAVING = frozenset("with having has have bearing share shares".split())
_BEFORE = IDLE | frozenset("a an the its some two four any long little big sharp curved".split())
_GRAINS = ("corn", "wheat", "oat", "bran")
_PAINTED = frozenset("handle handles colour grip cap lid label coat".split())


def part_after(parser: PhraseReader, draft: Draft, at: int) -> int | None:
    """Read a material or a part into a draft; return the place after it, or `None` where none stands."""
    if parser.word(at) == "made" and parser.word(at + 1) in ("of", "from", "out"):
        place = at + 2 + (parser.word(at + 2) == "of")
        if parser.text.nouns.filling(parser.word(place)):
            draft.test(Test("word", parser.word(place)))
            return place + 1
        if property_of(parser.word(place)) is None:
            return None
        draft.test(Test("property", parser.word(place)))
        return place + 1
    at += parser.word(at) in ("that", "which") and parser.word(at + 1) in _HAVING
    if parser.word(at) not in _HAVING:
        return None
    place = at + 1
    colour = ""
    while parser.word(place) in _BEFORE or colours_of(parser.word(place)) is not None:
        colour = parser.word(place) if colours_of(parser.word(place)) is not None else colour
        place += 1
    part, following = parser.word(place), parser.word(place + 1)
    if part in ("colour", "colours") and colours_of(following) is not None:
        draft.test(Test("colour", following))
        return place + 2
    if colour and part in _PAINTED:
        draft.test(Test("colour", colour))
        return place + 1
    place += part in _GRAINS and following == "flakes"
    if parser.text.nouns.filling(parser.word(place)):  # "the carton with the milk"
        draft.test(Test("word", parser.word(place)))
        return place + 1 + 2 * (parser.words[place + 1 : place + 3] in (("in", "it"), ("in", "them"), ("inside", "it")))
    end = _properties(parser, draft, place)
    if end is not None and colour:
        draft.test(Test("colour", colour))  # "with the brown glass"
    return end


def _properties(parser: PhraseReader, draft: Draft, place: int) -> int | None:
    """Read "a blade or an ink tip"."""
    tests = []
    while property_of(parser.word(place)) is not None:
        tests.append(Test("property", parser.word(place)))
        place += 1 + (parser.word(place + 1) == "tip")
        article = parser.word(place + 1) in ("a", "an", "the")
        if parser.word(place) not in ("or", "and") or property_of(parser.word(place + 1 + article)) is None:
            break
        place += 1 + article
    if not tests:
        return None
    draft.test(*tests)
    return place
