"""Voxels are divided into pieces that no proposal divides, and pairs of these are described by lengths and shares."""

import numpy as np
import pytest

from agent.perception.masks import VoxelMasks
from agent.perception.pieces import Pieces, Proposals, Surface

SIDE = 20  # voxels of 4 mm along each side of three squares in a row
VOXEL, REACH = 0.004, 0.0101
EYE = np.array([0.0, 0.0, 1.0])
RED, BLUE = (50.0, 60.0, 30.0), (50.0, 10.0, -60.0)


def squares(apart=0.0):
    """Positions of three squares in a row 2 cm above the table, the third one `apart` metres, and which is where."""
    rows, columns = np.indices((SIDE, 3 * SIDE)).reshape(2, -1)
    own = columns // SIDE
    across = VOXEL * columns + apart * (own == 2)
    return np.column_stack((VOXEL * rows, across, np.full(len(rows), 0.02))), own


def pieces_of(positions, shapes, mask, regions=None, lab=None, votes=None, certainty=(0.9, 0.95, 0.88)):
    count = len(positions)
    up = np.tile((0.0, 0.0, 1.0), (count, 1))
    masks = VoxelMasks(
        mask, np.ones(count), positions if votes is None else votes, positions, np.array(certainty),
        np.array([[0.0, 0.1 * k, 0.0] for k in range(3)]), np.full(3, 0.01),
    )  # fmt: skip
    surface = Surface(positions, up, lab, EYE, REACH)
    return Pieces(surface, Proposals(shapes, shapes if regions is None else regions, masks))


def described(pieces, own, first, second):
    """The features of the pieces of two squares."""
    numbers = sorted(int(pieces.of_voxel[own == square][0]) for square in (first, second))
    one, other = (pieces.describe(np.flatnonzero(pieces.of_voxel == number)) for number in numbers)
    return pieces.features(one, other, pieces.contacts().get(tuple(numbers), np.empty((0, 2), dtype=int)))


def test_a_piece_is_what_no_proposal_divides():
    positions, own = squares()
    shapes, mask = np.minimum(own, 1), np.maximum(own, 1) - 1  # 0 1 1 and 0 0 1
    found = pieces_of(positions, shapes, mask).of_voxel
    assert len(np.unique(found)) == 3
    for number in range(3):
        assert len(np.unique(found[own == number])) == 1


def test_masks_divide_only_where_several_are_certain():
    positions, own = squares()
    whole = np.zeros(len(own), dtype=int)
    assert len(np.unique(pieces_of(positions, whole, own).of_voxel)) == 3
    assert (pieces_of(positions, whole, own, certainty=(0.9, 0.5, 0.5)).of_voxel == 0).all()
    two = pieces_of(positions, whole, own, certainty=(0.9, 0.5, 0.9)).of_voxel
    assert len(np.unique(two)) == 2 and two[own == 0][0] != two[own == 2][0]


def test_specks_go_to_the_nearest_piece_of_their_shape_and_what_has_no_shape_to_none():
    positions, own = squares()
    mask = own.copy()
    mask[np.flatnonzero(own == 0)[:10]] = 2  # too few for a piece
    shapes = np.where(own == 2, -1, 0)
    found = pieces_of(positions, shapes, mask).of_voxel
    assert len(np.unique(found[own == 0])) == 1 and (found[own == 2] == -1).all() and found.max() == 1


def test_pieces_that_meet_have_contacts_within_reach_with_the_first_one_first():
    positions, own = squares(apart=0.05)
    pieces = pieces_of(positions, np.zeros(len(own), dtype=int), own)
    contacts = pieces.contacts()
    near = tuple(sorted(int(pieces.of_voxel[own == k][0]) for k in (0, 1)))
    assert list(contacts) == [near]
    first, second = contacts[near].T
    assert (pieces.of_voxel[first] == near[0]).all() and (pieces.of_voxel[second] == near[1]).all()
    assert np.linalg.norm(positions[first] - positions[second], axis=1).max() <= REACH


def test_features_are_lengths_and_shares():
    positions, own = squares(apart=0.05)
    whole = np.zeros(len(own), dtype=int)
    pieces = pieces_of(positions, np.minimum(own, 1), np.minimum(own, 1), regions=own)
    near, far = described(pieces, own, 0, 1), described(pieces, own, 1, 2)
    assert near["ratio of voxels"] == 1.0
    # Between some of the voxels: up to a voxel more.
    assert near["gap"] == pytest.approx(VOXEL / 0.02, abs=0.2)
    assert far["gap"] == pytest.approx((VOXEL + 0.05) / 0.02, abs=0.2)
    assert (near["one shape"], far["one shape"]) == (0.0, 1.0)
    assert (near["one mask"], far["one mask"], far["one certain mask"]) == (0.0, 1.0, pytest.approx(0.95))
    assert far["one region"] == 0.0
    assert near["masks apart"] == pytest.approx(min(0.1 / 0.02, 4.0))
    assert near["middle of the smaller"] == pytest.approx(0.2)
    assert near["long side of the larger"] == pytest.approx((VOXEL * (SIDE - 1) + 0.004) / 0.1, rel=0.05)
    assert near["convexity from above"] == pytest.approx(1.0, abs=0.02) and far["convexity from above"] < 0.8
    assert near["overlap from above"] < 0.1
    assert far["contacts"] == far["lean"] == 0.0 < near["contacts"]
    assert near["colours known"] == near["colours apart"] == 0.0
    assert pieces_of(positions, whole, whole).of_voxel.max() == 0


def test_features_of_colors_and_votes():
    positions, own = squares()
    shades = np.where(own[:, None] == 1, BLUE, RED).astype(float)
    middles = np.array([positions[own == k].mean(axis=0) for k in range(3)])
    votes = middles[np.array([0, 0, 2])[own]]  # the first two squares vote for one middle
    pieces = pieces_of(positions, own, own, lab=shades, votes=votes)
    near, far = described(pieces, own, 0, 1), described(pieces, own, 1, 2)
    assert near["colours known"] == 1.0 and near["colours apart"] > 2.0 and near["plain smaller"] == 1.0
    assert near["colours apart at the border"] > 2.0
    assert near["votes apart"] == near["votes as far apart as places"] == 0.0
    assert far["votes as far apart as places"] > 1.0


def test_surfaces_that_meet_in_a_valley_lean_together():
    """A floor and a wall that rises from it: their normals point to the same side of the valley."""
    along, away = np.indices((SIDE, SIDE)).reshape(2, -1) * VOXEL
    flat, zero = np.full(len(along), 0.0), np.full(len(along), 0.02)
    positions = np.vstack((np.column_stack((along, away, zero)), np.column_stack((along, flat - VOXEL, away + 0.02))))
    own = np.repeat((0, 1), len(along))
    normals = np.where(own[:, None] == 0, (0.0, 0.0, 1.0), (0.0, 1.0, 0.0))
    masks = VoxelMasks(own, np.ones(len(own)), positions, positions, np.ones(2), np.zeros((2, 3)), np.ones(2))
    valley = Pieces(Surface(positions, normals, None, EYE, REACH), Proposals(own, own, masks))
    ridge = Pieces(Surface(positions, -normals, None, EYE, REACH), Proposals(own, own, masks))
    assert described(valley, own, 0, 1)["lean"] < -0.3 < 0.3 < described(ridge, own, 0, 1)["lean"]


def test_pieces_apart_could_be_one_only_where_a_proposal_says_so_and_near():
    positions, own = squares(apart=0.05)
    first, apart = np.zeros(len(own), dtype=int), np.array([0, 1, 1])[own]
    together = pieces_of(positions, own, apart)
    one, two, three = (together.describe(np.flatnonzero(own == k)) for k in range(3))
    assert together.may_be_one(two, three, 0) and not together.may_be_one(one, three, 0)
    assert together.may_be_one(one, three, 3)
    far, _ = squares(apart=0.2)
    one, two = (pieces_of(far, own, first).describe(np.flatnonzero(own == k)) for k in (1, 2))
    assert not pieces_of(far, own, first).may_be_one(one, two, 0)
