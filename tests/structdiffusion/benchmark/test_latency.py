import pytest

from structdiffusion.benchmark import latency
from structdiffusion.benchmark.latency import measure, observed_scene, plot, sweep


def test_the_scene_has_as_many_objects_as_asked_for():
    scene = observed_scene(5, seed=0)
    assert len(scene.objects) == 5 and not scene.distractors


def test_seconds_are_measured_and_ordered():
    result = measure("diffusion-tokens", objects=3, candidates=2, runs=3)
    assert 0 < result["seconds_min"] <= result["seconds_median"] <= result["seconds_max"]
    assert (result["objects"], result["candidates"], result["runs"]) == (3, 2, 3)
    assert isinstance(result["rollout_seconds"], float)


def test_what_a_stand_in_for_a_sentence_asks_for_is_not_tried_out():
    result = measure("diffusion", objects=3, candidates=2, runs=1)
    assert result["seconds_median"] > 0 and result["rollout_seconds"] is None


def test_a_sweep_covers_both_numbers_and_is_drawn(monkeypatch, tmp_path):
    monkeypatch.setattr(latency, "_CANDIDATES", (1, 2))
    monkeypatch.setattr(latency, "_OBJECTS", (3, 7))
    results = sweep("geometric+rollout", runs=1)
    assert [(row["objects"], row["candidates"]) for row in results] == [(7, 1), (7, 2), (3, 64)]
    plot(results, tmp_path / "out" / "benchmark.png")
    assert (tmp_path / "out" / "benchmark.png").read_bytes().startswith(b"\x89PNG")


def test_an_unknown_model_is_named():
    with pytest.raises(ValueError, match="model cannot be 'magic'; legal values: diffusion, diffusion-tokens, geometric"):
        measure("magic", objects=3, candidates=2, runs=1)
