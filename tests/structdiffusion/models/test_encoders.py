import math

import pytest
import torch

from grounding.corpus.grammar import legal_specs
from grounding.spec import FIRST_SHAPES, SHAPES, StructureSpec
from structdiffusion.models.encoders import PointEncoder, TimeEmbedding, outline_features
from structdiffusion.word_tokens import VOCABULARY, word_ids


def test_word_ids_tell_every_spec_apart_and_no_slot_shares_one():
    later = [StructureSpec(shape) for shape in SHAPES if shape not in FIRST_SHAPES]
    rows = [tuple(word_ids(spec)) for spec in (*legal_specs(), *later)]
    assert len(set(rows)) == len(rows)
    slots = [{row[slot] for row in rows} - {0} for slot in range(5)]
    assert set.union(*slots) == set(range(1, VOCABULARY))
    assert sum(map(len, slots)) == VOCABULARY - 1
    assert word_ids(StructureSpec()) == [0] * 5


def test_outline_features_measure_a_box():
    corners = torch.tensor([[x, y, z] for x in (-0.1, 0.1) for y in (-0.02, 0.02) for z in (0.0, 0.06)])
    features = outline_features(corners + torch.tensor([0.4, 0.1, 0.0]))
    torch.testing.assert_close(features[:3], torch.tensor([0.4, 0.1, 0.03]))
    for k in range(16):
        angle = 2 * math.pi * k / 16
        reach = 0.1 * abs(math.cos(angle)) + 0.02 * abs(math.sin(angle))
        assert float(features[3 + k]) == pytest.approx(reach, abs=1e-6)
    torch.testing.assert_close(features[-2:], torch.tensor([0.03, 0.03]))


def test_the_point_encoder_ignores_the_order_of_the_points_but_not_the_points():
    generator = torch.Generator().manual_seed(0)
    encoder = PointEncoder(3, 16, 24).eval()
    cloud = torch.randn(2, 40, 3, generator=generator)
    shuffled = cloud[:, torch.randperm(40, generator=generator)]
    with torch.no_grad():
        code = encoder(cloud)
        torch.testing.assert_close(encoder(shuffled), code, atol=1e-5, rtol=1e-5)
        assert (encoder(cloud * 1.5) - code).abs().max() > 1e-3
    assert code.shape == (2, 24)


def test_time_embeddings_tell_neighbouring_steps_apart():
    with torch.no_grad():
        codes = TimeEmbedding(32)(torch.arange(200))
    distance = torch.cdist(codes, codes) + 1e9 * torch.eye(200)
    assert distance.min() > 1e-3
