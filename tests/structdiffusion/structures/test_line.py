"""A line holds when it is straight, even and across its heading, and fails once that is broken."""

from dataclasses import replace

import pytest

from grounding.spec import StructureSpec
from tests.structdiffusion.structures.handmade import HEADINGS, failures, moved, row


def test_a_line_and_how_it_is_broken():
    line, spec = row(), StructureSpec("line")
    assert failures(line, spec) == []
    assert failures([line[0], moved(line[1], dx=0.05), *line[2:]], spec) == ["distance to the line (m)"]
    assert failures([*line[:3], moved(line[3], dy=-0.06)], spec) == ["gap off the mean gap (m)"]
    assert failures([*line[:3], moved(line[3], dy=-0.02)], spec) == []  # off by 1.3 cm at most: forgiven
    assert failures([replace(line[0], rests_on=(1,)), *line[1:]], spec) == ["objects on top of others"]
    assert failures(line[:1], spec) == ["objects in the line"]
    assert failures([line[2], line[0], line[3], line[1]], spec) == []  # any order


@pytest.mark.parametrize(("rotation", "heading"), HEADINGS.items())
@pytest.mark.parametrize(("off", "right"), [(0, True), (20, True), (-20, True), (25, False), (90, False), (180, True)])
def test_a_line_runs_across_its_heading(rotation, heading, off, right):
    found = failures(row(degrees=heading + off), StructureSpec("line", rotation=rotation))
    assert found == ([] if right else ["line off perpendicular to its heading (deg)"])
