from dataclasses import replace

import pytest
import torch

from structdiffusion.data.batches import DemonstrationBatches
from structdiffusion.models.diffusion import PoseDiffusion
from structdiffusion.models.diffusion.loss import diffusion_loss
from structdiffusion.models.diffusion.model import DiffusionConfig
from structdiffusion.models.diffusion.scheduler import NoiseScheduler
from structdiffusion.rotations import rotation_from_6d, yaw_matrices

SMALL = DiffusionConfig(width=32, layers=2, heads=2, feed_forward=48, points=24, point_width=16)


@pytest.fixture(scope="module")
def model():
    torch.manual_seed(0)
    return PoseDiffusion(SMALL).eval()


@pytest.fixture
def generator():
    return torch.Generator().manual_seed(0)


def encoded(model, generator, batch=3, objects=5, **changes):
    given = {**model.fake_input(batch, objects, generator), **changes}
    return given, model.condition(given["clouds"], given["present"], given["nouns"], words=given["words"])


def test_states_decode_to_what_they_were_made_of(model, generator):
    frame = torch.eye(4).repeat(6, 1, 1)
    frame[:, :3, :3] = yaw_matrices(torch.linspace(-3, 3, 6))
    frame[:, :3, 3] = torch.randn(6, 3, generator=generator) * 0.2 + 0.4
    position = torch.randn(6, 4, 3, generator=generator) * 0.2
    turn = rotation_from_6d(torch.randn(6, 4, 6, generator=generator))
    state = model.encode_state(frame, position, turn)
    assert state.shape == (6, 5, 9)
    for found, true in zip(model.decode_state(state), (frame, position, turn)):
        torch.testing.assert_close(found, true, atol=1e-5, rtol=0)


def test_object_positions_are_told_in_the_structure_frame(model, generator):
    """The same structure elsewhere on the table, and turned, has the same object rows."""
    position, turn = torch.randn(1, 4, 3, generator=generator) * 0.1, torch.eye(3).expand(1, 4, 3, 3)
    here = torch.eye(4)[None]
    there = here.clone()
    there[:, :3, :3] = yaw_matrices(torch.tensor([0.8]))
    there[:, :3, 3] = torch.tensor([0.1, -0.2, 0.0])
    moved = torch.einsum("bij,bnj->bni", there[:, :3, :3], position) + there[:, None, :3, 3]
    a, b = model.encode_state(here, position, turn), model.encode_state(there, moved, turn)
    torch.testing.assert_close(a[:, 1:], b[:, 1:], atol=1e-5, rtol=0)
    assert (a[:, 0] - b[:, 0]).abs().max() > 0.1


def test_demonstrations_have_about_unit_variance(data_folder):
    """The scales of the config have to suit the data, or the noise schedule does not."""
    generator = torch.Generator().manual_seed(0)
    batch = DemonstrationBatches(data_folder).draw(200, generator)
    state = PoseDiffusion(SMALL).encode_state(batch.world_from_structure, batch.position, batch.turn)
    objects = state[:, 1:, :3][batch.present]
    for rows in (objects, state[:, 0, :2]):
        assert (rows.mean(0).abs() < 0.6).all()
        assert (rows.std(0) > 0.4).all() and (rows.std(0) < 2.0).all()


@torch.no_grad()
def test_absent_objects_have_no_say(model, generator):
    present = torch.ones(2, 5, dtype=torch.bool)
    present[:, 3:] = False
    given, condition = encoded(model, generator, 2, 5, present=present)
    state, steps = torch.randn(2, 6, 9, generator=generator), torch.tensor([3, 150])
    prediction = model(state, steps, condition)
    clouds = given["clouds"].clone()
    clouds[:, 3:] += 1.0
    _, other = encoded(model, generator, 2, 5, **{**given, "clouds": clouds})
    noisy = state.clone()
    noisy[:, 4:] = 9.0
    torch.testing.assert_close(model(noisy, steps, other)[:, :4], prediction[:, :4], atol=1e-5, rtol=0)
    # Nor do empty places: the scene without them is the same scene.
    short = replace(condition, objects=condition.objects[:, :3], present=condition.present[:, :3])
    torch.testing.assert_close(model(state[:, :4], steps, short), prediction[:, :4], atol=1e-5, rtol=0)


@torch.no_grad()
def test_encoding_is_by_object_and_places_are_what_tells_them_apart(model, generator):
    given, condition = encoded(model, generator, 2, 4, present=torch.ones(2, 4, dtype=torch.bool))
    order = torch.tensor([2, 0, 3, 1])
    permuted = {name: given[name][:, order] for name in ("clouds", "present", "nouns")}
    _, other = encoded(model, generator, 2, 4, **{**given, **permuted})
    torch.testing.assert_close(other.objects, condition.objects[:, order], atol=1e-5, rtol=0)
    state, steps = torch.randn(2, 5, 9, generator=generator), torch.tensor([10, 100])
    places = torch.cat((torch.zeros(1, dtype=torch.long), order + 1))
    prediction, moved = model(state, steps, condition), model(state[:, places], steps, other)
    assert (moved - prediction[:, places]).abs().max() > 1e-3  # object i takes place i
    saved = model.place.weight.clone()
    try:
        model.place.weight.zero_()
        without, moved = model(state, steps, condition), model(state[:, places], steps, other)
        torch.testing.assert_close(moved, without[:, places], atol=1e-5, rtol=0)
    finally:
        model.place.weight.copy_(saved)


@torch.no_grad()
def test_words_sentences_nouns_and_time_all_matter(model, generator):
    given, condition = encoded(model, generator, 2, 4)
    state, steps = torch.randn(2, 5, 9, generator=generator), torch.tensor([20, 20])
    base = model(state, steps, condition)
    words = given["words"].clone()
    words[:, 0] = 4
    nouns = torch.ones_like(given["nouns"])
    sentence = torch.nn.functional.normalize(torch.randn(2, 384, generator=generator), dim=1)
    observation = given["clouds"], given["present"]
    for changed in (
        model.condition(*observation, given["nouns"], words=words),
        model.condition(*observation, nouns, words=given["words"]),
        model.condition(*observation, given["nouns"], sentence=sentence),
        model.condition(*observation, given["nouns"]),
    ):
        assert (model(state, steps, changed) - base).abs().max() > 1e-4
    assert (model(state, steps + 50, condition) - base).abs().max() > 1e-4


@torch.no_grad()
def test_a_sentence_replaces_the_words_and_a_row_of_zeros_keeps_them(model, generator):
    given, words_only = encoded(model, generator, 2, 4)
    sentence = torch.zeros(2, 384)
    sentence[1] = torch.randn(384, generator=generator)
    observation = given["clouds"], given["present"], given["nouns"]
    mixed = model.condition(*observation, words=given["words"], sentence=sentence)
    alone = model.condition(*observation, sentence=sentence)
    assert mixed.spoken.tolist() == [False, True]
    torch.testing.assert_close(mixed.language[0], words_only.language[0])
    torch.testing.assert_close(mixed.language[1], alone.language[1])
    assert mixed.language_mask[1].tolist() == [True] + [False] * 4
    assert torch.equal(mixed.language_mask[0], given["words"][0] > 0)


@torch.no_grad()
def test_repeating_a_condition_repeats_each_scene(model, generator):
    _, condition = encoded(model, generator, 2, 4)
    state, steps = torch.randn(2, 5, 9, generator=generator), torch.tensor([20, 60])
    repeated = model(state.repeat_interleave(3, 0), steps.repeat_interleave(3), condition.repeat(3))
    torch.testing.assert_close(repeated, model(state, steps, condition).repeat_interleave(3, 0), atol=1e-5, rtol=0)


def test_known_nouns_have_their_own_id_and_others_share_zero(model):
    ids = model.noun_ids([*SMALL.nouns, "box", "object"])
    assert ids == [*range(1, len(SMALL.nouns) + 1), 0, 0]


@pytest.mark.parametrize("kind", ["epsilon", "v"])
def test_the_loss_is_that_of_a_guess_before_training_and_has_gradients_everywhere(data_folder, kind):
    torch.manual_seed(0)
    model = PoseDiffusion(replace(SMALL, prediction_type=kind))
    data = DemonstrationBatches(data_folder)
    losses = diffusion_loss(model, NoiseScheduler(200, kind), data, torch.Generator().manual_seed(0), 8, 4)
    assert losses["loss"].item() == pytest.approx((losses["position"] + 0.5 * losses["rotation"]).item(), rel=1e-5)
    assert 0.5 < losses["position"].item() < 4.0
    losses["loss"].backward()
    for name, parameter in model.named_parameters():
        assert parameter.grad is not None and torch.isfinite(parameter.grad).all(), name
        assert parameter.grad.abs().sum() > 0, name
