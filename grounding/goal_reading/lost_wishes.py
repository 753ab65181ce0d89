"""Find words that were not understood and surely ask for something, so that nothing is built without them.

Much of what people say around a plain instruction asks for nothing ("my aunt is coming at eight"), and not to understand
it does no harm. An order, an exception, a comparison, an amount or an object that is there do.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence

# What speaks of the objects' order, of exceptions, of likeness, of how an object lies, or of another place.
_WORDS = frozenset(
    "ascending descending rising falling increasing decreasing sequence sequential sequentially leading trailing foremost hindmost "
    "outermost innermost uppermost lowermost topmost bottommost taller shorter wider narrower thicker thinner heavier lighter "
    "alternate alternating alternately interleaved interleave elsewhere except excluding unless "
    "twice double doubled triple thrice halved upended flipped inverted sideways tilted leaning slanted slanting "
    "forbidden prohibited taboo likewise ditto respectively clockwise anticlockwise counterclockwise inward inwards "
    "outward outwards mirrored staggered concentric interlocking".split()
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
