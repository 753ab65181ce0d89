"""The film of a build: short however long the arm works, and sent however the build ends."""

import io

import numpy as np
import pytest
from PIL import Image

from agent.arm.events import Stopped
from agent.events import Checked, Filmed, Pictured
from agent.pipeline.building import build_with_arm
from agent.pipeline.film import Film
from agent.rendering.image_files import film_of, pictures_of
from agent.scenes.film_camera import Moment
from agent.scenes.table_scene import TableScene
from grounding.spec import StructureSpec
from structdiffusion.observation import Arrangement


@pytest.fixture(autouse=True)
def short_films():
    """Films are the subject here: nothing shortens them."""


class Counter:
    """A camera whose pictures are as bright as the number of the step at which they were taken."""

    def __init__(self) -> None:
        self.step = 0

    def moment(self) -> Moment:
        return Moment({"cup": np.full((4, 4), self.step)}, {0: np.eye(4)})

    def picture(self, moment: Moment) -> np.ndarray:
        return np.full((6, 8, 3), moment.objects["cup"][0, 0], np.uint8)


@pytest.mark.parametrize(
    ("steps", "moments", "frames"),
    [(1, [0], [0]), (7, [0, 2, 4, 6], [0]), (22, [*range(0, 21, 4)], [0, 20]), (81, [*range(0, 81, 16)], [0, 80])],
)
def test_film_stays_short_and_even(steps, moments, frames):
    camera = Counter()
    with Film(camera, interval=2 / 240, most=10) as film:
        for camera.step in range(steps):
            film.step()
        camera.step = 200
        filmed = film.finish()
    assert filmed.frames[:, 0, 0, 0].tolist() == [*frames, 200]
    assert filmed.motions["cup"][:, 0, 0].tolist() == [*moments, 200]
    assert filmed.links[0].shape == (len(moments) + 1, 4, 4)
    if len(moments) > 1:
        assert filmed.every == pytest.approx((moments[1] - moments[0]) / 240)
        assert filmed.interval == pytest.approx(5 * filmed.every)


def test_no_film_where_nothing_moved():
    with Film(Counter()) as film:
        assert film.finish() is None


def test_without_open3d_there_are_moments_and_a_reason(monkeypatch):
    def broken(self, moment):
        raise ImportError("libGL.so.1: cannot open shared object file")

    monkeypatch.setattr(Counter, "picture", broken)
    with Film(Counter()) as film:
        film.step()
        filmed = film.finish()
    assert film.trouble == "ImportError: libGL.so.1: cannot open shared object file"
    assert len(filmed.frames) == 0 and len(filmed.links[0]) == 2
    assert not list(pictures_of(filmed))


def test_film_is_kept_as_an_animation():
    frames = np.zeros((5, 24, 32, 3), np.uint8)
    for number, frame in enumerate(frames):
        frame[:, number * 6 : number * 6 + 6] = 255
    (picture,) = pictures_of(Filmed(1.25, frames))
    assert picture.name == "film" and "10 times as fast" in picture.caption
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
    assert not any(isinstance(event, Checked | Pictured) for event in happened)
    film = happened[-1]
    assert film.frames.shape[1:] == (480, 640, 3) and len(film.frames) >= 3
    assert np.abs(film.frames[2].astype(int) - film.frames[0]).max() > 30  # the arm has moved
    assert film.motions.keys() == set(table.names)
    assert film.motions[table.names[0]][0] == pytest.approx(np.eye(4), abs=5e-3)
    assert {shape.link for shape in film.shapes} <= film.links.keys()
