"""The baselines as planners, from checkpoints of small networks that were trained for a few steps."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
import torch

from grounding.spec import FIRST_SHAPES, StructureSpec
from structdiffusion.data.batches import DemonstrationBatches
from structdiffusion.geometry import tilt_between
from structdiffusion.models import structformer_name
from structdiffusion.models.checkpoint import CheckpointError
from structdiffusion.models.collision import CollisionDiscriminator
from structdiffusion.models.collision.model import CollisionConfig
from structdiffusion.models.cvae import PoseCVAE
from structdiffusion.models.cvae.loss import cvae_loss
from structdiffusion.models.cvae.model import CVAEConfig
from structdiffusion.models.diffusion import PoseDiffusion
from structdiffusion.models.diffusion.model import DiffusionConfig
from structdiffusion.models.outcome import OutcomeDiscriminator
from structdiffusion.models.outcome.model import OutcomeConfig
from structdiffusion.models.structformer import StructFormer
from structdiffusion.models.structformer.loss import structformer_loss
from structdiffusion.models.structformer.model import StructFormerConfig
from structdiffusion.models.structure import StructureDiscriminator
from structdiffusion.models.structure.model import StructureConfig
from structdiffusion.observation import ObjectCloud, Scene, StructureGoal
from structdiffusion.planners.baselines import CVAEPlanner, StructFormerPlanner
from structdiffusion.planners.factory import load_planner
from structdiffusion.planners.geometric import GeometricPlanner
from structdiffusion.planners.registry import PLANNERS
from structdiffusion.training.loop import TrainingOptions, train

SIZES = {"width": 32, "layers": 1, "heads": 2, "feed_forward": 48, "points": 16, "point_width": 16}
# Those that differ in a number alone are left out.
LEARNED = [
    name
    for name, parts in PLANNERS.items()
    if parts.network != "geometric"
    and not parts.candidates
    and parts.guidance in (0.0, 8.0)
    and not name.endswith(("steps5", "steps25", "ddpm200"))
]
STEPS = TrainingOptions(steps=4, learning_rate=2e-3, warmup=2, log_every=4)
GOAL = StructureGoal(StructureSpec("circle", size="small"), "a small ring", np.full(384, 0.05, dtype=np.float32))


def generator(seed=0):
    return torch.Generator().manual_seed(seed)


@pytest.fixture(scope="module")
def weights(data_folder, tmp_path_factory):
    """A folder with every checkpoint."""
    folder = tmp_path_factory.mktemp("weights")
    torch.manual_seed(0)

    def trained(model, loss, data, name):
        list(train(model, partial(loss, model, data, scenes=4), folder / name, STEPS, torch.device("cpu")))

    trained(PoseCVAE(CVAEConfig(**SIZES)), cvae_loss, DemonstrationBatches(data_folder), "cvae")
    for shape in FIRST_SHAPES:
        model = StructFormer(StructFormerConfig(**SIZES, shape=shape))
        trained(model, structformer_loss, DemonstrationBatches(data_folder, shape=shape), structformer_name(shape))
    PoseDiffusion(DiffusionConfig(**SIZES)).save_pretrained(folder / "diffusion")
    StructureDiscriminator(StructureConfig(width=16, layers=1, points=48)).save_pretrained(folder / "structure")
    CollisionDiscriminator(CollisionConfig(width=16, layers=1, points=32)).save_pretrained(folder / "collision")
    OutcomeDiscriminator(OutcomeConfig(width=16, layers=1)).save_pretrained(folder / "outcome")
    return folder


@pytest.fixture(scope="module")
def scene():
    """Four boxes that take part, and one that does not."""
    clouds = torch.rand(5, 300, 3, generator=generator()) * torch.tensor([0.06, 0.05, 0.1])
    at = torch.tensor([[0.3, -0.3, 0], [0.5, -0.2, 0], [0.35, 0.1, 0], [0.5, 0.3, 0], [0.25, 0.35, 0]])
    boxes = [ObjectCloud(f"box {i}", "box", cloud.numpy()) for i, cloud in enumerate(clouds + at[:, None])]
    return Scene(tuple(boxes[:4]), distractors=(boxes[4],))


@pytest.mark.parametrize("name", LEARNED)
def test_every_learned_planner_proposes(weights, scene, name):
    planner, parts = load_planner(name, weights), PLANNERS[name]
    if name != "diffusion":  # physics rollouts take the most time and are the same for all
        planner.post_process = replace(planner.post_process, rollouts=0)
    found = planner.propose(scene, GOAL, count=6, generator=generator())
    assert len(found) == 6
    for arrangement in found:
        assert arrangement.goal_from_initial.shape == (4, 4, 4) and arrangement.world_from_structure.shape == (4, 4)
        assert np.isfinite(arrangement.goal_from_initial).all()
        upright = [tilt_between(motion, np.eye(4)) < 1e-6 for motion in arrangement.goal_from_initial]
        assert all(upright) == parts.placed  # what an untrained network samples stands nowhere upright by chance
    totals = [arrangement.scores["total"] for arrangement in found]
    assert totals == sorted(totals, reverse=True)
    expected = {"total"} | ({"rollout"} if name == "diffusion" else set())
    if parts.ranked:
        judge = "outcome" if parts.outcome else "structure"
        expected |= {judge, "collision"} if parts.discriminators else set()
        expected |= ({"bounds"} if parts.bounds else set()) | ({"checks", "support"} if parts.checks else set())
    assert set(found[0].scores) == expected
    assert (totals == [1.0] * len(found)) == (not parts.ranked)
    again = planner.propose(scene, GOAL, count=6, generator=generator())
    other = planner.propose(scene, GOAL, count=6, generator=generator(1))
    for a, b in zip(found, again):
        np.testing.assert_array_equal(a.goal_from_initial, b.goal_from_initial)
    assert not np.allclose(found[0].goal_from_initial, other[0].goal_from_initial)


def test_names_say_what_planners_are_made_of(weights):
    assert isinstance(load_planner("geometric", weights), GeometricPlanner)
    for name, kind in (("cvae", CVAEPlanner), ("structformer", StructFormerPlanner)):
        plain, unranked, searching = (load_planner(name + end, weights) for end in ("", "-unranked", "+cem"))
        assert isinstance(plain, kind) and plain.post_process.ranker and not plain.search
        assert not unranked.post_process.ranker and not unranked.search
        assert searching.post_process.ranker and searching.search
    guided = load_planner("diffusion-tokens+guidance8", weights)
    assert guided.guidance == 8.0 and guided.guide and not guided.post_process.ranker and not guided.sentence
    unranked = load_planner("diffusion-unranked", weights)
    assert unranked.sentence and not unranked.post_process.ranker and not unranked.guidance


def test_each_shape_has_its_network_and_an_open_one_asks_those_that_fit(weights, scene):
    planner = load_planner("structformer-unranked", weights)
    asked = []
    for shape, model in planner.models.items():
        assert model.config.shape == shape
        model.sample = partial(lambda shape, sample, *given: asked.append(shape) or sample(*given), shape, model.sample)

    def count(spec, number):
        asked.clear()
        return len(planner.propose(scene, StructureGoal(spec), count=number, generator=generator()))

    assert count(StructureSpec("tower"), 3) == 3 and asked == ["tower"]
    assert count(StructureSpec(), 6) == 6 and asked == list(FIRST_SHAPES)
    assert count(StructureSpec(size="large"), 5) == 5 and asked == ["circle", "line"]
    assert count(StructureSpec(), 2) == 2 and asked == ["circle", "line"]


def test_more_objects_than_the_network_knows_are_an_error(scene):
    planner = CVAEPlanner(PoseCVAE(CVAEConfig(**SIZES, max_objects=3)))
    with pytest.raises(ValueError, match="4 objects are more than this model can place; legal: 1 to 3"):
        planner.propose(scene, GOAL, count=2, generator=generator())


@pytest.mark.parametrize("name", ["cvae+cem", "structformer"])
def test_networks_that_are_missing_are_said_to_be_made_how(name, tmp_path):
    network = {"cvae+cem": "cvae", "structformer": "structformer_circle"}[name]
    with pytest.raises(CheckpointError) as error:
        load_planner(name, tmp_path)
    message = str(error.value)
    assert f"{tmp_path} lacks {network}, " in message and repr(name) in message
    assert f"`structagent train {network} --data SCENES --out {tmp_path / network}`" in message
    assert "structure, collision, which" in message  # who judges is missing, too


@pytest.mark.parametrize("name", ["cvae-paper", "structformer-unranked"])
def test_the_shipped_baselines_propose(name, scene):
    arrangements = load_planner(name).propose(scene, GOAL, count=3, generator=generator())
    assert len(arrangements) == 3
    assert all(np.isfinite(arrangement.goal_from_initial).all() for arrangement in arrangements)


def test_a_network_in_the_place_of_another_is_refused(weights, tmp_path):
    for shape in FIRST_SHAPES:
        (tmp_path / structformer_name(shape)).symlink_to(weights / structformer_name("line"))
    with pytest.raises(CheckpointError, match="_circle is the network for a line; expected the one for a circle"):
        load_planner("structformer-unranked", tmp_path)
