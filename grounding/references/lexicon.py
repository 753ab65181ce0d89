"""Define the meanings of nouns for objects on a table: kinds, synonyms, and words for groups."""

from __future__ import annotations

from collections.abc import Mapping


def _words(text: str) -> tuple[str, ...]:
    return tuple(text.split())


CUTLERY = _words("fork knife spoon teaspoon chopstick")
DRINKWARE = _words("cup mug glass goblet")
CROCKERY = _words("plate bowl saucer dish")
FRUIT = _words(
    "apple banana orange lemon lime pear peach plum strawberry grape kiwi cherry mango melon apricot fig "
    "date pineapple coconut avocado grapefruit"
)
VEGETABLES = _words(
    "carrot onion potato tomato pepper cucumber garlic cabbage broccoli cauliflower lettuce mushroom pea "
    "bean celery leek radish turnip pumpkin aubergine zucchini"
)
BREAD = _words(
    "bread roll bun bagel croissant toast cookie cracker cake muffin doughnut cheese egg nut candy pizza"
)
FOOD_WORDS = _words("food soup tuna meat pudding gelatin cereal rice pasta honey chocolate sandwich")
TOOLS = _words(
    "hammer screwdriver wrench drill clamp plier saw chisel padlock scissors level screw nail bolt bit "
    "tape ruler"
)
TOYS = _words(
    "toy airplane car truck bus train boat doll bear teddy duck ball block cube brick lego dice marble "
    "puzzle domino pawn frisbee dinosaur yoyo"
)
WRITING = _words("pen pencil marker crayon chalk")
OFFICE = (
    *WRITING,
    *_words("eraser stapler ruler scissors tape notebook clip envelope highlighter calculator glue"),
)
COOKING = _words(
    "pan pot kettle pitcher teapot spatula ladle whisk colander grater tray lid jar corkscrew cutter"
)
ELECTRONICS = _words(
    "phone remote laptop tablet mouse keyboard charger battery camera clock radio lamp flashlight"
)
OTHERS = _words(
    "book box can bottle basket bucket bag brush sponge candle candlestick vase coin key card button stone "
    "shell spool napkin coaster placemat shaker watch hat shoe glove sock towel soap comb toothbrush rope "
    "string flower plant container tube vial magazine newspaper letter wallet purse umbrella lighter match "
    "picture opener holder rack"
)
KINDS: tuple[str, ...] = tuple(
    dict.fromkeys(
        (
            *CUTLERY, *DRINKWARE, *CROCKERY, *FRUIT, *VEGETABLES, *BREAD, *FOOD_WORDS[1:], *TOOLS, *TOYS[1:],
            *OFFICE, *COOKING, *ELECTRONICS, *OTHERS,
        )
    )
)  # fmt: skip

# Word -> what else it can mean, best first: the first of which an object is there is taken.
OTHER_WORDS: Mapping[str, tuple[str, ...]] = {
    "cup": ("mug", "beaker", "tumbler"),
    "teacup": ("cup", "mug"),
    "beaker": ("cup", "glass", "mug"),
    "glass": ("tumbler", "goblet", "cup"),
    "tumbler": ("glass", "cup"),
    "goblet": ("chalice", "glass", "cup"),
    "chalice": ("goblet", "glass", "cup"),
    "tin": ("can",),
    "spoon": ("teaspoon", "tablespoon", "ladle"),
    "can": ("tin",),
    "saucer": ("plate",),
    "plate": ("saucer",),
    "platter": ("plate", "tray"),
    "package": ("box", "parcel"),
    "packet": ("box",),
    "parcel": ("box", "package"),
    "crate": ("box",),
    "case": ("box",),
    "jug": ("pitcher",),
    "pitcher": ("jug",),
    "carafe": ("pitcher", "jug", "bottle"),
    "plane": ("airplane",),
    "aeroplane": ("airplane",),
    "aircraft": ("airplane", "plane"),
    "brick": ("block", "lego"),
    "block": ("brick", "cube"),
    "cube": ("block",),
    "die": ("dice",),
    "flask": ("bottle", "thermos"),
    "thermos": ("flask", "bottle"),
    "pot": ("saucepan", "pan"),
    "pan": ("skillet", "saucepan", "pot"),
    "skillet": ("pan",),
    "saucepan": ("pan", "pot"),
    "spanner": ("wrench",),
    "automobile": ("car",),
    "lorry": ("truck",),
    "biro": ("pen",),
    "ballpoint": ("pen",),
    "tome": ("book",),
    "novel": ("book",),
    "paperback": ("book",),
    "torch": ("flashlight",),
    "cookie": ("biscuit",),
    "biscuit": ("cookie", "cracker"),
    "eraser": ("rubber",),
    "telephone": ("phone",),
    "cellphone": ("phone",),
    "smartphone": ("phone",),
    "plier": ("pliers",),
    "spud": ("potato",),
    "tangerine": ("orange",),
    "mandarin": ("orange",),
    "satsuma": ("orange",),
    "berry": ("strawberry", "raspberry", "blueberry"),
    "teddy": ("bear",),
    "plushie": ("bear", "teddy"),
    "doll": ("puppet", "figurine"),
    "figurine": ("doll",),
    "soda": ("can", "bottle"),
    "pop": ("can", "bottle"),
    "cola": ("can", "bottle"),
    "beer": ("can", "bottle"),
    "spice": ("shaker", "jar"),
    "stone": ("rock", "pebble"),
    "rock": ("stone", "pebble"),
    "pebble": ("stone", "rock"),
    "canister": ("can", "jar"),
    "basin": ("bowl",),
    "teaspoon": ("spoon",), "tablespoon": ("spoon",), "pen": ("biro", "marker"), "sharpie": ("marker",),
    "highlighter": ("marker",), "sellotape": ("tape",), "shears": ("scissors",), "vise": ("clamp",), "vice": ("clamp",),
    "mallet": ("hammer",), "duckling": ("duck",), "ducky": ("duck",), "duckie": ("duck",),
    "sphere": ("ball",), "orb": ("ball",),
    "toolbox": ("box",), "chest": ("box",), "casket": ("box",), "auto": ("car",), "motorcar": ("car",), "sedan": ("car",), "roadster": ("car",),
    "bird": ("duck", "parrot"), "birdie": ("duck",), "quacker": ("duck",), "driver": ("screwdriver",), "driller": ("drill",),
    "sledgehammer": ("hammer",), "gavel": ("hammer",), "clipper": ("scissors",), "snip": ("scissors",), "cutter": ("scissors", "knife"),
    "globe": ("ball",), "tankard": ("mug",), "stein": ("mug",), "canteen": ("bottle",), "scoop": ("spoon",), "felt": ("marker",),
    "adhesive": ("tape", "glue"), "beverage": ("can", "bottle"), "drink": ("can", "bottle", "cup"), "urn": ("jar", "vase"),
    "toothpaste": ("tube",), "shovel": ("spade", "trowel"), "spade": ("shovel", "trowel"), "roll": ("tape",), "stirrer": ("spoon",),
    "tinny": ("can",), "carton": ("box",), "racecar": ("car",),
}
_DISHES = ("plate", "bowl", "saucer", "platter", "dish")
GROUPS: Mapping[str, tuple[str, ...]] = {
    "cutlery": CUTLERY,
    "silverware": CUTLERY,
    "flatware": CUTLERY,
    "utensil": (*CUTLERY, "spatula", "ladle", "whisk"),
    "dish": _DISHES,
    "dishware": _DISHES,
    "crockery": (*_DISHES, *DRINKWARE, "teapot"),
    "china": (*_DISHES, *DRINKWARE, "teapot"),
    "tableware": (*_DISHES, *DRINKWARE, *CUTLERY),
    "dinnerware": (*_DISHES, *DRINKWARE, *CUTLERY),
    "drinkware": DRINKWARE,
    "glassware": ("glass", "goblet", "tumbler", "vase", "jar", "bottle"),
    "cookware": COOKING,
    "kitchenware": (*COOKING, *CUTLERY, *_DISHES, *DRINKWARE),
    "fruit": FRUIT,
    "vegetable": VEGETABLES,
    "veg": VEGETABLES,
    "veggie": VEGETABLES,
    "food": (*FRUIT, *VEGETABLES, *BREAD, *FOOD_WORDS),
    "grocery": (*FRUIT, *VEGETABLES, *BREAD, *FOOD_WORDS, "can", "bottle", "jar"),
    "edible": (*FRUIT, *VEGETABLES, *BREAD, *FOOD_WORDS),
    "tool": TOOLS,
    "power tool": ("drill", "sander", "saw"),
    "hand tool": tuple(tool for tool in TOOLS if tool not in ("drill", "tape", "bit", "nail", "screw", "bolt")),
    "toy": TOYS,
    "plaything": TOYS,
    "vehicle": ("car", "truck", "bus", "train", "airplane", "boat"),
    "animal": (
        "bear",
        "teddy",
        "duck",
        "dinosaur",
        "cat",
        "dog",
        "horse",
        "cow",
        "sheep",
        "pig",
        "frog",
        "elephant",
    ),
    "stationery": OFFICE,
    "electronics": ELECTRONICS,
    "gadget": ELECTRONICS,
    "device": ELECTRONICS,
    "toiletry": ("toothbrush", "soap", "tube", "bottle", "cup", "glass", "comb", "towel", "sponge"),
    "container": ("box", "can", "jar", "bottle", "basket", "bucket", "bowl", "tray"),
    "ball": ("ball", "baseball", "softball", "football", "basketball", "racquetball", "volleyball"),
    "box": ("box", "matchbox", "lunchbox", "shoebox", "toolbox"),
    "vessel": ("bowl", *DRINKWARE, "jar", "pitcher", "bottle", "pot"),
    "receptacle": ("box", "can", "jar", "bottle", "basket", "bucket", "bowl"),
}
# What is round in itself; plates, cups and cans are round from above only.
SPHERES = frozenset((*GROUPS["ball"], "orange", "apple", "peach", "plum", "tomato", "marble", "melon", "lemon", "lime", "onion"))
VESSELS = frozenset((*GROUPS["vessel"], *GROUPS["receptacle"], "basin", "carton", "vase", "pan"))
MASS_NOUNS = frozenset(
    "cutlery silverware flatware dishware crockery china tableware dinnerware drinkware glassware cookware "
    "kitchenware fruit veg food stationery electronics lego".split()
)
# "kitchen stuff", "the writing things": the word before a noun that says nothing, and its group.
STUFF: Mapping[str, str] = {
    "kitchen": "kitchenware", "cooking": "cookware", "baking": "cookware", "writing": "writing",
    "drawing": "writing",
    "office": "stationery", "school": "stationery", "desk": "stationery", "tea": "crockery",
    "coffee": "crockery",
    "breakfast": "tableware", "dinner": "tableware", "lunch": "tableware", "dining": "tableware",
    "table": "tableware", "eating": "cutlery", "drinking": "drinkware", "play": "toy", "kids": "toy",
    "children's": "toy", "kids'": "toy", "baby's": "toy", "kid's": "toy", "workshop": "tool",
    "repair": "tool",
    "edible": "food", "electronic": "electronics", "garage": "tool",
}  # fmt: skip
# "anything you can drink from": a verb, the word after it, and the group.
USES: Mapping[tuple[str, str], str] = {
    ("drink", "from"): "drinkware", ("drink", "out"): "drinkware", ("eat", "with"): "cutlery",
    ("eat", ""): "food",
    ("write", "with"): "writing", ("draw", "with"): "writing", ("play", "with"): "toy",
    ("cook", "with"): "cookware",
    ("eat", "from"): "dish", ("eat", "off"): "dish", ("read", ""): "book", ("cut", "with"): "blade",
}  # fmt: skip
USE_GROUPS: Mapping[str, tuple[str, ...]] = {
    "writing": WRITING,
    "book": ("book",),
    "blade": ("knife", "scissors"),
}

# Adjectives that exclude each other: a name with one of them is not meant by another of the same class.
COLOURS = _words(
    "red blue green yellow orange purple violet pink brown black white grey gray silver gold golden beige "
    "turquoise"
)
SAME_WORDS: Mapping[str, str] = {
    "big": "large", "huge": "large", "little": "small", "tiny": "small", "mini": "small", "gray": "grey",
    "violet": "purple", "golden": "gold", "wood": "wooden", "metallic": "metal", "steel": "metal",
    "high": "tall",
    "low": "short", "colour": "color", "round": "round",
}  # fmt: skip
ATTRIBUTES: tuple[tuple[str, ...], ...] = (
    tuple(SAME_WORDS.get(word, word) for word in COLOURS),
    ("large", "medium", "small"),
    ("tall", "short", "flat"),
    ("long",),
    ("wooden", "plastic", "metal", "ceramic", "paper", "cardboard", "foam"),
    ("full", "empty"),
    ("thick", "thin"),
    ("wide", "narrow"),
    ("clean", "dirty"),
    ("new", "old"),
)
ADJECTIVES = frozenset(word for words in ATTRIBUTES for word in words)
# What a can, box or bottle holds; the same as with adjectives, but they can stand for the object itself.
CONTENTS = _words(
    "soup tuna coffee cracker sugar pudding gelatin mustard ketchup cereal meat juice milk soda pop cola "
    "beer wine water"
)

FILLINGS = frozenset((*CONTENTS, *FRUIT, *VEGETABLES, *BREAD, *FOOD_WORDS, "spice"))


def meanings(noun: str) -> list[tuple[str, ...]]:
    """List what a noun can mean, best first; each alternative is a set of kinds."""
    if noun in USE_GROUPS:
        return [USE_GROUPS[noun]]
    found: list[tuple[str, ...]] = [(noun,)]
    if noun in GROUPS:
        group = GROUPS[noun]
        # A tumbler is drinkware because it is a glass.
        found = [
            (noun, *group, *(word for word, kinds in OTHER_WORDS.items() if kinds and kinds[0] in group))
        ]
    return found + [(other,) for other in OTHER_WORDS.get(noun, ())]
