"""Free variations on the corpus, for training the parser: what people say instead of the vocabulary.

`paraphrase` draws one labelled sentence. Phrases whose place in their table is a multiple of six
(less one) are held out: training never sees them, calibration and evaluation do.
Labels are per slot, as spoken: a "small tower" is labelled small, and the parser resolves it later.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np

from grounding import phrases
from grounding.slot_reader import OTHER_SHAPE
from grounding.spec import LEGAL_VALUES, SLOTS, SLOTS_OF_SHAPE

HOLD_OUT_EVERY = 6


@dataclass(frozen=True)
class LabelledText:
    """A sentence and what it says: slot -> value, `None` where it says nothing.

    The shape may also be `OTHER_SHAPE`, and a tower may carry a size.
    """

    text: str
    labels: dict[str, str | None]


def _pick(table: tuple[str, ...], rng: np.random.Generator, held_out: bool) -> str:
    """One phrase: never a held-out one for training, and half the time one of those otherwise."""
    reserved = table[HOLD_OUT_EVERY - 1 :: HOLD_OUT_EVERY]
    if held_out and reserved and rng.random() < 0.5:
        return reserved[rng.integers(len(reserved))]
    choices = [phrase for i, phrase in enumerate(table) if i % HOLD_OUT_EVERY != HOLD_OUT_EVERY - 1]
    return choices[rng.integers(len(choices))]


def draw_labels(rng: np.random.Generator) -> dict[str, str | None]:
    """A random wish: a shape or none, and some of its slots."""
    shapes = ("circle", "line", "tower", "table setting", None, OTHER_SHAPE)
    shape = shapes[rng.choice(6, p=[0.2, 0.22, 0.16, 0.14, 0.2, 0.08])]
    labels: dict[str, str | None] = {slot: None for slot in SLOTS} | {"shape": shape}
    for slot in SLOTS[1:]:
        legal = slot in SLOTS_OF_SHAPE[None if shape == OTHER_SHAPE else shape]
        if rng.random() < (0.4 if legal else 0.1):
            labels[slot] = str(rng.choice(LEGAL_VALUES[slot]))
    return labels


def paraphrase(rng: np.random.Generator, held_out: bool = False) -> LabelledText:
    """One labelled sentence of free language; `held_out` mixes in the phrases kept from training."""
    pick = partial(_pick, rng=rng, held_out=held_out)
    labels = draw_labels(rng)
    if not any(labels.values()):
        return LabelledText(_dirty(pick(phrases.IDLE).format(o=_objects(pick, rng)), rng), labels)
    if rng.random() < 0.04:
        return LabelledText(_dirty(_telegram(labels, pick, rng), rng), labels)
    where, turn = _where(labels, pick, rng), _turn(labels, pick, rng)
    core = _core(labels, pick, rng, bool(where or turn))
    tail = [part for part in (where, turn) if part]
    if rng.random() < 0.4:
        tail.reverse()
    separator = ", " if rng.random() < 0.25 else " "
    if where and rng.random() < 0.2:
        text = f"{where}, {core}" + (f"{separator}{turn}" if turn else "")
    else:
        opening = pick(phrases.OPENINGS)
        text = separator.join([f"{opening} {core}" if opening else core, *tail])
    if rng.random() < 0.15:
        text += separator + pick(phrases.CLOSINGS)
    return LabelledText(_dirty(text, rng), labels)


def _objects(pick, rng: np.random.Generator) -> str:
    if rng.random() < 0.25:
        return pick(phrases.OBJECT_PRONOUNS)
    if rng.random() < 0.12:
        named = [f"the {pick(phrases.SINGLE_NOUNS)}" for _ in range(rng.integers(1, 4))]
        return " and ".join([", ".join(named[:-1]), named[-1]] if len(named) > 1 else named)
    adjective = pick(phrases.OBJECT_ADJECTIVES) + " " if rng.random() < 0.25 else ""
    text = f"{pick(phrases.DETERMINERS)} {adjective}{pick(phrases.OBJECT_NOUNS)}"
    return f"{text} and the {pick(phrases.OBJECT_NOUNS)}" if rng.random() < 0.15 else text


def _core(labels, pick, rng: np.random.Generator, has_tail: bool) -> str:
    """Verb, objects, shape and size; without shape and size only where a tail says something."""
    shape, size, objects = labels["shape"], labels["size"], _objects(pick, rng)
    adverb = f" {pick(phrases.SIZE_ADVERBS[size])}" if size else ""
    if shape in phrases.SHAPE_ACTIONS and rng.random() < 0.35:
        return pick(phrases.SHAPE_ACTIONS[shape]).format(o=objects) + adverb
    if shape is None and ((has_tail and not size) or rng.random() < 0.5) and rng.random() < 0.7:
        return f"{pick(phrases.PLACE_VERBS)} {objects}{adverb}"
    noun = pick(phrases.SHAPE_NOUNS[shape or ""])
    if size and rng.random() < 0.75:
        length = shape == "line" and rng.random() < 0.4
        adjective = phrases.LINE_LENGTHS[size] if length else pick(phrases.SIZE_ADJECTIVES[size])
        noun, adverb = f"{adjective} {noun}", ""
    a = noun if rng.random() < 0.1 else ("an " if noun[0] in "aeiou" else "a ") + noun
    kind = rng.random()
    if kind < 0.5:
        return f"{pick(phrases.PLACE_VERBS)} {objects} {pick(phrases.INTO)} {a}{adverb}"
    if kind < 0.7:
        return f"{pick(phrases.BUILD_VERBS)} {a} {pick(phrases.FROM)} {objects}{adverb}"
    if kind < 0.85:
        return f"{pick(phrases.BUILD_VERBS)} {a}{adverb}"
    if kind < 0.93:
        return f"{objects} should {'form' if rng.random() < 0.5 else 'be in'} {a}{adverb}"
    return pick(phrases.WISHES).format(a=a) + adverb


def _telegram(labels, pick, rng: np.random.Generator) -> str:
    """The bare tokens, in any order: "circle, medium, right, facing north"."""
    words = [labels[slot] for slot in ("size", "x_position", "y_position") if labels[slot]]
    if labels["shape"]:
        words.append(pick(phrases.SHAPE_NOUNS[labels["shape"]]))
    if labels["rotation"]:
        words.append(("" if rng.random() < 0.5 else "facing ") + labels["rotation"])
    rng.shuffle(words)
    return (", " if rng.random() < 0.6 else " ").join(words)


def _where(labels, pick, rng: np.random.Generator) -> str:
    x, y, place = labels["x_position"], labels["y_position"], pick(phrases.PLACES)
    if x and y and rng.random() < 0.6:
        side = x if x != "center" or rng.random() < 0.7 else "centre"
        return pick(phrases.CORNERS).format(y=pick(phrases.Y_ADJECTIVES[y]), x=side, p=place)
    parts = [pick(phrases.X_PHRASES[x]).format(p=place)] if x else []
    parts += [pick(phrases.Y_PHRASES[y]).format(p=pick(phrases.PLACES))] if y else []
    if rng.random() < 0.4:
        parts.reverse()
    return (" and " if rng.random() < 0.2 else " ").join(parts)


def _turn(labels, pick, rng: np.random.Generator) -> str:
    rotation = labels["rotation"]
    if not rotation:
        return ""
    ring = labels["shape"] == "circle" and rng.random() < 0.3
    if rng.random() < 0.75 or ring:
        heading = pick(phrases.COMPASS).format(c=rotation if rng.random() < 0.9 else rotation.capitalize())
        return pick(phrases.OPENINGS_OF_RING if ring else phrases.TURNS).format(r=heading)
    return f"{'facing' if rng.random() < 0.7 else 'turned'} {pick(phrases.ROTATION_SYNONYMS[rotation])}"


def _dirty(text: str, rng: np.random.Generator) -> str:
    """Casing, punctuation, a dropped article and a typing error, now and then."""
    if rng.random() < 0.1:
        text = text.replace(" the ", " ").replace(" a ", " ")
    words = text.split(" ")
    if rng.random() < 0.18:
        place = int(rng.integers(len(words)))
        word = words[place]
        if len(word) > 4:
            i = int(rng.integers(1, len(word) - 1))
            swapped = word[:i] + word[i + 1] + word[i] + word[i + 2 :]
            dropped, doubled = word[:i] + word[i + 1 :], word[:i] + word[i] + word[i:]
            words[place] = (swapped, dropped, doubled)[rng.integers(3)]
    text = " ".join(words)
    if rng.random() < 0.35:
        text = text[:1].upper() + text[1:]
    if rng.random() < 0.03:
        text = text.upper()
    return text + ("", "", "", ".", "!", "?")[rng.integers(6)]
