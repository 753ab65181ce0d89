"""Lengths, samples, Chamfer distance and similarity, by mathematics."""

import math

import numpy as np
import pytest

from structdiffusion.figures.curves import arc_lengths, chamfer, diameter, moved, sampled, similarity

L = np.array([[0.0, 2.0], [0.0, 0.0], [1.0, 0.0]])


def test_lengths_and_samples_of_an_angle():
    assert arc_lengths(L).tolist() == [0.0, 2.0, 3.0] and diameter(L) == pytest.approx(math.sqrt(5))
    points = sampled([L], 0.1)
    assert len(points) == 31 and np.linalg.norm(np.diff(points, axis=0), axis=1).max() == pytest.approx(0.1)
    assert sampled([L[:1]], 0.1).tolist() == [[0.0, 2.0]]


def test_chamfer_of_parallel_lines_is_their_distance_and_grows_both_ways():
    line = sampled([np.array([[0.0, 0.0], [1.0, 0.0]])], 0.01)
    assert chamfer(line, line + (0.0, 0.2)) == pytest.approx(0.2)
    half = line[line[:, 0] <= 0.5]
    assert chamfer(line, half) == pytest.approx(chamfer(half, line)) == pytest.approx(0.5 * 0.125, abs=2e-3)


def test_a_similarity_is_found_and_never_mirrors():
    there = moved(L, 0.3, 1.2, np.array([0.4, -0.1]))
    scale, angle, shift = similarity(L, there)
    assert (scale, angle) == (pytest.approx(0.3), pytest.approx(1.2)) and shift == pytest.approx([0.4, -0.1])
    scale, angle, shift = similarity(L, L * (1, -1))
    assert np.linalg.norm(moved(L, scale, angle, shift) - L * (1, -1)) > 0.5
