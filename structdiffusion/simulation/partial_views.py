"""Partial views in torch: the surface points that a depth camera would see, with its noise.

Training scenes are stored as object ids and poses only. The visible points are computed on the fly: points that face
the camera and are not hidden behind others (by a coarse depth buffer), drawn with the density of the pixels, with noise
along the ray. The module needs only torch.
"""

from __future__ import annotations

import math

import torch
from torch import Tensor

# The depth camera of the simulated table; `camera.py` renders with the same figures.
CAMERA_EYE = (0.02, 0.0, 1.05)  # m, world
CAMERA_TARGET = (0.45, 0.0, 0.0)  # m, world
_CELL = 0.0085  # of the depth buffer, radians: 9 mm at 1.05 m, about twice the spacing of surface points
_GRID = 192  # cells per side; the table spans about 110
_HIDDEN_BEHIND = 0.012  # m: points farther than this behind the nearest one of their cell are hidden


def depth_noise(distance: Tensor) -> Tensor:
    """Return the standard deviation, metres, of the noise of a structured-light depth camera at `distance` metres.

    Axial noise of Nguyen et al., 3DIMPVT 2012: 0.0012 + 0.0019 (d - 0.4)^2.
    """
    return 0.0012 + 0.0019 * (distance - 0.4) ** 2


def partial_views(
    points: Tensor,
    normals: Tensor,
    present: Tensor,
    count: int,
    generator: torch.Generator,
    eye: tuple[float, float, float] = CAMERA_EYE,
    target: tuple[float, float, float] = CAMERA_TARGET,
) -> tuple[Tensor, Tensor]:
    """Return the points of each object that the camera sees.

    Args:
        points: (B, N, S, 3) surface points, world frame, metres.
        normals: (B, N, S, 3) outward unit normals.
        present: (B, N) bool; absent objects hide nothing and are not seen.
        count: P, points to draw of each object (with repetition where fewer are visible).
        generator: the only source of randomness.
        eye, target: the camera's position and a point on its axis, world frame, metres.

    Returns:
        The clouds (B, N, P, 3), world frame, metres, and the visible shares (B, N) of the points.
    """
    batch, objects, surface, _ = points.shape
    device = points.device
    origin = torch.tensor(eye, device=device)
    forward = torch.nn.functional.normalize(torch.tensor(target, device=device) - origin, dim=0)
    right = torch.nn.functional.normalize(
        torch.linalg.cross(forward, torch.tensor([0.0, 0.0, 1.0], device=device)), dim=0
    )
    down = torch.linalg.cross(forward, right)

    rays = points - origin  # (B, N, S, 3)
    depth = rays @ forward  # (B, N, S)
    column = ((rays @ right) / depth / _CELL).round().long().clamp(-_GRID // 2, _GRID // 2 - 1) + _GRID // 2
    row = ((rays @ down) / depth / _CELL).round().long().clamp(-_GRID // 2, _GRID // 2 - 1) + _GRID // 2
    cell = (row * _GRID + column).view(batch, -1)
    occluding = torch.where(present[..., None], depth, torch.full_like(depth, math.inf)).view(batch, -1)
    nearest = torch.full((batch, _GRID * _GRID), math.inf, device=device)
    nearest.scatter_reduce_(1, cell, occluding, reduce="amin")
    in_front = (depth.view(batch, -1) < nearest.gather(1, cell) + _HIDDEN_BEHIND).view(batch, objects, surface)

    distance = rays.norm(dim=-1)
    facing = -(rays * normals).sum(-1) / distance  # cosine between normal and ray
    visible = in_front & (facing > 0.03) & present[..., None]
    # Gumbel keys: the highest `count` are a draw without repetition, with the density of pixels (cosine / distance^2).
    uniform = torch.rand(points.shape[:-1], generator=generator, device=device).clamp_(1e-9, 1 - 1e-7)
    keys = torch.log(facing.clamp(min=1e-3) / distance**2) - torch.log(-torch.log(uniform))
    keys = torch.where(visible, keys, torch.full_like(keys, -math.inf))
    order = keys.argsort(dim=-1, descending=True)  # (B, N, S)
    seen = visible.sum(-1).clamp(min=1)  # (B, N)
    pick = torch.arange(count, device=device).expand(batch, objects, count) % seen[..., None]
    index = order.gather(-1, pick)[..., None].expand(-1, -1, -1, 3)
    chosen, ray = points.gather(2, index), rays.gather(2, index)
    length = ray.norm(dim=-1, keepdim=True)
    noise = torch.randn(length.shape, generator=generator, device=device) * depth_noise(length)
    return chosen + ray / length * noise, visible.sum(-1) / surface
