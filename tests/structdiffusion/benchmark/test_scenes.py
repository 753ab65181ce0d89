import itertools

import numpy as np
import pytest

from grounding.spec import StructureSpec
from structdiffusion.benchmark.scenes import (
    ANY_SHAPE,
    CAMERA_SIDES,
    Conditions,
    camera_beside,
    draw_evaluation_scene,
    draw_evaluation_scenes,
)
from structdiffusion.data.scene_sampling import SceneError
from structdiffusion.objects.procedural import procedural_object
from structdiffusion.observation import Table
from structdiffusion.simulation.depth_camera import DepthCamera

MODELS = [procedural_object(kind, index) for kind in ("block", "can", "box") for index in range(3)]


@pytest.fixture(scope="module")
def scenes():
    return list(draw_evaluation_scenes(MODELS, 2, shapes=("line", "tower"), seed=3))


def test_scenes_follow_from_the_seed_and_can_be_solved(scenes):
    assert [(scene.structure, scene.number) for scene in scenes] == [
        ("line", 0),
        ("line", 1),
        ("tower", 0),
        ("tower", 1),
    ]
    again = list(draw_evaluation_scenes(MODELS, 1, shapes=("tower",), seed=3))[0]
    assert again.spec == scenes[2].spec
    np.testing.assert_array_equal(again.drawn.world_from_initial, scenes[2].drawn.world_from_initial)
    first, second = scenes[2].observed(), again.observed()
    np.testing.assert_array_equal(first.objects[0].points, second.objects[0].points)
    assert len(first.objects) == again.drawn.count
    assert again.planning_seed == scenes[2].planning_seed != scenes[3].planning_seed
    assert again.verdict(again.drawn.reference_goal_from_initial()).success
    other = list(draw_evaluation_scenes(MODELS, 1, shapes=("tower",), seed=4))[0]
    assert not np.array_equal(other.drawn.world_from_initial, again.drawn.world_from_initial)


def test_a_seed_gives_the_scenes_that_it_always_gave(scenes):
    """Published numbers name a seed: it must go on to mean the same scenes, and the same noise in them."""
    line, tower = scenes[1], scenes[2]
    assert str(line.spec) == "shape line, size medium, x_position right, y_position bottom, rotation west"
    assert [model.name for model in line.drawn.models] == ["can_0_001", "can_0_002", "block_0_002"]
    assert (line.drawn.count, line.draw, tower.drawn.count, tower.draw) == (2, 0, 4, 0)
    np.testing.assert_allclose(
        line.drawn.world_from_initial[:, :2, 3],
        [[0.31098, -0.13682], [0.53012, 0.270555], [0.332779, 0.192476]],
        atol=1e-5,
    )
    np.testing.assert_allclose(line.observed().objects[0].centroid, [0.302442, -0.132816, 0.099721], atol=1e-4)
    np.testing.assert_allclose(tower.observed().objects[0].centroid, [0.506401, 0.054172, 0.043994], atol=1e-4)


def test_no_scene_can_be_drawn_from_nothing():
    with pytest.raises(SceneError, match="no table setting in 100 draws from 9 objects"):
        list(draw_evaluation_scenes(MODELS, 1, shapes=("table setting",)))


def test_scenes_drawn_in_a_pool_are_those_drawn_alone(scenes):
    pooled = list(draw_evaluation_scenes(MODELS, 2, shapes=("line", "tower"), seed=3, workers=2))
    for one, other in zip(scenes, pooled, strict=True):
        assert (one.spec, one.draw) == (other.spec, other.draw)
        np.testing.assert_array_equal(one.drawn.world_from_initial, other.drawn.world_from_initial)


def test_more_objects_than_usual_take_part():
    many = Conditions(objects=(6, 7))
    line, tower = draw_evaluation_scenes(MODELS, 1, shapes=("line", "tower"), seed=3, conditions=many)
    assert 6 <= line.drawn.count <= 7 and len(line.observed().objects) == line.drawn.count
    assert 4 < tower.drawn.count <= 7  # as many as stand, and more than usual
    assert tower.verdict(tower.drawn.reference_goal_from_initial()).success
    with pytest.raises(SceneError, match="no line in 100 draws from 3 objects: 3 of 6 objects that suit it"):
        draw_evaluation_scene(MODELS[:3], "line", 0, seed=3, conditions=Conditions(objects=(6, 6)))


@pytest.mark.parametrize("table", [Table(0.25, 0.65, -0.30, 0.30), Table(0.10, 0.80, -0.60, 0.60)])
def test_a_scene_has_the_table_that_it_was_drawn_for(table):
    (scene,) = draw_evaluation_scenes(MODELS, 1, shapes=("circle",), seed=3, conditions=Conditions(table=table))
    assert scene.observed().table == scene.drawn.table == table
    at = scene.drawn.world_from_initial[:, :2, 3]
    assert table.overhang(at) == 0.0


@pytest.mark.parametrize("side", CAMERA_SIDES)
def test_a_camera_on_any_side_sees_the_whole_table(side):
    table, camera = Table(), camera_beside(side)
    corners = itertools.product((table.x_min, table.x_max), (table.y_min, table.y_max), (0.0, 0.15))
    pixels = camera.pixels(np.array(list(corners)))
    assert (pixels > 0).all() and (pixels < (camera.width, camera.height)).all()
    toward = np.array(camera.eye[:2]) - camera.target[:2]
    expected = {"robot": (-1, 0), "opposite": (1, 0), "left": (0, 1), "right": (0, -1)}[side]
    np.testing.assert_allclose(toward / np.linalg.norm(toward), expected, atol=1e-9)
    assert (camera == DepthCamera()) == (side == "robot")


def test_the_scene_is_looked_at_by_its_camera(scenes):
    opposite = Conditions(camera=camera_beside("opposite"))
    (scene,) = draw_evaluation_scenes(MODELS, 1, shapes=("tower",), seed=3, conditions=opposite)
    np.testing.assert_array_equal(scene.drawn.world_from_initial, scenes[2].drawn.world_from_initial)
    seen, usual = scene.observed(), scenes[2].observed()
    np.testing.assert_allclose(seen.world_from_camera[:3, 3], opposite.camera.eye)
    # The far sides of things come into view, and the near ones leave it.
    assert seen.objects[0].centroid[0] > usual.objects[0].centroid[0] + 0.01


def test_what_a_wish_leaves_open_stays_open():
    wish = StructureSpec(x_position="left")
    scene = draw_evaluation_scene(MODELS, None, 4, seed=3, spec=wish)
    assert scene.spec == wish and scene.structure == ANY_SHAPE and scene.number == 4
    assert scene.verdict(scene.drawn.reference_goal_from_initial()).success
    assert len(scene.observed().objects) == scene.drawn.count


def test_no_camera_stands_elsewhere():
    with pytest.raises(ValueError, match="'above'; legal values: robot, opposite, left, right"):
        camera_beside("above")


def test_a_draw_that_was_accepted_before_is_not_tried_once_more(scenes, monkeypatch):
    monkeypatch.setattr("structdiffusion.benchmark.scenes.place_and_check", None)
    monkeypatch.setattr("structdiffusion.benchmark.scenes.TabletopWorld", None)
    again = draw_evaluation_scene(MODELS, "tower", 1, seed=3, accepted=scenes[3].draw)
    assert (again.spec, again.draw, again.planning_seed) == (scenes[3].spec, scenes[3].draw, scenes[3].planning_seed)
    np.testing.assert_array_equal(again.drawn.world_from_initial, scenes[3].drawn.world_from_initial)
