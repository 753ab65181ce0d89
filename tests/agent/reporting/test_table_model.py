"""The table in 3D on the page of a run: its bodies, its motions, its size, and how a page shows it."""

import base64
import json
import re
from dataclasses import replace

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from agent import events
from agent.arm.visual_shapes import LinkShape
from agent.pipeline.event_builders import perceived_event
from agent.reporting.html.document import session_page
from agent.reporting.run_report import RunRecord
from agent.reporting.session_reader import Session
from agent.reporting.table_model import CANDIDATES, TableModel
from agent.reporting.table_parts import part_error
from structdiffusion.geometry import pose_from_xyz_yaw, transform_points
from structdiffusion.observation import Arrangement, ObjectCloud, Scene


def model_of(run_events) -> dict:
    model = TableModel()
    for event in run_events:
        model.on_event(event)
    return model.to_dict()


def lengths(text: str) -> np.ndarray:
    return np.frombuffer(base64.b64decode(text), "<i2").reshape(-1, 3) / 10_000


def data_of(page: str) -> dict:
    figure = re.search(r'<figure class="table-view">.*?</figure>', page, re.DOTALL).group()
    return json.loads(re.search(r'<script type="application/json">(.*?)</script>', figure).group(1))


def page_of(run_events) -> str:
    record = RunRecord()
    for event in run_events:
        record.on_event(event)
    return session_page(Session("0.1.0", "2025-01-31T09:30:00+00:00", "Python", {}, ()), [record.turn])


def test_clouds_and_candidates_of_a_run(run_events, scene):
    model = model_of(run_events)
    assert [each["name"] for each in model["objects"]] == ["cup 1", "cup 2", "cup 3", "banana"]
    assert model["table"] == [0.18, 0.72, -0.45, 0.45] and model["robot"] is None
    points = lengths(model["objects"][0]["points"])
    assert np.abs(points[0] - scene.objects[0].points[0]).max() < 1e-4
    colors = base64.b64decode(model["objects"][0]["colors"])
    assert len(colors) == 3 * len(points)
    views = {view["name"]: view for view in model["views"]}
    assert list(views) == ["scene", "goal"]  # no picture of these events measured where anything was
    assert views["scene"]["frames"][0]["motions"] == [None] * 4
    frames = views["goal"]["frames"]
    assert len(frames) == 12 and frames[0]["caption"] == "candidate 1, score 0.900"
    assert frames[0]["motions"] == [[1, 0, 0, 0, 0, 1, 0, 0.1, 0, 0, 1, 0]] * 3 + [None]


def test_the_goal_that_was_chosen_is_shown_first_even_behind_the_others(run_events):
    many = CANDIDATES + 5
    proposed = next(event for event in run_events if isinstance(event, events.Proposed))
    chosen = next(event for event in run_events if isinstance(event, events.Chosen))
    crowd = replace(
        proposed,
        candidates=tuple(replace(proposed.candidates[0], rank=rank) for rank in range(1, many + 1)),
        arrangements=proposed.arrangements[:1] * many,
    )
    goal = model_of([run_events[2], crowd, replace(chosen, rank=3)])["views"][1]
    assert goal["start"] == 2 and len(goal["frames"]) == CANDIDATES
    goal = model_of([run_events[2], crowd, replace(chosen, rank=many)])["views"][1]
    assert goal["start"] == CANDIDATES and goal["frames"][-1]["caption"].startswith(f"candidate {many},")


def test_steps_of_a_build_are_frames(run_events):
    moved = pose_from_xyz_yaw(0.1, 0.0, 0.0, 0.5)
    image = np.zeros((48, 64, 3), np.uint8)
    steps = [
        events.Pictured(f"placement-{n}-after", f"step {n}, through the camera", image, {"cup 2": moved})
        for n in (1, 2)
    ]
    steps.append(events.Pictured("placement-3-picked", "a picture alone", image))
    build = model_of([*run_events[:5], *steps])["views"][-1]
    assert (build["name"], build["start"]) == ("build", 1)
    assert [frame["caption"] for frame in build["frames"]] == ["step 1", "step 2"]
    assert build["frames"][1]["motions"][1] == pytest.approx(moved[:3].ravel().tolist(), abs=1e-4)
    assert build["frames"][1]["motions"][0] is None
    released = model_of([*run_events[:5], events.Tried((), ()), steps[0]])["views"][-1]
    assert released["name"] == "released"


def filmed(run_events) -> list:
    """A look, a placement, and a film of five moments in which the arm's one link rises and cup 2 goes along."""
    way = np.array([pose_from_xyz_yaw(0.0, 0.0, z, 2 * z) for z in (0.0, 0.1, 0.2, 0.2, 0.2)])
    placed = events.Pictured("placement-1-after", "after placement 1", np.zeros((4, 4, 3), np.uint8), {"cup 2": way[3]})
    still = np.tile(np.eye(4), (5, 1, 1))
    arm = LinkShape(3, (0.1, 0.1, 0.2), True, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), (9, 9, 9))
    frames = np.zeros((0, 4, 4, 3), np.uint8)
    film = events.Filmed(1.25, frames, 0.25, {"cup 1": still, "cup 2": way}, {3: way}, (arm,))
    return [*run_events[:5], placed, film]


def test_a_film_has_the_places_of_everything_at_every_moment(run_events):
    film = model_of(filmed(run_events))["film"]
    assert film["every"] == 0.25 and film["marks"] == [(2, "after placement 1")]
    assert [track is None for track in film["motions"]] == [True, False, True, True]
    track = np.frombuffer(base64.b64decode(film["motions"][1]), "<i2").reshape(5, 7)
    assert track[:, :3].tolist() == [[0, 0, z] for z in (0, 1000, 2000, 2000, 2000)]
    turns = Rotation.from_quat(track[:, 3:] / 32_767).as_euler("xyz")
    assert turns == pytest.approx(np.outer((0.0, 0.2, 0.4, 0.4, 0.4), (0, 0, 1)), abs=1e-3)
    assert film["links"] == {"3": film["motions"][1]} and film["shapes"][0]["sides"] == [0.1, 0.1, 0.2]


def test_parts_make_the_same_table_again_and_broken_ones_are_named(run_events):
    first, again = TableModel(), TableModel()
    parts = [json.loads(json.dumps(part)) for event in filmed(run_events) if (part := first.on_event(event))]
    assert [next(iter(part)) for part in parts] == ["seen", "candidates", "chosen", "step", "film"]
    for part in parts:
        assert part_error(part) == ""
        again.take(part)
    assert json.dumps(again.to_dict()) == json.dumps(first.to_dict())
    broken = 0
    for part in parts:
        kind = next(iter(part))
        for bad in spoiled(part[kind]):
            assert part_error({**part, kind: bad}).startswith("its table is not a part that structagent writes")
            broken += 1
    assert broken > 50
    for nothing in (None, 3, [], {}, {"other": 1}, {**parts[0], "more": 1}):
        assert part_error(nothing)


def spoiled(value):
    """The value, and in turn everything in it, replaced by what no part may have there."""
    yield {"x": object}
    yield "*" if isinstance(value, str) else "AAA"
    if isinstance(value, dict):
        for key, inner in value.items():
            if key != "caption" and key != "name":
                yield from ({**value, key: bad} for bad in spoiled(inner))
    if isinstance(value, list) and value and not isinstance(value[0], str | None):
        yield from ([bad, *value[1:]] for bad in spoiled(value[0]))


def test_bodies_in_physics_are_where_they_stand(table):
    seen = table.look()
    model = model_of([perceived_event(seen, 0.1, table)])
    assert model["robot"] == [0.0, 0.0, 0.0]
    for index, each in enumerate(model["objects"]):
        assert "points" not in each
        body = transform_points(table.world.pose(index), table.models[index].mesh_vertices)
        assert np.abs(lengths(each["vertices"]).max(axis=0) - body.max(axis=0)).max() < 1e-3


def test_nothing_was_seen():
    assert TableModel().to_dict() is None


def test_the_page_has_the_view_hidden_for_those_without_webgl(run_events):
    page = page_of(run_events)
    section = re.search(r"<section[^>]*>\s*<h3>The table in 3D</h3>.*?</section>", page, re.DOTALL).group()
    assert section.startswith("<section hidden>")
    assert re.findall(r'<button type="button" value="(\w+)"', section) == ["scene", "goal"]
    assert 'type="range"' in section and "<canvas" in section
    assert data_of(page) == model_of(run_events)
    assert page.count("class TableView") == 1 and "getContext" in page
    assert page.count("<img ") >= 3  # the pictures are there as before


def test_hostile_names_stay_names(run_events, scene):
    evil = "</script><script>alert(1)</script>"
    named = replace(scene, objects=(replace(scene.objects[0], name=evil), *scene.objects[1:]))
    page = page_of([run_events[0], perceived_event(named, 0.1)])
    assert data_of(page)["objects"][0]["name"] == evil
    assert "<script>alert" not in page


def test_a_crowded_table_is_a_small_page(run_events):
    ball = trimesh.creation.icosphere(5, 0.04)  # 20,480 faces
    rng = np.random.default_rng(0)
    names = [f"ball {number}" for number in range(30)]
    places = rng.uniform((0.2, -0.4, 0.04), (0.7, 0.4, 0.04), (30, 3))
    colors = np.full((len(ball.vertices), 3), 200, np.uint8)
    clouds = tuple(
        ObjectCloud(name, "ball", (ball.vertices + place).astype(np.float32), colors)
        for name, place in zip(names, places, strict=True)
    )
    crowded = Scene(clouds)
    surfaces = {name: (ball.vertices + place, ball.faces) for name, place in zip(names, places, strict=True)}
    perceived = replace(perceived_event(crowded, 0.1), surfaces=surfaces)
    motions = np.array([pose_from_xyz_yaw(*rng.uniform(-0.3, 0.3, 3), 1.0) for _ in names])
    proposed = next(event for event in run_events if isinstance(event, events.Proposed))
    candidates = tuple(replace(proposed.candidates[0], rank=rank) for rank in range(1, 65))
    arrangements = (Arrangement(motions, {"total": 0.5}),) * 64
    proposed = replace(proposed, candidates=candidates, scene=crowded, arrangements=arrangements)
    step = events.Pictured("a", "a", np.zeros((4, 4, 3), np.uint8), dict(zip(names, motions, strict=True)))
    size = len(json.dumps(model_of([perceived, proposed, *[step] * 30])))
    print(json.dumps({"bytes": size}))
    assert size < 1_000_000  # of the 3 MB that a page may have
