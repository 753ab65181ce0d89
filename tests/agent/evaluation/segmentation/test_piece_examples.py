"""Examples are pairs of pieces with their truth: those of one object, and those of two."""

import numpy as np
import pytest

from agent.evaluation.segmentation.piece_examples import Place, examples_at, pair_examples, places
from agent.perception.masks import VoxelMasks
from agent.perception.piece_network import piece_network
from agent.perception.pieces import Proposals, Surface
from agent.synthetic_tables.arrangements import ARRANGEMENTS


@pytest.fixture
def row():
    """Four squares in a row, each a piece."""
    rows, columns = np.indices((12, 48)).reshape(2, -1)
    own = columns // 12
    positions = np.column_stack((0.004 * rows, 0.004 * columns, np.full(len(rows), 0.02)))
    up = np.tile((0.0, 0.0, 1.0), (len(own), 1))
    masks = VoxelMasks(own, np.ones(len(own)), positions, positions, np.ones(4), np.zeros((4, 3)), np.ones(4))
    return Surface(positions, up, None, np.array([0.0, 0.0, 1.0]), 0.0101), Proposals(own, own, masks), own


def test_pairs_are_described_before_and_after_pieces_of_one_object_are_merged(row):
    surface, proposals, own = row
    examples = pair_examples(surface, proposals, np.array([1, 1, 2, 2])[own], np.random.default_rng(0))
    assert [one.one for one in examples[:3]] == [True, False, True]
    # Then either half is merged, and the other one: each time there is a pair of two objects.
    assert [one.one for one in examples[3:]].count(True) <= 1 and examples[-1].one is False
    assert examples[-1].features["voxels of the smaller"] == pytest.approx(np.log(2 * 144) / 5)


def test_what_is_of_no_object_is_none_and_what_is_of_two_is_left_out(row):
    surface, proposals, own = row
    of_nothing = np.array([1, 1, 0, 0])[own]
    examples = pair_examples(surface, proposals, of_nothing, np.random.default_rng(0))
    assert [one.one for one in examples[:2]] == [True, False]  # the pair of nothing and nothing teaches nothing
    halves = np.where(own == 1, 1 + np.arange(len(own)) % 2, 1)
    assert all(
        one.features["one shape"] == 0.0 for one in pair_examples(surface, proposals, halves, np.random.default_rng(0))
    )


def test_a_drawn_table_has_examples_of_both_kinds_with_the_features_that_the_network_takes():
    examples = examples_at((), Place("mixed", 1, 5))
    assert {one.one for one in examples} == {True, False}
    assert set(examples[0].features) == set(piece_network().features)
    assert all(0.0 < one.weight <= 1.0 and np.isfinite(list(one.features.values())).all() for one in examples)


def test_every_class_of_tables_and_every_structure_has_its_places():
    drawn = places(2, 1, 0)
    assert len(drawn) == 2 * len(ARRANGEMENTS) + 4 and len(set(drawn)) == len(drawn)
