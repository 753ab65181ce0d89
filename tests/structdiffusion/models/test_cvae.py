import math
from dataclasses import replace
from functools import partial

import pytest
import torch
from torch.distributions import Normal

from structdiffusion.data.batches import DemonstrationBatches
from structdiffusion.models.checkpoint import CheckpointError
from structdiffusion.models.cvae import PoseCVAE
from structdiffusion.models.cvae.loss import DEVIATION, cvae_loss
from structdiffusion.models.cvae.model import CVAEConfig
from structdiffusion.models.diffusion import PoseDiffusion
from structdiffusion.training.loop import TrainingOptions, train

SMALL = CVAEConfig(width=32, layers=1, heads=2, feed_forward=48, points=24, point_width=16, latent=6, latent_layers=1)


@pytest.fixture
def model():
    torch.manual_seed(0)
    return PoseCVAE(SMALL).eval()


@pytest.fixture
def generator():
    return torch.Generator().manual_seed(0)


def encoded(model, generator, batch=3, objects=4, **changes):
    given = {**model.fake_input(batch, objects, generator), **changes}
    return given, model.condition(given["clouds"], given["present"], given["nouns"], words=given["words"])


@torch.no_grad()
def test_the_latent_reaches_every_pose_and_poses_reach_only_the_posterior(model, generator):
    _, condition = encoded(model, generator)
    latent, state = torch.randn(3, 6, generator=generator), torch.randn(3, 5, 9, generator=generator)
    made = model(latent, condition)
    assert made.shape == (3, 5, 9)
    assert ((model(latent + 0.5, condition) - made).abs().amax(dim=-1) > 1e-4).all()
    posterior, prior = model.posterior(state, condition), model.prior(condition)
    assert posterior.mean.shape == prior.mean.shape == (3, 6)
    for row in range(5):  # of the present objects' poses, none is overlooked
        other = state.clone()
        other[:1, row] += 1.0
        assert (model.posterior(other, condition).mean - posterior.mean)[0].abs().max() > 1e-5
    assert not torch.allclose(posterior.mean, prior.mean, atol=1e-3)


@torch.no_grad()
def test_the_scene_and_the_words_reach_the_prior(model, generator):
    given, condition = encoded(model, generator)
    prior = model.prior(condition).mean
    for name, value in (("clouds", given["clouds"] * 1.2), ("words", (given["words"] + 1) % 5)):
        _, other = encoded(model, generator, **{**given, name: value})
        assert (model.prior(other).mean - prior).abs().max() > 1e-4


@torch.no_grad()
def test_absent_objects_have_no_say(model, generator):
    present = torch.tensor([[True, True, True, False]]).expand(2, -1)
    given, condition = encoded(model, generator, 2, 4, present=present)
    latent, state = torch.randn(2, 6, generator=generator), torch.randn(2, 5, 9, generator=generator)
    elsewhere, clouds = state.clone(), given["clouds"].clone()
    elsewhere[:, 4], clouds[:, 3] = 9.0, clouds[:, 3] + 1.0
    _, other = encoded(model, generator, 2, 4, **{**given, "clouds": clouds})
    torch.testing.assert_close(model(latent, other)[:, :4], model(latent, condition)[:, :4], atol=1e-5, rtol=0)
    torch.testing.assert_close(
        model.posterior(elsewhere, other).mean, model.posterior(state, condition).mean, atol=1e-5, rtol=0
    )


def test_the_divergence_is_of_the_posterior_from_the_prior(model, generator, data_folder):
    """For N(1, 2) from N(0, 1), (2^2 + 1^2 - 1) / 2 - log 2 a number of the latent; the other way round it is less."""
    ones = torch.ones(8, 6)
    model.posterior = lambda state, condition: Normal(ones, 2 * ones)
    model.prior = lambda condition: Normal(0 * ones, ones)
    losses = cvae_loss(model, DemonstrationBatches(data_folder), generator, 8)
    assert losses["divergence"].item() == pytest.approx(6 * (2.0 - math.log(2.0)), rel=1e-5)


def test_the_loss_is_the_bound_in_units_of_the_positions_error(model, generator, data_folder):
    """Twice the variance over the number of position numbers: what turns |error|^2 / (2 s^2) into a mean."""
    data = DemonstrationBatches(data_folder)
    batch = data.draw(8, generator)
    data.draw = lambda *_, **__: batch
    losses = cvae_loss(model, data, generator, 8)
    tokens = 8 + int(batch.present.sum())
    reconstruction = losses["position"] + 0.5 * losses["rotation"]
    weighed = losses["divergence"] * 8 * 2 * DEVIATION**2 / (3 * tokens)
    assert losses["loss"].item() == pytest.approx((reconstruction + weighed).item(), rel=1e-4)
    losses["loss"].backward()
    for name, parameter in model.named_parameters():
        assert parameter.grad is not None and torch.isfinite(parameter.grad).all(), name
        assert parameter.grad.abs().sum() > 0, name


def test_training_makes_the_latent_tell_what_the_scene_leaves_open(data_folder, tmp_path):
    data = DemonstrationBatches(data_folder)
    batch = data.draw(8, torch.Generator().manual_seed(0))
    data.draw = lambda *_, **__: batch  # always the same scenes
    torch.manual_seed(0)
    model = PoseCVAE(replace(SMALL, width=48))
    options = TrainingOptions(steps=80, learning_rate=3e-3, warmup=10, log_every=20)
    progress = list(train(model, partial(cvae_loss, model, data, scenes=8), tmp_path, options, torch.device("cpu")))
    assert progress[-1].losses["loss"] < 0.5 * progress[0].losses["loss"]
    assert progress[-1].losses["position"] < 0.5 * progress[0].losses["position"]


def test_a_checkpoint_comes_back_and_another_networks_is_refused(model, generator, tmp_path):
    model.save_pretrained(tmp_path)
    loaded = PoseCVAE.from_pretrained(tmp_path)
    assert loaded.config == SMALL
    _, condition = encoded(model, generator)
    _, again = encoded(loaded, torch.Generator().manual_seed(0))
    latent = torch.randn(3, 6, generator=generator)
    with torch.no_grad():
        torch.testing.assert_close(loaded(latent, again), model(latent, condition), atol=2e-2, rtol=0)
    with pytest.raises(CheckpointError, match="of kind 'cvae'; expected 'diffusion'"):
        PoseDiffusion.from_pretrained(tmp_path)
