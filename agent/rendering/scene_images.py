"""Draw clouds with their outlines and names, in their own colours: from above, or on the camera's picture.

As the speaker sees it from the robot's side: up is +x (away), left is +y. What takes no part has a dashed outline.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
from PIL import Image, ImageDraw, ImageFont
from scipy.spatial import ConvexHull, QhullError

from agent.rendering.palette import OUTLINE, RGB, color_of, ink_on, mean_color
from structdiffusion.geometry import transform_points
from structdiffusion.observation import Arrangement, ObjectCloud, Scene, Table
from structdiffusion.simulation.depth_camera import project

_PIXELS_PER_METRE = 1500  # of the drawing, which is then halved so that its edges are smooth
_MARGIN = 0.05
_FONT_PIXELS = 30
_LONGEST_NAME = 24  # characters of a name: a longer one would hide what is around it
_POINTS = 2500  # of a cloud that are drawn
_DIMMED = 0.45  # of the camera's picture that is left below a goal
_PAPER, _WOOD, _EDGE, _QUIET = (255, 255, 255), (244, 236, 222), (203, 187, 160), (110, 110, 110)
_DASH, _HEAD = 14, 26  # pixels: a dash of an outline, and the length of an arrow's head
_PLATE_MARGIN = 8  # pixels to the picture's edge
_START = 70  # of 255: how opaque an object is drawn where it starts from


class _Sheet:
    """A drawing in world coordinates, twice as large as it will be.

    Args:
        image: the image to draw on.
        pixels: world points (P, 3) to columns and rows (P, 2).
    """

    def __init__(self, image: Image.Image, pixels: Callable[[np.ndarray], np.ndarray]) -> None:
        self.image, self.pixels = image, pixels
        self.pen = ImageDraw.Draw(self.image, "RGBA")
        self.font = ImageFont.load_default(_FONT_PIXELS)
        self._plates: list[tuple[float, float, float, float]] = []

    def outline(self, points: np.ndarray) -> list[tuple[float, float]]:
        """Return the closed outline, in pixels, of points; empty when they span no area."""
        flat = self.pixels(points)
        try:
            ring = flat[ConvexHull(flat).vertices]
        except (QhullError, ValueError):
            return []
        return [tuple(point) for point in (*ring, ring[0])]

    def cloud(self, points: np.ndarray, colors: np.ndarray | None, own: RGB, fill: int) -> None:
        """Draw the points themselves inside their outline, which is filled with the object's own colour.

        Args:
            points: (P, 3) world frame.
            colors: (P, 3) of the points, or `None` for the object's own.
            own: the colour of the object.
            fill: how opaque the outline is filled, of 255.
        """
        outline = self.outline(points)
        if outline:
            self.pen.polygon(outline, fill=(*own, fill))
        if colors is None:
            colors = np.broadcast_to(np.array(own, dtype=np.uint8), points.shape)
        shown = np.argsort(points[:, 2])[:: max(1, len(points) // _POINTS)]
        for (column, row), color in zip(self.pixels(points[shown]), colors[shown], strict=True):
            self.pen.ellipse((column - 3, row - 3, column + 3, row + 3), fill=tuple(int(c) for c in color))
        if outline:
            self.pen.line(outline, fill=OUTLINE, width=9, joint="curve")
            self.pen.line(outline, fill=own, width=4, joint="curve")

    def start(self, points: np.ndarray, own: RGB) -> None:
        """Draw where an object is before it goes to its goal: faded, without its points."""
        outline = self.outline(points)
        if outline:
            self.pen.polygon(outline, fill=(*own, _START))
            self.pen.line(outline, fill=(*OUTLINE, 2 * _START), width=3, joint="curve")

    def dashes(self, points: np.ndarray, color: RGB) -> None:
        """Draw a dashed outline; the dashes continue around its corners."""
        outline = np.array(self.outline(points))
        passed = 0.0
        for one, other in zip(outline, outline[1:], strict=False):
            length = float(np.linalg.norm(other - one))
            first, last = int(passed // _DASH), int((passed + length) // _DASH)
            for number in range(first - first % 2, last + 1, 2):  # every second stretch is drawn
                ends = np.clip(np.array((number, number + 1)) * _DASH - passed, 0.0, length)
                stretch = [tuple(one + end / max(length, 1e-9) * (other - one)) for end in ends]
                self.pen.line(stretch, fill=color, width=5)
            passed += length

    def arrow(self, start: np.ndarray, goal: np.ndarray, own: RGB) -> None:
        """Draw an arrow from an object's start to the outline at its goal; nothing if these overlap.

        Args:
            start, goal: (P, 3) its points there, world frame.
            own: its colour.
        """
        tail, target = (self.pixels(points).mean(axis=0) for points in (start, goal))
        tip = _entry(tail, target, self.outline(goal))
        tail = _entry(target, tail, self.outline(start))
        along = tip - tail
        length = float(np.linalg.norm(along))
        if length < 1.5 * _HEAD or float(along @ (target - tail)) <= 0:
            return
        along /= length
        across = np.array((-along[1], along[0]))
        neck = tip - _HEAD * along
        head = [tuple(tip), tuple(neck + 0.45 * _HEAD * across), tuple(neck - 0.45 * _HEAD * across)]
        shaft = [tuple(tail), tuple(neck + 2 * along)]
        self.pen.line(shaft, fill=OUTLINE, width=9)
        self.pen.polygon(head, fill=OUTLINE)
        self.pen.line([*head, head[0]], fill=OUTLINE, width=3, joint="curve")
        self.pen.line(shaft, fill=own, width=6)
        self.pen.polygon(head, fill=own)

    def label(self, text: str, points: np.ndarray, color: RGB | None) -> None:
        """Draw a name on a plate below its object, and below existing plates.

        Args:
            text: the name.
            points: (P, 3) the object's cloud, world frame.
            color: of the plate, the object's own; by default the plate is light, as that of what takes no part.
        """
        text = text if len(text) <= _LONGEST_NAME else text[: _LONGEST_NAME - 1].rstrip() + "…"
        pixels = self.pixels(points)
        column, row = pixels[:, 0].mean(), pixels[:, 1].max() + _FONT_PIXELS * 0.8
        plate = self._plate(text, column, row)
        half = (plate[2] - plate[0]) / 2 + _PLATE_MARGIN
        column = min(max(column, half), self.image.width - half)
        plate = self._plate(text, column, row)
        while any(_overlap(plate, other) for other in self._plates) and plate[3] < self.image.height:
            row += _FONT_PIXELS / 4
            plate = self._plate(text, column, row)
        self._plates.append(plate)
        if color is None:
            self.pen.rounded_rectangle(plate, radius=8, fill=(255, 255, 255, 215))
        else:
            self.pen.rounded_rectangle(plate, radius=8, fill=color, outline=OUTLINE, width=3)
        ink = _QUIET if color is None else ink_on(color)
        self.pen.text((column, row), text, font=self.font, anchor="mm", fill=ink)

    def _plate(self, text: str, column: float, row: float) -> tuple[float, float, float, float]:
        left, top, right, bottom = self.pen.textbbox((column, row), text, font=self.font, anchor="mm")
        return left - 7, top - 5, right + 7, bottom + 5

    def finish(self) -> np.ndarray:
        """Return the picture (H, W, 3) uint8."""
        return np.asarray(self.image.reduce(2))


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


def _entry(outside: np.ndarray, inside: np.ndarray, outline: list[tuple[float, float]]) -> np.ndarray:
    """Return the first point (pixels) where a segment meets an outline; the end of the segment if it does not."""
    way = inside - outside
    shares = [1.0]
    for one, other in zip(np.array(outline), np.array(outline[1:]), strict=False):
        side = other - one
        cross = way[0] * side[1] - way[1] * side[0]
        if abs(cross) > 1e-9:
            gap = one - outside
            along = (gap[0] * side[1] - gap[1] * side[0]) / cross
            on_side = (gap[0] * way[1] - gap[1] * way[0]) / cross
            if 0.0 <= on_side <= 1.0 and 0.0 <= along <= 1.0:
                shares.append(along)
    return outside + min(shares) * way


def own_color(cloud: ObjectCloud, index: int) -> RGB:
    """Return the colour in which an object is drawn: the mean of its cloud's, or one of the palette where it has
    none."""
    return color_of(index, mean_color(cloud.colors))


def _quiet(sheet: _Sheet, clouds: tuple[ObjectCloud, ...]) -> None:
    for cloud in clouds:
        color = mean_color(cloud.colors) or _QUIET
        outline = sheet.outline(cloud.points)
        if outline:
            sheet.pen.polygon(outline, fill=(*color, _START))
        sheet.dashes(cloud.points, _QUIET)
        sheet.label(cloud.name, cloud.points, None)


def from_above(scene: Scene) -> np.ndarray:
    """Draw the observation from above: (H, W, 3) uint8."""
    sheet = _table_sheet(scene.table)
    _quiet(sheet, scene.distractors)
    for index, cloud in enumerate(scene.objects):
        sheet.cloud(cloud.points, cloud.colors, own_color(cloud, index), 60)
    for index, cloud in enumerate(scene.objects):
        sheet.label(cloud.name, cloud.points, own_color(cloud, index))
    return sheet.finish()


def goal_from_above(scene: Scene, arrangement: Arrangement) -> np.ndarray:
    """Draw the goal from above, (H, W, 3) uint8: every cloud at its start and, in front, at its goal, with an arrow."""
    sheet = _table_sheet(scene.table)
    _quiet(sheet, scene.distractors)
    moved = _moved(scene, arrangement)
    for index, cloud in enumerate(scene.objects):
        sheet.start(cloud.points, own_color(cloud, index))
    for index, cloud in enumerate(scene.objects):
        sheet.arrow(cloud.points, moved[index], own_color(cloud, index))
    _goals(sheet, scene, moved, 90)
    return sheet.finish()


def goal_overlay(scene: Scene, arrangement: Arrangement) -> np.ndarray:
    """Draw the goal over the camera's picture, which is dimmed: (H, W, 3) uint8.

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
    """Return the clouds (P, 3) of the objects that take part, moved to their goals."""
    pairs = zip(arrangement.goal_from_initial, scene.objects, strict=True)
    return [transform_points(motion, cloud.points) for motion, cloud in pairs]


def _goals(sheet: _Sheet, scene: Scene, moved: list[np.ndarray], fill: int) -> None:
    upward = np.argsort([points[:, 2].mean() for points in moved])
    for index in upward:  # what stands on top is drawn last
        cloud = scene.objects[index]
        sheet.cloud(moved[index], cloud.colors, own_color(cloud, index), fill)
    for index in reversed(upward):  # and its name stands above those of what is below it
        cloud = scene.objects[index]
        sheet.label(cloud.name, moved[index], own_color(cloud, index))
