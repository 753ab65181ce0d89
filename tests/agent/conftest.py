"""A short invented run, in the pipeline's own events, and a small real table, for tests of the listeners."""

import functools
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
import trimesh
import typer

from agent import events
from agent.arm.events import Picked, Placed, Planned
from agent.arm.trajectories import trajectory
from agent.event_base import Event
from agent.scenes.object_placement import load_scene
from agent.scenes.table_scene import TableScene
from agent.scenes.validation import StandingObject
from grounding.goal_network.writer import NetworkWriter
from grounding.parsers.sentence_encoder import SentenceEncoder
from grounding.spec import StructureSpec
from grounding.verify.verifier import Verifier
from structdiffusion import parallel
from structdiffusion.completion.methods import BEST, CompletedShape, complete
from structdiffusion.geometry import pose_from_xyz_yaw
from structdiffusion.objects.libraries import LIBRARIES
from structdiffusion.objects.procedural import procedural_object, procedural_objects
from structdiffusion.observation import Arrangement, ObjectCloud, Scene
from structdiffusion.simulation.depth_camera import DepthCamera
from structdiffusion.structures.checks import Check
from tests.browser import Browser, Page, running_browser

INSTRUCTION = 'put the cups in a small circle <script>alert("x")</script>'

_MOST_CLOUDS = 200
_SQUARE = 0.03 * np.array(((1, 1), (1, -1), (-1, -1), (-1, 1)))


def _cloud(name: str, category: str, x: float, y: float, rng: np.random.Generator) -> ObjectCloud:
    points = (rng.uniform(-0.03, 0.03, (300, 3)) + (x, y, 0.03)).astype(np.float32)
    return ObjectCloud(name, category, points, rng.integers(0, 255, (300, 3), dtype=np.uint8))


def _once_per_file(compute: Callable[..., object]) -> Callable[..., object]:
    """Return `compute`, of a sentence encoder and more, which computes once for as long as the encoder's file stays."""
    known: dict[tuple[object, ...], object] = {}

    def computed(encoder: SentenceEncoder, *more: object) -> object:
        file = encoder.folder / "model.safetensors"
        if not file.is_file():
            return compute(encoder, *more)
        state = file, file.stat().st_mtime_ns, file.stat().st_size, *more
        if state not in known:
            known[state] = compute(encoder, *more)
        return known[state]

    return computed


def _once_per_cloud() -> Callable[..., CompletedShape]:
    """Return what `complete` does, for each cloud once: the tests' tables are looked at with the same noise."""
    known: dict[tuple[object, ...], CompletedShape] = {}

    def completed(
        cloud: ObjectCloud, world_from_camera: np.ndarray | None, method: str = BEST, covered: bool = False
    ) -> CompletedShape:
        eye = None if world_from_camera is None else world_from_camera.tobytes()
        seen = np.asarray(cloud.points, dtype=np.float64).tobytes(), cloud.bottom, eye, method, covered
        if seen not in known:
            if len(known) >= _MOST_CLOUDS:
                known.clear()
            known[seen] = complete(cloud, world_from_camera, method, covered)
            for array in (*known[seen].parts, known[seen].seen):
                array.setflags(write=False)
        return known[seen]

    return completed


@pytest.fixture(scope="session", autouse=True)
def computed_once() -> Iterator[None]:
    """Compute once for all tests of the agent what is the same for all: commands, the objects of libraries, the tests'
    own scene files, what the sentence encoder reads of its files, the networks of language over it, and the hidden
    sides of what the camera sees.

    In a process of one command each is computed once at most, and each has tests of its own elsewhere.
    """
    scenes: dict[Path, tuple[StandingObject, ...]] = {}

    def scene(path: Path) -> tuple[StandingObject, ...]:
        if not path.is_relative_to(Path(__file__).parent):  # a test has written it
            return load_scene(path)
        if path not in scenes:
            scenes[path] = load_scene(path)
        return scenes[path]

    with pytest.MonkeyPatch.context() as patch:
        for name in ("checksum", "whole_words", "_tokenizer"):
            patch.setattr(SentenceEncoder, name, property(_once_per_file(getattr(SentenceEncoder, name).func)))
        patch.setattr(SentenceEncoder, "_load", _once_per_file(SentenceEncoder._load))
        for network in (NetworkWriter, Verifier):
            patch.setattr(network, "from_pretrained", _once_per_file(network.from_pretrained))
        patch.setattr("typer.main.get_command", functools.cache(typer.main.get_command))
        patch.setattr("structdiffusion.objects.procedural.procedural_object", functools.cache(procedural_object))
        patch.setitem(LIBRARIES, "ycb", lambda ycb=functools.cache(LIBRARIES["ycb"]): list(ycb()))
        patch.setattr("agent.scenes.sources.load_scene", scene)
        completed = _once_per_cloud()
        for module in (
            "agent.arm.tracked_shape",
            "structdiffusion.completion.bodies",
            "structdiffusion.completion.surface",
        ):
            patch.setattr(f"{module}.complete", completed)
        yield


@pytest.fixture(autouse=True)
def short_films(monkeypatch):
    """Take a picture of the arm every 100 s and not every 1.25: drawing them is a third of a build's time."""
    monkeypatch.setattr("agent.pipeline.film.INTERVAL", 20.0)


@pytest.fixture
def quick_arm(monkeypatch):
    """Let the arm move three times as fast as its limits: how it moves is the subject of `tests/agent/arm`."""

    def quick(path, period, limits):
        return trajectory(path, period, 3 * limits)

    monkeypatch.setattr("agent.arm.controller.trajectory", quick)


@pytest.fixture
def in_this_process(monkeypatch):
    """Do here what commands give to worker processes, which import and load everything anew."""
    monkeypatch.setattr(parallel, "_by_processes", lambda work, jobs, workers: parallel._here(work, jobs))


@pytest.fixture
def small_drawings(monkeypatch):
    """Draw pictures from above with a ninth of the pixels."""
    monkeypatch.setattr("agent.rendering.scene_images._PIXELS_PER_METRE", 500)


@pytest.fixture
def objects(tmp_path) -> str:
    """A folder of meshes with which every structure can be made."""
    folder = tmp_path / "objects"
    folder.mkdir()
    for number in range(4):
        trimesh.creation.box((0.05, 0.05, 0.05 + 0.01 * number)).export(folder / f"box_{number}.stl")
    trimesh.creation.cylinder(0.09, 0.02).export(folder / "plate.stl")
    trimesh.creation.cylinder(0.03, 0.08).export(folder / "cup.stl")
    trimesh.creation.box((0.18, 0.02, 0.01)).export(folder / "fork.stl")
    return str(folder)


@pytest.fixture
def scene() -> Scene:
    rng = np.random.default_rng(0)
    cups = [_cloud(f"cup {i + 1}", "cup", 0.3 + 0.1 * i, -0.2 + 0.2 * i, rng) for i in range(3)]
    banana = _cloud("banana", "banana", 0.6, -0.3, rng)
    camera = DepthCamera(width=64, height=48)
    picture = np.full((48, 64, 3), 120, np.uint8)
    return Scene(
        tuple(cups),
        distractors=(banana,),
        world_from_camera=camera.world_from_camera,
        color=picture,
        intrinsics=camera.intrinsics,
    )


@pytest.fixture
def run_events(scene: Scene) -> list[Event]:
    """The events of a run in which three cups are put into a circle, with one number that is not finite."""
    motions = np.tile(np.eye(4), (3, 1, 1))
    motions[:, 1, 3] = 0.1
    scores = {"total": 0.9, "structure": 0.95, "collision": 0.97, "bounds": 1.0}
    arrangement = Arrangement(motions, scores)
    places = tuple(tuple(cloud.centroid.tolist()) for cloud in scene.objects)
    seen = tuple(
        events.SeenObject(
            cloud.name,
            cloud.category,
            i < 3,
            tuple(cloud.centroid.tolist()),
            len(cloud.points),
            tuple(map(tuple, (cloud.centroid[:2] + _SQUARE).tolist())),
            (120, 60, 30),
        )
        for i, cloud in enumerate(scene.objects + scene.distractors)
    )
    return [
        events.Started(INSTRUCTION, {"seed": 0, "execute": True}),
        events.Parsed(
            StructureSpec("circle", "small"),
            {"shape": 0.99, "size": 0.9},
            {"shape": ("circle",)},
            "embedding",
            {},
            ("cup",),
            "robot",
            None,
            "",
            0.2,
        ),
        events.Perceived(seen, (0.18, 0.72, -0.45, 0.45), 1.0, scene=scene),
        events.Proposed(
            "diffusion",
            tuple(events.Candidate(rank, scores, places, (0.0, 0.1, -0.1)) for rank in range(1, 13)),
            2.0,
            scene=scene,
            arrangements=(arrangement,) * 12,
        ),
        events.Chosen(
            1,
            scores,
            tuple({"name": cloud.name, "position": place} for cloud, place in zip(scene.objects, places)),
            arrangement=arrangement,
            scene=scene,
        ),
        Planned(0, (0, 1, 2), ("side", "side", "rim"), 3.0),
        Picked(0, "cup 1", "side", 1, 3, "friction"),
        Placed(0, "cup 1", False, 0.006, 0.02, np.eye(4), 4.0),
        events.Pictured("placement-1-after", "after placement 1: the cup 1", np.full((48, 64, 3), 90, np.uint8)),
        events.Checked(
            False,
            "semantic",
            (Check("largest gap over the mean", False, float("inf"), "at most 1.6"),),
            "largest gap over the mean: inf, allowed at most 1.6",
            "arm",
            2.5,
        ),
        events.Failed("check", "the structure was built but does not stand as asked", 5),
        events.Finished(False, 5, 14.0),
    ]


@pytest.fixture
def table() -> Iterator[TableScene]:
    """Two boxes on a table in physics, beside the arm."""
    boxes = [model for model in procedural_objects(count=60, seed=0) if model.category == "box"][:2]
    poses = np.array([pose_from_xyz_yaw(0.45, -0.15, 0.0, 0.0), pose_from_xyz_yaw(0.45, 0.2, 0.0, 0.0)])
    with TableScene(boxes, poses, 2, np.random.default_rng(0)) as table:
        yield table


@pytest.fixture(scope="session")
def browser(tmp_path_factory) -> Iterator[Browser]:
    """One real browser for all tests of a process."""
    with running_browser(tmp_path_factory.mktemp("browser")) as browser:
        yield browser


@pytest.fixture
def tab(browser) -> Iterator[Page]:
    """A page of the browser, as large as a window on a desk."""
    page = browser.page()
    page.size(1200, 900)
    yield page
    assert not page.errors
    page.close()
