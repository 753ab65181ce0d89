"""Say which actions may follow one another, so that whatever the network writes is a goal."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass, field
from functools import cache

from grounding.goal_network.vocabulary import (
    HEADS,
    KEY_GROUPS,
    KEYWORD,
    KEYWORDS,
    MOST_COUNT,
    MOST_PARTS,
    MOST_PHRASES,
    MOST_STRUCTURES,
    NO_GOAL,
    NUMBER_OF,
    PLACED,
    RANK_OF,
    STRUCTURE_HEADS,
    Action,
)
from grounding.goals.parts import DIRECTIONAL, MOVE_DIRECTIONS, ORDER_KEYS, SHAPES_OF_KEY, order_starts
from grounding.spec import SLOTS_OF_SHAPE, X_POSITIONS, Y_POSITIONS

_SLOT_OF_GROUP = {"size": "size", "x": "x_position", "y": "y_position", "facing": "rotation"}
_KEY_OF_GROUP = {"group": "group_by"}
_LENGTHS = ("gap", "radius", "length")
_STRUCTURES = tuple(f"structure {number}" for number in range(1, MOST_STRUCTURES + 1))
_END = "<end>"


@dataclass(frozen=True)
class Legal:
    """What may come next.

    Attributes:
        keywords: numbers of the keywords that may come.
        start: whether a phrase may begin, at any word.
        end_from: the first word of the phrase that must end now, or `None`.
    """

    keywords: frozenset[int] = field(default_factory=frozenset)
    start: bool = False
    end_from: int | None = None


# Yields what may come, takes what comes; the value of a step is the keyword that comes, "" for a phrase.
Steps = Generator[Legal, Action, None]
_Step = Generator[Legal, Action, str]
_Words = tuple[str, ...] | frozenset[str]


def legal_actions(answers: bool = True) -> Steps:
    """Yield what may come next and take the action that does, until the goal is written.

    Args:
        answers: whether an answer may be written in place of a goal.
    """
    word = yield from _one(frozenset((*HEADS, *NO_GOAL) if answers else HEADS))
    parts = 0
    while word != _END:
        parts += 1
        after = (*HEADS, _END) if parts < MOST_PARTS else (_END,)
        if word in NO_GOAL:
            word = yield from _one((_END,))
        elif word in STRUCTURE_HEADS:
            word = yield from _structure(word.removesuffix(" of"), after)
        elif word == "place of":
            word = yield from _place(after)
        elif word == "move of":
            ways = tuple(f"move {way}" for way in MOVE_DIRECTIONS)
            yield from _objects(ways, ("(all)",))
            word = yield from _length(after)
        else:
            word = yield from _objects(after)


@cache
def _numbers(keywords: _Words) -> frozenset[int]:
    return frozenset(NUMBER_OF[word] for word in keywords)


def _one(keywords: _Words, start: bool = False) -> _Step:
    action = yield Legal(_numbers(keywords), start)
    return KEYWORDS[action.value] if action.kind == KEYWORD else ""


def _phrase(first: Action) -> Generator[Legal, Action, None]:
    yield Legal(end_from=first.value)


def _objects(after: _Words, instead: _Words = ()) -> _Step:
    """Take phrases, or one keyword in place of them; return the keyword of `after` that follows."""
    action = yield Legal(_numbers(instead), True)
    if action.kind == KEYWORD:
        return (yield from _one(after))
    follow = _numbers(after)
    for count in range(1, MOST_PHRASES + 1):
        yield from _phrase(action)
        action = yield Legal(follow, count < MOST_PHRASES)
        if action.kind == KEYWORD:
            break
    return KEYWORDS[action.value]


def _length(after: _Words) -> _Step:
    action = yield Legal(start=True)
    yield from _phrase(action)
    return (yield from _one(after))


def _structure(shape: str, after: _Words) -> _Step:
    keys = _keys_of(None if shape == "structure" else shape)

    def following(rank: int) -> tuple[str, ...]:
        return (*(key for key in keys if RANK_OF[key] > rank), *after)

    word = yield from _objects(following(-1), ("(all)",))
    while word in keys:
        rest = following(RANK_OF[word])
        if word.startswith("order "):
            word = yield from _order(word, shape, rest)
        elif word in _LENGTHS or word == "around":
            word = yield from _length(rest)
        elif word in ("rows", "columns"):
            yield from _one(tuple(f"count {number}" for number in range(1, MOST_COUNT + 1)))
            word = yield from _one(rest)
        else:
            word = yield from _one(rest)
    return word


@cache
def _keys_of(shape: str | None) -> frozenset[str]:
    found: list[str] = []
    for group in KEY_GROUPS:
        name = group[0].split(" ")[0]
        if name in _SLOT_OF_GROUP:
            found += group if _SLOT_OF_GROUP[name] in SLOTS_OF_SHAPE[shape] else ()
        elif shape in SHAPES_OF_KEY[_KEY_OF_GROUP.get(name, name)]:
            found += group
    return frozenset(found)


def _order(word: str, shape: str, rest: _Words) -> _Step:
    starts = tuple(f"from {end}" for end in order_starts(shape))
    ways = () if word == f"order {ORDER_KEYS[-1]}" else ("ascending", "descending")
    word = yield from _one((*ways, *starts, *rest))
    if word in ways:
        word = yield from _one((*starts, *rest))
    if word in starts:
        word = yield from _one(rest)
    return word


def _place(after: _Words) -> _Step:
    relations = tuple(f"rel {relation}" for relation in PLACED)
    word = yield from _objects((*relations, "at"), (*_STRUCTURES, "(all)"))
    if word == "at":
        x, y = tuple(f"x {one}" for one in X_POSITIONS), tuple(f"y {one}" for one in Y_POSITIONS)
        word = yield from _one((*x, *y))
        if word in x:
            word = yield from _one((*y, *after))
        if word in y:
            word = yield from _one(after)
        return word
    measured = word.removeprefix("rel ") in (*DIRECTIONAL, "next to")
    word = yield from _objects((*after, "distance") if measured else after, _STRUCTURES)
    if word == "distance":
        word = yield from _length(after)
    return word
