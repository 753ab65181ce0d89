"""Tell whether a person can see that an arrangement is another one than those that were shown."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from agent.pipeline.candidates import is_viable
from structdiffusion.completion.estimate import outline_of
from structdiffusion.footprints import outline_centroid
from structdiffusion.observation import Arrangement, Scene

VISIBLE = 0.03  # m: an arrangement is another one if an object's middle lies so far from where it lay before

Places = Mapping[str, np.ndarray]  # name -> (3,) where the middle of an object goes, world frame, metres


def places_of(arrangements: Sequence[Arrangement], scene: Scene) -> list[Places]:
    """Return where each arrangement puts the middle of every object: the one of its outline, which a turn on the spot
    hardly moves, as it does the mean of a cloud that was seen from one side.
    """
    middles = [_middle(cloud.points) for cloud in scene.objects]
    names = [cloud.name for cloud in scene.objects]
    return [
        {
            name: motion[:3, :3] @ middle + motion[:3, 3]
            for name, middle, motion in zip(names, middles, one.goal_from_initial, strict=True)
        }
        for one in arrangements
    ]


def differs(places: Places, shown: Iterable[Places]) -> bool:
    """Return whether an arrangement differs visibly from every one that was shown."""
    return all(
        places.keys() != one.keys() or max(np.linalg.norm(places[name] - one[name]) for name in places) >= VISIBLE
        for one in shown
    )


def other_ranks(arrangements: Sequence[Arrangement], scene: Scene, shown: Sequence[Places]) -> list[int]:
    """Return the ranks, from 1, of the viable arrangements that differ visibly from those that were shown."""
    places = places_of(arrangements, scene)
    return [
        rank
        for rank, (one, where) in enumerate(zip(arrangements, places, strict=True), start=1)
        if is_viable(one) and differs(where, shown)
    ]


def _middle(points: np.ndarray) -> np.ndarray:
    x, y = outline_centroid(outline_of(points[:, :2].astype(np.float64)))
    return np.array([x, y, points[:, 2].mean()])
