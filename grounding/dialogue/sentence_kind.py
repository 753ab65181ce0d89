"""Tell whether a sentence is an instruction of its own or speaks of what was asked for before."""

from __future__ import annotations

import re

from grounding.dialogue.goal_revision import Turn
from grounding.dialogue.part_swaps import SWAP
from grounding.dialogue.relative_edits import normalized, relative_edits
from grounding.dialogue.scene_reader import SpokenReading
from grounding.goal_reading.verb_words import VERBS
from grounding.references.phrases import ANY

REPLACING = re.compile(r"\b(?:instead|rather|i meant?|i said)\b|^(?:no|nope|not|actually|sorry|wait|hmm?|but)\b[ ,]")
_ALONE_INSTEAD = re.compile(
    r"[ ,]*\b(?:instead|rather)\b[ ,]*|^(?:(?:no|nope|actually|sorry|wait|hmm?|but|i meant?|i said)\b[ ,]+)+"
)
_OF_WHAT_IS_THERE = re.compile(
    r"\b(?:it|its|them|they|their|that|this one|that one|other side|other way|opposite|swap sides|back)\b"
)
_CHANGING = re.compile(r"(?:swap|switch|reverse|make|with|without|bigger|smaller|gaps?|space)\b")
_OTHER = re.compile(r"\b(?:other|opposite) (?:side|end|way|direction)\b")
_AN_ORDER = re.compile(r"\b(?:the|same|this|that|reversed?|opposite|other) order\b")  # no verb


def is_new(turn: Turn) -> bool:
    """Return whether the sentence is an instruction of its own: it names its objects, and speaks of nothing else."""
    return not corrects(turn) and any(one.mention.noun != ANY for one in turn.said.mentions)


def corrects(turn: Turn) -> bool:
    """Return whether the sentence speaks of what was asked for before."""
    said = turn.said
    edits = relative_edits(normalized(_besides_objects(turn)))[0]
    return bool(
        said.parts or edits or SWAP.search(said.said) or _OF_WHAT_IS_THERE.search(said.said)
        or REPLACING.search(said.said) or _CHANGING.match(said.said) or not (said.mentions or orders(turn))
    )  # fmt: skip


def is_whole(turn: Turn, read: SpokenReading) -> bool:
    """Return whether a sentence that sounds like a correction is an instruction of its own after all."""
    said = turn.said
    if said.parts or _OTHER.search(said.said) or relative_edits(normalized(_besides_objects(turn)))[0]:
        return False
    if read.goal.plain_spec is None:
        return bool(read.goal.named_objects())
    return any(one.indices for one in said.mentions) and (orders(turn) or REPLACING.search(said.said) is not None)


def _besides_objects(turn: Turn) -> str:
    """Return what is said, with nothing but their nouns for the objects: "the biggest pot" is no bigger pot."""
    said = turn.said.said
    for one in sorted((one for one in turn.said.mentions if one.indices), key=lambda one: one.span, reverse=True):
        said = f"{said[: one.span[0]]}{one.mention.noun}{said[one.span[1] :]}"
    return said


def orders(turn: Turn) -> bool:
    """Return whether the sentence has a verb that asks for something."""
    words = _AN_ORDER.sub("", turn.said.said).split()
    return any(VERBS.get(word, "leave") != "leave" for word in words)


def without_marker(turn: Turn) -> str:
    """Return the sentence without words such as "instead" and "no", which say that it takes something's place."""
    return _ALONE_INSTEAD.sub(" ", turn.said.said).strip(" ,") if REPLACING.search(turn.said.said) else turn.text
