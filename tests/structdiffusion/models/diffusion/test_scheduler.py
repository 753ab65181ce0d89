import pytest
import torch

from structdiffusion.models.diffusion.scheduler import NoiseScheduler

STEPS = 200


def sample(seed: int = 0) -> tuple[torch.Tensor, torch.Tensor]:
    generator = torch.Generator().manual_seed(seed)
    shape = (STEPS, 3, 9)
    return tuple(torch.randn(shape, generator=generator, dtype=torch.float64) for _ in range(2))


@pytest.mark.parametrize("kind", ["epsilon", "v"])
def test_the_target_leads_back_to_the_clean_sample(kind):
    clean, noise = sample()
    scheduler, every = NoiseScheduler(STEPS, kind), torch.arange(STEPS)
    noisy = scheduler.add_noise(clean, noise, every)
    found = scheduler.predict_original_sample(scheduler.target(clean, noise, every), every, noisy)
    torch.testing.assert_close(found, clean)


def test_noise_grows_and_the_signal_is_gone_at_the_end():
    clean, noise = sample()
    scheduler = NoiseScheduler(STEPS)
    noisy = scheduler.add_noise(clean, noise, torch.arange(STEPS))
    distance = (noisy - clean).flatten(1).norm(dim=1) / clean.flatten(1).norm(dim=1)
    assert distance[0] < 0.05
    cumulative = scheduler.alphas_cumprod
    assert (cumulative[1:] < cumulative[:-1]).all()
    assert cumulative[-1].sqrt() < 0.01
    # Unit variance in, unit variance out, at every step.
    assert noisy.flatten(1).var(dim=1).mean() == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize("kind", ["epsilon", "v"])
@pytest.mark.parametrize("count", [1, 7, 25, STEPS])
def test_ddim_with_the_true_prediction_recovers_the_clean_sample(kind, count):
    clean, noise = (tensor[:2] for tensor in sample(1))
    scheduler = NoiseScheduler(STEPS, kind)
    scheduler.set_timesteps(count, "ddim")
    assert len(scheduler.timesteps) == count and len(set(scheduler.timesteps.tolist())) == count
    state = scheduler.add_noise(clean, noise, scheduler.timesteps[:1].expand(2))
    for index, timestep in enumerate(scheduler.timesteps):
        # On the exact path the noise stays what it was, so that every sample is known in closed form.
        torch.testing.assert_close(state, scheduler.add_noise(clean, noise, timestep.expand(2)), atol=1e-5, rtol=0)
        step = scheduler.step(scheduler.target(clean, noise, timestep.expand(2)), index, state)
        torch.testing.assert_close(step.pred_original_sample, clean, atol=1e-4, rtol=0)
        state = step.prev_sample
    torch.testing.assert_close(state, clean, atol=1e-4, rtol=0)


@pytest.mark.parametrize("t", [1, 60, 199])
def test_ddpm_has_the_textbook_posterior(t):
    """Ho et al. 2020, equations 7 and 11, for neighbouring steps; not the misprinted Algorithm 1."""
    scheduler = NoiseScheduler(STEPS, "epsilon")
    scheduler.set_timesteps(STEPS, "ddpm")
    index = STEPS - 1 - t
    assert int(scheduler.timesteps[index]) == t
    betas = torch.linspace(0.0005, 0.1, STEPS, dtype=torch.float64)
    cumulative = torch.cumprod(1 - betas, dim=0)
    beta, bar, bar_before = betas[t], cumulative[t], cumulative[t - 1]
    draws = 60_000
    state, epsilon = torch.tensor(0.7, dtype=torch.float64), torch.tensor(-0.4, dtype=torch.float64)
    generator = torch.Generator().manual_seed(0)
    step = scheduler.step(epsilon.expand(draws, 1), index, state.expand(draws, 1), generator)
    mean = (state - beta / (1 - bar).sqrt() * epsilon) / (1 - beta).sqrt()
    variance = beta * (1 - bar_before) / (1 - bar)
    deviation = float(variance.sqrt())
    assert float(step.prev_sample.mean()) == pytest.approx(float(mean), abs=5 * deviation / draws**0.5 + 1e-6)
    assert float(step.prev_sample.std()) == pytest.approx(deviation, rel=0.02)


def test_ddpm_over_skipped_steps_keeps_the_marginal():
    """From q(x_t), with the true clean sample known, the step has to land in q(x_s)."""
    scheduler = NoiseScheduler(STEPS, "epsilon")
    scheduler.set_timesteps(10, "ddpm")
    generator = torch.Generator().manual_seed(3)
    clean = torch.full((60_000, 1), 1.5, dtype=torch.float64)
    noise = torch.randn(clean.shape, generator=generator, dtype=torch.float64)
    now, after = scheduler.timesteps[4], scheduler.timesteps[5]
    state = scheduler.add_noise(clean, noise, now.expand(len(clean)))
    previous = scheduler.step(noise, 4, state, generator).prev_sample
    bar = scheduler.alphas_cumprod[after]
    assert float(previous.mean()) == pytest.approx(1.5 * float(bar.sqrt()), abs=0.02)
    assert float(previous.std()) == pytest.approx(float((1 - bar).sqrt()), rel=0.02)


def test_ddpm_draws_from_its_generator_alone_and_not_at_the_end():
    scheduler = NoiseScheduler(STEPS, "v")
    scheduler.set_timesteps(5, "ddpm")
    state = torch.ones(2, 4)
    first, second, other = (
        scheduler.step(state, 0, state, torch.Generator().manual_seed(seed)).prev_sample for seed in (1, 1, 2)
    )
    assert torch.equal(first, second) and not torch.equal(first, other)
    last = scheduler.step(state, 4, state, torch.Generator().manual_seed(1))
    assert torch.equal(last.prev_sample, last.pred_original_sample)


@pytest.mark.parametrize("count", [0, -3, STEPS + 1])
def test_a_wrong_number_of_steps_is_an_error(count):
    with pytest.raises(ValueError, match=rf"{count}; legal values: 1 to 200"):
        NoiseScheduler(STEPS).set_timesteps(count)


def test_unknown_samplers_and_predictions_are_errors():
    with pytest.raises(ValueError, match="'euler'; legal values: ddpm, ddim"):
        NoiseScheduler(STEPS).set_timesteps(10, "euler")
    with pytest.raises(ValueError, match="'x0'; legal values: epsilon, v"):
        NoiseScheduler(STEPS, "x0")
