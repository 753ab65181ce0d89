"""Read the words of each structure from `grounding/structures/*.toml`: one file for each shape.

Everything that the language part knows about a single shape is in its file, so that another shape needs another
file and nothing else here (and a parser that is trained with it: the answers of the trained parsers are numbered).
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import MISSING, dataclass, field, fields
from functools import lru_cache
from pathlib import Path
from typing import Any

from grounding.figures.figure import Figure, FigureError
from grounding.figures.names import figure_named

# What a structure may be told beside its slots (docs/protocol.md, part two).
KEYS = ("order", "gap", "radius", "length", "rows", "columns", "around", "along", "group_by")
FOLDER = Path(__file__).parent / "structures"


class StructureWordsError(ValueError):
    """Raised for an invalid file of words; the message names the file, the key and the legal values."""


@dataclass(frozen=True)
class OwnPhrases:
    """Phrases of a hole of the training language that fit one shape better than the common ones.

    Attributes:
        share: how often they are drawn in place of the common ones, 0 to 1.
        phrases: value -> phrases.
    """

    share: float
    phrases: Mapping[str, tuple[str, ...]]


@dataclass(frozen=True)
class Grammar:
    """Words of the grammar of instructions (`grounding.corpus.grammar`).

    Attributes:
        nouns: four of them, which take turns.
        actions: sentences that need no noun for the structure.
        templates: sentences with the noun; empty for those that all shapes share.
        sizes: size -> adjectives; empty for those that all shapes share.
    """

    nouns: tuple[str, ...]
    actions: tuple[str, ...]
    templates: tuple[str, ...] = ()
    sizes: Mapping[str, tuple[str, ...]] = field(default_factory=dict)


@dataclass(frozen=True)
class Words:
    """Single words and phrases of a structure, by their role in a sentence.

    Attributes:
        nouns: by which people name the structure: "ring".
        never_objects: nouns, with their plurals, that mean a structure and never an object on the table.
        arranging: single verbs whose objects take part.
    """

    nouns: tuple[str, ...] = ()
    never_objects: tuple[str, ...] = ()
    arranging: tuple[str, ...] = ()


@dataclass(frozen=True)
class StructureWords:
    """The words of one shape.

    Attributes:
        name: the shape, as the slot's value.
        number: its place among the shapes, from 1; trained parsers depend on it, so that a new shape comes last.
        slots: its legal slots besides the shape.
        keys: of `KEYS`, those that it takes.
        least: the fewest objects that make one.
        words: see `Words`.
        grammar: see `Grammar`.
        phrases: "noun" and "action" -> phrases of the training language.
        stacked: whether its objects stand on each other: then "at the bottom" is a place of an object in it.
        pieces: nouns of objects that have a place of their own in it.
        half_turn: the message if half a turn changes nothing; empty if it changes the structure.
        unrotated: the reason for asking which way it should face if it shows no rotation; empty for the common reason.
        typos: word -> how it is mistyped in the training language.
        shorthand: mistyped word -> word.
        own_phrases: hole of the training language -> the shape's own phrases.
        figure: that the words are of; `None` for a taught shape.
    """

    name: str
    number: int
    slots: tuple[str, ...]
    least: int
    words: Words
    grammar: Grammar
    phrases: Mapping[str, tuple[str, ...]]
    keys: tuple[str, ...] = ()
    stacked: bool = False
    pieces: tuple[str, ...] = ()
    half_turn: str = ""
    unrotated: str = ""
    typos: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    shorthand: Mapping[str, str] = field(default_factory=dict)
    own_phrases: Mapping[str, OwnPhrases] = field(default_factory=dict)
    figure: Figure | None = None


def read_structure(path: Path) -> StructureWords:
    """Read the file of one shape.

    Raises:
        StructureWordsError: for a file that is no TOML, lacks a key or has an unknown one.
    """
    try:
        entries = _frozen(tomllib.loads(path.read_text(encoding="utf-8")))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise StructureWordsError(f"{path} is not a TOML file: {error}") from error
    entries["words"] = _made(Words, entries.get("words", {}), f"{path}, [words]")
    entries["grammar"] = _made(Grammar, entries.get("grammar", {}), f"{path}, [grammar]")
    entries["own_phrases"] = {
        hole: OwnPhrases(own["share"], {value: phrases for value, phrases in own.items() if value != "share"})
        for hole, own in entries.get("own_phrases", {}).items()
    }
    if unknown := [key for key in entries.get("keys", ()) if key not in KEYS]:
        raise StructureWordsError(f"{path}: keys cannot hold {unknown[0]!r}; legal values: {', '.join(KEYS)}")
    return _made(StructureWords, entries, str(path))


def _made(kind: type, entries: Mapping[str, Any], where: str) -> Any:
    """Make an instance of a dataclass whose fields are the legal keys."""
    legal = [each.name for each in fields(kind)]
    if unknown := [key for key in entries if key not in legal]:
        raise StructureWordsError(f"{where}: unknown key {unknown[0]!r}; legal keys: {', '.join(legal)}")
    needed = [each.name for each in fields(kind) if each.default is MISSING and each.default_factory is MISSING]
    if missing := [key for key in needed if key not in entries]:
        raise StructureWordsError(f"{where}: the key {missing[0]!r} is missing")
    return kind(**entries)


def _frozen(value: Any) -> Any:
    """Convert lists to tuples, at every depth."""
    if isinstance(value, dict):
        return {key: _frozen(entry) for key, entry in value.items()}
    return tuple(value) if isinstance(value, list) else value


def _all_structures() -> dict[str, StructureWords]:
    found = sorted(map(read_structure, FOLDER.glob("*.toml")), key=lambda each: each.number)
    numbers = [each.number for each in found]
    if numbers != list(range(1, len(found) + 1)):
        raise StructureWordsError(f"the files in {FOLDER} must be numbered from 1 without gaps, not {numbers}")
    return {each.name: each for each in found}


# Shape -> its words, in the order of the shapes' numbers.
STRUCTURES: Mapping[str, StructureWords] = _all_structures()


def words_of(shape: str) -> StructureWords:
    """Return the words of a shape that parsers are taught, or of a figure.

    Raises:
        FigureError: for a name that has neither.
    """
    return STRUCTURES[shape] if shape in STRUCTURES else _words_of_figure(figure_named(shape))


def is_shape(name: str) -> bool:
    """Return whether a name is that of a shape or of a figure."""
    try:
        return bool(words_of(name))
    except FigureError:
        return False


@lru_cache(maxsize=256)
def _words_of_figure(figure: Figure) -> StructureWords:
    return StructureWords(
        name=figure.name,
        number=0,
        slots=("x_position", "y_position", "rotation")
        if figure.stacked or figure.places
        else ("size", "x_position", "y_position", "rotation"),
        least=figure.legal[0],
        words=Words(nouns=figure.nouns),
        grammar=Grammar(figure.nouns, ()),
        phrases={},
        keys=("order",) if len(figure.strokes) == 1 else (),
        stacked=figure.stacked,
        figure=figure,
    )


def words_of_all(kind: str) -> tuple[str, ...]:
    """Collect the words of one kind, a field of `Words`, of all shapes."""
    return tuple(dict.fromkeys(word for each in STRUCTURES.values() for word in getattr(each.words, kind)))
