"""`structagent train` of a network from end to end, small."""

import json

import numpy as np
import pytest
import torch

from agent.cli.app import command_line
from agent.training.sentence_embeddings import write_language
from structdiffusion.data import demonstrations
from structdiffusion.models.diffusion import PoseDiffusion
from structdiffusion.objects.procedural import procedural_objects
from structdiffusion.planners.factory import WEIGHTS
from structdiffusion.word_tokens import FIRST_VOCABULARY, VOCABULARY


class Numbers:
    """An encoder without a network."""

    def encode(self, texts):
        return np.random.default_rng(0).normal(size=(len(texts), 384)).astype(np.float32)


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    """A few crowded scenes of all flat shapes, which are quick to draw, and their sentences."""
    folder = tmp_path_factory.mktemp("data")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(demonstrations, "SHARD_SCENES", 40)
        patch.setattr(demonstrations, "PROVEN", 0)
        list(demonstrations.generate(procedural_objects(51, seed=7), folder, 0, crowded=40, seed=3))
    write_language(folder, Numbers())
    return folder


def test_training_teaches_the_shipped_network_more_shapes(data, tmp_path):
    """The network starts from the shipped weights, knows the words of the data, and hardly differs after two steps."""
    line = ["train", "diffusion", "--data", str(data), "--steps", "2", "--batch", "3", "--device", "cpu"]
    taught = tmp_path / "taught"
    assert command_line([*line, "--start", str(WEIGHTS / "diffusion"), "--out", str(taught)]) == 0
    shipped, found = PoseDiffusion.from_pretrained(WEIGHTS / "diffusion"), PoseDiffusion.from_pretrained(taught)
    assert FIRST_VOCABULARY < found.config.vocabulary <= VOCABULARY
    known = min(shipped.config.vocabulary, found.config.vocabulary)
    torch.testing.assert_close(found.word.weight[:known], shipped.word.weight[:known], atol=0.01, rtol=0)
    torch.testing.assert_close(found.head[-1].weight, shipped.head[-1].weight, atol=0.01, rtol=0)
    record = json.loads((taught / "training.json").read_text())
    assert record["sessions"][0]["start"]["model.safetensors"]["sha256"]


def test_a_start_that_is_no_checkpoint_is_named(data, tmp_path, capsys):
    line = ["train", "diffusion", "--data", str(data), "--out", str(tmp_path / "out"), "--start", str(tmp_path)]
    assert command_line(line) == 6
    assert f"checkpoint {tmp_path} has no config.json" in capsys.readouterr().err
