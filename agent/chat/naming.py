"""Read lines that give objects a noun: "object 3 is a bowl", "call object 1 the red mug",
"objects 2 and 4 are cans".
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from agent.errors import UsageError
from grounding.dialogue.acts import bare, is_question
from grounding.resolve.function_words import FUNCTION_WORDS, GENERIC, NOT_OBJECTS
from grounding.resolve.lexicon import ADJECTIVES, KINDS
from grounding.resolve.object_names import UNKNOWN_CATEGORY, read_name
from grounding.resolve.word_forms import singular

_COUNTED = ("one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven", "twelve")
_NUMBER = rf"(?:\d{{1,4}}|{'|'.join(_COUNTED)})"
_LIST = rf"{_NUMBER}(?:(?: ?, ?(?:and )?| and | & )(?:(?:the )?(?P<again>[a-z]+) )?{_NUMBER})*"
_WHICH = rf"(?:the )?(?P<kind>[a-z]+(?: [a-z]+)?) (?:number |no |nr )?(?P<numbers>{_LIST})"
_MEANT = re.compile(r"\b(?:really|actually|in fact|in truth|of course|probably|simply|both|all) ")  # adds nothing
_NOUN = r"(?P<article>an?|the|some)? ?(?P<noun>[a-z][a-z'-]*(?: [a-z][a-z'-]*){0,3})"
_WORDINGS = tuple(
    re.compile(wording.replace("(?P<again>", "(?:"))
    for wording in (
        rf"{_WHICH} (?:is|are|was|were|'s|should be|must be)(?: (?:called|named))? {_NOUN}",
        rf"(?:i |we )?(?:call|name|label|rename) {_WHICH}(?: as| to)? {_NOUN}",
        rf"(?:i |we )?(?:take|treat|regard|consider|see|use) {_WHICH} (?:as|for|to be) {_NOUN}",
    )
)
_GENERAL = {"object", "number", "item", "thing", "piece", "one", "no", "nr"}
_MOST_NOUN = 40  # characters


@dataclass(frozen=True)
class Naming:
    """A noun for some objects.

    Attributes:
        numbers: of the objects.
        kind: the noun that the line itself has for them, or "" for "object" and its like.
        noun: what they are, in the singular, without digits.
    """

    numbers: tuple[int, ...]
    kind: str
    noun: str


def naming_of(line: str) -> Naming | None:
    """Return the noun that a line gives to objects; `None` for a line that says anything else."""
    a_can = re.match(r"\s*cans? \d", line, re.IGNORECASE) is not None  # not "can you ..."
    if line.rstrip().endswith("?") or not a_can and is_question(line):
        return None
    said = " ".join(re.sub(r"#\s*(?=\d)", " number ", line).replace("/", " ").split())
    said = re.sub(r"\bnumber number\b", "number", re.sub(r" ?, ?", ", ", bare(said)))
    said = re.sub(r"\b(object|item|thing)s? number\b", r"\1", said)
    said = re.sub(r"(?<=\w)'s (?=an? )", " is ", _MEANT.sub("", said))
    for wording in _WORDINGS:
        if (found := wording.fullmatch(said)) is not None:
            naming = _naming(found, is_called=wording is not _WORDINGS[0])
            if naming is not None:
                return naming
    return None


def _naming(found: re.Match[str], is_called: bool) -> Naming | None:
    """Return the naming of a matched line, or `None` if its last words are no noun."""
    *words, last = found["noun"].split()
    head = singular(last)
    about = [word for word in words if word not in ADJECTIVES]
    if any(word in FUNCTION_WORDS or word in NOT_OBJECTS for word in (*about, last)):
        return None
    if head in ADJECTIVES or head in GENERIC or head == UNKNOWN_CATEGORY or len(found["noun"]) > _MOST_NOUN:
        return None
    if head not in KINDS and not is_called and found["article"] not in ("a", "an"):
        return None  # "object 3 is wobbly", "objects 2 and 4 are the ends"
    numbers = [
        int(word) if word.isdecimal() else _COUNTED.index(word) + 1 for word in re.findall(_NUMBER, found["numbers"])
    ]
    kind = singular(found["kind"].split()[-1])
    return Naming(tuple(dict.fromkeys(numbers)), "" if kind in _GENERAL else kind, " ".join((*words, head)))


def named_indices(naming: Naming, names: Sequence[str], display_names: Sequence[str]) -> list[int]:
    """Return which objects are meant, as indices into their names.

    Raises:
        UsageError: for a number that no object has, or an object that is not of the kind that the line says.
    """
    numbers = [read_name(name).number for name in names]
    indices = []
    for number in naming.numbers:
        if number not in numbers:
            there = ", ".join(str(each) for each in sorted(each for each in numbers if each is not None))
            raise UsageError(f"there is no object {number}; legal: {there}")
        index = numbers.index(number)
        kinds = {UNKNOWN_CATEGORY, *read_name(names[index]).heads, *read_name(display_names[index]).heads}
        if naming.kind and naming.kind not in kinds:
            shown = display_names[index].split(",")[0]
            how = f"“object {number} is a ...” names it"
            raise UsageError(f"there is no {naming.kind} {number}, object {number} is {shown}; {how}")
        indices.append(index)
    return indices
