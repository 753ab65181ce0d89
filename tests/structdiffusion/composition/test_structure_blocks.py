"""What a planner proposes for a structure is kept where it is that structure, and laid out where nothing of it is."""

import numpy as np
import pytest
import torch

from grounding.goals.parts import StructurePart
from structdiffusion.composition.structure_blocks import StructureBlocks
from structdiffusion.observation import Arrangement
from structdiffusion.planners.geometric import GeometricPlanner
from structdiffusion.protocol.goal_keys import Grouping
from structdiffusion.structures import STRUCTURES
from tests.structdiffusion.composition.test_placement import table_of


class SomeLines:
    """A planner whose first proposals are exact, and whose others are straight lines whatever was asked for."""

    def __init__(self, exact: int) -> None:
        self.exact, self.asked = exact, 0

    def propose(self, scene, goal, *, count, generator):
        self.asked += 1
        arrangements = GeometricPlanner().propose(scene, goal, count=count, generator=generator)
        proposed = []
        for number, arrangement in enumerate(arrangements):
            motions = arrangement.goal_from_initial.copy()
            for place, cloud in enumerate(scene.objects if number >= self.exact else ()):
                middle = motions[place, :3, :3] @ cloud.points.mean(axis=0)
                motions[place, :2, 3] = np.array([0.45, 0.1 * place - 0.2]) - middle[:2]
            proposed.append(Arrangement(motions, {"total": 0.5 + 0.01 * number}))
        return proposed


@pytest.mark.parametrize("shape", ["grid", "cross", "triangle", "square", "rectangle", "arc"])
def test_only_proposals_that_are_the_structure_are_kept(shape):
    scene, state = table_of(np.random.default_rng(1))
    part = StructurePart(shape, objects=(0, 1, 2, 3, 4))

    def proposed(exact):
        planner = SomeLines(exact)
        blocks = StructureBlocks(planner, scene, state, Grouping()).propose(part, 5, torch.Generator().manual_seed(0))
        assert planner.asked == 1
        for block in blocks:
            bodies = [state.items[i].body_after(block.motions_at(np.array([0.45, 0.0]))[i]) for i in part.objects]
            assert all(check.passed for check in STRUCTURES[shape].check(bodies, part.spec, state.table))
        return [block.quality for block in blocks]

    assert proposed(2)[:2] == [0.5, 0.51]
    assert proposed(0) == [1.0] * 5  # exact layouts


def test_a_requested_key_is_laid_out_and_never_asked_of_the_planner():
    scene, state = table_of(np.random.default_rng(1))
    planner = SomeLines(5)
    part = StructurePart("grid", objects=(0, 1, 2, 3), rows=2, columns=2)
    StructureBlocks(planner, scene, state, Grouping()).propose(part, 3, torch.Generator().manual_seed(0))
    assert planner.asked == 0
