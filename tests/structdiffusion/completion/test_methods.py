"""Bodies guessed from partial views come near the true ones, stay where the camera did not see, and stand any input."""

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.spatial import cKDTree

from structdiffusion.completion.estimate import estimate
from structdiffusion.completion.methods import METHODS, complete
from structdiffusion.geometry import pose_from_xyz_yaw, transform_points
from structdiffusion.objects.decomposition import signed_distance
from structdiffusion.objects.everyday import everyday_objects
from structdiffusion.objects.model import ObjectModel
from structdiffusion.objects.procedural import procedural_objects
from structdiffusion.objects.solids import assemble
from structdiffusion.observation import ObjectCloud
from structdiffusion.simulation.depth_camera import DepthCamera
from structdiffusion.simulation.world import TabletopWorld
from tests.counting import counted_calls

MOST_CALLS = 300_000


@cache
def library() -> list[ObjectModel]:
    return procedural_objects(85)  # five of each noun


@cache
def looks(noun: str, count: int = 2) -> tuple:
    """(model, world_from_object, what the camera saw, world_from_camera) of a few objects."""
    rng = np.random.default_rng(0)
    models = [model for model in library() if model.category == noun][:count]
    return tuple((model, *look(model, rng)) for model in models)


def look(model: ObjectModel, rng: np.random.Generator) -> tuple[np.ndarray, ObjectCloud, np.ndarray]:
    pose = pose_from_xyz_yaw(rng.uniform(0.35, 0.6), rng.uniform(-0.25, 0.25), 0.0, rng.uniform(-3.0, 3.0))
    with TabletopWorld([model], [pose]) as world:
        scene = world.observe(rng)
    return pose, scene.objects[0], scene.world_from_camera


def overlap(parts, model: ObjectModel, pose: np.ndarray) -> float:
    """The intersection of two volumes over their union."""
    true = tuple(transform_points(pose, hull) for hull in model.hulls)
    corners = np.concatenate((*parts, *true))
    probes = np.random.default_rng(0).uniform(corners.min(axis=0), corners.max(axis=0), (6000, 3))
    guessed, there = signed_distance(probes, parts) <= 0, signed_distance(probes, true) <= 0
    return (guessed & there).sum() / (guessed | there).sum()


@pytest.mark.parametrize(
    ("noun", "least"),
    [("can", 0.9), ("box", 0.9), ("knife", 0.6), ("bottle", 0.7), ("plate", 0.6), ("cup", 0.5)],
)
def test_the_body_comes_near_the_true_one(noun, least):
    for model, pose, cloud, camera in looks(noun):
        assert overlap(complete(cloud, camera).parts, model, pose) > least


def test_fruit_is_as_round_below_as_above_and_dice_are_no_balls():
    rng = np.random.default_rng(0)
    for model in everyday_objects(3):
        if model.category not in ("apple", "pear", "lemon", "dice"):
            continue
        _, cloud, camera = look(model, rng)
        points = np.concatenate(complete(cloud, camera).parts)
        low = points[points[:, 2] < points[:, 2].min() + 0.1 * model.height, :2]
        breadth = np.ptp(low, axis=0) / np.ptp(points[:, :2], axis=0)
        if model.category == "dice":
            assert breadth.min() > 0.9, model.name
        elif estimate(cloud).rounded:
            assert breadth.max() < 0.85, model.name


@pytest.mark.parametrize("noun", ["bottle", "bowl", "mug", "pitcher"])
def test_symmetry_beats_what_merely_goes_down_to_the_table(noun):
    for model, pose, cloud, camera in looks(noun):
        by = {method: overlap(complete(cloud, camera, method).parts, model, pose) for method in METHODS}
        assert by["symmetry"] > by["extrude"] and by["symmetry"] > by["hull"]


@pytest.mark.parametrize("noun", ["bowl", "cup", "mug", "can", "box"])
def test_what_was_seen_into_stays_hollow(noun):
    hollow = noun in ("bowl", "cup", "mug")
    for _, pose, cloud, camera in looks(noun):
        shape = complete(cloud, camera)
        assert shape.hollow is hollow
        rim = max(part[:, 2].max() for part in shape.parts)
        points = np.concatenate(shape.parts)
        middle = 0.5 * (points.min(axis=0) + points.max(axis=0)) if noun != "mug" else pose[:3, 3]
        inside = np.array([[*middle[:2], rim - 0.012]])
        assert bool(signed_distance(inside, shape.parts)[0] > 0) is hollow


def test_boxes_and_cutlery_are_not_round():
    for noun in ("box", "block", "book", "fork", "spoon"):
        assert all(complete(cloud, camera).symmetry not in ("turned", "ball") for _, _, cloud, camera in looks(noun))


def test_a_ball_is_a_ball():
    turn = np.arange(200) * np.pi * (1 + np.sqrt(5))
    z = np.linspace(-1, 1, 200)
    ball = 0.035 * np.stack((np.sqrt(1 - z**2) * np.cos(turn), np.sqrt(1 - z**2) * np.sin(turn), z), axis=1)
    rng = np.random.default_rng(1)
    model = assemble("ball", "ball", [ball], density=400, friction=0.5, color=(1, 1, 1), source="made", rng=rng)
    pose, cloud, camera = look(model, rng)
    shape = complete(cloud, camera)
    assert shape.symmetry == "ball" and overlap(shape.parts, model, pose) > 0.85


@pytest.mark.parametrize("method", METHODS)
def test_every_method_stands_on_the_support(method):
    for noun in ("mug", "fork", "box"):
        _, _, cloud, camera = looks(noun)[0]
        raised = replace(cloud, points=cloud.points + np.float32([0, 0, 0.1]), bottom=0.1)
        camera = camera.copy()
        camera[2, 3] += 0.1
        parts = complete(raised, camera, method).parts
        assert min(part[:, 2].min() for part in parts) == pytest.approx(0.1, abs=1e-6)


def test_the_far_side_of_what_is_not_round_is_guessed_behind_what_was_seen():
    flat = [each for each in library() if np.ptp(each.footprint[:, 1]) < 0.8 * np.ptp(each.footprint[:, 0])]
    bottle = next(each for each in flat if each.category == "bottle")
    pose, cloud, camera = look(bottle, np.random.default_rng(2))
    shape = complete(cloud, camera)
    assert shape.symmetry in ("half turn", "mirror")
    assert overlap(shape.parts, bottle, pose) > overlap(complete(cloud, camera, "columns").parts, bottle, pose)


def test_nothing_is_guessed_beyond_what_the_camera_looked_past():
    for noun in ("bottle", "pitcher", "pan"):
        for _, _, cloud, camera in looks(noun):
            beside = DepthCamera().pixels(np.concatenate(complete(cloud, camera).parts))
            seen = DepthCamera().pixels(cloud.points.astype(np.float64))
            assert np.quantile(cKDTree(seen).query(beside)[0], 0.95) < 12  # pixels


@pytest.mark.parametrize("count", [1, 2, 3, 5, 30, 20_000])
def test_any_number_of_points_will_do(count):
    _, _, cloud, camera = looks("mug")[0]
    rng = np.random.default_rng(3)
    chosen = rng.choice(len(cloud.points), count, replace=count > len(cloud.points))
    points = cloud.points[chosen] + rng.normal(0, 0.001, (count, 3)).astype(np.float32)
    for method in METHODS:
        with counted_calls() as steps:
            shape = complete(replace(cloud, points=points), camera, method)
        assert steps.count < MOST_CALLS  # whatever the number of points
        assert shape.parts and all(np.isfinite(part).all() and len(part) >= 4 for part in shape.parts)
        assert np.ptp(np.concatenate(shape.parts), axis=0).max() < 0.3


def test_strays_and_gaps_in_the_numbers_do_no_harm():
    model, pose, cloud, camera = looks("can")[0]
    rng = np.random.default_rng(4)
    strays = (pose[:3, 3] + rng.uniform(-0.3, 0.3, (15, 3)) * [1, 1, 0.5] + [0, 0, 0.2]).astype(np.float32)
    gaps = np.full((40, 3), np.nan, dtype=np.float32)
    dirty = replace(cloud, points=np.concatenate((cloud.points, strays, gaps)), colors=None)
    assert overlap(complete(dirty, camera).parts, model, pose) > 0.85


def test_noise_of_a_cheap_camera_is_borne():
    for noun, least in (("can", 0.85), ("box", 0.85), ("bowl", 0.3)):
        model, pose, cloud, camera = looks(noun)[0]
        rays = cloud.points - camera[:3, 3]
        noise = np.random.default_rng(5).normal(0, 0.003, (len(rays), 1))
        points = cloud.points + noise * rays / np.linalg.norm(rays, axis=1, keepdims=True)
        assert overlap(complete(replace(cloud, points=points.astype(np.float32)), camera).parts, model, pose) > least


def test_without_a_camera_nothing_is_mirrored():
    _, _, cloud, _ = looks("bottle")[0]
    shape = complete(cloud, None)
    assert shape.symmetry == "" and not shape.hollow and shape.parts


@pytest.mark.parametrize("height", [0.003, 0.0045, 0.006, 0.05, 0.1])
def test_a_vessel_into_which_hardly_anything_was_seen_is_a_body_still(height):
    """A rim and the near wall alone, as of a dark or shiny mug; or a rimmed disc as low as a coaster."""
    rng, angles = np.random.default_rng(1), np.linspace(-math.pi, math.pi, 300)
    rim = np.column_stack((0.035 * np.cos(angles), 0.035 * np.sin(angles), np.full(300, height)))
    near = angles[np.abs(angles) > 2.2]
    wall = np.column_stack((0.035 * np.cos(near), 0.035 * np.sin(near), rng.uniform(0.0, height, len(near))))
    floor = rng.uniform(-0.01, 0.01, (12 if height < 0.01 else 0, 3)) * [1, 1, 0] + [0.0, 0.0, 0.0004]
    camera = looks("can")[0][3]
    points = (
        np.concatenate((rim, wall, floor))
        + [0.45, 0.0, 0.0]
        + rng.normal(0, 3e-4, (len(rim) + len(wall) + len(floor), 3))
    )
    shape = complete(ObjectCloud("mug", "mug", points.astype(np.float32)), camera)
    corners = np.concatenate(shape.parts)
    assert np.isfinite(corners).all() and corners[:, 2].max() == pytest.approx(height, abs=0.003)
    assert np.ptp(corners[:, :2], axis=0) == pytest.approx([0.07, 0.07], abs=0.012)


def test_bad_input_is_named():
    _, _, cloud, camera = looks("can")[0]
    with pytest.raises(ValueError, match="'guess'; legal: hull, "):
        complete(cloud, camera, "guess")
    with pytest.raises(ValueError, match="no point was seen of the can"):
        complete(replace(cloud, points=np.full((5, 3), np.nan)), camera)
