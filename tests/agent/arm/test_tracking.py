"""What the camera sees, told by the tracker: true poses are for the comparison only."""

import math
from dataclasses import replace

import numpy as np
import pytest

from agent.arm.simulated_arm import SimulatedArm
from agent.arm.tracking import Tracker
from grounding.spec import StructureSpec
from structdiffusion.data.scene_sampling import draw_scene
from structdiffusion.geometry import pose_from_xyz_rpy, pose_from_xyz_yaw, tilt_between, transform_points, turn_of
from structdiffusion.objects.libraries import load_objects
from structdiffusion.objects.procedural import procedural_object
from structdiffusion.objects.solids import assemble, box
from structdiffusion.simulation.world import TabletopWorld

AWAY = pose_from_xyz_yaw(0.0, 0.0, -5.0, 0.0)  # out of view, far below the table
PLACES = {"can": (0.35, 0.2, 0.0), "box": (0.5, -0.2, 0.4), "mug": (0.6, 0.15, -0.8), "fork": (0.3, -0.3, 1.0)}


class Table:
    """A table with a few things, whose tracker has seen them in their first places."""

    def __init__(self, places=PLACES, colors=()):
        models = [procedural_object(kind.split()[0], index) for index, kind in enumerate(places)]
        for index, color in enumerate(colors):
            models[index] = replace(models[index], color=color)
        self.rng = np.random.default_rng(0)
        self.world = TabletopWorld(models, [pose_from_xyz_yaw(x, y, 0.0, yaw) for x, y, yaw in places.values()])
        self.world.settle()
        self.first = self.world.poses()
        self.scene = self.world.observe(self.rng)
        self.tracker = Tracker(self.scene)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.world.close()

    def look(self, expected=()):
        return self.tracker.look(self.world.look(self.rng), dict(expected))

    def put(self, index, pose):
        self.world.set_pose(index, pose)
        if pose is not AWAY:
            self.world.settle(2.0)

    def true_motion(self, index):
        return self.world.pose(index) @ np.linalg.inv(self.first[index])

    def error(self, index):
        """Distance in the plane, metres, of the tracked middle of an object from the true one."""
        track = self.tracker.tracks[index]
        middle = self.first[index][:3, 3] + [0.0, 0.0, self.world.models[index].height / 2]
        apart = transform_points(track.now_from_initial, middle) - transform_points(self.true_motion(index), middle)
        return float(np.linalg.norm(apart[:2]))


def tall_screen():
    """A box that hides from the camera what stands behind it."""
    part, color = box(0.04, 0.2, 0.0, 0.34), (0.2, 0.6, 0.2)
    rng = np.random.default_rng(0)
    return assemble("screen", "box", [part], density=300.0, friction=0.5, color=color, source="procedural", rng=rng)


def test_where_nothing_happened_nothing_is_told():
    with Table() as table:
        for _ in range(5):
            tracks = table.look()
            assert all(track.seen and not track.gone for track in tracks) and not table.tracker.unknown
            assert max(table.error(index) for index in range(4)) < 0.006  # looks do not add up to a drift
            assert all(0.0 < track.error_m < 0.004 for track in tracks)


def test_the_segmentation_is_not_read():
    with Table() as table:
        table.put(1, pose_from_xyz_yaw(0.45, -0.15, 0.0, 0.6))
        picture = table.world.look(table.rng)
        told = table.tracker.look(picture)
        blind = Tracker(table.scene).look(replace(picture, segmentation=None))
        assert all(np.array_equal(a.now_from_initial, b.now_from_initial) for a, b in zip(told, blind))


def test_a_pushed_object_is_followed():
    with Table() as table:
        table.put(1, pose_from_xyz_yaw(0.43, -0.15, 0.0, 0.8))
        tracks = table.look()
        assert all(track.seen for track in tracks) and not table.tracker.unknown
        assert max(table.error(index) for index in range(4)) < 0.006
        turned = turn_of(table.true_motion(1)[:3, :3].T @ tracks[1].now_from_initial[:3, :3])
        assert min(turned, abs(math.pi - turned)) < 0.1  # after half a turn a box looks the same


def test_where_it_should_be_helps_to_find_an_object_on_another():
    with Table({"block": (0.4, 0.2, 0.0), "block 2": (0.4, -0.2, 0.0)}) as table:
        height = table.world.models[0].height
        goal = pose_from_xyz_yaw(0.4, 0.2, height, 0.3)
        table.put(1, goal)
        tracks = table.look({1: goal @ np.linalg.inv(table.first[1])})
        assert all(track.seen for track in tracks) and not table.tracker.unknown
        assert max(table.error(index) for index in range(2)) < 0.005
        assert tracks[1].now_from_initial[2, 3] == pytest.approx(height, abs=0.004)


def test_a_hidden_object_keeps_its_pose():
    """A tall box comes to stand between the camera and a block."""
    with Table({"block": (0.47, 0.0, 0.0), "box": (0.3, 0.3, 0.0)}) as table:
        table.look()
        before = table.tracker.tracks[0].now_from_initial
        screen = table.world.add(tall_screen(), AWAY)
        table.put(screen, pose_from_xyz_yaw(0.40, 0.0, 0.0, 0.0))
        track = table.look()[0]
        assert not track.seen and not track.gone and np.array_equal(track.now_from_initial, before)
        table.put(screen, AWAY)
        assert table.look()[0].seen


def test_a_removed_object_is_gone_until_it_is_back():
    with Table() as table:
        for index in range(4):
            table.put(index, AWAY)
            tracks = table.look()
            assert [track.gone for track in tracks] == [k == index for k in range(4)] and not table.tracker.unknown
            assert not tracks[index].seen
            table.put(index, table.first[index])
            assert all(track.seen and not track.gone for track in table.look())


def test_an_added_object_is_unknown():
    with Table() as table:
        added = table.world.add(procedural_object("cup", 9), pose_from_xyz_yaw(0.45, 0.0, 0.0, 0.0))
        tracks = table.look()
        assert all(track.seen for track in tracks) and len(table.tracker.unknown) == 1
        (cloud,) = table.tracker.unknown
        assert np.linalg.norm(cloud[:, :2].mean(axis=0) - table.world.pose(added)[:2, 3]) < 0.03


def test_objects_of_one_shape_are_told_apart_by_their_colors():
    places = {"block": (0.35, 0.2, 0.0), "block 2": (0.55, -0.2, 0.0)}
    with Table(places, colors=[(0.8, 0.1, 0.1), (0.1, 0.2, 0.8)]) as table:
        one, other = table.world.pose(0), table.world.pose(1)
        table.put(0, other)
        table.put(1, one)
        assert all(track.seen for track in table.look()) and not table.tracker.unknown
        assert max(table.error(index) for index in range(2)) < 0.006


@pytest.mark.parametrize("kind", ["bottle", "can", "box"])
def test_a_toppled_object_lies(kind):
    with Table({kind: (0.45, 0.1, 0.3), "mug": (0.6, -0.25, 0.0)}) as table:
        height = table.world.models[0].height
        table.put(0, pose_from_xyz_rpy((0.45, 0.1 + height / 2, 0.06), (math.pi / 2, 0.0, 0.3)))
        assert tilt_between(table.world.pose(0), np.eye(4)) > math.radians(60)
        track = table.look()[0]
        assert track.seen and not track.gone and not table.tracker.unknown
        assert tilt_between(track.now_from_initial, np.eye(4)) > math.radians(45) and table.error(0) < 0.03
        table.put(0, table.first[0])
        assert tilt_between(table.look()[0].now_from_initial, np.eye(4)) < math.radians(5)


def test_the_folded_arm_is_no_stranger():
    with Table() as table:
        SimulatedArm(table.world.client).fold_at_once()
        assert all(track.seen for track in table.look()) and not table.tracker.unknown


def test_what_is_not_measured_says_nothing():
    with Table() as table:
        picture = table.world.look(table.rng)
        masked = picture.segmentation == table.world.bodies[0]
        blind = np.full_like(picture.depth, np.nan)
        for mask, hidden in ((masked, [0]), (np.ones_like(masked), [0, 1, 2, 3])):
            depth = np.where(mask, blind, picture.depth)
            points = np.where(mask[..., None], np.nan, picture.points)
            tracks = table.tracker.look(replace(picture, depth=depth, points=points))
            assert [k for k, track in enumerate(tracks) if not track.seen] == hidden
            assert not any(track.gone for track in tracks) and not table.tracker.unknown


def test_a_scene_without_objects_has_only_strangers():
    with Table() as table:
        tracker = Tracker(replace(table.scene, objects=()))
        assert tracker.look(table.world.look(table.rng)) == [] and len(tracker.unknown) == 4


def test_twelve_drawn_scenes():
    """In each, one object is pushed, two change places, one is taken away, or one is laid down."""
    library = load_objects("procedural")
    errors, wrong = [], []
    for seed in range(12):
        rng = np.random.default_rng(seed)
        drawn = draw_scene(library, StructureSpec("circle", None, None, None, None), rng, distractors=1)
        with TabletopWorld(drawn.models, list(drawn.world_from_initial)) as world:
            world.settle()
            first = world.poses()
            tracker = Tracker(world.observe(rng, range(drawn.count), range(drawn.count, len(drawn.models))))
            kind = ("push", "swap", "remove")[seed % 3]
            gone = disturb(world, kind, rng)
            tracks = tracker.look(world.look(rng))
            wrong += [(seed, k) for k, track in enumerate(tracks) if (track.gone, track.seen) != (k == gone, k != gone)]
            wrong += [(seed, "unknown")] * len(tracker.unknown)
            for k, track in enumerate(tracks):
                if k != gone:
                    middle = first[k][:3, 3] + [0.0, 0.0, drawn.models[k].height / 2]
                    true = world.pose(k) @ np.linalg.inv(first[k])
                    apart = transform_points(track.now_from_initial, middle) - transform_points(true, middle)
                    errors.append(float(np.linalg.norm(apart[:2])))
    assert np.quantile(errors, 0.95) < 0.01 and np.median(errors) < 0.002
    assert not wrong


def disturb(world, kind, rng):
    """Disturb the first object: push it by 5 cm, let it change places with the second, or take it away; return the
    index of what is gone.
    """
    one, other = world.pose(0), world.pose(1)
    if kind == "remove":
        world.set_pose(0, AWAY)
        return 0
    if kind == "swap":
        one[:2, 3], other[:2, 3] = world.pose(1)[:2, 3], world.pose(0)[:2, 3]
        world.set_pose(0, AWAY)
        world.set_pose(1, other)
        world.set_pose(0, one)
    else:
        for angle in rng.uniform(0, 2 * math.pi, 50):
            world.set_pose(0, pose_from_xyz_yaw(0.05 * math.cos(angle), 0.05 * math.sin(angle), 0.0, 0.0) @ one)
            outline = world.models[0].footprint @ world.pose(0)[:2, :2].T + world.pose(0)[:2, 3]
            if world.table.overhang(outline) == 0.0 and not set(world.clearances(0, 0.005)) - {-1}:
                break
    world.settle(1.0)
    return None


@pytest.mark.parametrize("lower", [0.004, 0.008])
def test_what_was_put_onto_another_may_stand_lower_than_expected(lower):
    """Of two slabs of one colour, the upper one was taken to be gone where it stood 8 mm lower than it was let go."""
    part, rng = box(0.07, 0.07, 0.0, 0.033), np.random.default_rng(0)
    looks = {"density": 300.0, "friction": 0.5, "color": (0.6, 0.3, 0.2), "source": "procedural", "rng": rng}
    slabs = [assemble(f"slab {k}", "box", [part], **looks) for k in range(2)]
    with TabletopWorld(slabs, [pose_from_xyz_yaw(0.5, 0.0, 0.0, 0.2), pose_from_xyz_yaw(0.4, 0.25, 0.0, 0.5)]) as world:
        world.settle()
        first = world.pose(1)
        tracker = Tracker(world.observe(rng))
        world.set_pose(1, pose_from_xyz_yaw(0.5, 0.0, 0.033, 0.5))
        world.settle(1.0)
        motion = world.pose(1) @ np.linalg.inv(first)
        track = tracker.look(world.look(rng), {1: pose_from_xyz_yaw(0.0, 0.0, lower, 0.0) @ motion})[1]
    assert track.seen and abs(track.now_from_initial[2, 3] - motion[2, 3]) < 0.0015


@pytest.mark.parametrize("kinds", [("bottle", "jar"), ("can", "bottle"), ("cup", "jar")])
@pytest.mark.parametrize("way", ["lies against it", "stands beside it"])
def test_two_of_one_color_that_touch_are_told_apart(kinds, way):
    """Both are lost where the first was pushed, and the points of both are one group."""
    places = {kinds[0]: (0.4, -0.1, 0.0), kinds[1]: (0.5, 0.25, 0.0)}
    with Table(places, colors=[(0.2, 0.4, 0.7)] * 2) as table:
        standing, fallen = table.world.models
        table.put(0, pose_from_xyz_yaw(0.42, -0.05, 0.0, 0.0))
        wide = [np.ptp(model.footprint[:, 1]) / 2 for model in (standing, fallen)]
        y = -0.05 + wide[0] + 0.002
        if way == "lies against it":
            table.put(1, pose_from_xyz_rpy((0.42, y + fallen.height, wide[1]), (math.pi / 2, 0.0, 0.0)))
        else:
            table.put(1, pose_from_xyz_yaw(0.42, y + wide[1], 0.0, 0.0))
        tracks = table.look()
        assert all(track.seen for track in tracks) and not table.tracker.unknown
        assert table.error(0) < 0.006 and table.error(1) < 0.02
        lies = tilt_between(tracks[1].now_from_initial, np.eye(4)) > math.radians(45)
        assert lies == (tilt_between(table.world.pose(1), np.eye(4)) > math.radians(45))
