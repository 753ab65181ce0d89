"""Bags that are damaged, lie, or lack something: one clear sentence each, after a few steps, and nothing else."""

import os
import random
import re

import numpy as np
import pytest

from agent.errors import BadInput
from agent.recordings.bag_reader import open_bag
from agent.recordings.inspection import inspect_bag
from agent.recordings.load import read_recording
from agent.recordings.recording import ReadingOf
from tests.agent.recordings.bag_making import (
    COLOR_INFO,
    DEPTH,
    DEPTH_INFO,
    JOINTS,
    Said,
    camera_info,
    cloud,
    colors,
    depth_image,
    depths,
    image,
    joints,
    plane_points,
    session,
    transform,
    write_bag,
)
from tests.counting import counted_calls

KINDS = (".bag", ".mcap", ".db3")
MOST_CALLS = 500_000  # of functions, to say what is wrong with a bag


def refused(path, said=None, options=ReadingOf()):
    """The sentence that refuses a recording."""
    with counted_calls() as steps, pytest.raises(BadInput, match=said) as caught:
        read_recording(path, options)
    assert steps.count < MOST_CALLS
    sentence = str(caught.value)
    assert "\n" not in sentence and len(sentence) < 600
    return sentence


def read_or_refused(path):
    """What is read, in a few steps and without any other error, by both ways in."""
    for read in (read_recording, inspect_bag):
        with counted_calls() as steps:
            try:
                read(path)
            except BadInput as error:
                assert "\n" not in str(error)
        assert steps.count < MOST_CALLS


@pytest.fixture(scope="module", params=KINDS)
def whole(request, tmp_path_factory):
    """A good bag of every kind."""
    return write_bag(tmp_path_factory.mktemp("whole") / f"whole{request.param}", session((0.1,)))


def test_a_bag_cut_at_twenty_places(whole, tmp_path):
    data, path = whole.read_bytes(), tmp_path / f"cut{whole.suffix}"
    for part in range(20):
        path.write_bytes(data[: len(data) * part // 20])
        try:  # enough of it may be whole; of a database, all but what nobody asks it
            assert re.search("is cut short at|was cut short or never closed", read_recording(path).notes[0])
            continue
        except BadInput:
            pass
        sentence = refused(path)
        assert "cannot read '" not in sentence or sentence.endswith("` saves what is whole")
        assert str(path) in sentence and ("cut short" in sentence or "empty" in sentence or "begins with" in sentence)


def test_a_bag_with_changed_bytes(whole, tmp_path):
    data, path, rng = whole.read_bytes(), tmp_path / f"changed{whole.suffix}", random.Random(0)
    for turn in range(20):
        changed = bytearray(data)
        for _ in range(rng.choice((1, 5, 30))):
            changed[rng.randrange(len(changed) if turn % 2 else 6000)] = rng.randrange(256)
        path.write_bytes(changed)
        read_or_refused(path)


@pytest.mark.parametrize("suffix", KINDS)
@pytest.mark.parametrize(("data", "said"), [(b"", "is empty"), (b"Put the cups away.\n" * 9, "begins with b'Put")])
def test_a_file_that_is_no_bag(tmp_path, suffix, data, said):
    path = tmp_path / f"text{suffix}"
    path.write_bytes(data)
    refused(path, said)


@pytest.mark.parametrize("name", ["nothing.bag", "nothing.mcap"])
def test_a_file_that_is_not_there(tmp_path, name):
    refused(tmp_path / name, "there is no")


def test_a_file_of_another_kind(tmp_path):
    path = tmp_path / "session.zip"
    path.write_bytes(b"PK")
    with pytest.raises(BadInput, match=r"legal are \.bag, \.db3, \.mcap"), open_bag(path):
        pass


def test_a_file_that_must_not_be_read(tmp_path):
    (tmp_path / "loop.bag").symlink_to(tmp_path / "loop.bag")
    refused(tmp_path / "loop.bag")
    if os.geteuid():  # everything may be read by root
        path = write_bag(tmp_path / "closed.bag", session())
        path.chmod(0)
        refused(path, "Permission denied")


@pytest.mark.parametrize(
    ("metadata", "said"),
    [("", "metadata"), ("a: [", "metadata"), ("\x00\xff", "metadata"), ("rosbag2_bagfile_information: 3", "metadata")],
)
def test_a_folder_with_broken_metadata_and_no_file(tmp_path, metadata, said):
    (tmp_path / "bag").mkdir()
    (tmp_path / "bag" / "metadata.yaml").write_text(metadata, encoding="latin-1")
    refused(tmp_path / "bag", said)


@pytest.mark.parametrize(("old", "new"), [("storage_identifier: sqlite3", "storage_identifier: mcap"),
                                          ("nanoseconds: ", "nanoseconds: x"), ("message_count: ", "message_count: -"),
                                          ("serialization_format: cdr", "serialization_format: xml")])  # fmt: skip
def test_a_folder_whose_metadata_lies(tmp_path, old, new):
    path = write_bag(tmp_path / "bag", session())
    metadata = path / "metadata.yaml"
    metadata.write_text(metadata.read_text().replace(old, new))
    read_or_refused(path)


def claimed(path, pattern, value):
    """The bag with a number behind `pattern` replaced by a huge one."""
    data = bytearray(path.read_bytes())
    for found in re.finditer(pattern, bytes(data), re.DOTALL):
        data[found.end() : found.end() + len(value)] = value
    path.write_bytes(data)
    return path


@pytest.mark.parametrize("field", [b"chunk_count=", b"conn_count=", b"size=", b"count=", b"index_pos="])
def test_ten_gigabytes_claimed_in_a_header(tmp_path, field):
    path = write_bag(tmp_path / "boast.bag", session((0.1,)))
    read_or_refused(claimed(path, re.escape(field), b"\xff\xff\xff\x7f"))


def test_ten_gigabytes_claimed_for_a_chunk(tmp_path):
    path = write_bag(tmp_path / "boast.bag", session((0.1,)))
    read_or_refused(claimed(path, rb"compression=none....size=....", b"\xf0\xff\xff\x7f"))
    path = write_bag(tmp_path / "boast.mcap", session((0.1,)))
    data = bytearray(path.read_bytes())
    start = data.index(b"\x05", 60)
    data[start + 1 : start + 9] = (10 * 2**30).to_bytes(8, "little")
    path.write_bytes(data)
    read_or_refused(path)


def spoilt(**fields):
    """A session whose depth pictures all say something else."""
    said = session()
    for message in said:
        if message.topic == DEPTH:
            message.fields |= fields
    return said


def without(*topics):
    return [said for said in session() if said.topic not in topics]


NOTHING = np.zeros(0, np.uint8)
NO_LENS = without(DEPTH_INFO, COLOR_INFO)
BLIND = without(DEPTH)


@pytest.mark.parametrize("suffix", [".bag", ".mcap"])
@pytest.mark.parametrize(
    ("said", "sentence"),
    [
        (BLIND, "nothing that a depth camera measured: .*; it has /camera"),
        ([joints()], r"it has /j2s7s300_driver/out/joint_state \(sensor_msgs/JointState\)"),
        (NO_LENS, "no sensor_msgs/CameraInfo .*depth_info=TOPIC names one.; it has none at all"),
        (spoilt(encoding="bayer_xyzw16"), "nothing that a depth camera measured"),
        (spoilt(width=0, height=0, data=NOTHING), f"{DEPTH} .*0 x 0 pixels"),
        (spoilt(data=NOTHING), f"{DEPTH}.*needs 2400 bytes and has 0"),
        (spoilt(width=2**31, height=2**31), "does not fit|needs"),
        (spoilt(data=np.zeros(2400, np.uint8)), f"{DEPTH}.* measures nothing"),
        ([cloud(np.full((30, 40, 3), np.nan))], "measures nothing"),
        ([cloud(np.zeros((0, 0, 3)).reshape(1, 0, 3))], "1 pixels|has none"),
        ([*NO_LENS, camera_info(DEPTH_INFO, k=np.zeros(9), p=np.zeros(12))], "no focal length"),
        ([*NO_LENS, camera_info(DEPTH_INFO, width=640, height=640)], "does not fit a picture"),
        ([*BLIND, Said(DEPTH, "sensor_msgs/msg/Image", {}, 0.3, b"\xff" * 50)], f"decode a message on {DEPTH}"),
        ([Said("/c", "sensor_msgs/msg/PointCloud2", {}, 0.3, b"")], "decode a message on /c"),
        ([Said("/c/compressedDepth", "sensor_msgs/msg/CompressedImage", {"data": [1] * 50})], "neither JPEG nor PNG"),
    ],
)
def test_what_a_bag_lacks_or_spoils(tmp_path, suffix, said, sentence):
    path = write_bag(tmp_path / f"spoilt{suffix}", sorted(said, key=lambda message: message.seconds))
    refused(path, sentence)
    inspect_bag(path)


def test_no_messages_at_all(tmp_path):
    refused(write_bag(tmp_path / "none.bag", []), "holds no messages")
    refused(write_bag(tmp_path / "none.mcap", []), "holds no messages")


def test_several_types_on_one_topic(tmp_path):
    said = session()
    said += [Said(DEPTH, "std_msgs/msg/String", {"data": "depth"}, 0.3), cloud(plane_points(depths()), 0.3, DEPTH)]
    said += [Said(JOINTS, "sensor_msgs/msg/Image", image("", colors(), "rgb8").fields, 0.3)]
    for suffix in (".bag", ".mcap"):
        recording = read_recording(write_bag(tmp_path / f"mixed{suffix}", said))
        np.testing.assert_allclose(recording.frame.points, plane_points(depths()), atol=1e-6)
        assert recording.arm is not None
        assert [topic.name for topic in inspect_bag(recording.path).topics].count(DEPTH) == 3


@pytest.mark.parametrize("suffix", KINDS)
def test_time_that_runs_backwards(tmp_path, suffix):
    path = write_bag(tmp_path / f"back{suffix}", session((0.3, 0.1, 0.2)))
    assert read_recording(path).frame.color is not None


def test_tf_that_runs_in_a_loop_is_refused_unless_somebody_says_where_the_camera_stood(tmp_path):
    loop = [transform("camera_link", "world"), depth_image(depths(), 0.3)]
    path = write_bag(tmp_path / "loop.bag", [*session(), *loop])
    with pytest.raises(BadInput, match=r"tf runs in a loop \(.* -> .*\).*--camera-pose X,Y,Z"):
        read_recording(path)
    recording = read_recording(path, ReadingOf(world_from_camera=np.eye(4)))
    assert recording.base_from_camera is None and np.array_equal(recording.world_from_camera, np.eye(4))
