"""Where the camera stood: tf of both generations, and what is said where it is broken."""

import re
from itertools import pairwise

import numpy as np
import pytest

from agent.recordings.bag_reader import open_bag
from agent.recordings.inspection import inspect_bag, print_bag_info
from agent.recordings.tf_tree import Frames, TransformLoop, base_from_camera, read_frames
from tests.agent.recordings.bag_making import Said, nanoseconds, transform, write_bag
from tests.counting import counted_calls

BASE, CAMERA = "j2s7s300_link_base", "camera"
LOOSE = [transform("f1", BASE), transform("f9", CAMERA)]


def camera_pose(tmp_path, said, moment=1.0, prefix="", camera=CAMERA):
    """The pose and the notes."""
    with open_bag(write_bag(tmp_path / "tf.bag", said)) as bag:
        return base_from_camera(read_frames(bag, nanoseconds(moment), [(camera, "")]), camera, prefix)


def test_the_way_goes_up_and_down_the_tree(tmp_path):
    quarter = (0, 0, np.sqrt(0.5), np.sqrt(0.5))
    said = [transform("world", BASE, (1, 0, 0), quarter), transform("world", "post", (1, 2, 0)),
            transform("post", CAMERA, (0, 0, 3), quarter)]  # fmt: skip
    pose, notes = camera_pose(tmp_path, said)
    np.testing.assert_allclose(pose, ((1, 0, 0, 2), (0, 1, 0, 0), (0, 0, 1, 3), (0, 0, 0, 1)), atol=1e-9)
    assert notes == []


def test_both_generations_may_share_a_topic_and_slashes_do_not_count(tmp_path):
    said = [transform("/world", f"/{BASE}", (0, 0, 1), topic="/tf", kind="tf/msg/tfMessage"),
            transform("world", CAMERA, (0, 0, 3), topic="/tf", seconds=0.5)]  # fmt: skip
    pose, notes = camera_pose(tmp_path, said)
    assert pose[2, 3] == pytest.approx(2) and notes == []


@pytest.mark.parametrize(("moment", "x"), [(0.2, 1), (1.0, 1), (1.3, 1), (2.0, 2), (9.0, 5)])
def test_the_latest_transform_before_the_moment_holds_or_else_the_first_after(tmp_path, moment, x):
    said = [transform(BASE, CAMERA, (k, 0, 0), seconds=k, topic="/tf") for k in range(1, 6)]
    assert camera_pose(tmp_path, said, moment)[0][0, 3] == x


def test_a_gap_in_time_is_looked_across(tmp_path):
    said = [transform(BASE, "post", (0, 1, 0), topic="/tf")]
    said += [transform("post", CAMERA, (1, 0, 0), seconds=k, topic="/tf") for k in range(100, 130)]
    pose, _ = camera_pose(tmp_path, said, 120.0)
    np.testing.assert_allclose(pose[:3, 3], (1, 1, 0))


@pytest.mark.parametrize(
    ("said", "sentence"),
    [
        ([], "no usable tf"),
        ([transform("world", BASE)], "does not know the camera's frame 'camera'; it knows j2s7s300_link_base, world"),
        ([transform("post", CAMERA)], "knows no frame of the arm's base .* only camera, post"),
        ([transform("world", BASE), transform("post", CAMERA)], "does not connect .* 'camera' .* 'j2s7s300_link_base'"),
        ([transform(CAMERA, CAMERA), transform("world", BASE)], "'camera' in 'camera'; it was left out"),
        ([transform(BASE, CAMERA, turn=(0, 0, 0, 0))], "no rotation or no position for 'camera'"),
        ([transform(BASE, CAMERA, shift=(np.nan, 0, 0))], "no rotation or no position for 'camera'"),
        ([Said("/tf", "tf2_msgs/msg/TFMessage", {}, raw=b"\xff" * 40)], "cannot decode a message on /tf"),
    ],
)
def test_what_is_broken_is_reported_and_gives_no_pose(tmp_path, said, sentence):
    other = Said("/else", "std_msgs/msg/String", {"data": ""})
    pose, notes = camera_pose(tmp_path, [*said, other])
    assert pose is None
    assert re.search(sentence, " ".join(notes))


@pytest.mark.parametrize(
    ("said", "frames"),
    [
        (
            [transform(BASE, "a"), transform("a", "b"), transform("b", "a"), transform("b", CAMERA)],
            "a -> b -> a|b -> a -> b",
        ),
        ([transform(f"f{k}", f"f{(k + 1) % 3000}") for k in range(3000)] + LOOSE, "-> 2994 more ->"),
    ],
)
def test_a_loop_is_an_error_that_names_its_frames(tmp_path, said, frames):
    with pytest.raises(TransformLoop, match=rf"runs in a loop \(.*({frames}).*\)"):
        camera_pose(tmp_path, said)


def test_what_can_be_mended_is_mended_and_told(tmp_path):
    pose, notes = camera_pose(tmp_path, [transform(BASE, CAMERA, (1, 0, 0), (0, 0, 0, 2))])
    np.testing.assert_allclose(pose[:3, :3], np.eye(3))
    assert "a quaternion of length 2" in notes[0]


def test_two_parents_are_reported(tmp_path):
    pose, notes = camera_pose(tmp_path, [transform(BASE, CAMERA, (1, 0, 0)), transform("world", CAMERA)])
    assert pose[0, 3] == 1 and "2 parents (j2s7s300_link_base, world)" in notes[0]


def test_the_base_is_that_of_the_arm_or_what_stands_there(tmp_path):
    said = [transform("world", f"{side}_j2s7s300_link_base", (0, y, 0)) for side, y in (("left", 1), ("right", -1))]
    said += [transform("world", CAMERA), transform("world", "root", (0, 0, 5))]
    assert camera_pose(tmp_path, said, prefix="right_j2s7s300_")[0][1, 3] == 1
    (tmp_path / "tf.bag").unlink()
    pose, notes = camera_pose(tmp_path, said[2:])
    assert pose[2, 3] == -5 and "'root' was taken for the arm's base" in notes[0]


def in_one_message(said: list[Said]) -> list[Said]:
    """The transforms of many messages in one."""
    transforms = [entry for one in said for entry in one.fields["transforms"]]
    return [Said(said[0].topic, said[0].type, {"transforms": transforms}, said[0].seconds)]


def test_errors_and_parents_without_number_are_counted(tmp_path):
    broken = [transform(BASE, f"f{k}", (np.nan, 0, 0)) for k in range(1000)]
    parents = [transform(f"p{k:03}", CAMERA) for k in range(100)] + [transform(BASE, "p000")]
    pose, notes = camera_pose(tmp_path, in_one_message(broken + broken + parents))
    assert pose is not None and len(notes) == 10
    assert "for 'f7' in" in notes[7]
    assert notes[8] == "... and 992 more transforms of tf were left out or mended"
    assert notes[9].endswith("100 parents (p000, p001, p002, p003, p004, p005, p006, p007 and 92 more)")


@pytest.mark.parametrize("kind", ["broken", "chain", "parents"])
def test_work_grows_with_the_number_of_transforms(tmp_path, kind):
    def steps(count: int) -> int:
        said = {
            "broken": [transform(BASE, f"f{k}", (np.nan, 0, 0)) for k in range(count)],
            "chain": [transform(*edge) for edge in pairwise([BASE, *(f"f{k}" for k in range(count)), CAMERA])],
            "parents": [transform(f"f{k}", CAMERA) for k in range(count)]
            + [transform(BASE, f"f{k}") for k in range(count)],
        }[kind]
        (tmp_path / str(count)).mkdir()
        with open_bag(write_bag(tmp_path / str(count) / "tf.bag", in_one_message(said))) as bag:
            with counted_calls() as counted:
                base_from_camera(read_frames(bag, nanoseconds(1.0), [(CAMERA, "")]), CAMERA, "")
        return counted.count

    assert steps(1200) < 5 * steps(300)


def test_each_message_is_read_once_however_far_tf_is_looked_for(tmp_path, monkeypatch):
    read = []
    added = Frames.add
    monkeypatch.setattr(Frames, "add", lambda frames, message, recorded, static: (
        read.append(recorded), added(frames, message, recorded, static)
    ))  # fmt: skip
    said = [transform("a", f"b{k}", seconds=k, topic="/tf") for k in range(0, 300, 3)]
    assert camera_pose(tmp_path, said, moment=150.0)[0] is None
    assert sorted(read) == [nanoseconds(k) for k in range(0, 300, 3)]


def test_of_two_transforms_of_one_time_the_last_recorded_holds(tmp_path):
    """They are read in another order: the later one stands nearer to the moment."""
    said = [transform(BASE, CAMERA, (k, 0, 0), seconds=1.0, topic="/tf") for k in (1, 2)]
    for one, recorded in zip(said, (1.0, 4.5), strict=True):
        one.seconds = recorded
    said.append(transform("a", "b", seconds=5.0, topic="/tf"))
    with open_bag(write_bag(tmp_path / "tf.bag", said)) as bag:
        frames = read_frames(bag, nanoseconds(5.0), [(CAMERA, ""), ("a", CAMERA)])
    assert frames.transforms[CAMERA, BASE].parent_from_child[0, 3] == 2


def test_a_tree_of_very_many_frames_is_printed_in_part(tmp_path, capsys):
    import sys

    said = in_one_message([transform("world", f"f{k:04}") for k in range(1000)])
    info = inspect_bag(write_bag(tmp_path / "tf.bag", said))
    print_bag_info(info, sys.stdout)
    printed = capsys.readouterr().out
    assert len(info.frames) == 1000 and "f0198" in printed and "f0199" not in printed
    assert "... and 801 more; --json has all" in printed
