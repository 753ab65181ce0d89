"""Generate the grammar of paper appendix A.1: every legal combination of tokens, and sentences for each.

A sentence is a template with a phrase for every slot of its spec. Which synonym a template takes
turns with the spec's index, so the corpus is the same on every machine and every run.
"Center" always speaks of left and right and "middle" of near and far, as in the slots' vocabulary.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from itertools import product

from grounding.spec import FIRST_SHAPES, LEGAL_VALUES, SLOTS, SLOTS_OF_SHAPE, StructureSpec
from grounding.structure_words import STRUCTURES, Grammar

SIZE_WORDS = {
    "small": ("small", "compact", "little", "tight"),
    "medium": ("medium", "medium-sized", "mid-sized", "medium"),
    "large": ("large", "big", "wide", "large"),
}
# For a structure without a shape; each shape has its own in its file of words.
STRUCTURE_NOUNS = ("structure", "arrangement", "formation", "structure")
# Instructions name the objects; the sentence-conditioned model must not mind which.
OBJECT_WORDS = ("objects", "things", "items", "cups", "objects", "cans", "boxes")
X_PHRASES = {
    "left": ("on the left", "on the left side of the table", "at the left", "to the left"),
    "center": (
        "in the center",
        "at the center of the table",
        "centered between left and right",
        "at the center",
    ),
    "right": ("on the right", "on the right side of the table", "at the right", "to the right"),
}
Y_PHRASES = {
    "top": ("at the top of the table", "at the far end of the table", "at the back", "near the top edge"),
    "middle": (
        "in the middle of the table",
        "in the middle",
        "halfway to the back",
        "midway between front and back",
    ),
    "bottom": (
        "at the bottom of the table",
        "at the near end of the table",
        "at the front",
        "near the bottom edge",
    ),
}
# One phrase for both positions: {x} and {y} are the vocabulary's own words.
CORNER_PHRASES = ("in the {y} {x} of the table", "at the {y} {x}", "on the {y} {x} part of the table")
ROTATION_PHRASES = {
    rotation: (f"facing {rotation}", f"turned to the {rotation}", f"pointing {rotation}", f"that faces {rotation}")
    for rotation in LEGAL_VALUES["rotation"]
}
# A noun with its article needs "that faces"; an action ("stack the objects") cannot have it.
ACTION_ROTATION_PHRASES = {
    rotation: (f"facing {rotation}", f"so that it faces {rotation}", f"turned to the {rotation}", f"facing {rotation}")
    for rotation in LEGAL_VALUES["rotation"]
}
SIZE_ADVERBS = {
    "small": ("close together", "tightly", "with little space between them"),
    "medium": ("moderately spaced", "with some space between them", "a medium distance apart"),
    "large": ("far apart", "widely spaced", "with a lot of space between them"),
}

# {a} is article, size and noun; {where} and {turn} begin with a space, or are empty.
NOUN_TEMPLATES = (
    "build {a}{where}{turn}",
    "put the {objects} into {a}{turn}{where}",
    "I would like {a} of {objects}{where}{turn}",
    "arrange everything as {a}{turn}{where}",
    "{Where}make {a}{turn} with the {objects}",
    "could you form {a}{where}{turn}, please?",
)
# {size}, {where} and {turn} begin with a space, or are empty. Those of a shape are in its file of words.
ACTION_TEMPLATES = ("put the {objects}{size}{where}{turn}", "place all the {objects}{size}{where}{turn}")

# The shapes of the parsers' training language; no shape at all is the last.
CORPUS_SHAPES: tuple[str | None, ...] = (*FIRST_SHAPES, None)
# What the parsers' training never sees, so that their benchmark can tell reading from remembering.
HELD_OUT_TEMPLATES = (4, 7)
HELD_OUT_COMBINATION_EVERY = 10


def legal_specs(shapes: Sequence[str | None] = CORPUS_SHAPES) -> list[StructureSpec]:
    """List every legal combination of at least one token of some shapes, by default the first: 1055 specs.

    Shapes come in the order given. Circle and line: 4 sizes x 4 x 4 positions x 5 rotations, "unspecified" counted, are
    320 each;
    tower 4 x 4 = 16; table setting 4 x 4 x 5 = 80; without a shape 320, less the empty one: 319.
    """
    specs = []
    for shape in shapes:
        slots = SLOTS_OF_SHAPE[shape]
        for values in product(*((None, *LEGAL_VALUES[slot]) for slot in slots)):
            spec = StructureSpec(shape, **dict(zip(slots, values, strict=True)))
            if spec.tokens():
                specs.append(spec)
    return specs


def sentences(spec: StructureSpec) -> list[str]:
    """List at least five distinct English sentences that express exactly the spec.

    Raises:
        ValueError: for a spec with nothing specified, which no sentence can say.
    """
    if not spec.tokens():
        raise ValueError("a specification needs at least one slot to have sentences")
    return list(_numbered_sentences(spec))


def _numbered_sentences(spec: StructureSpec) -> dict[str, int]:
    """Return sentence -> the number of its template."""
    start = _mixed_index(spec)
    grammar = _grammar(spec.shape)
    nouns = grammar.templates or NOUN_TEMPLATES
    texts: dict[str, int] = {}
    for number, template in enumerate((*nouns, *grammar.actions)):
        phrases = ROTATION_PHRASES if number < len(nouns) else ACTION_ROTATION_PHRASES
        turn = _pick(phrases[spec.rotation], start + number) if spec.rotation else ""
        texts.setdefault(_fill(template, spec, start + number, turn), number)
    return texts


@lru_cache(maxsize=2)
def _table(shapes: tuple[str | None, ...] = CORPUS_SHAPES) -> tuple[tuple[str, StructureSpec], ...]:
    return tuple((text, spec) for spec in legal_specs(shapes) for text in sentences(spec))


@lru_cache(maxsize=1)
def _splits() -> Mapping[str, str]:
    splits = {}
    for place, spec in enumerate(legal_specs()):
        rare = place % HELD_OUT_COMBINATION_EVERY == 0 and len(spec.tokens()) > 1
        for text, number in _numbered_sentences(spec).items():
            held_out = "held-out combination" if rare else "seen"
            splits[text] = "held-out template" if number in HELD_OUT_TEMPLATES else held_out
    return splits


def split_of(text: str) -> str:
    """Name the split of a sentence of the grammar: "seen" may be trained on, the others are held out.

    "held-out template": one noun template and one action template are never seen with any spec;
    "held-out combination": every tenth spec with two tokens or more is never seen in any template.

    Raises:
        KeyError: for a text that is no sentence of the grammar.
    """
    return _splits()[text]


def all_sentences(shapes: Sequence[str | None] = CORPUS_SHAPES) -> list[tuple[str, StructureSpec]]:
    """List every sentence of some shapes with its spec, in the order of `legal_specs`; no sentence occurs twice."""
    return list(_table(tuple(shapes)))


def _grammar(shape: str | None) -> Grammar:
    return STRUCTURES[shape].grammar if shape else Grammar(STRUCTURE_NOUNS, ACTION_TEMPLATES)


def _mixed_index(spec: StructureSpec) -> int:
    """Return a number that differs between neighbouring specs, so that synonyms alternate along every slot."""
    number = 0
    for slot, weight in zip(SLOTS, (7, 5, 3, 1, 11), strict=True):
        value = getattr(spec, slot)
        number += weight * (0 if value is None else 1 + LEGAL_VALUES[slot].index(value))
    return number


def _pick(phrases: tuple[str, ...], index: int) -> str:
    return phrases[index % len(phrases)]


def _where(spec: StructureSpec, index: int) -> str:
    x, y = spec.x_position, spec.y_position
    if x and y and index % 2:
        return _pick(CORNER_PHRASES, index).format(x=x, y=y)
    parts = [_pick(X_PHRASES[x], index)] if x else []
    parts += [_pick(Y_PHRASES[y], index // 2)] if y else []
    return " ".join(parts)


def _fill(template: str, spec: StructureSpec, index: int, turn: str) -> str:
    """Fill the template with this spec's phrases."""
    grammar = _grammar(spec.shape)
    size_words = grammar.sizes or SIZE_WORDS
    size = _pick(size_words[spec.size], index) if spec.size else ""
    noun = " ".join(part for part in (size, _pick(grammar.nouns, index)) if part)
    where = _where(spec, index)
    return template.format(
        a=("an " if noun[0] in "aeiou" else "a ") + noun,
        objects=_pick(OBJECT_WORDS, index),
        size=f" {_pick(SIZE_ADVERBS[spec.size], index)}" if spec.size else "",
        where=f" {where}" if where else "",
        Where=f"{where}, " if where else "",
        turn=f" {turn}" if turn else "",
    )
