"""Find words that were not understood and surely ask for something, so that nothing is built without them.

Much of what people say around a plain instruction asks for nothing ("my aunt is coming at eight"), and not to understand
it does no harm. An order, an exception, a comparison, an amount or an object that is there do.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence

from grounding.goal_reading.chunk import Chunk
from grounding.references.pattern_parts import NUMBER, UNIT

# What speaks of the objects' order, of exceptions, of likeness, of how an object lies, or of another place.
_WORDS = frozenset(
    "ascending descending rising falling increasing decreasing sequence sequential sequentially leading trailing foremost hindmost "
    "outermost innermost uppermost lowermost topmost bottommost taller shorter wider narrower thicker thinner heavier lighter "
    "alternate alternating alternately interleaved interleave elsewhere except excluding unless "
    "twice double doubled triple thrice halved upended flipped inverted sideways tilted slanted slanting "
    "forbidden prohibited taboo likewise ditto respectively clockwise anticlockwise counterclockwise inward inwards "
    "outward outwards mirrored staggered concentric interlocking repeat repeatedly".split()
)
_PHRASES = re.compile(
    r"\b(?:off limits|out of bounds|other way|vice versa|as (?:big|long|wide|tall) as|in turns|every (?:other|second|third))\b"
)
_COMPARED = re.compile(r"\b(?:bigger|smaller|larger) (?:ones? )?(?:to|on|at|towards?) (?:the|my|your)\b")
_SUPERLATIVE = re.compile(r"[a-z]{3,}(?:i|[a-z])est\b")
_NO_SUPERLATIVES = frozenset(
    "best latest honest modest earnest harvest interest guest request suggest digest contest protest forest invest latest arrest "
    "manifest tempest conquest priest breakfast behest inquest chest crest quest attest detest easiest finest nicest dearest kindest "
    "prettiest neatest tidiest quickest fastest simplest cleanest greatest soonest earliest infest ingest molest latest slightest "
    "favourest loveliest happiest hardest strongest weakest sunday unrest".split()
)


_LENGTH_SAID = rf"(?:\d+(?:[.,]\d+)?|an?|{NUMBER}) ?(?:{UNIT}|m|in)"
SEVERAL_PERSONS = "several persons"  # of a table setting, which is for one
# What no goal can hold, however much of the rest is understood.
_NEVER_HELD = re.compile(
    r"\b(?:(?:above|below|under|beneath|underneath|off|over) the (?:table|desk)"
    r"|(?:on|onto|in|into|inside|to|off|from) (?:the|my|your|a) (?:floor|ground|shelf|drawer|cupboard|cabinet|fridge|oven|sink|trash|garbage"
    r"|dishwasher|chair|sofa|closet|pocket|lap|stove|counter)"
    rf"|{_LENGTH_SAID}(?: away)? from (?:the|my|your|its) (?:\w+ )?(?:edge|border|rim|corner|end)s?\b"
    r"|from (?:the|my) (?:\w+ ){1,2}corner to (?:the|my) (?:\w+ ){1,2}corner|corner to (?:the opposite |opposite )?corner"
    r"|between every two(?! (?:neighbou?rs?|of them|adjacent)\b)|(?<!left )(?<!right )(?<!front )(?<!back )(?<!near )(?<!far )(?:half|most|a third|a quarter|a part) of (?:the|my|these|those|them)(?! (?:table|desk|surface|row|way)\b)|(?:half|twice|(?:two|three|four|\d+) times) as \w+"
    r"|back (?:to )?(?:where|the way|how|as) (?:it|they|that|everything) (?:was|were)"
    r"|(?:put|place|bring|give|take|set) (?:the|my|it|them|that|those|these|everything|all)(?: (?!(?:at|in|to|on|the|toward|towards|near|along|by|from|against|into|onto|far|way|further|farther|right|left)\b)\w+){0,3} back(?=$| (?:[.,;!?|]|and|now|again|please))"
    r"|(?:get|gets|getting|becomes?|becoming|grows?|growing) (?:closer|farther|further|tighter|looser|denser|sparser)"
    r"|(?:(?:two|three|four) (?:thirds|quarters|fifths)|a fifth|\d+ ?(?:%|percent)) of"
    rf"|at (?:most|least) {_LENGTH_SAID}.*at (?:most|least) {_LENGTH_SAID}|between \d+ and \d+ ?(?:{UNIT})"
    r"|(?:one|an?|the \w+) (?:arm|side|end|leg|half|bar) (?:longer|shorter|wider|bigger|larger|smaller|denser|taller)"
    r"|(?:denser|sparser|tighter|looser|closer together) (?:on|at|in|towards?) the \w+(?: side| end)? than"
    r"|(?:use|with|using) (?:your|the) (?:left|right|other) (?:arm|gripper)|opposite (?:to |of |from )?(?:the|my) (?!edge|side|end|corner|one\b|way)\w+"
    r"|(?:^|(?<=[.,;!?] ))either (?!way|side|of|one|end)\w+ (?:the|my|all|a|an) (?:\w+ )*?or"
    r"|leaning(?! (?:over|back))|facing (?:each other|one another|inwards?|outwards?|the (?:cans?|cups?|bowl|plate|mug)))\b",
    re.IGNORECASE,
)


def never_held(chunks: Sequence[Chunk]) -> tuple[str, ...]:
    """Return the phrases that ask for what no goal can hold: "on the floor", "half of the cups".

    Args:
        chunks: of the instruction; what asides say is not looked at.
    """
    persons = (chunk.said for chunk in chunks if chunk.kind == "unknown" and chunk.value == SEVERAL_PERSONS)
    return (*persons, *(match.group() for match in _NEVER_HELD.finditer(without_asides(chunks))))


def without_asides(chunks: Sequence[Chunk]) -> str:
    """Return the words of an instruction with a bar in place of each aside."""
    asides = [chunk.kind == "mentioned" or (chunk.kind == "noise" and " " in chunk.said) for chunk in chunks]
    return " ".join("|" if aside else chunk.said for aside, chunk in zip(asides, chunks, strict=True))


def lost_wishes(
    text: str, residue: Sequence[str], objects_left: Sequence[str], colours: Collection[str] = ()
) -> tuple[str, ...]:
    """Return the words that were not understood and surely ask for something.

    Args:
        text: the instruction.
        residue: words that were not understood, in the order of the text.
        objects_left: those of them that name objects that are there.
        colours: of what is there; an instruction that names one chooses by it.
    """
    found = [words for words in residue if words in objects_left or _asks(words, colours)]
    together = " ".join(residue).lower()
    compared = _COMPARED.search(text.lower()) and re.search(r"bigger|smaller|larger", together)
    if not found and (_PHRASES.search(together) or compared):
        found = list(residue)
    return tuple(dict.fromkeys(found))


def _asks(words: str, colours: Collection[str]) -> bool:
    said = re.findall(r"[a-z]+", words.lower())
    if any(word in _WORDS or word in colours for word in said):
        return True
    return any(_SUPERLATIVE.fullmatch(word) and word not in _NO_SUPERLATIVES for word in said)
