"""An episode on a small table: what moves, what is refused, and what the protocol says of it."""

from dataclasses import replace

import numpy as np
import pytest

from agent.environment.episode import OTHERS, Episode, Move
from structdiffusion.benchmark.scenes import draw_evaluation_scene
from structdiffusion.evaluation_protocol import ABNORMAL_VELOCITY, INTERSECTION, NOT_UPRIGHT
from structdiffusion.geometry import pose_from_xyz_yaw
from structdiffusion.objects.procedural import procedural_object


@pytest.fixture(scope="module")
def scene():
    """Two cans and a bystander, to be stacked."""
    objects = [procedural_object("can", number) for number in range(6)]
    drawn = draw_evaluation_scene(objects, "tower", 0, seed=3)
    models = (objects[0], objects[1], objects[2])
    poses = np.array([pose_from_xyz_yaw(x, y, 0.0, 0.0) for x, y in ((0.35, -0.2), (0.35, 0.2), (0.6, 0.3))])
    spec = replace(drawn.spec, x_position=None, y_position=None)
    return replace(drawn, drawn=replace(drawn.drawn, models=models, world_from_initial=poses, count=2, spec=spec))


@pytest.fixture
def episode(scene):
    with Episode(scene) as episode:
        yield episode


def onto_the_first(episode) -> Move:
    """The second can onto the first one."""
    first, second = (episode._world.pose(index) for index in (0, 1))
    seen = episode.look()
    offset = seen.positions[1][:2] - second[:2, 3]
    height = float(seen.clouds[0].points[:, 2].max())
    return Move(1, *(first[:2, 3] + offset), height, 0.0)


def test_a_tower_of_two_moves_succeeds(episode):
    away = episode.move(Move(0, 0.45, 0.0, 0.0, 0.5))
    assert not away.success and away.failure == "semantic" and not away.ended and not away.refused
    assert episode._world.pose(0)[:2, 3] == pytest.approx((0.45, 0.0), abs=0.03)
    done = episode.move(onto_the_first(episode))
    assert done.success and done.ended and done.checks and all(check.passed for check in done.checks)


def test_an_object_is_turned_about_the_middle_of_what_is_seen(episode):
    before = episode.look().positions[0]
    episode.move(Move(0, *before[:2], 0.0, np.pi / 2))
    after = episode._world.pose(0)
    turned = pose_from_xyz_yaw(0.0, 0.0, 0.0, np.pi / 2)[:2, :2] @ (np.array((0.35, -0.2)) - before[:2]) + before[:2]
    assert after[:2, 3] == pytest.approx(turned, abs=0.003)


def test_what_would_intersect_ends_the_episode_and_stays(episode):
    seen = episode.look().positions
    outcome = episode.move(Move(0, *seen[1][:2], 0.0, 0.0))
    assert outcome.failure == INTERSECTION and outcome.ended and episode.names[1] in outcome.detail
    assert episode._world.pose(0)[:2, 3] == pytest.approx((0.35, -0.2), abs=1e-6)


def test_what_falls_from_a_height_ends_the_episode(episode):
    outcome = episode.move(Move(0, 0.45, 0.0, 0.5, 0.0))
    assert outcome.ended and outcome.failure in (ABNORMAL_VELOCITY, NOT_UPRIGHT) and not outcome.success


@pytest.mark.parametrize(("index", "why"), [(2, "takes no part"), (7, "there is no object 7")])
def test_what_cannot_be_moved_is_refused(episode, index, why):
    before = [pose.copy() for pose in episode._world.poses()]
    outcome = episode.move(Move(index, 0.45, 0.0, 0.0, 0.0))
    assert why in outcome.refused and not outcome.ended
    assert np.allclose(before, episode._world.poses(), atol=1e-3)


def test_a_bystander_off_its_place_is_a_failure(episode):
    moved = episode._world.pose(2)
    moved[0, 3] -= 0.08
    episode._world.set_pose(2, moved)
    outcome = episode.move(Move(0, 0.45, 0.0, 0.0, 0.0))
    assert outcome.failure == ABNORMAL_VELOCITY and outcome.ended
    assert not next(check for check in outcome.checks if check.name == OTHERS).passed


def test_what_is_hidden_cannot_be_moved(episode):
    episode._world.set_pose(0, pose_from_xyz_yaw(0.45, 0.0, -1.0, 0.0))
    seen = episode.look()
    assert seen.clouds[0] is None and np.isnan(seen.positions[0]).all()
    assert "is not seen" in episode.move(Move(0, 0.45, 0.0, 0.0, 0.0)).refused


def test_the_arm_moves_an_object(scene):
    with Episode(scene, "arm") as episode:
        outcome = episode.move(Move(0, 0.45, 0.0, 0.0, 0.0))
        assert not outcome.refused and not outcome.ended and outcome.failure == "semantic"
        assert episode._world.pose(0)[:2, 3] == pytest.approx((0.45, 0.0), abs=0.04)
        far = episode.move(Move(0, 0.72, 0.45, 0.3, 0.0))
        assert "the arm finds no plan" in far.refused and not far.ended
