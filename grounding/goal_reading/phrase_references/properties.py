"""Say which household nouns have which properties and uses, as far as the noun alone tells.

A property has the nouns that surely have it, in tiers: a ball is round before a plate is. It has nouns for which it
depends on the single thing, too: a box may be made of metal. All other nouns of the lexicon do not have it.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

from grounding.references.lexicon import BREAD, CUTLERY, FOOD_WORDS, FRUIT, KINDS, TOYS, VEGETABLES, WRITING


@dataclass(frozen=True)
class Property:
    """Which nouns have a property.

    Attributes:
        tiers: nouns that have it, the surest first.
        open: nouns of which some have it.
    """

    tiers: tuple[tuple[str, ...], ...]
    open: tuple[str, ...] = ()


def _property(*tiers: str, open: str = "") -> Property:
    return Property(tuple(tuple(tier.split()) for tier in tiers), tuple(open.split()))


_FOOD = " ".join((*FRUIT, *VEGETABLES, *BREAD, *FOOD_WORDS))
_BALLS = "ball orange apple peach plum tomato marble melon onion baseball globe"
_POINTED = "fork knife scissors screwdriver nail needle pen pencil trowel"
_TINS = "can tin"
_METAL = f"{' '.join(CUTLERY)} {_TINS} kettle trowel watering-can coin key padlock wrench nail screw bolt grater whisk"
_CERAMIC = "plate bowl saucer mug cup teapot vase dish platter"
_DRINKS = "cup mug glass goblet beaker tumbler"
PROPERTIES: Mapping[str, Property] = {
    "metal": _property(
        _METAL,
        "pan scissors hammer clamp stapler",
        open="box car toy pen phone tray drill bottle lamp saw level opener holder rack bucket screwdriver tape",
    ),
    "tin": _property(_TINS, open="box tray"),
    "ceramic": _property(_CERAMIC, "pot egg-cup", open="jar pitcher"),
    "glass": _property("glass goblet", "bottle jar", open="vase bowl cup pitcher teapot marble"),
    "wooden": _property("", open=" ".join(KINDS)),
    "plastic": _property("lego", open=" ".join(KINDS)),
    "paper": _property("paper book notebook magazine newspaper letter envelope napkin", open="cup bag box"),
    "cardboard": _property("carton box", open="cup"),
    "edible": _property(_FOOD, open="duck"),
    "tinned": _property(_TINS),
    "citrus": _property("orange lemon lime grapefruit tangerine mandarin"),
    "round": _property(
        _BALLS,
        "plate saucer bowl pan tape lid clock coin lemon",
        "cup mug can bottle jar cylinder glass pot bucket",
        open="box stone button toy",
    ),
    "square": _property("cube block box brick dice", open="book notebook plate tray"),
    "rectangular": _property("box brick book notebook tray carton phone", open="block"),
    "angular": _property("cube block box brick dice", open="book notebook carton stapler tray"),
    "oval": _property("egg", "lemon spoon"),
    "flat": _property("plate saucer tray notebook book phone pan coaster placemat", open="box"),
    "curved": _property("banana", "bowl"),
    "deep": _property("bowl", "cup mug pot jar bottle bucket"),
    "shallow": _property("plate saucer tray", "bowl"),
    "pointy": _property(_POINTED),
    "pronged": _property("fork"),
    "tined": _property("fork"),
    "sharp": _property("knife scissors saw nail"),
    "breakable": _property("egg glass goblet", f"{_CERAMIC} bottle jar", open="phone clock lamp"),
    "electric": _property(
        "drill phone lamp laptop tablet radio camera flashlight charger", open="kettle toothbrush toy"
    ),
    "feathered": _property("duck parrot chicken bird"),
    "sticky": _property("tape glue"),
    "soft": _property("sponge teddy bear sock towel cushion", open="ball toy"),
    "hollow": _property(f"{_DRINKS} bottle jar box can bowl pot teapot kettle pitcher tube"),
    "handle": _property(
        f"mug kettle pan pitcher teapot hammer screwdriver trowel watering-can saw bucket basket {' '.join(CUTLERY)} "
        "toothbrush brush",
        "scissors drill",
        open="cup pot box bag tray",
    ),
    "wheel": _property("car truck bus train bicycle", open="toy"),
    "beak": _property("duck parrot bird chicken"),
    "prong": _property("fork"),
    "tine": _property("fork"),
    "spout": _property("teapot kettle watering-can pitcher"),
    "trigger": _property("drill", open="bottle"),
    "motor": _property("drill", "car", open="toy toothbrush"),
    "blade": _property("knife scissors saw"),
    "ink": _property("pen marker highlighter"),
    "lid": _property("teapot jar kettle", "pot box bottle", open="can cup"),
}  # fmt: skip
SAME_PROPERTY: Mapping[str, str] = {
    "spherical": "round", "circular": "round", "wood": "wooden", "steel": "metal", "metallic": "metal",
    "china": "ceramic", "porcelain": "ceramic", "clay": "ceramic", "earthenware": "ceramic", "eatable": "edible",
    "fragile": "breakable", "electrical": "electric", "wheels": "wheel", "prongs": "prong", "tines": "tine",
    "handles": "handle", "bent": "curved", "squared": "square", "cubic": "square", "pointed": "pointy",
    "citric": "citrus", "canned": "tinned", "rolling": "rolls", "boxy": "rectangular", "egg-shaped": "oval",
    "feathers": "feathered", "spouts": "spout", "lids": "lid", "blades": "blade", "motors": "motor", "engine": "motor", "tip": "ink", "grip": "handle", "carton": "cardboard",
}  # fmt: skip

# What is done with a thing, in the words of "the thing you drink from", "for drinking", "that writes".
_USES: tuple[tuple[str, str], ...] = (
    (r"(?:drink|sip)\w*(?: (?:coffee|tea|from|out|of|with|in))*|coffee|tea", _DRINKS),
    (r"(?:eat\w*|spoon\w*) (?:the |your |my )?(?:soup|cereal|porridge) (?:with|by)", "spoon teaspoon"),
    (r"eat\w* (?:the |your |my )?(?:soup|cereal|porridge) (?:from|out of|off|in)", "bowl"),
    (r"eat\w* (?:from|off|off of|out of|on)|serv\w*(?: on)?", "plate bowl saucer dish platter"),
    (r"eat\w* with|eating (?:irons?|tools?|utensils?|implements?|gear)|eating", " ".join(CUTLERY)),
    (r"eat|be eaten", _FOOD),
    (r"(?:writ|draw|scribbl|sketch|colour)\w*(?: with)?", " ".join(WRITING)),
    (r"(?:writ|scribbl|sketch|draw)\w* (?:in|on|into|down in)|tak\w* notes in", "notebook paper"),
    (r"(?:cut|cuts|cutting|slic\w*|snip\w*)(?: (?:paper|things?|bread|food|stuff))?(?: with)?", "scissors knife"),
    (r"(?:stab|spear|prick)\w*(?: (?:food|things?))?(?: with)?", "fork"),
    (r"stir\w*(?: .+)? with|stir\w*", "spoon teaspoon"),
    (r"brush\w*(?: (?:your|my|his|her|one|the|our)? ?teeth)?(?: with)?", "toothbrush"),
    (r"rins\w*(?: .*)?", "cup glass mug"),
    (r"(?:talk|speak|call)\w*(?: .*)?", "phone telephone"),
    (r"read\w*(?: .*)?", "book magazine newspaper letter notebook"),
    (r"(?:stick|tap|glu|fasten)\w*(?: .*)?|keep\w* paper together", "tape glue"),
    (r"stapl\w*(?: .*)?", "stapler"),
    (r"drill\w*(?: .*)?|mak\w* holes(?: with)?", "drill"),
    (r"hold\w* (?:the |your )?(?:work|things?|pieces?|it) (?:still|tight|down|fast|in place)", "clamp"),
    (r"(?:driv\w*|knock\w*|hit\w*|bang\w*|pound\w*|hammer\w*)(?: (?:in |with )?nails?)?(?: in| into .*)?(?: with)?", "hammer"),
    (r"screw\w*(?: .*)?|(?:turn|driv)\w* screws?(?: .*)?", "screwdriver"),
    (r"(?:clamp|grip)\w*(?: .*)?", "clamp"),
    (r"needs? (?:electricity|power|current|a plug|plugging in)", "drill phone lamp laptop radio"),
    (r"roll\w* on (?:four )?wheels", "car truck bus train"),
    (r"roll\w*(?: (?:away|around|off))*", "ball orange apple car marble can cylinder"),
    (r"quack\w*|swim\w*", "duck"),
    (r"driv\w*|rac\w*", "car truck bus"),
    (r"play\w*(?: with)?", " ".join(TOYS)),
    (r"wash\w*(?: .*)?", "soap sponge"),
    (r"(?:clean|scrub|wip)\w*(?: .*)?", "sponge soap brush"),
    (r"squeez\w*(?: .*)?", "tube sponge"),
    (r"water\w*(?: .*)?", "watering-can"),
    (r"dig\w*(?: .*)?", "trowel shovel spade"),
    (r"pour\w*(?: .*)?", "kettle pitcher teapot jug watering-can"),
    (r"boil\w*(?: .*)?", "kettle"),
    (r"fry\w*(?: .*)?", "pan skillet"),
    (r"(?:gr[oe]w\w* on|pick\w* (?:from|off)) (?:an? )?trees?", "apple orange lemon lime pear peach plum cherry mango apricot fig banana"),
)  # fmt: skip


def use_of(words: str) -> tuple[str, ...] | None:
    """Return the nouns of what is used as some words say, "drink from"; `None` where no table knows."""
    found = [kinds for pattern, kinds in _USES if re.fullmatch(pattern, words)]
    return tuple(found[0].split()) if found else None


def property_of(word: str) -> Property | None:
    """Return the property that an adjective or a noun for a part names; `None` where no table knows it."""
    return PROPERTIES.get(SAME_PROPERTY.get(word, word))
