import json

import numpy as np
import pytest

from structdiffusion.benchmark import growth
from structdiffusion.benchmark.growth import fitted_exponent, growth_json, measure_growth, plot, resampled
from structdiffusion.benchmark.latency import observed_scenes


def test_the_exponent_is_that_of_the_larger_half():
    sizes = (1, 2, 4, 8, 16, 32)
    assert fitted_exponent(sizes, [3.0 * size**2 for size in sizes]) == pytest.approx(2.0)
    assert fitted_exponent(sizes, [1.0, 1.0, 1.0, 8.0, 16.0, 32.0]) == pytest.approx(1.0)
    assert fitted_exponent((4,), [1.0]) is None


def test_clouds_get_as_many_points_as_asked_for_near_those_that_were_seen():
    (scene,) = observed_scenes("circle", 3, 1)
    for points in (50, 3000):
        for seen, made in zip(scene.objects, resampled(scene, points).objects, strict=True):
            assert made.points.shape == (points, 3) and made.points.dtype == np.float32
            farthest = np.linalg.norm(made.points[:, None] - seen.points, axis=-1).min(axis=1).max()
            assert farthest < 0.004


def test_every_size_up_to_the_largest_is_measured_and_drawn(monkeypatch, tmp_path):
    monkeypatch.setattr(growth, "INSTRUCTIONS", (2, 4))
    monkeypatch.setattr(growth, "POINTS", (4, 64))
    grown = measure_growth("geometric", runs=1, largest=4)
    assert {row.size: row.sizes for row in grown} == {
        "candidates": (1, 4), "objects": (3, 4), "points per cloud": (4,), "instructions": (2, 4),
    }  # fmt: skip
    for row in grown:
        assert len(row.seconds) == len(row.cpu_seconds) == len(row.megabytes) == len(row.sizes)
        assert min(row.seconds) > 0
    assert [row["size"] for row in json.loads(growth_json(grown))] == [row.size for row in grown]
    plot(grown, tmp_path / "out" / "benchmark.png")
    assert (tmp_path / "out" / "benchmark.png").read_bytes().startswith(b"\x89PNG")


def test_memory_is_left_out_where_the_system_does_not_tell(monkeypatch, tmp_path):
    monkeypatch.setattr(growth, "_RESET", tmp_path / "there is none" / "x")
    grown = measure_growth("geometric", runs=1, largest=3)
    assert grown[0].megabytes == (None,)
    plot(grown, tmp_path / "benchmark.png")
