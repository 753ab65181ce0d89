"""The verdict on a disturbed build: the goal, or what is left of it, on the true objects."""

import numpy as np
import pytest

from agent.evaluation.loop.verdict import failed_checks, goal_without
from grounding.goals.goal import Goal
from grounding.goals.parts import PartReference, RelationPart, StructurePart
from structdiffusion.benchmark.goals import GoalScene, draw_goal_scene
from structdiffusion.geometry import pose_from_xyz_rpy
from structdiffusion.objects.blocks import block_objects
from structdiffusion.simulation.world import TabletopWorld

LINE, CIRCLE = StructurePart("line", objects=(0, 1, 2)), StructurePart("circle", objects=(3, 4, 5))


def test_what_is_left_of_a_goal():
    beside = RelationPart("left of", PartReference(1), PartReference(0))
    goal = Goal((LINE, CIRCLE, beside, RelationPart("next to", (6,), (0,))))
    assert goal_without(goal, ()) == goal
    without_one = goal_without(goal, {1})
    assert without_one.parts[0].objects == (0, 2) and without_one.parts[1:] == goal.parts[1:]
    # A circle of two is none, and nothing can stand beside it.
    assert goal_without(goal, {4}) == Goal((LINE, RelationPart("next to", (6,), (0,))))
    swapped = Goal((CIRCLE, LINE, RelationPart("left of", (6,), PartReference(1))))
    assert goal_without(swapped, {3}) == Goal((LINE, RelationPart("left of", (6,), PartReference(0))))
    assert goal_without(Goal((RelationPart("next to", (6,), (0,)),)), {0}) == Goal()


@pytest.fixture(scope="module")
def scene() -> GoalScene:
    return draw_goal_scene(block_objects(), "tower", 0, seed=0)


def failed(scene, change, gone=(), moved=(0, 1, 2)):
    """What fails when the reference stands, but for `change(poses)`."""
    poses = [motion @ pose for motion, pose in zip(scene.reference, scene.world_from_initial)]
    change(poses)
    with TabletopWorld(scene.models, poses, scene.table) as world:
        world.settle()
        return failed_checks(world, scene, range(len(poses)), moved, gone)


def test_the_whole_and_what_is_left(scene):
    (tower,) = scene.goal.structures
    by_height = sorted(tower.objects, key=lambda index: (scene.reference @ scene.world_from_initial)[index][2, 3])
    top = by_height[-1]

    def away(poses):
        poses[top][:3, 3] = 0.0, 0.0, -20.0

    def lying(poses):
        poses[top] = pose_from_xyz_rpy((0.25, 0.35, 0.1), (np.pi / 2, 0.0, 0.0))

    assert failed(scene, lambda poses: None) == []
    for change in (away, lying):
        assert any(scene.names[top] in line for line in failed(scene, change))
        assert failed(scene, change, gone={top}) == []
    assert failed(scene, lambda poses: lying(poses), gone={by_height[0]})  # another one is missing


def test_what_no_part_names_may_not_move_unless_it_made_room(scene):
    (other,) = (index for index in range(len(scene.models)) if index not in scene.goal.named_objects())

    def shifted(poses):
        poses[other][0, 3] += 0.03

    assert any("not named" in line for line in failed(scene, shifted))
    assert failed(scene, shifted, moved=(0, 1, 2, other)) == []
