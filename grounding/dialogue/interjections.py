"""Reword what people say around a correction: "oh wait, plus the hammer", "what about the car instead?"."""

from __future__ import annotations

import re

from grounding.parsers.spelling import SHORTHAND

_WORD = re.compile(r"(?<![\w'’])[^\W\d_]+(?![\w'’])")
# Of the shorthand of instructions, without what may be a word of its own.
_SHORTHAND = {
    short: word for short, word in SHORTHAND.items()
    if short.isalpha() and short not in ("id", "si", "sm", "lg", "cas", "da", "wes", "r")
} | {"btwn": "between"}  # fmt: skip
_INTERJECTION = re.compile(
    r"^(?:(?:oh|ah|aha|um+|uhm?|er+m?|hm+|oops|whoops|hey|yeah|all right|alright|great|nice|cool|perfect|thanks"
    r"|thank you|cheers|lovely|on (?:second|further) thoughts?|on reflection|you know what|(?:now that i |come to )think"
    r" (?:of|about) it|thinking about it|(?:good|fine|nice one|super|brilliant)(?=[,.!]))\b"
    r"(?: no\b(?= problem))?[ ,.!…-]*)+(?=\S)",
    re.IGNORECASE,
)
_REWORDED = tuple(
    (re.compile(pattern, re.IGNORECASE), said)
    for pattern, said in (
        (r"^nah\b", "no"),
        (r"\bw/o\b", "without"),
        (r"\bin ?front\b", "in front"),
        (r"\bi\.e\.,? ", ""),
        (r"(?<=[a-z]): ?(?=\d)", ", "),
        # "Not so close, 10 cm": the second half says how far.
        (r"^(?:but )?not (?:so|that|as|too|quite so) (?:close|near|far|tight|wide|much)(?: (?:together|apart|away|off))?[ ,;:.-]+(?=\d)", ""),
        # What people end with: "on the left pls", "not the orange one though".
        (r"(?<=\w)(?:[ ,.!]+(?:thanks|thank you|tho|though|lol|omg|haha|mate|silly me|my bad|final answer))+[ .!]*$", ""),
        (r"^(?:(?:it's|that's) )?(?:the )?wrong way (?:a)?round[,.;!]+ (?=\S)", ""),
        (r"^(?!i mean)(?P<what>.+?),? i mean(?:t)?$", r"i meant \g<what>"),
        (r",\s*(?:right|ok|okay|yes|yeah|alright)\s*\?+$", ""),  # "that one is out, right?"
        (r",? leave (?:that|it|those|them)(?: alone| there| be)?$", ""),
        (r"^plus(?=,? (?:the|a|an|my|your|that|this|those|these)\b)", "and"),
        (r"^(?:what|how) about (?!a\b|an\b)(?P<what>.+?)(?: instead)?\??$", r"\g<what> instead"),
        # "A little more, make it 8 cm": the second half says how much.
        (r"^(?:a (?:little|bit|touch|tad)|some|slightly|even) (?:more|less|further|farther)[ ,;:-]+(?=(?:make|say) )", ""),
    )
)


def without_interjections(text: str) -> str:
    """Return a sentence without interjections at its beginning, in usual words.

    Args:
        text: what was said; it stays where nothing else would be left.
    """
    said = _WORD.sub(lambda match: _SHORTHAND.get(match.group().lower(), match.group()), text.strip())
    said = _INTERJECTION.sub("", said)
    for pattern, usual in _REWORDED:
        said = pattern.sub(usual, said)
    return said.strip() or text
