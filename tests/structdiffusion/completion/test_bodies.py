"""The twin's bodies rest where the objects stood, and neighbours are not in each other."""

from dataclasses import replace

import numpy as np
import pytest

from grounding.spec import StructureSpec
from structdiffusion.completion.bodies import DENSITY, bodies_of, bodies_of_scene, body_of, separated
from structdiffusion.completion.methods import CompletedShape, complete
from structdiffusion.geometry import pose_from_xyz_yaw
from structdiffusion.objects.model import footprint_centroid
from structdiffusion.objects.procedural import procedural_objects
from structdiffusion.objects.rigid_body import mass_properties
from structdiffusion.objects.solids import box
from structdiffusion.observation import ObjectCloud
from structdiffusion.protocol.physical_stability import place_and_check
from structdiffusion.protocol.release import TabletopBodies
from structdiffusion.simulation.world import TabletopWorld

NOUNS = ("mug", "box", "bottle", "plate", "fork", "bowl")


@pytest.fixture(scope="module")
def seen():
    """A table with one thing of each noun: the scene, and the true poses."""
    library = procedural_objects(17)
    models = [next(model for model in library if model.category == noun) for noun in NOUNS]
    places = [(0.28, 0.3), (0.3, 0.05), (0.35, -0.25), (0.57, 0.28), (0.5, 0.05), (0.6, -0.2)]
    poses = [pose_from_xyz_yaw(x, y, 0.0, 0.7 * k) for k, (x, y) in enumerate(places)]
    with TabletopWorld(models, poses) as world:
        return world.observe(np.random.default_rng(0)), poses


def test_bodies_follow_the_conventions_of_models(seen):
    scene, _ = seen
    for cloud in scene.objects:
        model, pose = body_of(cloud, scene.world_from_camera)
        points = np.concatenate(model.hulls)
        assert points[:, 2].min() == pytest.approx(0.0, abs=1e-9)
        assert pose[2, 3] == pytest.approx(cloud.bottom, abs=1e-6)
        assert footprint_centroid(points[:, :2]) == pytest.approx([0.0, 0.0], abs=1e-6)
        assert (model.name, model.category, model.source) == (cloud.name, cloud.category, "recorded")
        assert model.surface_points.shape == (1024, 3) and 0.02 <= model.mass <= 1.5
        assert np.median(cloud.colors, axis=0) / 255 == pytest.approx(model.color)
        volume = mass_properties(model.hulls, model.mass).volume
        assert model.mass == pytest.approx(np.clip(DENSITY * volume, 0.02, 1.5), rel=0.01)


def test_bodies_stay_where_they_were_seen(seen):
    scene, true = seen
    bodies = bodies_of(scene.objects, scene.world_from_camera)
    with TabletopWorld(*zip(*bodies)) as world:
        assert all(clearance > -0.0005 for i in range(len(bodies)) for clearance in world.clearances(i).values())
        world.settle(1.0)
        for (_, before), after, cloud in zip(bodies, world.poses(), scene.objects):
            assert np.abs(after - before)[:3].max() < 0.003, cloud.name
    # A handle moves a footprint's middle by millimetres.
    for (_, pose), there in zip(bodies, true):
        assert np.linalg.norm(pose[:2, 3] - there[:2, 3]) < 0.015


def test_arrangements_are_tried_on_guessed_bodies(seen):
    scene = seen[0].select([4, 1])  # the fork and the box; what is left stands in the way
    models, poses, others = bodies_of_scene(scene)
    assert [model.name for model in models] == [cloud.name for cloud in scene.objects]
    assert [model.name for model, _ in others] == [cloud.name for cloud in scene.distractors]

    def tried(shift):
        motions = np.array([np.eye(4), pose_from_xyz_yaw(*shift, 0.0)])
        return place_and_check(TabletopBodies(models, poses, scene.table, others), motions, StructureSpec("line"))

    assert tried((0.0, 0.0, 0.0)).success
    bottle = seen[1][2][:3, 3] - seen[1][1][:3, 3]
    assert tried(bottle).failure == "intersection"
    assert tried((0.0, 0.0, 0.2)).failure == "abnormal velocity"  # it falls


def test_what_stands_on_something_is_set_on_it(seen):
    scene, _ = seen
    cloud = replace(scene.objects[1], points=scene.objects[1].points + np.float32([0, 0, 0.05]), bottom=0.05)
    _, pose = body_of(cloud, scene.world_from_camera)
    assert pose[2, 3] == pytest.approx(0.05, abs=1e-6)


def test_without_colours_a_body_is_gray(seen):
    scene, _ = seen
    model, _ = body_of(replace(scene.objects[0], colors=None), scene.world_from_camera)
    assert len(set(np.round(model.color, 1))) == 1


def slab(at: float, low: float = 0.0, high: float = 0.1) -> np.ndarray:
    return box(0.06, 0.06, low, high, x=at)


def test_neighbours_are_cut_between_what_was_seen_of_them():
    seen_of_one, seen_of_other = slab(0.0) * [1, 1, 1], slab(0.075)
    one = CompletedShape((slab(0.0), slab(0.02)), seen_of_one)  # guessed 2 cm beyond what was seen
    other = CompletedShape((slab(0.075), slab(0.065)), seen_of_other)
    apart = separated([one, other])
    reach = max(part[:, 0].max() for part in apart[0].parts)
    begins = min(part[:, 0].min() for part in apart[1].parts)
    assert reach < begins < 0.045
    assert reach >= seen_of_one[:, 0].max() and begins <= seen_of_other[:, 0].min()


def test_bodies_on_each_other_or_apart_are_left_alone():
    lower, upper = CompletedShape((slab(0.0),), slab(0.0)), CompletedShape((slab(0.0, 0.1, 0.2),), slab(0.0, 0.1, 0.2))
    far = CompletedShape((slab(0.3),), slab(0.3))
    assert separated([lower, upper, far]) == [lower, upper, far]


def test_what_no_plane_parts_is_left_alone():
    around = np.concatenate([box(0.1, 0.01, 0, 0.05, y=y) for y in (-0.05, 0.05)])
    ring = CompletedShape((around,), around)
    inside = CompletedShape((box(0.02, 0.02, 0, 0.08),), box(0.02, 0.02, 0, 0.08))
    assert separated([ring, inside]) == [ring, inside]


def test_two_boxes_side_by_side_do_not_touch_in_the_twin():
    rng = np.random.default_rng(1)
    clouds = []
    for k, x in enumerate((0.0, 0.07)):
        points = rng.uniform([-0.03, -0.03, 0.0], [0.034, 0.03, 0.08], (400, 3)) + [0.4 + x, 0.0, 0.0]
        clouds.append(ObjectCloud(f"box {k}", "box", points.astype(np.float32)))
    shapes = separated([complete(cloud, None) for cloud in clouds])
    assert max(p[:, 0].max() for p in shapes[0].parts) < min(p[:, 0].min() for p in shapes[1].parts) + 1e-9


def test_cutlery_has_its_front_where_it_was_seen(seen):
    scene, poses = seen
    fork = NOUNS.index("fork")
    model, pose = body_of(scene.objects[fork], scene.world_from_camera)
    assert pose[:3, 0] @ poses[fork][:3, 0] > np.cos(np.radians(8))  # of the two ends, the one with the tines
    length, width = np.ptp(np.concatenate(model.hulls)[:, :2], axis=0)
    assert length > 3 * width
    unnamed, straight = body_of(replace(scene.objects[fork], category="object"), scene.world_from_camera)
    assert np.array_equal(straight[:3, :3], np.eye(3)) and unnamed.radius == pytest.approx(model.radius, abs=1e-3)


def test_a_box_of_which_two_sides_are_seen_carries_what_stands_on_it():
    """What stands on it hides its top and its far side."""
    share = np.linspace(0.0, 1.0, 30)
    along, up = (grid.ravel() for grid in np.meshgrid(share, share))
    front, left = np.stack((0 * along, along, up), axis=1), np.stack((along, 0 * along, up), axis=1)
    top = np.stack((along, up, np.ones(len(up))), axis=1)
    lower = np.concatenate((front, left)) * [0.1, 0.1, 0.06] + [0.4, 0.0, 0.0]
    upper = np.concatenate((front, left, top)) * [0.08, 0.08, 0.06] + [0.41, 0.01, 0.06]
    clouds = [
        ObjectCloud("box 1", "box", lower.astype(np.float32)),
        ObjectCloud("box 2", "box", upper.astype(np.float32), bottom=0.06),
    ]
    bodies = bodies_of(clouds, pose_from_xyz_yaw(-0.5, -0.5, 1.0, 0.0))
    with TabletopWorld(*zip(*bodies)) as world:
        world.settle(2.0, until_rest=False)
        for (_, before), after in zip(bodies, world.poses()):
            assert np.abs(after - before)[:3].max() < 0.003


def test_a_body_stands_whose_top_is_round_and_higher_on_one_side():
    """As round below as above, it would roll over."""
    x, y = (grid.ravel() for grid in np.meshgrid(np.linspace(-1, 1, 41), np.linspace(-1, 1, 41)))
    there = x**2 + y**2 < 1
    x, y = x[there], y[there]
    top = np.stack((0.04 * x, 0.04 * y, 0.05 - 0.02 * (x**2 + y**2) + 0.03 * x), axis=1) + [0.4, 0.0, 0.0]
    cloud = ObjectCloud("object 1", "object", top.astype(np.float32))
    model, pose = body_of(cloud, pose_from_xyz_yaw(-0.5, 0.0, 1.0, 0.0))
    with TabletopWorld([model], [pose]) as world:
        world.settle(2.0, until_rest=False)
        assert np.abs(world.pose(0) - pose)[:3].max() < 0.003
