"""Represent the objects on a table as point clouds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from grounding.resolve.attributes import ObjectAttributes, SceneObject
from structagent.clouds import (
    check_places,
    checked_bottoms,
    checked_clouds,
    checked_colors,
    checked_names,
    checked_table,
)
from structagent.errors import public_errors
from structdiffusion.observation import ObjectCloud, Table
from structdiffusion.observation import Scene as Observation

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

MOST_POINTS = 10_000  # of a cloud: more take time and tell nothing more of an outline and a height
UNNAMED = "object"
_LEAST_WHITE = 75.0  # lightness in CIELAB: among dark objects alone, the brightest is not white


@dataclass(frozen=True, eq=False, repr=False)
class Scene:
    """The objects on a table as a camera saw them.

    Attributes:
        clouds: for each object (P, 3) float32, world frame, metres; read-only.
        names: what each object is called, unique: "cup 1".
        colors: for each object (P, 3) uint8 RGB, or `None`; read-only.
        bottoms: z of what each object stands on, metres; 0 is the table top.
        table: the table top's rectangle, world frame, metres.
        image: (H, W, 3) uint8 camera picture, or `None`.
        intrinsics: (3, 3) of that picture, pixels, or `None`.
        world_from_camera: (4, 4), z forward, x right, y down, or `None`.
        notes: what had to be assumed, a sentence each.
        nouns: the noun of each object, "object" if unknown.
        referents: the objects as an instruction can refer to them: by name, colour and size.
    """

    clouds: tuple[np.ndarray, ...]
    names: tuple[str, ...]
    colors: tuple[np.ndarray | None, ...]
    bottoms: tuple[float, ...]
    table: Table
    image: np.ndarray | None = None
    intrinsics: np.ndarray | None = None
    world_from_camera: np.ndarray | None = None
    notes: tuple[str, ...] = ()
    nouns: tuple[str, ...] = ()
    referents: tuple[SceneObject, ...] = field(default=())

    @classmethod
    @public_errors()
    def from_clouds(
        cls,
        clouds: Sequence[ArrayLike] | np.ndarray,
        *,
        names: Sequence[str | None] | None = None,
        colors: Sequence[ArrayLike | None] | None = None,
        bottoms: Sequence[float] | None = None,
        table: Table | Sequence[float] | None = None,
    ) -> Scene:
        """Check point clouds and make a scene of them.

        Args:
            clouds: N arrays (P, 3), P at least 20, or one array (N, P, 3): any real dtype, metres, world frame.
            names: the noun of each object, such as "cup" or "soup can"; `None` if unknown.
            colors: for each cloud (P, 3), an RGB triple for the whole object, or `None`: integers of 0 to 255, or
                floats of 0 to 1.
            bottoms: z of what each object stands on, metres; by default 0, the table top.
            table: (x_min, x_max, y_min, y_max) of the table top, metres; by default that of the simulated table.

        Raises:
            StructagentError: for invalid input; the message names the value, its place and the legal values.
        """
        points = checked_clouds(clouds)
        unique, given = checked_names(names, len(points))
        shades = checked_colors(colors, points)
        heights, top = checked_bottoms(bottoms, len(points)), checked_table(table)
        check_places(points, top, heights)
        from grounding.resolve.object_names import read_name

        nouns = tuple(read_name(name).head or name or UNNAMED for name in given)
        attributes = _attributes(points, shades, heights)
        return cls(
            tuple(points),
            unique,
            shades,
            heights,
            top,
            nouns=nouns,
            referents=tuple(map(SceneObject, unique, attributes)),
        )

    def __len__(self) -> int:
        return len(self.clouds)

    def __repr__(self) -> str:
        return f"Scene({len(self)} objects: {', '.join(self.names)})"

    def _repr_html_(self) -> str:
        from structagent.notebooks import scene_html

        return scene_html(self.observation(range(len(self))), self.notes)

    def observation(self, members: Sequence[int]) -> Observation:
        """Return the scene as planners take it.

        Args:
            members: indices of the participants; the other objects stay in place.
        """
        clouds = tuple(
            ObjectCloud(name, noun, *_thinned(points, colors), bottom)
            for name, noun, points, colors, bottom in zip(
                self.names, self.nouns, self.clouds, self.colors, self.bottoms, strict=True
            )
        )
        everything = Observation(clouds, self.table, (), self.world_from_camera, self.image, self.intrinsics)
        return everything.select(members)


def _thinned(points: np.ndarray, colors: np.ndarray | None) -> tuple[np.ndarray, np.ndarray | None]:
    """Return a writable copy of a cloud with at most `MOST_POINTS` points, always the same ones."""
    if len(points) <= MOST_POINTS:
        return points.copy(), None if colors is None else colors.copy()
    kept = np.sort(np.random.default_rng(0).choice(len(points), MOST_POINTS, replace=False))
    return points[kept], None if colors is None else colors[kept]


def _attributes(
    clouds: Sequence[np.ndarray], colors: Sequence[np.ndarray | None], bottoms: Sequence[float]
) -> list[ObjectAttributes]:
    """Return the attributes by which an instruction can refer to objects: "the red ones", "the tallest"."""
    from agent.perception.color import lab
    from agent.perception.color_names import color_word, lightness_of_white
    from agent.perception.description import oriented_box
    from agent.scenes.object_attributes import color_words

    known = [shade for shade in colors if shade is not None]
    white = max(_LEAST_WHITE, lightness_of_white(np.concatenate(known))) if known else 0.0
    attributes = []
    for points, shade, bottom in zip(clouds, colors, bottoms, strict=True):
        length, width, top = oriented_box(points)[1].tolist()
        words = () if shade is None else color_words((color_word(lab(shade), white),))
        attributes.append(ObjectAttributes(words, (length, width, max(top - bottom, 0.0))))
    return attributes
