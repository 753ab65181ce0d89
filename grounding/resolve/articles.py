"""Say "the fork" for "a fork" where only one thing is a fork: then nothing is left to choose."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence

from grounding.resolve.lexicon import ADJECTIVES
from grounding.resolve.object_names import read_name

# "like a plate" and "as a bowl" speak of no object.
_ARTICLE = r"(?<!\blike )(?<!\bas )\b(?:an?|any|some)"


def definite_where_single(text: str, names: Sequence[str | None]) -> str:
    """Return a text that names what there is one of by "the".

    Args:
        text: any string.
        names: of the objects, in any form.
    """
    count = Counter(read_name(name or "").head for name in names)
    heads = sorted((re.escape(head) for head, number in count.items() if head and number == 1), key=len, reverse=True)
    if not heads:
        return text
    nouns = "|".join(re.escape(head) for head in count if head)
    single = re.compile(
        rf"{_ARTICLE}(?P<said>(?:\s+[a-z]+)?\s+(?:{'|'.join(heads)}))\b(?![-\s]+(?:{nouns})\b)", re.IGNORECASE
    )
    return single.sub(_definite, text)


def _definite(found: re.Match[str]) -> str:
    *described, _ = found["said"].lower().split()
    return f"the{found['said']}" if set(described) <= ADJECTIVES else found[0]
