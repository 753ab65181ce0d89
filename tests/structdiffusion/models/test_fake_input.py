"""Every network can be tried out without data."""

import pytest
import torch

from structdiffusion.models.collision import CollisionDiscriminator
from structdiffusion.models.cvae import PoseCVAE
from structdiffusion.models.diffusion import PoseDiffusion
from structdiffusion.models.outcome import OutcomeDiscriminator
from structdiffusion.models.strokes.model import StrokeNetwork
from structdiffusion.models.structformer import StructFormer
from structdiffusion.models.structure import StructureDiscriminator
from structdiffusion.word_tokens import VOCABULARY

JUDGES = (StructureDiscriminator, CollisionDiscriminator, OutcomeDiscriminator)
NETWORKS = (PoseDiffusion, PoseCVAE, StructFormer, *JUDGES, StrokeNetwork)


def generator(seed: int = 0) -> torch.Generator:
    return torch.Generator().manual_seed(seed)


@pytest.mark.parametrize("kind", NETWORKS)
def test_a_fake_input_is_answered_in_the_documented_shape(kind):
    model = kind().eval()
    given = model.fake_input(3, 5, generator())
    answer = model.try_out(given, generator(1))
    expected = (3,) if kind in JUDGES else (3, 5, 5) if kind is StrokeNetwork else (3, 6, 9)
    assert model.answer_shape(given) == tuple(answer.shape) == expected
    assert answer.isfinite().all() and not answer.requires_grad
    assert torch.equal(answer, model.try_out(given, generator(1)))
    others = model.fake_input(3, 5, generator(2))
    assert not torch.equal(answer, model.try_out(others, generator(1)))


def test_fake_scenes_are_as_documented():
    given = PoseDiffusion.fake_input(4, 5, generator())
    assert given["clouds"].shape == (4, 5, 256, 3) and given["clouds"].dtype == torch.float32
    torch.testing.assert_close(given["clouds"].mean(dim=(0, 1, 2)), torch.tensor((0.45, 0.0, 0.05)), atol=0.01, rtol=0)
    assert given["present"].tolist() == [[True] * 5] + [[True] * 4 + [False]] * 3
    assert given["words"].shape == (4, 5) and given["words"].min() >= 0 and given["words"].max() < VOCABULARY
