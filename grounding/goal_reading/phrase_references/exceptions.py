"""Read what a copied phrase leaves out: "except the red one", "bar the cans", "but not the bowl"."""

from __future__ import annotations

import re
from dataclasses import replace

from grounding.goal_reading.phrase_references.draft import Draft
from grounding.goal_reading.phrase_references.phrase import Phrase, Rank
from grounding.goal_reading.phrase_references.phrase_text import PhraseReader

_EXCEPT = re.compile(
    r"(?:, |and )?(?:except for|except|apart from|other than|aside from|with the exception of|excluding|excepting|"
    r"barring|bar|save for|save|without|minus|but for|but not|but|and not|not including|not|besides|less)(?= )"
)


def exception_after(parser: PhraseReader, draft: Draft, at: int) -> int | None:
    """Read an exception into a draft; return the place after it, or `None` where none stands."""
    found = _EXCEPT.match(" ".join(parser.words[at:]))
    if found is None:
        return None
    place = at + len(found.group().split())
    if parser.word(place) == "one" and draft.rank is not None and parser.word(place - 1) == "but":
        draft.rank = Rank(draft.rank.by, draft.rank.place + 1)  # "the highest but one"
        return place + 1
    without: list[Phrase] = []
    while (other := parser.at(place, excepting=False)) is not None:
        any_one = found.group().rstrip().endswith("not") and not other[0].definite  # "anything not a cube"
        without.append(replace(other[0], plural=True, every=True, definite=True, count=None) if any_one else other[0])
        place = other[1]
        joint = place + 1 + (parser.word(place + 1) == "not")
        if parser.word(place) not in ("and", ",", "or", "nor") or parser.at(joint) is None:
            break
        place = joint
    if not without or not _says_which(without[0]):
        return None  # "all cups but one"
    draft.without += map(_all_of_colour, without)
    draft.plural = True if draft.plural is None else draft.plural
    return place


def _says_which(phrase: Phrase) -> bool:
    return bool(
        phrase.noun or phrase.tests or phrase.rank is not None or phrase.kind != "objects" or phrase.among is not None
    )


def _all_of_colour(phrase: Phrase) -> Phrase:
    """Return the phrase for all of a bare colour: "not red" leaves out everything that is red."""
    placed = any(each[0].kind == "place" for each in phrase.tests)
    if not phrase.bare or phrase.plural is not None or phrase.count is not None or placed:
        return phrase
    return replace(phrase, plural=True)
