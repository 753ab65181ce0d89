"""Write the pictures that belong to events as files."""

from __future__ import annotations

import io
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from PIL import Image

from agent import events
from agent.event_base import Event
from agent.rendering.animation import animation
from agent.rendering.scene_images import from_above, goal_from_above, goal_overlay

FORMAT = "webp"
FILM = "film"  # the name of the film among the pictures
_QUALITY, _FILM_QUALITY = 88, 75
FILM_SPEED = 8.0  # pictures a second
_LAST_PICTURE = 1500  # ms


@dataclass(frozen=True)
class Picture:
    """A picture, or a film, as it is kept.

    Attributes:
        name: its file's stem.
        caption: the caption.
        content: the bytes of a WebP file.
    """

    name: str
    caption: str
    content: bytes


def pictures_of(event: Event) -> Iterator[Picture]:
    """Draw the pictures that belong to an event, from the clouds and images that only a live event has."""
    match event:
        case events.Perceived():
            if event.scene.color is not None:
                yield Picture("camera-before", "the scene before, through the camera", webp_of(event.scene.color))
            if event.labelled is not None:
                yield Picture("objects-found", "the objects that were found", webp_of(event.labelled))
            yield Picture("scene-before", "the scene before, from above", webp_of(from_above(event.scene)))
        case events.Chosen():
            if event.scene.color is not None and event.scene.intrinsics is not None:
                overlay = goal_overlay(event.scene, event.arrangement)
                yield Picture("goal-overlay", "the proposed goal over the camera picture", webp_of(overlay))
            image = goal_from_above(event.scene, event.arrangement)
            yield Picture("proposed-goal", "the proposed goal from above, and the paths to it", webp_of(image))
        case events.Pictured():
            yield Picture(event.name, event.caption, webp_of(event.image))
        case events.Filmed() if len(event.frames):
            faster = event.interval * FILM_SPEED
            caption = f"the arm at work, seen from the robot's right, {faster:.0f} times as fast"
            yield Picture(FILM, caption, film_of(event.frames))


def webp_of(image: np.ndarray) -> bytes:
    """Encode a picture (H, W, 3) uint8 as a WebP file."""
    buffer = io.BytesIO()
    Image.fromarray(np.ascontiguousarray(image[..., :3])).save(
        buffer, format="WEBP", quality=_QUALITY, method=2
    )  # as the pictures of films: half of the time for 5 % more bytes
    return buffer.getvalue()


def within_size(content: bytes, most: int) -> bytes:
    """Return a picture, a WebP file, with so few pixels that it has at most `most` bytes."""
    if len(content) <= most:
        return content
    with Image.open(io.BytesIO(content)) as image:
        shown = image.convert("RGB")
    while len(content) > most and min(shown.size) > 1:
        shown.thumbnail((max(1, shown.width * 3 // 4), max(1, shown.height * 3 // 4)))
        content = webp_of(np.asarray(shown))
    return content


def film_of(frames: np.ndarray) -> bytes:
    """Encode pictures (T, H, W, 3) uint8 as an animated WebP file that plays again and again."""
    durations = [round(1000 / FILM_SPEED)] * (len(frames) - 1) + [_LAST_PICTURE]
    return animation(frames, durations, _FILM_QUALITY)
