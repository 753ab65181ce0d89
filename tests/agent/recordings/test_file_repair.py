"""Bags that were cut short or never closed: their whole messages are read, and it is said."""

import struct

import numpy as np
import pytest
from rosbags.rosbag1 import Writer as Writer1

from agent.errors import BadInput
from agent.recordings.bag_reader import open_bag
from agent.recordings.load import read_recording
from tests.agent.recordings.bag_making import write_bag
from tests.agent.recordings.test_hostile_bags import session

TIMES = tuple(0.1 * number for number in range(1, 9))


def messages_of(path):
    """Every message of a bag: topic, time, bytes; and the notes."""
    with open_bag(path) as bag:
        return [(one.stream.topic, one.recorded, one.raw) for one in bag.messages(bag.streams)], bag.notes


@pytest.fixture(scope="module", params=[".bag", ".mcap", "bz2", "lz4"])
def whole(request, tmp_path_factory):
    """A good bag, and the same with packed chunks of ROS 1 that end every few messages."""
    folder = tmp_path_factory.mktemp("whole")
    if request.param.startswith("."):
        return write_bag(folder / f"whole{request.param}", session(TIMES))
    plain, packed = write_bag(folder / "plain.bag", session(TIMES)), folder / "packed.bag"
    writer = Writer1(packed)
    writer.chunk_threshold = 20_000
    writer.set_compression(Writer1.CompressionFormat[request.param.upper()])
    with open_bag(plain) as bag, writer:
        connections = {
            stream: writer.add_connection(
                stream.topic, stream.type, msgdef=stream.connections[0].msgdef.data, md5sum=stream.connections[0].digest
            )
            for stream in bag.streams
        }
        for message in bag.messages(bag.streams):
            writer.write(connections[message.stream], message.recorded, message.raw)
    return packed


def test_what_is_left_of_a_cut_bag_is_a_beginning_of_the_whole(whole, tmp_path):
    expected, notes = messages_of(whole)
    assert not notes
    data, read = whole.read_bytes(), []
    path = tmp_path / f"cut{whole.suffix}"
    for part in range(1, 20):
        path.write_bytes(data[: len(data) * part // 20])
        try:
            found, notes = messages_of(path)
        except BadInput:
            found = []
        else:
            assert notes == (f"{path.name} was cut short or never closed: its whole messages were read",)
        by_time = sorted(found, key=lambda each: each[1])
        assert all(each in expected for each in found)
        assert [each[1] for each in by_time] == [each[1] for each in expected[: len(found)]]
        read.append(len(found))
    assert read == sorted(read) and read[-1] > 0.6 * len(expected)


def test_a_cut_bag_shows_the_same_scene(whole, tmp_path):
    data, path = whole.read_bytes(), tmp_path / f"cut{whole.suffix}"
    path.write_bytes(data[: len(data) * 9 // 10])
    np.testing.assert_array_equal(read_recording(path).frame.points, read_recording(whole).frame.points)


def test_a_bag_that_is_still_recorded_is_read(tmp_path):
    path = write_bag(tmp_path / "whole.bag", session(TIMES))
    expected, _ = messages_of(path)
    data = path.read_bytes()
    at = data.index(b"index_pos=") + len(b"index_pos=")
    active = tmp_path / "active.bag"
    active.write_bytes(data[:at] + bytes(8) + data[at + 8 :])
    found, notes = messages_of(active)
    assert found == expected and "never closed" in notes[0]


def mcap_of_ros1(messages):
    """An MCAP file with the profile of ROS 1, without chunks and summary; messages are (topic, type, time, raw)."""

    def record(opcode, content):
        return struct.pack("<BQ", opcode, len(content)) + content

    def text(value):
        return struct.pack("<L", len(value)) + value.encode()

    parts, numbers = [b"\x89MCAP0\r\n", record(0x01, text("ros1") + text("a test"))], {}
    for topic, kind, recorded, raw in messages:
        if (topic, kind) not in numbers:
            number = numbers[topic, kind] = len(numbers) + 1
            parts.append(record(0x03, struct.pack("<H", number) + text(kind) + text("ros1msg") + text("# not read")))
            channel = struct.pack("<HH", number, number) + text(topic) + text("ros1") + struct.pack("<L", 0)
            parts.append(record(0x04, channel))
        header = struct.pack("<HLQQ", numbers[topic, kind], 0, recorded, recorded)
        parts.append(record(0x05, header + raw))
    parts += [record(0x0F, bytes(4)), record(0x02, bytes(20)), b"\x89MCAP0\r\n"]
    return b"".join(parts)


@pytest.fixture(scope="module")
def same_in_both(tmp_path_factory):
    """A bag of ROS 1 and an MCAP file with its messages."""
    folder = tmp_path_factory.mktemp("profiles")
    path = write_bag(folder / "session.bag", session(TIMES))
    with open_bag(path) as bag:
        every = [
            (one.stream.topic, one.stream.type.replace("/msg/", "/"), one.recorded, one.raw)
            for one in bag.messages(bag.streams)
        ]
    converted = folder / "session.mcap"
    converted.write_bytes(mcap_of_ros1(every))
    return path, converted


def test_an_mcap_file_with_the_profile_of_ros1_shows_the_same_as_the_bag(same_in_both):
    path, converted = same_in_both
    expected, read = read_recording(path), read_recording(converted)
    np.testing.assert_array_equal(read.frame.points, expected.frame.points)
    np.testing.assert_array_equal(read.frame.color, expected.frame.color)
    assert read.arm.joints == expected.arm.joints
    assert read.used == expected.used


def test_an_mcap_file_with_the_profile_of_ros1_may_be_cut(same_in_both, tmp_path):
    path, converted = same_in_both
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(converted.read_bytes()[:-2000])
    read = read_recording(cut)
    assert "never closed" in read.notes[0]
    np.testing.assert_array_equal(read.frame.points, read_recording(path).frame.points)


def test_channels_in_other_languages_do_not_spoil_the_rest(same_in_both, tmp_path):
    _, converted = same_in_both
    path = tmp_path / "mixed.mcap"
    path.write_bytes(converted.read_bytes().replace(b"ros1msg", b"strange", 1))
    assert np.isfinite(read_recording(path).frame.points).any()
