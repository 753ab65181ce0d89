"""The likeliest pair is merged first, its features are found anew, and contacts are kept through merges."""

import numpy as np

from agent.perception.masks import VoxelMasks
from agent.perception.piece_merging import PieceGraph, merged
from agent.perception.pieces import Pieces, Proposals, Surface

SIDE, COUNT = 12, 4  # voxels of 4 mm along each side of four squares in a row
REACH = 0.0101


def row():
    """The surface of four squares in a row, proposals that divide them, and which voxel lies in which."""
    rows, columns = np.indices((SIDE, COUNT * SIDE)).reshape(2, -1)
    own = columns // SIDE
    positions = np.column_stack((0.004 * rows, 0.004 * columns, np.full(len(rows), 0.02)))
    up = np.tile((0.0, 0.0, 1.0), (len(own), 1))
    masks = VoxelMasks(
        own, np.ones(len(own)), positions, positions, np.ones(COUNT), np.zeros((COUNT, 3)), np.ones(COUNT)
    )
    surface = Surface(positions, up, None, np.array([0.0, 0.0, 1.0]), REACH)
    return surface, Proposals(own, own, masks), own


def test_nothing_is_merged_that_is_not_likely_to_be_one():
    surface, proposals, own = row()
    found = merged(surface, proposals, lambda pairs: np.full(len(pairs), 0.49))
    np.testing.assert_array_equal(found, own)


def test_everything_that_meets_is_merged_where_all_is_likely():
    surface, proposals, _ = row()
    assert len(np.unique(merged(surface, proposals, lambda pairs: np.full(len(pairs), 0.51)))) == 1


def test_the_likeliest_pair_is_merged_first_and_its_pairs_are_judged_anew():
    surface, proposals, own = row()
    asked = []

    def judge(pairs):
        """The two in the middle are likeliest; what is larger than a square is alone."""
        asked.append(len(pairs))
        if len(pairs) == 3:
            return np.array([0.6, 0.9, 0.6])
        return np.where([pair["ratio of voxels"] == 1.0 for pair in pairs], 0.9, 0.1)

    found = merged(surface, proposals, judge)
    np.testing.assert_array_equal(found == found[own == 1][0], (own == 1) | (own == 2))
    assert len(np.unique(found)) == 3 and asked == [3, 2]


def test_a_merged_piece_has_the_contacts_of_both():
    surface, proposals, own = row()
    graph = PieceGraph(Pieces(surface, proposals))
    assert sorted(graph.pairs) == [(0, 1), (1, 2), (2, 3)]
    before = graph.pairs[1, 2]
    graph.merge(2, 3)
    assert graph.refresh() == [(1, 2)]
    np.testing.assert_array_equal(graph.pairs[1, 2], before)
    graph.merge(2, 1)
    assert graph.refresh() == [(0, 2)]
    first, second = graph.pairs[0, 2].T
    assert (own[first] == 0).all() and (own[second] == 1).all()
    assert sorted(graph.pieces) == [0, 2] and len(graph.pieces[2].own) == 3 * SIDE**2
    graph.merge(0, 2)
    assert graph.refresh() == []
    assert (graph.of_voxel == 0).all() and not graph.pairs


def test_several_merges_are_described_at_once():
    surface, proposals, _ = row()
    graph = PieceGraph(Pieces(surface, proposals))
    graph.merge(0, 1)
    graph.merge(2, 3)
    assert graph.refresh() == [(0, 2)] == sorted(graph.pairs)
    assert [len(graph.pieces[number].own) for number in (0, 2)] == [2 * SIDE**2] * 2


def test_pairs_that_are_sure_are_merged_together_without_being_judged_again():
    surface, proposals, own = row()
    asked = []

    def judge(pairs):
        asked.append(len(pairs))
        return np.full(len(pairs), 0.1) if len(asked) > 1 else np.array([0.99, 0.99, 0.4])

    found = merged(surface, proposals, judge)
    np.testing.assert_array_equal(found == found[0], own < 3)
    assert asked == [3, 1]
