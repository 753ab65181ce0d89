"""Training data and loss of the collision discriminator: pairs of partial views (paper section IV.E)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import torch
from torch import Tensor, nn

from structdiffusion.data.npz_files import read_arrays
from structdiffusion.evaluation_protocol import MAX_PENETRATION
from structdiffusion.models.collision.model import CollisionDiscriminator
from structdiffusion.rotations import yaw_matrices
from structdiffusion.simulation.partial_views import partial_views

_POINTS = 256


@dataclass(frozen=True)
class PairBatches:
    """Pairs of `pairs.npz` and `library.npz`, from which batches are drawn (see `collision_pairs.py`).

    Attributes:
        surface, normals: (M, S, 3) of the library.
        objects: (K, 2) ids; poses: (K, 2, 4) x, y, z, yaw; distance: (K,) metres.
    """

    surface: Tensor
    normals: Tensor
    objects: Tensor
    poses: Tensor
    distance: Tensor

    @classmethod
    def load(cls, folder: str | Path, device: torch.device | str = "cpu") -> PairBatches:
        """Load the pairs from a folder of demonstrations.

        Raises:
            FileNotFoundError: for a missing file; the message names the command that makes it.
            DataFolderError: for a truncated or damaged file.
        """
        folder = Path(folder)
        for name in ("library.npz", "pairs.npz"):
            if not (folder / name).is_file():
                raise FileNotFoundError(f"{folder} has no {name}; make it with `structagent generate --out {folder}`")
        library = read_arrays(folder / "library.npz", "points", "normals")
        pairs = read_arrays(folder / "pairs.npz", "objects", "poses", "distance")
        arrays = (*library.values(), *pairs.values())
        surface, normals, objects, poses, distance = (torch.from_numpy(array).to(device) for array in arrays)
        return cls(surface.float(), normals.float(), objects.long(), poses, distance)

    def draw(self, size: int, generator: torch.Generator) -> tuple[Tensor, Tensor, Tensor]:
        """Draw clouds (B, P, 3) of both objects at their poses, and the distances (B,).

        Each object is seen somewhere on the table before it moves to its pose, so that its hidden side is independent
        of its partner.
        """
        device = self.objects.device
        pick = torch.randint(len(self.objects), (size,), generator=generator, device=device)
        ids, poses = self.objects[pick], self.poses[pick]  # (B, 2), (B, 2, 4)

        def rand(*shape: int) -> Tensor:
            return torch.rand(shape, generator=generator, device=device)

        spin = (rand(size, 1) * 2 - 1) * math.pi  # the pair as a whole has a random heading
        whole = yaw_matrices(spin).expand(-1, 2, -1, -1)
        yaw_before = (rand(size, 2) * 2 - 1) * math.pi
        place = torch.stack(
            (0.22 + 0.46 * rand(size, 2), 0.8 * rand(size, 2) - 0.4, torch.zeros(size, 2, device=device)), dim=-1
        )
        before = yaw_matrices(yaw_before)
        points = torch.einsum("bnij,bnsj->bnsi", before, self.surface[ids]) + place[:, :, None]
        normals = torch.einsum("bnij,bnsj->bnsi", before, self.normals[ids])
        # Two scenes with one object each, so that neither hides the other.
        flat = (points.flatten(0, 1)[:, None], normals.flatten(0, 1)[:, None])
        alone = torch.ones(2 * size, 1, dtype=torch.bool, device=device)
        seen = partial_views(*flat, alone, _POINTS, generator)[0].view(size, 2, _POINTS, 3)
        local = torch.einsum("bnji,bnpj->bnpi", before, seen - place[:, :, None])
        at_pose = torch.einsum("bnij,bnpj->bnpi", yaw_matrices(poses[..., 3]), local) + poses[:, :, None, :3]
        at_pose = torch.einsum("bnij,bnpj->bnpi", whole, at_pose)
        return at_pose[:, 0], at_pose[:, 1], self.distance[pick]


def collision_loss(
    model: CollisionDiscriminator, pairs: PairBatches, generator: torch.Generator, size: int = 64
) -> dict[str, Tensor]:
    """Return the binary cross-entropy of "penetrates by more than the evaluation protocol allows"."""
    first, second, distance = pairs.draw(size, generator)
    hit = (distance < -MAX_PENETRATION).float()
    logits = model(first, second)
    loss = nn.functional.binary_cross_entropy_with_logits(logits, hit)
    return {"loss": loss, "accuracy": ((logits > 0) == (hit > 0.5)).float().mean()}
