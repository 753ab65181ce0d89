import math
from copy import deepcopy
from functools import partial

import numpy as np
import pytest
import torch

from grounding.spec import FIRST_SHAPES
from structdiffusion.data.batches import DemonstrationBatches
from structdiffusion.models.checkpoint import CheckpointError
from structdiffusion.models.structformer import StructFormer
from structdiffusion.models.structformer.loss import structformer_loss
from structdiffusion.models.structformer.model import StructFormerConfig
from structdiffusion.training.loop import TrainingOptions, train
from structdiffusion.word_tokens import WORDS

SIZES = {"width": 32, "layers": 2, "heads": 2, "feed_forward": 48, "points": 24, "point_width": 16, "mixture": 3}
SMALL = StructFormerConfig(**SIZES)


@pytest.fixture(scope="module")
def model():
    torch.manual_seed(0)
    return StructFormer(SMALL).eval()


@pytest.fixture
def generator():
    return torch.Generator().manual_seed(0)


def encoded(model, generator, batch=2, objects=4, **changes):
    whole = {"present": torch.ones(batch, objects, dtype=torch.bool)}
    given = {**model.fake_input(batch, objects, generator), **whole, **changes}
    return given, model.condition(given["clouds"], given["present"], given["nouns"], words=given["words"])


def means(poses):
    return poses.component_distribution.base_dist.loc


@torch.no_grad()
def test_a_pose_is_told_the_poses_before_it_and_no_other(model, generator):
    _, condition = encoded(model, generator)
    state = torch.randn(2, 5, 9, generator=generator)
    base = means(model(state, condition))
    for row in range(5):
        other = state.clone()
        other[:, row] += 1.0
        change = (means(model(other, condition)) - base).abs().amax(dim=(0, 2, 3))
        assert (change[: row + 1] == 0).all()
        assert (change[row + 1 :] > 1e-5).all()


@torch.no_grad()
def test_every_pose_is_told_of_every_object_and_word(model, generator):
    given, condition = encoded(model, generator)
    state = torch.randn(2, 5, 9, generator=generator)
    base = means(model(state, condition))
    larger = given["clouds"].clone()
    larger[:, 3] = larger[:, 3] * 1.5
    words = given["words"].clone()
    words[:, 4] = WORDS["rotation", "west"]
    for changed in ({"clouds": larger}, {"words": words}):
        _, other = encoded(model, generator, **{**given, **changed})
        change = (means(model(state, other)) - base).abs().amax(dim=(0, 2, 3))
        assert (change > 1e-5).all()


@torch.no_grad()
def test_absent_objects_have_no_say(model, generator):
    present = torch.tensor([[True, False, True, False]]).expand(2, -1)
    given, condition = encoded(model, generator, present=present)
    state = torch.randn(2, 5, 9, generator=generator)
    elsewhere, clouds = state.clone(), given["clouds"].clone()
    elsewhere[:, 2], clouds[:, 1] = 9.0, clouds[:, 1] + 1.0
    _, other = encoded(model, generator, **{**given, "clouds": clouds})
    there = torch.tensor([0, 1, 3])
    base, found = means(model(state, condition)), means(model(elsewhere, other))
    torch.testing.assert_close(found[:, there], base[:, there], atol=1e-5, rtol=0)


@torch.no_grad()
def test_the_likelihood_is_that_of_the_mixture(model, generator):
    _, condition = encoded(model, generator)
    state = torch.randn(2, 5, 9, generator=generator)
    poses = model(state, condition)
    gaussian, weights = poses.component_distribution.base_dist, poses.mixture_distribution.probs
    z = (state[:, :, None] - gaussian.loc) / gaussian.scale
    density = torch.exp(-0.5 * z.square() - gaussian.scale.log() - 0.5 * math.log(2 * math.pi)).double().prod(dim=-1)
    expected = (weights * density).sum(dim=-1).log()
    torch.testing.assert_close(poses.log_prob(state).double(), expected, atol=1e-3, rtol=1e-4)
    assert gaussian.scale.min() > 0.1  # the resolution


@torch.no_grad()
def test_samples_are_drawn_pose_by_pose_from_what_the_network_says(model, generator):
    """Where nothing is uncertain but which Gaussian, each pose is the mean of one that the poses before it imply."""
    _, condition = encoded(model, generator)
    condition = condition.repeat(20)
    sure = deepcopy(model)
    sure.head[-1].bias[-SMALL.mixture * 9 :] -= 30.0
    state = sure.sample(condition, generator)
    away = (means(model(state, condition)) - state[:, :, None]).abs().amax(dim=-1)  # (B, 1 + N, K)
    assert away.amin(dim=-1).max() < 1e-3
    assert len(set(away[:20, 0].argmin(dim=-1).tolist())) == 3  # each Gaussian is drawn from at times
    gaussian = model(torch.zeros(40, 5, 9), condition).component_distribution.base_dist
    state = torch.stack([model.sample(condition, torch.Generator().manual_seed(k))[:20, 0] for k in range(40)])
    share = model(torch.zeros(40, 5, 9), condition).mixture_distribution.probs[0, 0, :, None]
    mean = (share * gaussian.loc[0, 0]).sum(dim=0)
    drawn = 0.5**2 * (gaussian.scale[0, 0].square() - 0.1**2)  # half the spread, free of the resolution
    variance = (share * (drawn + (gaussian.loc[0, 0] - mean).square())).sum(dim=0)
    torch.testing.assert_close(state.flatten(0, 1).mean(dim=0), mean, atol=0.12, rtol=0)
    torch.testing.assert_close(state.flatten(0, 1).var(dim=0), variance, atol=0.0, rtol=0.2)
    again = model.sample(condition, torch.Generator().manual_seed(3))
    torch.testing.assert_close(model.sample(condition, torch.Generator().manual_seed(3)), again, atol=0, rtol=0)
    assert not torch.allclose(model.sample(condition, torch.Generator().manual_seed(4)), again, atol=0.1)


@pytest.mark.parametrize("shape", FIRST_SHAPES)
def test_batches_of_one_shape(data_folder, generator, shape):
    data, whole = DemonstrationBatches(data_folder, shape=shape), DemonstrationBatches(data_folder)
    word = WORDS["shape", shape]
    assert 0 < len(data) == int((whole.words[:, 0] == word).sum()) < len(whole)
    words = data.draw(40, generator).words[:, 0]
    assert set(words.tolist()) <= {0, word} and (words == word).any()


def test_a_shape_that_no_scene_has_is_named(data_folder, tmp_path):
    for name in ("library.npz", "language.npz", "shard_00000.npz"):
        (tmp_path / name).write_bytes((data_folder / name).read_bytes())
    with np.load(tmp_path / "shard_00000.npz") as shard:
        columns = dict(shard)
    columns["words"][:, 0] = WORDS["shape", "line"]
    np.savez(tmp_path / "shard_00000.npz", **columns)
    with pytest.raises(FileNotFoundError, match=f"none of the 12 scenes in {tmp_path} is a tower; .*generate"):
        DemonstrationBatches(tmp_path, shape="tower")


def test_training_makes_demonstrations_likelier(data_folder, tmp_path):
    torch.manual_seed(0)
    model, data = StructFormer(SMALL), DemonstrationBatches(data_folder, shape="circle")
    options = TrainingOptions(steps=40, learning_rate=3e-3, warmup=5, log_every=10)
    loss = partial(structformer_loss, model, data, scenes=8)
    progress = list(train(model, loss, tmp_path, options, torch.device("cpu")))
    assert progress[-1].losses["loss"] < progress[0].losses["loss"] - 0.3
    loss(torch.Generator().manual_seed(0))["loss"].backward()
    for name, parameter in model.named_parameters():
        assert parameter.grad is not None and torch.isfinite(parameter.grad).all(), name
        assert parameter.grad.abs().sum() > 0, name


def test_a_checkpoint_comes_back_with_its_shape(generator, tmp_path):
    torch.manual_seed(0)
    model = StructFormer(StructFormerConfig(**SIZES, shape="table setting")).eval()
    model.save_pretrained(tmp_path)
    loaded = StructFormer.from_pretrained(tmp_path)
    assert loaded.config == model.config and loaded.config.shape == "table setting"
    _, condition = encoded(model, generator)
    _, again = encoded(loaded, torch.Generator().manual_seed(0))
    state = torch.randn(2, 5, 9, generator=generator)
    with torch.no_grad():
        torch.testing.assert_close(means(loaded(state, again)), means(model(state, condition)), atol=2e-2, rtol=0)
    config = tmp_path / "config.json"
    config.write_text(config.read_text().replace("table setting", "heart"))
    with pytest.raises(CheckpointError, match="shape cannot be 'heart'; legal values: circle, line"):
        StructFormer.from_pretrained(tmp_path)
