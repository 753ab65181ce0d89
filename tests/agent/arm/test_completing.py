"""The far side of what the camera sees is guessed where the object hides it, and nowhere else."""

import numpy as np
import pytest
import shapely

from agent.arm.completing import completed, completed_clouds
from structdiffusion.geometry import pose_from_xyz_yaw, transform_points
from structdiffusion.objects.libraries import load_objects
from structdiffusion.observation import ObjectCloud, Scene
from structdiffusion.tabletop import TabletopWorld


def outline(points: np.ndarray) -> shapely.Polygon:
    return shapely.MultiPoint(points[:, :2]).convex_hull


def looks_of(noun: str, count: int):
    """(seen points, camera, true outline) of objects of a noun, as the depth camera sees them."""
    rng = np.random.default_rng(0)
    for model in [model for model in load_objects("validation") if model.category == noun][:count]:
        pose = pose_from_xyz_yaw(rng.uniform(0.35, 0.6), rng.uniform(-0.25, 0.25), 0.0, rng.uniform(-3.0, 3.0))
        with TabletopWorld([model], [pose]) as world:
            scene = world.observe(rng)
        yield scene, outline(transform_points(pose, np.concatenate(model.hulls)))


@pytest.mark.parametrize(("noun", "hidden", "left"), [("bottle", 0.10, 0.04), ("jar", 0.02, 0.02)])
def test_what_a_tall_thing_hides_is_found(noun, hidden, left):
    before, after = [], []
    for scene, true in looks_of(noun, 5):
        seen = scene.objects[0].points
        (whole,) = completed_clouds(scene.objects, scene)
        assert np.array_equal(whole[: len(seen)], seen)
        before.append(true.difference(outline(seen)).area / true.area)
        after.append(true.difference(outline(whole)).area / true.area)
    assert np.mean(before) > hidden and np.mean(after) < left


@pytest.mark.parametrize("noun", ["fork", "knife", "plate"])
def test_flat_things_are_left_as_they_are(noun):
    for scene, _ in looks_of(noun, 2):
        (whole,) = completed_clouds(scene.objects, scene)
        assert len(whole) == len(scene.objects[0].points)


def test_nothing_is_guessed_where_the_camera_would_have_seen_it():
    # A wall across the view with a post on its left end: the post's axis would put a second wing into the open.
    rng = np.random.default_rng(0)
    wall = np.column_stack((np.full(600, 0.5), rng.uniform(0.0, 0.2, 600), rng.uniform(0.0, 0.08, 600)))
    post = np.column_stack((np.full(100, 0.5), rng.uniform(0.0, 0.01, 100), rng.uniform(0.0, 0.12, 100)))
    whole = completed(np.concatenate((wall, post)), np.array([0.0, 0.1, 1.0]))
    assert whole[:, 1].min() > -0.02


def test_without_a_camera_nothing_is_guessed():
    points = np.random.default_rng(0).uniform(0.0, 0.1, (50, 3)).astype(np.float32)
    (whole,) = completed_clouds([ObjectCloud("thing", "thing", points)], Scene(()))
    assert np.array_equal(whole, points)
