"""Find where a text speaks of an example: "the same with the cups", "one like this", "the example"."""

from __future__ import annotations

import re

from grounding.propose.figure_mentions import Mention

_BIGGER = re.compile(r"\b(?:a bit |a little |much )?(?:bigger|larger|wider)\b", re.IGNORECASE)
_SMALLER = re.compile(r"\b(?:a bit |a little |much )?(?:smaller|tighter|narrower)\b", re.IGNORECASE)
# How an example is spoken of, the clearest first.
_LIKE = tuple(re.compile(rf"\b(?:{words})\b", re.IGNORECASE) for words in (
    r"(?:exactly |just )?the same(?: (?:thing|structure|figure|shape|arrangement|one))?"
    r"(?: again| as (?:this|that|before))?",
    r"(?:(?:an?|another|one) )?(?:(?:thing|one|something|figure|structure) )?like "
    r"(?:this|that|it|the (?:example|one before|last one))(?: one)?",
    r"another(?: one)?|a copy(?: of (?:this|that|it))?|(?:this|that|the example)(?: (?:figure|structure|shape|one))?"
    r"|it|one",
))  # fmt: skip
_EXAMPLE = re.compile(
    r"\b(?:(?:(?:an?(?:other)?|one) )?(?:(?:thing|one|something|figure|structure|copy) )?(?:like|of) )?the example\b",
    re.IGNORECASE,
)


def like_mentions(text: str, name: str, always: bool = True, follows: bool = False) -> tuple[Mention, ...]:
    """Find where a text speaks of an example, "the same with the cups", "one like this": the most telling words alone.

    Args:
        text: any string.
        name: of the example's figure.
        always: whether it is about the example in any case: then "it" is the example.
        follows: whether there is a goal so far: then "the same" is about that, unless `always`.
    """
    for pattern in _LIKE if always else (_EXAMPLE, *(() if follows else _LIKE[:2])):
        if found := pattern.search(text):
            return (Mention(*found.span(), name, lead="a"),)
    return ()


def compared(text: str) -> str:
    """Return what is said of an example with sizes in place of comparisons: of another one, "bigger" is large."""
    return _SMALLER.sub("small", _BIGGER.sub("large", text))
