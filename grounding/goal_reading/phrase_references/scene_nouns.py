"""Find the objects that a noun can mean in one scene, in all its meanings, the likeliest first."""

from __future__ import annotations

from collections.abc import Mapping

from grounding.references.candidates import Candidates
from grounding.references.lexicon import CUTLERY, DRINKWARE, GROUPS, MASS_NOUNS, STUFF, TOOLS
from grounding.references.phrases import ANY, Mention, Vocabulary
from grounding.references.word_forms import singular

_DISHES = ("plate", "bowl", "saucer", "platter", "dish")
_PACKS = ("box", "carton", "can", "tin", "bottle", "jar", "tube", "bag", "packet")
_VESSELS = (*DRINKWARE, "bowl", "jar", "pitcher", "bottle", "pot", "kettle", "teapot", "jug", "vase", "bucket")
_OPEN = (*_VESSELS, "box", "can", "tin", "tray", "carton", "basket", "tube", "watering-can")
_SOLIDS = (
    "block",
    "cube",
    "cylinder",
    "brick",
    "ball",
    "cone",
    "pyramid",
    "prism",
    "sphere",
    "disc",
    "cuboid",
    "wedge",
)
# Word -> the kinds that it can mean besides the lexicon's, a set of kinds for each meaning.
_MEANINGS: Mapping[str, tuple[tuple[str, ...], ...]] = {
    "pot": (("pot",), ("teapot",), ("kettle",), ("saucepan",), ("jar",)),
    "brush": (("brush",), ("toothbrush", "paintbrush")),
    "dish": (_DISHES, (*_DISHES, *DRINKWARE)),
    "dishes": ((*_DISHES, "cup", "teacup", "glass", "teapot"), _DISHES),
    "porcelain": ((*_DISHES, *DRINKWARE, "teapot"),),
    "silver": (CUTLERY,),
    "iron": (("iron",), CUTLERY),
    "container": (_OPEN, ("box", "can", "jar", "bottle", "tube")),
    "vessel": (_VESSELS, _OPEN),
    "receptacle": (_OPEN,),
    "pack": (("box", "carton", "packet"), _PACKS),
    "packaging": ((*_PACKS, "cup"),),
    "package": (("box", "carton"), _PACKS),
    "carton": (("carton",), ("carton", "box")),
    "citrus": (("orange", "lemon", "lime", "grapefruit"),),
    "tool": ((*TOOLS,), ("trowel", "shovel", "spade", "rake", "watering-can")),
    "preserve": (("can", "tin", "jar"),),
    "produce": ((*GROUPS["fruit"], *GROUPS["vegetable"]),),
    "solid": (_SOLIDS,),
    "shape": (_SOLIDS,),
    "toolbox": (("toolbox",), ("box",)),
    "gadget": (("phone", "stapler", "radio", "camera", "calculator", "drill"),),
    "quacker": (("duck",),),
    "animal": (GROUPS["animal"],),
    "beastie": (GROUPS["animal"],),
    "shaker": (("shaker",),),
    "tumbler": (("tumbler", "glass", "cup"),),
    "wheels": (("car", "truck"),),
    "squash": (("bottle",),),
}  # fmt: skip
# What stands for a word in the name of an object: "the fish tin" is a tuna can.
_FILLINGS: Mapping[str, tuple[str, ...]] = {
    "fish": ("tuna", "salmon", "sardine"), "cornflake": ("cereal",), "muesli": ("cereal",), "flake": ("cereal",),
}  # fmt: skip
# Nouns that say nothing of what is there.
GENERAL = frozenset(
    "thing things item items object objects bit bits piece pieces stuff article articles element elements guy guys "
    "fella "
    "fellas thingy thingies member members good goods product products purchase purchases shopping belongings lot "
    "collection assortment set kit contents gear one-pieces body bodies stimulus stimuli fellow fellows entity "
    "entities "
    "specimen specimens material materials equipment candidate candidates individual thingamajig thingummy part parts "
    "possession possessions inventory supplies implement".split()
)
# "desk items", "breakfast things": all that is there, where most of it is of the kind.
_OCCASIONS = frozenset(
    (*STUFF, "bathroom", "desk", "garden", "gardening", "lab", "party", "shop", "household", "washing")
)
_LOOSE = ("grocery", "toiletry", "toy", "kitchenware", "tableware", "food", "solid", "shape")


class SceneNouns:
    """The nouns of one scene.

    Args:
        candidates: its objects.
        vocabulary: the nouns that are known.
    """

    def __init__(self, candidates: Candidates, vocabulary: Vocabulary) -> None:
        self._candidates, self._forms = candidates, vocabulary.forms
        self._names = ["-".join(name.lower().rstrip(" 0123456789").split()) for name in candidates.names]
        self.count = len(self._names)

    def head(self, index: int) -> str:
        """Return the noun of an object's name."""
        return self._candidates.head(index)

    def says(self, index: int, word: str) -> bool:
        """Tell whether the name of an object holds a word: "soup" of a soup can."""
        said = {singular(word), *_FILLINGS.get(singular(word), ())}
        return not said.isdisjoint(map(singular, self._names[index].split("-")))

    def named(self, word: str) -> bool:
        """Tell whether a word stands in the name of an object here."""
        return any(self.says(i, word) for i in self.everything())

    def filling(self, word: str) -> bool:
        """Tell whether a word is what something here holds, and no object itself: "milk" of a milk carton."""
        return self.named(word) and not self.of_kinds((singular(word),))

    def is_noun(self, word: str) -> bool:
        """Tell whether a word is a known noun for objects, general nouns left aside."""
        return word in self._forms or word in _MEANINGS or singular(word) in _MEANINGS

    def plural(self, word: str) -> bool:
        """Tell whether a noun stands in the plural, or means all of its kind."""
        known = self._forms.get(word)
        return (
            (known[1] if known else singular(word) != word)
            or word in MASS_NOUNS
            or word in ("porcelain", "silver", "produce", "packaging", "citrus")
        )

    def of_kinds(self, kinds: tuple[str, ...]) -> tuple[int, ...]:
        """List the objects of some kinds; a kind of two words is written "watering-can"."""
        return tuple(i for i, name in enumerate(self._names) if self.head(i) in kinds or name in kinds)

    def everything(self) -> tuple[int, ...]:
        """List all objects."""
        return tuple(range(self.count))

    def meanings(self, noun: str) -> list[tuple[int, ...]]:
        """List the sets of objects that a noun can mean, the likeliest first; empty where it means none."""
        found = [self.of_kinds(kinds) for kinds in _MEANINGS.get(noun, _MEANINGS.get(singular(noun), ()))]
        if noun == "dishes" or not found:
            said = Mention(singular(noun), (), None, False, "target", True, True, (), None, (0, 0))
            found.append(tuple(self._candidates.kinds_of(said)))
        if singular(noun) in _LOOSE and found[-1] and 2 * len(found[-1]) > self.count:
            found = [self.everything() if singular(noun) != "toy" else found[-1]]
        return [each for each in dict.fromkeys(found) if each]

    def of_occasion(self, word: str) -> tuple[int, ...] | None:
        """List what "desk items" or "breakfast things" are; `None` where the word names no occasion."""
        if word not in _OCCASIONS:
            return None
        group = STUFF.get(word)
        found = tuple(self.meanings(group)[0]) if group and group != ANY and self.meanings(group) else ()
        narrow = group in ("writing", "cutlery", "drinkware", "toy", "food", "tool", "cookware", "electronics")
        if narrow or (found and 2 * len(found) < self.count):
            return found
        return self.everything()
