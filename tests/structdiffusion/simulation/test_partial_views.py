import math

import numpy as np
import pytest
import torch

from structdiffusion.simulation.partial_views import CAMERA_EYE, depth_noise, partial_views

EYE = torch.tensor(CAMERA_EYE)


def sphere(centre, radius: float, count: int = 1024) -> tuple[torch.Tensor, torch.Tensor]:
    """Points and normals (count, 3), evenly spread (a Fibonacci lattice)."""
    k = torch.arange(count) + 0.5
    polar, turn = torch.arccos(1 - 2 * k / count), math.pi * (1 + math.sqrt(5)) * k
    normals = torch.stack((turn.cos() * polar.sin(), turn.sin() * polar.sin(), polar.cos()), dim=-1)
    return torch.tensor(centre) + radius * normals, normals


def plate(centre, half: float, normal, count: int = 1024) -> tuple[torch.Tensor, torch.Tensor]:
    """A flat square grid across `normal`."""
    normal = torch.nn.functional.normalize(torch.tensor(normal), dim=0)
    side = torch.nn.functional.normalize(torch.linalg.cross(normal, torch.tensor([0.0, 1.0, 0.0])), dim=0)
    other = torch.linalg.cross(normal, side)
    grid = torch.linspace(-half, half, int(count**0.5))
    u, v = (axis.reshape(-1, 1) for axis in torch.meshgrid(grid, grid, indexing="ij"))
    return torch.tensor(centre) + u * side + v * other, normal.expand(count, 3)


def look(*things, present=None, count: int = 256, seed: int = 0):
    points, normals = (torch.stack(parts)[None] for parts in zip(*things))
    present = torch.ones(1, len(things), dtype=torch.bool) if present is None else torch.tensor([present])
    clouds, seen = partial_views(points, normals, present, count, torch.Generator().manual_seed(seed))
    return clouds[0], seen[0]


def test_a_sphere_shows_the_half_that_faces_the_camera():
    centre, radius = (0.45, 0.1, 0.05), 0.05
    clouds, seen = look(sphere(centre, radius))
    toward = torch.nn.functional.normalize(EYE - torch.tensor(centre), dim=0)
    height = (clouds[0] - torch.tensor(centre)) @ toward
    assert height.min() > -0.006  # the rim, and noise of 2 mm
    assert height.max() > 0.045
    assert 0.35 < seen[0] <= 0.5
    # Pixels are spread evenly over the disc that the camera sees: half of them within r / sqrt 2 of its middle.
    across = (clouds[0] - torch.tensor(centre) - height[:, None] * toward).norm(dim=1)
    assert (across < radius / math.sqrt(2)).float().mean() == pytest.approx(0.5, abs=0.1)


def test_an_occluder_hides_what_is_behind_it_unless_it_is_absent():
    target = torch.tensor([0.45, 0.0, 0.0])
    ball = sphere((0.45, 0.0, 0.03), 0.03)
    screen = plate((EYE + 0.7 * (target - EYE)).tolist(), 0.10, (EYE - target).tolist())
    assert look(ball, screen)[1][0] == 0.0
    assert look(ball, screen)[1][1] == 1.0
    assert look(ball, screen, present=[True, False])[1].tolist() == pytest.approx([look(ball)[1][0].item(), 0.0])
    behind = plate((EYE + 1.2 * (target - EYE)).tolist(), 0.10, (EYE - target).tolist())
    assert look(ball, behind)[1][0] == look(ball)[1][0]
    assert 0 < look(ball, behind)[1][1] < 1


def test_a_half_hidden_object_shows_its_free_half():
    target = torch.tensor([0.45, 0.0, 0.0])
    wall = plate((0.45, 0.0, 0.0), 0.08, (EYE - target).tolist())
    middle = EYE + 0.8 * (target - EYE)
    screen = plate((middle + torch.tensor([0.0, 0.1, 0.0])).tolist(), 0.1, (EYE - target).tolist())
    clouds, seen = look(wall, screen)
    assert 0.35 < seen[0] < 0.6
    assert clouds[0][:, 1].max() < 0.015


def test_noise_lies_along_the_ray_and_has_the_sensors_sigma():
    distance = 1.1
    target = torch.tensor([0.45, 0.0, 0.0])
    direction = torch.nn.functional.normalize(target - EYE, dim=0)
    wall = plate((EYE + distance * direction).tolist(), 0.01, (-direction).tolist())
    offsets = torch.cat([look(wall, count=1024, seed=seed)[0][0] for seed in range(5)]) - EYE
    sigma = float(depth_noise(torch.tensor(distance)))
    assert sigma == pytest.approx(0.0012 + 0.0019 * 0.49)
    along = offsets @ direction - distance
    assert float(along.std()) == pytest.approx(sigma, rel=0.05)
    assert abs(float(along.mean())) < 4 * sigma / math.sqrt(len(along))
    # Rays keep their direction: every noisy point still lies on a ray to a point of the wall.
    rays = torch.nn.functional.normalize(offsets, dim=1)
    true = torch.nn.functional.normalize(wall[0] - EYE, dim=1)
    assert torch.cdist(rays, true).min(dim=1).values.max() < 1e-3


def test_views_follow_from_the_generator():
    thing = sphere((0.5, -0.1, 0.04), 0.04)
    first, again, other = (look(thing, seed=seed)[0] for seed in (1, 1, 2))
    assert torch.equal(first, again) and not torch.equal(first, other)


def test_few_visible_points_are_repeated_and_many_are_not():
    thing = sphere((0.45, 0.0, 0.05), 0.05, count=64)
    clouds, seen = look(thing, count=256)
    visible = round(float(seen[0]) * 64)
    nearest = torch.cdist(clouds[0], thing[0]).argmin(dim=1)
    assert 10 < len(nearest.unique()) <= visible + 3
    facing = look(plate((0.45, 0.0, 0.0), 0.1, (EYE - torch.tensor([0.45, 0.0, 0.0])).tolist()), count=512)[0][0]
    assert len(np.unique(facing.numpy(), axis=0)) == 512
