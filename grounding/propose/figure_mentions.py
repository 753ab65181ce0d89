"""Find where a text names a figure as a structure: "a heart", "the letter T", "write HI".

Many names of figures are also those of objects and places ("set the table", "the star"), so that the words around
decide: a figure that is to be made is no known thing yet ("a star"), unless the goal so far has it ("turn the star
around").
"""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import cache, lru_cache

from grounding.figures.drawings import drawings_among
from grounding.figures.names import figure_nouns
from grounding.figures.words import WORD
from grounding.resolve.attributes import EXPLETIVES, SceneObject
from grounding.resolve.function_words import (
    DETERMINERS,
    FUNCTION_WORDS,
    GENERIC,
    NOT_OBJECTS,
    NUMBERS,
    PLACE_ADJECTIVES,
    READ_WORDS,
    SHAPE_WORDS,
)
from grounding.resolve.lexicon import GROUPS, KINDS, OTHER_WORDS
from grounding.resolve.word_forms import singular
from grounding.structure_words import STRUCTURES

WORDS = re.compile(r"[^\W_]+(?:['’][^\W_]+)*|[^\w\s]")
_INDEFINITE = frozenset(("a", "an", "another", "one", "some", "any", "each"))
# Adjectives between a determiner and the noun of a figure that are function words elsewhere.
_ADJECTIVES = frozenset("big large huge small tiny medium long short wide single".split()) | PLACE_ADJECTIVES
_OBJECTS = frozenset((*KINDS, *GROUPS, *OTHER_WORDS, *GENERIC))
# Nouns of objects and places: without a determiner they are no figures ("in the middle of table").
_THINGS = _OBJECTS | (NOT_OBJECTS - SHAPE_WORDS) | READ_WORDS
# What changes nothing about a figure, or is read as its size.
HARMLESS = _ADJECTIVES | EXPLETIVES | frozenset(
    "little mini beautiful pretty cute cool neat simple plain basic proper real perfect new fresh good nice great fine "
    "decent awesome amazing gorgeous wonderful elegant own usual normal ordinary regular standard quick tidy clean "
    "complete different toy medium-sized".split()
)  # fmt: skip
_SHAPED = frozenset("shape shapes shaped form formation figure pattern outline".split())
OPENING = re.compile(r"\b(?:open\w*|mouth|gap|hollow)\b", re.IGNORECASE)
_CAPITAL = re.compile(r"(?<![\w.'’&])(?:[A-Z])(?![\w'’&]|\.\w)")
_LETTER = re.compile(
    r"\b(?:capital |upper[- ]?case |block |big )?(?:letter|capital|character|initial) "
    r"[\"'“‘]?([a-z])[\"'”’]?(?![\w'’])",
    re.IGNORECASE,
)
_DIGIT = re.compile(r"\b(?:number|digit|numeral|figure) [\"'“‘]?(\d)[\"'”’]?(?![\w.,]\d|\w)", re.IGNORECASE)
_BARE_DIGIT = re.compile(
    rf"\ban? (?:[a-z]+ )?(\d)(?! (?:by|x|or|to) (?:\d|{'|'.join(NUMBERS)}))(?=\s*(?:[.,;:!?]|$| (?P<next>[a-z]+)))",
    re.IGNORECASE,
)
_WRITTEN = re.compile(
    r"\b(?:write|spell)(?:s|ing)?(?: out| down)?(?: (?:the |a )?(?:words?|names?|letters|initials|text))?[: ]+"
    r"(?:[\"“‘'](?P<quoted>[^\"“”‘’']+)[\"”’']|(?P<word>[A-Z0-9]+(?: [A-Z0-9]+)*|[A-Za-z0-9]{2,})(?![\w'’]))"
)
# Function words after "write" that are not what is to be written: "write it with the cans"; greetings and answers are.
_NEVER_WRITTEN = (FUNCTION_WORDS | DETERMINERS) - frozenset("hi hello hey yes no ok okay thanks".split())
_NAMED_WORD = re.compile(r"\b(?:the|a) words? [\"“‘']?(?P<word>[^\W_]+)[\"”’']?(?![\w'’])", re.IGNORECASE)
_CAPITALS = re.compile(r"(?<![\w'’])[A-Z][A-Z0-9]+(?![\w'’])")


@dataclass(frozen=True)
class Mention:
    """A place of a text that names a figure.

    Attributes:
        first, end: its characters.
        name: of the figure.
        lead: words that stand for the rest of the place, as "make a" for the verb of "write HI".
    """

    first: int
    end: int
    name: str
    lead: str = ""


def names_in(objects: Sequence[SceneObject] | None) -> set[str]:
    """Return the words of the names of a scene's objects."""
    return {word for each in objects or () for word in re.findall(r"[^\W_]+", each.name)}


def mentions_of(text: str, objects: Sequence[SceneObject] | None, before: Collection[str] = ()) -> tuple[Mention, ...]:
    """Find the figures that a text names as structures, in the order of the text.

    Args:
        text: any string.
        objects: of the scene; `None` where it is not known.
        before: the shapes of the goal so far: "the heart" is a figure where it has one.
    """
    names = frozenset(names_in(objects))
    finder = _Finder(text, frozenset(map(str.lower, names)), names, frozenset(before))
    found = list[Mention]()
    for one in (*finder.words(), *finder.letters(), *finder.nouns(), *finder.capitals(), *finder.digits()):
        if all(one.end <= each.first or each.end <= one.first for each in found):
            found.append(one)
    return tuple(sorted(found, key=lambda each: each.first))


@dataclass(frozen=True)
class _Finder:
    """A finder of figures in one text.

    Attributes:
        text: the text.
        things: the words of the names of the scene's objects, in small letters.
        names: the same as they are written.
        before: the shapes of the goal so far.
    """

    text: str
    things: frozenset[str]
    names: frozenset[str]
    before: frozenset[str]

    def words(self) -> list[Mention]:
        """Find what is to be written; after a word also another one in capitals ("make it NO")."""
        found = list[Mention]()
        for match in _WRITTEN.finditer(_small_verbs(self.text)):
            said = match["quoted"] or match["word"]
            if said in _NEVER_WRITTEN and not match["quoted"]:
                continue
            if self.text.isupper():
                said = said.split()[0]
            end = (
                match.start("quoted") + len(match["quoted"]) + 1 if match["quoted"] else match.start("word") + len(said)
            )
            found.append(Mention(match.start(), end, _written(said), lead="make a"))
        named = [
            one for one in _NAMED_WORD.finditer(self.text) if one["word"].lower() not in FUNCTION_WORDS | DETERMINERS
        ]
        found += [Mention(one.start(), one.end(), _written(one["word"])) for one in named]
        if any(shape.startswith(WORD) for shape in self.before) and not self.text.isupper():
            found += [Mention(one.start(), one.end(), _written(one.group())) for one in _CAPITALS.finditer(self.text)]
        return found

    def letters(self) -> list[Mention]:
        """Find letters and digits that are named as such: "the letter t", "number 7"."""
        letters = [(one, f"letter {one[1].upper()}") for one in _LETTER.finditer(self.text)]
        digits = [(one, f"digit {one[1]}") for one in _DIGIT.finditer(self.text)]
        return [
            Mention(one.start(), one.end(), name)
            for one, name in (*letters, *digits)
            if not self._is_compound(one.end()) and not self._is_thing(self._before(one.start())[-1:])
        ]

    def nouns(self) -> list[Mention]:
        """Find the nouns of figures: "a heart", "heart-shaped", and "the heart" where there is one."""
        found, index = list[Mention](), {**_index(), **drawings_among(self.before)}
        for one in _pattern(tuple(index)).finditer(self.text):
            name = index[_bare(one[1])]
            if found and self.text[found[-1].end : one.start()] in (" ", "-") and name:
                found.pop()  # "a spiral staircase" is no spiral
            if name and self._is_made(one.start(), one.end(), name):
                found.append(Mention(one.start(), one.end(), name))
        return found

    def capitals(self) -> list[Mention]:
        """Find single capitals: "a T", "an L-shape", "cups as V"; the words "I" and "A" are none by themselves."""
        found = list[Mention]()
        for one in _CAPITAL.finditer(self.text):
            said, before = one.group(), self._before(one.start())
            shaped = self._after(one.end()) in _SHAPED
            if said in "IA" and not shaped and before[-1:] != ["an"]:
                continue
            if said in self.names or self._is_thing(before[-1:]):
                continue  # "cup B"
            if self._is_made(one.start(), one.end(), f"letter {said}"):
                found.append(Mention(one.start(), one.end(), f"letter {said}"))
        return found

    def digits(self) -> list[Mention]:
        """Find single digits as nouns: "a 7 out of cans", and not "a 5 cm gap"."""
        return [
            Mention(one.start(1), one.end(1), f"digit {one[1]}")
            for one in _BARE_DIGIT.finditer(self.text)
            if not one["next"] or one["next"].lower() in FUNCTION_WORDS - set(NUMBERS)
        ]

    def _is_made(self, first: int, end: int, name: str) -> bool:
        """Return whether the noun at a place is a structure that is to be made, or that the goal so far has."""
        if self._is_compound(end) or self._before(first)[-1:] == ["half"]:
            return False
        determiner, after = self._determiner(first), self._after(end)
        if determiner in _INDEFINITE or name in self.before or after in _SHAPED:
            return True
        bare = self.text[first:end].lower()
        return (
            not determiner and after not in DETERMINERS and bare not in _THINGS and self.text[first - 1 : first] != "-"
        )

    def _determiner(self, first: int) -> str:
        """Return the determiner of the noun at a place, adjectives between them left out; "" where it has none."""
        for word in reversed(self._before(first)[-4:]):
            if word in DETERMINERS:
                return word
            if not word.isalpha() or (word in FUNCTION_WORDS and word not in HARMLESS) or self._is_thing([word]):
                return ""
        return ""

    def _is_compound(self, end: int) -> bool:
        """Return whether the next word is an object, as in "star block"."""
        gap = re.match(r"[ -]*", self.text[end:])
        following = WORDS.match(self.text[end + (gap.end() if gap else 0) :])
        if following is None:
            return False
        word = following.group().lower()
        return word not in _SHAPED and word not in FUNCTION_WORDS and self._is_thing([word])

    def _is_thing(self, words: Sequence[str]) -> bool:
        return any(form in self.things or form in _OBJECTS for word in words for form in (word, singular(word)))

    def _before(self, first: int) -> list[str]:
        return [word.lower() for word in WORDS.findall(self.text[:first])]

    def _after(self, end: int) -> str:
        found = re.match(r"[ -]*([^\W\d_]+)", self.text[end:])
        return found[1].lower() if found else ""


def _small_verbs(text: str) -> str:
    """Return a text with the verbs of writing in small letters, at the same places."""
    return re.sub(r"\b(?:write|spell)\b", lambda found: found.group().lower(), text, flags=re.IGNORECASE)


def _written(said: str) -> str:
    """Return the name of the figure of what is written: a letter, a digit or a word."""
    said = said.strip().upper()
    if len(said) == 1:
        return f"digit {said}" if said.isdecimal() else f"letter {said}"
    return f"{WORD}{said}"


@cache
def _of_shapes() -> dict[str, str]:
    """Return noun -> shape of the shapes that are no figures."""
    return {
        _bare(noun): shape.name
        for shape in STRUCTURES.values()
        for noun in (shape.name, *shape.words.nouns, *shape.grammar.nouns, *shape.phrases["noun"])
    }


def _index() -> dict[str, str]:
    """Return noun -> figure of all figures, and of the nouns of other shapes "": "plus sign" is a cross."""
    figures = {_bare(noun): name for name, nouns in figure_nouns().items() for noun in nouns}
    return figures | dict.fromkeys(_of_shapes(), "")


def figures_read_otherwise(text: str) -> list[tuple[int, int, str]]:
    """Find the names of figures that are read as other shapes, "an arch" as an arc: their characters, and the shape."""
    figures = figure_nouns()
    return _found(text, tuple(noun for noun in _of_shapes() if noun in figures))


def shapes_without_size(text: str) -> list[tuple[int, int, str]]:
    """Find the nouns of shapes that have no size, "a tower": their characters, and the shape."""
    return _found(text, tuple(noun for noun, shape in _of_shapes().items() if "size" not in STRUCTURES[shape].slots))


def _found(text: str, nouns: tuple[str, ...]) -> list[tuple[int, int, str]]:
    """Find nouns of shapes in a text: their characters, and the shape."""
    return [(*one.span(1), _of_shapes()[_bare(one[1])]) for one in _pattern(nouns).finditer(text)]


def shapes_named(text: str) -> set[str]:
    """Return the shapes, figures aside, that a text names by a noun or by a verb."""
    nouns = {shape for _, _, shape in _found(text, tuple(_of_shapes()))}
    verbs = {
        one.name
        for one in STRUCTURES.values()
        for verb in one.words.arranging
        if re.search(rf"\b{verb}", text, re.IGNORECASE)
    }
    return nouns | verbs


@lru_cache(maxsize=4096)
def _bare(noun: str) -> str:
    return " ".join(re.split(r"[\s-]+", noun.lower()))


@cache
def _pattern(nouns: tuple[str, ...]) -> re.Pattern[str]:
    """Return the pattern of nouns of more than one character, plurals included."""
    longest = sorted((noun for noun in nouns if len(noun) > 1), key=len, reverse=True)
    words = "|".join(re.escape(noun).replace(r"\ ", "[ -]") for noun in longest)
    return re.compile(rf"\b({words})(?:e?s)?\b", re.IGNORECASE)
