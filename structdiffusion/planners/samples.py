"""The inputs of the networks for a scene, encoded once, and the decoding of samples to motions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch
from torch import Tensor

from grounding.spec import StructureSpec
from structdiffusion.completion.estimate import ObjectEstimate, estimate
from structdiffusion.models.backbone import Condition, PoseBackbone
from structdiffusion.models.checkpoint import require_sound
from structdiffusion.observation import ObjectCloud, Scene, StructureGoal
from structdiffusion.structures import OPEN_SHAPES, structure_named
from structdiffusion.word_tokens import UnknownWordError, require_known_words, word_ids

_FARTHEST = 1000.0  # m, from the robot: even an untrained network stays far below
_CLOUD_POINTS = 256  # as in training


@dataclass(frozen=True)
class EncodedScene:
    """The N objects of a scene that take part, encoded for the networks.

    Attributes:
        objects: the estimates from their clouds.
        clouds: (N, 256, 3) world frame, metres.
        nouns: (N,) noun ids.
    """

    objects: list[ObjectEstimate]
    clouds: Tensor
    nouns: Tensor


@dataclass(frozen=True)
class SampleBatch:
    """K samples to be drawn: the conditioning input, and which object takes which place in each.

    Every sample has the objects in another order, since object i takes place i of the structure.

    Attributes:
        condition: K rows, the objects place by place.
        order: (K, N) the object of each place.
        means: (K, N, 3) of the clouds, place by place.
    """

    condition: Condition
    order: Tensor
    means: Tensor

    def __getitem__(self, rows: Tensor) -> SampleBatch:
        """Select some of them, or all in another order."""
        return SampleBatch(self.condition[rows], self.order[rows], self.means[rows])

    def decode(self, model: PoseBackbone, state: Tensor) -> PoseSamples:
        """Decode a state (K, 1 + N, 9) to motions and frames.

        Raises:
            CheckpointError: for places that are not finite, or far off the table.
        """
        frame, position, turn = model.decode_state(state)
        for places in (frame, position, turn):
            require_sound(places, type(model).__name__, _FARTHEST)
        motion = torch.eye(4).repeat(*self.order.shape, 1, 1)
        motion[..., :3, :3] = turn
        motion[..., :3, 3] = position - torch.einsum("knij,knj->kni", turn, self.means)
        rows = torch.arange(len(motion))[:, None]
        motions = motion[rows, self.order.argsort(dim=1)].double().numpy()
        return PoseSamples(motions, frame.double().numpy(), self.order.numpy())


@dataclass(frozen=True)
class PoseSamples:
    """K samples as a network gives them.

    Attributes:
        motions: (K, N, 4, 4) of the objects, world frame.
        frames: (K, 4, 4) world_from_structure.
        orders: (K, N) the object of each place.
    """

    motions: np.ndarray
    frames: np.ndarray
    orders: np.ndarray

    @classmethod
    def concatenate(cls, parts: Sequence[PoseSamples]) -> PoseSamples:
        """Concatenate samples."""
        rows = zip(*((part.motions, part.frames, part.orders) for part in parts))
        return cls(*(np.concatenate(row) for row in rows))


def encode_scene(
    scene: Scene, goal: StructureGoal, model: PoseBackbone, sentence: bool, generator: torch.Generator
) -> EncodedScene:
    """Encode a scene as an input of `model`.

    Args:
        scene: the observation.
        goal: the request.
        model: the network.
        sentence: whether its input is the sentence's embedding rather than word tokens.
        generator: draws the points from the clouds.

    Raises:
        ValueError: if the embedding is missing, or the scene has too many objects.
        UnknownWordError: if the network was not trained on a requested value.
    """
    most = model.config.max_objects
    if len(scene.objects) > most:
        raise UnknownWordError(f"{len(scene.objects)} objects are more than this model can place; legal: 1 to {most}")
    if sentence and goal.embedding is None:
        raise ValueError("the sentence model needs a sentence embedding; for slots alone use model 'diffusion-tokens'")
    require_known_words(goal.spec, model.config.vocabulary, model.kind)
    nouns = torch.tensor(model.noun_ids([cloud.category for cloud in scene.objects]))
    objects = [estimate(cloud) for cloud in scene.objects]
    return EncodedScene(objects, sample_clouds(scene.objects, generator), nouns)


def prepare_samples(
    model: PoseBackbone, seen: EncodedScene, goal: StructureGoal, sentence: bool, count: int, generator: torch.Generator
) -> SampleBatch:
    """Prepare `count` samples of a scene, which is encoded once."""
    condition = model.condition(
        seen.clouds[None],
        torch.ones(1, len(seen.clouds), dtype=torch.bool),
        seen.nouns[None],
        words=torch.tensor([word_ids(goal.spec)]),
        sentence=torch.from_numpy(goal.embedding).float()[None] if sentence else None,
    ).repeat(count)
    order = place_orders(seen.objects, goal.spec, count, generator)  # (K, N)
    rows = torch.arange(count)[:, None]
    condition = replace(condition, objects=condition.objects[rows, order])
    return SampleBatch(condition, order, seen.clouds.mean(dim=1)[order])


def place_orders(
    objects: Sequence[ObjectEstimate], spec: StructureSpec, count: int, generator: torch.Generator
) -> Tensor:
    """Draw which object takes which place, (count, N), as in the demonstrations.

    Each structure says which object belongs where. With an open shape, the random order and those of the structures
    that need another take turns.
    """
    random = torch.rand(count, len(objects), generator=generator).argsort(dim=1).numpy()
    rng = np.random.default_rng(int(torch.randint(2**31, (1,), generator=generator)))
    items = [thing.layout_item() for thing in objects]
    structures = OPEN_SHAPES.values() if spec.shape is None else (structure_named(spec.shape),)
    ordered = [structure.order_places(items, random, rng) for structure in structures]
    orders = [order for order in ordered if order is not None]
    if spec.shape is None or not orders:
        orders.insert(0, random)
    return torch.from_numpy(np.stack(orders)[np.arange(count) % len(orders), np.arange(count)])


def sample_clouds(clouds: Sequence[ObjectCloud], generator: torch.Generator) -> Tensor:
    """Draw 256 points of each cloud, (N, 256, 3), without repetition where there are enough."""
    rows = []
    for cloud in clouds:
        points = torch.from_numpy(np.asarray(cloud.points, dtype=np.float32))
        order = torch.randperm(len(points), generator=generator)
        rows.append(points[order[torch.arange(_CLOUD_POINTS) % len(points)]])
    return torch.stack(rows) if rows else torch.zeros(0, _CLOUD_POINTS, 3)
