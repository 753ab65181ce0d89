"""What every planner with a network does before it samples poses and after: encode once; settle, shift, rank."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch
from torch import Tensor

from grounding.spec import StructureSpec
from structdiffusion.estimate import ObjectEstimate, estimate
from structdiffusion.layouts import setting_base, tower_order
from structdiffusion.models.backbone import Condition, PoseBackbone
from structdiffusion.models.encoders import word_ids
from structdiffusion.observation import Arrangement, Goal, ObjectCloud, Scene
from structdiffusion.placement import shift_into_place
from structdiffusion.ranking import Ranker
from structdiffusion.settle import settle

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

    def motions(self, model: PoseBackbone, state: Tensor) -> tuple[np.ndarray, np.ndarray]:
        """A state (K, 1 + N, 9) as motions (K, N, 4, 4) of the objects and structure frames (K, 4, 4)."""
        frame, position, turn = model.decode_state(state)
        motion = torch.eye(4).repeat(*self.order.shape, 1, 1)
        motion[..., :3, :3] = turn
        motion[..., :3, 3] = position - torch.einsum("knij,knj->kni", turn, self.means)
        rows = torch.arange(len(motion))[:, None]
        return motion[rows, self.order.argsort(dim=1)].double().numpy(), frame.double().numpy()


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


def finish(
    seen: Observed,
    scene: Scene,
    goal: Goal,
    motions: np.ndarray,
    frames: np.ndarray,
    ranker: Ranker | None,
    generator: torch.Generator,
) -> list[Arrangement]:
    """Sampled motions (K, N, 4, 4) and frames (K, 4, 4) set down, moved into place and ranked, best first.

    Without a ranker the order stays, and every arrangement counts as worth a try: its total is 1.
    """
    motions, frames = np.array([settle(seen.objects, row) for row in motions]), frames.copy()
    for row, frame in zip(motions, frames):
        shift = shift_into_place(seen.objects, row, goal.spec, scene.table)
        row[:, :2, 3] += shift
        frame[:2, 3] += shift
    arrangements = [Arrangement(row, {"total": 1.0}, frame) for row, frame in zip(motions, frames)]
    if ranker is None:
        return arrangements
    others = [estimate(cloud) for cloud in scene.distractors]
    other_clouds = sampled_clouds(scene.distractors, generator)
    scores = ranker.scores(
        seen.objects, others, seen.clouds, other_clouds, seen.nouns, motions, goal.spec, scene.table
    )
    ranked = [replace(arrangement, scores=row) for arrangement, row in zip(arrangements, scores)]
    return sorted(ranked, key=lambda arrangement: -arrangement.scores["total"])


def place_orders(
    objects: Sequence[ObjectEstimate], spec: StructureSpec, count: int, generator: torch.Generator
) -> Tensor:
    """Which object takes which place, (count, N), as in the demonstrations.

    Random around a ring and along a line; what carries goes below in a tower; the base of a table setting
    comes first. With an open shape, every third sample has the order of each.
    """
    random = torch.rand(count, len(objects), generator=generator).argsort(dim=1)
    rng = np.random.default_rng(int(torch.randint(2**31, (1,), generator=generator)))
    items = [thing.layout_item() for thing in objects]
    stacked = torch.tensor([tower_order(items, rng) for _ in range(count)])
    base = setting_base(items)
    first = (random == base).long().argsort(dim=1, descending=True, stable=True)
    based = random.gather(1, first)
    if spec.shape is None:
        third = (torch.arange(count) % 3)[:, None]
        return torch.where(third == 0, random, torch.where(third == 1, stacked, based))
    return {"tower": stacked, "table setting": based}.get(spec.shape, random)


def sampled_clouds(clouds: Sequence[ObjectCloud], generator: torch.Generator) -> Tensor:
    """The clouds with 256 points each: (N, 256, 3), drawn without repetition where there are enough."""
    rows = []
    for cloud in clouds:
        points = torch.from_numpy(np.asarray(cloud.points, dtype=np.float32))
        order = torch.randperm(len(points), generator=generator)
        rows.append(points[order[torch.arange(_CLOUD_POINTS) % len(points)]])
    return torch.stack(rows) if rows else torch.zeros(0, _CLOUD_POINTS, 3)
