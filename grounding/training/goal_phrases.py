"""Draw the phrases of instructions with several parts: objects, groups of them, lengths and places on the table."""

from __future__ import annotations

import tomllib
from functools import lru_cache
from importlib import resources

import numpy as np

_NOUNS = (
    "mug cup bowl plate can bottle box block jar spoon fork knife glass apple banana orange lemon pear peach ball cube "
    "brick tin "
    "candle book pen marker sponge scissors hammer wrench screwdriver phone remote marble toy car brush vase basket "
    "tray pot pan "
    "lid teapot saucer cone cylinder disc coin battery tomato potato egg cookie pitcher drill clamp timer camera soda "
    "shaker"
).split()
_FLAT = {"scissors", "soda"}
_IRREGULAR = {"knife": "knives", "glass": "glasses", "box": "boxes", "brush": "brushes", "peach": "peaches",
              "tomato": "tomatoes",
              "potato": "potatoes", "battery": "batteries", "wrench": "wrenches"}  # fmt: skip
COLOURS = "red blue green yellow white black orange purple pink brown grey turquoise".split()
_LOOKS = "big small tall short large little wooden plastic metal round square thin wide long shiny old empty".split()
_SUPERLATIVES = "tallest shortest biggest smallest largest widest longest".split()
_PLACED_NOUNS = "leftmost rightmost nearest farthest closest middle left right".split()
_COUNTS = {2: ("two", "2"), 3: ("three", "3"), 4: ("four", "4"), 5: ("five", "5"), 6: ("six", "6")}
_WHOLE = "one two three four five six seven eight nine ten twelve fifteen twenty thirty".split()
_UNITS = (
    "cm",
    "cm",
    "cm",
    "centimeters",
    "centimetres",
    "centimeter",
    "mm",
    "millimetres",
    "inches",
    "inch",
    "in",
    "m",
)
_EXCEPT = ("except", "but", "except for", "apart from")
_LENGTHS = ("half a metre", "half a meter", "an inch", "a foot", "half a foot", "a couple of centimetres",
            "a couple of inches",
            "one and a half inches", "a quarter of a metre", "half an inch")  # fmt: skip


@lru_cache(maxsize=1)
def phrases() -> dict[str, dict[str, list[str]]]:
    """Read the phrases of the training language: hole -> value -> phrases."""
    return tomllib.loads(resources.files("grounding").joinpath("language/phrases.toml").read_text(encoding="utf-8"))


class GoalPhrases:
    """Phrases that are drawn one after the other.

    Args:
        rng: draws them.
    """

    def __init__(self, rng: np.random.Generator) -> None:
        self.rng = rng

    def place_on_table(self) -> tuple[str, str]:
        """Draw a place: (what is said, x and y position of the line)."""
        x, y = self.one(("left", "center", "right")), self.one(("top", "middle", "bottom"))
        draw = self.rng.random()
        if draw < 0.35:
            return self.one(phrases()["x"][x][1:40]), x
        if draw < 0.6:
            return self.one(phrases()["y"][y][:30]), y
        x = self.one(("left", "right"))
        y = self.one(("top", "bottom"))
        depth = {"top": ("back", "far", "top", "upper", "rear"), "bottom": ("front", "near", "bottom", "lower")}[y]
        frame = self.one(("in the {y} {x} corner", "in the {y} {x}", "at the {y} {x}",
                          "in the {y}-{x} corner of the table",
                           "into the {y} {x} corner", "to the {y} {x}", "on the {x} at the {y}"))  # fmt: skip
        return frame.format(x=x, y=self.one(depth)), f"{x} {y}"

    def group(self) -> tuple[str, str]:
        """Draw several objects: (what is said, objects of the line)."""
        draw = self.rng.random()
        nouns = plural(self.noun())
        if draw < 0.34:
            all_of = ("the", "the", "the", "all the", "all", "my", "these", "those", "your", "both", "all of the")
            said = f"{self.one(all_of)} {nouns}"
        elif draw < 0.5:
            said = f"{self.one(('the', 'the', 'all the', 'all', 'my'))} {self.adjective()} {nouns}"
        elif draw < 0.62:
            count = self.one(_COUNTS[int(self.rng.integers(2, 6))])
            said = f"{self.one(('the ', '', 'these ', 'all '))}{count} {self.one(('', self.adjective() + ' '))}{nouns}"
        elif draw < 0.68:
            count, superlative = self.one(("two", "three", "3", "four")), self.one(_SUPERLATIVES)
            said = f"the {count} {superlative} {self.one((nouns, 'objects', 'things'))}"
        elif draw < 0.76:
            a, b = f"the {nouns}", f"the {plural(self.noun())}"
            return f"{a} and {b}", f"{a} + {b}"
        elif draw < 0.84:
            a, b, c = (self.object() for _ in range(3))
            return self.one((f"{a}, {b} and {c}", f"{a}, {b}, and {c}", f"{a}, {b}, {c}")), f"{a} + {b} + {c}"
        elif draw < 0.89:
            a, b = self.object(), self.object()
            return f"{a} and {b}", f"{a} + {b}"
        elif draw < 0.94:
            whole = self.one(("everything", "all the objects", "them all", "the rest", "everything else", "them",
                              "all of them",
                               "the "
                               "others", "all the other things", "the objects", "the remaining things"))  # fmt: skip
            return whole, "(all)"
        elif draw < 0.97:
            whole, without = self.one(("everything", "all objects", "all")), self.one(_EXCEPT)
            said = f"{whole} {without} {self.object()}"
        else:
            whole = self.one(("everything", "all things"))
            said = f"{whole} {self.one(('red', 'blue', 'green', 'that is red', 'that is not blue'))}"
        return said, said

    def group_of_one_kind(self) -> tuple[str, str]:
        """Draw several objects of one kind; see `group`."""
        said = f"{self.one(('the', 'both', 'all the', 'my', 'the two', 'the three'))} {plural(self.noun())}"
        return said, said

    def object(self) -> str:
        """Draw one object."""
        draw = self.rng.random()
        noun = self.noun()
        if draw < 0.5:
            return f"{self.one(('the', 'the', 'the', 'the', 'my', 'that', 'this'))} {noun}"
        if draw < 0.82:
            return f"the {self.adjective()} {noun}"
        if draw < 0.9:
            return f"the {self.one(_SUPERLATIVES)} {self.one((noun, 'object', 'one', 'thing'))}"
        if draw < 0.95:
            return f"the {self.one(_PLACED_NOUNS)} {noun}"
        return self.one((f"the {noun} on the left", f"the second {noun} from the left", f"a {noun}",
                         f"one of the {plural(noun)}",
                          f"the {noun} nearest to "
                          "me", f"the {self.adjective()} {self.adjective()} {noun}", noun))  # fmt: skip

    def length(self) -> str:
        """Draw a length with its unit."""
        draw = self.rng.random()
        if draw < 0.12:
            return self.one(_LENGTHS)
        unit = self.one(_UNITS)
        if draw < 0.3 and unit not in ("in", "m", "inch", "centimeter"):
            return f"{self.one(_WHOLE[1:])} {unit}"
        if unit == "m":
            return f"0.{self.rng.integers(1, 6)} m"
        number = self.rng.integers(1, 41) * (10 if unit.startswith("m") else 1)
        return f"{number}.5 {unit}" if self.rng.random() < 0.1 else f"{number} {unit}"

    def adjective(self) -> str:
        """Draw a colour or another adjective."""
        return self.one(COLOURS if self.rng.random() < 0.7 else _LOOKS)

    def noun(self) -> str:
        """Draw a noun."""
        return self.one(_NOUNS)

    def one(self, options: object) -> str:
        """Draw one of some phrases."""
        return str(options[self.rng.integers(len(options))])  # type: ignore[index, arg-type]


def plural(noun: str) -> str:
    """Form the plural."""
    return noun if noun in _FLAT else _IRREGULAR.get(noun, f"{noun}s")
