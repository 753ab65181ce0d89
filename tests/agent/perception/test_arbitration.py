"""Geometry's objects are divided and joined where the network is certain, and left where it is not."""

import numpy as np
import pytest

from agent.perception.arbitration import BOTH, GEOMETRY, NETWORK, Arbiter, divided, united, whole_again
from agent.perception.clustering import Voxels
from agent.perception.masks import Masks
from agent.perception.segmentation import segment
from structdiffusion.objects.procedural import procedural_object

SIDE = 20  # voxels of 4 mm along each side of two squares that touch


def masks_of(*certainty, apart=0.1):
    """Masks with centres in a row, and spreads of 3 cm."""
    centres = apart * np.arange(len(certainty))[:, None] * np.array([0.0, 1.0, 0.0])
    return Masks(np.zeros(0), np.zeros(0), np.array(certainty), centres, np.full(len(certainty), 0.03))


@pytest.fixture
def squares():
    """Positions of two squares side by side, and which voxel lies in which."""
    rows, columns = np.indices((SIDE, 2 * SIDE)).reshape(2, -1)
    positions = 0.004 * np.column_stack((rows, columns, np.zeros(len(rows))))
    return positions, (columns >= SIDE).astype(int)


def test_one_object_with_two_certain_masks_is_two(squares):
    positions, own = squares
    mask = own.copy()
    mask[::7] = -1
    part = divided(np.zeros(len(own), dtype=int), mask, masks_of(0.95, 0.95), positions)
    assert len(np.unique(part)) == 2
    assert ((part == part[0]) == (own == 0)).mean() > 0.98


@pytest.mark.parametrize("certainty", [(0.95, 0.3), (0.3, 0.95)])
def test_uncertain_masks_divide_nothing(squares, certainty):
    positions, own = squares
    part = divided(np.zeros(len(own), dtype=int), own, masks_of(*certainty), positions)
    assert (part == 0).all()


def test_votes_that_are_not_apart_divide_nothing(squares):
    positions, own = squares
    part = divided(np.zeros(len(own), dtype=int), own, masks_of(0.95, 0.95, apart=0.04), positions)
    assert (part == 0).all()


def test_a_sliver_is_not_divided_off(squares):
    positions, _ = squares
    mask = (positions[:, 0] < 0.006).astype(int)
    assert (divided(np.zeros(len(mask), dtype=int), mask, masks_of(0.95, 0.95), positions) == 0).all()


def test_a_certain_mask_over_two_objects_joins_them_and_no_third(squares):
    _, own = squares
    part = np.concatenate((own, np.full(300, 2), np.full(20, -1)))
    mask = np.concatenate((np.zeros(len(own), dtype=int), np.full(250, 1), np.full(70, -1)))
    connected = np.zeros(len(part), dtype=int)
    found = united(part, connected, mask, np.array([0.95, 0.95]), None)
    assert (found[: len(own)] == found[0]).all() and (found[-320:-20] == 2).all() and (found[-20:] == -1).all()
    np.testing.assert_array_equal(united(part, connected, mask, np.array([0.3, 0.95]), None), part)


def test_what_has_another_colour_or_stands_apart_is_not_joined(squares):
    _, own = squares
    mask, certain = np.zeros(len(own), dtype=int), np.array([0.95])
    whole = np.zeros(len(own), dtype=int)
    shades = np.where(own[:, None] == 1, (40.0, 50.0, 0.0), (60.0, -20.0, 10.0))
    assert len(np.unique(united(own, whole, mask, certain, shades))) == 2
    assert len(np.unique(united(own, whole, mask, certain, np.full((len(own), 3), 50.0)))) == 1
    apart = own + 1  # two connected parts
    assert len(np.unique(united(own, apart, mask, certain, None))) == 2
    assert len(np.unique(united(own, apart, mask, certain, np.full((len(own), 3), 50.0)))) == 1


def test_specks_beside_an_object_are_not_joined_to_it(squares):
    _, own = squares
    part = np.where(np.arange(len(own)) % 50 == 0, 1, 0)
    whole = np.zeros(len(own), dtype=int)
    np.testing.assert_array_equal(united(part, whole, whole, np.array([0.95]), None), part)


def test_each_method_has_its_own_objects(squares):
    """Voxels of two points; the network has a mask for one half, and geometry one object."""
    positions, own = squares
    voxels = Voxels(positions, np.repeat(np.arange(len(own)), 2), np.full(len(own), 2), 0.01)
    of_point = np.repeat(np.where(own == 1, 0, -1), 2)
    masks = Masks(of_point, np.ones(len(of_point)), np.array([0.9]), np.zeros((1, 3)), np.ones(1))
    whole = np.zeros(len(own), dtype=int)
    chosen = np.ones(len(of_point), dtype=bool)
    mask = Arbiter(masks, BOTH).mask_of(whole, voxels, chosen)
    assert (Arbiter(masks, BOTH).regrouped(whole, whole, mask, positions, None) == 0).all()
    network = Arbiter(masks, NETWORK).regrouped(whole, whole, mask, positions, None)
    assert (network[own == 1] == 0).all() and (network[positions[:, 1] < 0.05] == -1).all()


@pytest.mark.parametrize("method", [NETWORK, BOTH])
def test_blocks_that_stand_apart_are_found_by_every_method(record, method):
    block, other = procedural_object("block", 1), procedural_object("can", 2)
    scene = record([(block, 0.4, 0.1, 0.3), (other, 0.5, -0.15, 0.0)])
    plain, found = (segment(scene.recording, one) for one in (GEOMETRY, method))
    assert len(found.objects) == len(plain.objects) == 2
    for number in (1, 2):
        shared = (found.labels == number) & (plain.labels == number)
        assert shared.sum() > 0.9 * (plain.labels == number).sum()


def test_an_object_of_two_colours_stays_whole_where_one_certain_mask_covers_it():
    part, pieces = np.zeros(200, dtype=int), np.repeat((0, 1), 100)
    one, two = np.zeros(200, dtype=int), np.repeat((0, 1), 100)
    certain, unsure = np.array([0.9, 0.9]), np.array([0.3, 0.3])
    assert len(np.unique(whole_again(part, pieces, one, certain))) == 1
    assert len(np.unique(whole_again(part, pieces, two, certain))) == 2
    assert len(np.unique(whole_again(part, pieces, one, unsure))) == 2
