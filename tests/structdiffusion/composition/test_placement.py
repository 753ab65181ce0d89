"""Random goals without physics: every placement that is drawn meets the checks, and clears everything."""

import itertools

import numpy as np
import pytest
import torch

from grounding.goals.goal import Goal
from grounding.goals.parts import DIRECTIONAL, PartReference, RelationPart, StructurePart
from structdiffusion.completion.estimate import estimate
from structdiffusion.composition.items import Item, TableState
from structdiffusion.composition.placement import NoPlaceError, Placer
from structdiffusion.composition.structure_blocks import StructureBlocks
from structdiffusion.composition.units import Units
from structdiffusion.footprints import clear_gap
from structdiffusion.geometry import pose_from_xyz_yaw, transform_points
from structdiffusion.objects.solids import assemble, box, frustum
from structdiffusion.observation import ObjectCloud, Scene, Table
from structdiffusion.protocol.goal_keys import Grouping
from structdiffusion.protocol.goal_semantic import check_goal
from structdiffusion.relations.bonds import bonds_of

PLACES = [(0.28, 0.32), (0.45, 0.3), (0.62, 0.33), (0.3, 0.0), (0.6, 0.02), (0.28, -0.3), (0.62, -0.32)]


def table_of(rng) -> tuple[Scene, TableState]:
    """Seven known bodies, boxes and cans of any size; nothing is left to estimate."""
    items, clouds = [], []
    for index, place in enumerate(PLACES):
        side, height = rng.uniform(0.03, 0.08), rng.uniform(0.04, 0.1)
        part = box(side, side, 0.0, height) if index % 2 else frustum(side / 2, side / 2, 0.0, height, 24)
        name = f"thing {index + 1}"
        model = assemble(
            name, "thing", [part], density=500.0, friction=0.5, color=(0.5, 0.5, 0.5), source="procedural",
            rng=np.random.default_rng(0),
        )  # fmt: skip
        pose = pose_from_xyz_yaw(*place, 0.0, float(rng.uniform(-3, 3)))
        points = transform_points(pose, model.surface_points.astype(np.float64)).astype(np.float32)
        clouds.append(ObjectCloud(name, "thing", points))
        items.append(Item(index, clouds[-1], estimate(clouds[-1]), model, pose, hollow=False))
    return Scene(tuple(clouds)), TableState(tuple(items), len(items), Table())


def random_goal(rng) -> Goal:
    """One structure, and two or three relations of single objects, each to what is named before it."""
    shape = str(rng.choice(["line", "circle", "triangle", "cluster"]))
    parts = [StructurePart(shape, objects=(0, 1, 2), x_position=str(rng.choice(["left", "center", "right"])))]
    known = [PartReference(0), (6,)]
    for index in (3, 4, 5)[: int(rng.integers(2, 4))]:
        name = str(rng.choice((*DIRECTIONAL, "next to")))
        distance = float(rng.uniform(0.02, 0.08)) if rng.random() < 0.3 else None
        parts.append(RelationPart(name, (index,), known[int(rng.integers(len(known)))], distance=distance))
        known.append((index,))
    return Goal(tuple(parts))


def test_every_placement_meets_all_checks_and_clears_everything():
    rng, drawn, without = np.random.default_rng(4), 0, 0
    for number in range(12):
        scene, state = table_of(rng)
        goal = random_goal(rng).resolved(7)
        units = Units(goal, bonds_of(goal), state)
        made = units.make(StructureBlocks(None, scene, state, Grouping()), 6, torch.Generator().manual_seed(number))
        moved = {i for unit in made for i in unit.members}
        placer = Placer(state, made, units.bonds, frozenset(range(7)) - moved)
        for draw in range(4):
            try:
                placement = placer.draw(draw, rng)
            except NoPlaceError as error:
                assert "\n" not in str(error)
                without += 1
                continue
            drawn += 1
            standing = state.standing(placement.bodies)
            failed = [check for check in check_goal(standing, goal, 7) if not check.passed]
            assert not failed, (str(goal), failed)
            assert placement.margin > 0 and set(placement.bodies) == set(placement.motions) == moved
            for i, j in itertools.combinations(range(7), 2):
                if {i, j} & moved and not {i, j} <= {0, 1, 2}:
                    assert clear_gap(standing.bodies[i].footprint, standing.bodies[j].footprint) >= 0.0099
            for i in moved:
                assert Table().overhang(standing.bodies[i].footprint) == 0
                there = transform_points(placement.motions[i], np.append(state.items[i].centroid, 0.0))
                np.testing.assert_allclose(there[:2], standing.bodies[i].centroid, atol=1e-9)
    assert drawn >= 36 and drawn + without == 48


def test_units_come_after_what_they_are_placed_by():
    scene, state = table_of(np.random.default_rng(0))
    parts = [RelationPart("left of", (i,), (i + 1,)) for i in range(5)]
    goal = Goal(tuple(parts)).resolved(7)
    units = Units(goal, bonds_of(goal), state)
    made = units.make(StructureBlocks(None, scene, state, Grouping()), 4, torch.Generator().manual_seed(0))
    assert [unit.members for unit in made] == [(4,), (3,), (2,), (1,), (0,)]


def test_what_stands_on_something_is_found():
    scene, state = table_of(np.random.default_rng(0))
    assert dict(state.carriers) == {} and state.carried_by(0) == []
    lower = state.items[0]
    pose = pose_from_xyz_yaw(*lower.centroid, lower.model.height, 0.0)
    cloud = ObjectCloud("top", "thing", scene.objects[1].points, bottom=lower.model.height)
    upper = Item(7, cloud, estimate(cloud), state.items[1].model, pose, hollow=False)
    stacked = TableState((*state.items, upper), 8, Table())
    assert dict(stacked.carriers) == {7: 0} and stacked.carried_by(0) == [7]
    assert stacked.standing().bodies[7].rests_on == (0,)


@pytest.mark.parametrize("seed", range(3))
def test_an_upright_motion_puts_centroid_and_bottom_where_they_are_wanted(seed):
    rng = np.random.default_rng(seed)
    item = table_of(rng)[1].items[int(rng.integers(7))]
    place, turn, bottom = rng.uniform(0.2, 0.6, 2), float(rng.uniform(-3, 3)), float(rng.uniform(0, 0.2))
    body = item.body_after(item.motion_to(place, turn, bottom))
    np.testing.assert_allclose(body.centroid, place, atol=1e-9)
    assert body.z_bottom == pytest.approx(bottom) and body.z_top == pytest.approx(bottom + item.model.height)
