"""Draw labelled sentences of free language from the frames and phrases of `grounding.corpus.templates`.

Labels are per slot, as spoken: a "small tower" is labelled small, and the parser resolves it later.
Texts that have to be refused have no slots.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from grounding.corpus.templates import SLOTS_OF_HOLE, Frame, Hole, all_frames, all_phrases, own_table
from grounding.corpus.typos import roughen
from grounding.spec import FIRST_SHAPES, FIRST_VALUES, SLOTS, SLOTS_OF_SHAPE
from grounding.structure_words import STRUCTURES

# How much more often a frame of a file is drawn: plain frames are mostly holes and stand for many
# sentences; spoken ones are nearest to what people say.
_WEIGHTS = {"frames_plain": 3, "frames_spoken": 2}
_SHAPE_HOLES = ("a_shape", "shape_noun", "do_shape")
# Private characters around the words for objects while a sentence is drawn.
_FIRST, _LAST = "\ue000", "\ue001"
_DRAWN, _MARKS = re.compile(f"{_FIRST}([^{_LAST}]+){_LAST}"), re.compile(f"[{_FIRST}{_LAST}]")
_TABLE = {"a_shape": "shape_noun"}  # the same phrases, with an article


@dataclass(frozen=True)
class LabelledText:
    """A sentence and its labels.

    Attributes:
        text: the sentence.
        labels: slot -> value, `None` if unspecified. A tower may have a size if the text names one.
        refuse: why it has to be refused, one of `grounding.parse_result.REFUSALS`, or `None`.
        objects: the text's words for its objects, where a single hole has drawn them; else `None`.
    """

    text: str
    labels: Mapping[str, str | None]
    refuse: str | None = None
    objects: str | None = None


def paraphrase(rng: np.random.Generator, frame: Frame | None = None) -> LabelledText:
    """Draw one labelled sentence, of a given frame or of any."""
    if frame is None:
        frames = _weighted_frames()
        frame = frames[rng.integers(len(frames))]
    values = _draw_values(frame, rng)
    text = "".join(piece if isinstance(piece, str) else _fill(piece, values, rng) for piece in frame.pieces)
    if frame.refuse:
        labels: dict[str, str | None] = dict.fromkeys(SLOTS)
    else:
        filled = {slot for hole in frame.holes if not hole.negated for slot in SLOTS_OF_HOLE.get(hole.name, ())}
        labels = {slot: values[slot] if slot in filled or slot in frame.labels else None for slot in SLOTS}
    text = roughen(_dressed(text, rng), rng)
    drawn = _DRAWN.findall(text)
    return LabelledText(
        _MARKS.sub("", text),
        labels,
        frame.refuse,
        drawn[0] if len(drawn) == 1 and len(_MARKS.findall(text)) == 2 else None,
    )


@lru_cache(maxsize=1)
def _weighted_frames() -> tuple[Frame, ...]:
    return tuple(frame for name, frames in all_frames().items() for frame in frames * _WEIGHTS.get(name, 1))


def _one_of(phrases: tuple[str, ...], rng: np.random.Generator) -> str:
    return phrases[rng.integers(len(phrases))]


def _draw_values(frame: Frame, rng: np.random.Generator) -> dict[str, str | None]:
    """Draw a value for every slot, including those that the frame fixes; the holes decide which of them are labels."""
    values: dict[str, str | None] = {slot: _one_of(FIRST_VALUES[slot], rng) for slot in SLOTS}
    holes = {hole.name for hole in frame.holes if not hole.negated}
    needed = {slot for name in holes for slot in SLOTS_OF_HOLE.get(name, ())} | set(frame.labels)
    # Nobody asks for a large tower often, but it is asked for.
    lenient = rng.random() < 0.1 and "size" not in frame.labels and "rotation" not in frame.labels
    shapes = [shape for shape in FIRST_SHAPES if lenient or needed - {"shape"} <= set(SLOTS_OF_SHAPE[shape])]
    values["shape"] = _one_of(tuple(shapes), rng)
    nameless = holes & {"a_shape", "shape_noun"} and "do_shape" not in holes and not frame.refuse
    negated = any(hole.negated and hole.name in _SHAPE_HOLES for hole in frame.holes)
    if nameless and not negated and needed - {"shape"} and rng.random() < 0.12:
        values["shape"] = None
    return {**values, **frame.labels}


def _fill(hole: Hole, values: Mapping[str, str | None], rng: np.random.Generator) -> str:
    name = hole.name
    if name not in SLOTS_OF_HOLE:
        return _other(name, rng)
    slots = {slot: _another(slot, values[slot], rng) if hole.negated else values[slot] for slot in SLOTS_OF_HOLE[name]}
    phrases = all_phrases()
    if name == "xy":
        left, back = slots["x_position"], slots["y_position"]
        assert left and back
        x = _one_of(phrases["x_adj"][left], rng) if rng.random() < 0.3 else left
        return _one_of(phrases["xy"]["any"], rng).format(x=x, y=_one_of(phrases["y_adj"][back], rng))
    (value,) = slots.values()
    table = _TABLE.get(name, name)
    shape = values["shape"]
    own = STRUCTURES[shape].own_phrases.get(name) if shape else None
    if shape and own and rng.random() < own.share:
        table = own_table(name, shape)
    phrase = _one_of(phrases[table][value or "any"], rng)
    if name in _SHAPE_HOLES and value is not None and rng.random() < 0.25:
        # The plain word now and then: it is what most people say.
        phrase = value if name != "do_shape" else phrase
    if name == "do_shape":
        return phrase.replace("{o}", _marked(_objects(rng)))
    return f"a {phrase}" if name == "a_shape" else phrase


def _another(slot: str, value: str | None, rng: np.random.Generator) -> str:
    return _one_of(tuple(other for other in FIRST_VALUES[slot] if other != value), rng)


def _other(name: str, rng: np.random.Generator) -> str:
    phrases = all_phrases()
    match name:
        case "objects":
            return _marked(_objects(rng))
        case "object":
            return _marked(_object(rng))
        case "nouns":
            return _marked(_adjective(rng) + _one_of(phrases["objects"]["plural"], rng))
        case "noun":
            return _marked(_one_of(phrases["objects"]["singular"], rng))
        case "idle":
            text = _one_of(phrases["idle"]["any"], rng)
            return text.replace("{o}", _objects(rng)).replace("{s}", _object(rng)).rstrip(".!?")
    return _one_of(phrases[name]["any"], rng)


def _marked(objects: str) -> str:
    return f"{_FIRST}{objects}{_LAST}"


def _adjective(rng: np.random.Generator) -> str:
    """Draw an adjective of the objects; their size and shape say nothing about the structure."""
    return f"{_one_of(all_phrases()['objects']['adjective'], rng)} " if rng.random() < 0.25 else ""


def _object(rng: np.random.Generator) -> str:
    return f"the {_adjective(rng)}{_one_of(all_phrases()['objects']['singular'], rng)}"


def _objects(rng: np.random.Generator) -> str:
    phrases = all_phrases()["objects"]
    kind = rng.random()
    if kind < 0.22:
        return _one_of(phrases["pronoun"], rng)
    if kind < 0.32:
        return _one_of(phrases["group"], rng)
    if kind < 0.42:
        named = [_object(rng) for _ in range(rng.integers(2, 5))]
        return " and ".join([", ".join(named[:-1]), named[-1]])
    text = f"{_one_of(phrases['determiner'], rng)} {_adjective(rng)}{_one_of(phrases['plural'], rng)}"
    if rng.random() < 0.1:
        text += f" {('and', 'but not', 'except')[rng.integers(3)]} the {_one_of(phrases['plural'], rng)}"
    return text


def _dressed(text: str, rng: np.random.Generator) -> str:
    """Add what people say around the sentence: openings, closings and facts."""
    phrases = all_phrases()
    if rng.random() < 0.08:
        fact = _one_of(phrases["fact"]["any"], rng)
        text = f"{fact}. {text}" if rng.random() < 0.6 else f"{text.rstrip('.!?')}. {fact}"
    elif rng.random() < 0.22:
        text = f"{_one_of(phrases['opening']['any'], rng)} {text}"
    if rng.random() < 0.1:
        text = f"{text.rstrip('.!?')}{(' ', ', ')[rng.integers(2)]}{_one_of(phrases['closing']['any'], rng)}"
    return re.sub(r"\b([Aa])n? (?=(\w))", _article, text)


def _article(match: re.Match[str]) -> str:
    return f"{match[1]}n " if match[2] in "aeiouAEIO" else f"{match[1]} "
