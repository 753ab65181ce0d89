import shutil

import numpy as np
import pytest
import torch

from grounding.spec import FIRST_SHAPES, LEGAL_VALUES, SLOTS, StructureSpec
from structdiffusion.data.batches import DemonstrationBatches
from structdiffusion.data.demonstrations import DemonstrationSet, keep_shard
from structdiffusion.data.shards import draw_shard
from structdiffusion.footprints import turned
from structdiffusion.geometry import pose_from_xyz_yaw, transform_points
from structdiffusion.models.structure.loss import at_goal
from structdiffusion.observation import Table
from structdiffusion.protocol.semantic import check_structure
from structdiffusion.rotations import yaw_matrices
from structdiffusion.structures import STRUCTURES
from structdiffusion.structures.bodies import PlacedBody
from structdiffusion.tableware import BASES, CUTLERY, DRINKWARE
from structdiffusion.word_tokens import FIRST_VOCABULARY, VOCABULARY, WORDS
from tests.structdiffusion.structures.handmade import carriers


@pytest.fixture(scope="module")
def data(data_folder):
    return DemonstrationBatches(data_folder)


def generator(seed: int = 0) -> torch.Generator:
    return torch.Generator().manual_seed(seed)


def test_moving_a_cloud_by_its_state_puts_it_on_the_true_goal(data, data_folder, library):
    """Every point of the moved cloud lies on the true model's surface at the true goal, up to depth noise."""
    stored = DemonstrationSet.load(data_folder)
    batch = data.draw(12, generator())
    goal = at_goal(batch).numpy()
    checked = 0
    for b in range(12):
        frame = batch.world_from_structure[b]
        row = int(np.abs(stored.frame[:, :2] - frame[:2, 3].numpy()).max(axis=1).argmin())
        for n in range(7):
            if not batch.present[b, n]:
                continue
            assert stored.objects[row, n] == batch.object_ids[b, n]
            x, y, z, turn = stored.goal[row, n].astype(float)
            world_from_goal = pose_from_xyz_yaw(x, y, z, stored.initial[row, n, 2] + turn)
            surface = transform_points(world_from_goal, library[batch.object_ids[b, n]].surface_points)
            distance = np.linalg.norm(goal[b, n][:, None] - surface[None], axis=-1).min(axis=1)
            assert np.quantile(distance, 0.95) < 0.008
            checked += 1
    assert checked > 30


def test_stored_scenes_are_what_their_words_say(data_folder, library):
    """The checks of the evaluation protocol hold for the stored goals,
    and all of the words of a demonstration belong to it.
    """
    stored, table = DemonstrationSet.load(data_folder), Table()
    values = {number: pair for pair, number in WORDS.items()}
    for row in range(len(stored)):
        spec = StructureSpec(**dict(values[int(word)] for word in stored.words[row] if word))
        bodies = []
        for n in range(int((stored.objects[row, :7] >= 0).sum())):
            model = library[stored.objects[row, n]]
            x, y, z, turn = stored.goal[row, n].astype(float)
            yaw = stored.initial[row, n, 2] + turn
            footprint = turned(model.footprint, yaw) + (x, y)
            below = [one.footprint for one in bodies], [one.z_bottom for one in bodies], [one.z_top for one in bodies]
            outlines, bottoms, tops = ([*column, own] for column, own in zip(below, (footprint, z, z + model.height)))
            carrier = (n - 1,) if spec.shape == "tower" and n else carriers(n, outlines, bottoms, tops)
            bodies.append(
                PlacedBody(model.name, model.category, footprint, np.array([x, y]), z, z + model.height, yaw, carrier)
            )
        failed = [check for check in check_structure(bodies, spec, table) if not check.passed]
        assert not failed, (row, spec, failed)


def test_the_language_says_nothing_that_is_not_so_and_keeps_the_rings_opening(data):
    words, _ = data._speak(data.words.repeat(40, 1), 0.0, generator())
    true = data.words.repeat(40, 1)
    assert ((words == true) | (words == 0)).all()
    assert (words.sum(dim=1) > 0).all()
    opened = (true[:, 0] == WORDS["shape", "circle"]) & (true[:, 4] > 0)
    assert opened.sum() > 40
    assert (words[opened, 4] == true[opened, 4]).all()
    # Of the other rotations some are left out, and so is every other slot now and then.
    others = ~opened
    for slot in range(5):
        given = true[others, slot] > 0
        share = (words[others, slot][given] > 0).float().mean()
        assert (0.9 if slot == 0 else 0.6) < share < (0.99 if slot == 0 else 0.9)


def test_a_sentence_says_what_the_words_say(data):
    batch = data.draw(64, generator(1), sentences=0.5)
    spoken = batch.sentence.abs().sum(dim=1) > 0
    assert 15 < spoken.sum() < 50
    # In this folder a sentence's "embedding" is its word ids.
    assert torch.equal(batch.sentence[spoken, :5].long(), batch.words[spoken])
    assert not (data.draw(8, generator(), sentences=0.0).sentence != 0).any()
    assert (data.draw(8, generator(), sentences=1.0).sentence.abs().sum(dim=1) > 0).all()


def test_batches_follow_from_the_generator(data):
    first, again, other = (data.draw(4, generator(seed)) for seed in (5, 5, 6))
    for name in first.__dataclass_fields__:
        assert torch.equal(getattr(first, name), getattr(again, name)), name
    assert not torch.equal(first.clouds, other.clouds)
    assert first.clouds.shape == (4, 7, 256, 3) and first.present.shape == (4, 7)
    turn = first.turn
    torch.testing.assert_close(turn @ turn.transpose(-1, -2), torch.eye(3).expand_as(turn), atol=1e-5, rtol=0)


def test_nouns_are_those_of_the_objects_and_sometimes_forgotten(data, library):
    nouns = BASES + CUTLERY + DRINKWARE
    ids = torch.arange(len(library)).repeat(200, 1)
    found = data.noun_ids(ids, nouns, generator())
    true = torch.tensor([nouns.index(m.category) + 1 if m.category in nouns else 0 for m in library]).expand_as(found)
    assert ((found == true) | (found == 0)).all()
    remembered = (found[true > 0] > 0).float().mean()
    assert 0.7 < remembered < 0.9
    assert ((found == 0).all(dim=1)).float().mean() == pytest.approx(0.15, abs=0.08)


def test_yaw_matrices_turn_about_the_vertical():
    matrix = yaw_matrices(torch.tensor([[0.3, -2.0]], dtype=torch.float64)).numpy()
    for found, yaw in zip(matrix[0], (0.3, -2.0)):
        np.testing.assert_allclose(found, pose_from_xyz_yaw(0, 0, 0, yaw)[:3, :3], atol=1e-12)


@pytest.mark.parametrize("name", ["library.npz", "language.npz", "shard_*.npz"])
def test_a_missing_file_is_named_with_the_command_that_makes_it(data_folder, tmp_path, name):
    folder = tmp_path / "copy"
    shutil.copytree(data_folder, folder)
    for path in folder.glob(name):
        path.unlink()
    with pytest.raises(FileNotFoundError) as caught:
        DemonstrationBatches(folder)
    assert f"{folder} has no {name}; make it with `structagent generate --out {folder}`" in str(caught.value)


def test_every_value_of_every_slot_is_a_word():
    assert set(WORDS) == {(slot, value) for slot in SLOTS for value in LEGAL_VALUES[slot]}
    assert [WORDS["shape", shape] for shape in FIRST_SHAPES] == [1, 2, 3, 4]


def test_what_a_network_does_not_know_can_be_left_out(data_folder):
    whole, known = DemonstrationBatches(data_folder), DemonstrationBatches(data_folder, known=FIRST_VOCABULARY)
    assert FIRST_VOCABULARY < whole.vocabulary <= VOCABULARY and known.vocabulary == FIRST_VOCABULARY
    assert 0 < len(known) == int((whole.words[:, 0] <= len(FIRST_SHAPES)).sum()) < len(whole)
    with pytest.raises(FileNotFoundError, match=r"none of the \d+ scenes in .* is known to the network; make some"):
        DemonstrationBatches(data_folder, known=1)


@pytest.mark.parametrize("crowded", [False, True])
def test_scenes_have_room_for_the_objects_of_every_shape(library, crowded):
    """Shapes that usually have more objects than a row of the data has places for get fewer of them."""
    shard = draw_shard(library, 2, 0, 40, crowded=crowded)
    members = (shard.columns["objects"][:, :-2] >= 0).sum(axis=1)
    assert members.max() <= shard.columns["goal"].shape[1] == (10 if crowded else 7)
    share = "crowded_share" if crowded else "demonstration_share"
    drawn = {shape for shape, structure in STRUCTURES.items() if getattr(structure, share)}
    assert {"grid", "cross"} <= drawn
    shapes = {shape for shape in drawn if WORDS["shape", shape] in shard.columns["words"][:, 0]}
    assert len(shapes) > 6 and "grid" in shapes


def test_a_batch_is_as_wide_as_its_scenes(data_folder, library, tmp_path):
    """Crowded scenes beside others: a batch has scenes of one width, with the objects and the goals of its rows."""
    for path in data_folder.iterdir():
        shutil.copy(path, tmp_path)
    keep_shard(tmp_path, draw_shard(library, 0, 0, 8, crowded=True))
    mixed, usual = DemonstrationBatches(tmp_path), DemonstrationBatches(data_folder)
    assert len(mixed) == len(usual) + 8 and mixed.places == 10 and usual.places == 7
    widths = [mixed.draw(3, generator(seed)).present.shape[1] for seed in range(40)]
    assert set(widths) == {7, 10} and widths.count(10) < widths.count(7)
    seed = widths.index(10)
    batch = mixed.draw(3, generator(seed))
    assert batch.clouds.shape[:2] == batch.position.shape[:2] == batch.turn.shape[:2] == (3, 10)
    assert batch.present.sum(dim=1).max() > 7
    for b, frame in enumerate(batch.world_from_structure):
        row = int((mixed.frame[:, :2] - frame[:2, 3]).norm(dim=1).argmin())
        there = batch.present[b]
        assert (batch.object_ids[b, there] == mixed.objects[row, :10][there]).all()
