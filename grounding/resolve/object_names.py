"""Read the names of a scene's objects, and find what a noun means that no table knows."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from grounding.resolve.attributes import SceneObject
from grounding.resolve.function_words import FUNCTION_WORDS, GENERIC, NOT_OBJECTS
from grounding.resolve.lexicon import ADJECTIVES, ATTRIBUTES, CONTENTS, GROUPS, KINDS, OTHER_WORDS, SAME_WORDS
from grounding.resolve.word_forms import FORMS, Vocabulary, plural, singular

if TYPE_CHECKING:
    from grounding.parsers.sentence_encoder import SentenceEncoder

UNKNOWN_CATEGORY = "object"  # of things that nobody has named
# Cosine similarity from which on a noun means its nearest neighbour among all known nouns. Of 107 nouns that
# the tables lack, 0.6 finds 32 right ones and 11 wrong ones (0.5: 38 and 34; 0.7: 18 and 3).
SAME_MEANING = 0.6
_WORD = re.compile(r"[^\W\d_]{2,}")
_NUMBER = re.compile(r"\d+")
_TEXT_WORD = re.compile(r"[^\W\d_]+")
_JOINT = re.compile(r"[ \t_-]+")  # what stands between the words of one name
_LONGEST_NAME = 4  # words
STORED = Path(__file__).parent / "data" / "noun_embeddings.npz"
_BEHIND_THE_NOUN = re.compile(r"\b(?:with|of|for|in|from|on)\b")
# What an unknown noun is compared with: the nearest of many, not of the few that happen to be there.
KNOWN_NOUNS = tuple(dict.fromkeys((*KINDS, *OTHER_WORDS, *GROUPS)))
_RIVALS = {word: words for words in (*ATTRIBUTES, CONTENTS) for word in words}


@dataclass(frozen=True)
class Name:
    """The parsed name of an object, such as "tomato_soup_can" or "object 3, red, tall".

    Attributes:
        head: the noun, singular; empty if there is none.
        other: the noun that it may be instead: "mug" of "cup or mug 2"; empty if there is none.
        words: all words, in the singular, adjectives under one spelling.
        number: of "cup 2", or `None`.
    """

    head: str
    words: tuple[str, ...]
    number: int | None
    other: str = ""

    @property
    def heads(self) -> tuple[str, ...]:
        """Return the nouns that it may be, the likelier first."""
        return tuple(filter(None, (self.head, self.other)))


@lru_cache(maxsize=4096)
def read_name(name: str) -> Name:
    """Split a name of any kind into its parts."""
    name = name.lower().replace("_", " ")
    described = name.split(",")[0]
    nouns = [singular(word) for word in _WORD.findall(_BEHIND_THE_NOUN.split(described)[0])]
    other = nouns.pop() if len(nouns) > 2 and nouns[-2] == "or" else ""
    nouns = nouns[:-1] if other else nouns
    words = tuple(word for found in _WORD.findall(name) if (word := adjective(found)) != UNKNOWN_CATEGORY)
    numbers = _NUMBER.findall(described) if described.strip()[-1:].isdecimal() else []
    head = nouns[-1] if nouns and nouns[-1] != UNKNOWN_CATEGORY else ""
    return Name(head, words, int(numbers[-1][:9]) if numbers else None, other)


@lru_cache(maxsize=64)
def read_names(names: tuple[str | None, ...]) -> tuple[Name, ...]:
    """Split the names of a scene into their parts, each spelled as the others are; once for every scene."""
    return tuple(read_name(as_named(name or "", names)) for name in names)


def telling_words(one: SceneObject) -> set[str]:
    """Return the words of an object's name and of its colours."""
    name = read_name(one.name)
    return {*name.words, *name.heads, *(one.attributes.colors if one.attributes is not None else ())}


def adjective(word: str) -> str:
    """Return the one spelling of an adjective, or the singular of a noun that describes."""
    word = SAME_WORDS.get(word, word)
    return word if word in _RIVALS else singular(word)


def rivals(word: str) -> tuple[str, ...]:
    """List the adjectives that exclude this one and each other; empty if there are none."""
    return _RIVALS.get(word, ())


@lru_cache(maxsize=64)
def vocabulary(names: tuple[str | None, ...]) -> Vocabulary:
    """Collect the nouns of the tables and the names, and other words of the names that can stand for the object."""
    forms = dict(FORMS)
    heads: set[str] = set()
    compounds: set[tuple[str, str]] = set()
    for name in dict.fromkeys(read_names(names)):
        for word in (*name.heads, *name.words):
            blocked = word in FUNCTION_WORDS or word in NOT_OBJECTS or word in GENERIC or word in ADJECTIVES
            if word and (word in name.heads or not blocked):
                forms.setdefault(plural(word), (word, True))
                forms.setdefault(word, (word, False))
        heads.update(name.heads)
        compounds.update(zip(name.words, name.words[1:], strict=False))
    return Vocabulary(forms, frozenset(heads - {""}), frozenset(compounds))


def as_named(text: str, names: Sequence[str | None]) -> str:
    """Spell the names of objects in a text as the objects are named, where only spaces, hyphens, underscores or
    capitals differ: "the gear boxes" is "the gearboxes" if something is called "gearbox", and "a coffeepot" is "a
    coffee pot".

    Whole words are compared, one or several side by side, with whole words of a name.

    Args:
        text: any string.
        names: of the objects, in any form.
    """
    runs = _runs(tuple(names))
    words = list(_TEXT_WORD.finditer(text)) if runs else []
    said = [word.group().lower() for word in words]
    out, end, first = list[str](), 0, 0
    while first < len(words):
        last, run = _named_run(text, words, said[first : first + _LONGEST_NAME], first, runs)
        if run:
            out += [text[end : words[first].start()], run]
            end = words[last].end()
        first = last + 1
    return "".join((*out, text[end:]))


def _named_run(
    text: str, words: list[re.Match[str]], said: Sequence[str], first: int, runs: Mapping[str, str]
) -> tuple[int, str]:
    """Return the last of the words from `first` on that are a name, and its other spelling; "" if it is spelled so.

    Args:
        text: whose words they are.
        words: all.
        said: the few from `first` on, in small letters.
        first: the place of the first.
        runs: as `_runs`.
    """
    if said[0] in FUNCTION_WORDS and said[0] not in KINDS:
        return first, ""  # "a corn cob" is no acorn
    for count in range(1, len(said) + 1):
        last = first + count - 1
        if count > 1 and not _JOINT.fullmatch(text, words[last - 1].end(), words[last].start()):
            break
        for noun, form in ((said[count - 1], str), (singular(said[count - 1]), plural)):
            spelled = runs.get("".join((*said[: count - 1], noun)), "")
            if not spelled or (count == 1 and spelled == noun):
                continue
            name = form(spelled)
            return last, "" if text[words[first].start() : words[last].end()].lower() == name else name
    return first, ""


@lru_cache(maxsize=64)
def _runs(names: tuple[str | None, ...]) -> Mapping[str, str]:
    """Return the words that stand side by side in the names: without spaces -> the first name's, with single spaces."""
    found: dict[str, str] = {}
    for name in names:
        words = [singular(word) for word in _WORD.findall((name or "").lower().replace("_", " ").split(",")[0])]
        for first in range(len(words)):
            for end in range(first + 1, min(first + _LONGEST_NAME, len(words)) + 1):
                found.setdefault("".join(words[first:end]), " ".join(words[first:end]))
    return found


def meant_noun(noun: str, heads: Sequence[str], encoder: SentenceEncoder | None) -> str:
    """Return the known noun that an unknown one means; empty where none is near enough, or without an encoder.

    Args:
        noun: singular.
        heads: the nouns of what is there.
        encoder: compares their meanings.
    """
    if encoder is None:
        return ""
    heads = [head for head in heads if head not in KNOWN_NOUNS]
    unknown, *others = encoder.encode([noun, *heads])
    near = {word: float(other @ unknown) for word, other in zip(heads, others, strict=True)}
    near |= dict(zip(KNOWN_NOUNS, _embedded_nouns(encoder) @ unknown, strict=True))
    best = max(near, key=near.__getitem__)
    return best if near[best] >= SAME_MEANING else ""


def near_nouns(noun: str, heads: Sequence[str], encoder: SentenceEncoder | None) -> list[str]:
    """List the nouns that are near another one in meaning, though not the same: they share a synonym, or the encoder
    finds them near.

    Args:
        noun: singular, one that the tables know.
        heads: the nouns of what is there.
        encoder: compares their meanings; `None` does without.
    """
    others = [head for head in dict.fromkeys(heads) if head and head != noun]
    same = _synonyms(noun)
    found = {head for head in others if same & _synonyms(head)}
    if encoder is not None and others:
        own, *rest = embed_nouns([noun, *others], encoder)
        found |= {head for head, other in zip(others, rest, strict=True) if float(other @ own) >= SAME_MEANING}
    return [head for head in others if head in found]


def _synonyms(noun: str) -> set[str]:
    return {*OTHER_WORDS.get(noun, ()), *(word for word, others in OTHER_WORDS.items() if noun in others)}


@lru_cache(maxsize=2)
def _embedded_nouns(encoder: SentenceEncoder) -> np.ndarray:
    return embed_nouns(KNOWN_NOUNS, encoder)


def embed_nouns(nouns: Sequence[str], encoder: SentenceEncoder) -> np.ndarray:
    """Return the embeddings (N, 384) float32 of nouns, from the stored ones where they are of this encoder."""
    checksum, known = stored_embeddings()
    if checksum != encoder.checksum:
        known = {}
    rest = [noun for noun in nouns if noun not in known]
    found = {**known, **dict(zip(rest, encoder.encode(rest), strict=True))}
    return np.array([found[noun] for noun in nouns], dtype=np.float32)


@cache
def stored_embeddings() -> tuple[str, dict[str, np.ndarray]]:
    """Load the checksum of the encoder that made the stored embeddings, and the embedding (384,) of each noun."""
    with np.load(STORED, allow_pickle=False) as stored:
        return str(stored["encoder_sha256"]), dict(zip(stored["nouns"].tolist(), stored["embeddings"], strict=True))
