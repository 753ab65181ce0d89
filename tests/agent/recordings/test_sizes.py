"""Recordings of a few kilobytes that stand for gigabytes: one sentence, and little memory and work."""

import struct
import sys
from contextlib import suppress

import apsw
import numpy as np
import pytest

from agent.cli.app import command_line
from agent.errors import BadInput
from agent.recordings import decompression, image_decoding, load
from agent.recordings.bag_reader import open_bag
from agent.recordings.decompression import UnpackingLimits
from agent.recordings.image_decoding import color_picture
from agent.recordings.inspection import inspect_bag
from agent.recordings.load import read_recording
from agent.recordings.point_count import with_fewer_points
from agent.recordings.recording import DepthFrame, ReadingOf
from structdiffusion.limits import BAG_SMALL_PIECE_BYTES, MOST_PIXELS
from tests.agent.recordings.bag_making import (
    COLOR,
    COLOR_INFO,
    DEPTH,
    DEPTH_INFO,
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
from tests.agent.recordings.test_image_decoding import raw
from tests.memory import forget_peak, peak_megabytes

RVL = f"{DEPTH}/compressedDepth"
MOST_MEGABYTES = 600  # beside what the test process has; a command has 100 by itself


def rvl_picture(width: int, height: int, numbers: bytes, seconds: float) -> Said:
    """A compressedDepth picture with RVL in it."""
    data = bytes(12) + struct.pack("<II", width, height) + numbers
    fields = {"format": "16UC1; compressedDepth rvl", "data": np.frombuffer(data, np.uint8)}
    return Said(RVL, "sensor_msgs/msg/CompressedImage", {"header": ("camera", seconds)} | fields, seconds)


def nothing(pixels: int) -> bytes:
    """One run of nothing in RVL."""
    nibbles, left = [], pixels
    while left or not nibbles:
        nibbles.append((left & 7) | (8 if left >> 3 else 0))
        left >>= 3
    nibbles += [0] * (-len(nibbles) % 8 or 8)
    words = "".join(f"{nibble:x}" for nibble in nibbles)
    return b"".join(int(words[k : k + 8], 16).to_bytes(4, "little") for k in range(0, len(words), 8))


def refused(path, said: str, options=ReadingOf()) -> None:
    """Refuses a small file in one sentence, with little memory."""
    assert path.stat().st_size < 60_000
    forget_peak()
    before = peak_megabytes()
    with pytest.raises(BadInput, match=said) as caught:
        read_recording(path, options)
    with suppress(BadInput):
        inspect_bag(path)
    assert peak_megabytes() - before < MOST_MEGABYTES
    assert "\n" not in str(caught.value) and len(str(caught.value)) < 1000


def wide(width: int, height: int, times) -> list[Said]:
    return [camera_info(f"{DEPTH}/camera_info".replace("image_raw/", ""), t, width=width, height=height) for t in times]


def test_pictures_of_nothing_as_large_as_they_may_be(tmp_path):
    times = np.arange(30) / 10
    said = [rvl_picture(5000, MOST_PIXELS // 5000, nothing(MOST_PIXELS), t) for t in times]
    refused(write_bag(tmp_path / "a.mcap", [*said, *wide(5000, 4000, times)], packed=True), "measures nothing")


@pytest.mark.parametrize(("width", "height"), [(5001, 4000), (2**31, 2**31), (0, 7)])
def test_pictures_that_claim_more(tmp_path, width, height):
    said = [rvl_picture(width, height, bytes(100), 0.0), camera_info(DEPTH_INFO, width=width, height=height)]
    refused(write_bag(tmp_path / "a.mcap", said), f"claims {width} x {height} pixels; from 1 to {MOST_PIXELS} in all")


def test_a_message_that_is_far_larger_than_the_recording(tmp_path):
    long = BAG_SMALL_PIECE_BYTES + 1000
    said = [rvl_picture(640, 480, nothing(640 * 480) + bytes(long), 0.0), camera_info(DEPTH_INFO)]
    path = write_bag(tmp_path / "a.mcap", said, packed=True)
    refused(path, f"a packed piece of \\d+ bytes that becomes larger than {BAG_SMALL_PIECE_BYTES} bytes")
    assert command_line(["bag", "objects", str(path)]) == command_line(["bag", "info", str(path)]) == 6


@pytest.mark.parametrize(
    ("fields", "part"),
    [
        ({"width": 2**31, "height": 1, "row_step": 0}, "needs \\d+ bytes"),
        ({"width": 2**31, "height": 2**31, "point_step": 0, "row_step": 0}, "claims 4611686018427387904 points"),
        ({"row_step": 2**31}, "2147483648 a row"),
        ({"point_step": 2**31}, "needs \\d+ bytes"),
    ],
)
def test_clouds_that_claim_more(tmp_path, fields, part):
    said = cloud(plane_points(depths()))
    said.fields |= fields
    refused(write_bag(tmp_path / "a.mcap", [said], packed=True), part)


@pytest.mark.parametrize("suffix", [".mcap", ".bag"])
def test_a_cloud_of_more_fields_than_points_have(tmp_path, suffix):
    said = cloud(plane_points(depths()))
    said.fields["fields"] = said.fields["fields"] * 400
    refused(write_bag(tmp_path / f"a{suffix}", [said]), "a cloud claims 1200 fields a point; at most 1000 are read")


def test_messages_without_pictures_are_small(tmp_path):
    said = [*session([0.1]), joints(0.1, names=["x" * 8] * 100_000, topic="/j2s7s300_driver/out/joint_state")]
    recording = read_recording(write_bag(tmp_path / "a.mcap", said, packed=True))
    assert recording.arm is not None  # of the other message
    with open_bag(tmp_path / "a.mcap") as bag:
        stream = next(stream for stream in bag.streams if stream.type.endswith("JointState"))
        with pytest.raises(BadInput, match="JointState has 1\\d+ bytes; at most 1000000 are read"):
            [bag.decoded(message) for message in bag.messages([stream])]


@pytest.mark.parametrize("encoding", ["mono16", "16UC1", "32FC1"])
def test_raw_pictures_that_claim_more(tmp_path, encoding):
    said = depth_image(depths())
    said.fields |= {"width": 60_000, "height": 60_000, "step": 0, "encoding": encoding}
    path = write_bag(tmp_path / "a.mcap", [said, camera_info(DEPTH_INFO)], packed=True)
    refused(path, "needs \\d+ bytes and has 2400")


def test_messages_are_counted(tmp_path, monkeypatch):
    monkeypatch.setattr(decompression, "BAG_MESSAGES_A_BYTE", 0)
    path = write_bag(tmp_path / "a.mcap", [transform("a", "b", topic="/tf")] * 200, packed=True)
    with open_bag(path, UnpackingLimits(messages=300)) as bag:
        assert len(list(bag.messages(bag.streams))) == 200
        with pytest.raises(BadInput, match="more messages than are read: 300, or 0 for each of its"):
            list(bag.messages(bag.streams))


def test_records_of_pieces_that_become_very_much_larger_are_counted(tmp_path):
    said = [Said("/x", "std_msgs/msg/String", {}, raw=b"")] * 3000
    path = write_bag(tmp_path / "a.mcap", said, packed=True)
    for limit, fits in ((100_000, True), (1000, False)):
        with open_bag(path, UnpackingLimits(dense_records=limit, all_times=5)) as bag:
            if fits:
                assert len(list(bag.messages(bag.streams))) == 3000
                continue
            with pytest.raises(BadInput, match="more than 1000 records in packed pieces"):
                list(bag.messages(bag.streams))


def test_an_index_that_names_a_chunk_twice(tmp_path):
    path = write_bag(tmp_path / "a.mcap", session([0.1]), packed=True)
    content = path.read_bytes()
    (summary,) = struct.unpack("<Q", content[-28:-20])
    at = summary
    while content[at] != 0x08:
        at += 9 + struct.unpack_from("<Q", content, at + 1)[0]
    end = at + 9 + struct.unpack_from("<Q", content, at + 1)[0]
    path.write_bytes(content[:end] + content[at:end] + content[end:])
    refused(path, "it names one of its chunks twice")


def test_a_database_that_makes_up_rows_without_an_end(tmp_path):
    path = write_bag(tmp_path / "a.db3", session([0.1]))
    with apsw.Connection(str(path)) as database:
        database.execute(
            "DROP TABLE message_definitions; CREATE VIEW message_definitions AS WITH RECURSIVE more(id) AS "
            "(SELECT 1 UNION ALL SELECT id + 1 FROM more) SELECT id, 'a' AS topic_type, 'ros2msg' AS encoding, "
            "'' AS encoded_message_definition, '' AS type_description_hash FROM more"
        )
    with pytest.raises(BadInput, match="makes up more rows than its \\d+ bytes can have"):
        with open_bag(path, UnpackingLimits(database_steps=3_000_000)):
            pass


def test_a_large_depth_picture_loses_rows_and_columns_before_its_points_are_made(tmp_path):
    rows, columns = np.mgrid[:1300, :1300]
    depth = (700 + rows // 10 + columns // 20) / 1000
    color = np.stack((rows % 251, columns % 241, (rows + columns) % 239), axis=-1).astype(np.uint8)
    matrix = np.array(((900.0, 0, 640), (0, 910, 655), (0, 0, 1)))
    lens = {"width": 1300, "height": 1300, "k": matrix, "p": np.hstack((matrix, np.zeros((3, 1))))}
    said = [depth_image(depth), image(COLOR, color, "rgb8"), camera_info(DEPTH_INFO, **lens)]
    found = read_recording(write_bag(tmp_path / "a.mcap", [*said, camera_info(COLOR_INFO, **lens)]))
    depth = depth.astype(np.float32)
    points = np.stack(((columns - 640) / 900 * depth, (rows - 655) / 910 * depth, depth), axis=-1)
    small, note = with_fewer_points(DepthFrame(points.astype(np.float32), color, intrinsics=matrix))
    assert found.frame.points.shape == (650, 650, 3) and note in found.notes
    np.testing.assert_allclose(found.frame.points, small.points, atol=1e-6)
    np.testing.assert_array_equal(found.frame.color, small.color)
    np.testing.assert_allclose(found.frame.intrinsics, small.intrinsics)


def test_no_more_pictures_are_looked_at_than_their_pixels_allow(tmp_path, monkeypatch):
    path = write_bag(tmp_path / "a.mcap", session((0.1, 0.15, 0.2, 0.25, 0.3)))
    assert read_recording(path, ReadingOf(at=0.2)).frame.looks == 5
    monkeypatch.setattr(load, "MOST_PIXELS_TOGETHER", 3 * depths().size)
    assert read_recording(path, ReadingOf(at=0.2)).frame.looks == 3
    monkeypatch.setattr(load, "MOST_PIXELS_TOGETHER", 1)
    assert read_recording(path, ReadingOf(at=0.2)).frame.looks == 1


def test_colours_are_converted_some_rows_at_a_time(monkeypatch):
    pixels = np.random.default_rng(0).integers(0, 256, (30, 40), dtype=np.uint8)
    pictures = [raw(pixels, f"bayer_{order}8") for order in ("rggb", "bggr", "gbrg", "grbg")]
    pictures += [raw(pixels.astype(np.uint16) << 8, "bayer_rggb16"), raw(colors()[..., :2], "yuv422")]
    whole = [color_picture(picture) for picture in pictures]
    monkeypatch.setattr(image_decoding, "_BAND_PIXELS", 200)
    for picture, expected in zip(pictures, whole, strict=True):
        np.testing.assert_array_equal(color_picture(picture), expected)


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="measures the memory that Linux tells")
def test_a_colour_picture_as_large_as_it_may_be(tmp_path):
    mosaic = np.zeros((4000, 5000), np.uint8)
    forget_peak()
    before = peak_megabytes()
    assert color_picture(raw(mosaic, "bayer_rggb8")).shape == (4000, 5000, 3)
    assert peak_megabytes() - before < 300
