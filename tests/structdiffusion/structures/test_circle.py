"""A circle holds when it is round, even and open where it should be, and fails once that is broken."""

import math
from dataclasses import replace

import numpy as np
import pytest

from grounding.spec import StructureSpec
from tests.structdiffusion.structures.handmade import HEADINGS, body, failures, moved, ring

CIRCLE = StructureSpec("circle")


def test_a_circle_and_how_it_is_broken():
    good = ring()
    assert failures(good, CIRCLE) == []
    assert "distance to the circle (m)" in failures([moved(good[0], dx=0.07), *good[1:]], CIRCLE)
    assert failures([moved(good[0], dx=0.015), *good[1:]], CIRCLE) == []  # 2 cm are forgiven
    assert failures([replace(good[0], rests_on=(1,)), *good[1:]], CIRCLE) == ["objects on top of others"]
    assert failures(good[:2], CIRCLE) == ["objects in the circle"]


def test_a_large_circle_forgives_fifteen_percent_of_its_radius():
    def waved(amount):
        angles = np.radians(range(0, 360, 45))
        radii = 0.2 * (1 + amount * np.array([1, -1] * 4))
        return [body(0.45 + r * math.cos(a), r * math.sin(a)) for a, r in zip(angles, radii)]

    assert failures(waved(0.14), CIRCLE) == []
    assert failures(waved(0.16), CIRCLE) == ["distance to the circle (m)"]


def test_a_ring_is_closed_unless_it_faces_somewhere():
    # Six of seven places: the gap is 2 of the others, and 12/7 = 1.71 of the mean.
    angles = [(k + 1) * 360 / 7 for k in range(6)]
    opened = ring(0.1, angles)
    assert failures(opened, CIRCLE) == ["largest gap / mean gap"]
    assert failures(opened, StructureSpec("circle", rotation="north")) == []
    assert failures(ring(), StructureSpec("circle", rotation="north")) != []
    too_wide = ring(0.1, [100, 140, 180, 220, 260])
    assert "opening / mean of the other gaps" in failures(too_wide, StructureSpec("circle", rotation="north"))


@pytest.mark.parametrize(("rotation", "heading"), HEADINGS.items())
@pytest.mark.parametrize(
    ("off", "right"), [(0, True), (40, True), (-40, True), (50, False), (-50, False), (180, False)]
)
def test_the_opening_faces_the_rotation_within_45_degrees(rotation, heading, off, right):
    angles = [heading + off + (k + 1) * 360 / 7 for k in range(6)]
    expected = [] if right else ["opening's heading (deg off)"]
    assert failures(ring(0.1, angles), StructureSpec("circle", rotation=rotation)) == expected
