"""Films as animated WebP files: any program plays them, and their frames come out as they went in."""

import io

import numpy as np
import pytest
from PIL import Image

from agent.rendering.animation import animation, still_frames


def striped(count: int, height: int = 48, width: int = 64) -> np.ndarray:
    frames = np.zeros((count, height, width, 3), np.uint8)
    for number, frame in enumerate(frames):
        frame[:, number * 8 : number * 8 + 8] = (40 * number + 60, 90, 200)
    return frames


def decoded(content: bytes, number: int = 0) -> np.ndarray:
    with Image.open(io.BytesIO(content)) as image:
        image.seek(number)
        return np.asarray(image.convert("RGB")).astype(int)


def test_any_program_plays_it():
    content = animation(striped(5), [125] * 4 + [1500], 80)
    with Image.open(io.BytesIO(content)) as film:
        assert film.format == "WEBP" and film.n_frames == 5 and film.size == (64, 48) and film.info["loop"] == 0
        for number in range(5):
            film.seek(number)
            film.load()
            assert film.info["duration"] == (125 if number < 4 else 1500)
    for number, frame in enumerate(striped(5)):
        assert np.abs(decoded(content, number) - frame).mean() < 12


@pytest.mark.parametrize("size", [(48, 64), (47, 63)])  # pictures of an odd number of bytes too
def test_every_frame_comes_out_as_a_picture(size):
    content = animation(striped(4, *size), [100] * 4, 80)
    stills = still_frames(content)
    assert stills is not None and len(stills) == 4
    for number, still in enumerate(stills):
        assert (decoded(still) == decoded(content, number)).all()


def test_a_film_of_changes_has_no_whole_frames():
    first, *rest = map(Image.fromarray, striped(4))
    buffer = io.BytesIO()
    first.save(buffer, format="WEBP", save_all=True, append_images=rest, duration=80, loop=0, quality=75)
    assert still_frames(buffer.getvalue()) is None


def test_a_single_picture_is_no_film():
    buffer = io.BytesIO()
    Image.fromarray(striped(1)[0]).save(buffer, format="WEBP")
    assert still_frames(buffer.getvalue()) is None
