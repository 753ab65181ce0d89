"""Draw what perception found: the camera's picture, or one from above, with the objects outlined and numbered."""

from __future__ import annotations

from typing import Any

import numpy as np
from PIL import Image, ImageDraw, ImageFont
from scipy import ndimage

from agent.perception.segments import ARM, Segments
from agent.recordings.recording import Recording
from agent.rendering.palette import RGB, color_of, ink_on, mean_color, rim_of

_TINT = 0.4  # of an object's colour in the picture is its own, which evens out its shades
_DIMMED = 0.55  # what is neither table nor object
_ACROSS = 640  # pixels of a view from above
_LETTERS = 16  # pixels high
_MARGIN = 3  # pixels about a number


def labelled_picture(recording: Recording, segments: Segments) -> np.ndarray:
    """Draw a picture (H, W, 3) uint8 with every object in its own colour, outlined and numbered as in its name.

    Each number stands on a patch of the object's mean colour. It is the camera's picture, or its depth where it has no
    colour; a view from above of an unorganised cloud. The objects have palette colours where their own are not known.
    """
    if recording.frame.organised:
        picture, labels = _seen(recording), segments.labels
    else:
        picture, labels = _from_above(recording, segments)
    picture = picture.astype(np.float32)
    picture[labels < 0] *= _DIMMED
    picture[labels == ARM] = picture[labels == ARM] * _DIMMED + 60.0
    own = [color_of(index, mean_color(segment.colors)) for index, segment in enumerate(segments.objects)]
    for number, color in enumerate(own, start=1):
        mask = labels == number
        picture[mask] = (1 - _TINT) * picture[mask] + _TINT * np.array(color, dtype=np.float32)
        inner = ndimage.binary_erosion(mask, iterations=2)
        picture[mask & ~inner] = color
        picture[mask & ~ndimage.binary_erosion(mask)] = rim_of(color)  # seen on a ground of the same colour too
    image = Image.fromarray(np.clip(picture, 0, 255).astype(np.uint8))
    draw = ImageDraw.Draw(image)
    font = ImageFont.load_default(_LETTERS)
    for number in range(1, len(own) + 1):
        if (labels == number).any():
            # Where it is thickest: the middle of a bowl that holds another lies in the other.
            inside = ndimage.distance_transform_edt(labels == number)
            row, column = np.unravel_index(int(inside.argmax()), inside.shape)
            _draw_badge(draw, (int(column), int(row)), str(number), own[number - 1], font)
    return np.asarray(image)


def _draw_badge(draw: ImageDraw.ImageDraw, middle: tuple[int, int], text: str, color: RGB, font: Any) -> None:
    """Draw a number on a patch of the object's own colour, with a dark and a light line about it: one of them, and the
    number, contrasts with any ground.
    """
    left, top, right, bottom = draw.textbbox(middle, text, font=font, anchor="mm")
    box = (left - _MARGIN, top - _MARGIN, right + _MARGIN, bottom + _MARGIN)
    for wider, line in ((2, "black"), (1, "white")):
        draw.rectangle((box[0] - wider, box[1] - wider, box[2] + wider, box[3] + wider), fill=line)
    draw.rectangle(box, fill=color)
    draw.text(middle, text, fill=ink_on(color), font=font, anchor="mm")


def _seen(recording: Recording) -> np.ndarray:
    """Return the camera's picture, or its depth: near is bright."""
    frame = recording.frame
    if frame.color is not None:
        return frame.color
    return _gray(-frame.points[..., 2])


def _gray(values: np.ndarray) -> np.ndarray:
    """Return a picture (..., 3) uint8 of values, the highest bright; black where there is none."""
    there = np.isfinite(values)
    shades = np.zeros((*values.shape, 3), dtype=np.uint8)
    if there.any():
        low, high = np.percentile(values[there], (2, 98))
        bright = np.clip((values[there] - low) / max(high - low, 1e-6), 0.0, 1.0)
        shades[there] = (40 + 215 * bright)[:, None]
    return shades


def _from_above(recording: Recording, segments: Segments) -> tuple[np.ndarray, np.ndarray]:
    """Return a view from above, x up and y to the left, and the labels in it; higher points hide lower ones."""
    frame, pose = recording.frame, segments.world_from_camera
    points = frame.points[0] @ pose[:3, :3].T.astype(np.float32) + pose[:3, 3].astype(np.float32)
    shown = np.isfinite(points).all(axis=1) & (segments.labels[0] != -1)
    points, labels = points[shown], segments.labels[0][shown]
    low, high = points[:, :2].min(axis=0), points[:, :2].max(axis=0)
    # Two points a pixel: fewer leave holes in what they show.
    size = max(float((high - low).max()) / _ACROSS, float(np.sqrt(2.0 * np.prod(high - low) / max(len(points), 1))))
    height, width = (np.ceil((high - low) / size).astype(int) + 1).tolist()
    upward = np.argsort(points[:, 2], kind="stable")
    rows = ((high[0] - points[upward, 0]) / size).astype(int)
    columns = ((high[1] - points[upward, 1]) / size).astype(int)
    seen = np.full((height, width), -1, dtype=labels.dtype)
    seen[rows, columns] = labels[upward]
    tops = np.full((height, width), np.nan)
    tops[rows, columns] = points[upward, 2]
    if frame.color is None:
        picture = _gray(tops)
    else:
        picture = np.zeros((height, width, 3), dtype=np.uint8)
        picture[rows, columns] = frame.color[0][shown][upward]
    scale = max(1, round(_ACROSS / max(height, width)))
    return picture.repeat(scale, axis=0).repeat(scale, axis=1), seen.repeat(scale, axis=0).repeat(scale, axis=1)
