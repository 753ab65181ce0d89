"""Draw plain wishes about the objects of a scene: what people type first, and what labelled texts have few of.

Most short labelled texts are remarks or wishes that cannot be built, so that a network that sees only these takes "put the banana in
the bowl" for one.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from grounding.goal_benchmark.rows import goal_scenes
from grounding.goal_network.goal_rendition import object_phrases
from grounding.resolve.attributes import SceneObject
from grounding.structure_words import STRUCTURES
from grounding.training.goal_lines import LabelError, LabelledGoal, labelled

_PUT = ("put {a}", "place {a}", "set {a}", "move {a}", "please put {a}", "can you put {a}", "{a}", "i want {a}", "lay {a}", "get {a}")
_RELATIONS = {
    "left of": ("left of", "to the left of", "on the left of"), "right of": ("right of", "to the right of", "on the right of"),
    "in front of": ("in front of", "before"), "behind": ("behind", "in the back of"), "next to": ("next to", "beside", "by"),
    "on": ("on", "on top of", "onto"), "inside": ("in", "inside", "into"),
}  # fmt: skip
_PLACES = {
    "left": ("on the left", "to the left side", "at the left"), "right": ("on the right", "on the right side", "at the right"),
    "top": ("at the back", "at the far end", "far away"), "bottom": ("at the front", "near me", "at the near end"),
}  # fmt: skip
_WAYS = {"left": "to the left", "right": "to the right", "away": "away from me", "closer": "closer to me"}
_JOINS = (" and ", ", and ", ", then ", ". ", " and then ")
TWO = 0.2  # share of the draws that are two wishes about different objects
_KINDS = ("relation", "relation", "place", "between", "swap", "move", "structure", "structure", "structure")


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
            if self.rng.random() < TWO:
                left = [place for place in places if place not in found[0][2]]
                found += [self._wish(left, objects)] if len(left) > 1 else []
            try:
                return labelled(str(self._one(_JOINS)).join(text for text, *_ in found), "; ".join(line for _, line, _ in found), 0, scene)
            except LabelError:  # as of too few objects for a phrase
                continue

    def _wish(self, places: Sequence[int], objects: Sequence[SceneObject]) -> tuple[str, str, tuple[int, ...]]:
        """Draw a wish: its text, its line, and the objects that it names."""
        kind = str(self._one(_KINDS))
        alike = [place for place in places if objects[place].name.split()[0] == objects[places[0]].name.split()[0]]
        if kind == "structure" and len(alike) > 1:
            return (*self._structure(alike, objects), tuple(alike))
        names = [object_phrases((place,), objects)[0].words for place in places]
        a, b, c = (names * 3)[:3]
        put = str(self._one(_PUT)).format(a=a)
        if kind == "place":
            value = str(self._one(list(_PLACES)))
            return f"{put} {self._one(_PLACES[value])}", f"place of {a}, at {value}", tuple(places[:1])
        if kind == "move":
            way, length = str(self._one(list(_WAYS))), f"{self.rng.integers(2, 21)} cm"
            return f"move {a} {length} {_WAYS[way]}", f"move of {a}, {way} {length}", tuple(places[:1])
        if kind == "swap" and len(places) > 1:
            return f"swap {a} {self._one(('and', 'with'))} {b}", f"swap of {a} + {b}", tuple(places[:2])
        if kind == "between" and len(places) > 2:
            return f"{put} between {b} and {c}", f"place of {a}, between {b} + {c}", tuple(places[:3])
        relation = str(self._one(list(_RELATIONS)))
        return f"{put} {self._one(_RELATIONS[relation])} {b}", f"place of {a}, {relation} {b}", tuple(places[:2])

    def _structure(self, members: Sequence[int], objects: Sequence[SceneObject]) -> tuple[str, str]:
        """Draw a wish for a structure of some objects of a kind, with or without a place."""
        phrases = [phrase.words for phrase in object_phrases(members, objects)]
        shapes = [name for name, words in STRUCTURES.items() if words.least <= len(members) and not words.pieces]
        shape = str(self._one(shapes))
        noun = str(self._one(STRUCTURES[shape].words.nouns[:2]))
        said, where, line = " and ".join(phrases), "", f"{shape} of {' + '.join(phrases)}"
        if self.rng.random() < 0.4:
            value = str(self._one(list(_PLACES)))
            where, line = f" {self._one(_PLACES[value])}", f"{line}, {value}"
        forms = (f"put {said} in a {noun}", f"make a {noun} of {said}", f"arrange {said} in a {noun}", f"{said} in a {noun}",
                 f"build a {noun} with {said}", f"a {noun} of {said}, please")  # fmt: skip
        text = str(self._one(forms))
        if shape in ("line", "tower") and self.rng.random() < 0.4:
            text = f"{'line up' if shape == 'line' else 'stack'} {said}"
        return f"{text.removesuffix(', please')}{where}", line

    def _one(self, values: Sequence[str]) -> str:
        return values[int(self.rng.integers(len(values)))]
