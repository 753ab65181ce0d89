"""The arm's shapes are where the simulation has them."""

import numpy as np
import pybullet
import pytest

from agent.arm.simulated_arm import SimulatedArm
from agent.arm.visual_shapes import BASE, link_poses, link_shapes


@pytest.fixture
def arm():
    client = pybullet.connect(pybullet.DIRECT)
    yield SimulatedArm(client)
    pybullet.disconnect(client)


def test_poses_follow_the_joints(arm):
    arm.teleport(arm.kinematics.folded + np.linspace(0.1, 0.4, 7))
    poses = link_poses(arm)
    assert np.allclose(poses[arm.end_effector], arm.world_from_ee(), atol=1e-6)
    assert np.allclose(poses[BASE][:3, 3], 0.0, atol=1e-6)
    assert np.allclose(poses[BASE][:3, 0], (0.0, 1.0, 0.0), atol=1e-6)  # mounted turned by 90 degrees


def test_shapes_fill_what_collides(arm):
    """Every solid's corners, in the world, lie in its link's bounding box of the physics engine."""
    poses = link_poses(arm)
    signs = np.array(np.meshgrid(*[(-1, 1)] * 3)).reshape(3, -1).T / 2
    solids = [shape for shape in link_shapes(arm) if max(shape.sides) > 0.02]
    assert {shape.link for shape in solids} >= {BASE, *range(7)}
    for shape in solids:
        turned = np.array(pybullet.getMatrixFromQuaternion(shape.quaternion)).reshape(3, 3)
        corners = signs * shape.sides @ turned.T + shape.position
        corners = corners @ poses[shape.link][:3, :3].T + poses[shape.link][:3, 3]
        low, high = pybullet.getAABB(arm.body, shape.link, physicsClientId=arm.client)
        assert (corners.mean(axis=0) > low).all() and (corners.mean(axis=0) < high).all()
        diagonal = np.linalg.norm(np.subtract(high, low))
        assert np.linalg.norm(shape.sides) <= diagonal + 0.02
