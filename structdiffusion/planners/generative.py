"""What every planner with a network does before it samples poses and after: encode once; set down, refine, rank."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch
from torch import Tensor

from grounding.spec import StructureSpec
from structdiffusion.completion.estimate import ObjectEstimate, estimate
from structdiffusion.models.backbone import Condition, PoseBackbone
from structdiffusion.models.checkpoint import require_sound
from structdiffusion.observation import Arrangement, Goal, ObjectCloud, Scene, Table
from structdiffusion.postprocessing.physics_reranking import tried_out
from structdiffusion.postprocessing.physics_rollout import Imagination
from structdiffusion.postprocessing.ranking import Ranker
from structdiffusion.postprocessing.refinement import align_cutlery, fit_to_size, separate
from structdiffusion.postprocessing.settling import settle
from structdiffusion.postprocessing.table_regions import shift_into_place
from structdiffusion.structures import STRUCTURES
from structdiffusion.word_tokens import word_ids

_FARTHEST = 1000.0  # m, from the robot: even an untrained network stays far below
_CLOUD_POINTS = 256  # as in training


@dataclass(frozen=True)
class Observed:
    """The N objects of a scene that take part, as networks take them.

    Attributes:
        objects: what their clouds tell of them.
        clouds: (N, 256, 3) world frame, metres.
        nouns: (N,) noun ids.
    """

    objects: list[ObjectEstimate]
    clouds: Tensor
    nouns: Tensor


@dataclass(frozen=True)
class Samples:
    """K samples in the making: what the network is told, and which object takes which place in each.

    Every sample has the objects in another order, since object i takes place i of the structure.

    Attributes:
        condition: K rows, the objects place by place.
        order: (K, N) the object of each place.
        means: (K, N, 3) of the clouds, place by place.
    """

    condition: Condition
    order: Tensor
    means: Tensor

    def __getitem__(self, rows: Tensor) -> Samples:
        """Some of them, or all in another order."""
        return Samples(self.condition[rows], self.order[rows], self.means[rows])

    def sampled(self, model: PoseBackbone, state: Tensor) -> Sampled:
        """What a state (K, 1 + N, 9) says.

        Raises:
            CheckpointError: for places that are none.
        """
        frame, position, turn = model.decode_state(state)
        for places in (frame, position, turn):
            require_sound(places, type(model).__name__, _FARTHEST)
        motion = torch.eye(4).repeat(*self.order.shape, 1, 1)
        motion[..., :3, :3] = turn
        motion[..., :3, 3] = position - torch.einsum("knij,knj->kni", turn, self.means)
        rows = torch.arange(len(motion))[:, None]
        motions = motion[rows, self.order.argsort(dim=1)].double().numpy()
        return Sampled(motions, frame.double().numpy(), self.order.numpy())


@dataclass(frozen=True)
class Sampled:
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
    def joined(cls, parts: Sequence[Sampled]) -> Sampled:
        """The samples of several, one after another."""
        rows = zip(*((part.motions, part.frames, part.orders) for part in parts))
        return cls(*(np.concatenate(row) for row in rows))


def observed(scene: Scene, goal: Goal, model: PoseBackbone, sentence: bool, generator: torch.Generator) -> Observed:
    """The scene as `model` takes it.

    Args:
        scene: what was perceived.
        goal: what is asked for.
        model: the network.
        sentence: whether it will be told the sentence's embedding rather than word tokens.
        generator: of the points that are drawn from the clouds.

    Raises:
        ValueError: when there is no embedding to be told, or the scene has too many objects.
    """
    most = model.config.max_objects
    if len(scene.objects) > most:
        raise ValueError(f"{len(scene.objects)} objects are more than this model knows; legal: 1 to {most}")
    if sentence and goal.embedding is None:
        raise ValueError("the sentence model needs a sentence embedding; for slots alone use model 'diffusion-tokens'")
    nouns = torch.tensor(model.noun_ids([cloud.category for cloud in scene.objects]))
    objects = [estimate(cloud) for cloud in scene.objects]
    return Observed(objects, sampled_clouds(scene.objects, generator), nouns)


def begin(
    model: PoseBackbone, seen: Observed, goal: Goal, sentence: bool, count: int, generator: torch.Generator
) -> Samples:
    """`count` samples of the scene, which is encoded once."""
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
    return Samples(condition, order, seen.clouds.mean(dim=1)[order])


@dataclass(frozen=True)
class Finish:
    """What becomes of samples before they are proposed. Each part can be left out, to measure what it is worth.

    Attributes:
        placed: set objects down (`settle`), and move the structure as a whole into the thirds asked for (`placement`).
        refined: correct sizes, roundness and gaps into the bands of the evaluation protocol, and move objects apart (`refinement`).
        ranker: gives the order; with none it is that of sampling.
        imagined: how many of the best-ranked are tried out in imagination (`imagination`).
    """

    placed: bool = True
    refined: bool = True
    ranker: Ranker | None = None
    imagined: int = 0

    def __call__(
        self, seen: Observed, scene: Scene, goal: Goal, sampled: Sampled, generator: torch.Generator
    ) -> list[Arrangement]:
        """The samples as arrangements, best first. Without a ranker every one counts as worth a try: its total is 1."""
        motions, frames = sampled.motions.copy(), sampled.frames.copy()
        others = [estimate(cloud) for cloud in scene.distractors]
        if self.placed:
            for row, frame in zip(motions, frames):
                self._place(seen.objects, others, row, frame, goal.spec, scene.table)
        arrangements = [Arrangement(row, {"total": 1.0}, frame) for row, frame in zip(motions, frames)]
        if self.ranker is not None:
            other_clouds = sampled_clouds(scene.distractors, generator)
            scores = self.ranker.scores(
                seen.objects, others, seen.clouds, other_clouds, seen.nouns, motions, goal.spec, scene.table,
                sampled.orders,
            )  # fmt: skip
            ranked = [replace(arrangement, scores=row) for arrangement, row in zip(arrangements, scores)]
            arrangements = sorted(ranked, key=lambda arrangement: -arrangement.scores["total"])
        if self.imagined:
            arrangements = tried_out(Imagination(scene), arrangements, goal.spec, self.imagined)
        return arrangements

    def _place(
        self,
        objects: Sequence[ObjectEstimate],
        others: Sequence[ObjectEstimate],
        motions: np.ndarray,
        frame: np.ndarray,
        spec: StructureSpec,
        table: Table,
    ) -> None:
        """Sets one arrangement (N, 4, 4) down, refines it, and moves it with its frame (4, 4), in place."""
        motions[:] = settle(objects, motions)
        if self.refined:
            motions[:] = fit_to_size(objects, motions, spec)
            motions[:] = align_cutlery(objects, motions, spec, math.atan2(frame[1, 0], frame[0, 0]))
        shift = shift_into_place(objects, motions, spec, table)
        motions[:, :2, 3] += shift
        frame[:2, 3] += shift
        if self.refined:
            motions[:] = separate(objects, others, motions)


def place_orders(
    objects: Sequence[ObjectEstimate], spec: StructureSpec, count: int, generator: torch.Generator
) -> Tensor:
    """Which object takes which place, (count, N), as in the demonstrations.

    Each structure says which object belongs where. With an open shape, the random order and those of the structures that
    need another take turns.
    """
    random = torch.rand(count, len(objects), generator=generator).argsort(dim=1).numpy()
    rng = np.random.default_rng(int(torch.randint(2**31, (1,), generator=generator)))
    items = [thing.layout_item() for thing in objects]
    structures = STRUCTURES.values() if spec.shape is None else (STRUCTURES[spec.shape],)
    ordered = [structure.order_places(items, random, rng) for structure in structures]
    orders = [order for order in ordered if order is not None]
    if spec.shape is None or not orders:
        orders.insert(0, random)
    return torch.from_numpy(np.stack(orders)[np.arange(count) % len(orders), np.arange(count)])


def sampled_clouds(clouds: Sequence[ObjectCloud], generator: torch.Generator) -> Tensor:
    """The clouds with 256 points each: (N, 256, 3), drawn without repetition where there are enough."""
    rows = []
    for cloud in clouds:
        points = torch.from_numpy(np.asarray(cloud.points, dtype=np.float32))
        order = torch.randperm(len(points), generator=generator)
        rows.append(points[order[torch.arange(_CLOUD_POINTS) % len(points)]])
    return torch.stack(rows) if rows else torch.zeros(0, _CLOUD_POINTS, 3)
