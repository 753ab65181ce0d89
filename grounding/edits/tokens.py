"""Divide a correction into typed tokens: lengths, angles, factors, directions, and what of the goal it speaks of."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from grounding.goals.goal import Goal
from grounding.goals.parts import Part, StructurePart
from grounding.resolve.attributes import SceneObject
from grounding.resolve.measures import length_at, number_at
from grounding.resolve.object_names import read_name, telling_words
from grounding.resolve.tokens import Words, split
from grounding.resolve.word_forms import singular
from grounding.structure_words import words_of

Value = float | str
TO = "to"  # "reduce it to 12 cm" names the value itself


@dataclass(frozen=True)
class Token:
    """A word, or several, of one kind.

    Attributes:
        kind: "length" (m), "number", "angle" (degrees), "factor", "more", "less", "change" (1 or -1), "key" (which
            length), "direction", "opposite", "side", "way", "swap", "reverse", "turn", "rotation" (1 for clockwise,
            -1), "move", "bit", "be" ("like", "make it").
        value: as its kind says; otherwise the word.
    """

    kind: str
    value: Value


@dataclass(frozen=True)
class Tokens:
    """The tokens of a correction every word of which is known.

    Attributes:
        tokens: in their order, without what they are about.
        targets: the parts of the goal that are named; `None` where none is.
        named: objects that are named, in their order.
        every: whether all parts are meant: "both".
    """

    tokens: tuple[Token, ...]
    targets: tuple[int, ...] | None
    named: tuple[int, ...]
    every: bool

    @property
    def kinds(self) -> str:
        """Return the kinds of the tokens, a space between them."""
        return " ".join(token.kind for token in self.tokens)

    def value(self, kind: str) -> Value | None:
        """Return the value of the first token of a kind."""
        return next((token.value for token in self.tokens if token.kind == kind), None)


def _phrases(kind: str, values: Mapping[Value, str] | str) -> dict[tuple[str, ...], Token]:
    """Return phrases, divided by commas, as tokens of a kind; without a mapping each is its own value."""
    if isinstance(values, str):
        values = {phrase: phrase for phrase in values.split(", ")}
    return {tuple(one.split()): Token(kind, value) for value, listed in values.items() for one in listed.split(", ")}


_PHRASES: Mapping[tuple[str, ...], Token] = {
    **_phrases("more", "more, further, farther, wider, longer, bigger, larger, roomier, looser, extra, another, add, "
               "plus, increase, increased, widen, widened, enlarge, expand, extend, grow, stretch, beyond, over"),
    **_phrases("less", "less, closer, nearer, shorter, tighter, narrower, smaller, minus, reduce, reduced, decrease, "
               "decreased, shrink, shorten, tighten, cut, subtract, back off"),
    # Of a length that is named alone: "drop the cup" is something else.
    **_phrases("change", {1.0: "raise, raised, up", -1.0: "lower, lowered, drop, dropped, down"}),
    **_phrases("key", {
        "gap": "gap, gaps, spacing, spaces, space, apart, interval, intervals, separation, clearance, between, "
        "between them, in between",
        "radius": "radius", "diameter": "diameter, across", "length": "length, long", "distance": "distance, distances",
    }),
    **_phrases("factor", {2.0: "double, twice, dbl, two times, times two", 0.5: "half, halve, halved",
                          3.0: "triple, three times, thrice"}),
    **_phrases("angle", {
        90.0: "quarter, a quarter, quarter turn, a quarter turn, a right angle",
        180.0: "half a turn, a half turn, half turn, upside down",
    }),
    **_phrases("rotation", {1.0: "clockwise",
                            -1.0: "counterclockwise, anticlockwise, counter clockwise, anti clockwise"}),
    **_phrases("direction", {
        "left": "left, leftward, leftwards", "right": "right, rightward, rightwards",
        "away": "back, backward, backwards, rear, away from me, away from us, further away from me, "
        "farther from me, further from me, far from me, away, deeper",
        "closer": "forward, forwards, front, toward me, towards me, toward us, close to me, "
        "closer to me, nearer to me, nearer me, closer to us, to me, closer 2 me",
    }),
    **_phrases("opposite", "other, opposite"),
    **_phrases("side", "side, sides"),
    **_phrases("way", "way, way around, way round, end, direction, around, round, about"),
    **_phrases("swap", "swap, swapped, switch, switched, exchange, exchanged, trade, interchange, change places, "
               "change sides, vice versa, swap places, trade places, switch places, swap positions"),
    **_phrases("reverse", "reverse, reversed, flip, flipped, mirror, invert"),
    **_phrases("turn", "turn, rotate, spin, swivel, twist, turned, rotated"),
    **_phrases("move", "move, shift, push, pull, slide, put, nudge, scoot, scooch, bring, drag, place"),
    **_phrases("bit",
               "bit, little, touch, tad, smidge, smidgen, slightly, somewhat, notch, step, teeny, tiny, wee, some"),
    **_phrases("be", "like, say, make it, make that, about"),
    **_phrases("filler", "as far, as wide, as big, as much, as large, so far, so long, so wide, that far, "
               "that much, that wide, as far apart, so big, apart, whole thing"),
    **_phrases("every", "both, each, all, everything, every, whole, lot"),
}  # fmt: skip
_LONGEST = max(map(len, _PHRASES))
_FILLERS = frozenset(
    "the a an my it its them that this these those they their no nope nah ok okay oh ah and but then now please pls "
    "actually rather hmm hm um uh well yes yeah just only can could would you i we want i'd by to of with on at for in "
    "from where is it's as again so than make let let's have give need needs be should go goes get set please , . ! ? "
    ": ; sorry wait cheers thanks one ones thing stands".split()
)
_BEFORE_A_VALUE = frozenset((",", ":", TO))
_WITH_OBJECTS = frozenset("add plus another minus reduce subtract extra".split())
_DEGREES = frozenset("degree degrees deg °".split())


def tokens_of(text: str, goal: Goal, objects: Sequence[SceneObject]) -> Tokens | None:
    """Divide a correction into tokens.

    Args:
        text: any string.
        goal: that it is said about; its objects are indices.
        objects: of the scene.

    Returns:
        The tokens; `None` where a word is no part of any: then it says more than the rules of edits know.
    """
    said, place = split(text), 0
    found, targets, named = list[Token](), dict[int, None](), list[int]()
    every = False
    while place < len(said.words):
        if said.word(place) in _BEFORE_A_VALUE and found and _is_value(said, place + 1, said.word(place) == TO):
            found.append(Token("be", said.word(place)))  # "closer, 3 cm" is not 3 cm closer
            place += 1
        elif (token := _measure(said, place) or _phrase(said.words, place)) is not None:
            one, place = token
            every = every or one.kind == "every"
            found += [one] if one.kind not in ("every", "filler") else []
        elif parts := _structures(goal, said.word(place)):
            targets.update(dict.fromkeys(parts))
            place += 1
        elif (group := _objects(goal, objects, said, place)) is not None:
            if found and found[-1].kind == "factor" and "of" in said.words[max(0, place - 2) : place]:
                return None  # "half of the cups"
            indices, place = group
            named += [index for index in indices if index not in named]
        elif said.word(place) in _FILLERS:
            place += 1
        else:
            return None
    if named:
        targets = dict.fromkeys(_parts_with(goal, named))
    if named and found and found[0].value in _WITH_OBJECTS:
        return None  # "add the spoon, 5 cm"
    return Tokens(tuple(found), tuple(targets) if targets or named else None, tuple(named), every)


def _is_value(said: Words, place: int, bare: bool) -> bool:
    """Return whether a length stands at a place, or, if `bare`, a number."""
    return length_at(said, place) is not None or (bare and number_at(said, place) is not None)


def _measure(said: Words, place: int) -> tuple[Token, int] | None:
    """Read a length, an angle, a factor or a number, and the place after it."""
    if said.word(place) != "another" and (length := length_at(said, place)) is not None:
        return Token("length", length[0]), length[1]
    if (number := number_at(said, place)) is None or number[0] < 0:
        return None
    value, end = number
    if said.word(end) in _DEGREES:
        return Token("angle", value), end + 1
    if said.word(end) in ("times", "x"):
        return Token("factor", value), end + 1
    return (Token("number", value), end) if said.word(place)[0].isdigit() else None


def _phrase(words: Sequence[str], place: int) -> tuple[Token, int] | None:
    for length in range(_LONGEST, 0, -1):
        if (token := _PHRASES.get(tuple(words[place : place + length]))) is not None:
            return token, min(place + length, len(words))
    return None


def _structures(goal: Goal, word: str) -> list[int]:
    """Return the numbers of the structures of which a noun speaks."""
    structures = [
        (n, part.shape) for n, part in enumerate(goal.parts) if isinstance(part, StructurePart) and part.shape
    ]
    return [n for n, shape in structures if singular(word) in map(str.lower, words_of(shape).words.nouns)]


def _objects(goal: Goal, objects: Sequence[SceneObject], said: Words, place: int) -> tuple[list[int], int] | None:
    """Read a colour, a noun and a number that speak of objects of the goal, and the place after them."""
    there, end = list(range(len(objects))), place
    for end in range(place, len(said.words) + 1):
        left = [index for index in there if singular(said.word(end)) in _words(objects[index], end > place)]
        if not left or (said.word(end).isdecimal() and length_at(said, end) is not None):
            break  # "the cup 2 cm more" is no cup 2
        there = left
    inside = [index for index in there if index in _named(goal)]
    return None if end == place or not inside else (inside, end)


def _words(one: SceneObject, after: bool) -> set[str]:
    return telling_words(one) | ({str(read_name(one.name).number or 1)} if after else set())


def _named(goal: Goal) -> set[int]:
    return {index for index in goal.named_objects() if isinstance(index, int)}


def _parts_with(goal: Goal, named: Iterable[int]) -> list[int]:
    """Return the parts that place the named objects: those that place nothing else, where there are any."""
    own = {n: set(part.objects) for n, part in enumerate(goal.parts) if isinstance(part.objects, tuple)}
    exact = [n for n, objects in own.items() if objects <= set(named)]
    some = [n for n, objects in own.items() if objects & set(named)]
    by = [n for n, part in enumerate(goal.parts) if set(named) & set(_reference(part))]
    return exact or some or by


def _reference(part: Part) -> tuple[int | str, ...]:
    second = part.around if isinstance(part, StructurePart) else part.reference
    return second if isinstance(second, tuple) else ()
