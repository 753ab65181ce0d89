import json
import math

import numpy as np
import pytest

from grounding.spec import StructureSpec
from structdiffusion.geometry import pose_from_xyz_yaw
from structdiffusion.objects.model import ObjectModel
from structdiffusion.objects.procedural import procedural_object
from structdiffusion.objects.solids import assemble, box, frustum
from structdiffusion.observation import Table
from structdiffusion.protocol.physical_stability import executable_order, place_and_check
from structdiffusion.protocol.release import TabletopBodies
from structdiffusion.protocol.world_checks import semantic_checks
from structdiffusion.simulation.world import TabletopWorld

LINE = StructureSpec("line")
INITIAL_X = 0.3


def solid(category: str, *parts: np.ndarray) -> ObjectModel:
    return assemble(
        category,
        category,
        parts,
        density=600.0,
        friction=0.6,
        color=(0.2, 0.5, 0.8),
        source="procedural",
        rng=np.random.default_rng(0),
    )


def block(length=0.06, width=0.06, height=0.05, category="block") -> ObjectModel:
    return solid(category, box(length, width, 0.0, height))


def at(x: float, y: float, z: float = 0.0, yaw: float = 0.0) -> np.ndarray:
    return pose_from_xyz_yaw(x, y, z, yaw)


def try_goals(models, goals, spec, table=Table(), others=()):
    initial = np.stack([at(INITIAL_X, 0.1 * k - 0.2, 0.0, 0.3 * k) for k in range(len(models))])
    motions = np.stack(goals) @ np.linalg.inv(initial)
    return place_and_check(TabletopBodies(models, initial, table, others), motions, spec)


def test_an_exact_line_of_boxes_succeeds():
    goals = [at(0.45, y) for y in (-0.2, -0.1, 0.0, 0.1)]
    verdict = try_goals([block()] * 4, goals, StructureSpec("line", rotation="north"))
    assert verdict.success and verdict.failure is None and verdict.failed_object is None
    assert verdict.checks and all(check.passed for check in verdict.checks)
    np.testing.assert_allclose(verdict.world_from_final, goals, atol=1e-3)
    assert verdict.measured["penetration"] < 1e-4
    assert 0.6 < verdict.measured["speed"] < 0.8  # the fall from 3 cm, and no more
    assert json.loads(json.dumps(verdict.to_dict()))["success"] is True


def test_the_same_arrangement_gives_the_same_verdict():
    goals = [at(0.45, 0.0), at(0.46, 0.0, 0.05), at(0.45, 0.005, 0.1)]
    first, second = (try_goals([block()] * 3, goals, StructureSpec("tower")) for _ in range(2))
    assert first.success
    assert first.measured == second.measured
    np.testing.assert_array_equal(first.world_from_final, second.world_from_final)


def test_a_bent_line_is_a_semantic_failure():
    verdict = try_goals([block()] * 3, [at(0.45, -0.1), at(0.55, 0.0), at(0.45, 0.1)], LINE)
    assert verdict.failure == "semantic"
    assert "distance to the line" in verdict.detail
    assert verdict.failed_object is None


@pytest.mark.parametrize("depth, failure", [(0.0015, None), (0.004, "intersection")])
def test_penetration_of_more_than_two_millimetres_is_an_intersection(depth, failure):
    verdict = try_goals([block()] * 2, [at(0.45, -0.1), at(0.45, -0.04 - depth)], StructureSpec("line"))
    assert verdict.failure == failure
    if failure:
        assert verdict.failed_object == "block 2"
        assert verdict.detail == "the block 2 would penetrate the block 1 by 4.0 mm, allowed 2 mm"
        assert verdict.measured["penetration"] == pytest.approx(depth, abs=1e-4)


def test_penetration_of_the_table_and_of_a_distractor():
    low = try_goals([block()] * 2, [at(0.45, -0.1), at(0.45, 0.1, -0.003)], LINE)
    assert low.failure == "intersection" and "penetrate the table by 3.0 mm" in low.detail and low.penetrated == "table"
    others = [(block(category="can"), at(0.45, 0.12))]
    hit = try_goals([block()] * 2, [at(0.45, -0.1), at(0.45, 0.1)], LINE, others=others)
    assert hit.failure == "intersection" and "penetrate the can by" in hit.detail and hit.penetrated == "can"


def test_off_the_table_is_an_abnormal_velocity():
    verdict = try_goals([block()] * 2, [at(0.45, 0.3), at(0.45, 0.47)], LINE)
    assert verdict.failure == "abnormal velocity" and verdict.failed_object == "block 2"
    small = Table(0.3, 0.5, -0.15, 0.15)
    assert try_goals([block()] * 2, [at(0.4, 0.0), at(0.4, 0.25)], LINE, small).failure == "abnormal velocity"


def test_dropped_from_high_up_is_an_abnormal_velocity():
    verdict = try_goals([block()] * 2, [at(0.45, -0.1), at(0.45, 0.1, 0.2)], LINE)
    assert verdict.failure == "abnormal velocity" and "m/s, allowed 1 m/s" in verdict.detail


def test_sliding_away_is_an_abnormal_velocity():
    corners = ((-0.08, 0.0), (0.08, 0.0), (-0.08, 0.16))
    wedge = solid("wedge", np.array([[x, y, z] for y in (-0.05, 0.05) for x, z in corners]))
    goal = at(0.45, 0.0, 0.10)
    goal[:3, :3] = [[math.sqrt(0.5), 0, math.sqrt(0.5)], [0, 1, 0], [-math.sqrt(0.5), 0, math.sqrt(0.5)]]
    verdict = try_goals([wedge, block(0.04, 0.04, 0.03)], [at(0.45, 0.0), goal], StructureSpec("tower"))
    assert verdict.failure == "abnormal velocity" and verdict.failed_object == "block"


def test_a_pencil_on_its_end_is_not_upright():
    pencil = solid("pencil", frustum(0.001, 0.004, 0.0, 0.01, 8), frustum(0.004, 0.004, 0.01, 0.08, 8))
    goal = at(0.45, 0.1)
    lean = 0.05
    goal[:3, :3] = [
        [math.cos(lean), 0, math.sin(lean)],
        [0, 1, 0],
        [-math.sin(lean), 0, math.cos(lean)],
    ]
    verdict = try_goals([block(), pencil], [at(0.45, -0.1), goal], LINE)
    assert verdict.failure == "not upright" and verdict.failed_object == "pencil"
    assert verdict.measured["tilt"] > math.radians(15)


def test_the_first_cause_counts():
    # The second block would intersect the third, but the first one is off the table before.
    goals = [at(0.45, 0.5), at(0.45, 0.0), at(0.45, 0.0)]
    verdict = try_goals([block(0.08, 0.08), block(0.07, 0.07), block()], goals, LINE)
    assert (verdict.failure, verdict.failed_object) == ("abnormal velocity", "block 1")
    assert np.isnan(verdict.world_from_final[2]).all()


def test_supports_come_first():
    plate, bowl = procedural_object("plate", 0), procedural_object("bowl", 0)
    order = executable_order([bowl, plate], np.stack([at(0.45, 0.0, 0.004), at(0.45, 0.0, 0.0)]))
    assert order == (1, 0)
    assert executable_order([block()] * 3, np.stack([at(0.4, 0, z) for z in (0.1, 0.0, 0.05)])) == (1, 2, 0)


def test_a_bowl_on_its_plate_and_a_cup_behind_make_a_setting():
    plate, bowl, mug = (procedural_object(kind, 1) for kind in ("plate", "bowl", "mug"))
    goals = [at(0.45, 0.0), at(0.45, 0.0, 0.012), at(0.60, -0.13)]
    verdict = try_goals([plate, bowl, mug], goals, StructureSpec("table setting"))
    assert verdict.failure is None, verdict.detail


def test_resting_on_a_distractor_is_no_structure():
    others = [(block(0.15, 0.15, 0.02, "book"), at(0.45, 0.0))]
    verdict = try_goals([block()] * 2, [at(0.45, -0.04, 0.02), at(0.45, 0.04, 0.02)], LINE, others=others)
    assert verdict.failure == "semantic" and "rest on a distractor" in verdict.detail


def test_checks_of_what_stands_in_a_world_already():
    poses = [at(0.45, 0.0), at(0.3, 0.3), at(0.45, 0.0, 0.05)]
    with TabletopWorld([block()] * 3, poses) as world:
        tower = semantic_checks(world, [0, 2], StructureSpec("tower"))
        line = semantic_checks(world, [0, 2], LINE)
    assert all(check.passed for check in tower)
    assert not all(check.passed for check in line)


def test_a_tower_that_also_leans_on_the_table_is_none_even_where_the_shape_is_open():
    ends = [(x, y, z) for y in (-0.03, 0.03) for x, z in ((-0.03, 0.0), (0.03, 0.0), (-0.002, 0.03), (0.002, 0.03))]
    roof, plank = solid("roof", np.array(ends)), solid("plank", box(0.16, 0.05, 0.0, 0.01))
    slope = math.atan2(0.03, 0.09)  # its low end is 9 cm before the ridge that it leans on
    leaning = at(0.45, 0.0)
    leaning[:3, :3] = [[math.cos(slope), 0, -math.sin(slope)], [0, 1, 0], [math.sin(slope), 0, math.cos(slope)]]
    leaning[:3, 3] = (0.36 + 0.08 * math.cos(slope), 0.0, 0.08 * math.sin(slope))
    for goal, held in ((leaning, False), (at(0.45, 0.0, 0.031), True)):  # the second lies level on the ridge
        with TabletopWorld([roof, plank], [at(0.45, 0.0), goal]) as world:
            world.settle()
            supports = world.supports(0.1)
            checks = semantic_checks(world, [0, 1], StructureSpec(x_position="center"))
        named = {check.name: check for check in checks}.get("objects that rest on the table and on another")
        assert (len(supports[1]) == 1) is held
        assert named is not None and named.passed is held


def test_wrong_shapes_are_named():
    with pytest.raises(ValueError, match=r"motions of 1 objects are \(1, 4, 4\), got \(2, 4, 4\)"):
        place_and_check(TabletopBodies([block()], np.eye(4)[None].repeat(2, 0)), np.eye(4)[None].repeat(2, 0), LINE)


def test_what_a_later_release_moves_is_measured(monkeypatch):
    """Something pushes the first by 2 of the 4 cm that are allowed while the second comes to rest."""
    goals = [at(0.45, y) for y in (-0.2, 0.0)]
    assert try_goals([block()] * 2, goals, LINE).measured["disturbed"] < 0.05
    settled, settle = [], TabletopWorld.settle

    def pushed(world, *arguments):
        settled.append(settle(world, *arguments))
        if len(settled) == 2:
            world.set_pose(0, at(0.02, 0.0) @ world.pose(0))
        return settled[-1]

    monkeypatch.setattr(TabletopWorld, "settle", pushed)
    verdict = try_goals([block()] * 2, goals, LINE)
    assert verdict.measured["disturbed"] == pytest.approx(0.5, abs=0.05)
    assert verdict.measured["displacement"] == pytest.approx(0.02, abs=0.002)


def test_equally_low_objects_are_released_from_far_to_near_as_the_arm_builds():
    wide, narrow, upper = block(0.1, 0.1), block(), block()
    goals = np.stack([at(0.3, 0.0), at(0.5, 0.0), at(0.5, 0.0, 0.05)])
    assert executable_order([wide, narrow, upper], goals) == (0, 1, 2)
    assert executable_order([wide, narrow, upper], goals, far_first=True) == (1, 0, 2)
