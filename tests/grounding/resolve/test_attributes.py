"""Sizes by which objects are told apart."""

from grounding.resolve.attributes import ObjectAttributes, by_size, of_size


def test_sizes_split_at_the_widest_step():
    heights = [0.10, 0.20, 0.11, 0.19]
    known = [ObjectAttributes((), (0.1, 0.1, height)) for height in heights]
    assert of_size("tall", known) == [1, 3]
    assert of_size("short", known) == [0, 2]
    assert by_size("tall", known) == [1, 3, 2, 0]
    assert of_size("tall", known[:1]) is None  # nothing to compare with
    assert of_size("tall", [*known, ObjectAttributes()]) is None
