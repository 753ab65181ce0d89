import numpy as np
import pytest

from grounding.goals.goal import Goal
from grounding.goals.parts import GoalError, PartReference, RelationPart, StructurePart
from grounding.spec import StructureSpec
from structdiffusion.geometry import pose_from_xyz_yaw
from structdiffusion.objects.model import ObjectModel
from structdiffusion.objects.procedural import procedural_object
from structdiffusion.objects.solids import assemble, box
from structdiffusion.protocol.goal_checks import asked_checks, goal_checks
from structdiffusion.protocol.physical_stability import executable_order, place_and_check
from structdiffusion.protocol.release import TabletopBodies
from structdiffusion.protocol.world_checks import semantic_checks
from structdiffusion.simulation.world import TabletopWorld


def block(side=0.05, height=0.05, category="block") -> ObjectModel:
    return assemble(
        category, category, [box(side, side, 0.0, height)], density=600.0, friction=0.6, color=(0.2, 0.5, 0.8),
        source="procedural", rng=np.random.default_rng(0),
    )  # fmt: skip


def at(x, y, z=0.0, yaw=0.0):
    return pose_from_xyz_yaw(x, y, z, yaw)


def failed(goal, *places, before=None, models=None, **more):
    """Names of the checks that fail where blocks stand at places."""
    models = models or [block()] * len(places)
    poses = [at(*place) for place in places]
    before = poses if before is None else [at(*place) for place in before]
    with TabletopWorld(models, poses) as world:
        checks = goal_checks(world, range(len(models)), goal, before, **more)
    assert checks
    return [check.name for check in checks if not check.passed]


def line(*objects, **keys):
    return StructurePart("line", objects=objects or None, **keys)


def test_every_part_of_a_goal_is_checked():
    goal = Goal((line(0, 1, 2, x_position="left"), StructurePart("tower", objects=(3, 4), x_position="right")))
    row = [(0.45, y) for y in (0.2, 0.3, 0.4)]
    tower = [(0.45, -0.3), (0.45, -0.3, 0.05)]
    assert failed(goal, *row, *tower) == []
    assert failed(goal, *row, (0.45, -0.3), (0.45, -0.2)) == [
        "tower (part 2): objects that rest on the next one below only",
        "tower (part 2): objects whose centroid lies over the one below",
    ]
    bent = [(0.45, 0.2), (0.55, 0.3), (0.45, 0.4)]
    assert failed(goal, *bent, *tower) == ["line (part 1): distance to the line (m)"]
    middle = [(0.45, y) for y in (-0.1, 0.0, 0.1)]
    assert failed(goal, *middle, *tower) == ["line (part 1): left: place in the range"]


def test_one_structure_is_checked_as_it_always_was():
    for places in ([(0.45, 0.0), (0.45, 0.1), (0.45, 0.2)], [(0.45, 0.0), (0.55, 0.1), (0.45, 0.2)]):
        for spec in (StructureSpec("line", "small"), StructureSpec("circle"), StructureSpec(x_position="center")):
            with TabletopWorld([block()] * 3, [at(*place) for place in places]) as world:
                asked = asked_checks(world, [0, 2], spec, [])
            with TabletopWorld([block()] * 3, [at(*place) for place in places]) as world:
                assert asked == semantic_checks(world, [0, 2], spec)
            goal = Goal((StructurePart.of(spec, (0, 2)),))
            with TabletopWorld([block()] * 3, [at(*place) for place in places]) as world:
                checks = goal_checks(world, range(3), goal, [at(*place) for place in places])
            assert checks[: len(asked)] == asked
            assert [check.name for check in checks[len(asked) :]] == ["move of what is not named (m)"]


def test_what_no_part_names_stays_unless_it_is_set_aside():
    goal = Goal((RelationPart("next to", (0,), (1,)),))
    places = [(0.45, 0.1), (0.45, 0.0), (0.3, -0.3), (0.3, 0.3)]
    assert failed(goal, *places) == []
    before = [(0.6, 0.1), (0.6, 0.0), (0.3, -0.3), (0.3, 0.3)]
    assert failed(goal, *places, before=before) == []  # what a part names may move
    for off, names in ((0.0099, []), (0.0101, ["move of what is not named (m)"])):
        moved = [*before[:3], (0.3, 0.3 + off)]
        assert failed(goal, *places, before=moved) == names
        assert failed(goal, *places, before=moved, aside=[3]) == []
        assert failed(goal, *places, before=moved, count=3) == names  # an object that the goal does not count
    stacked = [*places[:3], (0.3, -0.3, 0.05)]
    assert failed(goal, *stacked, before=before, aside=[3]) == ["block 4, set aside: things that it rests on"]
    with pytest.raises(ValueError, match="object 1 is named by the goal"):
        failed(goal, *places, aside=[1])


def test_a_structure_without_a_shape_beside_others_is_a_group_at_a_place():
    goal = Goal((StructurePart(objects=(0, 1, 2), x_position="left"), RelationPart("at", (3,), x_position="right")))
    group = [(0.3, 0.35), (0.5, 0.22), (0.6, 0.4)]
    assert failed(goal, *group, (0.4, -0.3)) == []
    assert failed(goal, *[(x, y - 0.3) for x, y in group], (0.4, -0.3)) == [
        "structure (part 1): left: place in the range"
    ]
    stacked = [(0.3, 0.35), (0.5, 0.3), (0.5, 0.3, 0.05)]
    assert failed(goal, *stacked, (0.4, -0.3)) == ["structure (part 1): objects on top of others"]


def test_a_structure_as_a_whole_is_an_object_and_a_reference():
    whole = PartReference(0)
    places = [(0.5, y) for y in (-0.1, 0.0, 0.1)]
    for part, far, near in (
        (RelationPart("left of", whole, (3,)), (0.5, -0.3), (0.5, 0.3)),
        (RelationPart("left of", (3,), whole), (0.5, 0.3), (0.5, -0.3)),
    ):
        goal = Goal((line(0, 1, 2), part))
        assert failed(goal, *places, far) == []
        assert [name.split(": ")[1] for name in failed(goal, *places, near)] == ["direction (deg off)"]


def test_swapped_and_moved_are_measured_from_where_things_stood():
    before = [(0.3, 0.2), (0.6, -0.2), (0.45, 0.0)]
    swapped = Goal((RelationPart("swapped", (0, 1)),))
    assert failed(swapped, (0.6, -0.2), (0.3, 0.2), (0.45, 0.0), before=before) == []
    assert failed(swapped, *before, before=before) == [
        "block 1 swapped block 2: off the other's place (m)", "block 2 swapped block 1: off the other's place (m)",
    ]  # fmt: skip
    moved = Goal((RelationPart("moved", (2,), distance=0.1, direction="left"),))
    assert failed(moved, (0.3, 0.2), (0.6, -0.2), (0.45, 0.1), before=before) == []
    assert failed(moved, (0.3, 0.2), (0.6, -0.2), (0.45, 0.08), before=before) == [
        "block 3 moved: moved left: off along (m)"
    ]


def test_a_line_along_an_edge_and_a_circle_around_an_object():
    along = Goal((line(0, 1, 2, along="near"),))
    assert failed(along, *[(0.329, y) for y in (-0.1, 0.0, 0.1)]) == []
    assert failed(along, *[(0.331, y) for y in (-0.1, 0.0, 0.1)]) == ["distance to the near edge (m)"]
    steep = [(0.25 + y * np.tan(np.radians(10.2)), y) for y in (-0.1, 0.0, 0.1)]
    assert failed(along, *steep) == ["line off the near edge (deg)"]
    left = Goal((line(0, 1, 2, along="left"),))
    assert failed(left, *[(x, 0.32) for x in (0.3, 0.4, 0.5)]) == []
    ring = [(0.45 + 0.12 * np.cos(a), 0.12 * np.sin(a)) for a in np.radians(range(0, 360, 90))]
    around = Goal((StructurePart("circle", objects=(0, 1, 2, 3), around=(4,)),))
    assert failed(around, *ring, (0.45, 0.0299)) == []
    assert failed(around, *ring, (0.45, 0.0301)) == ["centre off the block 5 (m)"]
    before = [*ring, (0.45, 0.0105)]
    assert failed(around, *ring, (0.45, 0.0), before=before) == ["move of the block 5 (m)"]


def test_a_spoon_in_a_mug_is_inside_and_beside_it_is_not():
    mug, cube = procedural_object("mug", 1), block(0.02, 0.02)
    goal = Goal((RelationPart("in", (1,), (0,)),))
    with TabletopWorld([mug, cube], [at(0.45, 0.0), at(0.45, 0.0, 0.03)]) as world:
        world.settle()
        checks = goal_checks(world, [0, 1], goal, [at(0.45, 0.0), at(0.3, 0.0)])
    assert all(check.passed for check in checks), checks
    assert failed(goal, (0.45, 0.0), (0.45, 0.15), models=[mug, cube]) != []


def test_only_what_moves_is_released_and_carriers_come_first():
    plate, cube = block(0.12, 0.02, "plate"), block(0.04, 0.04)
    initial = [at(0.3, 0.3), at(0.5, -0.2), at(0.5, 0.2)]
    bodies, goal = TabletopBodies([plate, cube, cube], initial), Goal((RelationPart("on", (1,), (0,)),))

    def motions(*goals):
        return np.stack([place @ np.linalg.inv(start) for place, start in zip(goals, initial)])

    verdict = place_and_check(bodies, motions(initial[0], at(0.3, 0.3, 0.021), initial[2]), goal)
    assert verdict.success and verdict.order == (1,), verdict.detail
    moved = place_and_check(bodies, motions(at(0.4, 0.0), at(0.4, 0.0, 0.021), initial[2]), goal)
    assert moved.success and moved.order == (0, 1)
    pushed = motions(initial[0], at(0.3, 0.3, 0.021), at(0.5, 0.25))
    assert place_and_check(bodies, pushed, goal).failure == "semantic"
    assert place_and_check(bodies, pushed, goal, aside=[2]).success
    onto = place_and_check(bodies, motions(initial[0], at(0.5, 0.21), initial[2]), goal)
    assert onto.failure == "intersection" and onto.penetrated == "block 2"  # what stays is there from the start


def test_carriers_come_first_even_where_their_bottoms_are_level():
    goals = np.stack([at(0.45, 0.0), at(0.45, 0.0, 0.003)])
    wide, narrow = block(0.1, 0.02), block(0.05)
    assert executable_order([wide, narrow], goals) == (0, 1)
    assert executable_order([wide, narrow], goals, {0: [1]}) == (1, 0)


@pytest.mark.parametrize(
    "goal, message",
    [
        (Goal((RelationPart("next to", (0,), (7,)),)), "names object 7; legal values: 0 to 2"),
        (Goal((RelationPart("next to", ("mug",), ("bowl",)),)), "in words; expected the indices of 3"),
        (Goal((line(0, 1), RelationPart("on", PartReference(0), (2,)))), "the line as a whole cannot be put on"),
        (Goal((line(0, 1), RelationPart("in", (2,), PartReference(0)))), "one object has to carry the other, not 2"),
        (Goal((line(0, 1), RelationPart("left of", PartReference(0), (1,)))), "a structure that it belongs to"),
        (Goal((line(0, 1, 2), RelationPart("between", (0,), PartReference(0)))), "it needs 2 references, got 3"),
        (
            Goal((line(0, 1, 2), StructurePart("tower"))),
            "takes all objects that no other part names, but there are none",
        ),
    ],
)
def test_goals_that_cannot_be_checked_are_refused(goal, message):
    with pytest.raises(GoalError, match=message):
        failed(goal, (0.4, 0.0), (0.4, 0.1), (0.4, 0.2))


@pytest.mark.parametrize("by", ["kind", "colour"])
def test_groups_hold_by_themselves_and_are_six_centimetres_apart(by):
    models = [block(), block(category="can"), block(), block(category="can")]
    goal = Goal((StructurePart("cluster", objects=(0, 1, 2, 3), group_by=by, x_position="center"),))
    more = {"models": models, "colors": ("red", "blue", "red", "blue")}

    def places(apart, within=0.07):
        return [(0.4, -0.05), (0.4 + 0.05 + apart, -0.05), (0.4, -0.05 + within), (0.4 + 0.05 + apart, -0.05 + within)]

    assert failed(goal, *places(0.0602), **more) == []
    assert failed(goal, *places(0.0598), **more) == ["clear gap between groups (m)"]
    names = failed(goal, *places(0.0602, within=0.0902), **more)
    assert len(names) >= 2 and all(name.startswith(("red: ", "blue: ", "block: ", "can: ")) for name in names)
    mixed = places(0.0602)
    assert failed(goal, *[mixed[i] for i in (0, 2, 1, 3)], **more) != []
    if by == "colour":
        with pytest.raises(GoalError, match="their colours are not known"):
            failed(goal, *places(0.0602), models=models)
