"""Find the noun of an object in the names of its file, folder or node."""

from __future__ import annotations

import re

# The nouns that are recognised in file names.
NOUNS = (
    "fork", "knife", "spatula", "spoon", "plate", "saucer", "bowl", "mug", "cup", "glass", "saucepan",
    "skillet", "pan", "pot", "pitcher", "jug", "teapot", "kettle", "bottle", "jar", "can", "box", "block",
    "brick", "cube", "book", "ball", "apple", "banana", "lemon", "orange", "peach", "pear", "plum",
    "strawberry", "sponge", "hammer", "wrench", "screwdriver", "scissors", "clamp", "marker", "pen",
    "pencil", "brush", "candle", "vase", "basket", "tray", "lid", "drill", "padlock", "car",
    "airplane", "toy",
)  # fmt: skip
_PLURALS = {
    "knives": "knife", "glasses": "glass", "boxes": "box", "brushes": "brush", "strawberries": "strawberry",
}  # fmt: skip


def category_of(*names: str) -> str:
    """Return the noun in the first name that has one: "red_mug_2" gives "mug", "SoupCan" gives "can".

    The last known noun of a name counts, as in "sugar box". Without a known noun, the result is the first name without
    its numbers.
    """
    for name in names:
        for word in reversed(_words(name)):
            for noun in (_PLURALS.get(word, word), word.removesuffix("s")):
                if noun in NOUNS:
                    return noun
    return " ".join(_words(names[0])) or names[0]


def _words(name: str) -> list[str]:
    spaced = re.sub(r"([a-z])([A-Z])", r"\1 \2", name)
    return [word.lower() for word in re.findall(r"[^\W\d_]+", spaced) if len(word) > 1]
