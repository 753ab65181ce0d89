"""The templated benchmark of goals: complete, deterministic, and about what is there."""

from grounding.goal_benchmark.rows import goal_scenes
from grounding.goal_benchmark.templates import FAMILIES, ROWS_OF_FAMILY, templated_goal_rows
from grounding.goals.parts import RELATIONS
from grounding.spec import SHAPES
from grounding.structure_words import KEYS


def test_every_family_shape_key_and_relation_is_there():
    rows = templated_goal_rows()
    counts = {family: sum(row.stratum == family for row in rows) for family in FAMILIES}
    assert len(rows) == sum(counts.values()) > 3000 and all(200 < count <= ROWS_OF_FAMILY for count in counts.values())
    assert len({(row.text, row.scene) for row in rows}) == len(rows)
    structures = [part for row in rows for goal in row.goals for part in goal.structures]
    assert {part.shape for part in structures} == set(SHAPES) - {"table setting"}
    assert {key for part in structures for key in part.keys} == set(KEYS)
    assert {part.relation for row in rows for goal in row.goals for part in goal.relations} == set(RELATIONS)
    assert {row.status for row in rows} == {"ok", "ask", "refused"}


def test_it_is_the_same_each_time():
    assert templated_goal_rows() == templated_goal_rows()


def test_goals_name_objects_that_are_there():
    for row in templated_goal_rows():
        count = len(goal_scenes()[row.scene])
        assert (row.status == "ok") == bool(row.goals)
        for goal in row.goals:
            assert all(0 <= index < count for index in goal.named_objects()), row.text
            assert goal.resolved(count)
