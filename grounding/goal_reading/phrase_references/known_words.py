"""Collect the words that copied phrases are read with, which are no typing errors of others."""

from __future__ import annotations

from grounding.goal_reading.phrase_references.adjectives import COLOUR_OF, COLOURS, IDLE
from grounding.goal_reading.phrase_references.place_words import SIDES
from grounding.goal_reading.phrase_references.properties import PROPERTIES, SAME_PROPERTY
from grounding.goal_reading.phrase_references.scene_nouns import GENERAL

# Words of clauses, and everyday words that are one letter away from a noun.
_FURTHER = frozenset(
    "furthest farthest further else shopping bought find bench workbench table kitchen bathroom office workshop garden "
    "clear handle handles wheel wheels trigger electricity paper paperwork corner corners edge column third thirds "
    "sour "
    "grass glass teeth brush brushes brushing drink drinks drinking write writes writing stick sticks sticky talk "
    "talks "
    "quack quacks rolls rolling cutting stabbing coffee water waters watering whose match matches matching share "
    "shares "
    "colour colours coloured same other others remaining remains leftover whole entire complete twin twins brother "
    "sister "
    "partner counterpart neighbour neighbours sibling siblings exception apart aside excluding barring minus without "
    "provided available lying standing sitting flanking between closest nearest foremost rearmost hindmost frontmost "
    "backmost outermost centre middle either neither every everything everybody everyone anything whatever whichever "
    "those these there where which person people somebody touch large larger pointy curved right rightmost leftmost "
    "should would could might doctors monkeys belong belongs breakfast dinner lunch rinse rinses squeeze squeezes "
    "stove "
    "hands handed light lights white whites black blacks brown browns green greens blues yellows reds oranges pinks "
    "pair "
    "trees grows trays metal metals wooden woods china shape shaped shapes solid solids thing things piece "
    "pieces distant nearer closer most more medium middle-sized unique odd stabs pours spout spouts pouring "
    "grew device toiletries angular opaque cousin cousins friends fish stirrer".split()
)
KNOWN_WORDS = _FURTHER | GENERAL | IDLE | frozenset((*COLOURS, *COLOUR_OF, *SIDES, *PROPERTIES, *SAME_PROPERTY))
