"""Reword what people say around a correction: "oh wait, plus the hammer", "what about the car instead?"."""

from __future__ import annotations

import re

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
    said = _INTERJECTION.sub("", text.strip())
    for pattern, usual in _REWORDED:
        said = pattern.sub(usual, said)
    return said.strip() or text
