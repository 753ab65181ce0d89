"""Clouds and lenses out of messages: whatever order, type and padding the bytes have."""

from types import SimpleNamespace

import numpy as np
import pytest

from agent.errors import BadInput
from agent.recordings.message_decoding import lens_of, stored_cloud, without_nothing
from tests.agent.recordings.bag_making import HEIGHT, MATRIX, WIDTH, colors, depths, plane_points


def header(frame="camera", seconds=0):
    return SimpleNamespace(frame_id=frame, stamp=SimpleNamespace(sec=seconds, nanosec=0))


def packed(points, rgb, rng, big_endian, kind):
    """A PointCloud2 with fields of random order and distance, and rows with something after them."""
    order = ">" if big_endian else "<"
    color = "f4" if kind == "rgb as float32" else "u4"
    fields = [("x", 7, "f4"), ("y", 8, "f8"), ("z", 7, "f4"), ("label", 4, "u2")]
    fields.append(("rgb", 7 if color == "f4" else 6, color))
    fields = [fields[k] for k in rng.permutation(len(fields))]
    offsets, at = [], 0
    for _, _, dtype in fields:
        at += int(rng.integers(0, 7))
        offsets.append(at)
        at += np.dtype(dtype).itemsize
    step = at + int(rng.integers(0, 5))
    height, width = points.shape[:2]
    pad = int(rng.integers(0, 9))
    names, formats = [name for name, _, _ in fields], [order + dtype for _, _, dtype in fields]
    layout = {"names": names, "formats": formats, "offsets": offsets, "itemsize": step}
    table = np.zeros((height, width), np.dtype(layout))
    for axis, name in enumerate("xyz"):
        table[name] = points[..., axis]
    word = (rgb.astype(np.uint32) << np.array((16, 8, 0), np.uint32)).sum(axis=-1).astype(np.uint32)
    table["rgb"] = word if color == "u4" else word.view(np.float32)
    rows = np.frombuffer(table.tobytes(), np.uint8).reshape(height, width * step)
    data = np.hstack((rows, np.full((height, pad), 0xEE, np.uint8)))
    return SimpleNamespace(
        header=header(), height=height, width=width, point_step=step, row_step=width * step + pad,
        is_bigendian=big_endian, is_dense=False, data=data.ravel(),
        fields=[SimpleNamespace(name=f[0], offset=o, datatype=f[1], count=1) for f, o in zip(fields, offsets)],
    )  # fmt: skip


@pytest.mark.parametrize("seed", range(12))
def test_a_cloud_comes_back_whatever_its_layout(seed):
    rng = np.random.default_rng(seed)
    points = plane_points(depths()).astype(np.float32)
    points[rng.random(points.shape[:2]) < 0.2] = np.nan
    points[0, 0, 1] = np.inf
    message = packed(points, colors(), rng, bool(seed % 2), ("rgb as float32", "rgb as uint32")[seed // 2 % 2])
    points, rgb, _ = stored_cloud(message)
    read = without_nothing(points)
    points[0, 0] = np.nan
    np.testing.assert_array_equal(read, points)
    np.testing.assert_array_equal(rgb, colors())


def test_an_unorganised_cloud_is_one_row():
    points = plane_points(depths()).reshape(1, -1, 3)
    message = packed(points, colors().reshape(1, -1, 3), np.random.default_rng(3), False, "rgb as uint32")
    message.row_step = 0  # some drivers leave it out where there is one row
    assert stored_cloud(message)[0].shape == (1, WIDTH * HEIGHT, 3)


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (lambda m: setattr(m, "data", m.data[:-400]), "needs"),
        (lambda m: setattr(m, "width", 100_000), "needs"),
        (lambda m: (setattr(m, "width", 2**31), setattr(m, "height", 2**31)), "needs"),
        (lambda m: setattr(m, "height", 0), "has none"),
        (lambda m: setattr(m, "row_step", 3), "3 a row"),
        (lambda m: setattr(m, "point_step", 0), "no usable field x and y and z"),
        (lambda m: setattr(m, "fields", [f for f in m.fields if f.name != "z"]), "no usable field z"),
        (lambda m: [setattr(f, "offset", 4_000_000_000) for f in m.fields if f.name == "x"], "no usable field x"),
        (lambda m: [setattr(f, "datatype", 99) for f in m.fields if f.name == "y"], "no usable field y"),
    ],
)
def test_a_cloud_that_contradicts_itself_is_refused(spoil, said):
    message = packed(plane_points(depths()), colors(), np.random.default_rng(0), False, "rgb as uint32")
    spoil(message)
    with pytest.raises(BadInput, match=said):
        stored_cloud(message)


def info(**fields):
    values = {"k": MATRIX.ravel(), "p": np.zeros(12), "d": np.zeros(5), "distortion_model": "plumb_bob"}
    values |= {"width": WIDTH, "height": HEIGHT, "header": header("/camera_optical")}
    return SimpleNamespace(**values | fields)


def test_a_lens_gives_the_rays_of_its_pixels_and_back():
    bent = np.array((0.12, -0.2, 0.003, -0.002, 0.05))
    lens = lens_of(info(d=bent), rectified=False)
    rays = lens.rays(WIDTH, HEIGHT)
    points = np.concatenate((rays, np.ones((HEIGHT, WIDTH, 1))), axis=-1) * 0.7
    rows, columns = np.mgrid[:HEIGHT, :WIDTH]
    np.testing.assert_allclose(lens.pixels(points), np.stack((columns, rows), axis=-1), atol=2e-3)
    straight = lens_of(info(), rectified=False).rays(WIDTH, HEIGHT)
    assert np.abs(straight - rays).max() > 0.01


def test_the_projection_goes_for_rectified_pictures_and_where_there_is_no_other():
    projection = np.hstack((np.diag((50.0, 51.0, 1.0)), np.zeros((3, 1))))
    both = info(p=projection.ravel(), d=np.full(5, 0.1))
    assert lens_of(both, rectified=True).matrix[0, 0] == 50
    assert not lens_of(both, rectified=True).distortion.any()
    assert lens_of(both, rectified=False).matrix[0, 0] == 35
    assert lens_of(info(p=projection.ravel(), k=np.zeros(9)), rectified=False).matrix[1, 1] == 51


def test_a_model_of_distortion_that_is_not_known_is_reported():
    lens = lens_of(info(d=np.full(4, 0.1), distortion_model="equidistant"), rectified=False)
    assert "equidistant" in lens.note and not lens.distortion.any()


@pytest.mark.parametrize("matrix", [np.zeros(9), np.full(9, np.nan), np.full(9, 1e300)])
def test_a_lens_without_a_focal_length_is_refused(matrix):
    with pytest.raises(BadInput, match="no focal length"):
        lens_of(info(k=matrix), rectified=False)


def test_a_lens_fits_a_picture_of_half_the_size_and_no_other_shape():
    lens = lens_of(info(), rectified=False)
    half = lens.scaled(WIDTH // 2, HEIGHT // 2)
    np.testing.assert_allclose(half.rays(WIDTH // 2, HEIGHT // 2).mean(axis=(0, 1)), 0, atol=1e-6)
    with pytest.raises(BadInput, match="does not fit a picture of 40 x 40"):
        lens.scaled(40, 40)


def whole_info(width, height, roi=(0, 0, 0, 0), binning=(0, 0), k=None, p=None):
    """A CameraInfo of a camera of 640 x 480 pixels, with its region (x, y, width, height)."""
    k = np.array(((500.0, 0, 319.5), (0, 500, 239.5), (0, 0, 1))) if k is None else k
    p = k if p is None else p
    names = ("x_offset", "y_offset", "width", "height")
    return SimpleNamespace(
        width=width, height=height, k=k.ravel(), p=np.hstack((p, np.zeros((3, 1)))).ravel(), d=np.zeros(5),
        distortion_model="plumb_bob", header=SimpleNamespace(frame_id="eye"), binning_x=binning[0],
        binning_y=binning[1], roi=SimpleNamespace(**dict(zip(names, roi, strict=True)), do_rectify=False),
    )  # fmt: skip


def moved(matrix, x, y):
    return np.array(((1.0, 0, -x), (0, 1, -y), (0, 0, 1))) @ matrix


FULL = np.array(((500.0, 0, 319.5), (0, 500, 239.5), (0, 0, 1)))


@pytest.mark.parametrize("rectified", [False, True])
@pytest.mark.parametrize(
    ("info", "size", "lens", "told"),
    [
        (whole_info(640, 480), (640, 480), (500, 319.5, 239.5), ""),
        (whole_info(640, 480, (0, 0, 640, 480)), (640, 480), (500, 319.5, 239.5), ""),
        (whole_info(640, 480, (160, 120, 320, 240)), (320, 240), (500, 159.5, 119.5), ""),
        (whole_info(640, 480, (10, 200, 100, 60)), (100, 60), (500, 309.5, 39.5), ""),
        (whole_info(640, 480, (160, 120, 320, 240), (2, 2)), (160, 120), (250, 79.5, 59.5), ""),
        (whole_info(640, 480, binning=(2, 2)), (320, 240), (250, 159.5, 119.5), ""),
        (whole_info(640, 480, binning=(1, 1)), (640, 480), (500, 319.5, 239.5), ""),
        # The picture is whole although a region is stated, or has the region without the binning.
        (whole_info(640, 480, (160, 120, 320, 240)), (640, 480), (500, 319.5, 239.5), "320 x 240"),
        (whole_info(640, 480, (160, 120, 320, 240), (2, 2)), (320, 240), (500, 159.5, 119.5), "160 x 120"),
        (whole_info(640, 480, (4 * 10**9, 0, 4 * 10**9, 5)), (640, 480), (500, 319.5, 239.5), "x 5 pixels"),
        # Scaled in neither way that is stated.
        (whole_info(640, 480), (320, 240), (250, 159.5, 119.5), "was scaled"),
        (whole_info(640, 480, (0, 0, 400, 400)), (200, 200), (250, 159.5, 119.5), "was scaled"),
        # Drivers that state the region's size as that of the camera, with matrices of either.
        (whole_info(400, 300, (160, 120, 400, 300)), (400, 300), (500, 159.5, 119.5), ""),
        (whole_info(400, 300, (160, 120, 400, 300), p=moved(FULL, 160, 120)), (400, 300), (500, 159.5, 119.5), ""),
        (whole_info(400, 300, (160, 120, 400, 300), k=moved(FULL, 160, 120)), (400, 300), (500, 159.5, 119.5), ""),
        (whole_info(640, 480, (160, 120, 400, 300), p=moved(FULL, 160, 120)), (400, 300), (500, 159.5, 119.5), ""),
        # So small a step aside that its middle stays within the region when it is cut out once more.
        (whole_info(480, 360, (80, 60, 480, 360), k=moved(FULL, 80, 60)), (480, 360), (500, 239.5, 179.5), ""),
        (whole_info(480, 360, (80, 60, 480, 360)), (480, 360), (500, 239.5, 179.5), ""),
    ],
)
def test_regions_and_binning_change_the_lens(info, size, lens, told, rectified):
    found = lens_of(info, rectified).scaled(*size)
    assert (found.matrix[0, 0], found.matrix[1, 1]) == pytest.approx((lens[0], lens[0]))
    assert found.matrix[:2, 2] == pytest.approx(lens[1:], abs=0.26)
    assert told in found.note and bool(told) == bool(found.note)


@pytest.mark.parametrize(("info", "size"), [
    (whole_info(640, 480, (160, 120, 320, 240)), (300, 300)), (whole_info(640, 480, binning=(2, 2)), (320, 200)),
])  # fmt: skip
def test_a_picture_of_another_shape_has_no_lens(info, size):
    with pytest.raises(BadInput, match="does not fit a picture of"):
        lens_of(info, False).scaled(*size)
