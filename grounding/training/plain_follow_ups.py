"""Draw plain sentences about a goal: one thing more, or one thing otherwise, said in full.

Writers who are asked for corrections write what is short or unusual; "and the pitcher in front of the kettle", said
while a kettle stands, is seldom among it. Goals so far are those of labelled instructions.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TypeVar

import numpy as np

from grounding.goal_benchmark.rows import goal_scenes
from grounding.goal_network.goal_rendition import Rendition, object_phrases, rendition_of
from grounding.goals.goal import Goal
from grounding.goals.parts import StructurePart
from grounding.resolve.attributes import SceneObject
from grounding.structure_words import STRUCTURES
from grounding.training.goal_lines import LabelError, LabelledGoal, labelled
from grounding.training.plain_wishes import BESIDE, PLACES, RELATIONS

Value = TypeVar("Value")

_SHORT = {"left of": ("on the left", "to the left", "left"), "right of": ("on the right", "to the right", "right"),
          "in front of": ("in front",), "behind": ("behind", "at the back")}  # fmt: skip
_OPPOSITE = {"left of": "right of", "right of": "left of", "in front of": "behind", "behind": "in front of"}
_OPENINGS = ("", "", "", "", "and ", "and ", "now ", "then ", "also ", "next, ", "okay, ", "please ", "after that, ")
_ENDINGS = ("", ".", ".", ".", ", please.", " please", "!", " now.")
_VERBS = ("{a} {b}", "{a} {b}", "put {a} {b}", "place {a} {b}", "{a} goes {b}", "i want {a} {b}", "set {a} {b}",
          "{a} should be {b}", "could you put {a} {b}", "{a} must be {b}")  # fmt: skip
_DENIALS = ("no, ", "no ", "sorry, ", "wait, ", "", "not there, ", "oh, ", "actually, ", "i meant ", "no, i meant ")
_KINDS = ("beside", "beside", "beside", "structure", "structures", "both", "place", "relation", "reference", "shape",
          "moved")  # fmt: skip
_REPAIRS = ("no", "no, wait", "sorry", "or rather", "i mean", "hm, no", "or wait", "no no")
_DISTANCE, _REPAIRED = 0.15, 0.15  # shares of the wishes beside something that say how far, and that begin otherwise


class PlainFollowUps:
    """Sentences about goals that are drawn.

    Args:
        goals: by the name of the scene.
        rng: draws.
    """

    def __init__(self, goals: Mapping[str, Sequence[Goal]], rng: np.random.Generator) -> None:
        some = {scene: [goal for goal in each if goal.parts] for scene, each in goals.items()}
        self.goals, self.rng = {scene: each for scene, each in some.items() if each}, rng

    def draw(self) -> LabelledGoal:
        """Draw a task."""
        while True:
            scene = self._one(list(self.goals))
            goal, objects = self.goals[scene][self.rng.integers(len(self.goals[scene]))], goal_scenes()[scene]
            rendition = rendition_of(goal, objects)
            wish = self._wish(self._one(_KINDS), goal, objects, rendition)
            if wish is None:
                continue
            text, label = wish
            try:
                return labelled(f"{rendition.text} {text}{self._one(_ENDINGS)}", label, rendition.length, scene)
            except LabelError:
                continue  # as with more than nine parts

    def _wish(
        self, kind: str, goal: Goal, objects: Sequence[SceneObject], rendition: Rendition
    ) -> tuple[str, str] | None:
        """Draw a sentence and the label of the goal after it; `None` where this kind says nothing of the goal."""
        if kind in ("relation", "reference"):
            return self._otherwise(kind, goal, objects, rendition)
        if kind in ("shape", "moved"):
            return self._structure(kind, goal, objects, rendition)
        if kind == "structures":
            return self._two_structures(goal, objects, rendition)
        if any(part.objects is None for part in goal.structures):
            return None  # nothing is left
        named = goal.named_objects()
        free = [index for index in range(len(objects)) if index not in named]
        names = [object_phrases((index,), objects)[0].words for index in self.rng.permutation(free).tolist()]
        there = [object_phrases((index,), objects)[0].words for index in named if isinstance(index, int)]
        if not names:
            return None
        opening = self._one(_OPENINGS)
        if kind == "both" and len(names) > 1 and there:
            one, other = ("left of", "right of") if self.rng.random() < 0.7 else ("in front of", "behind")
            if self.rng.random() < 0.5:
                one, other = other, one
            a, b, c = names[0], names[1], self._one(there)
            second = self._one(
                (f"{self._one(RELATIONS[other])} {c}", self._one(_SHORT[other]), f"{RELATIONS[other][0]} it")
            )
            text = f"{a} {self._one(RELATIONS[one])} {c} and {b} {second}"
            return f"{opening}{text}", f"{rendition.label}; place of {a}, {one} {c}; place of {b}, {other} {c}"
        if kind == "place":
            value = self._one(list(PLACES))
            return self._added(rendition, names[0], self._one(PLACES[value]), f"at {value}")
        if kind == "structure":
            called = self._called(goal, objects)
            if not called:
                return None
            number, relation = self._one(list(called)), self._one(BESIDE)
            return self._beside(rendition, names[0], relation, called[number], f"structure {number}")
        if kind == "beside" and there:
            relation, c = self._one(list(RELATIONS)), self._one(there)
            return self._beside(rendition, names[0], relation, c, c)
        return None

    def _beside(self, rendition: Rendition, name: str, relation: str, called: str, written: str) -> tuple[str, str]:
        """Say that one object more goes beside something; `called` in the sentence, and `written` in the label."""
        said, key, chance = f"{self._one(RELATIONS[relation])} {called}", f"{relation} {written}", self.rng.random()
        if relation in BESIDE and chance < _REPAIRED:
            wrong = self._one([each for each in BESIDE if each != relation])
            again = self._one((said, f"{RELATIONS[relation][0]} it"))
            said = f"{self._one(RELATIONS[wrong])} {called}, {self._one(_REPAIRS)}, {again}"
        elif relation in BESIDE and chance > 1.0 - _DISTANCE:
            length = f"{self.rng.integers(2, 16)} {self._one(('cm', 'centimetres', 'cm'))}"
            said = self._one((f"{length} {said}", f"{said}, {length} away", f"{said} with a distance of {length}"))
            key = f"{key}, distance {length}"
        return self._added(rendition, name, said, key)

    def _added(self, rendition: Rendition, name: str, said: str, key: str) -> tuple[str, str]:
        """Say that one object more goes somewhere."""
        text = f"{self._one(_OPENINGS)}{self._one(_VERBS)}".format(a=name, b=said)
        return text, f"{rendition.label}; place of {name}, {key}"

    def _otherwise(
        self, kind: str, goal: Goal, objects: Sequence[SceneObject], rendition: Rendition
    ) -> tuple[str, str] | None:
        """Give the last object that was placed beside something another relation, or another reference."""
        parts = rendition.label.split("; ")
        cells = [cell.strip() for cell in parts[-1].split(",")]
        if not cells[0].startswith("place of ") or " + " in cells[0] or len(cells) < 2:
            return None
        name = cells[0].removeprefix("place of ")
        relation = next((each for each in RELATIONS if cells[1].startswith(f"{each} ")), None)
        if relation is None or " + " in cells[1] or name.startswith("structure"):
            return None
        reference = cells[1].removeprefix(f"{relation} ")
        if kind == "relation":
            new = self._one([each for each in (*BESIDE, "on") if each != relation])
            if reference.startswith("structure") and new == "on":
                return None
            said = self._one(RELATIONS[new])
            wishes = [f"{said} it", f"{name} {said} it"]
            wishes += [f"{name} {said} {reference}", f"{said} {reference}"] if reference in rendition.text else []
            if _OPPOSITE.get(relation) == new:
                wishes += ["the other side", "on the other side", f"{name} on the other side"]
            if relation in _SHORT and new in _SHORT:
                wishes += [f"{self._one(_SHORT[new])}, not {self._one(_SHORT[relation])}"]
        else:
            free = [index for index in range(len(objects)) if index not in goal.named_objects()]
            if not free:
                return None
            new, reference = relation, self._one([object_phrases((index,), objects)[0].words for index in free])
            said = self._one(RELATIONS[new])
            wishes = [f"{said} {reference}", f"{name} {said} {reference}", f"{name} {said} {reference} instead"]
        line = ", ".join((cells[0], f"{new} {reference}", *cells[2:]))
        return f"{self._one(_DENIALS)}{self._one(wishes)}", "; ".join((*parts[:-1], line))

    def _two_structures(
        self, goal: Goal, objects: Sequence[SceneObject], rendition: Rendition
    ) -> tuple[str, str] | None:
        """Say how one structure of a goal stands to another; either may come first in the sentence."""
        called = self._called(goal, objects)
        if len(called) < 2 or "place of structure" in rendition.label:
            return None
        one, other = self.rng.permutation(list(called))[:2].tolist()
        if _is_placed(rendition.label.split("; ")[goal.parts.index(goal.structures[one - 1])]):
            return None
        relation = self._one(BESIDE)
        said = self._one(RELATIONS[relation])
        text = self._one(
            ("put {a} {r} {b}", "{a} must be {r} {b}", "{a} {r} {b}", "{a} goes {r} {b}", "{a} should stand {r} {b}",
             "i want {a} {r} {b}", "{a} to be {r} {b}", "move {a} {r} {b}", "{a} belongs {r} {b}")
        ).format(a=called[one], r=said, b=called[other])  # fmt: skip
        return (
            f"{self._one(_OPENINGS)}{text}",
            f"{rendition.label}; place of structure {one}, {relation} structure {other}",
        )

    def _structure(
        self, kind: str, goal: Goal, objects: Sequence[SceneObject], rendition: Rendition
    ) -> tuple[str, str] | None:
        """Give a structure of a goal another shape, or another place."""
        called = self._called(goal, objects)
        if not called:
            return None
        number, parts = self._one(list(called)), rendition.label.split("; ")
        place = goal.parts.index(goal.structures[number - 1])
        one, name, alone = goal.structures[number - 1], called[number], len(goal.structures) == 1
        noun = STRUCTURES[str(one.shape)].words.nouns[0]
        head, *cells = [cell.strip() for cell in parts[place].split(",")]
        if kind == "shape":
            if cells or one.objects is None:
                return None  # what was said of its size or order may be no word of another shape
            shapes = [name for name, words in STRUCTURES.items()
                      if words.least <= len(one.objects) and not words.pieces and name != one.shape]  # fmt: skip
            shape = self._one(shapes)
            new = self._one(STRUCTURES[shape].words.nouns)
            forms = [f"make {name} a {new}", f"{name} should be a {new} instead", f"turn {name} into a {new}"]
            forms += [f"make it a {new}", f"make it a {new} instead", f"rather a {new}"] if alone else []
            forms += (
                [f"a {new} instead of the {noun}", f"not a {noun}, a {new}", f"no {noun}, a {new}"] if alone else []
            )
            line = f"{shape} of {head.partition(' of ')[2]}"
            text = f"{self._one(('', '', *_DENIALS))}{self._one(forms)}"
            return text, "; ".join((*parts[:place], line, *parts[place + 1 :]))
        value = self._one(list(PLACES))
        if _is_placed(parts[place]) or "place of structure" in rendition.label:
            return None
        where = self._one(PLACES[value])
        forms = [f"{name} {where}", f"put {name} {where}", f"{name} goes {where}", f"move {name} {where}"]
        forms += [where, f"move it {where}", f"put it {where}"] if alone else []
        line = ", ".join((head, *cells, value))
        text = f"{self._one(_OPENINGS)}{self._one(forms)}"
        return text, "; ".join((*parts[:place], line, *parts[place + 1 :]))

    def _called(self, goal: Goal, objects: Sequence[SceneObject]) -> dict[int, str]:
        """Name the structures of a goal that have words of their own: by their shape, their colour, or both."""
        known = {number: one for number, one in enumerate(goal.structures, 1) if one.shape}
        found = dict[int, str]()
        for number, one in known.items():
            noun = self._one(STRUCTURES[str(one.shape)].words.nouns)
            own, others = _colours(one, objects), [each for each in known.values() if each is not one]
            words = [] if any(each.shape == one.shape for each in others) else [f"the {noun}"]
            if len(own) == 1 and not any(own & _colours(each, objects) for each in others):
                colour = next(iter(own))
                words += [f"the {colour} {noun}", f"the {colour} ones"]
            if words:
                found[number] = self._one(words)
        return found

    def _one(self, values: Sequence[Value]) -> Value:
        return values[int(self.rng.integers(len(values)))]


def _is_placed(line: str) -> bool:
    """Return whether the line of a structure in a label says where it stands."""
    cells = {cell.strip() for cell in line.split(",")}
    return bool(cells & {"left", "right", "center", "top", "middle", "bottom"}) or "along" in line


def _colours(part: StructurePart, objects: Sequence[SceneObject]) -> set[str]:
    """Return the colours of the objects of a structure."""
    known = [objects[index].attributes for index in part.objects or () if isinstance(index, int)]
    return {colour for each in known if each is not None for colour in each.colors}
