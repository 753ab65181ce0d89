"""Choose the objects that a description of their use means: "the thing that quacks", "both things for coffee"."""

from __future__ import annotations

import re

from grounding.goal_reading.scene_references import SceneReferences
from grounding.references.attributes import is_color, of_color
from grounding.references.described_kinds import described_kind
from grounding.references.function_words import NUMBERS

_SINGLE = re.compile(r"\b(?:thing|one|tool|object|item|utensil|implement|vessel)\b", re.IGNORECASE)


def described_objects(text: str, find: SceneReferences) -> list[int] | None:
    """Return the indices of the objects that a description means, and note it; `None` if it means no kind clearly.

    Args:
        text: the words for the objects.
        find: what is there.

    Raises:
        ReadingQuestion: where it speaks of one object and several are of that kind.
    """
    if find.objects is None or find.candidates is None or find.catalogue or find.encoder is None:
        return None
    heads = [find.candidates.head(index) for index in range(len(find.objects))]
    kind = described_kind(text, tuple(dict.fromkeys(filter(None, heads))), find.encoder)
    if kind is None:
        return None
    found = [index for index, head in enumerate(heads) if head == kind]
    words = re.findall(r"[a-z]+", text.lower())
    colours = [word for word in words if is_color(word)]
    for colour in colours:
        fitting = of_color(colour, [find.objects[index].attributes for index in found])
        if fitting is None:
            return None
        found = [found[place] for place in fitting]
    count = next((NUMBERS[word] for word in words if word in NUMBERS and word != "one"), None)
    if not found or (count is not None and count != len(found)):
        return None
    if len(found) > 1 and count is None and _SINGLE.search(text):
        raise find.doubt(text, found)
    find.notes.append(f"{text!r} is taken for the {kind}")
    return found
