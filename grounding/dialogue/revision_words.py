"""Words that a correction must have for what it changes: for a size, a place, a shape, an object that leaves or stays.

A star stands for any ending, an underscore for a space.
"""

from __future__ import annotations

import re

from grounding.structure_words import STRUCTURES


def _one_of(words: str) -> str:
    """Return a pattern for any of some words."""
    return "|".join(word.replace("*", r"\w*").replace("_", " ") for word in words.split())


def _having(words: str) -> re.Pattern[str]:
    """Return the pattern of texts that have any of some words."""
    return re.compile(rf"\b(?:{_one_of(words)})\b")


_LARGE = (
    "large larger big bigger huge giant wide wider broad broader roomy roomier loose* spac* long longer enlarge* grow* "
    "expand* stretch* increase* spread* apart enormous gigantic massive max* up more"
)
_SMALL = (
    "small smaller smallish tiny tinier little wee titchy compact* tight* dense denser close closer together shrink* "
    "shrank shrunk reduce* narrow narrower short shorter squeeze* mini* down less"
)
_EXCHANGING = "swap* switch* exchange* trade* change_* versa round other opposite"
_ACROSS = f"left* right* center* centre* mid* east west side sides over corner between mirror* {_EXCHANGING}"
_ALONG = (
    "top bottom front back rear near* far* behind clos* toward towards away up down me mid middle center* centre* "
    f"forward forwards further upper lower corner edge ahead {_EXCHANGING}"
)
_TURNING = (
    "fac* point* open* turn* rotat* look* flip* direction mouth gap hole clockwise degree degrees round around toward "
    "towards away north south east west other opposite reverse*"
)
SIZE_WORDS = {
    "large": _one_of(_LARGE), "small": _one_of(_SMALL),
    "medium": _one_of(f"medium* mid middl* average normal half {_LARGE} {_SMALL}"),
}  # fmt: skip
# Of what a part may hold, by the name of its field.
VALUE_WORDS = {
    "x_position": _one_of(_ACROSS),
    "y_position": _one_of(_ALONG),
    "rotation": _one_of(_TURNING),
    "direction": _one_of(f"{_ACROSS} {_ALONG}"),
    "relation": _one_of(
        f"{_ACROSS} {_ALONG} on onto in into inside next beside besides by move* atop under* put with"
    ),
}
# Words that ask for a shape in ways that its own words do not show.
_OTHER_SHAPE_WORDS = {
    "line": "side_by_side one_beside one_behind one_next alongside abreast in_order line* lining flat",
    "tower": "on_top_of one_on one_upon one_above one_over upright upwards stack* pile piled piles piling",
    "circle": "ring rings circl* round loop loops encircl* surround*",
    "table setting": "lay laid set setting place_setting place_settings dinner table",
    "grid": "rows columns by",
    "cluster": "clust* clump* huddl* bunch* group* gather* heap together pile piled",
}
_AS_ANOTHER = "same swap* switch* exchang* trad* versa other_way chang*"
AS_ANOTHER = _having(_AS_ANOTHER)
# Words for a cluster, too.
HEAPS = _having("heap heaps pile piles")
# With these a size is that of an object in an order.
FIRST_OR_LAST = _having("first last start starts begin begins end ends beginning order sort sorted")
# Of one of several objects: in a goal with an order it may speak of that.
SUPERLATIVE = re.compile(r"\b(?:\w{3,}est|first|last)\b(?! (?:to|for))")
THAT_PLACE = re.compile(r"\b(?:that|same|this|its|their|whose) (?:spot|place|position|corner|side|end)\b")
ONE_OF_A_ROW = re.compile(
    r"\bthe (?:middle|center|central|first|second|third|last|outer|end|leftmost|rightmost) (?:one|object|thing)\b"
)
# Sides of the table, not of an object.
OF_THE_TABLE = _having("table desk edge rim corner side end corners")
BARE_SIDE = re.compile(r"\b(?:in front|behind|left|right)\b(?! of)")
ON_TOP = re.compile(r"\bon(?: the)? top\b")
# What sounds like a side, and is none: "close it", "right then".
SAYS_NO_PLACE = re.compile(
    r"\bclose (?:it|that|this|them|up|the)\b|^(?:all )?right\b(?=[ ,]+(?:then|so|now|right|that|let|well)\b|,)"
    r"|\b(?:middle|cent(?:re|er)) of (?:it|them|that|those|the (?!table|desk|board)\w+)\b"
    r"|\bsame (?:side|edge|end)\b|\b(?:side|edge|end) (?:(?:is|stays|as) )?(?:the )?same\b"
)
PRONOUNS_OR_ALL = _having(
    "everything everybody everyone all rest other others remaining whole lot each every any both object objects thing "
    "things item items stuff them they these those it whatever anything else"
)
EVERYTHING = _having(
    "everything everybody everyone all rest the_other_ones the_other_objects the_other_things (?<!each_)others remaining "
    "whole every any anything object objects thing things item items the_stuff the_lot the_whole_lot"
)
# What some of the objects are said to do alone, or not.
FEWER = _having("only just out without minus except nothing_but")
NEGATED = _having(
    r"no not nor none never out without minus except but_for leave leaves lose drop remov* off away skip ditch "
    r"exclude* forget scrap delete need needed isnt stay stays keep n't \w+n't doesnt dont wrong"
)
LEAVING = re.compile(
    rf"{_having('only just same instead rather replace* substitut* change* mean meant make use using take').pattern}"
    rf"|{_having('swap* switch* exchange* trade* nothing_but i_said').pattern}|^(?:no|nope|not|actually|sorry|wait)\b"
)
KEPT = _having(
    "stay stays keep keeps as_it as_they as_you as_is as_said as_before as_was as_were same rest only just fine ok "
    "okay good right"
)
# Sides that are said, and what of a part shows them.
SIDES = {
    "left": r"left|west", "right": r"right|east", "back|rear": r"top|far|behind|away|back|north",
    "front": r"bottom|near|front|closer|south",
    r"(?:top|upper)(?=[ -](?:left|right))": r"top|far|behind|away|back|north",
    r"(?:bottom|lower)(?=[ -](?:left|right))": r"bottom|near|front|closer|south",
}  # fmt: skip
# With these a side may be denied, corrected, a way to move, or no side at all.
NO_SIDE = _having(
    r"bit little tad touch slightly further farther more over closer nearer toward towards degree degrees cm quarter "
    r"not no nope instead rather than never neither nor from but other opposite wrong swap* all_right alright "
    r"right_now"
    r"that's_right is_right fine left_over what's_left to_my back_to go_back put_back \w+n't actually sorry was were is"
)
# Before the words for what shall not be, and what may follow these.
DENYING = re.compile(r"\b(?:not|never|instead of|rather than|lose|drop)(?: (?:of )?(?:the|that|this|my|any|those|these))* ")
RELATED_BY = re.compile(r" (?:on|in|inside|behind|left|right|next|beside|between|at|to|in front|under|near|from|part|is|are)\b")
AFRESH = _having("scrap skip forget scratch start_again start_over start_afresh new_plan new_idea drop")
NOTHING_ELSE = _having(
    "only merely nothing_else nowt_else that's_it thats_it that's_all finish afresh bin ditch abandon changed_my_mind "
    "easier again"
)
# A sentence with one of these takes the place of what was said before.
INSTEAD = re.compile(
    r"\b(?:instead|rather|i meant?|i said|in place of|in (?:its|their|his|her) (?:place|stead)|backwards?|only|just that"
    r"|do it with)\b"
    r"|^(?:no|nope|not|actually|sorry|wait)\b"
)
JOINING = _having(
    "too also as_well join joins belong belongs part_of with_it with_them with_those include included add added in_it "
    "in_there"
)


def says_shape(shape: str, said: str) -> bool:
    """Return whether a sentence has a word for a shape."""
    words = STRUCTURES[shape].words
    own = (*words.nouns, *words.never_objects, *words.adjectives, *words.verbs, *words.participles)
    other = _one_of(f"{_AS_ANOTHER} {_OTHER_SHAPE_WORDS.get(shape, '')}")
    return re.search(rf"\b(?:{'|'.join(map(re.escape, own))}|{other})(?:s|ed|ing)?\b", said) is not None
