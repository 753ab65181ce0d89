"""Propose structures as rigid blocks: from a planner of one structure, or as exact layouts where a key forces them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
import torch

from grounding.goals.parts import StructurePart
from grounding.spec import StructureSpec
from structdiffusion.composition.blocks import Block
from structdiffusion.composition.items import Item, TableState
from structdiffusion.composition.layout_choices import heading_of, in_another_order, size_of
from structdiffusion.evaluation_protocol import MIN_GROUP_GAP
from structdiffusion.footprints import clear_gap, turned
from structdiffusion.observation import Arrangement, Scene, StructureGoal
from structdiffusion.postprocessing.physics_reranking import rerank_by_physics
from structdiffusion.postprocessing.physics_rollout import PhysicsRollout
from structdiffusion.protocol.goal_keys import Grouping
from structdiffusion.protocol.goal_semantic import only_placed
from structdiffusion.structures import OPEN_SHAPES, structure_named
from structdiffusion.structures.keys import structure_keys
from structdiffusion.structures.structure import LIFT, LayoutError, a_structure
from structdiffusion.word_tokens import UnknownWordError

_CLEAR = 0.015  # m between the objects of a structure and what it is laid around
_WIDER = 1.04  # factor by which a structure grows until it clears what it is laid around
_MOST_WIDER = 60
_GROUPS_APART = MIN_GROUP_GAP + 0.015  # m
_TRIED_STACKS = 10  # stacks that are tried in physics, until two stand under every hypothesis
_ENOUGH_STACKS = 2
# Share of hypotheses under which a proposed stack stands that is kept; one that was not tried has as much.
_STANDS = 0.5


class StructurePlanner(Protocol):
    """A planner of one structure (see `structdiffusion.planners.factory.Planner`)."""

    def propose(
        self, scene: Scene, goal: StructureGoal, *, count: int = 64, generator: torch.Generator
    ) -> list[Arrangement]:
        """Propose arrangements of the scene's objects, best first."""


@dataclass(frozen=True)
class StructureBlocks:
    """Proposals for the structures of a goal.

    Attributes:
        planner: proposes structures without keys; `None` for exact layouts only. Shapes that it was not taught are laid
            out too, and so is a structure none of whose proposals passes its checks.
        scene: the observation.
        state: the same, completed.
        grouping: by which colours objects can be grouped.
    """

    planner: StructurePlanner | None
    scene: Scene
    state: TableState
    grouping: Grouping

    def propose(self, part: StructurePart, count: int, generator: torch.Generator) -> list[Block]:
        """Propose up to `count` blocks, best first.

        Raises:
            LayoutError: if these objects cannot make this structure on this table.
        """
        members = part.indices
        rng = np.random.default_rng(int(torch.randint(2**31, (1,), generator=generator)))
        blocks: list[Block] = []
        exact = part.shape is not None and structure_named(part.shape).exact
        if self.planner is not None and not part.keys and not only_placed(part) and not exact:
            try:
                blocks = self._planned(part, members, count, generator)
            except UnknownWordError:
                blocks = []
        if not blocks:
            blocks = self._laid_out(part, members, count, rng)
        return self._that_fit(part, blocks)

    def _planned(
        self, part: StructurePart, members: tuple[int, ...], count: int, generator: torch.Generator
    ) -> list[Block]:
        if part.shape is not None:
            self._require_suitable(part, [self.state.items[i] for i in members])
        assert self.planner is not None
        own = replace(self.scene.on_the_table().select(members), distractors=())
        arrangements = self.planner.propose(own, StructureGoal(part.spec), count=count, generator=generator)
        if part.shape is not None and structure_named(part.shape).stacks:
            arrangements = self._tried(own, members, arrangements, part)
            arrangements = [one for one in arrangements if one.scores["rollout"] > _STANDS]
        blocks = []
        for arrangement in arrangements:
            motions = {}
            for place, index in enumerate(members):
                lowered = np.eye(4)
                lowered[2, 3] = -self.state.items[index].bottom
                motions[index] = arrangement.goal_from_initial[place] @ lowered
            if self._holds(part, motions):
                blocks.append(self._block(part, motions, float(arrangement.scores["total"])))
        return blocks

    def _holds(self, part: StructurePart, motions: Mapping[int, np.ndarray]) -> bool:
        """Return whether what a planner proposed passes its checks, wherever it stands; stacks are tried in physics."""
        if part.shape is None or structure_named(part.shape).stacks:
            return True
        bodies = [self.state.items[i].body_after(motion) for i, motion in motions.items()]
        spec = replace(part.spec, x_position=None, y_position=None)
        return all(check.passed for check in structure_named(part.shape).check(bodies, spec, self.state.table))

    def _laid_out(
        self, part: StructurePart, members: tuple[int, ...], count: int, rng: np.random.Generator
    ) -> list[Block]:
        blocks: list[Block] = []
        reason: LayoutError | None = None
        for number in range(count):
            try:
                spec = replace(part.spec, size=size_of(part, number), x_position=None, y_position=None)
                if only_placed(part):
                    spec = StructureSpec("cluster") if len(members) > 1 else spec
                if part.group_by is not None:
                    motions = self._grouped(part, spec, members, rng)
                else:
                    ordered = in_another_order(part, self.state, number, rng)
                    motions = self._drawn(ordered, spec, ordered.indices, heading_of(part, number, rng), rng)
                blocks.append(self._block(part, motions, 1.0))
            except LayoutError as error:
                reason = reason or error
        if not blocks and reason is not None:
            raise reason
        structure = None if part.shape is None else structure_named(part.shape)
        if structure is not None and structure.stacks and not structure.exact:  # what is exact is tried as a whole
            blocks = self._tried_blocks(part, members, blocks)
        return blocks

    def _drawn(
        self,
        part: StructurePart,
        spec: StructureSpec,
        members: Sequence[int],
        heading: float,
        rng: np.random.Generator,
    ) -> dict[int, np.ndarray]:
        """Draw one exact layout about the origin, and return the motion of each object."""
        if spec.shape is None and len(members) == 1:
            return {members[0]: self.state.items[members[0]].motion_to((0.0, 0.0), 0.0, 0.0)}
        listed = part.order is not None and part.order.by == "listed"
        own = list(members) if listed else [members[i] for i in rng.permutation(len(members))]
        items = [self.state.items[i] for i in own]
        shape = spec.shape or self._open_shape(spec, items, rng)
        draft = structure_named(shape).draft(
            [item.layout_item() for item in items], replace(spec, shape=shape), heading, rng, structure_keys(part)
        )
        offsets = self._widened(part, items, draft.order, draft.offsets, draft.turns)
        return {
            own[i]: items[i].motion_to(offsets[place], float(draft.turns[place]), float(draft.heights[place]) + LIFT)
            for place, i in enumerate(draft.order)
        }

    def _open_shape(self, spec: StructureSpec, items: Sequence[Item], rng: np.random.Generator) -> str:
        able = [
            name
            for name, structure in OPEN_SHAPES.items()
            if structure.can_carry(spec)
            and len(items) >= structure.least
            and not structure.stacks
            and structure.nouns is None
        ]
        if not able:
            raise LayoutError(f"no shape can be built with {len(items)} objects")
        return str(rng.choice(able))

    def _widened(
        self, part: StructurePart, items: Sequence[Item], order: Sequence[int], offsets: np.ndarray, turns: np.ndarray
    ) -> np.ndarray:
        """Return the offsets (N, 2), by place, scaled about the centre until all objects clear the object in the
        middle.
        """
        if part.around is None:
            return offsets
        middle = self.state.items[part.around[0]]  # type: ignore[index]
        inner = middle.outline - middle.centroid
        outlines = [turned(items[i].outline - items[i].centroid, turn) for i, turn in zip(order, turns, strict=True)]
        for step in range(_MOST_WIDER):
            grown = offsets * _WIDER**step
            if all(clear_gap(outline + at, inner) >= _CLEAR for outline, at in zip(outlines, grown, strict=True)):
                if step and part.gap is not None:
                    raise LayoutError(
                        f"a {part.shape} with gaps of {part.gap * 100:.3g} cm does not clear the {middle.name} in its "
                        "middle"
                    )
                if step and part.radius is not None:
                    raise LayoutError(
                        f"a {part.shape} with a radius of {part.radius * 100:.3g} cm does not clear the {middle.name} "
                        "in its middle"
                    )
                return grown
        raise LayoutError(f"no {part.shape} of these objects clears the {middle.name} in its middle")

    def _grouped(
        self, part: StructurePart, spec: StructureSpec, members: Sequence[int], rng: np.random.Generator
    ) -> dict[int, np.ndarray]:
        """Draw one layout for each group, side by side in one or two rows, and return the motion of each object."""
        kinds = [self.state.items[i].cloud.category for i in members]
        groups = list(self.grouping.groups(kinds, members, part.group_by or "").values())
        assert part.shape is not None
        least = structure_named(part.shape).least
        blocks = []
        for places in (groups[i] for i in rng.permutation(len(groups))):
            own = [members[i] for i in places]
            if len(own) < least:
                motions = {i: self.state.items[i].motion_to((0.3 * k, 0.0), 0.0, LIFT) for k, i in enumerate(own)}
            else:
                motions = self._drawn(
                    replace(part, group_by=None), spec, own, float(rng.uniform(-math.pi, math.pi)), rng
                )
            blocks.append(Block.of({i: self.state.items[i] for i in own}, motions))
        rows = 1 + int(len(blocks) > 2)
        columns = math.ceil(len(blocks) / rows)
        width = max(np.ptp(block.points[:, 1]) for block in blocks) + _GROUPS_APART
        depth = max(np.ptp(block.points[:, 0]) for block in blocks) + _GROUPS_APART
        together: dict[int, np.ndarray] = {}
        for number, block in enumerate(blocks):
            cell = np.array([depth * (number // columns), width * (number % columns)])
            middle = 0.5 * (block.points.min(axis=0) + block.points.max(axis=0))
            together |= block.motions_at(cell - middle)
        return together

    def _block(self, part: StructurePart, motions: Mapping[int, np.ndarray], quality: float) -> Block:
        items = {i: self.state.items[i] for i in motions}
        bodies = [items[i].body_after(motion) for i, motion in motions.items()]
        middles = np.array([body.centroid for body in bodies])
        centre = structure_named(part.shape).centre(bodies) if part.shape is not None else middles.mean(axis=0)
        return Block.of(items, motions, centre, quality)

    def _tried_blocks(self, part: StructurePart, members: tuple[int, ...], blocks: Sequence[Block]) -> list[Block]:
        """Return laid-out stacks as physics ranks them, in the middle of the table."""
        own = replace(self.scene.on_the_table().select(members), distractors=())
        table = self.state.table
        middle = np.array([0.5 * (table.x_min + table.x_max), 0.5 * (table.y_min + table.y_max)])
        raised = []
        for block in blocks:
            motions = block.motions_at(middle)
            rows = np.array([motions[i] for i in members])
            rows[:, 2, 3] += [self.state.items[i].bottom for i in members]
            raised.append(Arrangement(rows, {"total": block.quality}))
        arrangements = self._tried(own, members, raised, part)
        result = []
        for arrangement in arrangements:
            rows = arrangement.goal_from_initial.copy()
            rows[:, 2, 3] -= [self.state.items[i].bottom for i in members]
            result.append(self._block(part, dict(zip(members, rows, strict=True)), float(arrangement.scores["total"])))
        return result

    def _tried(
        self, own: Scene, members: Sequence[int], arrangements: Sequence[Arrangement], part: StructurePart
    ) -> list[Arrangement]:
        """Return the stacks that stand best in physics rollouts of the first of them, best first."""
        bodies = []
        for index in members:
            item = self.state.items[index]
            pose = item.pose.copy()
            pose[2, 3] -= item.bottom
            bodies.append((item.model, pose))
        spec = replace(part.spec, x_position=None, y_position=None)
        ranked = rerank_by_physics(
            PhysicsRollout(own, bodies), arrangements, spec, _TRIED_STACKS, enough=_ENOUGH_STACKS, sure=math.inf
        )
        best = max(arrangement.scores["rollout"] for arrangement in ranked)
        return [arrangement for arrangement in ranked if arrangement.scores["rollout"] == best]

    def _require_suitable(self, part: StructurePart, items: Sequence[Item]) -> None:
        """Raise a `LayoutError` for too few objects, or a stack of several that nothing can stand on."""
        assert part.shape is not None
        structure = structure_named(part.shape)
        structure.require_enough([item.layout_item() for item in items])
        round_ones = [item.name for item in items if item.seen.rounded]
        if structure.stacks and len(round_ones) > 1:
            raise LayoutError(
                f"a {part.shape} cannot have the {round_ones[0]} and the {round_ones[1]}: nothing stands on either"
            )

    def _that_fit(self, part: StructurePart, blocks: Sequence[Block]) -> list[Block]:
        """Return the blocks that are no larger than the table.

        Raises:
            LayoutError: if all are.
        """
        table = self.state.table
        room = np.array([table.x_max - table.x_min, table.y_max - table.y_min])
        sizes = [np.ptp(block.points, axis=0) for block in blocks]
        fits = [block for block, size in zip(blocks, sizes) if (size <= room).all()]
        if not fits:
            size = min(sizes, key=lambda one: float((one - room).max()))
            asked = f" {part.length * 100:.4g} cm long" if part.length is not None else ""
            raise LayoutError(
                f"{a_structure(part.shape or 'structure')}{asked} of these objects takes at least {size[0]:.2f} m in "
                "depth and "
                f"{size[1]:.2f} m in width, and the table has only {room[0]:.2f} m and {room[1]:.2f} m"
            )
        return fits
