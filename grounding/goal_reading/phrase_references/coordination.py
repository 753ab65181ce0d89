"""Give bare adjectives of a list the noun of the phrase that they share: "the red + blue + green blocks"."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from grounding.goal_reading.phrase_references.determiners import OWNERS
from grounding.goal_reading.phrase_references.phrase import Phrase


def coordinated(phrases: Sequence[Phrase], takes: Callable[[Phrase, Phrase], bool]) -> list[Phrase]:
    """Give the phrases of one list the nouns that they leave out.

    Args:
        phrases: as they follow each other.
        takes: tells whether there is something of the second phrase's noun that the first can mean.
    """
    found = list(phrases)
    for n in range(len(found) - 1, -1, -1):
        if found[n].bare and found[n].kind == "objects":
            following = next((each for each in found[n + 1 :] if not each.bare and each.kind == "objects"), None)
            model = following or next((each for each in reversed(found[:n]) if each.noun), None)
            if model is not None and takes(found[n], model):
                found[n] = _like(found[n], model)
    every = False
    for n, phrase in enumerate(found):
        if every and phrase.noun and not phrase.plural and phrase.count is None and not phrase.tests:
            found[n] = replace(phrase, every=True, plural=True)  # "every cup + can"
        every = every or phrase.every
    return found


def _like(phrase: Phrase, model: Phrase) -> Phrase:
    """Give a bare phrase the noun of another one, and its colours where it names none."""
    plural, own = phrase.plural, model.text.split()[0] in OWNERS and phrase.text.split()[0] not in OWNERS
    if plural is None and phrase.count is None:
        plural = True if model.plural else None if own else False  # "yellow, green and the orange block"
    coloured = any(each[0].kind == "colour" for each in phrase.tests)
    colours = () if coloured else tuple(each for each in model.tests if each[0].kind == "colour")
    return replace(
        phrase,
        noun=model.noun,
        bare=plural is None and phrase.count is None,
        borrowed=model.borrowed,
        plural=plural,
        tests=(*phrase.tests, *colours),
    )
