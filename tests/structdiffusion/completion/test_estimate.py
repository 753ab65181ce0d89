import math

import numpy as np
import pytest
import torch

from structdiffusion.completion.estimate import estimate, imagined_bodies
from structdiffusion.footprints import turned
from structdiffusion.geometry import pose_from_xyz_yaw, transform_points, wrap_angle
from structdiffusion.objects.everyday import everyday_objects
from structdiffusion.objects.model import footprint_centroid
from structdiffusion.objects.solids import assemble, box
from structdiffusion.observation import ObjectCloud
from structdiffusion.simulation.partial_views import partial_views


def seen(model, x=0.45, y=0.1, yaw=0.0, points=512, seed=0) -> ObjectCloud:
    """What the camera sees of a model that stands alone."""
    pose = pose_from_xyz_yaw(x, y, 0.0, yaw)
    surface = torch.from_numpy(transform_points(pose, model.surface_points)).float()[None, None]
    normals = torch.from_numpy(model.surface_normals @ pose[:3, :3].T).float()[None, None]
    there = torch.ones(1, 1, dtype=torch.bool)
    cloud, _ = partial_views(surface, normals, there, points, torch.Generator().manual_seed(seed))
    return ObjectCloud(model.name, model.category, cloud[0, 0].numpy())


def test_outline_and_height_are_those_of_the_model_to_a_centimetre(library):
    for number, model in enumerate(library):
        if model.category in ("bottle", "pitcher", "candle"):  # narrow tops; what the handle hides
            continue
        yaw = 0.7 * number
        found = estimate(seen(model, yaw=yaw, seed=number))
        assert found.height == pytest.approx(model.height, abs=0.012), model.name
        true = turned(model.footprint, yaw) + (0.45, 0.1)
        for corner in np.linspace(0, 2 * math.pi, 8, endpoint=False):
            direction = np.array([math.cos(corner), math.sin(corner)])
            reach = (found.outline @ direction).max() - (true @ direction).max()
            # Toward the camera everything is seen; the far side of tall things is not.
            assert -0.03 < reach < 0.012, model.name


def test_what_can_carry_and_what_is_hollow(library):
    hollow = {"bowl": 0, "cup": 0}
    for number, model in enumerate(library):
        found = estimate(seen(model, seed=number))
        if model.category in ("box", "block", "book", "can"):
            assert found.stackable and not found.hollow, model.name
        if model.category == "bottle":
            assert not found.stackable, model.name
        if model.category in hollow:
            hollow[model.category] += found.hollow
    assert all(count >= 2 for count in hollow.values()), hollow


def test_fruit_is_rounded_and_carries_nothing(library):
    fruit = [model for model in everyday_objects() if model.category in ("apple", "pear", "ball")]
    found = [estimate(seen(model, seed=number)) for number, model in enumerate(fruit)]
    assert sum(one.rounded for one in found) >= 0.9 * len(found)
    assert not any(one.stackable for one in found if one.rounded)
    level = [model for model in (*library, *everyday_objects()) if model.category in ("box", "can", "dice", "brick")]
    assert not any(estimate(seen(model, seed=number)).rounded for number, model in enumerate(level))


def test_nothing_stands_on_a_thick_ridge():
    """A cylinder of 18 mm that lies, as broad as a banana, and a box of the same size."""
    angles = np.arange(32) * 2 * math.pi / 32
    ends = [
        np.column_stack((np.full(32, x), 0.018 * np.cos(angles), 0.018 * (1 + np.sin(angles)))) for x in (-0.08, 0.08)
    ]
    shapes = {"roll": np.concatenate(ends), "box": box(0.16, 0.036, 0.0, 0.036)}
    for name, hull in shapes.items():
        model = assemble(
            name, name, [hull], density=500.0, friction=0.5, color=(0.5, 0.5, 0.5), source="procedural",
            rng=np.random.default_rng(0),
        )  # fmt: skip
        found = estimate(seen(model, yaw=0.4))
        assert found.stackable is (name == "box") and found.rounded is (name == "roll")


def test_cutlery_fronts_are_found_by_their_broad_end(library):
    errors = []
    for number, model in enumerate(library):
        if model.category in ("fork", "spoon"):
            errors += [
                abs(wrap_angle(estimate(seen(model, yaw=yaw, seed=number)).front_yaw - yaw)) for yaw in (-2.5, 0.3, 1.9)
            ]
    assert np.mean(np.array(errors) < math.radians(10)) >= 0.8, np.degrees(errors)


def test_the_planner_sees_the_outline_about_its_centroid(library):
    found = estimate(seen(library[0], 0.4, -0.2))
    item = found.layout_item()
    np.testing.assert_allclose(footprint_centroid(item.footprint), 0.0, atol=1e-12)
    np.testing.assert_allclose(item.footprint + footprint_centroid(found.outline), found.outline)
    motion = pose_from_xyz_yaw(0.3, 0.1, 0.0, 1.2)
    np.testing.assert_allclose(
        found.outline_after(motion),
        transform_points(motion, np.column_stack((found.outline, np.zeros(len(found.outline)))))[:, :2],
    )


@pytest.mark.parametrize("points", [2, 3, 50])
def test_poor_clouds_still_have_an_outline(points):
    line = np.column_stack((np.linspace(0.4, 0.5, points), np.zeros(points), np.full(points, 0.02))).astype(np.float32)
    found = estimate(ObjectCloud("speck", "object", line))
    assert found.outline.shape[0] >= 3 and np.isfinite(found.outline).all()
    assert not found.stackable and np.isfinite(found.front_yaw)


def test_of_two_things_below_the_one_that_reaches_higher_carries():
    """A low box that stands on a sheet, beside a tall one on the table: what lies over both lies on the tall one."""

    def slab(name, *size):
        return estimate(seen(assemble(name, name, [box(*size[:2], 0.0, size[2])], density=600.0, friction=0.5,
                                      color=(1, 1, 1), source="procedural", rng=np.random.default_rng(0))))  # fmt: skip

    things = [slab("low", 0.05, 0.05, 0.02), slab("tall", 0.05, 0.05, 0.09), slab("lid", 0.14, 0.05, 0.02)]
    motions = np.stack([pose_from_xyz_yaw(x, 0.0, z, 0.0) for x, z in ((-0.03, 0.013), (0.03, 0.0), (0.0, 0.092))])
    assert imagined_bodies(things, motions)[2].rests_on == (1,)


def test_imagined_bodies_rest_on_the_highest_thing_below(library):
    books = [model for model in library if model.category == "book"]
    blocks = [estimate(seen(model, y=y)) for model, y in zip(books, (-0.3, 0.0, 0.3))]
    motions = np.array([np.eye(4)] * 3)
    flat = imagined_bodies(blocks, motions)
    assert [body.rests_on for body in flat] == [(), (), ()]
    for i, thing in enumerate(blocks):  # all in one place, one above the other
        motions[i, :2, 3] = -thing.mean[:2] + (0.45, 0.0)
        motions[i, 2, 3] = sum(below.height for below in blocks[:i]) + 0.002 * i
    stacked = imagined_bodies(blocks, motions)
    assert [body.rests_on for body in stacked] == [(), (0,), (1,)]
    assert stacked[2].z_bottom == pytest.approx(motions[2, 2, 3])
    assert stacked[2].z_top == pytest.approx(motions[2, 2, 3] + blocks[2].height)
    motions[2, 1, 3] += 0.4  # in the air, above nothing
    assert imagined_bodies(blocks, motions)[2].rests_on == ()
