"""The scenes of the closed loop: solvable, with enough objects to move, and one to lay on its side."""

import numpy as np
import pytest

from structdiffusion.benchmark.goal_names import LOOP_FAMILIES as NAMES
from structdiffusion.benchmark.goals import draw_goal_scene
from structdiffusion.benchmark.loop_families import LEAST_MOVED, LOOP_FAMILIES, moved_by
from structdiffusion.data.scene_sampling import SceneError
from structdiffusion.objects.blocks import block_objects


@pytest.fixture(scope="module")
def blocks():
    return block_objects()


@pytest.mark.parametrize("family", LOOP_FAMILIES)
def test_there_is_enough_to_disturb(blocks, family):
    for number in range(len(LOOP_FAMILIES[family][1])):
        scene = draw_goal_scene(blocks, family, number, seed=3)
        moved = moved_by(scene.goal.parts)
        assert scene.kind == LOOP_FAMILIES[family][1][number] and len(moved) >= LEAST_MOVED
        assert any(scene.models[index].tall for index in moved)
        assert scene.verdict(scene.reference).success


def test_what_the_seed_determines(blocks):
    one, again, other = (draw_goal_scene(blocks, "tower", 1, seed=seed) for seed in (4, 4, 5))
    assert one.goal == again.goal and np.array_equal(one.world_from_initial, again.world_from_initial)
    assert [model.name for model in one.models] != [model.name for model in other.models]
    assert one.planning_seed == again.planning_seed != draw_goal_scene(blocks, "related", 1, seed=4).planning_seed


def test_libraries_without_what_it_takes(blocks):
    flat = [model for model in blocks if not model.tall]
    assert not any(model.tall for model in draw_goal_scene(flat, "flat-structure", 0, seed=0).models)
    with pytest.raises(SceneError):
        draw_goal_scene(flat[:2], "tower", 0, seed=0)


def test_the_names_are_those_of_the_families():
    assert tuple(LOOP_FAMILIES) == NAMES
