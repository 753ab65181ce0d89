"""Read lengths and counts: "10 cm", "two and a half inches", "half a metre", "a foot and a half"."""

from __future__ import annotations

from collections.abc import Mapping

from grounding.resolve.tokens import Words

UNITS: Mapping[str, float] = {
    **dict.fromkeys("mm millimeter millimeters millimetre millimetres mil mils".split(), 0.001),
    **dict.fromkeys("cm centimeter centimeters centimetre centimetres centimenter centi centis".split(), 0.01),
    **dict.fromkeys("dm decimeter decimeters decimetre decimetres".split(), 0.1),
    **dict.fromkeys("m meter meters metre metres".split(), 1.0),
    **dict.fromkeys('inch inches "'.split(), 0.0254),
    **dict.fromkeys("ft foot feet '".split(), 0.3048),
}  # fmt: skip
_ONES = "zero one two three four five six seven eight nine ten eleven twelve thirteen fourteen fifteen sixteen".split()
COUNTS: Mapping[str, int] = {
    **{word: number for number, word in enumerate(_ONES)},
    "seventeen": 17, "eighteen": 18, "nineteen": 19, "dozen": 12,
}  # fmt: skip
_TENS = {"twenty": 20, "thirty": 30, "forty": 40, "fifty": 50, "sixty": 60, "seventy": 70, "eighty": 80, "ninety": 90}
# After these "in" is a unit: "5 in apart", and not "put 3 in the bowl".
_AFTER_IN = frozenset(
    "apart away gap gaps spacing radius long wide across left right behind diameter closer nearer farther further "
    "forward forwards backward backwards toward towards".split()
)


def count_at(said: Words, place: int) -> tuple[int, int] | None:
    """Read a whole number, in digits or words, and the place after it."""
    word = said.word(place)
    if word.isdecimal():
        return int(word[:9]), place + 1
    if word in COUNTS:
        return COUNTS[word], place + 1
    if word in _TENS:
        unit = COUNTS.get(said.word(place + 1), 0)
        return (_TENS[word] + unit, place + 2) if 0 < unit < 10 else (_TENS[word], place + 1)
    return None


def number_at(said: Words, place: int) -> tuple[float, int] | None:
    """Read a number that may have a fraction, and the place after it."""
    sign = 1.0
    if said.word(place) == "minus" or said.word(place) == "negative":
        sign, place = -1.0, place + 1
    word = said.word(place)
    if word.replace(".", "", 1).replace("e", "", 1).isdecimal():
        value, end = float(word[:30]), place + 1
        if said.word(end) == "/" and said.word(end + 1).isdecimal() and int(said.word(end + 1)[:9]):
            value, end = value / int(said.word(end + 1)[:9]), end + 2
        elif said.word(end).isdecimal() and said.word(end + 1) == "/" and said.word(end + 2).isdecimal():
            value, end = value + int(said.word(end)[:9]) / max(1, int(said.word(end + 2)[:9])), end + 3
        elif said.word(end) in ("0.5", "0.25", "0.75"):
            value, end = value + float(said.word(end)), end + 1
    elif (counted := count_at(said, place)) is not None:
        value, end = float(counted[0]), counted[1]
        if said.word(end) == "hundred":
            value, end = value * 100, end + 1
        if said.word(end) == "point" and (digit := count_at(said, end + 1)) is not None and digit[0] < 10:
            value, end = value + digit[0] / 10, digit[1]
    elif word == "hundred" or (word == "a" and said.word(place + 1) == "hundred"):
        value, end = 100.0, place + 1 + (word == "a")
    else:
        return None
    if said.words[end : end + 3] == ("and", "a", "half"):
        value, end = value + 0.5, end + 3
    return sign * value, end


def length_at(said: Words, place: int) -> tuple[float, int] | None:
    """Read a length with its unit, in metres, and the place after it; `None` where there is none."""
    found = _single(said, place)
    if found is None:
        return None
    value, end = found
    smaller = _single(said, end + (said.word(end) == "and"))
    if smaller is not None and 0 < smaller[0] < abs(value) and said.words[end - 1] in ("foot", "feet", "ft", "'", "m"):
        return value + smaller[0], smaller[1]
    return found


def _single(said: Words, place: int) -> tuple[float, int] | None:
    for end in range(place + 1, place + _LONGEST_FACTOR + 1):
        factor, unit = _FACTORS.get(said.words[place:end]), UNITS.get(said.word(end))
        if factor is not None and unit is not None:
            if factor == 1.0 and said.words[end + 1 : end + 4] == ("and", "a", "half"):
                return 1.5 * unit, end + 4
            return factor * unit, end + 1
    number = number_at(said, place)
    if number is None:
        return None
    value, end = number
    unit = UNITS.get(said.word(end))
    if (
        said.word(end) == "in"
        and said.word(end + 1) in _AFTER_IN
        or said.word(end) == "in"
        and said.words[end + 1 : end + 3] in (("to", "the"), ("from", "the"), ("from", "each"))
    ):
        unit = 0.0254
    if unit is None:
        return None
    end += 1
    if said.words[end : end + 3] == ("and", "a", "half"):
        return (value + 0.5) * unit, end + 3
    return value * unit, end


_SHARES = {
    "half": 1 / 2, "halves": 1 / 2, "third": 1 / 3, "quarter": 1 / 4, "fifth": 1 / 5, "eighth": 1 / 8, "tenth": 1 / 10,
}  # fmt: skip
_HOW_MANY: Mapping[tuple[str, ...], int] = {(): 1, ("a",): 1, ("an",): 1, ("one",): 1, ("two",): 2, ("three",): 3}
_WHOLES = ((), ("a",), ("an",), ("of", "a"), ("of", "an"), ("of", "one"))


def _factors() -> dict[tuple[str, ...], float]:
    """Return what stands before a unit, as numbers: "half a", "three quarters of an", "a couple of"."""
    found = {
        (*many, word, *whole): number * share
        for name, share in _SHARES.items()
        for many, number in _HOW_MANY.items()
        for word in (name, f"{name}s")
        for whole in _WHOLES
    }
    couple = {(*a, "couple", *of): 2.0 for a in ((), ("a",)) for of in ((), ("of",))}
    return found | couple | {("a",): 1.0, ("an",): 1.0, ("another",): 1.0, ("a", "single"): 1.0}


_FACTORS = _factors()
_LONGEST_FACTOR = max(map(len, _FACTORS))


# Before and after a length: it is meant as it is said.
_BEFORE = frozenset(
    "about around roughly approximately approx circa exactly precisely nearly almost only just clear full".split()
)
_PHRASES_BEFORE = (
    ("a", "good"), ("at", "least"), ("at", "most"), ("no", "less", "than"), ("no", "more", "than"),
    ("more", "or", "less"),
    ("something", "like"), ("not", "less", "than"),
)  # fmt: skip
_AFTER = (("or", "so"), ("or", "thereabouts"), ("give", "or", "take"), ("exactly",), ("or", "thereabout"))


def _qualified(said: Words, place: int) -> int:
    """Return the place of the number that words such as "about" stand before."""
    at = place
    while True:
        phrase = next((one for one in _PHRASES_BEFORE if said.words[at : at + len(one)] == one), None)
        if phrase is not None:
            at += len(phrase)
        elif said.word(at) in _BEFORE:
            at += 1
        else:
            return at


def _range(said: Words, place: int) -> int | None:
    """Return the place after a range, which says no single length: "2 to 3 cm"; `None` where there is none."""
    first = number_at(said, place)
    if first is None or said.word(first[1]) not in ("to", "or"):
        return None
    last = length_at(said, first[1] + 1)
    return None if last is None else last[1]


def lengths_of(said: Words) -> dict[int, tuple[float, int]]:
    """Find every length, with what qualifies it ("about 10 cm"): place -> (metres, place after it).

    A range such as "2 to 3 cm" is no length.
    """
    found: dict[int, tuple[float, int]] = {}
    place = 0
    while place < len(said.words):
        number = _qualified(said, place)
        if (end := _range(said, number)) is not None:
            place = end
            continue
        length = length_at(said, number)
        if length is None:
            place += 1
            continue
        end = length[1]
        end += next((len(one) for one in _AFTER if said.words[end : end + len(one)] == one), 0)
        found[place] = round(length[0], 6), end  # to the micrometre: three inches are 0.0762 m
        place = end
    return found
