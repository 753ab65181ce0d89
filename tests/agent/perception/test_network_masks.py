"""Votes become masks: near votes are one object, and every measured point has the mask of the surface that it is on."""

import numpy as np
import pytest

from agent.perception.network_masks import Sight, decoded, network_masks, pixel_pitch
from agent.segmentation_network.network import Seen


def answer(objects, centres, level, spread=0.02, seeds=0.9):
    """What a network says that votes for centres (K, 3); `objects` (H, W) has the object of each pixel, -1 for none."""
    inside = objects >= 0
    classes = np.stack((np.zeros(inside.shape), ~inside, inside)).astype(np.float32)
    votes = np.where(inside[..., None], np.asarray(centres)[objects] - level, 0.0).transpose(2, 0, 1)
    return Seen(classes, votes, np.full(inside.shape, spread), np.where(inside, seeds, 0.0))


@pytest.fixture
def level():
    x, y = np.meshgrid(np.linspace(0.4, 0.0, 20), np.linspace(0.3, -0.3, 30), indexing="ij")
    return np.stack((x, y, np.zeros_like(x)), axis=-1)


def two_objects():
    objects = np.full((20, 30), -1)
    objects[5:12, 5:12], objects[5:12, 12:20] = 0, 1
    return objects


def test_objects_that_touch_are_told_apart_by_their_votes(level):
    objects = two_objects()
    seen = answer(objects, [(0.2, 0.1, 0.0), (0.2, -0.05, 0.0)], level)
    labels, centres, spreads, certainty = decoded(seen, level, np.ones(objects.shape, dtype=bool))
    assert len(centres) == len(spreads) == 2 and certainty == pytest.approx([0.9, 0.9])
    assert (labels[objects < 0] == -1).all()
    assert {tuple(np.unique(labels[objects == k])) for k in (0, 1)} == {(0,), (1,)}


def test_one_centre_is_one_object_and_its_stray_votes_belong_to_it(level):
    objects = two_objects()
    seen = answer(objects, [(0.2, 0.0, 0.0), (0.2, 0.01, 0.0)], level)
    seen.votes[:, 6, 6] += 0.03
    labels, centres, _, _ = decoded(seen, level, np.ones(objects.shape, dtype=bool))
    assert len(centres) == 1 and (labels[objects >= 0] == 0).all()


def test_what_was_not_measured_or_is_unsure_is_no_object(level):
    objects = two_objects()
    known = np.ones(objects.shape, dtype=bool)
    known[:, :12] = False
    centres = [(0.2, 0.1, 0.0), (0.2, -0.05, 0.0)]
    labels, found, _, _ = decoded(answer(objects, centres, level), level, known)
    assert len(found) == 1 and (labels[:, :12] == -1).all()
    labels, found, _, _ = decoded(answer(objects, centres, level, seeds=0.1), level, known)
    assert len(found) == 0 and (labels == -1).all()


def test_the_pitch_is_that_of_the_camera():
    columns, rows = np.meshgrid(np.arange(64) - 32, np.arange(48) - 24)
    depth = 1.0 + 0.2 * (columns > 0)
    points = np.stack((columns * depth / 500.0, rows * depth / 500.0, depth), axis=-1)
    points[3:7] = np.nan
    assert pixel_pitch(points) == pytest.approx(1 / 500)


def test_points_have_the_mask_of_their_own_surface():
    """A box before a table: a full resolution of 320 pixels is shown to the network at 160."""
    shape = (240, 320)
    rows, columns = np.indices(shape)
    near = (rows > 80) & (rows < 141) & (columns > 100) & (columns < 181)
    distance = np.where(near, 0.8, 1.0)
    level = np.stack((distance, (160 - columns) / 300 * distance, (120 - rows) / 300 * distance), axis=-1)
    there = np.ones(shape, dtype=bool)
    there[:10] = False

    def network(maps):
        assert maps.shape[1:] == (120, 160)
        inside = maps[1] > 0.5
        votes = np.zeros((3, 120, 160))
        return Seen(
            np.stack((np.zeros(inside.shape), ~inside, inside)), votes, np.full(inside.shape, 0.5), 0.9 * inside
        )

    pixels = np.flatnonzero(there.ravel())
    points, heights = level.reshape(-1, 3)[pixels], np.where(near.ravel()[pixels], 0.1, 0.0)
    masks = network_masks(Sight(points, heights, np.zeros(3), pixels, shape, 1 / 300, None), network)
    assert len(masks.certainty) == 1
    wrong = (masks.of_point >= 0) != near.ravel()[pixels]
    assert wrong.mean() < 0.005
    assert (masks.share[masks.of_point >= 0] > 0.5).all()
