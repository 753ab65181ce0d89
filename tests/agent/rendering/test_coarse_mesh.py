"""A reduced mesh keeps its size and its shape, with few faces."""

import numpy as np
import pytest
import trimesh

from agent.rendering.coarse_mesh import coarse_mesh


@pytest.mark.parametrize("most", [100, 600, 2000])
def test_a_ball_stays_a_ball(most):
    ball = trimesh.creation.icosphere(5, 0.05)
    vertices, faces = coarse_mesh(ball.vertices + 0.3, ball.faces, most)
    assert most / 8 < len(faces) <= most < len(ball.faces)
    assert np.linalg.norm(vertices - 0.3, axis=1) == pytest.approx(0.05, rel=0.15)
    assert trimesh.Trimesh(vertices, faces, process=False).area == pytest.approx(ball.area, rel=0.2)
    assert faces.max() < len(vertices) and (faces[:, 0] != faces[:, 1]).all()


def test_a_small_mesh_is_left_as_it_is():
    box = trimesh.creation.box((0.1, 0.2, 0.3))
    vertices, faces = coarse_mesh(box.vertices, box.faces, 12)
    assert vertices is box.vertices and faces is box.faces
