"""The planner of goals of several parts: from a goal and an observed scene to ranked arrangements of all its objects.

Structures come from a planner of one structure, as rigid blocks; relations, keys and places decide where the blocks and
the single objects go, all together; physics rollouts of the whole decide which arrangement is best.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import torch

from grounding.goals.goal import Goal
from grounding.goals.parts import GoalError, StructurePart
from grounding.spec import FIRST_SHAPES, StructureSpec
from structdiffusion.composition.contradictions import require_consistent
from structdiffusion.composition.items import TableState
from structdiffusion.composition.placement import NoPlaceError, Placement, Placer, Unit
from structdiffusion.composition.structure_blocks import StructureBlocks, StructurePlanner
from structdiffusion.composition.units import Units
from structdiffusion.observation import Scene, StructureGoal
from structdiffusion.planners.diffusion import DiffusionPlanner
from structdiffusion.planners.geometric import GeometricPlanner
from structdiffusion.postprocessing.build_order import NoOrderError
from structdiffusion.postprocessing.physics_reranking import steadiness
from structdiffusion.postprocessing.physics_rollout import STACKED, PhysicsRollout
from structdiffusion.protocol.goal_keys import Grouping
from structdiffusion.protocol.goal_semantic import bond_name
from structdiffusion.protocol.physical_stability import Verdict
from structdiffusion.relations.bonds import bonds_of, require_indices
from structdiffusion.structures import structure_named
from structdiffusion.structures.structure import LayoutError

_BLOCKS = 16  # proposals for each structure of a goal of several parts
_DRAWS = 32  # placements that are drawn at most,
_WANTED = 8  # until so many have been found,
_HOPELESS = 10  # or, after so many draws, none
_TRIED = 6  # placements that are tried in physics at most,
_ENOUGH = 2  # until so many stand
_HYPOTHESES = 3  # about what the camera did not see, for placements in which something stands on something
_UNTRIED, _FELL = 0.5, 0.1  # scores of a placement that was not tried, and of one that does not stand


@dataclass(frozen=True)
class GoalArrangement:
    """One proposed arrangement of everything that a goal moves.

    Attributes:
        moved: the indices of the scene's objects that are picked and placed.
        aside: the objects that only make room; they end upright on the table.
        goal_from_initial: (N, 4, 4) float64, the motion of each of the scene's objects; the identity for what stays.
        scores: each in [0, 1], larger is better; "total" decides.
        order: what is moved, in the order in which it has to be placed; () for any order with supports first.
    """

    moved: tuple[int, ...]
    aside: tuple[int, ...]
    goal_from_initial: np.ndarray
    scores: Mapping[str, float] = field(default_factory=dict)
    order: tuple[int, ...] = ()


class GoalPlanner:
    """A planner of goals of several parts, based on a planner of single structures.

    Args:
        planner: proposes structures.
        ask: makes the goal of `planner` from the slots of one structure: with a sentence, for planners that are
            conditioned on it.
    """

    def __init__(
        self, planner: StructurePlanner, ask: Callable[[StructureSpec], StructureGoal] = StructureGoal
    ) -> None:
        self.planner, self.ask = planner, ask

    def propose(
        self,
        scene: Scene,
        goal: Goal,
        *,
        count: int = 64,
        generator: torch.Generator,
        colors: Sequence[str] | None = None,
    ) -> list[GoalArrangement]:
        """Propose arrangements, best first.

        A goal of one plain structure gets exactly what the planner of structures proposes for it, if every network
        knows its shape.

        Args:
            scene: the observation: all objects that the goal indexes, wherever they stand, and the distractors.
            goal: the goal, with indices of the scene's objects.
            count: how many arrangements of one plain structure are proposed. Of other goals there are as many as were
                found.
            generator: the only source of randomness.
            colors: the name of each object's colour, for goals that group by it.

        Raises:
            LayoutError: if these objects cannot do this on this table; one sentence says why.
            GoalError: for a goal that does not fit the scene, or whose relations have no meaning.
        """
        if not goal.parts:
            raise GoalError("the goal has no parts")
        resolved = require_indices(goal, len(scene.objects))
        if goal.plain_spec is not None and goal.plain_spec.shape in (None, *FIRST_SHAPES):
            return self._plain(scene, resolved, self.ask(goal.plain_spec), count, generator)
        bonds = bonds_of(resolved)
        names = [cloud.name for cloud in (*scene.objects, *scene.distractors)]
        require_consistent(resolved, bonds, names)
        composer = _Composer(scene, resolved, TableState.of(scene), Grouping(colors), generator)
        return composer.arrangements(Units(resolved, bonds, composer.state), _without_physics(self.planner))

    def _plain(
        self, scene: Scene, goal: Goal, asked: StructureGoal, count: int, generator: torch.Generator
    ) -> list[GoalArrangement]:
        part = goal.parts[0]
        assert isinstance(part, StructurePart)
        members = part.indices
        flat = scene.on_the_table().select(members)
        arrangements = self.planner.propose(flat, asked, count=count, generator=generator)
        proposed = []
        for arrangement in arrangements:
            motions = np.tile(np.eye(4), (len(scene.objects), 1, 1))
            for place, index in enumerate(members):
                lowered = np.eye(4)
                lowered[2, 3] = -scene.objects[index].bottom
                motions[index] = arrangement.goal_from_initial[place] @ lowered
            moved = tuple(index for index in members if index not in scene.fixed)
            proposed.append(GoalArrangement(moved, (), motions, arrangement.scores))
        return proposed


@dataclass(frozen=True)
class _Composer:
    """Composes one goal on one table."""

    scene: Scene
    goal: Goal
    state: TableState
    grouping: Grouping
    generator: torch.Generator

    def arrangements(self, units: Units, planner: StructurePlanner) -> list[GoalArrangement]:
        """Return the arrangements, best first."""
        blocks = StructureBlocks(planner, self.scene, self.state, self.grouping)
        moving = units.make(blocks, _BLOCKS, self.generator)
        rng = np.random.default_rng(int(torch.randint(2**31, (1,), generator=self.generator)))
        found, reason = [], ""
        for movable, clearing in ((False, False), (True, False), (False, True), (True, True)):
            placements, why = self._placements(units, moving, movable, clearing, rng)
            found += placements
            reason = reason or why
            if found:
                break
        if not found:
            raise LayoutError(reason)
        return self._ranked(units, found)

    def _placements(
        self, units: Units, moving: Sequence[Unit], movable: bool, clearing: bool, rng: np.random.Generator
    ) -> tuple[list[tuple[Placement, set[int]]], str]:
        """Draw placements and what each sets aside; without any, why.

        Args:
            units, moving: the objects that the goal moves.
            movable: whether reference objects may move although the goal does not ask for it.
            clearing: whether objects that no part names may be set aside.
            rng: of the draws.
        """
        own = {i for unit in moving for i in unit.members}
        named: set[int] = set(self.goal.named_objects())  # type: ignore[arg-type]
        fixed = {i for part in self.goal.structures for i in part.around or ()} | set(self.scene.fixed)
        references = sorted(named - own - fixed) if movable else []
        if movable and not references:
            return [], ""
        together = units.ordered([*moving, *(units.single(i, optional=True) for i in references)])
        moved = own | set(references)
        on_top = {i for index in moved for i in self.state.carried_by(index)} - moved
        self._require_movable(on_top, named)
        everything = frozenset(range(len(self.state.items)))
        stays = everything - moved - on_top
        unnamed = {i for i in stays if i < self.state.count} - named - set(self.scene.fixed)
        removable = frozenset(unnamed) if clearing else frozenset()
        if clearing and not removable:
            return [], ""
        placer = Placer(self.state, together, units.bonds, stays, removable, frozenset(self.scene.fixed))
        found, reason = [], ""
        for number in range(_DRAWS):
            try:
                placement = placer.draw(number, rng)
                aside = set(on_top)
                for index in placement.in_the_way:
                    aside |= {index, *self.state.carried_by(index)}
                self._require_movable(aside, named)
                self._set_aside(units, placement, aside, everything - moved - aside, rng)
                found.append((placement, aside))
            except NoPlaceError as error:
                reason = reason or str(error)
            if len(found) >= _WANTED or (number + 1 >= _HOPELESS and not found):
                break
        return found, reason

    def _require_movable(self, aside: set[int], named: set[int]) -> None:
        for index in aside:
            if index >= self.state.count or index in self.scene.fixed:
                above, below = self.state.items[index], self.state.items[self.state.carriers[index]]
                raise LayoutError(f"the {above.name} stands on the {below.name}, and cannot be moved")
            if index in named and index in self.state.carriers:
                above, below = self.state.items[index], self.state.items[self.state.carriers[index]]
                raise LayoutError(
                    f"the {above.name} stands on the {below.name} and would fall: say where the {above.name} is to go "
                    "first"
                )

    def _set_aside(
        self, units: Units, placement: Placement, aside: set[int], stays: frozenset[int], rng: np.random.Generator
    ) -> None:
        """Place what makes room anywhere that is free."""
        if not aside:
            return
        free = Placer(self.state, (), (), stays)
        for index in sorted(aside):
            free.place(units.single(index), placement, 0, rng)

    def _ranked(self, units: Units, found: Sequence[tuple[Placement, set[int]]]) -> list[GoalArrangement]:
        """Try the placements in physics, and return them as arrangements, best first."""
        rollout = PhysicsRollout(self.scene, self.state.bodies)
        rows = sorted(found, key=lambda row: (len(row[1]), -row[0].margin * row[0].quality))
        tried: list[tuple[float, GoalArrangement]] = []
        falls: list[Verdict] = []
        if self._is_exact:
            return self._in_order(rollout, rows)
        for number, (placement, aside) in enumerate(rows):
            enough = sum(share == 1.0 for share, _ in tried) >= _ENOUGH
            if number < _TRIED and not enough:
                tried.append(self._tried(rollout, placement, aside, falls))
            else:
                tried.append((_UNTRIED, self._arrangement(self._motions(placement), placement, aside, _UNTRIED)))
        if len(falls) == min(_TRIED, len(rows)):
            self._require_carried(units, falls)
        # Those that were not tried come after those that stand, and before those that fall.
        return [arrangement for _, arrangement in sorted(tried, key=lambda row: -row[0])]

    @property
    def _is_exact(self) -> bool:
        """Return whether the goal copies an example exactly: then nothing is built that was not tried in its order."""
        shapes = [part.shape for part in self.goal.structures if part.shape is not None]
        return any(structure_named(shape).exact for shape in shapes)

    def _in_order(self, rollout: PhysicsRollout, rows: Sequence[tuple[Placement, set[int]]]) -> list[GoalArrangement]:
        """Return the first placements for which an order of building was found that stands at every moment.

        Raises:
            LayoutError: if there is none; the message says what falls.
        """
        found: list[list[GoalArrangement]] = []
        reason = ""
        for placement, aside in rows[:_TRIED]:
            motions = self._motions(placement)
            stays = [i for i in range(len(motions)) if i not in placement.motions or i in self.scene.fixed]
            motions = rollout.set_down(motions, stays, self.goal)
            try:
                orders = rollout.build_orders(motions, stays)
            except NoOrderError as error:
                reason = reason or str(error)
                continue
            verdict = rollout.verdict(motions, self.goal, 0, stays, sorted(aside), self.grouping.colors, orders[0])
            if not verdict.success:
                reason = reason or f"the best goal does not hold in physics: {verdict.detail}"
                continue
            one = self._arrangement(motions, placement, aside, 1.0)
            found.append([replace(one, order=order) for order in orders])
            if len(found) >= _ENOUGH:
                break
        if not found:
            raise LayoutError(reason)
        return [one for number in range(max(map(len, found))) for ways in found for one in ways[number : number + 1]]

    def _tried(
        self, rollout: PhysicsRollout, placement: Placement, aside: set[int], falls: list[Verdict]
    ) -> tuple[float, GoalArrangement]:
        """Return the share of hypotheses under which a placement stands, and the arrangement; add its falls."""
        motions = self._motions(placement)
        stays = [i for i in range(len(motions)) if i not in placement.motions or i in self.scene.fixed]
        motions = rollout.set_down(motions, stays, self.goal)
        stacked = any(motions[i, 2, 3] + self.scene.objects[i].bottom > STACKED for i in placement.motions)
        hypotheses = _HYPOTHESES if stacked else 1
        stood = 0.0
        for hypothesis in range(hypotheses):
            verdict = rollout.verdict(motions, self.goal, hypothesis, stays, sorted(aside), self.grouping.colors)
            stood += steadiness(verdict)
            if not verdict.success and not stood:
                falls.append(verdict)
                break
        share = stood / hypotheses
        return share, self._arrangement(motions, placement, aside, max(_FELL, share))

    def _require_carried(self, units: Units, falls: Sequence[Verdict]) -> None:
        """Raise a `LayoutError` if every trial failed because an object fell off its support."""
        for bond in units.bonds:
            if not bond.relation.carried:
                continue
            (index,) = bond.members
            name, said = self.state.items[index].name, bond_name(self.state.standing(), bond, self.goal)
            if all(fall.failed_object == name or fall.detail.startswith(f"{said}: ") for fall in falls):
                carrier = self.state.items[bond.references[0][0]].name
                raise LayoutError(
                    f"the {name} does not come to rest {bond.part.relation} the {carrier}: {falls[0].detail}"
                )

    def _motions(self, placement: Placement) -> np.ndarray:
        motions = np.tile(np.eye(4), (self.state.count, 1, 1))
        for index, motion in placement.motions.items():
            motions[index] = motion
        return motions

    def _arrangement(
        self, motions: np.ndarray, placement: Placement, aside: set[int], rollout: float
    ) -> GoalArrangement:
        scores = {"margin": placement.margin, "quality": placement.quality, "rollout": rollout}
        total = {"total": float(np.prod(list(scores.values())))}
        moved = tuple(sorted(placement.motions.keys() - set(self.scene.fixed)))
        return GoalArrangement(moved, tuple(sorted(aside)), motions, {**scores, **total})


def _without_physics(planner: StructurePlanner) -> StructurePlanner:
    """Return a planner that proposes by word tokens and tries nothing in physics: the whole is tried later.

    The sentence of a goal of several parts describes no single structure.
    """
    bare: Any = copy(planner)
    if isinstance(bare, GeometricPlanner):
        bare.rollouts = 0
    elif hasattr(bare, "post_process"):
        bare.post_process = bare.post_process.without_physics()
    if isinstance(bare, DiffusionPlanner):
        bare.sentence, bare.candidates = False, None
    return bare
