"""Depth and colour pictures of folders: paired by lists, names and times, each with the camera of its own."""

import json

import numpy as np
import pytest
from PIL import Image

from agent.errors import BadInput
from agent.recordings.decimal_commas import decimal_comma
from agent.recordings.rgbd_folder import read_rgbd

LENS = {"fx": 50.0, "fy": 50.0, "cx": 19.5, "cy": 14.5}


def folder_of(path, depths, colors, lens=LENS):
    path.mkdir()
    for number, name in enumerate((*depths, *colors)):
        (path / name).parent.mkdir(exist_ok=True)
        pixels = np.full((30, 40, 3), number, np.uint8)
        if number < len(depths):
            pixels = np.full((30, 40), 1000 + number, np.uint16)
        Image.fromarray(pixels).save(path / name)
    if lens is not None:
        (path / "camera.json").write_text(json.dumps(lens))
    return path


STAMPED = (
    ("depth/1305031102.160407.png", "depth/1305031102.194330.png"),
    ("rgb/1305031102.175304.png", "rgb/1305031102.211214.png"),
)


@pytest.mark.parametrize(
    "lines",
    [
        "1.0 depth/1305031102.160407.png 2.0 rgb/1305031102.211214.png\n",
        "2.0 rgb/1305031102.211214.png 1.0 depth/1305031102.160407.png\n",
        "# depth rgb\n\ndepth/1305031102.160407.png rgb/1305031102.211214.png # the first\n",
        "0 1 2 3 0 0 0 1 1.0 ./depth/1305031102.160407.png 2.0 ./rgb/1305031102.211214.png extra\n",
        "depth/1305031102.160407.png,rgb/1305031102.211214.png\n",
        "1,5 depth/1305031102.160407.png 2,5 rgb/1305031102.211214.png\n",
        "1.0 data/depth/1305031102.160407.png 2.0 data/rgb/1305031102.211214.png\n1.0 depth/no.png 2.0 rgb/no.png\n",
    ],
)
def test_a_list_goes_before_times(tmp_path, lines):
    folder = folder_of(tmp_path / "a", *STAMPED)
    (folder / "associations.txt").write_text(lines)
    found = read_rgbd(folder)
    assert found.used["color"] == "rgb/1305031102.211214.png" and found.color[0, 0, 0] == 3
    assert any("by associations.txt" in note for note in found.notes)


def test_a_list_goes_before_names_too(tmp_path):
    folder = folder_of(tmp_path / "a", ("depth/0.png", "depth/1.png"), ("rgb/0.png", "rgb/1.png"))
    assert read_rgbd(folder).used["color"] == "rgb/0.png"
    (folder / "pairs.csv").write_text("depth/0.png,rgb/1.png\n")
    assert read_rgbd(folder).used["color"] == "rgb/1.png"


def test_times_pair_what_no_list_does(tmp_path):
    folder = folder_of(tmp_path / "a", *STAMPED)
    found = read_rgbd(folder, "1305031102.194330")
    assert found.used["color"] == "rgb/1305031102.211214.png" or found.used["color"] == "rgb/1305031102.175304.png"
    assert read_rgbd(folder).used["color"] == "rgb/1305031102.175304.png"
    assert any("0.015 s from the depth" in note for note in read_rgbd(folder).notes)
    stamps = ("rgb/1403715273272143101.png", "rgb/1403715274262142976.png")
    other = folder_of(tmp_path / "b", ("depth/1403715273262142976.png",), stamps)
    assert read_rgbd(other).used["color"] == "rgb/1403715273272143101.png"


def test_lists_of_times_pair_too_and_a_decimal_comma_is_named(tmp_path):
    folder = folder_of(tmp_path / "a", ("depth/a.png", "depth/b.png"), ("rgb/c.png", "rgb/d.png"))
    (folder / "depth.txt").write_text("# time file\n1.00 depth/a.png\n2.00 depth/b.png\n")
    (folder / "rgb.txt").write_text("2.01 rgb/c.png\n1.02 rgb/d.png\n")
    assert read_rgbd(folder).used["color"] == "rgb/d.png"
    (folder / "rgb.txt").write_text("2,01 rgb/c.png\n1,02 rgb/d.png\n")
    with pytest.raises(BadInput, match="rgb.txt.*'2,01' with a decimal comma; write 2.01"):
        read_rgbd(folder)


def test_what_is_said_about_missing_colour_is_true(tmp_path):
    folder = folder_of(tmp_path / "a", ("depth/a.png", "depth/b.png"), ("rgb/c.png", "rgb/d.png"))
    (note,) = [note for note in read_rgbd(folder).notes if "colour" in note]
    assert "there is no colour" not in note and "rgb/c.png, rgb/d.png have another name" in note
    late = folder_of(tmp_path / "b", ("depth/1305031102.16.png",), ("rgb/1305031109.16.png",))
    assert "color" not in read_rgbd(late).used and "within 0.05 s" in read_rgbd(late).notes[0]
    only = folder_of(tmp_path / "c", ("depth/left.png",), ("rgb/right.png",))
    assert read_rgbd(only).used["color"] == "rgb/right.png" and "the only one" in read_rgbd(only).notes[0]
    none = folder_of(tmp_path / "d", ("depth/a.png",), ())
    assert "there is no colour picture" in read_rgbd(none).notes[0]


def camera(focal):
    return {"cam_K": [focal, 0, 19.5, 0, focal, 14.5, 0, 0, 1], "depth_scale": 1.0}


def test_each_picture_has_its_own_camera(tmp_path):
    names = [f"{role}/{number:06d}.png" for role in ("depth", "rgb") for number in (0, 1, 12)]
    folder = folder_of(tmp_path / "a", names[:3], names[3:], None)
    cameras = {"0": camera(40.0), "1": camera(50.0), "000012": camera(60.0)}
    (folder / "scene_camera.json").write_text(json.dumps(cameras))
    focal = {name: read_rgbd(folder, name).intrinsics[0, 0] for name in ("000000", "000001", "000012")}
    assert focal == {"000000": 40.0, "000001": 50.0, "000012": 60.0}
    assert float(np.nanmedian(read_rgbd(folder, "000001").depth)) == pytest.approx(1.001)
    (folder / "scene_camera.json").write_text(json.dumps({"0": camera(40.0), "1": camera(50.0)}))
    with pytest.raises(BadInput, match="cameras of the pictures 0, 1, and none of '000012'"):
        read_rgbd(folder, "000012")
    (folder / "scene_camera.json").write_text(json.dumps({"0": camera(40.0), "1": camera(40.0)}))
    assert read_rgbd(folder, "000012").intrinsics[0, 0] == 40.0


def test_each_picture_may_have_a_file_of_its_own(tmp_path):
    folder = folder_of(tmp_path / "a", ("0001-depth.png", "0002-depth.png"), ("0001-color.png", "0002-color.png"), None)
    for number in (1, 2):
        (folder / f"000{number}-camera.json").write_text(json.dumps(LENS | {"fx": 50.0 + number}))
    assert [read_rgbd(folder, name).intrinsics[0, 0] for name in ("0001", "0002")] == [51.0, 52.0]


@pytest.mark.parametrize(
    ("name", "text", "number"),
    [
        ("camera.json", '{"fx": "525,5", "fy": "525,5", "cx": "19,5", "cy": "14,5"}', "525,5"),
        ("K.txt", "525,5 0 19,5\n0 525,5 14,5\n0 0 1\n", "525,5"),
        ("camera_info.yaml", "fx: 525,5\nfy: 525,5\ncx: 19,5\ncy: 14,5\n", "525,5"),
    ],
)
def test_decimal_commas_in_a_cameras_file_are_named(tmp_path, name, text, number):
    folder = folder_of(tmp_path / "a", ("depth.png",), ("color.png",), None)
    (folder / name).write_text(text)
    with pytest.raises(BadInput, match=f"{name}.*'{number}' with a decimal comma; write 525.5"):
        read_rgbd(folder)


@pytest.mark.parametrize("line", ["525,525,319.5,239.5", "525, 525, 319, 239", "1 2 3", "1.5 2.5", "525,5", ""])
def test_commas_between_numbers_are_no_decimal_commas(line):
    assert decimal_comma([line]) == ""
