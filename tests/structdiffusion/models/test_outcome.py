"""The outcome discriminator sees who is there and how close they come, and learns from judged samples."""

import numpy as np
import pytest
import torch

from structdiffusion.data.npz_files import save_arrays
from structdiffusion.models.outcome import OutcomeDiscriminator
from structdiffusion.models.outcome.loss import judged_scenes, outcome_loss
from structdiffusion.models.outcome.model import OutcomeConfig, gaps
from structdiffusion.word_tokens import WORDS

SMALL = OutcomeConfig(width=16, layers=1, heads=2)


@pytest.fixture
def generator():
    return torch.Generator().manual_seed(0)


@pytest.fixture(scope="module")
def network():
    torch.manual_seed(0)
    return OutcomeDiscriminator(SMALL).eval()


@torch.no_grad()
def test_absent_objects_have_no_say(network, generator):
    given = network.fake_input(3, 5, generator)
    score = network(**given)
    absent = ~given["present"]
    given["clouds"][absent], given["nouns"][absent] = 7.0, 1
    torch.testing.assert_close(network(**given), score)


@torch.no_grad()
def test_words_gaps_and_the_place_on_the_table_count(network, generator):
    given = network.fake_input(2, 3, generator)
    score = network(**given)
    closer = given["clouds"].clone()
    closer[:, 0] += 0.3
    for changed in ({"words": torch.full_like(given["words"], WORDS["size", "large"])}, {"clouds": closer},
                    {"clouds": given["clouds"] + torch.tensor((0.0, 0.2, 0.0))}):  # fmt: skip
        assert (network(**given | changed) - score).abs().min() > 1e-4


def test_gaps_are_those_of_the_nearest_points():
    clouds = torch.zeros(1, 2, 4, 3)
    clouds[0, 1] = torch.tensor((0.03, 0.0, 0.04))
    torch.testing.assert_close(gaps(clouds)[0, 0, 1], torch.tensor((0.05, 0.03)))
    torch.testing.assert_close(gaps(clouds)[0, 1, 0], torch.tensor((0.05, 0.03)))


def write_judged(folder, wide: float) -> None:
    """Two cubes side by side: those of which the gap is wide stand as asked."""
    rng = np.random.default_rng(0)
    surface = rng.uniform(-0.02, 0.02, (2, 1024, 3)).astype(np.float16)
    normals = np.tile(np.float16((0.0, 0.0, 1.0)), (2, 1024, 1))
    save_arrays(
        folder / "library.npz", {"points": surface, "normals": normals, "categories": np.array(["cup", "block"])}
    )
    apart = rng.uniform(0.0, 2 * wide, (4, 80)).astype(np.float32)
    objects, initial = np.full((4, 12), -1, np.int16), np.zeros((4, 12, 4), np.float32)
    objects[:, :2], initial[:, :2, :3] = (0, 1), ((0.4, -0.1, 0.02), (0.4, 0.1, 0.02))
    motions, orders = np.zeros((4, 80, 12, 4), np.float32), np.zeros((4, 80, 12), np.int8)
    motions[:, :, 1, 1], orders[:, :, 1] = apart - 0.2, 1
    save_arrays(folder / "judged_00000.npz", {
        "objects": objects, "initial": initial, "count": np.full(4, 2, np.int8), "motions": motions, "orders": orders,
        "words": np.zeros((4, 5), np.int8), "right": apart > wide,
    })  # fmt: skip


def test_it_learns_which_samples_are_right(tmp_path, generator):
    write_judged(tmp_path, wide=0.06)
    scenes = list(judged_scenes(tmp_path))
    assert len(scenes) == 4 and scenes[0].outlines.shape == (2, 80, 2, 21) and scenes[0].near.shape == (2, 80, 2, 2, 2)
    torch.manual_seed(1)
    network = OutcomeDiscriminator(SMALL)
    optimizer = torch.optim.Adam(network.parameters(), lr=5e-3)
    losses = []
    for _ in range(60):
        optimizer.zero_grad()
        losses.append(outcome_loss(network, scenes, generator, 4))
        losses[-1]["loss"].backward()
        optimizer.step()
    assert losses[0]["accuracy"] < 0.8 and float(losses[-1]["accuracy"]) > 0.9


def test_a_folder_without_judged_samples_names_the_command(tmp_path):
    with pytest.raises(FileNotFoundError, match="structagent generate --proposals"):
        list(judged_scenes(tmp_path))
