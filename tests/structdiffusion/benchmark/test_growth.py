import json

import numpy as np
import pytest

from structdiffusion.benchmark import growth
from structdiffusion.benchmark.growth import (
    different_instructions,
    fitted_exponent,
    growth_json,
    measure_growth,
    plot,
    resampled,
)
from structdiffusion.benchmark.latency import observed_scenes
from structdiffusion.parallel import in_parallel


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


@pytest.fixture
def without_workers(monkeypatch):
    """What workers do, this process does."""
    monkeypatch.setattr(growth, "in_parallel", lambda *arguments, ray: in_parallel(*arguments[:-1], 0))


@pytest.mark.usefixtures("without_workers")
def test_every_size_up_to_the_largest_is_measured_and_drawn(monkeypatch, tmp_path):
    monkeypatch.setattr(growth, "INSTRUCTIONS", (2, 4))
    monkeypatch.setattr(growth, "_PORTION", 2)
    monkeypatch.setattr(growth, "POINTS", (4, 64))
    grown = measure_growth("geometric", runs=1, largest=4)
    assert [(row.size, row.held, row.sizes) for row in grown] == [
        ("candidates", "a circle of 4 objects", (1, 4)),
        ("objects", "a line, 4 candidates", (2, 3, 4)),
        ("points per cloud", "a circle of 4 objects, 4 candidates", (4,)),
        ("instructions", "one batch, one process", (2, 4)),
        ("instructions", "one batch, 2 processes", (2, 4)),
    ]
    for row in grown:
        assert len(row.seconds) == len(row.cpu_seconds) == len(row.megabytes) == len(row.sizes)
        assert min(row.seconds) > 0 and min(row.cpu_seconds) > 0
    assert [row["size"] for row in json.loads(growth_json(grown))] == [row.size for row in grown]
    plot(grown, tmp_path / "out" / "benchmark.png")
    assert (tmp_path / "out" / "benchmark.png").read_bytes().startswith(b"\x89PNG")


def test_instructions_of_a_batch_differ():
    texts = different_instructions(200)
    assert len(texts) == len(set(texts)) == 200
    assert all(any(shape in text for text in texts) for shape in ("circle", "line"))


@pytest.mark.usefixtures("without_workers")
def test_a_batch_is_read_by_one_loaded_parser_in_each_process(monkeypatch):
    """Portions of a batch share the parser of their process: it is loaded once, however many they are."""
    loads, read = [], []

    class Stub:
        def interpret_many(self, texts):
            read.append(list(texts))

    monkeypatch.setattr(growth, "_interpreter", lambda: loads.append(1) or Stub())
    monkeypatch.setattr(growth, "_PORTION", 2)
    texts = ["a", "b", "c", "d", "e"]
    growth.read_here(texts)(4)
    assert (len(loads), read) == (1, [["a", "b", "c", "d"]])
    read.clear()
    growth.read_by_workers(texts, 2)(5)
    assert (len(loads), read) == (2, [["a", "b"], ["c", "d"], ["e"]])


def test_workers_of_ray_are_asked_where_there_are_some(monkeypatch):
    asked = []

    def workers(task, load, arguments, jobs, count, ray):
        asked.append((len(jobs), count, ray))
        return iter([0.25] * len(jobs))

    monkeypatch.setattr(growth, "in_parallel", workers)
    _, worked, memory = growth.read_by_workers(different_instructions(120), 3, ray=True)(120)
    assert (asked, worked, memory) == ([(3, 3, True)], 0.75, None)


@pytest.mark.usefixtures("without_workers")
def test_memory_is_left_out_where_the_system_does_not_tell(monkeypatch, tmp_path):
    monkeypatch.setattr(growth, "_RESET", tmp_path / "there is none" / "x")
    monkeypatch.setattr(growth, "OBJECTS", ())
    grown = measure_growth("geometric", runs=1, largest=3)
    assert grown[0].megabytes == (None,)
    plot(grown, tmp_path / "benchmark.png")
