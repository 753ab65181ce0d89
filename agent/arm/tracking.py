"""Follow the objects on the table from one depth picture to the next, by what the camera sees alone.

Every object is known by the cloud of the first look: completed to a body, with its colours. A later picture is explained
by these bodies: each where it was or should be if the picture agrees, else where a group of unexplained points has its
shape and colours. What the picture neither shows nor refutes is hidden and keeps its pose; what no body explains is
unknown.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np
from scipy import ndimage
from scipy.optimize import linear_sum_assignment

from agent.arm.registration import (
    FAR_GATE,
    Fit,
    explained,
    fit_together,
    free_turns,
    guesses_from_points,
    judge,
)
from agent.arm.sight import STRIDE, Sight, of_palette
from agent.arm.tracked_shape import TrackedShape, tracked_shape
from structdiffusion.observation import Scene, Table
from structdiffusion.simulation.depth_camera import CameraImage

ROUGHLY_THERE = 0.5  # share of an object's side that is where it was guessed, so that a fit is worth it
THERE = 0.8  # the same after a fit: the rest is what completion errs by
LEAST_SUPPORT = 12  # samples on a measured surface, about 3 cm^2: fewer show no object
SEEN = 0.1  # share of the side facing the camera that can be judged, of an object that is seen
REFUTED = 0.3  # share that is refuted of an object that is gone
LEAST_CLUSTER = 12  # points, of 16 mm^2 each: fewer are noise and edges
GUESSES = 3  # per object and cluster that are fitted
BAD_RESIDUAL = 0.004  # m: an upright body that fits no better may lie


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

    def look(
        self, picture: CameraImage, expected: Mapping[int, np.ndarray] = MappingProxyType({})
    ) -> list[Track]:
        """Find every object in one picture, and return their tracks.

        Args:
            picture: depth, points and colours; the segmentation is not read. The arm is out of view, or the depth of
                its pixels is NaN.
            expected: index -> now_from_initial (4, 4) where an object should be now, besides where it was last.
        """
        sight = Sight(picture, self._area)
        guesses = [
            [motion @ self.shapes[i].world_from_shape for motion in (*_given(expected, i), track.now_from_initial)]
            for i, track in enumerate(self.tracks)
        ]
        found = self._where_guessed(sight, guesses)
        for _ in range(2):  # in the first round, two objects may be one group of points
            found |= self._elsewhere(sight, guesses, found)
        self.tracks = [self._track(sight, i, guesses[i], found.get(i)) for i in range(len(self.shapes))]
        self.unknown = self._strangers(sight, found)
        return list(self.tracks)

    def _where_guessed(self, sight: Sight, guesses: Sequence[Sequence[np.ndarray]]) -> dict[int, Fit]:
        """Fit the objects that are about where they were or should be."""
        best = [
            max((judge(sight, shape, guess) for guess in at), key=lambda fit: (fit.share >= ROUGHLY_THERE, fit.supported))
            for shape, at in zip(self.shapes, guesses)
        ]
        near = [i for i, fit in enumerate(best) if fit.share >= ROUGHLY_THERE and fit.supported >= LEAST_SUPPORT]
        fits = fit_together(
            sight, [self.shapes[i] for i in near], [best[i].world_from_shape for i in near],
            [free_turns(self.shapes[i], upright=True) for i in near],
        )  # fmt: skip
        return {i: fit for i, fit in zip(near, fits) if self._holds(fit)}

    @staticmethod
    def _holds(fit: Fit) -> bool:
        return fit.share >= THERE and fit.supported >= LEAST_SUPPORT and fit.residual < BAD_RESIDUAL

    def _elsewhere(
        self, sight: Sight, guesses: Sequence[Sequence[np.ndarray]], found: Mapping[int, Fit]
    ) -> dict[int, Fit]:
        """Fit the other objects to what the found ones leave unexplained."""
        lost = [i for i in range(len(self.shapes)) if i not in found]
        clusters = self._clusters(sight, found) if lost else []
        if not clusters:
            return {}
        fits = {(i, k): self._on_cluster(sight, i, guesses[i], mine) for i in lost for k, mine in enumerate(clusters)}
        costs = np.array([[self._cost(fits[i, k], len(clusters[k])) for k in range(len(clusters))] for i in lost])
        pairs = [(lost[a], b) for a, b in zip(*linear_sum_assignment(costs)) if costs[a, b] < 1.0]
        return {i: fits[i, k] for i, k in pairs}

    @staticmethod
    def _cost(fit: Fit, size: int) -> float:
        """Return how badly a body explains a cluster of `size` points, 1 or more if it does not."""
        if fit.share < THERE or fit.supported < LEAST_SUPPORT or fit.residual > 1.5 * BAD_RESIDUAL:
            return 10.0
        return (1.0 - fit.share) + 0.5 * max(0.0, 1.0 - len(fit.points) / size) + fit.residual / FAR_GATE

    def _on_cluster(self, sight: Sight, index: int, guesses: Sequence[np.ndarray], mine: np.ndarray) -> Fit:
        """Return the best fit of an object to a group of points: upright, or else lying."""
        shape = self.shapes[index]
        among = np.zeros(len(sight.points), dtype=bool)
        among[mine] = True
        own = mine[of_palette(sight.features[mine], shape.palette)]
        if len(own) < LEAST_CLUSTER:
            return replace(judge(sight, shape, guesses[-1]), supported=0)
        best: Fit | None = None
        for lying in (False, True):
            starts = guesses_from_points(shape, sight.points[own], guesses[-1][:3, :3], lying, GUESSES)
            for start in starts if lying else (*starts, *guesses):
                (fit,) = fit_together(sight, [shape], [start], [free_turns(shape, not lying)], among)
                if best is None or self._cost(fit, len(mine)) < self._cost(best, len(mine)):
                    best = fit
            assert best is not None
            if self._holds(best):
                break
        return best

    def _clusters(self, sight: Sight, found: Mapping[int, Fit]) -> list[np.ndarray]:
        """Return the indices of the points of each group that the found objects do not explain."""
        left = ~explained(sight, [self.shapes[i] for i in found], [fit.world_from_shape for fit in found.values()])
        mask = np.zeros(sight.shape, dtype=bool)
        mask[tuple(sight.pixels[left].T)] = True
        labels, count = ndimage.label(ndimage.binary_opening(mask), np.ones((3, 3)))
        label = labels[tuple(sight.pixels.T)]
        groups = [np.flatnonzero(label == k) for k in range(1, count + 1)]
        return [group for group in groups if len(group) >= LEAST_CLUSTER]

    def _track(self, sight: Sight, index: int, guesses: Sequence[np.ndarray], fit: Fit | None) -> Track:
        from_shape = np.linalg.inv(self.shapes[index].world_from_shape)
        if fit is not None:
            return Track(fit.world_from_shape @ from_shape, True, False, fit.residual)
        before = self.tracks[index]
        for guess in guesses:
            there = judge(sight, self.shapes[index], guess)
            if there.refuted <= REFUTED * (there.refuted + there.supported + there.hidden):
                return Track(guess @ from_shape, False, False, before.error_m)
        return Track(before.now_from_initial, False, True, before.error_m)

    def _strangers(self, sight: Sight, found: Mapping[int, Fit]) -> list[np.ndarray]:
        return [sight.points[group] for group in self._clusters(sight, found)]


def _given(expected: Mapping[int, np.ndarray], index: int) -> list[np.ndarray]:
    return [expected[index]] if index in expected else []
