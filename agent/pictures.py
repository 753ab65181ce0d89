"""Pictures for the report: what the camera took, and the table from above with every object's cloud.

Drawn as the speaker sees it from the robot's side: up is +x (away), left is +y.
"""

from __future__ import annotations

import io
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from PIL import Image, ImageDraw, ImageFont
from scipy.spatial import ConvexHull, QhullError

from agent import events
from agent.colors import color_of
from structdiffusion.geometry import transform_points
from structdiffusion.observation import Arrangement, ObjectCloud, Scene, Table

_PIXELS_PER_METRE = 1500  # of the drawing, which is then halved so that its edges are smooth
_MARGIN = 0.05
_FONT_PIXELS = 30
FORMAT = "webp"
_QUALITY, _FILM_QUALITY = 88, 75
FILM_SPEED = 12.0  # pictures a second
_LAST_PICTURE = 1500  # ms
_PAPER, _WOOD, _EDGE, _QUIET = (255, 255, 255), (244, 236, 222), (203, 187, 160), (150, 150, 150)


@dataclass(frozen=True)
class Picture:
    """A picture, or a film, as it is kept.

    Attributes:
        name: its file's stem.
        caption: what it shows.
        content: the bytes of a WebP file.
    """

    name: str
    caption: str
    content: bytes


def pictures_of(event: events.Event) -> Iterator[Picture]:
    """The pictures that belong to an event, from the clouds and images that only a live event has."""
    match event:
        case events.Perceived():
            if event.scene.color is not None:
                yield Picture("camera-before", "the scene before, through the camera", webp_of(event.scene.color))
            yield Picture("scene-before", "the scene before, from above", webp_of(from_above(event.scene)))
        case events.Chosen():
            image = imagined(event.scene, event.arrangement)
            yield Picture("imagined-goal", "the imagined goal, from above", webp_of(image))
        case events.Pictured():
            yield Picture(event.name, event.caption, webp_of(event.image))
        case events.Filmed() if len(event.frames):
            faster = event.interval * FILM_SPEED
            yield Picture("film", f"the arm at work, {faster:.0f} times as fast", film_of(event.frames))


class _Sheet:
    """A drawing in world coordinates."""

    def __init__(self, table: Table) -> None:
        self.table = table
        width = table.y_max - table.y_min + 2 * _MARGIN
        height = table.x_max - table.x_min + 2 * _MARGIN
        self.image = Image.new("RGB", (round(width * _PIXELS_PER_METRE), round(height * _PIXELS_PER_METRE)), _PAPER)
        self.pen = ImageDraw.Draw(self.image, "RGBA")
        self.font = ImageFont.load_default(_FONT_PIXELS)
        corners = np.array([[table.x_max, table.y_max], [table.x_min, table.y_min]])
        self.pen.rectangle([tuple(corner) for corner in self.pixels(corners)], fill=_WOOD, outline=_EDGE, width=4)

    def pixels(self, points: np.ndarray) -> np.ndarray:
        """World x, y (P, 2 or 3) to pixel columns and rows (P, 2)."""
        columns = (self.table.y_max + _MARGIN - points[:, 1]) * _PIXELS_PER_METRE
        rows = (self.table.x_max + _MARGIN - points[:, 0]) * _PIXELS_PER_METRE
        return np.stack((columns, rows), axis=1)

    def outline(self, points: np.ndarray) -> list[tuple[float, float]]:
        """The closed outline, in pixels, of points seen from above; empty when they span no area."""
        flat = self.pixels(points)
        try:
            ring = flat[ConvexHull(flat).vertices]
        except (QhullError, ValueError):
            return []
        return [tuple(point) for point in (*ring, ring[0])]

    def cloud(self, points: np.ndarray, colors: np.ndarray | None, rim: tuple[int, int, int], fill: int) -> None:
        """The points themselves inside their outline."""
        outline = self.outline(points)
        if outline:
            self.pen.polygon(outline, fill=(*rim, fill))
        if colors is None:
            colors = np.broadcast_to(np.array(rim, dtype=np.uint8), points.shape)
        for order in np.argsort(points[:, 2])[:: max(1, len(points) // 2500)]:
            column, row = self.pixels(points[order : order + 1])[0]
            self.pen.ellipse((column - 3, row - 3, column + 3, row + 3), fill=tuple(int(c) for c in colors[order]))
        if outline:
            self.pen.line(outline, fill=rim, width=5, joint="curve")

    def label(self, text: str, points: np.ndarray, color: tuple[int, int, int]) -> None:
        """A name on a light plate, just below what it names."""
        pixels = self.pixels(points)
        column, row = pixels[:, 0].mean(), pixels[:, 1].max() + _FONT_PIXELS * 0.8
        left, top, right, bottom = self.pen.textbbox((column, row), text, font=self.font, anchor="mm")
        self.pen.rounded_rectangle((left - 7, top - 5, right + 7, bottom + 5), radius=8, fill=(255, 255, 255, 215))
        self.pen.text((column, row), text, font=self.font, anchor="mm", fill=color)

    def finish(self) -> np.ndarray:
        """The picture (H, W, 3) uint8."""
        return np.asarray(self.image.resize((self.image.width // 2, self.image.height // 2), Image.LANCZOS))


def _quiet(sheet: _Sheet, clouds: tuple[ObjectCloud, ...]) -> None:
    for cloud in clouds:
        sheet.cloud(cloud.points, None, _QUIET, 40)
        sheet.label(cloud.name, cloud.points, _QUIET)


def from_above(scene: Scene) -> np.ndarray:
    """What the camera saw, from above: (H, W, 3) uint8; the distractors in grey."""
    sheet = _Sheet(scene.table)
    _quiet(sheet, scene.distractors)
    for index, cloud in enumerate(scene.objects):
        sheet.cloud(cloud.points, cloud.colors, color_of(index), 40)
    for index, cloud in enumerate(scene.objects):
        sheet.label(cloud.name, cloud.points, color_of(index))
    return sheet.finish()


def imagined(scene: Scene, arrangement: Arrangement) -> np.ndarray:
    """The goal from above: (H, W, 3) uint8; every cloud moved there, with its outline and way from where it is now."""
    sheet = _Sheet(scene.table)
    _quiet(sheet, scene.distractors)
    moved = [
        transform_points(motion, cloud.points)
        for motion, cloud in zip(arrangement.goal_from_initial, scene.objects, strict=True)
    ]
    for index, cloud in enumerate(scene.objects):
        now = sheet.outline(cloud.points)
        if now:
            sheet.pen.line(now, fill=(*color_of(index), 110), width=3)
        way = sheet.pixels(np.stack((cloud.centroid, moved[index].mean(axis=0))))
        sheet.pen.line([tuple(point) for point in way], fill=(*color_of(index), 90), width=4)
    for index in np.argsort([points[:, 2].mean() for points in moved]):  # what stands on top is drawn last
        sheet.cloud(moved[index], scene.objects[index].colors, color_of(index), 60)
    for index, cloud in enumerate(scene.objects):
        sheet.label(cloud.name, moved[index], color_of(index))
    return sheet.finish()


def webp_of(image: np.ndarray) -> bytes:
    """A picture (H, W, 3) uint8 as the bytes of a WebP file."""
    buffer = io.BytesIO()
    Image.fromarray(np.ascontiguousarray(image[..., :3])).save(buffer, format="WEBP", quality=_QUALITY)
    return buffer.getvalue()


def film_of(frames: np.ndarray) -> bytes:
    """Pictures (T, H, W, 3) uint8 as the bytes of an animated WebP file that plays again and again."""
    first, *rest = (Image.fromarray(np.ascontiguousarray(frame[..., :3])) for frame in frames)
    durations = [round(1000 / FILM_SPEED)] * len(rest) + [_LAST_PICTURE]
    buffer = io.BytesIO()
    first.save(
        buffer, format="WEBP", save_all=True, append_images=rest, duration=durations, loop=0, quality=_FILM_QUALITY,
        method=2,
    )  # fmt: skip
    return buffer.getvalue()
