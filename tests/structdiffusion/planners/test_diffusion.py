import itertools
from dataclasses import replace

import numpy as np
import pytest
import torch

from grounding.spec import SHAPES, StructureSpec
from structdiffusion.completion.estimate import estimate, imagined_bodies
from structdiffusion.data.scene_sampling import draw_scene, full_spec
from structdiffusion.footprints import clear_gap
from structdiffusion.geometry import tilt_between
from structdiffusion.models.checkpoint import CheckpointError
from structdiffusion.models.collision import CollisionDiscriminator
from structdiffusion.models.collision.model import CollisionConfig
from structdiffusion.models.diffusion import PoseDiffusion
from structdiffusion.models.diffusion.model import DiffusionConfig
from structdiffusion.models.structure import StructureDiscriminator
from structdiffusion.models.structure.model import StructureConfig
from structdiffusion.observation import StructureGoal
from structdiffusion.planners.diffusion import DiffusionPlanner
from structdiffusion.planners.factory import load_planner
from structdiffusion.planners.geometric import GeometricPlanner
from structdiffusion.planners.samples import encode_scene, place_orders
from structdiffusion.postprocessing.ranking import Ranker
from structdiffusion.protocol.semantic import check_structure
from structdiffusion.simulation.world import TabletopWorld
from structdiffusion.structures import STRUCTURES
from structdiffusion.structures.structure import LayoutError

pytestmark = pytest.mark.usefixtures("one_cache")

SENTENCE = np.random.default_rng(0).standard_normal(384).astype(np.float32)


def generator(seed: int = 0) -> torch.Generator:
    return torch.Generator().manual_seed(seed)


def seen(library, spec, seed=0, **options):
    """A drawn scene as the simulated camera sees it."""
    rng = np.random.default_rng(seed)
    drawn = draw_scene(library, spec, rng, **options)
    with TabletopWorld(drawn.models, drawn.world_from_initial) as world:
        return world.observe(rng, distractors=range(drawn.count, len(drawn.models)))


@pytest.fixture(scope="module")
def circle(library):
    return seen(library, StructureSpec("circle"), count=4, distractors=1)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Checkpoints of small, untrained networks."""
    folder = tmp_path_factory.mktemp("weights")
    torch.manual_seed(0)
    small = DiffusionConfig(width=32, layers=1, heads=2, feed_forward=48, points=16, point_width=16)
    PoseDiffusion(small).save_pretrained(folder / "diffusion")
    StructureDiscriminator(StructureConfig(width=16, layers=1, points=64)).save_pretrained(folder / "structure")
    CollisionDiscriminator(CollisionConfig(width=16, layers=1, points=32)).save_pretrained(folder / "collision")
    return folder


@pytest.mark.parametrize("shape", SHAPES)
def test_the_geometric_planner_proposes_what_passes_the_checks(library, shape):
    """From clouds alone, its best proposal passes every check on the estimated outlines, upright, on the table."""
    for seed in range(2):
        spec = full_spec(shape, np.random.default_rng(seed))
        scene = seen(library, spec, seed)
        found = GeometricPlanner().propose(scene, StructureGoal(spec), count=6, generator=generator(seed))
        assert 1 <= len(found) <= 6
        totals = [arrangement.scores["total"] for arrangement in found]
        assert totals == sorted(totals, reverse=True)
        objects = [estimate(cloud) for cloud in scene.objects]
        best = found[0].goal_from_initial
        failed = [c for c in check_structure(imagined_bodies(objects, best), spec, scene.table) if not c.passed]
        assert not failed, (seed, spec, failed)
        assert found[0].scores["checks"] == 1.0
        assert all(tilt_between(motion, np.eye(4)) < 1e-6 for motion in best)
        outlines = [thing.outline_after(motion) for thing, motion in zip(objects, best)]
        if shape == "tower":
            assert np.diff(np.sort(best[:, 2, 3])).min() > 0.003
        elif not STRUCTURES[shape].stacks:
            assert min(clear_gap(a, b) for a, b in itertools.combinations(outlines, 2)) > 0.009
            assert (best[:, 2, 3] == 0).all()
        assert scene.table.overhang(np.concatenate(outlines)) == 0.0


def test_the_geometric_planner_says_why_it_cannot(circle):
    with pytest.raises(LayoutError, match="needs a plate or bowl"):
        cans = [cloud for cloud in circle.objects if cloud.category not in ("plate", "bowl")][:2]
        scene = circle.select([circle.objects.index(cloud) for cloud in cans]) if cans else circle
        GeometricPlanner().propose(scene, StructureGoal(StructureSpec("table setting")), count=2, generator=generator())


def test_arrangements_of_the_diffusion_planner(circle, folder):
    planner = load_planner("diffusion-tokens", folder)
    goal = StructureGoal(StructureSpec("circle", size="small"))
    found = planner.propose(circle, goal, count=6, generator=generator())
    assert len(found) == 6
    totals = [arrangement.scores["total"] for arrangement in found]
    assert totals == sorted(totals, reverse=True) and all(0 <= total <= 1 for total in totals)
    for arrangement in found:
        assert arrangement.goal_from_initial.shape == (len(circle.objects), 4, 4)
        assert arrangement.goal_from_initial.dtype == np.float64
        assert arrangement.world_from_structure.shape == (4, 4)
        for motion in arrangement.goal_from_initial:
            np.testing.assert_allclose(motion[:3, :3] @ motion[:3, :3].T, np.eye(3), atol=1e-9)
            np.testing.assert_allclose((motion[2, 2], *motion[3]), (1, 0, 0, 0, 1), atol=1e-12)
    again = planner.propose(circle, goal, count=6, generator=generator())
    other = planner.propose(circle, goal, count=6, generator=generator(1))
    for a, b in zip(found, again):
        np.testing.assert_array_equal(a.goal_from_initial, b.goal_from_initial)
        assert a.scores == b.scores
    assert not np.allclose(found[0].goal_from_initial, other[0].goal_from_initial)


def test_previews_lead_to_the_result(circle, folder):
    told = []
    planner = DiffusionPlanner(PoseDiffusion.from_pretrained(folder / "diffusion"), sentence=False, steps=7)
    goal = StructureGoal(StructureSpec("circle"))
    scene = encode_scene(circle, goal, planner.model, False, generator())
    sampled = planner.sample(scene, goal, 3, generator(), lambda *step: told.append(step))
    assert sampled.motions.shape == (3, len(circle.objects), 4, 4) and sampled.frames.shape == (3, 4, 4)
    assert [step[:2] for step in told] == [(k, 7) for k in range(1, 8)]
    np.testing.assert_array_equal(told[-1][2], sampled.motions)


def test_every_object_gets_the_motion_of_its_own_place(circle, folder):
    """With a denoiser that knows the answer by place, object and place have to match through every shuffle."""
    model = PoseDiffusion.from_pretrained(folder / "diffusion")
    planner = DiffusionPlanner(model, sentence=False, steps=5)
    count, things = 8, len(circle.objects)
    x, y = torch.linspace(0.3, 0.6, things), torch.linspace(-0.3, 0.3, things)
    places = torch.stack((x, y, torch.zeros(things)), dim=1)
    frame = torch.eye(4)[None]
    clean = model.encode_state(frame, places[None], torch.eye(3).expand(1, things, 3, 3)).expand(count, -1, -1)

    def oracle(state, timesteps, condition):  # v for the known clean sample
        signal, sigma = planner.scheduler._scales(timesteps, state)
        return (signal * state - clean) / sigma

    planner.model = type(
        "Oracle",
        (),
        {
            "__call__": staticmethod(oracle),
            "config": model.config,
            "condition": model.condition,
            "decode_state": model.decode_state,
            "noun_ids": model.noun_ids,
        },
    )()
    goal = StructureGoal(StructureSpec("circle"))
    scene = encode_scene(circle, goal, model, False, generator())
    sampled = planner.sample(scene, goal, count, generator())
    means = scene.clouds.mean(dim=1).numpy()
    orders = set()
    for row, asked in zip(sampled.motions, sampled.orders):
        ends = np.einsum("nij,nj->ni", row[:, :3, :3], means) + row[:, :3, 3]
        place = np.linalg.norm(ends[:, None] - places.numpy()[None], axis=-1)
        np.testing.assert_allclose(place.min(axis=1), 0.0, atol=2e-3)
        assert sorted(place.argmin(axis=1)) == list(range(things))  # each place is taken once
        assert (place.argmin(axis=1)[asked] == np.arange(things)).all()  # by the object that was to take it
        orders.add(tuple(place.argmin(axis=1)))
    assert len(orders) > 2  # in another order in each sample


def test_in_a_tower_the_broad_and_level_go_below(library):
    scene = seen(library, StructureSpec("tower"), seed=1, count=3, distractors=0)
    objects = [estimate(cloud) for cloud in scene.objects]
    order = place_orders(objects, StructureSpec("tower"), 16, generator())
    carries = torch.tensor([thing.stackable for thing in objects])
    assert (order.sort(dim=1).values == torch.arange(len(objects))).all()
    assert not ((~carries[order[:, :-1]]) & carries[order[:, 1:]]).any()
    boxes = [replace(thing, stackable=True) for thing in objects]
    usual, many = (place_orders(boxes, StructureSpec("tower"), count, generator()).tolist() for count in (16, 64))
    assert len(set(map(tuple, usual))) < len(set(map(tuple, many)))  # other orders, where the usual one may not stand
    assert (either := place_orders(objects, StructureSpec(), 16, generator())).shape == (16, 3)
    assert (either.sort(dim=1).values == torch.arange(len(objects))).all()


def test_without_a_ranker_everything_is_worth_a_try(circle, folder):
    planner = DiffusionPlanner(PoseDiffusion.from_pretrained(folder / "diffusion"), sentence=False)
    found = planner.propose(circle, StructureGoal(StructureSpec("circle")), count=2, generator=generator())
    assert [dict(arrangement.scores) for arrangement in found] == [{"total": 1.0}] * 2


def test_the_sentence_model_is_told_the_sentence(circle, folder):
    planner = load_planner("diffusion", folder)
    spec = StructureSpec("circle")
    with pytest.raises(ValueError, match="needs a sentence embedding; .*'diffusion-tokens'"):
        planner.propose(circle, StructureGoal(spec), count=2, generator=generator())
    first, other = (
        planner.propose(circle, StructureGoal(spec, "a ring", embedding), count=2, generator=generator())
        for embedding in (SENTENCE, -SENTENCE)
    )
    assert not np.allclose(first[0].goal_from_initial, other[0].goal_from_initial)


def test_more_objects_than_the_model_knows_are_an_error(circle, folder):
    small = PoseDiffusion(DiffusionConfig(width=32, layers=1, heads=2, feed_forward=32, max_objects=3))
    with pytest.raises(ValueError, match="4 objects are more than this model can place; legal: 1 to 3"):
        DiffusionPlanner(small, sentence=False).propose(
            circle, StructureGoal(StructureSpec("circle")), count=1, generator=generator()
        )


def test_loading_says_what_is_missing(folder, tmp_path):
    assert isinstance(load_planner("geometric"), GeometricPlanner)
    with pytest.raises(ValueError, match="'magic'; legal values: diffusion, diffusion-tokens, geometric"):
        load_planner("magic")
    with pytest.raises(CheckpointError, match=f"no folder {tmp_path / 'nowhere'}"):
        load_planner("diffusion", tmp_path / "nowhere")
    with pytest.raises(CheckpointError, match="lacks diffusion, structure, collision, which model"):
        load_planner("diffusion", tmp_path)
    planner = load_planner("diffusion-tokens", str(folder))
    assert not planner.sentence and isinstance(planner.post_process.ranker, Ranker)


@pytest.mark.parametrize("name", ["diffusion", "structure", "collision"])
@pytest.mark.parametrize("number", [1e38, -1e38])
def test_weights_that_overflow_name_the_network(name, number, circle, folder):
    """Each number in the file is finite, and what is computed with them is not."""
    planner = load_planner("diffusion-tokens", folder)
    ranker = planner.post_process.ranker
    network = {"diffusion": planner.model, "structure": ranker.structure, "collision": ranker.collision}[name]
    answering = "PoseDiffusion" if name == "diffusion" else name
    with torch.no_grad():
        for parameter in network.parameters():
            parameter.fill_(number)
    with pytest.raises(CheckpointError, match=f"'{answering}' gives numbers that are not finite or far too large"):
        planner.propose(circle, StructureGoal(StructureSpec("circle", size="small")), count=4, generator=generator())


def test_scales_that_leave_the_world_name_the_network(circle, folder):
    planner = load_planner("diffusion-tokens", folder)
    planner.model.config = replace(planner.model.config, frame_scale=(1e29, 1e29, 1e29))
    with pytest.raises(CheckpointError, match="'PoseDiffusion' gives numbers that are not finite or far too large"):
        planner.propose(circle, StructureGoal(StructureSpec("circle", size="small")), count=4, generator=generator())
