"""Depths in RVL: what a plain encoder of the paper's scheme packs is unpacked exactly, and damage is one sentence."""

import struct
from types import SimpleNamespace

import numpy as np
import pytest

from agent.errors import BadInput
from agent.recordings import rvl
from agent.recordings.image_decoding import compressed_size, stored_compressed_depths
from agent.recordings.load import read_recording
from agent.recordings.rvl import unpack_rvl
from tests.agent.recordings.bag_making import DEPTH, HEIGHT, WIDTH, depths, quantised_header, write_bag
from tests.agent.recordings.test_hostile_bags import session
from tests.counting import counted_calls
from tests.memory import forget_peak, peak_megabytes


def packed(values):
    """Pack depths one number after the other, as the paper describes it."""
    nibbles = []

    def number(value):
        while True:
            nibbles.append((value & 7) | (8 if value >> 3 else 0))
            value >>= 3
            if not value:
                return

    at, previous = 0, 0
    while at < len(values):
        for of_nothing in (True, False):
            end = at
            while end < len(values) and (values[end] == 0) == of_nothing:
                end += 1
            number(end - at)
            if not of_nothing:
                for value in values[at:end]:
                    difference = int(value) - previous
                    number(2 * difference if difference >= 0 else -2 * difference - 1)
                    previous = int(value)
            at = end
    nibbles += [0] * (-len(nibbles) % 8)
    words = ["".join(f"{nibble:x}" for nibble in nibbles[k : k + 8]) for k in range(0, len(nibbles), 8)]
    return b"".join(struct.pack("<L", int(word, 16)) for word in words)


def message_of(values, message_format="16UC1; compressedDepth rvl", before=bytes(12)):
    data = before + struct.pack("<II", *values.shape[::-1]) + packed(values.ravel())
    return SimpleNamespace(format=message_format, data=np.frombuffer(data, np.uint8))


@pytest.mark.parametrize("share", [0.0, 0.1, 0.5, 0.9, 1.0])
def test_any_depths_are_unpacked_exactly(share):
    rng = np.random.default_rng(0)
    values = rng.integers(1, 65536, 1000).astype(np.uint16)
    values[rng.random(1000) < share] = 0
    np.testing.assert_array_equal(unpack_rvl(packed(values), 1000), values)


def test_a_long_picture_is_unpacked_exactly():
    values = np.clip(np.random.default_rng(1).normal(900, 300, 640 * 480), 0, 65535).astype(np.uint16)
    np.testing.assert_array_equal(unpack_rvl(packed(values), len(values)), values)


def test_depths_are_metres_with_nan_for_nothing():
    values = np.rint(depths() * 1000).astype(np.uint16)
    values[3, 4] = 0
    message = message_of(values)
    expected = values.astype(np.float32) * np.float32(0.001)
    expected[3, 4] = np.nan
    np.testing.assert_array_equal(stored_compressed_depths(message).metres(), expected)
    assert compressed_size(message) == (WIDTH, HEIGHT)


def test_quantised_float_depths_are_undone():
    a = 100.0 * 101.0
    b = 1.0 - a / 10.0
    values = np.rint(a / depths() + b).astype(np.uint16)
    message = message_of(values, "32FC1; compressedDepth rvl", quantised_header(a, b))
    assert np.abs(stored_compressed_depths(message).metres() - depths()).max() < 1e-3


@pytest.mark.parametrize("kept", [12, 19, 20, 30, 200])
def test_a_cut_picture_is_refused(kept):
    message = message_of(np.rint(depths() * 1000).astype(np.uint16))
    message.data = message.data[:kept]
    with pytest.raises(BadInput, match="RVL picture"):
        stored_compressed_depths(message).metres()


def test_random_bytes_are_refused_or_fit_the_claimed_size():
    rng = np.random.default_rng(2)
    for _ in range(200):
        data = rng.integers(0, 256, 400).astype(np.uint8).tobytes()
        try:
            assert len(unpack_rvl(data, 500)) == 500
        except BadInput as error:
            assert "RVL picture" in str(error)


def test_a_picture_that_claims_more_than_any_camera_has_is_refused():
    data = bytes(12) + struct.pack("<II", 100_000, 100_000) + bytes(100)
    with pytest.raises(BadInput, match="claims 100000 x 100000 pixels"):
        stored_compressed_depths(
            SimpleNamespace(format="16UC1; compressedDepth rvl", data=np.frombuffer(data, np.uint8))
        ).metres()


def test_a_bag_of_them_shows_what_the_raw_depths_show(tmp_path):
    messages = list(session((0.1,)))
    raw = read_recording(write_bag(tmp_path / "raw.bag", messages)).frame.points
    values = np.rint(depths() * 1000).astype(np.uint16)
    for said in messages:
        if said.topic == DEPTH:
            data = message_of(values).data
            said.topic, said.type = f"{DEPTH}/compressedDepth", "sensor_msgs/msg/CompressedImage"
            said.fields = {"header": said.fields["header"], "format": "16UC1; compressedDepth rvl", "data": data}
    points = read_recording(write_bag(tmp_path / "rvl.bag", messages)).frame.points
    np.testing.assert_allclose(points, raw, atol=1e-3)


def test_what_follows_the_picture_is_not_unpacked():
    values = np.clip(np.random.default_rng(1).normal(900, 300, 3000), 0, 65535).astype(np.uint16)
    data = packed(values) + bytes(20_000_000)
    forget_peak()
    before = peak_megabytes()
    np.testing.assert_array_equal(unpack_rvl(data, len(values)), values)
    assert peak_megabytes() - before < 30


@pytest.mark.parametrize("block", [8, 64])
def test_runs_and_numbers_across_blocks(monkeypatch, block):
    monkeypatch.setattr(rvl, "_BLOCK", block)
    rng = np.random.default_rng(5)
    for share in (0.02, 0.5, 0.98):
        values = rng.integers(1, 65536, 700).astype(np.uint16)
        values[rng.random(700) < share] = 0
        data = packed(values)
        np.testing.assert_array_equal(unpack_rvl(data + bytes(40), 700), values)
        for cut in range(0, len(data) - 4, 37):
            with pytest.raises(BadInput, match="RVL picture is cut short"):
                unpack_rvl(data[:cut], 700)


def test_many_short_runs_take_few_steps():
    pixels = 20_000
    pattern = bytes((0x11, 0x21, 0x12)) * (pixels // 4)  # nothing, one measurement, its difference of -1 or 1
    data = np.frombuffer((pattern * 2)[: len(pattern) // 4 * 4], np.uint8).reshape(-1, 4)[:, ::-1].tobytes()
    with counted_calls() as steps:
        unpack_rvl(data, pixels)
    assert steps.count < 2 * pixels
