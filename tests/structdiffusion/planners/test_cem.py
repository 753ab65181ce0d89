import pytest
import torch

from grounding.spec import StructureSpec
from structdiffusion.models.cvae import PoseCVAE
from structdiffusion.models.cvae.model import CVAEConfig
from structdiffusion.models.structure import StructureDiscriminator
from structdiffusion.models.structure.model import StructureConfig
from structdiffusion.observation import StructureGoal
from structdiffusion.planners.cem import PoseSearch, maximise
from structdiffusion.planners.guidance import StructureScore
from structdiffusion.planners.samples import EncodedScene, SampleBatch

GOAL = StructureGoal(StructureSpec("circle"))


def generator(seed=0):
    return torch.Generator().manual_seed(seed)


def test_searches_side_by_side_find_each_their_own_summit():
    summits = torch.tensor([[0.5, -0.5, 0.2], [-1.0, 0.3, 0.0]])

    def score(candidates):  # (K, M, 3)
        return -(candidates - summits[:, None]).square().sum(dim=-1)

    start = torch.zeros(2, 3)
    found, scores = maximise(score, start, torch.tensor(1.0), generator(), rounds=12)
    torch.testing.assert_close(found, summits, atol=0.03, rtol=0)
    torch.testing.assert_close(scores, score(found[:, None])[:, 0])
    few, _ = maximise(score, start, torch.tensor(1.0), generator(), rounds=2)
    assert ((few - summits).norm(dim=1) < (start - summits).norm(dim=1)).all()
    assert ((found - summits).norm(dim=1) < (few - summits).norm(dim=1)).all()


def test_a_start_at_the_summit_is_kept():
    start = torch.tensor([[1.0, 2.0], [3.0, 4.0]])

    def score(candidates):
        return -(candidates - start[:, None]).abs().sum(dim=-1)

    found, scores = maximise(score, start, torch.tensor([0.3, 0.3]), generator())
    assert torch.equal(found, start) and torch.equal(scores, torch.zeros(2))


@pytest.fixture(scope="module")
def sampled():
    """A network, four objects, and eight random states of them."""
    torch.manual_seed(0)
    model = PoseCVAE(CVAEConfig(width=32, layers=1, heads=2, feed_forward=48, points=16, point_width=16)).eval()
    given = model.fake_input(1, 4, generator())
    seen = EncodedScene([], given["clouds"][0], given["nouns"][0])
    order = torch.rand(8, 4, generator=generator(1)).argsort(dim=1)
    with torch.no_grad():
        told = given["clouds"], torch.ones(1, 4, dtype=torch.bool), given["nouns"]
        condition = model.condition(*told, words=given["words"]).repeat(8)
        samples = SampleBatch(condition, order, seen.clouds.mean(dim=1)[order])
        state = model(torch.randn(8, 32, generator=generator(2)), condition)
    return model, seen, samples, state


@torch.no_grad()
def test_the_search_raises_the_discriminators_score_and_leaves_the_frame(sampled):
    model, seen, samples, state = sampled
    structure = StructureDiscriminator(StructureConfig(width=16, layers=1, points=48)).eval()

    def scores(samples, state):
        _, position, turn = model.decode_state(state)
        return StructureScore.of(structure, seen, samples, GOAL)(position, turn)

    before = scores(samples, state)
    search = PoseSearch(structure, share=0.5, deviation=(0.015, 0.015, 0.005, 0.15))
    better, improved = search.improve(model, seen, samples, state, GOAL, generator())
    after = scores(better, improved)
    assert (after.diff() <= 1e-5).all()  # best first
    ranked = before.argsort(descending=True)
    assert after.max() > before.max() + 1e-4
    # Which sample each row was: the order of objects and the structure's frame are as they were.
    frame, position, turn = model.decode_state(improved)
    old_frame, old_position, old_turn = model.decode_state(state)
    was = (frame[:, None] - old_frame[None]).abs().amax(dim=(2, 3)).argmin(dim=1)
    assert sorted(was.tolist()) == list(range(8))
    torch.testing.assert_close(frame, old_frame[was], atol=1e-5, rtol=0)
    assert torch.equal(better.order, samples.order[was])
    moved = (position - old_position[was]).norm(dim=-1).amax(dim=1)
    for row, old in enumerate(was.tolist()):
        assert after[row] >= before[old] - 1e-5
        assert (1e-3 < moved[row] < 0.3) if old in ranked[:4] else moved[row] < 1e-5
    upright = turn @ old_turn[was].transpose(-1, -2)
    torch.testing.assert_close(upright[..., 2, 2], torch.ones(8, 4), atol=1e-4, rtol=0)
