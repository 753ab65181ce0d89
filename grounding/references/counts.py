"""Read how many objects a noun phrase means, and which of the numbered ones."""

from __future__ import annotations

from grounding.references.function_words import ALL_WORDS, DETERMINERS, FUNCTION_WORDS, NUMBERS, ORDINALS
from grounding.references.sentence_roles import Sentences

JOINTS = (",", "and", "&", "plus")


def numbers_after(said: Sentences, place: int) -> tuple[tuple[int, ...], int]:
    """Read the numbers of "cups 1 and 3", from this place on; return also the place after them."""
    numbers: list[int] = []
    while said.word(place).isdecimal() and len(said.word(place)) < 4:
        numbers.append(int(said.word(place)))
        place += 1
        joint = 1 + (said.word(place + 1) in JOINTS)
        if said.word(place) in JOINTS and said.word(place + joint).isdecimal():
            after = said.word(place + joint + 1)
            place += joint if after in ("", ".", ",", ";") or after in FUNCTION_WORDS else 0
    return tuple(numbers), place


def count_before(said: Sentences, start: int) -> tuple[int | None, bool, int]:
    """Read (number or None, whether it was given, place of the first word) of a phrase."""
    first, count, exact = start, None, False
    while first > 0 and start - first < 6:
        word = said.word(first - 1)
        if word.isdecimal() and 0 < int(word[:3]) < 100 and len(word) < 3:
            count, exact = int(word), True
        elif word in NUMBERS and not (word == "one" and said.word(first) in NUMBERS):
            count, exact = NUMBERS[word], NUMBERS[word] > 1 or said.word(first) == "of"
        elif word in ORDINALS and said.word(first - 2) in DETERMINERS:
            pass
        elif word == "but" and count and said.word(first - 2) in ALL_WORDS:
            count, first = -count, first - 1
        elif word == "that" and said.word(first) in DETERMINERS:
            break
        elif not (word in DETERMINERS or word in ALL_WORDS or (word == "of" and _of_number(said, first - 2))):
            break
        first -= 1
    return count, exact, first


def _of_number(said: Sentences, place: int) -> bool:
    word = said.word(place)
    return word in NUMBERS or word.isdecimal() or word in ALL_WORDS or word in ("some", "most")
