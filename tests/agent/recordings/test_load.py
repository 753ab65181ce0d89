"""One moment out of whole bags: what is chosen, fused, laid over each other, and said."""

import io
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from agent.errors import BadInput, UsageError
from agent.recordings.load import read_recording
from agent.recordings.recording import ReadingOf
from tests.agent.recordings.bag_making import (
    COLOR,
    DEPTH,
    DEPTH_INFO,
    HEIGHT,
    HOME,
    JOINTS,
    MATRIX,
    OPTICAL,
    WIDTH,
    Said,
    camera_info,
    cloud,
    colors,
    depth_image,
    depths,
    image,
    joints,
    plane_points,
    quantised_header,
    session,
    transform,
    write_bag,
)


def without(messages, *topics):
    return [said for said in messages if said.topic not in topics]


@pytest.mark.parametrize("name", ["session.bag", "session.mcap", "session.db3", "session"])
def test_a_session_comes_back_from_every_kind_of_bag(tmp_path, name):
    path = write_bag(tmp_path / name, session())
    recording = read_recording(path)
    frame = recording.frame
    np.testing.assert_allclose(frame.points, plane_points(depths()), atol=1e-6)
    np.testing.assert_array_equal(frame.color, colors())
    np.testing.assert_array_equal(frame.intrinsics, MATRIX)
    assert (frame.frame_id, frame.looks, frame.organised) == (OPTICAL, 3, True)
    assert frame.seconds == pytest.approx(0.1)
    assert recording.arm.model == "j2s7s300" and recording.arm.prefix == "j2s7s300_"
    assert recording.arm.joints == pytest.approx({f"joint_{k}": angle for k, angle in enumerate(HOME, start=1)})
    # the camera stands at (0.1, -0.89, 0.6) and looks along the base's +x: its z is x, its x is -y, its y is -z
    expected = np.array(((0, 0, 1, 0.1), (-1, 0, 0, -0.89), (0, -1, 0, 0.6), (0, 0, 0, 1)))
    np.testing.assert_allclose(recording.base_from_camera, expected, atol=1e-9)
    assert recording.used == {
        "depth": DEPTH, "depth_info": DEPTH_INFO, "color": COLOR, "joints": JOINTS, "tf": "/tf_static"
    }  # fmt: skip
    assert recording.notes == ()


def test_the_moment_is_the_one_that_is_asked_for(tmp_path):
    said = [transform("root", OPTICAL, seconds=0.0)]
    for k in range(40):
        said += [camera_info(DEPTH_INFO, k), depth_image(depths() + 0.05 * k, k), joints(k, angles=[k] * 7)]
    path = write_bag(tmp_path / "long.mcap", said)
    for at in (0, 7.4, 22.6, 39):
        recording = read_recording(path, ReadingOf(at=at))
        assert recording.frame.seconds == round(at) and recording.arm.joints["joint_1"] == round(at)
        np.testing.assert_allclose(recording.frame.points[..., 2], depths() + 0.05 * round(at), atol=1e-3)
    with pytest.raises(BadInput, match=r"no moment 40 s after its first; legal: 0 to 39\.0"):
        read_recording(path, ReadingOf(at=40))


def test_the_first_moment_has_everything(tmp_path):
    said = [*session((0.1,)), joints(0.9), depth_image(depths(), 0.5), depth_image(depths() + 0.1, 1.0)]
    said = [message for message in said if message.topic != JOINTS or message.seconds > 0.5]
    recording = read_recording(write_bag(tmp_path / "late.bag", sorted(said, key=lambda message: message.seconds)))
    assert recording.frame.seconds == pytest.approx(1.0)


def test_holes_are_filled_from_other_looks_and_noise_is_halved(tmp_path):
    rng = np.random.default_rng(0)
    said = without(session((0.0,)), DEPTH)
    for k in range(5):
        depth = depths() + rng.choice((-0.002, 0.0, 0.002), depths().shape)
        depth[rng.random(depth.shape) < 0.2] = 0
        said.append(depth_image(depth, 0.1 * k))
    path = write_bag(tmp_path / "holes.bag", said)
    one, five = (read_recording(path, ReadingOf(looks=looks)).frame for looks in (1, 5))
    assert (one.looks, five.looks) == (1, 5)
    assert np.isnan(one.points[..., 2]).mean() > 0.15 and np.isnan(five.points[..., 2]).mean() < 0.005
    errors = [np.nanmean(np.abs(frame.points[..., 2] - depths())) for frame in (one, five)]
    assert errors[1] < 0.75 * errors[0]


def test_looks_of_a_camera_that_moves_are_not_mixed(tmp_path):
    said = without(session((0.0,)), DEPTH) + [depth_image(depths() + 0.1 * k, 0.1 * k) for k in range(5)]
    frame = read_recording(write_bag(tmp_path / "moving.bag", said)).frame
    assert frame.looks == 1
    np.testing.assert_allclose(frame.points[..., 2], depths(), atol=1e-6)


def test_pictures_that_measure_nothing_are_passed_over(tmp_path):
    said = without(session((0.0,)), DEPTH) + [depth_image(0 * depths(), 0.1 * k) for k in range(9)]
    recording = read_recording(write_bag(tmp_path / "dark.bag", [*said, depth_image(depths(), 1.0)]))
    assert recording.frame.seconds == pytest.approx(1.0)


def test_a_coloured_organised_cloud_is_enough(tmp_path):
    points = plane_points(depths())
    points[2:4] = np.nan
    message = cloud(points)
    packed = np.zeros((HEIGHT, WIDTH, 32), np.uint8)
    packed[..., :12] = np.frombuffer(message.fields["data"].tobytes(), np.uint8).reshape(HEIGHT, WIDTH, 12)
    packed[..., 16:19] = colors()[..., ::-1]
    fields = [*message.fields["fields"], {"name": "rgb", "offset": 16, "datatype": 7, "count": 1}]
    message.fields |= {"fields": fields, "point_step": 32, "row_step": 32 * WIDTH, "data": packed.ravel()}
    recording = read_recording(write_bag(tmp_path / "cloud.bag", [message]))
    np.testing.assert_array_equal(np.isnan(recording.frame.points[..., 0]), np.isnan(points[..., 0]))
    np.testing.assert_array_equal(recording.frame.color, colors())
    assert recording.frame.intrinsics is None and recording.arm is None and recording.base_from_camera is None
    assert len(recording.notes) == 2


def test_loose_points_give_way_to_a_depth_picture_unless_they_are_named(tmp_path):
    loose = cloud(plane_points(depths()).reshape(1, -1, 3), 0.1)
    path = write_bag(tmp_path / "both.mcap", [*session(), loose])
    assert read_recording(path).frame.points.shape == (HEIGHT, WIDTH, 3)
    named = read_recording(path, ReadingOf(topics={"points": loose.topic}))
    assert named.frame.points.shape == (1, HEIGHT * WIDTH, 3) and named.used["points"] == loose.topic


def test_compressed_pictures_serve_where_there_are_no_others(tmp_path):
    millimetres, picture = io.BytesIO(), io.BytesIO()
    Image.fromarray(np.rint(depths() * 1000).astype(np.uint16)).save(millimetres, "PNG")
    Image.fromarray(colors()).save(picture, "PNG")
    kind = "sensor_msgs/msg/CompressedImage"
    depth = {"format": "16UC1; compressedDepth", "data": list(quantised_header() + millimetres.getvalue())}
    color = {"format": "rgb8; png compressed bgr8", "data": list(picture.getvalue())}
    said = [
        *without(session((0.1,)), DEPTH, COLOR),
        Said(f"{DEPTH}/compressedDepth", kind, depth | {"header": (OPTICAL, 0.1)}, 0.1),
        Said(f"{COLOR}/compressed", kind, color | {"header": (OPTICAL, 0.1)}, 0.1),
    ]
    recording = read_recording(write_bag(tmp_path / "compressed.bag", said))
    np.testing.assert_allclose(recording.frame.points, plane_points(depths()), atol=1e-6)
    np.testing.assert_array_equal(recording.frame.color, colors())
    assert recording.used["depth_info"] == DEPTH_INFO


def apart(shift):
    """Depth and colour of two cameras beside each other, the colour `shift` metres to the right."""
    depth, info = "/camera/depth/image_rect_raw", "/camera/depth/camera_info"
    frames = [transform("camera_link", "depth_optical"), transform("camera_link", OPTICAL, (shift, 0, 0))]
    flat = np.full((HEIGHT, WIDTH), 0.7)
    pictures = [camera_info(info, 0.1, "depth_optical"), depth_image(flat, 0.1, depth, "depth_optical")]
    return [*frames, *pictures, camera_info("/camera/color/camera_info", 0.1), image(COLOR, colors(), "rgb8", 0.1)]


def test_colour_of_another_camera_is_laid_over_the_depth(tmp_path):
    recording = read_recording(write_bag(tmp_path / "apart.bag", apart(0.1)))  # at 0.7 m: 35 * 0.1 / 0.7 = 5 pixels
    np.testing.assert_array_equal(recording.frame.color[:, 5:], colors()[:, :-5])
    assert not recording.frame.color[:, :5].any()
    assert any("laid over" in note for note in recording.notes)


def test_colour_of_a_camera_that_stands_nobody_knows_where_is_left_out(tmp_path):
    recording = read_recording(write_bag(tmp_path / "apart.bag", without(apart(0.1), "/tf_static")))
    assert recording.frame.color is None and "color" not in recording.used
    assert any("colour was left out: tf does not connect" in note for note in recording.notes)


def of_camera(said, name, frame, **data):
    """The messages of the session's camera as those of another one, with other pictures of "16UC1" or "rgb8"."""
    made = []
    for message in said:
        if message.topic.startswith("/camera/"):
            pictures = data.get(message.fields.get("encoding", ""), {})
            fields = message.fields | {"header": (frame, 0.1)} | pictures
            made.append(replace(message, topic=message.topic.replace("/camera/", f"/{name}/"), fields=fields))
    return made


BLANK = {"data": np.zeros(2 * HEIGHT * WIDTH, np.uint8)}
BLACK = {"data": np.zeros(3 * HEIGHT * WIDTH, np.uint8)}


@pytest.mark.parametrize("name", ["a_camera", "wrist"])
def test_a_camera_that_measures_nothing_gives_way_to_the_other(tmp_path, name):
    said = session((0.1,))
    path = write_bag(tmp_path / "two.bag", [*of_camera(said, name, "eye", **{"16UC1": BLANK, "rgb8": BLACK}), *said])
    recording = read_recording(path)
    assert (recording.used["depth"], recording.used["color"]) == (DEPTH, COLOR)
    np.testing.assert_array_equal(recording.frame.color, colors())


@pytest.mark.parametrize("frame", ["eye", OPTICAL])
def test_the_colour_is_that_of_the_camera_whose_depth_is_named(tmp_path, frame):
    said = session((0.1,))
    path = write_bag(tmp_path / "two.bag", [*of_camera(said, "a_camera", frame, rgb8=BLACK), *said])
    for name in ("camera", "a_camera"):
        topic = DEPTH.replace("camera", name, 1)
        recording = read_recording(path, ReadingOf(topics={"depth": topic}))
        assert recording.used["color"] == COLOR.replace("camera", name, 1)
        assert recording.frame.color.any() == (name == "camera")


def test_the_colour_of_another_cameras_depth_is_not_taken(tmp_path):
    said = session((0.1,))
    path = write_bag(tmp_path / "two.bag", [*of_camera(said, "wrist", "eye", rgb8=BLACK), *without(said, COLOR)])
    assert read_recording(path, ReadingOf(topics={"depth": DEPTH})).frame.color is None
    named = read_recording(path, ReadingOf(topics={"depth": DEPTH, "color": "/wrist/color/image_raw"}))
    assert named.used["color"] == "/wrist/color/image_raw"


def test_the_colour_nearest_in_its_stamp_is_taken(tmp_path):
    said = without(session((0.1,)), COLOR)
    for k in range(5):
        late = image(COLOR, colors() // (k + 1), "rgb8", 0.05 * k)
        said.append(replace(late, seconds=0.05 * k + 0.3))  # it arrives late
    recording = read_recording(write_bag(tmp_path / "late.bag", sorted(said, key=lambda message: message.seconds)))
    np.testing.assert_array_equal(recording.frame.color, colors() // 3)


def test_a_colour_that_cannot_be_used_is_reported_and_refused_only_where_it_is_named(tmp_path):
    said = [*without(session((0.1,)), COLOR), image(COLOR, colors()[..., 0], "bayer_xyzw8", 0.1)]
    path = write_bag(tmp_path / "bayer.bag", said)
    recording = read_recording(path)
    assert recording.frame.color is None and "'bayer_xyzw8' cannot be used" in recording.notes[0]
    with pytest.raises(BadInput, match="bayer_xyzw8"):
        read_recording(path, ReadingOf(topics={"color": COLOR}))


def test_named_topics_are_taken(tmp_path):
    other = depth_image(depths() + 0.3, 0.1, "/my/range")
    path = write_bag(tmp_path / "named.bag", [*session(), other])
    recording = read_recording(path, ReadingOf(topics={"depth": "/my/range", "depth_info": DEPTH_INFO}))
    assert np.nanmin(recording.frame.points[..., 2]) == pytest.approx(1.0)
    assert recording.used["depth"] == "/my/range"


@pytest.mark.parametrize(
    ("topics", "error", "said"),
    [
        ({"depth": "/nowhere"}, BadInput, f"no topic '/nowhere' .* for depth; legal: {DEPTH}, {COLOR}"),
        ({"points": "/nowhere"}, BadInput, "legal: none; it has /camera"),
        ({"joints": DEPTH}, BadInput, f"legal: {JOINTS}"),
        ({"lens": DEPTH_INFO}, UsageError, "'lens'; legal: points, depth, depth_info, color, joints"),
        ({"depth": COLOR}, BadInput, f"{COLOR}.*no sensor_msgs|'rgb8' holds no depths"),
    ],
)
def test_a_topic_that_is_not_there_is_reported_with_those_that_are(tmp_path, topics, error, said):
    path = write_bag(tmp_path / "session.bag", session())
    with pytest.raises(error, match=said):
        read_recording(path, ReadingOf(topics=topics))


def test_points_and_depth_exclude_each_other(tmp_path):
    path = write_bag(tmp_path / "both.bag", [*session(), cloud(plane_points(depths()))])
    with pytest.raises(UsageError, match="not both"):
        read_recording(path, ReadingOf(topics={"points": "/camera/depth_registered/points", "depth": DEPTH}))


def test_stamps_of_another_clock_are_not_believed(tmp_path):
    said = session()
    for message in said:
        if "header" in message.fields:
            message.fields["header"] = (message.fields["header"][0], -1.5e9)
    recording = read_recording(write_bag(tmp_path / "clock.bag", said))
    assert recording.frame.color is not None and recording.arm is not None and recording.notes == ()


def test_a_folder_without_its_metadata_is_read_by_its_only_file(tmp_path):
    path = write_bag(tmp_path / "session", session())
    (path / "metadata.yaml").write_text("rosbag2_bagfile_information: [")
    recording = read_recording(path)
    assert "session.db3 was read alone" in recording.notes[0]
    (path / "metadata.yaml").unlink()
    assert "it has no metadata.yaml" in read_recording(path).notes[0]


def test_of_a_long_bag_little_is_decoded(tmp_path, monkeypatch):
    from agent.recordings.bag_reader import Bag

    said = [transform("root", OPTICAL)]
    said += [transform("root", "j2s7s300_link_base", seconds=0.1 * k, topic="/tf") for k in range(3000)]
    for k in range(300):
        said += [camera_info(DEPTH_INFO, k), depth_image(depths(), k), joints(k)]
    path = write_bag(tmp_path / "long.bag", sorted(said, key=lambda message: message.seconds))
    messages, decoded = [], Bag.decoded

    def counted(bag, message):
        messages.append(message)
        return decoded(bag, message)

    monkeypatch.setattr(Bag, "decoded", counted)
    recording = read_recording(path, ReadingOf(at=150))
    assert recording.frame.seconds == pytest.approx(150) and recording.base_from_camera is not None
    assert len(messages) < 150


def test_looks_from_a_hand_that_moves_are_not_mixed(tmp_path):
    said = [transform("root", "j2s7s300_link_base")]
    for k in range(5):
        when = 0.05 * k
        said += [transform("root", OPTICAL, (0.02 * k, 0, 0.5), seconds=when, topic="/tf")]
        said += [camera_info(DEPTH_INFO, when), depth_image(np.full((HEIGHT, WIDTH), 0.5), when)]
    frame = read_recording(write_bag(tmp_path / "hand.bag", said)).frame
    assert frame.looks == 1
