"""Recorded scenes as tables: a bag of a simulated scene is seen, completed, talked about, built on and saved."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from agent import events
from agent.arm.events import Placed
from agent.errors import BadInput, NotBuildable, UsageError
from agent.pipeline.run import RunOptions, run_instruction
from agent.recordings.recording import ReadingOf, RecordedOptions
from agent.scenes.digital_twin import RecordedSource
from agent.scenes.record_bag import record_session
from agent.scenes.sources import FileSource, scene_source
from agent.scenes.table_scene import TableScene
from grounding.resolve.goal import resolve_phrase
from grounding.resolve.referents import Referents
from structdiffusion.data.scene_sampling import SceneError
from structdiffusion.geometry import pose_from_xyz_yaw
from structdiffusion.objects.solids import assemble, box
from tests.agent.scenes.goals import a_line

RED, GREEN = (0.75, 0.1, 0.1), (0.1, 0.6, 0.15)
PLACES = ((0.35, 0.2), (0.5, 0.0), (0.4, -0.2))  # from left to right, as objects are numbered
HEIGHTS = (0.05, 0.14, 0.05)


def block(name, size, color):
    return assemble(
        name, "block", [box(size[0], size[1], 0.0, size[2])], density=400, friction=0.6, color=color,
        source="procedural", rng=np.random.default_rng(0),
    )  # fmt: skip


@pytest.fixture(scope="module")
def bag(tmp_path_factory) -> Path:
    """Two red blocks, one of them tall, and a green one."""
    models = [block(f"b{k}", (0.05, 0.05, height), RED if k < 2 else GREEN) for k, height in enumerate(HEIGHTS)]
    path = tmp_path_factory.mktemp("recorded") / "blocks.bag"
    poses = np.array([pose_from_xyz_yaw(x, y, 0.0, 0.0) for x, y in PLACES])
    with TableScene(models, poses, 3, np.random.default_rng(0)) as table:
        record_session(table, path, np.random.default_rng(0))
    return path


@pytest.fixture(scope="module")
def source(bag) -> RecordedSource:
    return RecordedSource(bag)


def test_what_was_seen_becomes_bodies_where_it_stood(source):
    assert [each.name for each in source.objects] == ["object 1", "object 2", "object 3"]
    for each, place, height in zip(source.objects, PLACES, HEIGHTS, strict=True):
        assert np.linalg.norm(each.world_from_object[:2, 3] - place) < 0.006
        assert each.model.height == pytest.approx(height, abs=0.006)
        assert each.model.source == "recorded" and each.trouble == ""


def test_the_first_look_is_the_recording_and_later_ones_the_twin(source):
    with source.open(a_line(source), 0) as table:
        scene = table.look()
        assert np.array_equal(scene.color, source.recording.frame.color)
        assert np.allclose(scene.intrinsics, source.recording.frame.intrinsics)
        for cloud, each in zip(scene.objects, source.objects, strict=True):
            seen = {tuple(point) for point in each.cloud.points.tolist()}
            assert len(cloud.points) <= 1024 and all(tuple(point) in seen for point in cloud.points.tolist())
        table.world.set_pose(0, table.poses()["object 1"] @ pose_from_xyz_yaw(0.0, -0.1, 0.0, 0.0))
        moved = table.look()
        assert not np.array_equal(moved.color, source.recording.frame.color)
        shift = moved.objects[0].points - scene.objects[0].points
        assert np.allclose(shift, (0.0, -0.1, 0.0), atol=0.003)
        assert np.array_equal(moved.objects[1].points, scene.objects[1].points)


def test_words_choose_among_what_was_found(source):
    assert resolve_phrase("the red ones", Referents(source.referents)).indices == (0, 1)
    assert resolve_phrase("the green object and object 1", Referents(source.referents)).indices == (2, 0)
    with source.open(a_line(source, (1, 2)), 0) as table:
        assert table.names == ("object 2", "object 3", "object 1") and table.count == 2
    with pytest.raises(SceneError, match=r"line of 1 of the scene's 3 objects \('object 2'\); legal: 2 to 12"):
        source.open(a_line(source, (1,)), 0)


def test_a_noun_is_what_the_instruction_can_call_it(bag):
    named = RecordedSource(bag, RecordedOptions(nouns={"object 2": "soup can"}))
    assert named.objects[1].name == "soup can 2" and named.objects[1].model.category == "can"
    assert resolve_phrase("the can and object 3", Referents(named.referents)).indices == (1, 2)
    with pytest.raises(UsageError, match="--call names 'object 9', which was not found; there are: object 1, object 2"):
        RecordedSource(bag, RecordedOptions(nouns={"object 9": "cup"}))


def test_options_of_recordings_need_a_recording(tmp_path):
    *_, failed, _ = run_instruction("make a line", RunOptions(recorded=RecordedOptions(ReadingOf(at=1.0))))
    assert (
        failed.exit_code == 2
        and "--at, --topic, --camera-pose, --depth-unit and --call are for recordings" in failed.message
    )
    with pytest.raises(UsageError, match="--scene cannot be ''"):
        scene_source("", "procedural")
    for options in (
        RecordedOptions(ReadingOf(at=0.0)),
        RecordedOptions(ReadingOf(topics={"depth": "/x"})),
        RecordedOptions(ReadingOf(world_from_camera=np.eye(4))),
        RecordedOptions(nouns={"object 1": "cup"}),
    ):
        with pytest.raises(UsageError, match="for recordings, and --scene is 'simulated'"):
            scene_source("simulated", "procedural", options)


def test_what_stands_too_far_away_is_left_where_it_is(bag):
    # The same camera, said to stand 25 cm farther back: the block at x = 0.35 is too near then.
    pose = RecordedSource(bag).segments.world_from_camera.copy()
    pose[0, 3] -= 0.25
    source = RecordedSource(bag, RecordedOptions(ReadingOf(world_from_camera=pose)))
    far = "out of the arm's reach"
    assert [each.trouble for each in source.objects] == [far, "", far]
    with source.set_out(0) as table:
        assert table.out_of_reach == {"object 1": far, "object 3": far} and table.count == 1
        assert any("object 1 is left where it is: out of the arm's reach" in note for note in table.notes)
    assert source.hint.startswith("out of the arm's reach: object 1, object 3; ")
    with pytest.raises(
        SceneError, match=r"line of 1 of the scene's 3 objects.*; out of the arm's reach: object 1, obj"
    ):
        source.open(a_line(source), 0)
    pose[0, 3] += 5.0
    with pytest.raises(NotBuildable, match=r"none of the 3 objects in .*: object 1, object 2, object 3; .*x 4.94"):
        RecordedSource(bag, RecordedOptions(ReadingOf(world_from_camera=pose)))


def test_a_body_that_falls_off_while_the_twin_comes_to_rest_takes_no_part(bag, monkeypatch):
    source = RecordedSource(bag)
    far = source.objects[1].world_from_object
    beyond = pose_from_xyz_yaw(3.0, 0.0, -0.5, 0.0)  # of no table: what a phantom at the edge comes to
    monkeypatch.setattr(source, "objects", tuple(
        replace(each, world_from_object=beyond) if each.world_from_object is far else each for each in source.objects
    ))  # fmt: skip
    with source.open(a_line(source), 0) as table:
        assert table.names[: table.count] == ("object 1", "object 3") and table.fallen == ("object 2",)
        assert "fell off the table" in table.missing["object 2"]
        assert [cloud.name for cloud in table.look().objects] == ["object 1", "object 3"]


def lifted(source, monkeypatch, height=0.1):
    """Let the second object's body be in the air, as one is whose carrier was completed too small."""
    far = source.objects[1].world_from_object
    monkeypatch.setattr(source, "objects", tuple(
        replace(each, world_from_object=pose_from_xyz_yaw(0.0, 0.0, height, 0.0) @ far)
        if each.world_from_object is far else each for each in source.objects
    ))  # fmt: skip


def test_a_body_that_would_not_stay_is_held_where_it_was_seen_until_the_arm_takes_it(bag, monkeypatch):
    source = RecordedSource(bag)
    lifted(source, monkeypatch)
    with source.open(a_line(source), 0) as table:
        seen = source.objects[1].world_from_object
        assert table.world.held == [1] and np.allclose(table.poses()["object 2"], seen, atol=1e-6)
        assert [note for note in table.notes if "object 2 is held where it was seen" in note]
        assert not any("object 1" in note or "object 3" in note for note in table.notes if "is held" in note)
        before = table.poses()
        table.world.free(table.world.bodies[1])
        table.world.settle()
        assert table.poses()["object 2"][2, 3] < 0.01
        assert table.put_back(before) == ("object 2",)
        table.world.settle()
        assert np.allclose(table.poses()["object 2"], seen, atol=1e-6)


def test_a_held_body_takes_part_in_a_build_and_elsewhere_stays_out_of_its_way(bag, monkeypatch):
    options = RunOptions(scene=str(bag), model="geometric")
    made = RecordedSource.__init__

    def made_and_lifted(self, *args, **kwargs):
        made(self, *args, **kwargs)
        lifted(self, monkeypatch, 0.03)

    monkeypatch.setattr(RecordedSource, "__init__", made_and_lifted)
    happened = list(run_instruction("put everything in a line", options))
    assert "object 2" in [event.name for event in happened if isinstance(event, Placed)] and happened[-1].success
    # The tall red one is not asked for: released without the arm, the others find it where it was seen.
    told = list(run_instruction("put object 1 and object 3 in a line", replace(options, execute=False)))
    checked = next(event for event in told if isinstance(event, events.Checked))
    assert checked.success, checked.detail


def test_a_table_with_nothing_on_it_is_no_scene(tmp_path):
    with TableScene([], np.empty((0, 4, 4)), 0, np.random.default_rng(0)) as table:
        record_session(table, tmp_path / "empty.bag", np.random.default_rng(0), seconds=0.1)
    with pytest.raises(BadInput, match=r"empty.bag' shows a table and no object on it$"):
        RecordedSource(tmp_path / "empty.bag")


def test_a_run_over_a_recording_ends_as_a_run(bag):
    happened = list(run_instruction("put everything in a line", RunOptions(str(bag), model="geometric", execute=False)))
    perceived = next(event for event in happened if isinstance(event, events.Perceived))
    assert perceived.objects[0].display_name.startswith("object 1, red") and perceived.labelled.shape == (480, 640, 3)
    checked = next(event for event in happened if isinstance(event, events.Checked))
    assert checked.success and checked.on == "the twin's bodies"
    assert happened[-1].success


def test_a_stack_is_kept_as_it_was_seen_and_taken_apart_from_the_top(tmp_path):
    models = [
        block("below", (0.07, 0.07, 0.06), RED),
        block("above", (0.045, 0.045, 0.05), GREEN),
        block("beside", (0.05, 0.05, 0.05), RED),
    ]
    places = ((0.45, 0.1, 0.0), (0.45, 0.1, 0.06), (0.4, -0.2, 0.0))
    poses = np.array([pose_from_xyz_yaw(x, y, z, 0.2) for x, y, z in places])
    with TableScene(models, poses, 3, np.random.default_rng(0)) as table:
        record_session(table, tmp_path / "stack.bag", np.random.default_rng(0))
    source = RecordedSource(tmp_path / "stack.bag")
    (above,) = (each for each in source.segments.objects if each.rests_on)
    upper = next(each for each in source.objects if each.name == above.name)
    assert upper.world_from_object[2, 3] == pytest.approx(0.06, abs=0.006)
    assert above.points[:, 2].min() > above.bottom - 0.0061
    assert upper.model.height == pytest.approx(0.05, abs=0.006)
    options = RunOptions(scene=str(tmp_path / "stack.bag"), model="geometric")
    happened = list(run_instruction("put everything in a line", options))
    placed = [event.name for event in happened if isinstance(event, Placed)]
    assert placed.index(above.name) < placed.index(above.rests_on)
    assert happened[-1].success


def test_an_unknown_noun_is_reported_with_what_would_help(bag):
    *_, failed, _ = run_instruction("stack the cups", RunOptions(str(bag), model="geometric", execute=False))
    assert "nothing here is 'the cups'; there is only: object 1, red" in failed.message
    assert failed.message.endswith("--call 'object 1=cup' says what an object is")


def test_a_twin_that_is_saved_is_a_scene_file(source, tmp_path):
    from agent.scenes.files import write_scene

    file = tmp_path / "desk" / "twin.yaml"
    with source.set_out(0) as table:
        write_scene(source.saved(table, file.parent), file)
        poses = table.poses()
    again = FileSource(file)
    assert [entry.name for entry in again.standing] == ["object 1", "object 2", "object 3"]
    for entry in again.standing:
        assert np.allclose(entry.world_from_object[:3, 3], poses[entry.name][:3, 3], atol=0.004)


def test_scenes_saved_in_one_folder_keep_their_own_bodies(source, bag, tmp_path):
    pose = source.segments.world_from_camera.copy()
    pose[1, 3] += 0.04  # another recording: the same names, and other bodies
    for each in (source, RecordedSource(bag, RecordedOptions(ReadingOf(at=0.5, world_from_camera=pose)))):
        with each.set_out(0) as table:
            each.saved(table, tmp_path)
            each.saved(table, tmp_path)  # the same bodies again
    meshes = sorted(mesh.name.partition("-")[0] for mesh in (tmp_path / "meshes").iterdir())
    assert meshes == ["object"] * 6
