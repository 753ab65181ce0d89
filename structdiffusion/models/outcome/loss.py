"""Training data and loss of the outcome discriminator: judged samples of the diffusion model."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import torch
from torch import Tensor, nn

from structdiffusion.data.batches import with_forgotten
from structdiffusion.data.npz_files import read_arrays
from structdiffusion.models.encoders import outline_features
from structdiffusion.models.outcome.model import OutcomeDiscriminator, gaps
from structdiffusion.rotations import yaw_matrices
from structdiffusion.simulation.partial_views import partial_views
from structdiffusion.tableware import noun_ids

VIEWS = 2  # of each scene: what the camera sees of it depends on noise alone
SAMPLES = 12  # of a scene in a step
UNNAMED, NAMELESS = 0.15, 0.3  # shares of the objects, and of the arrangements, whose nouns are not known
_POINTS = 256


@dataclass(frozen=True)
class JudgedScene:
    """What is seen of the K samples of one scene with N objects.

    Attributes:
        outlines: (V, K, N, 21), place by place, of V views.
        near: (V, K, N, N, 2) likewise.
        nouns: (K, N) ids.
        words: (5,) ids.
        right: (K,) float, 1 if the sample stands as asked.
    """

    outlines: Tensor
    near: Tensor
    nouns: Tensor
    words: Tensor
    right: Tensor


def judged_scenes(folder: Path) -> Iterator[JudgedScene]:
    """Load the judged proposals of a folder of training data, and look at each scene.

    Raises:
        FileNotFoundError: if there are none; the message names the command that makes them.
        DataFolderError: for a truncated or damaged file.
    """
    shards = sorted(folder.glob("judged_*.npz"))
    if not shards:
        raise FileNotFoundError(f"{folder} has no judged_*.npz; `structagent generate --proposals` makes them")
    library = read_arrays(folder / "library.npz", "points", "normals", "categories")
    surface = torch.from_numpy(library["points"]).float(), torch.from_numpy(library["normals"]).float()
    nouns = torch.tensor(noun_ids(library["categories"].tolist()))
    generator = torch.Generator().manual_seed(0)
    for shard in shards:
        columns = {name: torch.from_numpy(array) for name, array in read_arrays(shard).items()}
        for row in range(len(columns["objects"])):
            yield _looked_at({name: each[row] for name, each in columns.items()}, surface, nouns, generator)


def _looked_at(
    scene: dict[str, Tensor], surface: tuple[Tensor, Tensor], nouns: Tensor, generator: torch.Generator
) -> JudgedScene:
    ids, count = scene["objects"].long(), int(scene["count"])
    ids = ids[ids >= 0]
    turn, place = yaw_matrices(scene["initial"][: len(ids), 3]), scene["initial"][: len(ids), :3]
    points = torch.einsum("nij,nsj->nsi", turn, surface[0][ids]) + place[:, None]
    normals = torch.einsum("nij,nsj->nsi", turn, surface[1][ids])
    motions, order = scene["motions"][:, :count], scene["orders"][:, :count].long()
    rows = torch.arange(len(motions))[:, None]
    outlines, near = [], []
    for _ in range(VIEWS):
        there = torch.ones(1, len(ids), dtype=torch.bool)
        seen = partial_views(points[None], normals[None], there, _POINTS, generator)[0][0, :count]
        moved = torch.einsum("knij,npj->knpi", yaw_matrices(motions[..., 3]), seen) + motions[:, :, None, :3]
        in_place = moved[rows, order]
        outlines.append(outline_features(in_place))
        near.append(gaps(in_place))
    return JudgedScene(
        torch.stack(outlines), torch.stack(near), nouns[ids[:count]][order], scene["words"].long(),
        scene["right"].float(),
    )  # fmt: skip


def outcome_loss(
    model: OutcomeDiscriminator, scenes: list[JudgedScene], generator: torch.Generator, size: int = 32
) -> dict[str, Tensor]:
    """Return the binary cross-entropy over some samples of `size` scenes, of which some nouns are not known."""
    drawn = [scenes[int(torch.randint(len(scenes), (1,), generator=generator))] for _ in range(size)]
    most = max(scene.nouns.shape[1] for scene in drawn)
    batches = []
    for scene in drawn:
        view = int(torch.randint(len(scene.outlines), (1,), generator=generator))
        pick = torch.randperm(len(scene.right), generator=generator)[:SAMPLES]
        things = scene.nouns.shape[1]
        more = most - things
        present = (torch.arange(most) < things).expand(len(pick), -1)
        outlines = nn.functional.pad(scene.outlines[view, pick], (0, 0, 0, more))
        near = nn.functional.pad(scene.near[view, pick], (0, 0, 0, more, 0, more), value=1.0)
        nouns = nn.functional.pad(scene.nouns[pick], (0, more))
        batches.append((outlines, near, present, nouns, scene.words.expand(len(pick), -1), scene.right[pick]))
    device = next(model.parameters()).device
    *given, right = (torch.cat(parts).to(device) for parts in zip(*batches, strict=True))
    outlines, near, present, nouns, words = given
    nouns = with_forgotten(nouns, UNNAMED, NAMELESS, generator)
    logits = model.judged(outlines, near, present, nouns, words)
    loss = nn.functional.binary_cross_entropy_with_logits(logits, right)
    return {"loss": loss, "accuracy": ((logits > 0) == (right > 0.5)).float().mean()}
