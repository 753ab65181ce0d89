"""The 6-d representation of rotations in the networks."""

from __future__ import annotations

import torch
from torch import Tensor


def rotation_from_6d(six: Tensor) -> Tensor:
    """Return rotation matrices (..., 3, 3) of 6-d representations (..., 6), by Gram-Schmidt.

    The two vectors a, b of paper section IV.B (Zhou et al. 2019) become the first two columns.
    """
    a, b = six[..., :3], six[..., 3:]
    x = torch.nn.functional.normalize(a, dim=-1)
    y = torch.nn.functional.normalize(b - (x * b).sum(-1, keepdim=True) * x, dim=-1)
    return torch.stack((x, y, torch.linalg.cross(x, y)), dim=-1)


def rotation_to_6d(matrix: Tensor) -> Tensor:
    """Return the 6-d representation (..., 6) of rotation matrices (..., 3, 3): their first two columns."""
    return torch.cat((matrix[..., :, 0], matrix[..., :, 1]), dim=-1)


def yaw_matrices(yaw: Tensor) -> Tensor:
    """Return rotations (..., 3, 3) about z."""
    c, s, zero, one = yaw.cos(), yaw.sin(), torch.zeros_like(yaw), torch.ones_like(yaw)
    return torch.stack((c, -s, zero, s, c, zero, zero, zero, one), dim=-1).unflatten(-1, (3, 3))
