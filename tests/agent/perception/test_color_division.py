"""Two colours make two objects only where the outline changes with them."""

import numpy as np
import pytest

from agent.perception.color_division import divided_by_color

EYE = np.array([-0.8, 0.0, 0.7])
RED, BLUE = (45.0, 60.0, 40.0), (40.0, 10.0, -50.0)
STEP = 0.004


def box(x, y, z, length, width, height):
    """Voxels of the front and the top of a box whose lower front edge has its middle at (x, y, z)."""
    across = np.arange(-width / 2, width / 2, STEP)
    front = [(x, y + b, z + c) for b in across for c in np.arange(0.0, height, STEP)]
    top = [(x + a, y + b, z + height) for a in np.arange(0.0, length, STEP) for b in across]
    return np.array(front + top)


def divided(*parts):
    """Which voxels of colored parts are another object than the first one's."""
    positions = np.vstack([positions for positions, _ in parts])
    rng = np.random.default_rng(0)
    lab = np.vstack([np.tile(color, (len(part), 1)) for part, color in parts]) + rng.normal(0, 3, (len(positions), 3))
    second = divided_by_color(positions, lab, EYE, 0.01)
    return second if not second.any() else second ^ second[0], len(parts[0][0])


def test_a_box_on_a_wider_one_is_another_object():
    second, first = divided((box(0.0, 0.0, 0.0, 0.08, 0.1, 0.06), RED), (box(0.0, 0.0, 0.06, 0.08, 0.07, 0.05), BLUE))
    assert (~second[:first]).mean() > 0.95 and second[first:].mean() > 0.95


@pytest.mark.parametrize("upper", [RED, BLUE])
def test_a_box_in_one_or_two_colours_is_one(upper):
    second, _ = divided((box(0.0, 0.0, 0.0, 0.08, 0.1, 0.06), RED), (box(0.0, 0.0, 0.06, 0.08, 0.1, 0.05), upper))
    assert not second.any()


def test_a_lid_is_a_part_of_its_jar():
    second, _ = divided((box(0.0, 0.0, 0.0, 0.08, 0.1, 0.09), RED), (box(0.01, 0.0, 0.09, 0.06, 0.08, 0.012), BLUE))
    assert not second.any()


def can(y, radius, colors=1):
    """Voxels of the front of a can whose axis is at (0, y), those of each half apart."""
    angle, z = np.meshgrid(np.arange(0.5 * np.pi, 1.5 * np.pi, STEP / radius), np.arange(0.0, 0.09, STEP))
    front = np.column_stack((radius * np.cos(angle.ravel()), y + radius * np.sin(angle.ravel()), z.ravel()))
    return front if colors == 1 else (front[angle.ravel() < np.pi], front[angle.ravel() >= np.pi])


def test_cans_side_by_side_are_two_and_a_can_in_two_colours_is_one():
    second, first = divided((can(0.035, 0.034), RED), (can(-0.035, 0.034), BLUE))
    assert (~second[:first]).mean() > 0.95 and second[first:].mean() > 0.95
    left, right = can(0.0, 0.05, colors=2)
    assert not divided((left, RED), (right, BLUE))[0].any()


def test_boxes_that_are_flush_are_not_told_from_one_with_a_print():
    second, _ = divided((box(0.0, 0.0, 0.0, 0.08, 0.08, 0.06), RED), (box(0.0, 0.08, 0.0, 0.08, 0.08, 0.06), BLUE))
    assert not second.any()


def test_a_print_on_a_box_is_no_object():
    plain = box(0.0, 0.0, 0.0, 0.1, 0.12, 0.1)
    print_ = (np.abs(plain[:, 1]) < 0.03) & (np.abs(plain[:, 2] - 0.05) < 0.03)
    second, _ = divided((plain[~print_], RED), (plain[print_], BLUE))
    assert not second.any()


def test_the_lit_top_of_a_small_block_is_a_part_of_it():
    whole = box(0.0, 0.0, 0.0, 0.035, 0.035, 0.035)
    lit = whole[:, 2] > 0.034
    second, _ = divided((whole[~lit], (33.0, 30.0, 18.0)), (whole[lit], (60.0, 55.0, 33.0)))
    assert not second.any()


def test_light_and_shade_of_a_stepped_thing_are_one_colour():
    second, _ = divided(
        (box(0.0, 0.0, 0.0, 0.08, 0.1, 0.06), (33.0, 30.0, 18.0)),
        (box(0.0, 0.0, 0.06, 0.08, 0.07, 0.05), (60.0, 55.0, 33.0)),
    )
    assert not second.any()


def test_a_handle_in_another_colour_is_a_part_of_its_mug():
    second, _ = divided((box(0.0, 0.0, 0.0, 0.08, 0.08, 0.09), RED), (box(0.03, 0.055, 0.01, 0.01, 0.03, 0.06), BLUE))
    assert not second.any()
