"""Clouds drawn with their outlines and names: on the table seen from above, or on the camera's picture.

As the speaker sees it from the robot's side: up is +x (away), left is +y.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
from PIL import Image, ImageDraw, ImageFont
from scipy.spatial import ConvexHull, QhullError

from agent.colors import RGB, color_of
from structdiffusion.camera import project
from structdiffusion.geometry import transform_points
from structdiffusion.observation import Arrangement, ObjectCloud, Scene, Table

_PIXELS_PER_METRE = 1500  # of the drawing, which is then halved so that its edges are smooth
_MARGIN = 0.05
_FONT_PIXELS = 30
_LONGEST_NAME = 24  # characters of a name: a longer one would hide what is around it
_POINTS = 2500  # of a cloud that are drawn
_DIMMED = 0.45  # of the camera's picture that is left below a goal
_PAPER, _WOOD, _EDGE, _QUIET = (255, 255, 255), (244, 236, 222), (203, 187, 160), (150, 150, 150)


class _Sheet:
    """A drawing in world coordinates, twice as large as it will be.

    Args:
        image: what is drawn upon.
        pixels: world points (P, 3) to columns and rows (P, 2).
    """

    def __init__(self, image: Image.Image, pixels: Callable[[np.ndarray], np.ndarray]) -> None:
        self.image, self.pixels = image, pixels
        self.pen = ImageDraw.Draw(self.image, "RGBA")
        self.font = ImageFont.load_default(_FONT_PIXELS)
        self._plates: list[tuple[float, float, float, float]] = []

    def outline(self, points: np.ndarray) -> list[tuple[float, float]]:
        """The closed outline, in pixels, of points; empty when they span no area."""
        flat = self.pixels(points)
        try:
            ring = flat[ConvexHull(flat).vertices]
        except (QhullError, ValueError):
            return []
        return [tuple(point) for point in (*ring, ring[0])]

    def cloud(self, points: np.ndarray, colors: np.ndarray | None, rim: RGB, fill: int) -> None:
        """The points themselves inside their outline, which is filled with `rim`, `fill` of 255 opaque."""
        outline = self.outline(points)
        if outline:
            self.pen.polygon(outline, fill=(*rim, fill))
        if colors is None:
            colors = np.broadcast_to(np.array(rim, dtype=np.uint8), points.shape)
        shown = np.argsort(points[:, 2])[:: max(1, len(points) // _POINTS)]
        for (column, row), color in zip(self.pixels(points[shown]), colors[shown], strict=True):
            self.pen.ellipse((column - 3, row - 3, column + 3, row + 3), fill=tuple(int(c) for c in color))
        if outline:
            self.pen.line(outline, fill=rim, width=5, joint="curve")

    def label(self, text: str, points: np.ndarray, color: RGB) -> None:
        """A name on a light plate below what it names, and below the plates that are there already."""
        text = text if len(text) <= _LONGEST_NAME else text[: _LONGEST_NAME - 1].rstrip() + "…"
        pixels = self.pixels(points)
        column, row = pixels[:, 0].mean(), pixels[:, 1].max() + _FONT_PIXELS * 0.8
        plate = self._plate(text, column, row)
        half = (plate[2] - plate[0]) / 2
        column = min(max(column, half), self.image.width - half)
        plate = self._plate(text, column, row)
        while any(_overlap(plate, other) for other in self._plates) and plate[3] < self.image.height:
            row += _FONT_PIXELS / 4
            plate = self._plate(text, column, row)
        self._plates.append(plate)
        self.pen.rounded_rectangle(plate, radius=8, fill=(255, 255, 255, 215))
        self.pen.text((column, row), text, font=self.font, anchor="mm", fill=color)

    def _plate(self, text: str, column: float, row: float) -> tuple[float, float, float, float]:
        left, top, right, bottom = self.pen.textbbox((column, row), text, font=self.font, anchor="mm")
        return left - 7, top - 5, right + 7, bottom + 5

    def finish(self) -> np.ndarray:
        """The picture (H, W, 3) uint8."""
        return np.asarray(self.image.resize((self.image.width // 2, self.image.height // 2), Image.LANCZOS))


def _overlap(one: tuple[float, float, float, float], other: tuple[float, float, float, float]) -> bool:
    return one[0] < other[2] and other[0] < one[2] and one[1] < other[3] and other[1] < one[3]


def _table_sheet(table: Table) -> _Sheet:
    width = table.y_max - table.y_min + 2 * _MARGIN
    height = table.x_max - table.x_min + 2 * _MARGIN

    def pixels(points: np.ndarray) -> np.ndarray:
        columns = (table.y_max + _MARGIN - points[:, 1]) * _PIXELS_PER_METRE
        rows = (table.x_max + _MARGIN - points[:, 0]) * _PIXELS_PER_METRE
        return np.stack((columns, rows), axis=1)

    size = (round(width * _PIXELS_PER_METRE), round(height * _PIXELS_PER_METRE))
    sheet = _Sheet(Image.new("RGB", size, _PAPER), pixels)
    corners = pixels(np.array([[table.x_max, table.y_max], [table.x_min, table.y_min]]))
    sheet.pen.rectangle([tuple(corner) for corner in corners], fill=_WOOD, outline=_EDGE, width=4)
    return sheet


def _quiet(sheet: _Sheet, clouds: tuple[ObjectCloud, ...]) -> None:
    for cloud in clouds:
        sheet.cloud(cloud.points, None, _QUIET, 40)
        sheet.label(cloud.name, cloud.points, _QUIET)


def from_above(scene: Scene) -> np.ndarray:
    """What the camera saw, from above: (H, W, 3) uint8; the distractors in grey."""
    sheet = _table_sheet(scene.table)
    _quiet(sheet, scene.distractors)
    for index, cloud in enumerate(scene.objects):
        sheet.cloud(cloud.points, cloud.colors, color_of(index), 40)
    for index, cloud in enumerate(scene.objects):
        sheet.label(cloud.name, cloud.points, color_of(index))
    return sheet.finish()


def imagined(scene: Scene, arrangement: Arrangement) -> np.ndarray:
    """The goal from above: (H, W, 3) uint8; every cloud moved there, with its outline and way from where it is now."""
    sheet = _table_sheet(scene.table)
    _quiet(sheet, scene.distractors)
    moved = _moved(scene, arrangement)
    for index, cloud in enumerate(scene.objects):
        now = sheet.outline(cloud.points)
        if now:
            sheet.pen.line(now, fill=(*color_of(index), 110), width=3)
        way = sheet.pixels(np.stack((cloud.centroid, moved[index].mean(axis=0))))
        sheet.pen.line([tuple(point) for point in way], fill=(*color_of(index), 90), width=4)
    _goals(sheet, scene, moved, 60)
    return sheet.finish()


def goal_overlay(scene: Scene, arrangement: Arrangement) -> np.ndarray:
    """The goal over the camera's picture, which is dimmed: (H, W, 3) uint8.

    Args:
        scene: with its picture, and the camera's pose and intrinsics.
        arrangement: where every cloud goes.

    Raises:
        ValueError: for a scene without a picture, or whose camera is not known.
    """
    if scene.color is None or scene.intrinsics is None or scene.world_from_camera is None:
        raise ValueError("a scene without a picture of a known camera has nothing to draw a goal upon")
    height, width = scene.color.shape[:2]
    pixels = partial(
        project, world_from_camera=scene.world_from_camera, intrinsics=np.diag((2.0, 2.0, 1.0)) @ scene.intrinsics
    )
    picture = Image.fromarray(np.ascontiguousarray(scene.color[..., :3])).resize((2 * width, 2 * height))
    picture = Image.blend(Image.new("RGB", picture.size, _PAPER), picture, _DIMMED)
    sheet = _Sheet(picture, pixels)
    _goals(sheet, scene, _moved(scene, arrangement), 90)
    return sheet.finish()


def _moved(scene: Scene, arrangement: Arrangement) -> list[np.ndarray]:
    """The clouds (P, 3) of the objects that take part, where they go."""
    pairs = zip(arrangement.goal_from_initial, scene.objects, strict=True)
    return [transform_points(motion, cloud.points) for motion, cloud in pairs]


def _goals(sheet: _Sheet, scene: Scene, moved: list[np.ndarray], fill: int) -> None:
    for index in np.argsort([points[:, 2].mean() for points in moved]):  # what stands on top is drawn last
        sheet.cloud(moved[index], scene.objects[index].colors, color_of(index), fill)
    for index, cloud in enumerate(scene.objects):
        sheet.label(cloud.name, moved[index], color_of(index))
