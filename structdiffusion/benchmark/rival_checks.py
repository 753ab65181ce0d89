"""The success checks that two other systems report with, for comparison with ours on the same final scenes.

They look at where objects end, and at fewer things than the evaluation protocol: slots and keys that they do not know
    (size,
position, rotation, gap, order, ...) are not checked, nor is whether something stands on something else. A goal of which
they cannot express a shape or a relation has no verdict.

LGMCTS: H. Chang et al., "LGMCTS: Language-Guided Monte-Carlo Tree Search for Executable Semantic Object Rearrangement",
IROS 2024 (arXiv 2309.15821); the checks are those of its published code (github.com/changhaonan/LGMCTS-D,
`lgmcts/components/patterns.py`), with its default threshold of 10 cm.

SREM: N. Gkanatsios et al., "Energy-based Models are Zero-Shot Planners for Compositional Scene Rearrangement", RSS 2023
(arXiv 2304.14391); the checks are the rewards of its published code (github.com/ayushjain1144/ebmplanner,
`tasks/task.py` and `ebm_training/classifiers.py`), of which a success needs the full one. Its measures are shares of
the longer side of an image of 1 m: 0.03 of it is 3 cm.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import combinations

import numpy as np

from grounding.goals.goal import Goal
from grounding.goals.parts import Objects, PartReference, RelationPart, StructurePart
from structdiffusion.footprints import fit_circle
from structdiffusion.structures.bodies import PlacedBody

LGMCTS_THRESHOLD = 0.10  # m
SREM_MOST_SPREAD = 0.03  # m: standard deviation
SREM_LEAST_INSIDE = 0.8  # share of an object's box
Check = Callable[[np.ndarray], bool]  # of the objects' places (N, 2)

# Relation -> the axis of the world, and the side of the reference on it: left is +y, behind is +x.
_SIDES: Mapping[str, tuple[int, int]] = {
    "left of": (1, 1),
    "right of": (1, -1),
    "behind": (0, 1),
    "in front of": (0, -1),
}


def lgmcts_accepts(bodies: Sequence[PlacedBody], goal: Goal) -> bool | None:
    """Tell whether LGMCTS's checks accept a final scene; `None` for a goal with a shape or relation that they lack.

    - line: every place at most 10 cm off the straight line through the leftmost and the rightmost object;
    - circle: no place more than 10 cm outside the least-squares circle; fewer than four objects always form one;
    - rectangle, square: of four objects; of the six distances between them, the four smallest exceed their own mean by
    at
      most 10 cm;
    - left of, right of, in front of, behind: the object's place is on that side of the reference's, however far.

    Args:
        bodies: all objects of the scene, at rest.
        goal: with indices into them, resolved.
    """

    def relation(part: RelationPart) -> bool | None:
        if part.relation not in _SIDES:
            return None
        axis, sign = _SIDES[part.relation]
        place = _places(bodies, _members(part.reference, goal)).mean(axis=0)
        return all(
            sign * (_places(bodies, [one]).mean(axis=0) - place)[axis] >= 0 for one in _members(part.objects, goal)
        )

    def structure(part: StructurePart) -> bool | None:
        places = _places(bodies, _members(part.objects, goal))
        if part.shape in ("rectangle", "square") and len(places) != 4:
            return None
        check = _LGMCTS_SHAPES.get(part.shape)
        return None if check is None else check(places)

    return _accepts(goal, structure, relation)


def srem_accepts(bodies: Sequence[PlacedBody], goal: Goal) -> bool | None:
    """Tell whether SREM's checks accept a final scene; `None` for a goal with a shape or relation that they lack.

    Its places are the centres of boxes along the axes.

    - circle, triangle, square: the distances of the places from their mean have a standard deviation below 3 cm;
    - line: the distances of the places from the line have a standard deviation below 3 cm. SREM's lines all run from
      left to right, where that is the distance from the mean depth; ours run anywhere, so that it is the one across;
    - left of, right of, in front of, behind: the object's box lies wholly on that side of the reference's;
    - in: more than 80 % of the object's box lies in the reference's.

    Args:
        bodies: all objects of the scene, at rest.
        goal: with indices into them, resolved.
    """

    def relation(part: RelationPart) -> bool | None:
        if part.relation not in (*_SIDES, "in"):
            return None
        reference = _box(bodies, _members(part.reference, goal))
        return all(_box_holds(part.relation, _box(bodies, [one]), reference) for one in _members(part.objects, goal))

    def structure(part: StructurePart) -> bool | None:
        check = _SREM_SHAPES.get(part.shape)
        if check is None:
            return None
        return check(np.array([_box(bodies, [one]).mean(axis=0) for one in _members(part.objects, goal)]))

    return _accepts(goal, structure, relation)


RIVALS: Mapping[str, Callable[[Sequence[PlacedBody], Goal], bool | None]] = {
    "LGMCTS": lgmcts_accepts,
    "SREM": srem_accepts,
}


def _accepts(
    goal: Goal,
    structure: Callable[[StructurePart], bool | None],
    relation: Callable[[RelationPart], bool | None],
) -> bool | None:
    verdicts = [structure(part) if isinstance(part, StructurePart) else relation(part) for part in goal.parts]
    return None if None in verdicts else all(verdicts)


def _members(objects: Objects | None, goal: Goal) -> Sequence[int]:
    """Return the indices of some objects, or of those of the part that is meant."""
    if isinstance(objects, PartReference):
        objects = goal.parts[objects.part].objects
    return tuple(objects or ())  # type: ignore[arg-type]


def _places(bodies: Sequence[PlacedBody], members: Sequence[int]) -> np.ndarray:
    return np.array([bodies[i].centroid for i in members])


def _box(bodies: Sequence[PlacedBody], members: Sequence[int]) -> np.ndarray:
    """Return the low and the high corner (2, 2) of the box along the axes around some objects."""
    points = np.concatenate([bodies[i].footprint for i in members])
    return np.array([points.min(axis=0), points.max(axis=0)])


def _box_holds(relation: str, box: np.ndarray, reference: np.ndarray) -> bool:
    if relation == "in":
        shared = np.clip(np.minimum(box[1], reference[1]) - np.maximum(box[0], reference[0]), 0.0, None)
        return bool(shared.prod() > SREM_LEAST_INSIDE * (box[1] - box[0]).prod())
    axis, sign = _SIDES[relation]
    return bool(box[0, axis] > reference[1, axis] if sign > 0 else box[1, axis] < reference[0, axis])


# --- shapes, of places (N, 2) ---------------------------------------------------------------------


def _lgmcts_line(places: np.ndarray) -> bool:
    first, last = places[places[:, 1].argmax()], places[places[:, 1].argmin()]
    length = float(np.linalg.norm(last - first))
    if length == 0.0:
        return False
    along, away = (last - first) / length, places - first
    return bool(np.abs(away[:, 0] * along[1] - away[:, 1] * along[0]).max() <= LGMCTS_THRESHOLD)


def _lgmcts_circle(places: np.ndarray) -> bool:
    if len(places) < 4:
        return True
    centre, radius = fit_circle(places)
    return bool((np.linalg.norm(places - centre, axis=1) - radius).max() <= LGMCTS_THRESHOLD)


def _lgmcts_rectangle(places: np.ndarray) -> bool:
    sides = np.sort([np.linalg.norm(one - other) for one, other in combinations(places, 2)])[:4]
    return bool((sides - sides.mean()).max() <= LGMCTS_THRESHOLD)


def _srem_polygon(places: np.ndarray) -> bool:
    return bool(np.linalg.norm(places - places.mean(axis=0), axis=1).std() < SREM_MOST_SPREAD)


def _srem_line(places: np.ndarray) -> bool:
    about = places - places.mean(axis=0)
    across = about @ np.linalg.svd(about)[2][1]
    return bool(np.abs(across).std() < SREM_MOST_SPREAD)


_LGMCTS_SHAPES: Mapping[str | None, Check] = {
    "line": _lgmcts_line,
    "circle": _lgmcts_circle,
    "rectangle": _lgmcts_rectangle,
    "square": _lgmcts_rectangle,
}
_SREM_SHAPES: Mapping[str | None, Check] = {
    "line": _srem_line,
    "circle": _srem_polygon,
    "triangle": _srem_polygon,
    "square": _srem_polygon,
}
