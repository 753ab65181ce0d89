"""`structagent bag`: what it prints, writes and refuses, through the real command line."""

import json
from pathlib import Path

import numpy as np
import pytest
import typer
from PIL import Image

from agent.cli import app as cli
from agent.cli.bag import bag_app
from agent.cli.options import reading_of, recorded_options
from agent.errors import UsageError
from agent.recordings import example_path
from agent.recordings.load import read_recording
from agent.scenes.object_placement import load_scene
from structdiffusion.simulation.depth_camera import DepthCamera

EXAMPLE = example_path()
SCENE = EXAMPLE.with_suffix(".yaml")


@pytest.fixture
def bag(monkeypatch, capsys, tmp_path):
    """Runs `structagent bag ...`: (exit code, standard output, standard error)."""
    app = typer.Typer(rich_markup_mode=None)
    app.add_typer(bag_app, name="bag")
    monkeypatch.setattr(cli, "app", app)
    monkeypatch.chdir(tmp_path)

    def run(*arguments: object) -> tuple[int, str, str]:
        code = cli.command_line(["bag", *map(str, arguments)])
        said = capsys.readouterr()
        return code, said.out, said.err

    return run


@pytest.fixture
def pictures(tmp_path) -> Path:
    folder = tmp_path / "pictures"
    folder.mkdir()
    for name in ("1-", "2-"):
        Image.fromarray(np.full((30, 40, 3), 90, np.uint8)).save(folder / f"{name}color.png")
        Image.fromarray(np.full((30, 40), 800 + int(name[0]), np.uint16)).save(folder / f"{name}depth.png")
    return folder


@pytest.mark.parametrize("arguments", [[], ["info"], ["objects"], ["record"], ["from-rgbd"], ["from-cloud"]])
def test_help_has_an_example(bag, arguments):
    code, out, _ = bag(*arguments, "--help")
    assert code == 0 and "Example: structagent bag" in out


def test_info_of_the_example(bag):
    code, out, err = bag("info", EXAMPLE)
    assert (code, err) == (0, "")
    assert "/camera/aligned_depth_to_color/image_raw" in out and "j2s7s300_link_base" in out
    code, out, _ = bag("info", EXAMPLE, "--json")
    told = json.loads(out)
    assert (
        code == 0 and told["used"]["joints"] == "/j2s7s300_driver/out/joint_state" and all(told["available"].values())
    )


def test_objects_of_the_example(bag, tmp_path):
    code, out, err = bag("objects", EXAMPLE, "--json", "--picture", tmp_path / "new" / "found.png")
    told = json.loads(out)
    assert code == 0 and len(told["objects"]) == 4 and "found.png" in err
    standing = np.array([entry.world_from_object[:2, 3] for entry in load_scene(SCENE)])
    found = np.array([[each["x"], each["y"]] for each in told["objects"]])
    assert np.linalg.norm(found[:, None] - standing[None], axis=2).min(axis=0).max() < 0.02
    assert Image.open(tmp_path / "new" / "found.png").size == (640, 480)
    code, _, err = bag("objects", EXAMPLE, "--picture", tmp_path / "new" / "found.png")
    assert code == 2 and "--force" in err


def test_the_example_is_known_by_its_name(bag, tmp_path):
    assert "cups.bag" in bag("info", "example")[1]
    (tmp_path / "example").mkdir()
    code, _, err = bag("info", "example")
    assert code == 6 and "'example'" in err


def test_a_picture_that_cannot_be_written(bag, tmp_path):
    (tmp_path / "file").write_text("mine")
    code, _, err = bag("objects", EXAMPLE, "--picture", "file/found.png")
    assert code == 6 and err.startswith("structagent: cannot write 'file/found.png': ")


def test_objects_for_people(bag):
    code, out, _ = bag("objects", EXAMPLE)
    assert code == 0 and "object 4" in out and "red" in out


def test_a_pose_given_by_hand_is_taken(bag):
    pose = "0.02,0,1.05,-2.75290315,0,-1.57079633"
    assert np.allclose(reading_of(camera_pose=pose).world_from_camera, DepthCamera().world_from_camera, atol=1e-6)
    code, out, _ = bag("objects", EXAMPLE, "--json", "--camera-pose", pose)
    first = json.loads(out)["objects"][0]
    assert code == 0 and (first["x"], first["y"]) == pytest.approx((0.36, 0.24), abs=0.02)


def test_record_writes_what_a_scene_file_says(bag, tmp_path):
    arguments = ("--scene", SCENE, "--seconds", 0.1, "--seed", 5)
    code, out, err = bag("record", "--out", "new/a.bag", "--truth", "new/a.yaml", *arguments)
    assert (code, out) == (0, "") and "a.bag: mug, cup 1, cup 2, cup 3" in err and "a.yaml" in err
    for truth, entry in zip(load_scene(tmp_path / "new" / "a.yaml"), load_scene(SCENE), strict=True):
        assert truth.name == entry.name and np.allclose(truth.world_from_object, entry.world_from_object, atol=1e-5)
    code, out, _ = bag("record", "--out", "b.mcap", "--json", *arguments)
    told = json.loads(out)
    assert code == 0 and told["objects"] == ["mug", "cup 1", "cup 2", "cup 3"] and told["file"] == "b.mcap"
    a, b = read_recording(tmp_path / "new" / "a.bag"), read_recording(tmp_path / "b.mcap")
    assert np.array_equal(a.frame.points, b.frame.points, equal_nan=True)
    before = (tmp_path / "b.mcap").read_bytes()
    code, _, err = bag("record", "--out", "b.mcap", *arguments)
    assert code == 2 and "--force" in err and (tmp_path / "b.mcap").read_bytes() == before
    code, _, err = bag("record", "--out", "c.bag", "--truth", "new/a.yaml", *arguments)
    assert code == 2 and "--truth" in err and not (tmp_path / "c.bag").exists()


def test_record_draws_the_scene_of_a_run(bag, tmp_path):
    from agent.events import Perceived
    from agent.pipeline.run import RunOptions, run_instruction

    text = "put the cups in a small circle"
    code, _, err = bag("record", "--instruction", text, "--seed", 3, "--out", "a.bag", "--truth", "a.yaml")
    assert code == 0
    events = run_instruction(text, RunOptions(model="geometric", seed=3))
    seen = next(event for event in events if isinstance(event, Perceived))
    standing = {entry.name: entry.world_from_object[:2, 3] for entry in load_scene(tmp_path / "a.yaml")}
    assert [each.name for each in seen.objects] == list(standing)
    for each in seen.objects:
        assert np.linalg.norm(standing[each.name] - each.position[:2]) < 0.05
    events.close()


def test_pictures_become_a_bag(bag, tmp_path, pictures):
    lens = ("--intrinsics", "50,51,19,14")
    code, out, err = bag("from-rgbd", pictures, "--out", "a.bag", *lens)
    assert (code, out) == (0, "") and "1-depth.png" in err and "the first of 2" in err
    recording = read_recording(tmp_path / "a.bag")
    assert np.allclose(recording.frame.points[..., 2], 0.801) and (recording.frame.color == 90).all()
    assert np.allclose(recording.frame.intrinsics, [[50, 0, 19], [0, 51, 14], [0, 0, 1]])
    code, out, _ = bag("from-rgbd", pictures, "--name", 2, "--out", "b", "--depth-scale", "0.00025", "--json", *lens)
    assert code == 0 and json.loads(out)["made_from"]["depth"] == "2-depth.png"
    # A quarter of 802 mm is not a whole number of them, and is kept.
    assert np.allclose(read_recording(tmp_path / "b").frame.points[..., 2], 0.2005, atol=1e-6)


@pytest.mark.parametrize(
    ("code", "arguments", "parts"),
    [
        (6, ("info", "nowhere.bag"), ("nowhere.bag",)),
        (6, ("objects", "nowhere.ply"), ("nowhere.ply",)),
        (6, ("from-rgbd", "nowhere", "--out", "a.bag"), ("nowhere",)),
        (6, ("from-rgbd", "pictures", "--out", "a.bag"), ("intrinsics", "1-color.png")),
        (6, ("objects", "pictures"), ("intrinsics", "1-color.png")),
        (6, ("from-rgbd", "pictures", "--out", "notes/a.bag", "--intrinsics", "50,51,19,14"), ("notes/a.bag",)),
        (2, ("from-rgbd", "pictures", "--out", "a.zip"), ("a.zip", ".mcap")),
        (2, ("from-rgbd", "pictures", "--out", "a.bag", "--intrinsics", "50,51"), ("'50,51'", "FX,FY,CX,CY")),
        (2, ("from-rgbd", "pictures", "--out", "a.bag", "--depth-scale", "0"), ("--depth-unit", "0.001")),
        (2, ("objects", EXAMPLE, "--depth-unit", "inch"), ("'inch'", "0.25mm")),
        (2, ("record", "--out", "a.db3"), ("a.db3", ".bag")),
        (2, ("record",), ("--out",)),
        (2, ("record", "--out", "a.bag", "--arm", "ur5"), ("ur5", "j2n6s300")),
        (2, ("record", "--out", "a.bag", "--truth", "a.txt"), ("a.txt", ".yaml")),
        (2, ("record", "--out", "a.bag", "--seconds", "0"), ("--seconds",)),
        (2, ("objects", EXAMPLE, "--at", "-1"), ("--at", "-1")),
        (2, ("objects", EXAMPLE, "--at", "nan"), ("--at", "nan")),
        (2, ("objects", EXAMPLE, "--topic", "depth"), ("'depth'", "depth=/TOPIC")),
        (2, ("objects", EXAMPLE, "--topic", "hue=/x"), ("'hue=/x'", "color=/TOPIC")),
        (2, ("objects", EXAMPLE, "--camera-pose", "1,2,3,4,5,inf"), ("inf", "X,Y,Z,ROLL,PITCH,YAW")),
        (2, ("objects", EXAMPLE, "--picture", "a.jpg"), ("a.jpg", ".png")),
        (3, ("record", "--out", "a.bag", "--instruction", "sing a song"), ()),
    ],
)  # fmt: skip
def test_what_is_wrong_is_one_sentence(bag, pictures, tmp_path, code, arguments, parts):
    (tmp_path / "notes").write_text("")
    found, out, err = bag(*arguments)
    said = [line for line in err.splitlines() if line.startswith("structagent: ")]
    assert (found, out, len(said)) == (code, "", 1), err
    assert all(part in said[0] for part in parts), said
    assert sorted(path.name for path in tmp_path.iterdir()) == ["notes", "pictures"]


def test_options_name_each_topic_and_object_once():
    assert reading_of(2.5, ["depth=/a", "color=/b"]).topics == {"depth": "/a", "color": "/b"}
    assert recorded_options(None, None, None, ["3=mug", "Object 1 = tea cup"]).nouns == {
        "object 3": "mug", "object 1": "tea cup",
    }  # fmt: skip
    for calls in (["3=mug", "object 3=cup"], ["3=17"], ["3=object 2"], ["3="], ["=mug"], ["mug"]):
        with pytest.raises(UsageError, match="--call cannot be .*; legal: an object and a noun without digits"):
            recorded_options(None, None, None, calls)
    with pytest.raises(UsageError, match="only once"):
        reading_of(topics=["depth=/a", "depth=/b"])


@pytest.mark.parametrize("out", ["cloud.bag", "cloud.mcap"])
def test_a_cloud_becomes_the_bag_that_shows_the_same(bag, tmp_path, out):
    rows = ["0.1 0.2 0.9 4210752", "nan nan nan 0", "-0.1 0.2 1.0 16711680", "0.1 -0.2 1.1 255"]
    head = ["VERSION .7", "FIELDS x y z rgb", "SIZE 4 4 4 4", "TYPE F F F U", "COUNT 1 1 1 1", "WIDTH 2", "HEIGHT 2"]
    head += ["VIEWPOINT 0 0 0 1 0 0 0", "POINTS 4", "DATA ascii"]
    (tmp_path / "cloud.pcd").write_text("\n".join([*head, *rows]) + "\n")
    code, said, err = bag("from-cloud", "cloud.pcd", "--out", out, "--json")
    assert code == 0 and f"wrote {out}: points cloud.pcd" in err
    assert json.loads(said)["made_from"] == {"points": "cloud.pcd"}
    before, after = read_recording(tmp_path / "cloud.pcd").frame, read_recording(tmp_path / out).frame
    assert after.points.shape == (2, 2, 3)
    np.testing.assert_array_equal(after.points, before.points)
    seen = np.isfinite(after.points[..., 0])
    np.testing.assert_array_equal(after.color[seen], before.color[seen])
    assert after.color[seen].tolist() == [[64, 64, 64], [255, 0, 0], [0, 0, 255]]
    code, _, err = bag("from-cloud", "nowhere.pcd", "--out", "other.bag")
    assert code == 6 and "there is no cloud 'nowhere.pcd'" in err and not (tmp_path / "other.bag").exists()
