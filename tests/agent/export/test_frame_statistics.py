"""The statistics of frames are those of all frames at once."""

import numpy as np
import pytest

from agent.export.frame_statistics import QUANTILES, PictureStatistics, VectorStatistics


def test_vectors_of_several_runs_count_together():
    rng = np.random.default_rng(0)
    rows = rng.normal(size=(70, 4))
    statistics = VectorStatistics()
    statistics.add(rows[:20])
    statistics.add(rows[20:])
    found = statistics.to_dict()
    assert found["mean"] == pytest.approx(rows.mean(axis=0)) and found["std"] == pytest.approx(rows.std(axis=0))
    assert found["min"] == pytest.approx(rows.min(axis=0)) and found["max"] == pytest.approx(rows.max(axis=0))
    assert found["q90"] == pytest.approx(np.quantile(rows, 0.9, axis=0)) and found["count"] == [70]


def test_a_histogram_gives_the_statistics_of_the_pixels():
    rng = np.random.default_rng(1)
    pictures = list(rng.integers(0, 200, (5, 12, 16, 3), dtype=np.uint8))
    statistics = PictureStatistics()
    statistics.add(pictures[:2])
    statistics.add(pictures[2:])
    found = {key: np.array(value) for key, value in statistics.to_dict().items()}
    pixels = np.stack(pictures).reshape(-1, 3) / 255
    assert found["count"] == [5] and found["mean"].shape == (3, 1, 1)
    for key in ("min", "max", "mean", "std"):
        assert found[key].ravel() == pytest.approx(getattr(pixels, key)(axis=0))
    for name, share in QUANTILES.items():
        assert found[name].ravel() == pytest.approx(np.quantile(pixels, share, axis=0, method="inverted_cdf"))
