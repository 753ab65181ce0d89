import numpy as np
import pytest
import torch

from grounding.spec import StructureSpec
from structdiffusion.completion.estimate import estimate
from structdiffusion.models.diffusion import PoseDiffusion
from structdiffusion.models.diffusion.model import DiffusionConfig
from structdiffusion.models.diffusion.scheduler import NoiseScheduler
from structdiffusion.models.structure import StructureDiscriminator
from structdiffusion.models.structure.model import StructureConfig
from structdiffusion.observation import ObjectCloud, StructureGoal
from structdiffusion.planners.diffusion import DiffusionPlanner
from structdiffusion.planners.guidance import StructureScore, guided
from structdiffusion.planners.samples import EncodedScene, prepare_samples
from structdiffusion.word_tokens import word_ids

GOAL = StructureGoal(StructureSpec("line", size="small"))


def generator(seed=0):
    return torch.Generator().manual_seed(seed)


@pytest.fixture(scope="module")
def model():
    torch.manual_seed(0)
    sizes = {"width": 32, "layers": 1, "heads": 2, "feed_forward": 48, "points": 16, "point_width": 16}
    return PoseDiffusion(DiffusionConfig(**sizes)).eval()


@pytest.fixture(scope="module")
def structure():
    torch.manual_seed(1)
    return StructureDiscriminator(StructureConfig(width=16, layers=1, points=48)).eval()


@pytest.fixture(scope="module")
def seen():
    """Three boxes."""
    clouds = torch.rand(3, 256, 3, generator=generator()) * torch.tensor([0.06, 0.04, 0.1])
    clouds = clouds + torch.tensor([[0.4, -0.2, 0.0], [0.5, 0.0, 0.0], [0.3, 0.2, 0.0]])[:, None]
    objects = [estimate(ObjectCloud(f"box {i}", "box", cloud.numpy())) for i, cloud in enumerate(clouds)]
    return EncodedScene(objects, clouds, torch.tensor([1, 0, 2]))


@pytest.mark.parametrize("prediction_type", ["epsilon", "v"])
def test_a_prediction_follows_from_the_clean_state_that_it_implies(prediction_type):
    scheduler = NoiseScheduler(200, prediction_type)
    prediction, sample = torch.randn(2, 6, 4, 9, generator=generator())
    steps = torch.tensor([0, 5, 50, 100, 150, 199])
    clean = scheduler.predict_original_sample(prediction, steps, sample)
    torch.testing.assert_close(scheduler.prediction_of(clean, steps, sample), prediction, atol=5e-3, rtol=1e-3)
    assert 0 < scheduler.noise_level(torch.tensor(0)) < 0.1 < 0.99 < scheduler.noise_level(torch.tensor(199)) < 1


@torch.no_grad()
def test_the_score_is_the_discriminators_of_the_moved_clouds_place_by_place(model, structure, seen):
    samples = prepare_samples(model, seen, GOAL, False, 5, generator())
    state = torch.randn(5, 4, 9, generator=generator(1))
    _, position, turn = model.decode_state(state)
    scores = StructureScore.of(structure, seen, samples, GOAL)(position, turn)
    motions = samples.decode(model, state).motions
    for k in range(5):
        moved = torch.from_numpy(motions[k]).float()
        moved = torch.einsum("nij,npj->npi", moved[:, :3, :3], seen.clouds) + moved[:, None, :3, 3]
        at_goal = moved[samples.order[k]][None]
        nouns, words = seen.nouns[samples.order[k]][None], torch.tensor([word_ids(GOAL.spec)])
        logit = structure(at_goal, torch.ones(1, 3, dtype=torch.bool), nouns, words)
        torch.testing.assert_close(scores[k], logit.sigmoid().log()[0], atol=1e-4, rtol=0)


def test_guidance_goes_up_the_slope_by_weight_and_noise_and_leaves_the_frame(model):
    clean = torch.randn(6, 4, 9, generator=generator())
    top = torch.tensor([0.4, 0.0, 0.1])

    def score(position, turn):
        return -(position - top).square().sum(dim=(1, 2))

    def scored(state):
        _, position, turn = model.decode_state(state)
        return score(position, turn)

    once = guided(clean, 0.5, 1.0, model, score)
    assert torch.equal(once[:, 0], clean[:, 0])
    assert (scored(once) > scored(clean)).all()
    twice, noisier = guided(clean, 0.5, 2.0, model, score), guided(clean, 1.0, 1.0, model, score)
    torch.testing.assert_close(twice - clean, 2 * (once - clean))
    torch.testing.assert_close(noisier - clean, 4 * (once - clean))
    torch.testing.assert_close(once[..., 3:], clean[..., 3:])  # this score does not ask how anything is turned
    # By hand: the slope in metres, times what a unit of the state is in metres, in the structure's axes.
    frame, position, _ = model.decode_state(clean)
    slope = torch.einsum("kji,knj->kni", frame[:, :3, :3], -2 * (position - top))
    slope = slope * torch.tensor(model.config.object_scale)
    assert slope.norm(dim=-1).max() < 1.0
    torch.testing.assert_close((once - clean)[:, 1:, :3], 0.25 * slope, atol=1e-5, rtol=1e-4)
    steep = guided(clean, 1.0, 3.0, model, lambda position, turn: 1e4 * score(position, turn))
    torch.testing.assert_close((steep - clean)[:, 1:].norm(dim=-1), torch.full((6, 3), 3.0), atol=1e-3, rtol=0)


def test_without_weight_nothing_is_guided_bit_for_bit(model, structure, seen):
    def sampled(**options):
        return DiffusionPlanner(model, sentence=False, steps=6, **options).sample(seen, GOAL, 4, generator())

    plain = sampled()
    unguided = sampled(guide=structure, guidance=0.0)
    assert np.array_equal(plain.motions, unguided.motions) and np.array_equal(plain.frames, unguided.frames)
    other = sampled(guide=structure, guidance=4.0)
    assert np.abs(other.motions - plain.motions).max() > 1e-4


def test_the_more_guidance_the_higher_the_score(model, structure, seen):
    def mean_score(weight):
        planner = DiffusionPlanner(model, sentence=False, steps=10, guide=structure, guidance=weight)
        motions = planner.sample(seen, GOAL, 16, generator()).motions
        samples = prepare_samples(model, seen, GOAL, False, 16, generator())  # the same orders of the objects
        moved = torch.from_numpy(motions).float()
        moved = moved[torch.arange(16)[:, None], samples.order]
        position = torch.einsum("knij,knj->kni", moved[..., :3, :3], samples.means) + moved[..., :3, 3]
        with torch.no_grad():
            return StructureScore.of(structure, seen, samples, GOAL)(position, moved[..., :3, :3]).mean().item()

    none, little, much = (mean_score(weight) for weight in (0.0, 2.0, 8.0))
    assert none < little < much
