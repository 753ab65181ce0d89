"""Which of the scene's objects an instruction means: "the cups", "three cans", "everything but the bowl".

Plain rules over nouns and numbers, so that the same words always mean the same objects. Adjectives
are not understood: "the red cup" means a cup. A compound means its last noun: a "soup can" is a can.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

# Noun -> what it can mean, best first: the first alternative of which an object is there is taken.
_CUTLERY = ("fork", "knife", "spoon")
_FRUIT = ("apple", "banana", "lemon", "orange", "peach", "pear", "plum", "strawberry")
_TOOLS = ("clamp", "drill", "hammer", "padlock", "scissors", "screwdriver", "wrench")
_OWN_MEANING = (
    *_CUTLERY, *_FRUIT, *_TOOLS, "airplane", "ball", "basket", "block", "book", "bottle", "bowl", "box",
    "brush", "can", "candle", "car", "dice", "jar", "lid", "marble", "marker", "mug", "pan", "pen", "pencil",
    "pitcher", "plate", "sponge", "spatula", "tray", "vase",
)  # fmt: skip
MEANINGS: dict[str, tuple[tuple[str, ...], ...]] = {noun: ((noun,),) for noun in _OWN_MEANING} | {
    "cup": (("cup",), ("mug",)),
    "teacup": (("cup",), ("mug",)),
    "beaker": (("cup",), ("mug",)),
    "glass": (("glass",), ("cup",)),
    "tumbler": (("glass",), ("cup",)),
    "tin": (("can",),),
    "dish": (("plate", "bowl"),),
    "saucer": (("plate",),),
    "carton": (("box",),),
    "package": (("box",),),
    "jug": (("pitcher",),),
    "plane": (("airplane",),),
    "brick": (("brick",), ("block",)),
    "cube": (("cube",), ("block",)),
    "flask": (("bottle",),),
    "pot": (("pan",),),
    "toy": (("toy", "airplane", "car", "block", "cube", "ball"),),
    "tool": (_TOOLS,),
}
# Nouns without a plural that mean all of their kind.
MASS_NOUNS: dict[str, tuple[str, ...]] = {
    "cutlery": _CUTLERY,
    "silverware": _CUTLERY,
    "flatware": _CUTLERY,
    "crockery": ("plate", "bowl", "cup", "mug"),
    "tableware": ("plate", "bowl", "cup", "mug", *_CUTLERY),
    "fruit": _FRUIT,
}
UNKNOWN_CATEGORY = "object"  # of things that nobody has recognised: they may be what any noun means
_COUNTING = ("two", "three", "four", "five", "six", "seven", "eight", "nine", "ten")
NUMBERS = {"both": 2} | {word: number for number, word in enumerate(_COUNTING, start=2)}
_WORD = re.compile(r"\d+|[^\W\d_]+(?:['’][^\W\d_]+)?|,")
_ALL_WORDS = ("all", "every", "each", "any", "everything")
_EXCEPTIONS = re.compile(
    r"\b(?:but|except(?:ing)?(?: for)?|excluding|besides|apart from|other than|save(?: for)?|not"
    r"|ignor(?:e|ing)|without(?: touching| moving| using)?|leav(?:e|ing)(?: out)?"
    r"|(?:don't|do not) (?:touch|move|use))\b"
)
# Words that can stand between an exception and its noun, or between two of its nouns.
_FILLERS = ("the", "a", "an", "all", "any", "my", "these", "those", "and", "or", "nor", "of", ",", *NUMBERS)
# "A bit to the left" is no drill bit; the plural is.
_NEVER_NOUNS = ("bit",)
_PRONOUNS = ("i", "you", "we", "it", "they", "he", "she", "one", "someone", "anyone")


class SelectionError(ValueError):
    """An object was named that is not there; the message lists what is."""


@dataclass(frozen=True)
class Selection:
    """The objects that an instruction means.

    Attributes:
        indices: into the scene's objects, ascending.
        named: the nouns that chose them, as singulars, in the order of the text; empty for "everything".
        excluded: the nouns that the instruction leaves out.
    """

    indices: tuple[int, ...]
    named: tuple[str, ...] = ()
    excluded: tuple[str, ...] = ()


@dataclass(frozen=True)
class _Mention:
    noun: str
    count: int | None  # None: all of them
    exact: bool  # whether the speaker gave the number
    excluded: bool


def select_objects(text: str, categories: Sequence[str]) -> Selection:
    """The objects that the instruction means.

    A plural means all of its kind, a number as many of them, and a singular one, from the front of
    the list; without any noun, everything is meant.

    Args:
        text: the instruction.
        categories: the noun of each object in the scene, singular, such as "mug".

    Raises:
        SelectionError: for a known noun of which no object, or too few objects, are there, and for an
            instruction that leaves nothing.
    """
    mentions = _mentions(text.lower(), categories)
    left_out: set[int] = set()
    for mention in mentions:
        if mention.excluded:
            left_out.update(_matches(mention.noun, categories)[: mention.count])
    included = [mention for mention in mentions if not mention.excluded]
    chosen: set[int] = set()
    wanted: Counter[str] = Counter()
    for mention in included:
        found = [i for i in _matches(mention.noun, categories) if i not in left_out]
        if not found or (mention.exact and len(found) < (mention.count or 0)):
            asked = f"{mention.count} of {mention.noun!r}" if mention.exact else repr(mention.noun)
            raise SelectionError(f"the instruction names {asked}; there is only: {_inventory(categories)}")
        # "the cracker box and the sugar box" are two boxes
        wanted[mention.noun] += len(found) if mention.count is None else mention.count
        chosen.update(found[: wanted[mention.noun]])
    if not included:
        chosen = set(range(len(categories))) - left_out
    if not chosen:
        raise SelectionError(f"the instruction leaves no object to move; there is: {_inventory(categories)}")
    return Selection(
        tuple(sorted(chosen)),
        tuple(dict.fromkeys(mention.noun for mention in included)),
        tuple(dict.fromkeys(mention.noun for mention in mentions if mention.excluded)),
    )


def _mentions(text: str, categories: Sequence[str]) -> list[_Mention]:
    nouns = _forms(categories)
    words = _WORD.findall(text)
    exceptions = [len(_WORD.findall(text[: match.end()])) for match in _EXCEPTIONS.finditer(text)]
    excluded = {place for start in exceptions for place in _exception_run(words, start, nouns)}
    mentions = []
    for place, word in enumerate(words):
        following = words[place + 1] if place + 1 < len(words) else ""
        if word not in nouns or word in _NEVER_NOUNS or following in nouns:
            continue
        if word == "can" and _is_verb(words, place):
            continue
        noun, plural = nouns[word]
        count, exact = _count(words, place, nouns)
        if count is None and not plural:
            before = words[max(0, place - 3) : place]
            count = None if any(w in _ALL_WORDS for w in before) else 1
        mentions.append(_Mention(noun, count, exact, place in excluded))
    return mentions


def _forms(categories: Sequence[str]) -> dict[str, tuple[str, bool]]:
    """Word -> (singular, whether it is a plural), for known nouns and the last words of the categories."""
    forms: dict[str, tuple[str, bool]] = {}
    own = {category.lower().split()[-1] for category in categories if category.strip()} - {UNKNOWN_CATEGORY}
    for noun in (*MEANINGS, *own):
        forms[_plural(noun)] = (noun, True)
        forms.setdefault(noun, (noun, False))
    for noun in MASS_NOUNS:
        forms[noun] = (noun, True)
    forms["fruits"] = ("fruit", True)
    return forms


def _plural(noun: str) -> str:
    if noun in ("scissors", "dice"):
        return noun
    if noun.endswith("fe"):
        return noun[:-2] + "ves"
    if noun.endswith("y") and noun[-2] not in "aeiou":
        return noun[:-1] + "ies"
    return noun + ("es" if noun.endswith(("s", "x", "sh", "ch")) else "s")


def _is_verb(words: list[str], place: int) -> bool:
    """Whether this "can" asks ("can you ...", "as high as you can") and is no tin."""
    following = words[place + 1] if place + 1 < len(words) else ""
    return place == 0 or following in _PRONOUNS or words[place - 1] in _PRONOUNS


def _count(words: list[str], place: int, nouns: dict[str, tuple[str, bool]]) -> tuple[int | None, bool]:
    """The number right before the noun, or before its adjective or compound."""
    for back in (1, 2, 3):
        if place < back:
            break
        word = words[place - back]
        if word.isdigit() and 0 < int(word) < 100:
            return int(word), True
        if word in NUMBERS:
            return NUMBERS[word], True
        if word in _FILLERS or (word in nouns and back > 1):
            break
    return None, False


def _exception_run(words: list[str], start: int, nouns: dict[str, tuple[str, bool]]) -> list[int]:
    """The places of the nouns that follow an exception, before anything else is said."""
    run = []
    for place in range(start, len(words)):
        following = words[place + 1] if place + 1 < len(words) else ""
        if words[place] in nouns:
            run.append(place)
        elif words[place] not in _FILLERS and following not in nouns:
            break
    return run


def _matches(noun: str, categories: Sequence[str]) -> list[int]:
    """The objects that the noun can mean."""
    meanings = MEANINGS.get(noun) or ((MASS_NOUNS[noun],) if noun in MASS_NOUNS else ())
    for kinds in ((noun,), *meanings):
        found = [i for i, category in enumerate(categories) if _head(category) in kinds]
        if found:
            return found
    return [i for i, category in enumerate(categories) if category == UNKNOWN_CATEGORY]


def _head(category: str) -> str:
    return category.lower().split()[-1] if category.strip() else ""


def _inventory(categories: Sequence[str]) -> str:
    counted = Counter(categories)
    parts = (f"{number} x {category}" if number > 1 else category for category, number in counted.items())
    return ", ".join(parts) or "nothing"
