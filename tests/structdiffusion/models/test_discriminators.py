from functools import partial

import pytest
import torch

from grounding.spec import LEGAL_VALUES, SLOTS, StructureSpec
from structdiffusion.data.batches import DemonstrationBatches
from structdiffusion.models.collision import CollisionDiscriminator
from structdiffusion.models.collision.loss import PairBatches, collision_loss
from structdiffusion.models.collision.model import CollisionConfig
from structdiffusion.models.structure import StructureDiscriminator
from structdiffusion.models.structure.loss import at_goal, other_words, perturbed, structure_loss
from structdiffusion.models.structure.model import StructureConfig
from structdiffusion.training.loop import TrainingOptions, train
from structdiffusion.word_tokens import WORDS, word_ids


@pytest.fixture
def generator():
    return torch.Generator().manual_seed(0)


@pytest.fixture(scope="module")
def structure():
    torch.manual_seed(0)
    return StructureDiscriminator(StructureConfig(width=24, layers=1, points=96)).eval()


def scene(generator, batch=2, count=4):
    clouds = 0.03 * torch.randn(batch, count, 128, 3, generator=generator)
    clouds += torch.randn(batch, count, 1, 3, generator=generator) * 0.1 + torch.tensor([0.45, 0.0, 0.05])
    present = torch.ones(batch, count, dtype=torch.bool)
    nouns = torch.randint(0, 8, (batch, count), generator=generator)
    words = torch.tensor([word_ids(StructureSpec("circle", "small", "left", "top", "north"))]).expand(batch, -1)
    return clouds, present, nouns, words


@torch.no_grad()
def test_the_structure_score_does_not_depend_on_where_it_stands(structure, generator):
    clouds, present, nouns, words = scene(generator)
    score = structure(clouds, present, nouns, words)
    elsewhere = clouds + torch.tensor([0.13, -0.2, 0.0])
    torch.testing.assert_close(structure(elsewhere, present, nouns, words), score, atol=1e-5, rtol=0)
    raised = clouds + torch.tensor([0.0, 0.0, 0.1])  # but a structure in the air is another matter
    assert (structure(raised, present, nouns, words) - score).abs().min() > 2e-4
    placed = words.clone()
    placed[:, 2:4] = torch.tensor([WORDS["x_position", "right"], WORDS["y_position", "bottom"]])
    torch.testing.assert_close(structure(clouds, present, nouns, placed), score)
    for slot, value in (("shape", "line"), ("size", "large"), ("rotation", "south")):
        changed = words.clone()
        changed[:, SLOTS.index(slot)] = WORDS[slot, value]
        assert (structure(clouds, present, nouns, changed) - score).abs().min() > 1e-4, slot


@torch.no_grad()
def test_absent_objects_have_no_say_in_the_structure(structure, generator):
    clouds, present, nouns, words = scene(generator)
    present[:, 3:] = False
    score = structure(clouds, present, nouns, words)
    clouds[:, 3:], nouns[:, 3:] = 7.0, 1
    torch.testing.assert_close(structure(clouds, present, nouns, words), score)
    torch.testing.assert_close(structure(clouds[:, :3], present[:, :3], nouns[:, :3], words), score)


def test_negatives_differ_visibly_and_only_where_objects_are(generator):
    clouds, present, _, _ = scene(generator, 200, 5)
    present[:, 4] = torch.rand(200, generator=generator) < 0.5
    wrong = perturbed(clouds, present, generator)
    shift = (wrong.mean(dim=2) - clouds.mean(dim=2)).norm(dim=-1)  # (B, N)
    moved = shift > 1e-6
    stretched = (moved & present).sum(1) == present.sum(1)
    assert moved[present].float().mean() < 0.95  # some objects stay
    assert ((moved & present).sum(dim=1) >= 1).all()
    assert not (moved & ~present)[~stretched].any()
    largest = (shift * present).amax(dim=1)
    assert (largest[~stretched] >= 0.0119).all()
    # Each object is moved as a rigid thing: distances within it stay.
    before, after = (torch.cdist(part[:20, 0, :30], part[:20, 0, :30]) for part in (clouds, wrong))
    torch.testing.assert_close(before, after, atol=1e-3, rtol=0)


def test_other_words_change_one_local_slot_to_a_legal_value(generator):
    specs = [
        StructureSpec("circle", "small", "left", "top", "north"),
        StructureSpec(x_position="left"),
        StructureSpec(rotation="west"),
        StructureSpec("tower", y_position="top"),
    ]
    words = torch.tensor([word_ids(spec) for spec in specs] * 30)
    changed = other_words(words, generator)
    legal = {SLOTS.index(slot): {WORDS[slot, value] for value in LEGAL_VALUES[slot]} for slot in SLOTS}
    seen = set()
    for row, (old, new) in enumerate(zip(words.tolist(), changed.tolist())):
        slots = [slot for slot in range(5) if old[slot] != new[slot]]
        if row % 4 == 1:
            assert slots == []  # nothing local was said
            continue
        assert len(slots) == 1 and slots[0] in (0, 1, 4) and old[slots[0]] > 0
        assert new[slots[0]] in legal[slots[0]]
        seen.add((slots[0], new[slots[0]]))
    assert {slot for slot, _ in seen} == {0, 1, 4} and len(seen) >= 8


def test_the_structure_discriminator_learns_to_tell_goals_from_negatives(data_folder, tmp_path):
    torch.manual_seed(0)
    model = StructureDiscriminator(StructureConfig(width=24, layers=1, points=96))
    loss = partial(structure_loss, model, DemonstrationBatches(data_folder), scenes=12)
    options = TrainingOptions(steps=60, learning_rate=3e-3, warmup=5, log_every=15)
    progress = list(train(model, loss, tmp_path, options, torch.device("cpu")))
    assert progress[-1].losses["loss"] < progress[0].losses["loss"]
    assert 0 <= progress[-1].losses["accuracy"] <= 1


@torch.no_grad()
def test_collision_is_symmetric_and_the_same_everywhere(generator):
    torch.manual_seed(0)
    model = CollisionDiscriminator(CollisionConfig(width=16, layers=1, points=48)).eval()
    a, b = 0.03 * torch.randn(2, 5, 64, 3, generator=generator)
    logits = model(a, b)
    assert logits.shape == (5,)
    torch.testing.assert_close(model(b, a), logits)
    away = torch.tensor([0.5, -0.3, 0.2])
    torch.testing.assert_close(model(a + away, b + away), logits, atol=1e-5, rtol=0)
    assert (model(a + away, b) - logits).abs().min() > 2e-4


def boxes_in_pairs() -> PairBatches:
    """One cube, beside itself: the distance is known, and only it varies."""
    generator = torch.Generator().manual_seed(0)
    axis = torch.randint(3, (1, 1024), generator=generator)
    side = torch.randint(2, (1, 1024), generator=generator) * 2.0 - 1
    points = torch.rand(1, 1024, 3, generator=generator) * 2 - 1
    points.scatter_(2, axis[..., None], side[..., None])
    normals = torch.zeros(1, 1024, 3).scatter_(2, axis[..., None], side[..., None])
    distance = torch.rand(400, generator=generator) * 0.06 - 0.03
    poses = torch.zeros(400, 2, 4)
    poses[:, 1, 0] = 0.06 + distance
    points = 0.03 * points + torch.tensor([0.0, 0.0, 0.03])
    return PairBatches(points, normals, torch.zeros(400, 2, dtype=torch.long), poses, distance)


def test_the_collision_discriminator_learns_cubes(tmp_path):
    torch.manual_seed(0)
    model, pairs = CollisionDiscriminator(CollisionConfig(width=16, layers=1, points=32)), boxes_in_pairs()
    loss = partial(collision_loss, model, pairs, size=32)
    options = TrainingOptions(steps=120, learning_rate=3e-3, warmup=5, log_every=20)
    progress = list(train(model, loss, tmp_path, options, torch.device("cpu")))
    assert progress[-1].losses["loss"] < 0.7 * progress[0].losses["loss"]
    assert progress[-1].losses["accuracy"] > 0.8


def test_goals_are_reached_by_turning_about_the_mean(data_folder, generator):
    batch = DemonstrationBatches(data_folder).draw(6, generator)
    goal = at_goal(batch)
    torch.testing.assert_close(goal.mean(dim=2)[batch.present], batch.position[batch.present], atol=1e-4, rtol=0)
    before, after = (torch.cdist(part[0, 0, :50], part[0, 0, :50]) for part in (batch.clouds, goal))
    torch.testing.assert_close(before, after, atol=1e-3, rtol=0)
