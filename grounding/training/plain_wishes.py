"""Draw plain wishes about the objects of a scene: what people type first, and what labelled texts have few of.

Most short labelled texts are remarks or wishes that cannot be built, so that a network that sees only these takes "put
the banana in the bowl" for one.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from grounding.goal_benchmark.rows import goal_scenes
from grounding.goal_network.goal_rendition import object_phrases
from grounding.resolve.attributes import SceneObject
from grounding.structure_words import STRUCTURES
from grounding.training.goal_lines import LabelError, LabelledGoal, labelled

_PUT = (
    "put {a}",
    "place {a}",
    "set {a}",
    "move {a}",
    "please put {a}",
    "can you put {a}",
    "{a}",
    "i want {a}",
    "lay {a}",
    "get {a}",
)
RELATIONS = {
    "left of": ("left of", "to the left of", "on the left of", "at the left of", "on the left side of"),
    "right of": ("right of", "to the right of", "on the right of", "at the right of", "on the right side of"),
    "in front of": ("in front of", "before"), "behind": ("behind", "at the back of", "in the back of"),
    "next to": ("next to", "beside", "by"),
    "on": ("on", "on top of", "onto"), "inside": ("in", "inside", "into"),
}  # fmt: skip
BESIDE = ("left of", "right of", "in front of", "behind", "next to")  # where a structure can stand
PLACES = {
    "left": ("on the left", "to the left", "on the left side", "at the left"),
    "right": ("on the right", "to the right", "on the right side", "at the right"),
    "top": ("at the back", "at the far end", "far away", "to the back"),
    "bottom": ("at the front", "near me", "at the near end", "to the front"),
}  # fmt: skip
_WAYS = {"left": "to the left", "right": "to the right", "away": "away from me", "closer": "closer to me"}
_JOINS = (" and ", ", and ", ", then ", ". ", " and then ")
TWO = 0.2  # share of the draws that are two wishes about different objects
_KINDS = (
    "relation",
    "relation",
    "place",
    "between",
    "swap",
    "move",
    "structure",
    "structure",
    "beside",
    "listed",
    "listed",
    "all",
)
_EVERYTHING = (
    "everything",
    "all objects",
    "all of the objects",
    "every object",
    "all of it",
    "all the things",
    "it all",
    "all",
)
_ONLY = ("only {said}", "just {said}", "nothing but {said}", "{said} only", "{said} and nothing else")
_VERBS = {"line": ("line up", "align"), "tower": ("stack", "stack up"), "cluster": ("gather", "collect", "bunch up")}
OFTEN, SELDOM = 0.4, 0.15  # shares of the structures that have a place, and of those that say "only"
MOST_LISTED = 5


class PlainWishes:
    """Wishes that are drawn.

    Args:
        rng: draws.
    """

    def __init__(self, rng: np.random.Generator) -> None:
        self.rng = rng

    def draw(self) -> LabelledGoal:
        """Draw a task."""
        while True:
            scene = str(self._one(list(goal_scenes())))
            objects = goal_scenes()[scene]
            places = self.rng.permutation(len(objects)).tolist()
            found = [self._wish(places, objects)]
            if self.rng.random() < TWO and "structure 1" not in found[0][1]:
                left = [place for place in places if place not in found[0][2]]
                found += [self._wish(left, objects)] if len(left) > 1 else []
            if len(found) > 1 and found[0][1].partition(" of ")[0] in STRUCTURES:
                found[1] = (found[1][0], found[1][1].replace("structure 1", "structure 2"), found[1][2])
            try:
                return labelled(
                    str(self._one(_JOINS)).join(text for text, *_ in found),
                    "; ".join(line for _, line, _ in found),
                    0,
                    scene,
                )
            except LabelError:  # as of too few objects for a phrase
                continue

    def _wish(self, places: Sequence[int], objects: Sequence[SceneObject]) -> tuple[str, str, tuple[int, ...]]:
        """Draw a wish: its text, its line, and the objects that it names."""
        kind = str(self._one(_KINDS))
        alike = [place for place in places if objects[place].name.split()[0] == objects[places[0]].name.split()[0]]
        if kind == "all":
            return (*self._structure(str(self._one(_EVERYTHING)), "(all)", len(places)), tuple(places))
        if kind in ("structure", "beside") and len(alike) > 1:
            phrases = [phrase.words for phrase in object_phrases(alike, objects)]
            others = [place for place in places if place not in alike]
            beside = kind == "beside" and bool(others)
            text, line = self._structure(
                " and ".join(phrases), " + ".join(phrases), len(alike), 0.0 if beside else OFTEN
            )
            if not beside:
                return text, line, tuple(alike)
            relation, b = str(self._one(BESIDE)), object_phrases(others[:1], objects)[0].words
            text = f"{text} {self._one(RELATIONS[relation])} {b}"
            return text, f"{line}; place of structure 1, {relation} {b}", (*alike, others[0])
        if kind == "listed" and len(places) > 1:
            members = places[: int(self.rng.integers(2, MOST_LISTED + 1))]
            phrases = self._listed(members, objects)
            said = f"{', '.join(phrases[:-1])} and {phrases[-1]}"
            return (*self._structure(said, " + ".join(phrases), len(members)), tuple(members))
        names = [object_phrases((place,), objects)[0].words for place in places]
        a, b, c = (names * 3)[:3]
        put = str(self._one(_PUT)).format(a=a)
        if kind == "place":
            value = str(self._one(list(PLACES)))
            return f"{put} {self._one(PLACES[value])}", f"place of {a}, at {value}", tuple(places[:1])
        if kind == "move":
            way, length = str(self._one(list(_WAYS))), f"{self.rng.integers(2, 21)} cm"
            return f"move {a} {length} {_WAYS[way]}", f"move of {a}, {way} {length}", tuple(places[:1])
        if kind == "swap" and len(places) > 1:
            return f"swap {a} {self._one(('and', 'with'))} {b}", f"swap of {a} + {b}", tuple(places[:2])
        if kind == "between" and len(places) > 2:
            return f"{put} between {b} and {c}", f"place of {a}, between {b} + {c}", tuple(places[:3])
        relation = str(self._one(list(RELATIONS)))
        return f"{put} {self._one(RELATIONS[relation])} {b}", f"place of {a}, {relation} {b}", tuple(places[:2])

    def _listed(self, members: Sequence[int], objects: Sequence[SceneObject]) -> list[str]:
        """Draw what each of some objects is called: by its kind and colour, or by a number as the tool itself does."""
        if self.rng.random() < 0.5:
            return [object_phrases((place,), objects)[0].words for place in members]
        noun = str(self._one(("object", objects[members[0]].name.split()[0])))
        numbers = 1 + self.rng.choice(MOST_LISTED + 4, len(members), replace=False)
        return [f"{noun} {number}" for number in (np.sort(numbers) if self.rng.random() < 0.7 else numbers)]

    def _structure(self, said: str, phrases: str, count: int, placed: float = OFTEN) -> tuple[str, str]:
        """Draw a wish for a structure of some objects, with or without a place.

        Args:
            said: the words for the objects.
            phrases: these words in the label.
            count: of the objects.
            placed: share of the draws with a place.
        """
        shapes = [name for name, words in STRUCTURES.items() if words.least <= count and not words.pieces]
        shape = str(self._one(shapes))
        noun = str(self._one(STRUCTURES[shape].words.nouns))
        where, line = "", f"{shape} of {phrases}"
        if self.rng.random() < placed:
            value = str(self._one(list(PLACES)))
            where, line = f" {self._one(PLACES[value])}", f"{line}, {value}"
        if phrases != "(all)" and self.rng.random() < SELDOM:
            said = str(self._one(_ONLY)).format(said=said)
        forms = (f"put {said} in a {noun}", f"make a {noun} of {said}", f"arrange {said} in a {noun}",
                 f"{said} in a {noun}", f"build a {noun} with {said}", f"a {noun} of {said}, please",
                 f"use {said} to make a {noun}", f"{noun} with {said}", f"{noun} out of {said}",
                 f"{said}, {noun}")  # fmt: skip
        text = str(self._one(forms))
        if shape in _VERBS and self.rng.random() < OFTEN:
            text = f"{self._one(_VERBS[shape])} {said}"
        return f"{text.removesuffix(', please')}{where}", line

    def _one(self, values: Sequence[str]) -> str:
        return values[int(self.rng.integers(len(values)))]
