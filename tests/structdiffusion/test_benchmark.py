import pytest

from structdiffusion.benchmark import measure, observed_scene


def test_the_scene_has_as_many_objects_as_asked_for():
    scene = observed_scene(5, seed=0)
    assert len(scene.objects) == 5 and not scene.distractors


def test_seconds_are_measured_and_ordered():
    result = measure("diffusion", objects=3, candidates=2, runs=3)
    assert 0 < result["seconds_min"] <= result["seconds_median"] <= result["seconds_max"]
    assert (result["objects"], result["candidates"], result["runs"]) == (3, 2, 3)


def test_an_unknown_model_is_named():
    with pytest.raises(ValueError, match="model cannot be 'magic'; legal values: diffusion, diffusion-tokens, geometric"):
        measure("magic", objects=3, candidates=2, runs=1)
