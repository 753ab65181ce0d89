"""A table setting has everything where the diner expects it."""

import math
from dataclasses import replace

import pytest

from grounding.spec import StructureSpec
from tests.structdiffusion.structures.handmade import HEADINGS, body, failures, setting


@pytest.mark.parametrize(("rotation", "degrees"), HEADINGS.items())
def test_a_setting_seen_by_the_diner(rotation, degrees):
    assert failures(setting(degrees), StructureSpec("table setting", rotation=rotation)) == []
    assert failures(setting(degrees + 20), StructureSpec("table setting", rotation=rotation)) == []
    turned_away = failures(setting(degrees + 30), StructureSpec("table setting", rotation=rotation))
    assert turned_away == ["setting's heading (deg off)"]


@pytest.mark.parametrize(
    ("shifts", "broken"),
    [
        ({"fork": (0.26, -0.16)}, ["fork: left of the plate (m)"]),
        ({"knife": (-0.30, 0.0)}, ["knife: right of the plate (m)"]),
        ({"spoon": (-0.034, -0.16)}, ["spoon: right of knife and plate (m)"]),
        ({"cup": (-0.12, 0.04)}, ["cup: right of the centre (m)"]),
        ({"cup": (0.1, -0.16)}, ["cup: behind the centre (m)"]),
        ({"bowl": (0.12, 0.04)}, ["bowl: left of the centre (m)"]),
        ({"bowl": (-0.1, -0.2)}, ["bowl: behind the centre (m)"]),
        ({"cup": (0.12, 0.06)}, ["clear gap to the nearest neighbour (m)"]),
        ({"fork": (0, 0, 40)}, ["fork: points away from the diner (deg off)"]),
    ],
)
def test_each_thing_has_its_side(shifts, broken):
    assert failures(setting(**shifts), StructureSpec("table setting")) == broken


def test_cutlery_that_points_at_the_diner_turns_the_whole_setting():
    reversed_cutlery = [replace(b, front_yaw=b.front_yaw + math.pi) for b in setting()]
    found = failures(reversed_cutlery, StructureSpec("table setting", rotation="south"))
    assert "fork: left of the plate (m)" in found and "setting's heading (deg off)" in found


def test_the_plate_carries_a_bowl_and_nothing_else():
    plate, fork, knife, spoon, cup, bowl = setting()
    on_plate = body(0.45, 0.0, 0.06, "bowl", z=0.02, rests_on=(0,))
    spec = StructureSpec("table setting")
    assert failures([plate, fork, knife, on_plate], spec) == []
    assert "things on the plate other than a bowl" in failures([plate, replace(fork, rests_on=(0,)), knife], spec)
    assert failures([fork, knife], spec) == ["plates or bowls as a base"]
    assert failures([plate], spec) == ["objects in the setting"]


def test_without_cutlery_the_setting_faces_wherever_it_holds():
    plate, _, _, _, cup, bowl = setting(90.0)
    for rotation in HEADINGS:
        found = failures([plate, cup, bowl], StructureSpec("table setting", rotation=rotation))
        assert (found == []) == (rotation == "west")
