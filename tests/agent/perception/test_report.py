"""What was found: the table, the JSON and the picture say the same."""

import io
import json
from dataclasses import replace

import numpy as np
import pytest
from scipy import ndimage

from agent.perception.overlay import labelled_picture
from agent.perception.report import objects_json, print_objects
from agent.perception.segmentation import segment
from agent.recordings.recording import DepthFrame
from structdiffusion.objects.procedural import procedural_object


@pytest.fixture(scope="module")
def two(record):
    return record([(procedural_object("can", 37), 0.4, 0.2, 0.0), (procedural_object("mug", 37), 0.5, -0.2, 0.0)])


@pytest.fixture(scope="module")
def found(two):
    return segment(two.recording)


def test_every_object_has_a_line(found):
    output = io.StringIO()
    print_objects(found, output)
    lines = output.getvalue().splitlines()
    assert [line.startswith(one.display_name) for line, one in zip(lines[1:3], found.objects, strict=True)] == [
        True,
        True,
    ]
    assert len({len(line) for line in lines[:3]}) == 1
    assert lines[3].startswith("2 objects on a table that was seen from x 0.1")


def test_json_holds_what_was_found(found):
    output = json.loads(json.dumps(objects_json(found)))
    assert [one["called"] for one in output["objects"]] == [one.display_name for one in found.objects]
    for one, other in zip(output["objects"], found.objects, strict=True):
        np.testing.assert_allclose((one["x"], one["y"]), other.world_from_box[:2, 3], atol=1e-3)
        np.testing.assert_allclose(one["world_from_box"], other.world_from_box, atol=1e-6)
        assert one["points"] == len(other.points)
    np.testing.assert_allclose(output["world_from_camera"], found.world_from_camera, atol=1e-6)


@pytest.mark.parametrize(
    ("seen", "said"), [(True, "object 2 rests on object 1"), (False, "object 2 seems to rest on object 1")]
)
def test_what_carries_an_object_is_asserted_where_it_was_seen(found, seen, said):
    first, second = found.objects
    stacked = replace(found, objects=(first, replace(second, rests_on=first.name, support_seen=seen)))
    output = io.StringIO()
    print_objects(stacked, output)
    assert said in output.getvalue().splitlines()
    assert [one["support_seen"] for one in objects_json(stacked)["objects"]] == [None, seen]


def test_the_picture_marks_the_objects_and_nothing_else(two, found):
    picture = labelled_picture(two.recording, found)
    before = two.recording.frame.color.astype(int)
    changed = np.abs(picture.astype(int) - before).sum(axis=2) > 30
    assert picture.shape == before.shape and picture.dtype == np.uint8
    beside = changed & (found.labels == 0)
    for number, one in enumerate(found.objects, start=1):
        mask = found.labels == number
        rim, inside = mask & ~ndimage.binary_erosion(mask), ndimage.binary_erosion(mask, iterations=3)
        assert changed[rim].mean() > 0.95
        # Beside it, only the patch of its number may lie, which keeps the object's own colour.
        inner = ndimage.distance_transform_edt(mask)
        row, column = np.unravel_index(inner.argmax(), inner.shape)
        beside[row - 16 : row + 17, column - 16 : column + 17] = False
        badge = picture[row - 9 : row + 10, column - 7 : column + 8].reshape(-1, 3).astype(int)
        assert (np.abs(badge - one.colors.mean(axis=0)).max(axis=1) < 2).sum() > 60
        # Inside it keeps its own colour: nothing is painted in another one.
        own = one.colors.mean(axis=0)
        assert np.abs(np.median(picture[inside], axis=0) - own).max() < 40
    assert not beside.any()


def test_depth_alone_and_loose_points_have_pictures_too(two, found):
    frame = two.recording.frame
    depth = labelled_picture(replace(two.recording, frame=DepthFrame(frame.points)), found)
    assert depth.shape == (480, 640, 3)
    there = np.isfinite(frame.points[..., 2])
    loose = replace(two.recording, frame=DepthFrame(frame.points[there][None], frame.color[there][None]))
    above = labelled_picture(loose, replace(found, labels=found.labels[there][None]))
    # x is up, y to the left: the can, nearer and to the left, is lower and to the left of the mug.
    assert above.ndim == 3 and above.std() > 10 and max(above.shape[:2]) >= 320
