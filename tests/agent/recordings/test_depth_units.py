"""The unit of depths is found by what is seen, in every loader, and a right one is never changed."""

import io
import json

import numpy as np
import pytest
from PIL import Image

from agent.errors import BadInput, UsageError
from agent.recordings.depth_units import IN_BAGS, IN_CLOUDS, fitting_unit, unit_of
from agent.recordings.inspection import inspect_bag
from agent.recordings.load import read_recording
from agent.recordings.point_cloud_files import read_cloud
from agent.recordings.recording import ReadingOf
from agent.recordings.rgbd_folder import in_space, read_rgbd
from tests.agent.recordings.bag_making import (
    DEPTH,
    DEPTH_INFO,
    OPTICAL,
    Said,
    camera_info,
    cloud,
    image,
    quantised_header,
    transform,
    write_bag,
)

WIDTH, HEIGHT, FOCAL = 320, 240, 283.0
MATRIX = np.array(((FOCAL, 0, (WIDTH - 1) / 2), (0, FOCAL, (HEIGHT - 1) / 2), (0, 0, 1)))
BOXES = (  # x, y, and the sides along x, y and z
    (0.0, 0.0, 0.07, 0.09, 0.10), (0.13, 0.06, 0.06, 0.06, 0.05), (-0.14, 0.05, 0.09, 0.05, 0.16),
    (0.05, -0.11, 0.05, 0.08, 0.07),
)  # fmt: skip


def table_depth(distance: float, boxes=BOXES, half: float = 0.6) -> np.ndarray:
    """Depths (H, W), metres, of boxes on a square table over a floor; the camera looks down at 55 degrees."""
    tilt = np.radians(55.0)
    x = (np.arange(WIDTH) - MATRIX[0, 2]) / FOCAL
    y = (np.arange(HEIGHT) - MATRIX[1, 2]) / FOCAL
    rays = np.stack([*np.meshgrid(x, y), np.ones((HEIGHT, WIDTH))], axis=-1)
    # World: x right, y forward, z up; the table's middle is the origin.
    forward = np.array((0, np.cos(tilt), -np.sin(tilt)))
    down = np.array((0, -np.sin(tilt), -np.cos(tilt)))
    rays = rays @ np.stack(((1.0, 0, 0), down, forward))
    eye = -distance * forward
    depth = np.full((HEIGHT, WIDTH), np.inf)

    def slab(low, high):
        with np.errstate(divide="ignore", invalid="ignore"):
            one, other = (low - eye) / rays, (high - eye) / rays
        near, far = np.minimum(one, other).max(axis=-1), np.maximum(one, other).min(axis=-1)
        np.minimum(depth, np.where((near < far) & (near > 0), near, np.inf), out=depth)

    slab(np.array((-half, -half, -0.03)), np.array((half, half, 0.0)))
    slab(np.array((-5.0, -5.0, -0.8)), np.array((5.0, 5.0, -0.75)))
    for px, py, sx, sy, sz in boxes:
        slab(np.array((px - sx / 2, py - sy / 2, 0.0)), np.array((px + sx / 2, py + sy / 2, sz)))
    depth += np.random.default_rng(0).normal(0, 0.0015, depth.shape) * depth
    depth[~np.isfinite(depth)] = 0.0
    return depth


@pytest.fixture(scope="module")
def scenes() -> dict[float, np.ndarray]:
    return {distance: table_depth(distance) for distance in (0.4, 0.6, 1.1, 1.8, 2.5)}


UNITS = (1.0, 0.001, 0.00025, 0.0002, 0.0001)


def found(depth: np.ndarray, true: float, declared: float, candidates=IN_BAGS) -> float | str:
    """The unit that is found, or the sentence that asks for it."""
    try:
        return fitting_unit(in_space((depth / true).astype(np.float32), MATRIX), declared, candidates)[0]
    except BadInput as error:
        return str(error)


@pytest.mark.parametrize("distance", [0.4, 0.6, 1.1, 1.8, 2.5])
@pytest.mark.parametrize("unit", UNITS)
def test_a_unit_that_is_declared_rightly_is_never_changed(scenes, distance, unit):
    assert found(scenes[distance], unit, unit) == unit


@pytest.mark.parametrize("distance", [0.4, 0.6, 1.1, 1.8, 2.5])
@pytest.mark.parametrize(
    ("true", "declared"), [(0.00025, 0.001), (0.0001, 0.001), (0.001, 1.0), (0.0001, 1.0), (1.0, 0.001)]
)
def test_another_unit_is_found_or_asked_for_and_never_taken_wrongly(scenes, distance, true, declared):
    said = found(scenes[distance], true, declared)
    # A near table in such units looks like a farther one in millimetres: there tf tells, or the user.
    nearest = {0.00025: 0.7, 0.0001: 0.5}
    like_declared = declared == 0.001 and distance < nearest.get(true, 0.0) and said == declared
    assert said == true or like_declared or isinstance(said, str) and "--depth-unit" in said


@pytest.mark.parametrize(("true", "declared"), [(0.0001, 0.001), (0.001, 1.0)])
def test_at_the_usual_distance_a_tenth_and_a_thousandth_are_found(scenes, true, declared):
    assert found(scenes[1.1], true, declared) == true


def test_where_several_units_fit_they_are_named(scenes):
    said = found(scenes[1.1], 0.00025, 0.001, (0.001, 0.00025, 0.0002))
    assert "quarters of a millimetre or fifths of a millimetre" in said and "--depth-unit" in said


def test_one_odd_thing_or_a_bare_wall_decides_nothing():
    tall = table_depth(1.1, ((0.0, 0.0, 0.3, 0.3, 0.5),))
    assert found(tall, 0.001, 0.001) == 0.001
    assert found(table_depth(1.1, ()), 0.001, 0.001) == 0.001
    wall = np.full((HEIGHT, WIDTH), 4.0)
    assert found(wall, 0.001, 0.001) == 0.001


def test_no_unit_that_fits_is_asked_for(scenes):
    said = found(scenes[1.1], 1e-8, 0.001)
    assert "no usual unit fits" in said and "--depth-unit says it, legal: metres per stored unit" in said


@pytest.mark.parametrize(
    ("text", "metres"),
    [("0.001", 0.001), ("mm", 0.001), ("0.25 mm", 0.00025), ("TUM", 0.0002), ("m", 1.0), (0.0001, 0.0001)],
)
def test_units_are_given_by_numbers_and_names(text, metres):
    assert unit_of(text) == metres


@pytest.mark.parametrize("text", ["inch", "", "0", "-0.001", "nan", "1e9", "0,001"])
def test_other_units_are_refused_with_the_legal_ones(text):
    with pytest.raises(UsageError, match="--depth-unit cannot be .*0.001, or m, cm, mm"):
        unit_of(text)


def bag_of(path, pixels, encoding, *more, **fields):
    said = [camera_info(DEPTH_INFO, height=HEIGHT, width=WIDTH, k=MATRIX, p=np.hstack((MATRIX, np.zeros((3, 1)))))]
    return write_bag(path, [*said, image(DEPTH, pixels, encoding, **fields), *more])


def middle(recording) -> float:
    return float(np.nanmedian(recording.frame.points[..., 2]))


@pytest.mark.parametrize(("true", "encoding"), [(0.0001, "16UC1"), (0.001, "32FC1")])
def test_a_bag_in_another_unit_is_read_in_metres_and_told(tmp_path, scenes, true, encoding):
    kind = "<u2" if encoding == "16UC1" else "<f4"
    path = bag_of(tmp_path / "a.bag", np.rint(scenes[1.1] / true).astype(kind), encoding)
    recording, info = read_recording(path), inspect_bag(path)
    right = float(np.median(scenes[1.1][scenes[1.1] > 0]))
    assert middle(recording) == pytest.approx(right, rel=0.01)
    notes = [note for note in recording.notes if "were taken to be in" in note]
    assert len(notes) == 1 and DEPTH in notes[0] and notes[0] in info.notes
    assert middle(read_recording(path, ReadingOf(depth_unit=2 * true))) == pytest.approx(2 * right, rel=0.01)


def test_tf_settles_between_units(tmp_path, scenes):
    """A base that stands on the table, under the camera by 0.9 m: 0.25 mm and no other unit brings the table there."""
    pixels = np.rint(scenes[1.1] / 0.00025).astype("<u2")
    tilt = np.radians(55.0)
    height = 1.1 * np.sin(tilt)
    half = (np.pi / 2 + tilt) / 2  # optical to base: a turn about x that leaves z looking down by the tilt
    pose = transform("j2s7s300_link_base", OPTICAL, (0, 0, height), (-np.sin(half), 0, 0, np.cos(half)))
    path = bag_of(tmp_path / "a.bag", pixels, "16UC1", pose)
    recording = read_recording(path)
    assert any("quarters of a millimetre" in note and "arm's base" in note for note in recording.notes)
    assert middle(recording) == pytest.approx(float(np.median(scenes[1.1][scenes[1.1] > 0])), rel=0.01)
    with pytest.raises(BadInput, match="--depth-unit"):
        read_recording(bag_of(tmp_path / "b.bag", pixels, "16UC1"))


@pytest.mark.parametrize("distance", [0.4, 0.6, 1.1, 2.5])
@pytest.mark.parametrize("true", [0.001, 0.00025, 0.0001, 0.0002, 0.01])  # the last two: what no driver should write
def test_with_tf_near_and_far_tables_are_told_apart(scenes, distance, true):
    tilt = np.radians(55.0)
    base_from_camera = np.eye(4)
    s, c = np.sin(tilt), np.cos(tilt)
    base_from_camera[:3, :3] = np.array(((1.0, 0, 0), (0, -s, c), (0, -c, -s)))
    base_from_camera[2, 3] = distance * np.sin(tilt)
    points = in_space((scenes[distance] / true).astype(np.float32), MATRIX)
    unit, note = fitting_unit(points, 0.001, IN_BAGS, base_from_camera=lambda: base_from_camera)
    assert unit == true and bool(note) == (true != 0.001)


def test_compressed_depths_and_clouds_in_millimetres(tmp_path, scenes):
    buffer = io.BytesIO()
    Image.fromarray(np.rint(scenes[1.1] / 0.0001).astype(np.uint16)).save(buffer, "png")
    data = np.frombuffer(quantised_header() + buffer.getvalue(), np.uint8)
    fields = {"header": (OPTICAL, 0.0), "format": "16UC1; compressedDepth png", "data": data}
    packed = Said(f"{DEPTH}/compressedDepth", "sensor_msgs/msg/CompressedImage", fields)
    lens = camera_info(DEPTH_INFO, height=HEIGHT, width=WIDTH, k=MATRIX, p=np.hstack((MATRIX, np.zeros((3, 1)))))
    right = pytest.approx(float(np.median(scenes[1.1][scenes[1.1] > 0])), rel=0.01)
    assert middle(read_recording(write_bag(tmp_path / "a.bag", [lens, packed]))) == right
    points = in_space((scenes[1.1] * 1000).astype(np.float32), MATRIX)
    recording = read_recording(write_bag(tmp_path / "b.bag", [cloud(points)]))
    assert middle(recording) == right and "coordinates" in recording.notes[0] and "millimetres" in recording.notes[0]


@pytest.mark.parametrize(("true", "name"), [(0.001, "millimetres"), (0.01, "centimetres"), (1.0, "")])
def test_clouds_on_disk(tmp_path, scenes, true, name):
    points = in_space((scenes[1.1] / true).astype("<f4"), MATRIX).reshape(-1, 3)
    points = points[points[:, 2] > 0]
    header = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\n"
    header += "".join(f"property float {axis}\n" for axis in "xyz") + "end_header\n"
    (tmp_path / "a.ply").write_bytes(header.encode() + points.tobytes())
    read, _, notes = read_cloud(tmp_path / "a.ply")
    assert float(np.median(read[..., 2])) == pytest.approx(float(np.median(points[:, 2])) * true, rel=1e-3)
    assert bool(name) == bool(notes) and all(f"in {name}" in note for note in notes)
    assert fitting_unit(points, 1.0, IN_CLOUDS)[0] == true
    assert read_cloud(tmp_path / "a.ply", 2 * true)[2] == ()


@pytest.mark.parametrize(
    ("scale", "true", "told"),
    [(0.1, 0.0001, False), (1.0, 0.001, False), (0.001, 0.001, False), (1000, 0.001, False), (5000, 0.0002, False),
     (0.0002, 0.0002, False), (None, 0.001, False)],
)  # fmt: skip
def test_folders_with_the_numbers_of_data_sets(tmp_path, scenes, scale, true, told):
    Image.fromarray(np.rint(scenes[1.1] / true).astype(np.uint16)).save(tmp_path / "depth.png")
    lens = {"fx": FOCAL, "fy": FOCAL, "cx": MATRIX[0, 2], "cy": MATRIX[1, 2]}
    lens |= {} if scale is None else {"depth_scale": scale}
    (tmp_path / "camera.json").write_text(json.dumps(lens))
    picture = read_rgbd(tmp_path)
    right = float(np.median(scenes[1.1][scenes[1.1] > 0]))
    assert float(np.nanmedian(picture.depth)) == pytest.approx(right, rel=0.01)
    assert any("were taken to be" in note for note in picture.notes) == told
    assert np.allclose(read_rgbd(tmp_path, depth_unit=2 * true).depth, 2 * picture.depth, equal_nan=True)


def test_a_folder_in_tenths_of_a_millimetre_is_asked_about(tmp_path, scenes):
    Image.fromarray(np.rint(scenes[1.1] / 0.0001).astype(np.uint16)).save(tmp_path / "depth.png")
    with pytest.raises(BadInput, match="fifths of a millimetre or tenths of a millimetre; --depth-unit"):
        read_rgbd(tmp_path, intrinsics=(FOCAL, FOCAL, *MATRIX[:2, 2]))


@pytest.mark.parametrize("flag", [0, 1])
@pytest.mark.parametrize(("encoding", "kind", "unit"), [("16UC1", "u2", 0.001), ("32FC1", "f4", 1.0)])
def test_a_byte_order_that_the_values_contradict_is_corrected_and_told(tmp_path, scenes, flag, encoding, kind, unit):
    right = (scenes[1.1] / unit).astype(kind)
    for order, told in (("<" if flag else ">", True), (">" if flag else "<", False)):
        path = tmp_path / f"{told}.bag"
        recording = read_recording(bag_of(path, right.astype(order + kind), encoding, is_bigendian=flag))
        assert middle(recording) == pytest.approx(float(np.median(scenes[1.1][scenes[1.1] > 0])), rel=0.01)
        assert any(f"is_bigendian = {flag}" in note for note in recording.notes) == told


def test_noise_and_bare_planes_keep_their_byte_order(tmp_path):
    noise = np.random.default_rng(0).integers(300, 3000, (HEIGHT, WIDTH)).astype("<u2")
    for name, pixels in (("noise", noise), ("plane", np.full((HEIGHT, WIDTH), 1000, "<u2"))):
        recording = read_recording(bag_of(tmp_path / f"{name}.bag", pixels, "16UC1", is_bigendian=0))
        assert not any("bigendian" in note for note in recording.notes)
