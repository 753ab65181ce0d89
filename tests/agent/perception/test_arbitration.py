"""What geometry and the network say of voxels comes together, and each method decides by its own."""

import numpy as np
import pytest

from agent.perception.arbitration import BOTH, GEOMETRY, NETWORK, decided, masks_of_voxels
from agent.perception.clustering import Voxels
from agent.perception.masks import Masks, VoxelMasks
from agent.perception.pieces import Proposals, Surface
from agent.perception.segmentation import segment
from structdiffusion.objects.procedural import procedural_object

SIDE = 20  # voxels of 4 mm along each side of two squares that touch


@pytest.fixture
def squares():
    """Positions of two squares side by side, and which voxel lies in which."""
    rows, columns = np.indices((SIDE, 2 * SIDE)).reshape(2, -1)
    positions = 0.004 * np.column_stack((rows, columns, np.full(len(rows), 5.0)))
    return positions, (columns >= SIDE).astype(int)


def test_a_voxel_has_the_mask_of_most_of_its_points_and_the_mean_of_their_votes(squares):
    positions, own = squares
    voxels = Voxels(positions, np.repeat(np.arange(len(own)), 3), np.full(len(own), 3), 0.01)
    of_point = np.repeat(own, 3)
    of_point[::3] = -1
    votes = np.repeat(positions, 3, axis=0)
    votes[::3] += 0.3
    share = np.tile((0.4, 0.7, 1.0), len(own))
    masks = Masks(of_point, share, np.array([0.9, 0.8]), np.zeros((2, 3)), np.ones(2), votes)
    chosen, connected = np.ones(len(of_point), dtype=bool), np.zeros(len(own), dtype=int)
    seen = masks_of_voxels(masks, voxels, chosen, connected)
    np.testing.assert_array_equal(seen.of_voxel, own)
    np.testing.assert_allclose(seen.share, 0.7)
    np.testing.assert_allclose(seen.votes, positions + 0.1)


def test_a_voxel_without_a_mask_has_that_of_a_near_one(squares):
    positions, own = squares
    voxels = Voxels(positions, np.arange(len(own)), np.ones(len(own), dtype=int), 0.01)
    of_point, connected = np.where(own == 0, 0, -1), np.where(positions[:, 0] < 0.05, 0, -1)
    masks = Masks(of_point, np.ones(len(own)), np.array([0.9]), np.zeros((1, 3)), np.ones(1), positions)
    seen = masks_of_voxels(masks, voxels, np.ones(len(own), dtype=bool), connected)
    near = positions[:, 1] < 0.076 + 0.0199  # up to 2 cm from the first square
    np.testing.assert_array_equal(seen.of_voxel == 0, near & (connected == 0))


def test_each_method_has_its_own_objects(squares):
    positions, own = squares
    up = np.tile((0.0, 0.0, 1.0), (len(own), 1))
    surface = Surface(positions, up, None, np.array([0.0, 0.0, 1.0]), 0.01)
    masks = VoxelMasks(
        own, np.ones(len(own)), positions, positions, np.array([0.9, 0.9]), np.zeros((2, 3)), np.full(2, 0.01)
    )
    whole = np.zeros(len(own), dtype=int)
    proposals = Proposals(whole, whole, masks)
    assert (decided(surface, proposals, GEOMETRY) == 0).all()
    np.testing.assert_array_equal(decided(surface, proposals, NETWORK), own)
    assert (decided(surface, Proposals(whole, whole, None), BOTH) == 0).all()


@pytest.mark.parametrize("method", [NETWORK, BOTH])
def test_blocks_that_stand_apart_are_found_by_every_method(record, method):
    block, other = procedural_object("block", 1), procedural_object("can", 2)
    scene = record([(block, 0.4, 0.1, 0.3), (other, 0.5, -0.15, 0.0)])
    plain, found = (segment(scene.recording, one) for one in (GEOMETRY, method))
    assert len(found.objects) == len(plain.objects) == 2
    for number in (1, 2):
        shared = (found.labels == number) & (plain.labels == number)
        assert shared.sum() > 0.9 * (plain.labels == number).sum()
