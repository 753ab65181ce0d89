"""Roughen sentences as people type them: casing, punctuation, typing errors, missing articles."""

from __future__ import annotations

import re

import numpy as np

from grounding.structure_words import STRUCTURES

_NEIGHBOURS = {
    letter: row[max(0, i - 1) : i] + row[i + 1 : i + 2]
    for row in ("qwertyuiop", "asdfghjkl", "zxcvbnm")
    for i, letter in enumerate(row)
}
_SHORTER = {
    "please": ("pls", "plz", "pleas"), "you": ("u",), "and": ("n", "&", "+"), "with": ("w/", "w"), "are": ("r",),
    "to": ("2",), "for": ("4",), "the": ("da", "teh"), "of": ("o",), "that": ("tht",), "because": ("bc", "cuz"),
    "right": ("rite", "rght"), "left": ("lft", "letf"), "center": ("cntr", "ctr"), "middle": ("midle", "mid"),
    "table": ("tabel", "tbl"),
    "facing": ("facin",), "small": ("smal", "sml"), "large": ("lrg",), "medium": ("med",), "everything": ("evrything",),
    **{word: slips for structure in STRUCTURES.values() for word, slips in structure.typos.items()},
}  # fmt: skip


def roughen(text: str, rng: np.random.Generator) -> str:
    """Add small faults to a text: most sentences get none, some get one, a few get many."""
    kind = rng.random()
    if kind < 0.14:
        text = _slip(text, rng, 1)
    elif kind < 0.22:
        text = _slip(text, rng, int(rng.integers(2, 5)))
    if rng.random() < 0.08:
        text = re.sub(r"\b(?:the|an?|of|is|please) ", "", text)
    if rng.random() < 0.06:
        text = " ".join(_abbreviated(word, rng) for word in text.split(" "))
    casing = rng.random()
    if casing < 0.35:
        text = text[:1].upper() + text[1:]
    elif casing < 0.5:
        text = text.lower()
    elif casing < 0.53:
        text = text.upper()
    if rng.random() < 0.08:
        text = re.sub(r"[,.;:!?'-]", "", text)
    if text[-1:] not in ".!?":
        text += ("", "", "", ".", ".", "!")[rng.integers(6)]
    return text


def _abbreviated(word: str, rng: np.random.Generator) -> str:
    short = _SHORTER.get(word.lower())
    return short[rng.integers(len(short))] if short and rng.random() < 0.6 else word


def _slip(text: str, rng: np.random.Generator, count: int) -> str:
    words = text.split(" ")
    long = [i for i, word in enumerate(words) if len(word) > 3 and word.isalpha()]
    for i in rng.permutation(long)[:count]:
        words[i] = mistyped(words[i], rng)
    text = " ".join(words)
    if rng.random() < 0.1 and len(words) > 2:  # two words run together
        place = int(rng.integers(len(words) - 1))
        text = " ".join([*words[:place], words[place] + words[place + 1], *words[place + 2 :]])
    return text


def mistyped(word: str, rng: np.random.Generator) -> str:
    """Leave out, exchange, double or replace a letter of a word of four letters and more."""
    i = int(rng.integers(1, len(word) - 1))
    match rng.integers(5):
        case 0:
            return word[:i] + word[i + 1] + word[i] + word[i + 2 :]
        case 1:
            return word[:i] + word[i + 1 :]
        case 2:
            return word[: i + 1] + word[i:]
        case 3:
            near = _NEIGHBOURS.get(word[i].lower(), word[i])
            return word[:i] + near[rng.integers(len(near))] + word[i + 1 :]
    return word[:-1]
