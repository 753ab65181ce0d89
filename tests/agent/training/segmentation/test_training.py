"""The loss prefers what is right, and training writes a network that numpy runs, and resumes."""

import json

import numpy as np
import pytest
import torch

from agent.cli.app import command_line
from agent.segmentation_network import WEIGHTS
from agent.segmentation_network.features import CHANNELS
from agent.segmentation_network.network import CLASSES, OUTPUTS, VOTE_UNIT, SegmentationNetwork
from agent.training.segmentation import pool
from agent.training.segmentation.batches import Example, draw_batch
from agent.training.segmentation.loss import lovasz_hinge, segmentation_loss
from agent.training.segmentation.network import SegmentationConfig
from agent.training.segmentation.network import SegmentationNetwork as TrainedNetwork
from agent.training.segmentation.pool import Pool, fill
from structdiffusion.models.checkpoint import CheckpointError


@pytest.fixture(scope="module")
def small_shards():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pool, "PER_SHARD", 2)
        yield


@pytest.fixture(scope="module")
def views(small_shards, tmp_path_factory):
    """A folder of four views."""
    folder = tmp_path_factory.mktemp("run") / "views"
    folder.mkdir()
    fill(folder, 0, 2, 1, seed=3)
    return folder


@pytest.fixture
def example():
    """Two flat objects side by side on a table."""
    x, y = np.meshgrid(np.linspace(0.2, -0.2, 24), np.linspace(0.2, -0.2, 32), indexing="ij")
    level = np.stack((x, y, np.zeros_like(x)), axis=-1).astype(np.float32)
    truth = np.ones((24, 32), dtype=np.uint8)
    truth[4:16, 4:14], truth[4:16, 14:24] = 2, 3
    known = np.ones(truth.shape, dtype=bool)
    known[:2] = False
    return Example(np.zeros((1, 24, 32), dtype=np.float32), level, known, np.where(known, truth, 0))


def outputs_of(example, centres):
    """What a perfect network says of an example, if the votes of objects 2 and 3 are for these centres."""
    out = torch.zeros(1, OUTPUTS, 24, 32)
    classes = torch.from_numpy(np.minimum(example.truth, 2)).long()
    out[0, :CLASSES] = 12.0 * torch.nn.functional.one_hot(classes, CLASSES).permute(2, 0, 1)
    for number, centre in zip((2, 3), centres, strict=True):
        own = example.truth == number
        off = (np.array(centre) - example.level[own]) / VOTE_UNIT
        out[0, CLASSES : CLASSES + 3, own] = torch.from_numpy(off.T).float()
    out[0, CLASSES + 4] = torch.where(torch.from_numpy(example.truth > 1), 6.0, -6.0)
    return out


def true_centres(example):
    return [example.level[example.truth == number].mean(axis=0) for number in (2, 3)]


def test_the_loss_of_a_right_answer_is_almost_nothing_and_of_one_object_for_two_is_not(example):
    first, second = true_centres(example)
    generator = torch.Generator().manual_seed(0)
    right = segmentation_loss(outputs_of(example, (first, second)), [example], generator)
    middle = (first + second) / 2
    merged = segmentation_loss(outputs_of(example, (middle, middle)), [example], generator)
    assert float(right["loss"]) < 0.1
    assert float(merged["overlap"]) > 0.5 > 20 * float(right["overlap"])
    wrong_class = outputs_of(example, (first, second))
    wrong_class[:, :CLASSES] = wrong_class[:, :CLASSES].flip(1)
    assert float(segmentation_loss(wrong_class, [example], generator)["classes"]) > 1.0


def test_a_view_without_objects_has_a_loss(example):
    bare = Example(example.maps, example.level, example.known, np.minimum(example.truth, 1))
    out = torch.zeros(1, OUTPUTS, 24, 32, requires_grad=True)
    loss = segmentation_loss(out, [bare], torch.Generator().manual_seed(0))["loss"]
    loss.backward()
    assert torch.isfinite(loss) and torch.isfinite(out.grad).all()


def test_the_hinge_is_zero_where_all_are_right_by_a_margin_and_grows_with_what_is_wrong():
    labels = torch.tensor([[1, 1, 0, 0]], dtype=torch.bool)
    right = torch.tensor([[2.0, 2.0, -2.0, -2.0]])
    one_wrong, both_wrong = right.clone(), right.clone()
    one_wrong[0, 0] = -1.0
    both_wrong[0, :2] = -1.0
    losses = [float(lovasz_hinge(logits, labels)) for logits in (right, one_wrong, both_wrong)]
    # One of two pixels is missing: the intersection over union is 1/2; the hinge of -1 counts twice.
    assert losses == pytest.approx([0.0, 1.0, 2.0])


def test_shards_are_drawn_once_and_a_pool_grows(views, small_shards):
    before = {path.name: path.stat().st_mtime_ns for path in views.iterdir()}
    fill(views, 0, 2, 1, seed=3)
    assert {path.name: path.stat().st_mtime_ns for path in views.iterdir()} == before
    found = Pool(views)
    assert found.count == 4 and found[3].depth.max() > 0


def test_training_writes_a_network_that_numpy_runs_and_resumes(views, capsys):
    line = ["train", "segmentation", "--out", str(views.parent), "--batch", "2", "--views", "1", "--device", "cpu"]
    assert command_line([*line, "--steps", "1"]) == 0
    assert command_line([*line, "--steps", "2"]) == 0
    assert "step 2/2" in capsys.readouterr().out
    record = json.loads((views.parent / "training.json").read_text())
    assert [session["last_step"] for session in record["sessions"]] == [1, 2]
    seen = SegmentationNetwork.from_pretrained(views.parent)(np.zeros((12, 32, 32), dtype=np.float32))
    assert np.isfinite(seen.votes).all()


def test_a_network_to_start_from_says_the_same_while_it_is_trained(views):
    rng = np.random.default_rng(0)
    maps = np.stack([one.maps for one in draw_batch(Pool(views), 6, rng)])
    network = TrainedNetwork(SegmentationConfig())
    network.start_from(WEIGHTS, torch.from_numpy(maps))
    expected = np.stack([SegmentationNetwork.from_pretrained(WEIGHTS).outputs(one) for one in maps])
    for mode in (network.eval(), network.train()):
        with torch.no_grad():
            np.testing.assert_allclose(mode(torch.from_numpy(maps)).numpy(), expected, atol=0.02)


def test_a_folder_without_a_network_is_named(tmp_path):
    with pytest.raises(CheckpointError, match=r"nothing' holds no segmentation network to start from"):
        TrainedNetwork(SegmentationConfig()).start_from(tmp_path / "nothing", torch.zeros(1, CHANNELS, 8, 8))
