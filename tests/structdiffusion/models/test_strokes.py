"""The stroke network: what it sees does not depend on numbering, padding or place; its examples show their drawings."""

import numpy as np
import torch

from structdiffusion.models.strokes.drawings import FAMILIES, FEWEST, MOST, NEVER, draw_example
from structdiffusion.models.strokes.loss import draw_batch, stroke_loss
from structdiffusion.models.strokes.model import FEATURES, StrokeConfig, StrokeNetwork, pair_features

SMALL = StrokeConfig(width=16, pair_width=8, rounds=2, heads=2)


def network():
    with torch.random.fork_rng():
        torch.manual_seed(0)
        return StrokeNetwork(SMALL).eval()


def answer(model, points, gaps, padding=0):
    count = len(points)
    pairs = np.zeros((1, count + padding, count + padding, FEATURES), np.float32)
    pairs[0, :count, :count] = pair_features(points, gaps)
    there = torch.arange(count + padding)[None] < count
    with torch.no_grad():
        joined, corners = model(torch.from_numpy(pairs), there)
    return joined[0, :count, :count].numpy(), corners[0, :count].numpy()


def test_numbering_padding_and_unit_change_nothing():
    model, rng = network(), np.random.default_rng(0)
    one = draw_example(rng)
    joined, corners = answer(model, one.points, one.gaps)
    assert np.allclose(joined, joined.T)
    order = rng.permutation(len(one.points))
    other, others = answer(model, one.points[order], one.gaps[np.ix_(order, order)])
    assert np.allclose(other, joined[np.ix_(order, order)], atol=1e-4) and np.allclose(
        others, corners[order], atol=1e-4
    )
    for padded in (answer(model, one.points, one.gaps, 3), answer(model, 0.1 * one.points + 5.0, 0.1 * one.gaps)):
        assert np.allclose(padded[0], joined, atol=1e-3) and np.allclose(padded[1], corners, atol=1e-3)


def test_what_the_network_sees_of_four_objects():
    points = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [2.0, 3.0]])
    features = pair_features(points, np.full((4, 4), 0.5))
    assert features[0, 1, 0] == 1.0 and features[1, 0, 0] == -1.0 and features[2, 3, 1] == 3.0
    near, tree = features[..., 7] > 0, features[..., 8] > 0
    assert tree.sum() == 6 and tree[0, 1] and tree[1, 2] and tree[2, 3]
    assert near[0, 1] and not near[0, 2] and not near[1, 3]
    assert features[0, 1, 9] == features[0, 1, 10] == 1.0  # four more of the six pairs are near, and have its gap


def test_examples_show_strokes_at_even_gaps():
    rng = np.random.default_rng(1)
    for _ in range(20):
        one = draw_example(rng)
        assert FEWEST <= len(one.points) <= MOST and one.joined.any() and (one.joined == one.joined.T).all()
        assert not one.joined.diagonal().any()
        ends = one.joined.sum(axis=1) == 1
        assert one.corners[ends].all()  # an end is kept


def test_no_family_of_the_benchmark_is_trained_on():
    from structdiffusion.benchmark.figure_families import COUNTS

    assert set(COUNTS) <= set(NEVER) and not set(FAMILIES) & set(NEVER) and len(FAMILIES) >= 40


def test_some_steps_teach_it_and_a_seed_repeats_them():
    losses = []
    for _ in range(2):
        model = network().train()
        optimiser = torch.optim.Adam(model.parameters(), 1e-2)
        generator = torch.Generator().manual_seed(3)
        for _ in range(12):
            loss = stroke_loss(model, generator, 8)["loss"]
            optimiser.zero_grad()
            loss.backward()
            optimiser.step()
        held = draw_batch(24, np.random.default_rng(9))
        with torch.no_grad():
            joined, _ = model(held.pairs, held.there)
        both = held.there[:, :, None] & held.there[:, None]
        losses.append(float(torch.nn.functional.binary_cross_entropy_with_logits(joined[both], held.joined[both])))
    assert losses[0] == losses[1] < 0.6
