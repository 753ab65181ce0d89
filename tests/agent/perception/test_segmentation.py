"""Simulated recordings, of which the truth is known: what is found, where, and how exactly."""

import math
import re
import subprocess
import sys
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from agent.arm.arm_model import WORLD_FROM_BASE
from agent.errors import BadInput
from agent.evaluation.segmentation.synthetic_tables import synthetic_table
from agent.perception.segmentation import segment
from agent.perception.segments import ARM, TABLE
from agent.recordings.recording import DepthFrame, Recording
from grounding.resolve.goal import resolve_phrase
from grounding.resolve.referents import Referents
from structdiffusion.geometry import pose_from_xyz_yaw, transform_points
from structdiffusion.objects.procedural import procedural_object
from structdiffusion.objects.solids import assemble, box, frustum
from tests.counting import counted_calls

MOST_CALLS = 20_000

RED, BLUE = (0.75, 0.1, 0.1), (0.1, 0.2, 0.7)


def made(color, *parts):
    return assemble(
        "it", "it", parts, density=400, friction=0.6, color=color, source="procedural", rng=np.random.default_rng(0)
    )


def block(length, width, height, color=RED):
    return made(color, box(length, width, 0.0, height))


def can(radius, height, color=RED):
    return made(color, frustum(radius, radius, 0.0, height))


def overlaps(labels, truth):
    """Of each true object, the best intersection over union with a found one."""
    found = [labels == number for number in range(1, labels.max() + 1)]
    true = [truth == number for number in range(1, truth.max() + 1)]
    return [max((one & own).sum() / (one | own).sum() for own in found) for one in true]


@pytest.fixture(scope="module")
def mixed(record):
    """A mug, a bowl, a fork of 1 cm, a tall can and a small block, from left to right."""
    return record(
        [
            (procedural_object("mug", 37), 0.45, 0.33, 0.8),
            (procedural_object("bowl", 37), 0.55, 0.12, 0.0),
            (procedural_object("fork", 37), 0.35, -0.02, 0.4),
            (can(0.03, 0.15), 0.5, -0.16, 0.0),
            (block(0.04, 0.04, 0.04, BLUE), 0.4, -0.33, 0.3),
        ]
    )


@pytest.fixture(scope="module")
def found(mixed):
    return segment(mixed.recording)


def test_every_object_is_found_once_and_numbered_from_left_to_right(mixed, found):
    assert [one.name for one in found.objects] == [f"object {k}" for k in range(1, 6)]
    assert min(overlaps(found.labels, mixed.truth)) > 0.85
    assert all(one.world_from_box[1, 3] > other.world_from_box[1, 3] for one, other in pairwise(found.objects))


def test_where_things_are_comes_from_tf_and_the_table(mixed, found):
    np.testing.assert_allclose(found.world_from_camera, mixed.world_from_camera, atol=0.004)
    np.testing.assert_allclose(found.world_from_base, WORLD_FROM_BASE, atol=0.004)
    tall, small = found.objects[3:]
    np.testing.assert_allclose(tall.world_from_box[:2, 3], (0.5, -0.16), atol=0.012)
    assert tall.sides[2] == pytest.approx(0.15, abs=0.006)
    np.testing.assert_allclose(small.sides, 0.04, atol=0.012)
    assert found.notes == ()


def test_the_table_is_as_large_as_what_was_seen_of_it(found):
    np.testing.assert_allclose(
        (found.surface.x_min, found.surface.x_max, found.surface.y_min, found.surface.y_max),
        (0.18, 0.72, -0.45, 0.45),
        atol=0.02,
    )
    assert found.table.x_min >= 0.18 and found.table.y_max <= 0.45
    assert (found.labels == TABLE).mean() > 0.3


def test_a_name_says_what_distinguishes_an_object(found):
    names = [one.display_name for one in found.objects]
    assert "red" in names[3] and "tall" in names[3]
    assert "blue" in names[4] and "tall" not in names[4]
    assert resolve_phrase("the red tall object", Referents(names)).indices == (3,)
    assert resolve_phrase("object 5", Referents(names)).indices == (4,)


def test_the_arm_is_no_object(mixed, found):
    assert (found.labels == ARM).sum() > 1000
    assert not (mixed.truth[found.labels == ARM] > 0).any()
    without = segment(replace(mixed.recording, arm=None))
    assert not (without.labels == ARM).any()


def test_an_unorganised_cloud_without_colour_shows_the_same_objects(mixed, found):
    points = mixed.recording.frame.points.reshape(-1, 3)
    there = np.random.default_rng(0).permutation(np.flatnonzero(np.isfinite(points).all(axis=1)))[:120_000]
    seen = segment(replace(mixed.recording, frame=DepthFrame(points[there][None])))
    assert len(seen.objects) == 5
    assert min(overlaps(seen.labels[0], mixed.truth.ravel()[there])) > 0.6
    for one, other in zip(seen.objects, found.objects, strict=True):
        np.testing.assert_allclose(one.world_from_box[:2, 3], other.world_from_box[:2, 3], atol=0.015)
        assert one.colors is None and "red" not in one.display_name


def test_without_any_pose_the_objects_lie_where_the_arm_reaches(mixed, found):
    seen = segment(replace(mixed.recording, base_from_camera=None, arm=None))
    places = np.array([one.world_from_box[:2, 3] for one in seen.objects])
    assert len(places) == 5 and "the camera's pose is unknown" in seen.notes[0]
    np.testing.assert_allclose((places.min(axis=0) + places.max(axis=0)) / 2, (0.45, 0.0), atol=0.02)
    known = np.array([one.world_from_box[:2, 3] for one in found.objects])
    np.testing.assert_allclose(places - places.mean(axis=0), known - known.mean(axis=0), atol=0.02)
    np.testing.assert_array_equal(seen.world_from_base, WORLD_FROM_BASE)


def test_a_pose_given_by_hand_is_corrected_by_the_table(mixed, found):
    wrong = pose_from_xyz_yaw(0.0, 0.0, 0.03, 0.0) @ mixed.world_from_camera
    seen = segment(replace(mixed.recording, world_from_camera=wrong, base_from_camera=None, arm=None))
    np.testing.assert_allclose(seen.world_from_camera, mixed.world_from_camera, atol=0.004)
    assert float(re.search(r"([-+]\d+) mm of height", seen.notes[0])[1]) == pytest.approx(-30, abs=2)


@pytest.mark.parametrize("quarter", range(4))
def test_x_is_the_way_from_the_base_to_the_objects(mixed, quarter):
    turned = pose_from_xyz_yaw(0.0, 0.0, -0.2, quarter * math.pi / 2) @ mixed.recording.base_from_camera
    seen = segment(replace(mixed.recording, base_from_camera=turned, arm=None))
    np.testing.assert_allclose(seen.world_from_camera, mixed.world_from_camera, atol=0.004)
    # The base stands 20 cm above the table, turned so that base and world agree about the camera.
    np.testing.assert_allclose(seen.world_from_base @ turned, mixed.world_from_camera, atol=0.004)
    assert seen.world_from_base[2, 3] == pytest.approx(0.2, abs=0.004)


def test_tf_that_disagrees_with_the_table_is_reported(mixed):
    tilt = np.eye(4)
    tilt[1:3, 1:3] = (math.cos(0.15), -math.sin(0.15)), (math.sin(0.15), math.cos(0.15))
    base_from_camera = mixed.recording.base_from_camera.copy()
    base_from_camera[:3, :3] = tilt[:3, :3] @ base_from_camera[:3, :3]
    seen = segment(replace(mixed.recording, base_from_camera=base_from_camera, arm=None))
    assert "tf and the table disagree: the table leans by 8.6 degrees" in " ".join(seen.notes)
    np.testing.assert_allclose(seen.world_from_base[:3, 2], (0, 0, 1), atol=1e-9)


def test_things_that_touch_are_several(record):
    touching = record(
        [
            (block(0.09, 0.06, 0.12), 0.45, 0.2, 0.5),
            (block(0.09, 0.06, 0.07), 0.385, 0.185, 0.5 + math.pi / 2),
            (can(0.035, 0.1), 0.45, -0.2, 0.0),
            (can(0.035, 0.1), 0.45, -0.27, 0.0),
        ]
    )
    seen = segment(touching.recording)
    assert len(seen.objects) == 4
    assert min(overlaps(seen.labels, touching.truth)) > 0.75


def test_a_stack_is_several_and_its_parts_are_whole(record):
    stacked = record(
        [
            (block(0.12, 0.1, 0.06), 0.42, 0.2, 0.3),
            (block(0.06, 0.05, 0.08, BLUE), 0.42, 0.2, 0.5, 0.06),
            (can(0.05, 0.07), 0.45, -0.2, 0.0),
            (can(0.03, 0.06, BLUE), 0.455, -0.2, 0.0, 0.07),
        ]
    )
    seen = segment(stacked.recording)
    assert len(seen.objects) == 4
    assert min(overlaps(seen.labels, stacked.truth)) > 0.75


def test_a_mug_is_one_with_its_inside_and_its_handle(record):
    mugs = record([(procedural_object("mug", number), 0.5, 0.3 - 0.2 * number, 0.9 * number) for number in range(4)])
    seen = segment(mugs.recording)
    assert len(seen.objects) == 4
    assert min(overlaps(seen.labels, mugs.truth)) > 0.85


def test_what_another_object_cuts_in_two_is_one(record):
    hidden = record([(block(0.03, 0.2, 0.08), 0.6, 0.0, 0.0), (can(0.025, 0.2, BLUE), 0.47, 0.0, 0.0)])
    seen = segment(hidden.recording)
    assert len(seen.objects) == 2
    assert min(overlaps(seen.labels, hidden.truth)) > 0.8


@pytest.mark.parametrize("number", [1, 3])
def test_a_table_seen_across_a_corner_is_told_from_the_floor_and_the_wall(number):
    cloud = synthetic_table("apart", "development", 0, number)
    seen = segment(Recording(Path("corner.bag"), DepthFrame(cloud.points, cloud.color)))
    assert min(overlaps(seen.labels, cloud.labels)) > 0.75


def test_cutlery_of_half_a_centimetre_is_not_lost(record):
    flat = record([(block(0.18, 0.018, 0.005, (0.6, 0.6, 0.62)), 0.45, 0.1 - 0.1 * k, 0.2 * k) for k in range(3)])
    seen = segment(flat.recording)
    assert len(seen.objects) == 3
    assert min(overlaps(seen.labels, flat.truth)) > 0.7
    assert all(one.sides[0] == pytest.approx(0.18, abs=0.015) for one in seen.objects)


def test_an_empty_table_has_no_objects(record):
    seen = segment(record([]).recording)
    assert seen.objects == () and seen.labels.max() == TABLE


def test_a_plane_without_any_noise_is_an_empty_table():
    rows, columns = np.mgrid[:120, :160]
    points = np.stack(((columns - 79.5) / 130, (rows - 59.5) / 130, np.ones(rows.shape)), axis=-1)
    assert not segment(Recording(Path("flat.bag"), DepthFrame(points.astype(np.float32)))).objects


def test_nothing_measured_is_reported():
    with pytest.raises(BadInput, match="of 307200 points 0 were measured"):
        segment(Recording(Path("empty.bag"), DepthFrame(np.full((480, 640, 3), np.nan, np.float32))))


def test_a_wall_is_no_table(mixed):
    rows, columns = np.mgrid[:240, :320]
    wall = np.stack(((columns - 160) / 250, (rows - 120) / 250, np.ones(rows.shape)), axis=-1)
    wall += np.random.default_rng(0).normal(0, 0.001, wall.shape)
    known = Recording(Path("wall.bag"), DepthFrame(wall.astype(np.float32)), base_from_camera=upright_camera())
    with pytest.raises(BadInput, match=r"no plane .* lies level .* 90 degrees from up"):
        segment(known)


def test_a_ball_of_points_is_no_table():
    scattered = np.random.default_rng(0).normal((0, 0, 1.0), 0.25, (1, 4000, 3)).astype(np.float32)
    with pytest.raises(BadInput, match="no table to see"):
        segment(Recording(Path("noise.ply"), DepthFrame(scattered)))


def upright_camera():
    """base_from_camera of a camera that looks level."""
    pose = np.eye(4)
    pose[:3, :3] = np.array(((1, 0, 0), (0, 0, 1), (0, -1, 0)))
    pose[:3, 3] = 0.0, 0.0, 0.5
    return pose


def test_nothing_but_noise_is_refused_after_a_few_steps():
    points = np.random.default_rng(0).uniform(-1.0, 1.0, (480, 640, 3)).astype(np.float32) + (0.0, 0.0, 1.5)
    with counted_calls() as steps, pytest.raises(BadInput, match="there is no table to see"):
        segment(Recording(Path("noise.bag"), DepthFrame(points.astype(np.float32))))
    assert steps.count < MOST_CALLS


def test_points_of_a_segment_are_its_pixels(mixed, found):
    world = transform_points(found.world_from_camera, mixed.recording.frame.points.astype(np.float64))
    for number, one in enumerate(found.objects, start=1):
        own = found.labels == number
        assert own.sum() == len(one.points) == len(one.colors)
        np.testing.assert_allclose(world[own][:, :2], one.points[:, :2], atol=0.001)


def test_geometry_alone_loads_no_network():
    """The few numbers that merge pieces are no network of pictures; they are read when they are needed."""
    program = (
        "import sys, agent.perception.segmentation as _; "
        "print(*(name for name in sys.modules if 'segmentation_network' in name or 'network_masks' in name))"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == ""
