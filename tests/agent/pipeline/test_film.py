"""The film of a build: short however long the arm works, and sent however the build ends."""

import io

import numpy as np
import pytest
from PIL import Image

from agent.arm.events import Stopped
from agent.events import Checked, Filmed
from agent.pipeline.building import build_with_arm
from agent.pipeline.film import Film
from agent.rendering.image_files import film_of, pictures_of
from agent.scenes.table_scene import TableScene
from grounding.spec import StructureSpec
from structdiffusion.observation import Arrangement


@pytest.fixture(autouse=True)
def short_films():
    """Films are the subject here: nothing shortens them."""


def counted():
    """Pictures whose brightness is the number of the step at which they were taken."""
    step = [0]

    def take() -> np.ndarray:
        return np.full((6, 8, 3), step[0], np.uint8)

    return step, take


@pytest.mark.parametrize(
    ("steps_taken", "frames"), [(1, [0]), (7, [0, 2, 4, 6]), (12, [0, 4, 8]), (30, [0, 8, 16, 24])]
)
def test_film_stays_short_and_even(steps_taken, frames):
    step, take = counted()
    film = Film(take, interval=2 / 240, most=5)
    for step[0] in range(steps_taken):
        film.step()
    step[0] = 200
    filmed = film.finish()
    assert filmed.frames[:, 0, 0, 0].tolist() == [*frames, 200]
    if len(frames) > 1:
        assert filmed.interval == pytest.approx((frames[1] - frames[0]) / 240)


def test_no_film_where_nothing_moved():
    assert Film(counted()[1]).finish() is None


def test_film_is_kept_as_an_animation():
    frames = np.zeros((5, 24, 32, 3), np.uint8)
    for number, frame in enumerate(frames):
        frame[:, number * 6 : number * 6 + 6] = 255
    (picture,) = pictures_of(Filmed(0.8, frames))
    assert picture.name == "film" and "5 times as fast" in picture.caption
    with Image.open(io.BytesIO(film_of(frames))) as film:
        assert film.is_animated and film.n_frames == 5
        film.seek(3)
        shown = np.asarray(film.convert("L"))
    assert shown[:, 19:23].mean() > 200 > 60 > shown[:, :12].mean()


def test_an_interrupted_build_has_its_film_too(table):
    scene = table.look()
    motions = np.tile(np.eye(4), (2, 1, 1))
    motions[0, 1, 3] = 0.1
    passed, happened = [0], []

    def on_step(watched: TableScene) -> None:
        assert watched is table
        passed[0] += 1
        if passed[0] == 600:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        for event in build_with_arm(table, scene, StructureSpec("line"), [Arrangement(motions)], 0, on_step=on_step):
            happened.append(event)
    assert isinstance(happened[-2], Stopped) and isinstance(happened[-1], Filmed)
    assert not any(isinstance(event, Checked) for event in happened)
    frames = happened[-1].frames
    assert frames.shape[1:] == (480, 640, 3) and len(frames) >= 3
    assert np.abs(frames[2].astype(int) - frames[0]).max() > 30  # the arm has moved


def test_film_is_seen_from_the_robot_s_side_and_the_arm_stands_on_something(table):
    picture = table.picture("shoulder").astype(int)
    assert (picture.max(axis=2) - picture.min(axis=2))[-60:].max() < 40  # floor and pedestal, and no bare wood
    floor = (picture == 255).all(axis=2).mean()
    assert floor < 0.05  # there is no white void around the table
    lens = table._shoulder
    foot = lens.pixels(np.array((0.0, 0.0, -0.2))).astype(int)
    assert picture[foot[1], foot[0]].max() < 190  # the pedestal's gray, darker than the floor
    left, right = lens.pixels(np.array(((0.45, 0.3, 0.0), (0.45, -0.3, 0.0))))
    assert left[0] < right[0]
