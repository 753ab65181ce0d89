"""Recordings that are no bags: clouds and folders of pictures, well made, incomplete and damaged."""

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from agent.errors import BadInput, UsageError
from agent.recordings.other_formats import read_other
from agent.recordings.point_cloud_files import read_cloud
from agent.recordings.recording import ReadingOf
from agent.recordings.rgbd_folder import read_rgbd

WIDTH, HEIGHT = 40, 30
PARAMETERS = {"fx": 50.0, "fy": 51.0, "cx": 19.0, "cy": 14.0}
MATRIX = np.array([[50.0, 0, 19], [0, 51, 14], [0, 0, 1]])


def depth_in_mm() -> np.ndarray:
    depth = np.arange(WIDTH * HEIGHT, dtype=np.uint16).reshape(HEIGHT, WIDTH) + 600
    depth[3, 4] = 0
    return depth


def colors() -> np.ndarray:
    return np.random.default_rng(0).integers(0, 255, (HEIGHT, WIDTH, 3), dtype=np.uint8)


def rgbd_folder(folder: Path, names: tuple[str, ...] = ("",), parameters: object = PARAMETERS) -> Path:
    folder.mkdir()
    for name in names:
        Image.fromarray(colors()).save(folder / f"{name}color.png")
        Image.fromarray(depth_in_mm()).save(folder / f"{name}depth.png")
    if parameters is not None:
        (folder / "camera_params.json").write_text(json.dumps(parameters))
    return folder


def pcd(path: Path, points: np.ndarray, kind: str = "binary", size: tuple[int, int] | None = None, **said: str) -> Path:
    width, height = size or (len(points), 1)
    header = {
        "VERSION": "0.7", "FIELDS": "x y z", "SIZE": "4 4 4", "TYPE": "F F F", "COUNT": "1 1 1", "WIDTH": str(width),
        "HEIGHT": str(height), "VIEWPOINT": "0 0 0 1 0 0 0", "POINTS": str(len(points)), "DATA": kind,
    } | said  # fmt: skip
    text = "# .PCD v0.7\n" + "".join(f"{key} {value}\n" for key, value in header.items())
    if kind == "ascii":
        body = "\n".join(" ".join(map(str, row)) for row in points.tolist()).encode()
    else:
        body = points.astype("<f4").tobytes()
    path.write_bytes(text.encode() + body)
    return path


def ply(path: Path, points: np.ndarray, kind: str = "binary_little_endian") -> Path:
    header = f"ply\nformat {kind} 1.0\nelement vertex {len(points)}\n"
    header += "".join(f"property float {axis}\n" for axis in "xyz") + "end_header\n"
    if kind == "ascii":
        body = "\n".join(" ".join(map(str, row)) for row in points.tolist()).encode()
    else:
        body = points.astype(">f4" if "big" in kind else "<f4").tobytes()
    path.write_bytes(header.encode() + body)
    return path


@pytest.fixture
def points() -> np.ndarray:
    return (np.random.default_rng(0).uniform(-0.3, 0.3, (60, 3)) + (0, 0, 1)).astype(np.float32)


def test_pictures_become_points(tmp_path):
    found = read_other(rgbd_folder(tmp_path / "desk"))
    assert np.array_equal(found.frame.color, colors())
    assert np.array_equal(found.frame.intrinsics, MATRIX)
    points, depth = found.frame.points, depth_in_mm() / 1000
    assert points.shape == (HEIGHT, WIDTH, 3) and points.dtype == np.float32
    assert np.isnan(points[3, 4]).all() and np.isnan(points).sum() == 3
    assert points[20, 30] == pytest.approx(
        [(30 - 19) / 50 * depth[20, 30], (20 - 14) / 51 * depth[20, 30], depth[20, 30]], rel=1e-6
    )
    assert found.used == {"depth": "depth.png", "color": "color.png", "intrinsics": "camera_params.json"}
    assert (found.base_from_camera, found.arm, found.notes) == (None, None, ())


def test_the_first_of_several_pictures_is_taken_and_told(tmp_path):
    folder = rgbd_folder(tmp_path / "desk", ("000004-", "000007_"))
    found = read_other(folder)
    assert found.used["depth"] == "000004-depth.png"
    assert any("000004" in note and "000007" in note for note in found.notes)
    assert read_rgbd(folder, "000007").used["color"] == "000007_color.png"
    with pytest.raises(BadInput, match="000004.*000007"):
        read_rgbd(folder, "000005")


@pytest.mark.parametrize(
    ("color", "depth"),
    [
        ("rgb/12.jpg", "depth/12.png"),
        ("color_0001.png", "aligned_depth_to_color_0001.png"),
        ("left.rgb.png", "other.depth.png"),
    ],
)
def test_names_of_other_data_sets(tmp_path, color, depth):
    for name, pixels in ((color, colors()), (depth, depth_in_mm())):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        Image.fromarray(pixels).save(tmp_path / name)
    (tmp_path / "K.txt").write_text("50 0 19\n0 51 14\n0 0 1\n")
    assert read_rgbd(tmp_path).used == {"depth": depth, "color": color, "intrinsics": "K.txt"}


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("camera_params.json", '{"fx": 50, "fy": 51, "x_offset": 19, "y_offset": 14, "img_width": 40}'),
        ("camera.json", '{"color": {"fx": 50, "fy": 51, "ppx": 19, "ppy": 14}}'),
        ("intrinsics.json", '{"K": [[50, 0, 19], [0, 51, 14], [0, 0, 1]]}'),
        ("intrinsic.json", '{"width": 40, "height": 30, "intrinsic_matrix": [50, 0, 0, 0, 51, 0, 19, 14, 1]}'),
        ("scene_camera.json", '{"0": {"cam_K": [50, 0, 19, 0, 51, 14, 0, 0, 1]}}'),
        ("meta.json", '{"camera": {"fx": 50, "fy": 51, "cx": 19, "cy": 14}}'),
        ("camera_info.yaml", "camera_matrix:\n  rows: 3\n  cols: 3\n  data: [50, 0, 19, 0, 51, 14, 0, 0, 1]\n"),
        ("camera-intrinsics.txt", "50 0 19\n0 51 14\n0 0 1\n"),
        ("intrinsic_depth.txt", "50 0 19 0\n0 51 14 0\n0 0 1 0\n0 0 0 1\n"),
        ("intrinsic/intrinsic_depth.txt", "50 0 19 0\n0 51 14 0\n0 0 1 0\n0 0 0 1\n"),
        ("TUM1.yaml", "%YAML:1.0\n\n# ORB-SLAM\nCamera.fx: 50\nCamera.fy: 51\nCamera.cx: 19\nCamera.cy: 14\n"),
        ("D435.yaml", "%YAML:1.0\nCamera1.fx: 50\nCamera1.fy: 51\nCamera1.cx: 19\nCamera1.cy: 14\nCamera2.fx: 9\n"),
        (
            "calibration.yml",
            "%YAML:1.0\n---\ncamera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n"
            "   data: [50., 0., 19., 0., 51., 14., 0., 0., 1.]\n",
        ),
    ],
)
def test_spellings_of_a_lens(tmp_path, name, text):
    folder = rgbd_folder(tmp_path / "desk", parameters=None)
    (folder / name).parent.mkdir(exist_ok=True)
    (folder / name).write_text(text)
    assert np.array_equal(read_rgbd(folder).intrinsics, MATRIX)


def test_the_lens_of_the_depth_goes_before_that_of_the_colour_and_a_pose_is_none(tmp_path):
    folder = rgbd_folder(tmp_path / "scan", parameters=None)
    (folder / "camera_pose.txt").write_text("1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n")
    with pytest.raises(BadInput, match="has no file with fx, fy, cx and cy"):
        read_rgbd(folder)
    (folder / "intrinsic").mkdir()
    for name, factor in (("color", 2), ("depth", 1)):
        matrix = np.diag((factor, factor, 1.0)) @ MATRIX
        np.savetxt(folder / "intrinsic" / f"intrinsic_{name}.txt", matrix)
    picture = read_rgbd(folder)
    assert np.array_equal(picture.intrinsics, MATRIX)
    assert picture.used["intrinsics"] == "intrinsic/intrinsic_depth.txt"


@pytest.mark.parametrize("key", ["DepthMapFactor", "RGBD.DepthMapFactor", "png_depth_scale"])
def test_the_unit_in_other_programs_files(tmp_path, key):
    folder = rgbd_folder(tmp_path / "desk", parameters=None)
    text = f"%YAML:1.0\nCamera.fx: 50\nCamera.fy: 51\nCamera.cx: 19\nCamera.cy: 14\n{key}: 2000.0\n"
    (folder / "SLAM.yaml").write_text(text)
    assert np.nanmin(read_rgbd(folder).depth) == pytest.approx(0.3)


@pytest.mark.parametrize(("color", "depth"), [
    ("image/000000.jpg", "depth/000000.png"), ("image/000000.png", "depth/000000.png"),
    ("results/frame000000.jpg", "results/depth000000.png"),
])  # fmt: skip
def test_colour_pictures_whose_names_do_not_say_so(tmp_path, color, depth):
    for name in (color, depth, "mask/000000.png"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
    Image.fromarray(colors()).save(tmp_path / color)
    Image.fromarray(depth_in_mm()).save(tmp_path / depth)
    Image.fromarray(colors()[::-1]).save(tmp_path / "mask" / "000000.png")
    (tmp_path / "camera_params.json").write_text(json.dumps(PARAMETERS))
    assert read_rgbd(tmp_path).used["color"] == color
    (tmp_path / color).unlink()
    assert read_rgbd(tmp_path).color is None


def test_the_unit_of_depths(tmp_path):
    folder = rgbd_folder(tmp_path / "desk")
    metres = read_rgbd(folder).depth
    assert np.nanmax(np.abs(read_rgbd(folder, depth_unit=0.0005).depth - metres / 2)) < 1e-6
    (folder / "camera_params.json").write_text(json.dumps(PARAMETERS | {"depth_scale": 2000.0}))
    assert np.nanmax(np.abs(read_rgbd(folder).depth - metres / 2)) < 1e-6
    (folder / "depth.png").unlink()
    (folder / "camera_params.json").write_text(json.dumps(PARAMETERS))
    np.save(folder / "depth.npy", metres)
    assert np.array_equal(read_rgbd(folder).depth, metres, equal_nan=True)
    np.save(folder / "depth.npy", metres * 1000)
    found = read_rgbd(folder)
    assert np.allclose(found.depth, metres, equal_nan=True) and "in millimetres" in found.notes[0]
    np.save(folder / "depth.npy", metres * 1e7)
    with pytest.raises(BadInput, match="no usual unit fits.*--depth-unit"):
        read_rgbd(folder)


def test_colour_of_another_size(tmp_path):
    folder = rgbd_folder(tmp_path / "desk")
    Image.fromarray(colors()).resize((80, 60)).save(folder / "color.png")
    scaled = read_rgbd(folder)
    assert scaled.color.shape == (HEIGHT, WIDTH, 3) and "80 x 60" in scaled.notes[0]
    Image.fromarray(colors()).resize((80, 80)).save(folder / "color.png")
    left_out = read_rgbd(folder)
    assert left_out.color is None and "color" not in left_out.used and "80 x 80" in left_out.notes[0]


def test_missing_pieces_are_named_with_what_is_there(tmp_path):
    empty = tmp_path / "empty"
    empty.mkdir()
    with pytest.raises(BadInput, match="no depth picture.*nothing"):
        read_other(empty)
    with pytest.raises(BadInput, match="no recording"):
        read_other(tmp_path / "nowhere")
    folder = rgbd_folder(tmp_path / "desk", parameters=None)
    with pytest.raises(BadInput, match="no file with fx.*color.png, depth.png.*--intrinsics"):
        read_other(folder)
    (folder / "color.png").unlink()
    found = read_rgbd(folder, intrinsics=(50, 51, 19, 14))
    assert found.color is None and "no colour" in found.notes[0] and found.used["intrinsics"] == "--intrinsics"
    (folder / "depth.png").unlink()
    with pytest.raises(BadInput, match="no depth picture"):
        read_other(folder)


@pytest.mark.parametrize(
    ("parameters", "part"),
    [
        ({"fx": 50, "fy": 51, "cx": 900, "cy": 14}, "900"),
        ({"fx": 0, "fy": 51, "cx": 19, "cy": 14}, "fx 0"),
        (PARAMETERS | {"width": 640, "height": 480}, "640 x 480"),
        ("not a camera", "no file with fx, fy"),
        ({"fx": "wide"}, "no file with fx, fy"),
    ],
)
def test_a_lens_that_does_not_fit(tmp_path, parameters, part):
    with pytest.raises(BadInput, match=part):
        read_other(rgbd_folder(tmp_path / "desk", parameters=parameters))


def test_damaged_pictures(tmp_path):
    folder = rgbd_folder(tmp_path / "desk")
    whole = (folder / "depth.png").read_bytes()
    for cut in range(0, len(whole) - 20, len(whole) // 20):
        (folder / "depth.png").write_bytes(whole[:cut])
        with pytest.raises(BadInput, match="depth.png"):
            read_other(folder)
    Image.fromarray(depth_in_mm().astype(np.uint8)).save(folder / "depth.png")
    with pytest.raises(BadInput, match="16 bits"):
        read_other(folder)
    Image.fromarray(np.zeros_like(depth_in_mm())).save(folder / "depth.png")
    with pytest.raises(BadInput, match="no value above 0"):
        read_other(folder)
    (folder / "depth.png").write_bytes(whole)
    (folder / "camera_params.json").write_text('{"fx": ')
    with pytest.raises(BadInput, match="camera_params.json"):
        read_other(folder)


@pytest.mark.parametrize(
    "content",
    [b"", b"text", b"\x93NUMPY\x01\x00v\x00{'descr': '<f8', 'fortran_order': False, 'shape': (99999, 99999), }\n"],
)
def test_damaged_arrays(tmp_path, content):
    folder = rgbd_folder(tmp_path / "desk")
    (folder / "depth.png").unlink()
    (folder / "depth.npy").write_bytes(content)
    with pytest.raises(BadInput, match="depth.npy"):
        read_other(folder)


def test_arrays_of_another_shape(tmp_path):
    folder = rgbd_folder(tmp_path / "desk")
    (folder / "depth.png").unlink()
    np.save(folder / "depth.npy", np.ones((5, 5, 3)))
    with pytest.raises(BadInput, match="5 x 5 x 3"):
        read_other(folder)


@pytest.mark.parametrize("kind", ["ascii", "binary"])
def test_pcd_clouds(tmp_path, points, kind):
    points[7] = np.nan
    found = read_other(pcd(tmp_path / "a.pcd", points, kind, (10, 6)))
    assert np.array_equal(found.frame.points, points.reshape(6, 10, 3), equal_nan=True)
    assert found.frame.organised and found.frame.color is None
    assert any("optical frame" in note for note in found.notes)


@pytest.mark.parametrize("kind", ["ascii", "binary_little_endian", "binary_big_endian"])
def test_ply_clouds(tmp_path, points, kind):
    frame = read_other(ply(tmp_path / "a.ply", points, kind)).frame
    assert np.allclose(frame.points, points[None], atol=1e-6) and not frame.organised


@pytest.mark.parametrize(
    ("name", "options"),
    [("a.ply", {}), ("a.ply", {"write_ascii": True}), ("a.pcd", {}), ("a.pcd", {"compressed": True})],
)
def test_clouds_as_the_library_writes_them_with_colours(tmp_path, points, name, options):
    import open3d

    colors = np.random.default_rng(1).integers(0, 255, points.shape, dtype=np.uint8)
    cloud = open3d.t.geometry.PointCloud(open3d.core.Tensor(points))
    cloud.point.colors = open3d.core.Tensor(colors)
    open3d.t.io.write_point_cloud(str(tmp_path / name), cloud, **options)
    frame = read_other(tmp_path / name).frame
    assert np.allclose(frame.points[0], points, atol=1e-5) and np.array_equal(frame.color[0], colors)


def test_colours_packed_into_a_float(tmp_path, points):
    packed = np.full(len(points), 0x00102030, np.uint32).view(np.float32)
    rows = np.column_stack((points, packed))
    path = pcd(tmp_path / "a.pcd", rows, FIELDS="x y z rgb", SIZE="4 4 4 4", TYPE="F F F F", COUNT="1 1 1 1")
    assert (read_other(path).frame.color == (0x10, 0x20, 0x30)).all()


def test_millimetres_are_reported(tmp_path, points):
    found = read_other(pcd(tmp_path / "a.pcd", points * 1000))
    assert np.allclose(found.frame.points[0], points, atol=1e-6)
    assert any("millimetres" in note for note in found.notes)


@pytest.mark.parametrize(
    ("said", "part"),
    [
        ({"FIELDS": "x y intensity"}, "no x, y and z.*intensity"),
        ({"WIDTH": "999999999", "HEIGHT": "9", "POINTS": "8999999991"}, "8999999991 points"),
        ({"WIDTH": "7"}, "60 points in 7 x 1"),
        ({"WIDTH": "many"}, "header"),
        ({"SIZE": "4 4"}, "header"),
        ({"DATA": "zipped"}, "zipped.*ascii"),
        ({"WIDTH": "0", "POINTS": "0"}, "empty"),
        ({"DATA": "binary_compressed"}, "unpacks"),
    ],
)
def test_headers_that_claim_what_is_not_there(tmp_path, points, said, part):
    with pytest.raises(BadInput, match=part):
        read_other(pcd(tmp_path / "a.pcd", points, **said))


@pytest.mark.parametrize("name", ["a.pcd", "a.ply"])
@pytest.mark.parametrize(
    "content", [b"", b"just some text\n", bytes(range(256)) * 8, b"ply\nformat ascii 1.0\nend_header\n"]
)
def test_files_that_are_no_clouds(tmp_path, name, content):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(BadInput, match=name):
        read_other(tmp_path / name)


def test_truncated_clouds(tmp_path, points):
    files = [pcd(tmp_path / "a.pcd", points, "ascii"), pcd(tmp_path / "b.pcd", points)]
    files += [ply(tmp_path / "c.ply", points, "ascii"), ply(tmp_path / "d.ply", points)]
    for path in files:
        whole = path.read_bytes()
        for part in range(20):
            path.write_bytes(whole[: len(whole) * part // 20])
            with pytest.raises(BadInput, match=path.name):
                read_cloud(path)


def test_a_cloud_that_measured_nothing(tmp_path, points):
    for nothing in (np.full_like(points, np.nan), np.zeros_like(points)):
        with pytest.raises(BadInput, match="measures"):
            read_other(pcd(tmp_path / "a.pcd", nothing))


def test_options_of_bags_are_refused(tmp_path, points):
    cloud, folder = pcd(tmp_path / "a.pcd", points), rgbd_folder(tmp_path / "desk")
    for path, what in ((cloud, "a cloud"), (folder, "a folder of pictures")):
        with pytest.raises(UsageError, match=f"--at.*{what}"):
            read_other(path, ReadingOf(at=1.0))
        with pytest.raises(UsageError, match=f"--topic.*{what}"):
            read_other(path, ReadingOf(topics={"depth": "/x"}))
        pose = np.eye(4)
        assert read_other(path, ReadingOf(world_from_camera=pose)).world_from_camera is pose
