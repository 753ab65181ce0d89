"""Scores of reading goals: parts in any order, lengths within 1 %, and what is dropped, invented or wrong."""

from grounding.goals.comparison import compare_goals
from grounding.goals.goal import Goal
from grounding.goals.parts import Order, PartReference, RelationPart, StructurePart

LINE = StructurePart("line", objects=(2, 4, 5), gap=0.05)
TOWER = StructurePart("tower", objects=(6, 7), x_position="left")
BEFORE = RelationPart("in front of", (0,), PartReference(0))


def test_the_order_of_parts_and_of_objects_does_not_matter_and_references_follow_their_part() -> None:
    read = Goal(
        (
            TOWER,
            StructurePart("line", objects=(5, 4, 2), gap=0.0504),
            RelationPart("in front of", (0,), PartReference(1)),
        )
    )
    assert compare_goals(read, Goal((LINE, TOWER, BEFORE))).exact


def test_a_reference_to_another_part_is_wrong() -> None:
    comparison = compare_goals(
        Goal((LINE, TOWER, RelationPart("in front of", (0,), PartReference(1)))), Goal((LINE, TOWER, BEFORE))
    )
    assert not comparison.exact
    assert comparison.wrong == ("reference",)


def test_two_alike_structures_that_a_relation_tells_apart_are_matched_by_it() -> None:
    one, other = StructurePart("circle", objects=(0, 1, 2)), StructurePart("circle", objects=(3, 4, 5))
    read = Goal((one, other, RelationPart("behind", (6,), PartReference(0))))
    assert compare_goals(read, Goal((other, one, RelationPart("behind", (6,), PartReference(1))))).exact
    assert not compare_goals(read, Goal((other, one, RelationPart("behind", (6,), PartReference(0))))).exact


def test_what_is_dropped_invented_filled_or_wrong_is_counted_apart() -> None:
    truth = Goal((LINE, BEFORE))
    assert compare_goals(Goal((LINE,)), truth).dropped == (1,)
    assert compare_goals(Goal((LINE, BEFORE, TOWER)), truth).false_parts == (2,)
    filled = StructurePart("line", size="small", objects=(2, 4, 5), gap=0.05)
    assert compare_goals(Goal((filled, BEFORE)), truth).false_fills == ("size",)
    shorter = StructurePart("line", objects=(2, 4), gap=0.06)
    assert compare_goals(Goal((shorter, BEFORE)), truth).wrong == ("objects", "gap")
    emptied = StructurePart("line", objects=(2, 4, 5))
    assert compare_goals(Goal((emptied, BEFORE)), truth).wrong == ("gap",)


def test_a_listed_order_is_the_order_of_the_objects() -> None:
    def listed(objects: tuple[int, ...], start: str) -> Goal:
        return Goal((StructurePart("line", objects=objects, order=Order("listed", None, start)),))

    assert compare_goals(listed((1, 2, 3), "left"), listed((3, 2, 1), "right")).exact
    assert not compare_goals(listed((1, 2, 3), "left"), listed((3, 2, 1), "left")).exact


def test_lengths_differ_by_at_most_one_percent() -> None:
    def apart(gap: float) -> Goal:
        return Goal((StructurePart("line", gap=gap),))

    assert compare_goals(apart(0.0509), apart(0.0504)).exact
    assert not compare_goals(apart(0.0511), apart(0.0504)).exact


def test_one_relation_of_two_objects_is_two_relations_of_one() -> None:
    together = Goal((RelationPart("in", (3, 1), (0,)), LINE, RelationPart("behind", (8,), PartReference(1))))
    apart = Goal(
        (
            RelationPart("in", (1,), (0,)),
            RelationPart("in", (3,), (0,)),
            LINE,
            RelationPart("behind", (8,), PartReference(2)),
        )
    )
    assert compare_goals(together, apart).exact
    assert compare_goals(Goal(apart.parts[1:3]), together).dropped
    assert not compare_goals(Goal((RelationPart("swapped", (3, 1)),)), Goal((RelationPart("swapped", (3, 2)),))).exact


def test_the_rest_is_the_same_as_its_objects_in_a_known_scene() -> None:
    rest = Goal((StructurePart("circle", around=(0,)),))
    listed = Goal((StructurePart("circle", objects=(1, 2, 3), around=(0,)),))
    assert compare_goals(rest, listed, count=4).exact
    assert not compare_goals(rest, listed, count=5).exact
    assert not compare_goals(rest, listed).exact
