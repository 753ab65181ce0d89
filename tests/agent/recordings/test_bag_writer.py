"""New bags: what is written is read back by the library that knows them, and nobody's file is lost."""

import os
from pathlib import Path

import numpy as np
import pytest
from rosbags.highlevel import AnyReader

from agent.errors import BadInput, UsageError
from agent.recordings.bag_writer import START, BagWriter, check_new
from agent.recordings.message_builders import joints_message, lens_message, transforms_message

NAMES = ("out.bag", "out.mcap", "out")


def speak(path: Path, force: bool = False, times: int = 3) -> None:
    with BagWriter(path, force) as writer:
        for k in range(times):
            writer.write("/joints", joints_message(writer, ["a", "b"], [0.1, 0.2 * k], 0.5 * k), 0.5 * k)


def heard(path: Path) -> list[tuple[str, float, object]]:
    with AnyReader([path]) as reader:
        return [
            (connection.topic, time / 1e9 - START, reader.deserialize(raw, connection.msgtype))
            for connection, time, raw in reader.messages()
        ]


@pytest.mark.parametrize("name", NAMES)
def test_messages_are_read_back(tmp_path, name):
    speak(tmp_path / "new" / name)
    messages = heard(tmp_path / "new" / name)
    assert [topic for topic, _, _ in messages] == ["/joints"] * 3
    for k, (_, time, message) in enumerate(messages):
        assert time == pytest.approx(0.5 * k, abs=1e-6)
        assert message.header.stamp.sec + message.header.stamp.nanosec / 1e9 - START == pytest.approx(0.5 * k, abs=1e-6)
        assert message.name == ["a", "b"] and message.position.tolist() == [0.1, 0.2 * k]
    assert os.listdir(tmp_path / "new") == [name]


def test_headers_of_ros_1_count(tmp_path):
    speak(tmp_path / "out.bag")
    assert [message.header.seq for _, _, message in heard(tmp_path / "out.bag")] == [0, 1, 2]


@pytest.mark.parametrize("name", NAMES)
def test_lens_and_transforms_in_both_dialects(tmp_path, name):
    lens = np.array([[525.0, 0, 319.5], [0, 524.0, 239.5], [0, 0, 1]])
    turned = np.array([[0.0, -1, 0, 1], [1, 0, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]])
    with BagWriter(tmp_path / name) as writer:
        writer.write("/lens", lens_message(writer, lens, (480, 640), 0.0, "camera"), 0.0)
        writer.write("/tf_static", transforms_message(writer, {("a", "b"): turned}, 0.0), 0.0, latched=True)
    (_, _, info), (_, _, tf) = heard(tmp_path / name)
    assert np.array_equal((info.K if writer.ros1 else info.k).reshape(3, 3), lens)
    assert (info.height, info.width, info.header.frame_id) == (480, 640, "camera")
    (found,) = tf.transforms
    assert (found.header.frame_id, found.child_frame_id) == ("a", "b")
    at, q = found.transform.translation, found.transform.rotation
    assert (at.x, at.y, at.z) == (1, 2, 3)
    assert (q.x, q.y, q.z, q.w) == pytest.approx((0, 0, np.sqrt(0.5), np.sqrt(0.5)))


def test_static_transforms_are_latched(tmp_path):
    for name in NAMES:
        with BagWriter(tmp_path / name) as writer:
            writer.write("/tf_static", transforms_message(writer, {("a", "b"): np.eye(4)}, 0.0), 0.0, latched=True)
        with AnyReader([tmp_path / name]) as reader:
            (connection,) = reader.connections
            if writer.ros1:
                assert connection.ext.latching
            else:
                (profile,) = connection.ext.offered_qos_profiles
                assert profile.durability.name == "TRANSIENT_LOCAL"


@pytest.mark.parametrize("name", NAMES)
def test_nothing_is_overwritten_unasked(tmp_path, name):
    speak(tmp_path / name, times=1)
    with pytest.raises(UsageError, match="--force"):
        speak(tmp_path / name)
    assert len(heard(tmp_path / name)) == 1
    speak(tmp_path / name, force=True)
    assert len(heard(tmp_path / name)) == 3


def test_force_takes_bags_alone(tmp_path):
    (tmp_path / "thesis").mkdir()
    (tmp_path / "thesis" / "metadata.yaml").write_text("mine")
    (tmp_path / "thesis" / "chapter.tex").write_text("mine")
    (tmp_path / "notes").write_text("mine")
    (tmp_path / "folder.bag").mkdir()
    for name in ("thesis", "notes", "folder.bag"):
        with pytest.raises(UsageError, match=name):
            check_new(tmp_path / name, force=True)


@pytest.mark.parametrize("name", ["out.txt", "out.db3", "out.bag.gz"])
def test_other_suffixes_are_refused(tmp_path, name):
    with pytest.raises(UsageError, match=r"\.bag.*\.mcap.*folder"):
        BagWriter(tmp_path / name)


@pytest.mark.parametrize("name", NAMES)
def test_an_error_leaves_nothing_behind(tmp_path, name):
    with pytest.raises(RuntimeError), BagWriter(tmp_path / name) as writer:
        writer.write("/joints", joints_message(writer, ["a"], [0.1], 0.0), 0.0)
        raise RuntimeError
    assert not list(tmp_path.iterdir())


def test_an_error_keeps_what_was_there(tmp_path):
    speak(tmp_path / "out.bag")
    before = (tmp_path / "out.bag").read_bytes()
    with pytest.raises(RuntimeError), BagWriter(tmp_path / "out.bag", force=True):
        raise RuntimeError
    assert (tmp_path / "out.bag").read_bytes() == before


def test_a_place_that_cannot_be_written(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(BadInput, match="file"):
        speak(tmp_path / "file" / "out.bag")


def test_what_somebody_else_wrote_meanwhile_stays(tmp_path):
    with pytest.raises(UsageError, match="out.bag"), BagWriter(tmp_path / "out.bag") as writer:
        writer.write("/joints", joints_message(writer, ["a"], [0.1], 0.0), 0.0)
        (tmp_path / "out.bag").write_text("mine")
    assert (tmp_path / "out.bag").read_text() == "mine" and len(list(tmp_path.iterdir())) == 1


def test_a_full_disk_is_one_sentence(tmp_path, monkeypatch):
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    with pytest.raises(BadInput, match="out.bag.*No space left"), BagWriter(tmp_path / "out.bag") as writer:
        monkeypatch.setattr(os, "replace", full)
        writer.write("/joints", joints_message(writer, ["a"], [0.1], 0.0), 0.0)
    assert not list(tmp_path.iterdir())


def test_a_topic_carries_one_type(tmp_path):
    with BagWriter(tmp_path / "out.bag") as writer:
        writer.write("/x", joints_message(writer, ["a"], [0.1], 0.0), 0.0)
        with pytest.raises(ValueError, match="JointState"):
            writer.write("/x", transforms_message(writer, {}, 0.0), 0.0)
