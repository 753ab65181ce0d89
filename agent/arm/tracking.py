"""Follow the objects on the table from one depth picture to the next, by what the camera sees alone.

Every object is known by the cloud of the first look: completed to a body, with its colours. A later picture is
explained by these bodies: each where it was or should be if the picture agrees, else where a group of unexplained
points has its shape and colours. What the picture neither shows nor refutes is hidden and keeps its pose; what no body
explains is unknown.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from scipy import ndimage
from scipy.optimize import linear_sum_assignment
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from agent.arm.registration import (
    FAR_GATE,
    FREE,
    Fit,
    explained,
    fit_together,
    free_turns,
    guesses_from_points,
    judge,
    lowest,
)
from agent.arm.sight import Sight, of_palette
from agent.arm.tracked_shape import tracked_shape
from structdiffusion.geometry import raised, tilt_between
from structdiffusion.observation import Scene, Table
from structdiffusion.simulation.depth_camera import CameraImage

ROUGHLY_THERE = 0.5  # share of an object's side that is where it was guessed, so that a fit is worth it
LEAST_SUPPORT = 12  # samples on a measured surface, about 3 cm^2: fewer show no object
# Costs: the share of an object that is refuted, half the share of the points that it leaves unexplained, the mean
# residual per 3 cm, and the distance of colours per `OTHER_COLOR`. Noise alone costs 0.05, completion's errors up to as
# much again.
CERTAIN, LIKELY, UNSURE, UNLIKELY, UNLIKELY_LYING, IMPOSSIBLE = 0.08, 0.12, 0.24, 0.35, 0.5, 10.0
OTHER_COLOR = 0.1  # between two colours that nobody would confuse: a third of it is noticed
FALLEN = math.radians(45)  # of tilt
NO_BETTER = 0.02  # cost that a fit has to save: so many points of noise change sides
UPRIGHT_BONUS = 0.05  # that lying has to cost less than standing
CLOSE = 0.004  # m: mean residual of points that lie on a badly completed body, half of those that any point may have
STAYED = 0.006  # m that an object may seem to have moved which nobody touched
SINKS = 0.003  # m that a body may reach into the table: noise of its height
REFUTED = 0.3  # share that is refuted of an object that is gone
LEAST_GROUP = 12  # points, of 16 mm^2 each: fewer are noise and edges
APART = 0.015  # m between two things: neighbouring points of one are 4 mm apart, and more on steep sides
LEAST_STRANGER = 25  # points of what belongs to no object: 2 cm by 2 cm
BESIDE = 0.015  # m from an object within which points of its colour may belong to it
APPENDAGE = 0.35  # of an object's points at most are a side that was not seen before, such as a handle
FLAT = 0.02  # m high: what is no higher neither leans nor lies otherwise, as far as a camera can tell
STEPS = (0.0, -0.005, 0.005, -0.01, 0.01)  # m by which what was put down may be higher than expected
GUESSES = 3  # per object and group of points that are fitted
ALL_WAYS = 12  # the same, of every way in which a block may have rolled over


@dataclass(frozen=True, eq=False)
class Track:
    """What is known of one object after a look.

    Attributes:
        now_from_initial: (4, 4) its rigid motion since the first observation; the last known one where it is hidden.
        seen: whether the last picture shows it.
        gone: whether the last picture shows that it is not where it was, and it was found nowhere else.
        error_m: uncertainty of its place, metres: the mean residual of the fit.
    """

    now_from_initial: np.ndarray
    seen: bool
    gone: bool
    error_m: float


class Tracker:
    """The objects of a scene, then its distractors, and where they are now.

    Args:
        scene: what was seen before anything moved.

    Attributes:
        tracks: of the objects, then of the distractors.
        unknown: (P, 3) clouds of what the last picture shows and no known object explains, world frame, metres.
    """

    def __init__(self, scene: Scene) -> None:
        clouds = (*scene.objects, *scene.distractors)
        self.shapes = [tracked_shape(cloud, scene.world_from_camera) for cloud in clouds]
        self.tracks = [Track(np.eye(4), True, False, 0.0) for _ in clouds]
        self.unknown: list[np.ndarray] = []
        reach = [cloud.points[:, :2] for cloud in clouds]
        low = np.min([(scene.table.x_min, scene.table.y_min), *(one.min(axis=0) for one in reach)], axis=0)
        high = np.max([(scene.table.x_max, scene.table.y_max), *(one.max(axis=0) for one in reach)], axis=0)
        self._area = Table(low[0], high[0], low[1], high[1])

    def look(self, picture: CameraImage, expected: Mapping[int, np.ndarray] = MappingProxyType({})) -> list[Track]:
        """Find every object in one picture, and return their tracks.

        Args:
            picture: depth, points and colours; the segmentation is not read. The arm is out of view, or the depth of
                its pixels is NaN.
            expected: index -> now_from_initial (4, 4) where an object should be now, besides where it was last. It may
                stand a little lower or higher: what it was put on is known to millimetres only.
        """
        sight = self._sight = Sight(picture, self._area)
        guesses = [
            [motion @ self.shapes[i].world_from_shape for motion in (*_given(expected, i), track.now_from_initial)]
            for i, track in enumerate(self.tracks)
        ]
        found = self._where_guessed(sight, guesses)
        # These may be turned otherwise, or have fallen; where they seem to be is tried once more.
        doubtful = {i: found.pop(i) for i in self._with_rest(sight, found) | self._badly_fitted(found)}
        for i, fit in doubtful.items():
            guesses[i].insert(0, fit.world_from_shape)
        # Two objects may be one group of points: when the one is found, the rest shows the other.
        while more := self._elsewhere(sight, guesses, found):
            found |= more
        found = doubtful | found
        found |= self._still_there(sight, found)
        self.tracks = [self._track(sight, i, guesses[i], found.get(i)) for i in range(len(self.shapes))]
        self.unknown = self._strangers(sight, found)
        return list(self.tracks)

    def may_be_rolled(self, index: int, on_head: bool) -> bool:
        """Return whether an object that the last picture shows upright looks about the same on its side,
        or on its head.
        """
        shape, sight = self.shapes[index], self._sight
        pose = self.tracks[index].now_from_initial @ shape.world_from_shape
        among = np.zeros(len(sight.points), dtype=bool)
        own = judge(sight, shape, pose).points
        among[own] = True
        if shape.height < FLAT or len(own) < LEAST_GROUP:
            return False
        (upright,) = fit_together(sight, [shape], [pose], [free_turns(shape, pose)], among)
        starts = guesses_from_points(shape, sight.points[own], pose, True, ALL_WAYS)
        for start in (one for one in starts if _is_rolled(one, on_head)):
            (first,) = fit_together(sight, [shape], [start], [FREE], among)
            (lying,) = fit_together(sight, [shape], [first.world_from_shape], [FREE], among)
            cost = self._cost(index, lying, len(own))
            if (
                _is_rolled(lying.world_from_shape, on_head)
                and cost < self._cost(index, upright, len(own)) + UPRIGHT_BONUS
            ):
                return True
        return False

    def _where_guessed(self, sight: Sight, guesses: Sequence[list[np.ndarray]]) -> dict[int, Fit]:
        """Fit the objects that are about where they were or should be."""
        best = {}
        for i, (shape, at) in enumerate(zip(self.shapes, guesses)):
            there = [(sight.evidence(shape, guess), guess) for guess in at]
            there = [one for one in there if one[0].share >= ROUGHLY_THERE and one[0].supported >= LEAST_SUPPORT]
            if there:
                best[i] = max(there, key=lambda one: one[0].supported)[1]
        shapes = [self.shapes[i] for i in best]
        free = [free_turns(shape, pose) for shape, pose in zip(shapes, best.values())]
        fits = fit_together(sight, shapes, list(best.values()), free)
        return {i: fit for i, fit in zip(best, fits) if self._cost(i, fit) < UNLIKELY}

    def _cost(self, index: int, fit: Fit, size: int = 0) -> float:
        """Return how badly an object at a pose explains what is seen there, `size` points of its colours; infinite if
        not at all.
        """
        if fit.evidence.supported < LEAST_SUPPORT:
            return np.inf
        sunk = max(0.0, -lowest(self.shapes[index], fit.world_from_shape) - SINKS)
        unexplained = max(0.0, 1.0 - len(fit.points) / size) if size else 0.0
        missing = 1.0 - fit.evidence.share
        return missing + 0.5 * unexplained + fit.off_color / OTHER_COLOR + (fit.residual + sunk) / FAR_GATE

    @staticmethod
    def _limit(fit: Fit, owned: bool) -> float:
        """Return the cost from which on a fit counts as none; more for what lies, and shows sides not seen before, and
        less for points that may be a side of another object.
        """
        if owned:
            return LIKELY if fit.evidence.hidden < fit.evidence.supported else 0.0
        return UNLIKELY if tilt_between(fit.world_from_shape, np.eye(4)) < FALLEN else UNLIKELY_LYING

    def _elsewhere(
        self, sight: Sight, guesses: Sequence[Sequence[np.ndarray]], found: Mapping[int, Fit]
    ) -> dict[int, Fit]:
        """Fit the other objects to what the found ones leave unexplained."""
        lost = [i for i in range(len(self.shapes)) if i not in found]
        groups = self._rest(sight, found) if lost else []
        if not groups:
            return {}
        costs = np.full((len(lost), len(groups)), IMPOSSIBLE)
        fits, owned = {}, [self._is_owned(sight, found, group) for group in groups]
        for a, b in np.ndindex(*costs.shape):
            fits[a, b], cost = self._on_group(sight, lost[a], guesses[lost[a]], groups[b])
            costs[a, b] = cost if cost < self._limit(fits[a, b], owned[b]) else IMPOSSIBLE
        pairs = [(a, b) for a, b in zip(*linear_sum_assignment(costs)) if costs[a, b] < IMPOSSIBLE]
        if not pairs and len(lost) > 1:  # a group may be two that lean on each other: the one that fits, then the rest
            costs = np.array([[self._cost(i, fits[a, b]) for b in range(len(groups))] for a, i in enumerate(lost)])
            a, b = np.unravel_index(int(costs.argmin()), costs.shape)
            pairs = [(a, b)] if costs[a, b] < self._limit(fits[a, b], owned=True) else []
        return {lost[a]: fits[a, b] for a, b in pairs}

    def _on_group(
        self, sight: Sight, index: int, guesses: Sequence[np.ndarray], group: np.ndarray
    ) -> tuple[Fit, float]:
        """Return the best fit of an object to a group of points, upright or else lying, and its cost."""
        shape = self.shapes[index]
        among = np.zeros(len(sight.points), dtype=bool)
        among[group] = True
        best, least = judge(sight, shape, guesses[-1]), np.inf
        own = group[of_palette(sight.features[group], shape.palette)]
        if len(own) < LEAST_GROUP:
            return best, least
        for way in ("standing", "leaning", "lying"):
            if way == "leaning":
                starts = [best.world_from_shape]
            else:
                starts = guesses_from_points(shape, sight.points[own], guesses[-1], way == "lying", GUESSES)
            starts = [*guesses, *starts] if way == "standing" else starts
            bar = least - (0.0 if way == "standing" else UPRIGHT_BONUS)
            while starts:  # a tilted body is fitted again until that helps no more
                start = starts.pop(0)
                free = free_turns(shape, start) if way == "standing" else FREE
                (fit,) = fit_together(sight, [shape], [start], [free], among)
                cost = self._cost(index, fit, len(own))
                if cost < min(bar, least - NO_BETTER):
                    best, least = fit, cost
                    starts += [] if way == "standing" else [fit.world_from_shape]
                if least < CERTAIN:
                    break
            if least < LIKELY or shape.height < FLAT:
                break
        return best, least

    def _still_there(self, sight: Sight, found: Mapping[int, Fit]) -> dict[int, Fit]:
        """Return the objects not found that seem to be where they were, however badly their bodies were completed."""
        taken = np.concatenate([np.empty(0, dtype=np.int64), *(fit.points for fit in found.values())])
        there = {}
        for i in set(range(len(self.shapes))) - set(found):
            pose = self.tracks[i].now_from_initial @ self.shapes[i].world_from_shape
            fit = judge(sight, self.shapes[i], pose)
            free = not np.isin(fit.points, taken).any() and self._cost(i, fit) < np.inf
            if free and fit.evidence.share >= ROUGHLY_THERE and fit.residual < CLOSE:
                there[i] = fit
        return there

    def _rest(self, sight: Sight, found: Mapping[int, Fit]) -> list[np.ndarray]:
        """Return the indices of the points of each group that the found objects do not explain."""
        left = ~explained(sight, [self.shapes[i] for i in found], [fit.world_from_shape for fit in found.values()])
        mask = np.zeros(sight.shape, dtype=bool)
        mask[tuple(sight.pixels[left].T)] = True
        labels, count = ndimage.label(ndimage.binary_opening(mask, np.ones((2, 2))), np.ones((3, 3)))
        label = labels[tuple(sight.pixels.T)]
        groups = [np.flatnonzero(label == k) for k in range(1, count + 1)]
        return [group for group in groups if len(group) >= LEAST_GROUP]

    def _with_rest(self, sight: Sight, found: Mapping[int, Fit]) -> set[int]:
        """Return the found objects that have unexplained points of their colour beside them."""
        owners = {self._owner(sight, found, group) for group in self._rest(sight, found)}
        return {owner for owner in owners if owner is not None}

    def _badly_fitted(self, found: Mapping[int, Fit]) -> set[int]:
        """Return the found objects that fit badly; one that has not moved may: its body was completed wrongly."""
        bad = set()
        for i, fit in found.items():
            before = self.tracks[i].now_from_initial @ self.shapes[i].world_from_shape
            stayed = np.linalg.norm(fit.world_from_shape[:3, 3] - before[:3, 3]) < STAYED
            if self._cost(i, fit) > (UNSURE if stayed else LIKELY):
                bad.add(i)
        return bad

    def _owner(self, sight: Sight, found: Mapping[int, Fit], group: np.ndarray) -> int | None:
        """Return the object that a group of points lies beside and has the colour of, or `None`."""
        apart = {}
        for i, fit in found.items():
            if of_palette(sight.features[group], self.shapes[i].palette).mean() > 0.5:
                pose = fit.world_from_shape
                apart[i] = self.shapes[i].distances((sight.points[group] - pose[:3, 3]) @ pose[:3, :3])[0].min()
        owner = min(apart, key=lambda i: apart[i], default=None)
        return owner if owner is not None and apart[owner] < BESIDE else None

    def _is_owned(self, sight: Sight, found: Mapping[int, Fit], group: np.ndarray) -> bool:
        """Return whether a group of points may be a side of a found object that was not seen before."""
        owner = self._owner(sight, found, group)
        return owner is not None and len(group) <= APPENDAGE * len(found[owner].points)

    def _strangers(self, sight: Sight, found: Mapping[int, Fit]) -> list[np.ndarray]:
        """Return the clouds (P, 3) of what belongs to no object."""
        pieces = (piece for group in self._rest(sight, found) for piece in _pieces(sight.points, group))
        groups = (piece for piece in pieces if len(piece) >= LEAST_STRANGER)
        return [sight.points[group] for group in groups if not self._is_owned(sight, found, group)]

    def _track(self, sight: Sight, index: int, guesses: Sequence[np.ndarray], fit: Fit | None) -> Track:
        from_shape = np.linalg.inv(self.shapes[index].world_from_shape)
        if fit is not None:
            return Track(fit.world_from_shape @ from_shape, True, False, fit.residual)
        before = self.tracks[index]
        for guess in guesses:
            if sight.evidence(self.shapes[index], guess).refuted_share <= REFUTED:
                return Track(guess @ from_shape, False, False, before.error_m)
        return Track(before.now_from_initial, False, True, before.error_m)


def _is_rolled(pose: np.ndarray, on_head: bool) -> bool:
    """Return whether a pose (4, 4) is on its side, or on its head."""
    tilt = tilt_between(pose, np.eye(4))
    return tilt > math.pi - FALLEN if on_head else FALLEN < tilt < math.pi - FALLEN


def _pieces(points: np.ndarray, group: np.ndarray) -> list[np.ndarray]:
    """Return the parts of a group of points that hang together: what is one in the picture may be far apart."""
    pairs = cKDTree(points[group]).query_pairs(APART, output_type="ndarray")
    joined = coo_array((np.ones(len(pairs)), pairs.T), shape=(len(group), len(group)))
    count, label = connected_components(joined, directed=False)
    return [group[label == k] for k in range(count)]


def _given(expected: Mapping[int, np.ndarray], index: int) -> list[np.ndarray]:
    return [raised(expected[index], step) for step in STEPS] if index in expected else []
