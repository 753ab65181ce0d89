"""Parts on both sides of something nearer: one object where they are one face or one cylinder, otherwise two."""

import numpy as np
import pytest

from agent.perception.occlusion import rejoined

EYE = np.array([-0.8, 0.0, 0.5])
STEP = 0.004


def wall(x, low, high, turn=0.0, height=0.1):
    """Voxels and normals of an upright face from y = low to high, turned about its middle line x, m and rad."""
    y, z = (axis.ravel() for axis in np.meshgrid(np.arange(low, high, STEP), np.arange(0.0, height, STEP)))
    positions = np.column_stack((x + np.tan(turn) * y, y, z))
    return positions, np.tile((-np.cos(turn), np.sin(turn), 0.0), (len(y), 1))


def can(x, y, radius, height=0.1):
    """Voxels and normals of the front of an upright cylinder."""
    angle, z = np.meshgrid(np.arange(np.pi / 2, 1.5 * np.pi, STEP / radius), np.arange(0.0, height, STEP))
    normals = np.column_stack((np.cos(angle.ravel()), np.sin(angle.ravel()), np.zeros(angle.size)))
    return np.array((x, y, 0.0)) + radius * normals + np.outer(z.ravel(), (0, 0, 1)), normals


def joined(*parts, lab=None):
    """How many objects the first two of some parts are."""
    rng = np.random.default_rng(0)
    positions = np.vstack([positions for positions, _ in parts])
    part = np.repeat(np.arange(len(parts)), [len(positions) for positions, _ in parts])
    colors = None if lab is None else np.array(lab)[part] + rng.normal(0, 2, (len(part), 3))
    noisy = positions + rng.normal(0, 0.001, positions.shape)
    found = rejoined(part, noisy, np.vstack([normals for _, normals in parts]), colors, EYE)
    return len(np.unique(found[part < 2]))


FRONT = wall(-0.1, -0.035, 0.035, height=0.16)
LEFT, RIGHT = wall(0.05, 0.03, 0.09), wall(0.05, -0.09, -0.03)


def test_one_face_behind_something_is_one_object_without_colours():
    assert joined(LEFT, RIGHT, FRONT) == 1


def test_parts_of_a_face_may_have_prints_but_not_quite_other_colours():
    grey = (50.0, 0.0, 0.0)
    assert joined(LEFT, RIGHT, FRONT, lab=((60, 10, 10), (50, -5, 0), grey)) == 1
    assert joined(LEFT, RIGHT, FRONT, lab=((60, 50, 30), (50, -5, -40), grey)) == 2


@pytest.mark.parametrize("other", [wall(0.08, -0.09, -0.03), wall(0.05, -0.09, -0.03, turn=0.5)])
def test_faces_in_other_planes_are_two_objects(other):
    assert joined(LEFT, other, FRONT) == 2


def test_nothing_is_joined_through_a_gap_that_is_seen():
    assert joined(LEFT, RIGHT) == 2


def test_the_sides_of_one_can_behind_something_are_one_and_of_two_are_two():
    narrow = wall(-0.1, -0.012, 0.012, height=0.16)
    whole = can(0.08, 0.0, 0.05)
    left, right = (tuple(each[side] for each in whole) for side in (whole[0][:, 1] > 0.016, whole[0][:, 1] < -0.016))
    assert joined(left, right, narrow) == 1
    assert joined(can(0.05, 0.05, 0.025), can(0.05, -0.05, 0.025), FRONT) == 2
