"""An arc holds while it is round, spans about half a circle and is open where it should be, and fails just beyond."""

import numpy as np
import pytest

from grounding.spec import StructureSpec
from structdiffusion.evaluation_protocol import ARC_DEGREES, MAX_ARC_OFF_DEGREES
from structdiffusion.structures.arc import Arc
from tests.structdiffusion.structures.handmade import HEADINGS, arc, failures, moved, ring_at

SPEC = StructureSpec("arc")


@pytest.mark.parametrize(
    ("span", "failed"),
    [
        (ARC_DEGREES[0] + 1, []), (ARC_DEGREES[0] - 1, ["span of the arc (deg)"]),
        (ARC_DEGREES[1] - 1, []), (ARC_DEGREES[1] + 1, ["span of the arc (deg)"]),
    ],
)  # fmt: skip
def test_what_an_arc_spans(span, failed):
    assert failures(arc(span=span), SPEC) == failed


@pytest.mark.parametrize("rotation", HEADINGS)
def test_the_open_side_is_where_it_should_be(rotation):
    spec = StructureSpec("arc", rotation=rotation)
    for off, failed in (
        (0, []),
        (44, []),
        (-44, []),
        (46, ["open side's heading (deg off)"]),
        (180, ["open side's heading (deg off)"]),
    ):
        assert failures(arc(degrees=HEADINGS[rotation] + off), spec) == failed
    assert MAX_ARC_OFF_DEGREES == 45


def test_an_uneven_arc_and_an_object_off_it():
    uneven = ring_at(0.15, np.array([90, 110, 130, 270 - 40, 270]))
    assert failures(uneven, SPEC) == ["largest inner gap / mean inner gap"]
    bodies = arc(0.15, count=7)
    assert failures([*bodies[:3], moved(bodies[3], 0.06), *bodies[4:]], SPEC) == ["distance to the circle (m)"]


def test_rings_and_rows_are_no_arcs():
    assert failures(ring_at(0.15, np.arange(0, 360, 45)), SPEC) == ["span of the arc (deg)"]
    assert "span of the arc (deg)" in failures(ring_at(1.5, np.arange(176, 185, 2)), SPEC)


def test_its_sequence_runs_from_end_to_end_wherever_it_is_open():
    for degrees in (0, 100, 200, 300):
        bodies = arc(degrees=degrees)
        mixed = [bodies[i] for i in (3, 0, 4, 1, 2)]
        assert [(3, 0, 4, 1, 2)[i] for i in Arc().sequence(mixed)] == [0, 1, 2, 3, 4]
        assert Arc().radius(mixed) == pytest.approx(0.12)
