"""The released network is timed beside ours; a small package with its import paths stands in for it."""

import sys

import pytest
import torch

from structdiffusion.benchmark.latency import loaded, observed_scenes
from structdiffusion.benchmark.released_network import (
    RELEASED,
    SAMPLES,
    ReleasedNetwork,
    ReleasedNetworkError,
    measure_sampling,
)
from tests.structdiffusion.benchmark.released_checkout import MODEL, checkout


@pytest.fixture(scope="module")
def planner():
    return loaded("diffusion-tokens")


def test_a_step_is_that_of_the_released_sampler(tmp_path):
    released = ReleasedNetwork(checkout(tmp_path))
    assert released.steps == 200
    clouds, state = torch.zeros(3, 1024, 3), torch.ones(2, 4, 9)
    # 2 (x - 0.01 / 0.1 * x / 2), and in every step but the last noise with a deviation of a half
    assert torch.allclose(released.denoise(clouds, state, 0, torch.Generator().manual_seed(0)), 1.9 * state)
    noise = released.denoise(clouds, state, 7, torch.Generator().manual_seed(0)) - 1.9 * state
    assert torch.allclose(noise, 0.5 * torch.randn((2, 4, 9), generator=torch.Generator().manual_seed(0)))


def test_both_networks_are_timed_on_one_scene(planner, tmp_path):
    (scene,) = observed_scenes("circle", 3, 1)
    released = ReleasedNetwork(checkout(tmp_path))
    theirs, ours = measure_sampling(released, planner, "diffusion-tokens", "circle", scene, runs=3)
    assert (theirs.model, theirs.denoising_steps) == (RELEASED, 200)
    assert (ours.model, ours.denoising_steps) == ("diffusion-tokens", 10)
    for row in (theirs, ours):
        assert (row.structure, row.objects, row.samples, row.runs) == ("circle", 3, SAMPLES, 3)
        assert row.seconds_per_candidate >= 0.99 * row.seconds_per_step * row.denoising_steps / SAMPLES > 0
    assert released._network.asked == [199, 198, 197, 196]  # the first warms up


def test_every_checkout_has_its_own_code_and_leaves_nothing_behind(tmp_path):
    assert ReleasedNetwork(checkout(tmp_path / "one")).steps == 200
    ReleasedNetwork(checkout(tmp_path / "two", MODEL.replace("* 0.5", "* 0.25")))
    assert not [name for name in sys.modules if name.startswith("StructDiffusion")]
    assert not [path for path in sys.path if path.startswith(str(tmp_path))]


@pytest.mark.parametrize(
    ("model", "said"),
    [
        ("import pytorch3d_of_nobody", "needs 'pytorch3d_of_nobody', which is not installed"),
        ("class Other: pass", "does not hold the released network: .*TransformerDiffusionModel"),
        (MODEL.replace("ignore_rgb=False, ", ""), "does not hold the released network: .*ignore_rgb"),
    ],
)
def test_what_is_not_the_released_network_is_refused(model, said, tmp_path):
    with pytest.raises(ReleasedNetworkError, match=said):
        ReleasedNetwork(checkout(tmp_path, model))


def test_a_folder_without_the_network_is_named(tmp_path):
    with pytest.raises(ReleasedNetworkError, match="has no file src/StructDiffusion/models/models.py"):
        ReleasedNetwork(tmp_path)


def test_more_objects_than_it_can_take_are_refused(planner, tmp_path):
    (scene,) = observed_scenes("line", 8, 1)
    with pytest.raises(ReleasedNetworkError, match="at most 7 objects, not 8"):
        measure_sampling(ReleasedNetwork(checkout(tmp_path)), planner, "diffusion-tokens", "line", scene, runs=1)


def test_a_network_that_fails_is_one_sentence(planner, tmp_path):
    (scene,) = observed_scenes("circle", 3, 1)
    released = ReleasedNetwork(checkout(tmp_path, MODEL.replace("poses * 0.5", "poses @ poses")))
    with pytest.raises(ReleasedNetworkError, match="cannot be run here"):
        measure_sampling(released, planner, "diffusion-tokens", "circle", scene, runs=1)
