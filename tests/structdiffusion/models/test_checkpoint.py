import json
import subprocess
import sys
from dataclasses import replace

import pytest
import torch
from safetensors.torch import load_file, save_file

from structdiffusion.models.checkpoint import CheckpointError, grown, parameter_count
from structdiffusion.models.collision import CollisionDiscriminator
from structdiffusion.models.collision.model import CollisionConfig
from structdiffusion.models.diffusion import PoseDiffusion
from structdiffusion.models.diffusion.model import DiffusionConfig
from structdiffusion.models.structure import StructureDiscriminator
from structdiffusion.planners.factory import load_planner
from structdiffusion.word_tokens import FIRST_VOCABULARY, VOCABULARY
from tests.memory import forget_peak, peak_megabytes

SMALL = CollisionConfig(width=16, layers=1, points=32)


@pytest.fixture
def folder(tmp_path):
    torch.manual_seed(0)
    CollisionDiscriminator(SMALL).save_pretrained(tmp_path)
    return tmp_path


def edit(folder, **values):
    path = folder / "config.json"
    path.write_text(json.dumps({**json.loads(path.read_text()), **values}))


def test_a_checkpoint_comes_back_in_half_precision(tmp_path):
    model = CollisionDiscriminator(SMALL)
    model.save_pretrained(tmp_path / "deep" / "folder")
    loaded = CollisionDiscriminator.from_pretrained(tmp_path / "deep" / "folder")
    assert loaded.config == SMALL and not loaded.training
    assert set(load_file(tmp_path / "deep" / "folder" / "model.safetensors")) == set(model.state_dict())
    for name, tensor in model.state_dict().items():
        found = loaded.state_dict()[name]
        assert found.dtype == tensor.dtype
        torch.testing.assert_close(found, tensor.half().to(tensor.dtype), atol=0, rtol=0)
    size = (tmp_path / "deep" / "folder" / "model.safetensors").stat().st_size
    assert size < 2.2 * parameter_count(model) + 5000
    clouds = torch.randn(2, 4, 40, 3, generator=torch.Generator().manual_seed(1)) * 0.05
    with torch.no_grad():
        torch.testing.assert_close(loaded(*clouds), model(*clouds), atol=5e-3, rtol=0)


def test_configs_come_back_equal_tuples_included(tmp_path):
    size = {"width": 32, "layers": 1, "heads": 2, "feed_forward": 32}
    config = DiffusionConfig(**size, nouns=("plate", "fork"), prediction_type="epsilon")
    PoseDiffusion(config).save_pretrained(tmp_path)
    assert PoseDiffusion.from_pretrained(tmp_path).config == config


def test_a_network_grows_by_words_and_answers_old_ones_as_before(tmp_path):
    size = {"width": 32, "layers": 1, "heads": 2, "feed_forward": 32}
    few = PoseDiffusion(DiffusionConfig(**size, vocabulary=FIRST_VOCABULARY)).eval()
    few.save_pretrained(tmp_path)
    more = grown(PoseDiffusion, tmp_path, VOCABULARY).eval()
    assert more.config == replace(few.config, vocabulary=VOCABULARY) and len(more.word.weight) == VOCABULARY
    torch.testing.assert_close(more.word.weight[:FIRST_VOCABULARY], few.word.weight, atol=2e-3, rtol=0)
    assert more.word.weight[FIRST_VOCABULARY:].std() > 0.5
    given = PoseDiffusion.fake_input(2, 3, torch.Generator().manual_seed(2))
    answers = [one.try_out(given, torch.Generator().manual_seed(3)) for one in (few, more)]
    torch.testing.assert_close(*answers, atol=5e-3, rtol=0)
    assert grown(PoseDiffusion, tmp_path, 3).config == few.config  # nothing is forgotten
    with pytest.raises(CheckpointError, match="of kind 'diffusion'; expected 'collision'"):
        grown(CollisionDiscriminator, tmp_path, 0)


def test_a_network_without_words_is_loaded_to_go_on(folder):
    assert grown(CollisionDiscriminator, folder, 0).config == SMALL


@pytest.mark.parametrize("name", ["config.json", "model.safetensors"])
def test_a_missing_file_is_named(folder, name):
    (folder / name).unlink()
    with pytest.raises(CheckpointError, match=f"{folder} has no {name}"):
        CollisionDiscriminator.from_pretrained(folder)


@pytest.mark.parametrize("number", [torch.nan, torch.inf])
def test_numbers_that_are_not_finite_are_refused(folder, number):
    path = folder / "model.safetensors"
    weights = load_file(path)
    weights["head.0.bias"][0] = number
    save_file(weights, path)
    with pytest.raises(CheckpointError, match="model.safetensors: 'head.0.bias' has numbers that are not finite"):
        CollisionDiscriminator.from_pretrained(folder)


def test_another_models_checkpoint_is_refused(folder):
    with pytest.raises(CheckpointError, match="config.json is of kind 'collision'; expected 'structure'"):
        StructureDiscriminator.from_pretrained(folder)


def test_an_unknown_key_is_named_with_the_legal_ones(folder):
    edit(folder, depth=3)
    with pytest.raises(CheckpointError, match="unknown key 'depth'; legal: .*width"):
        CollisionDiscriminator.from_pretrained(folder)


def test_weights_of_a_wrong_shape_are_named_with_both_shapes(folder):
    edit(folder, width=32)
    with pytest.raises(CheckpointError, match=r"model.safetensors: 'encoder.* has shape \(16.*asks for \(32"):
        CollisionDiscriminator.from_pretrained(folder)


def test_missing_weights_are_named(folder):
    weights = load_file(folder / "model.safetensors")
    del weights["head.0.bias"]
    save_file(weights, folder / "model.safetensors")
    with pytest.raises(CheckpointError, match="lacks 'head.0.bias'"):
        CollisionDiscriminator.from_pretrained(folder)


@pytest.mark.parametrize("keep", [0, 6, 100, -50])
def test_truncated_weights_name_the_file(folder, keep):
    path = folder / "model.safetensors"
    path.write_bytes(path.read_bytes()[:keep])
    with pytest.raises(CheckpointError, match="model.safetensors cannot be read"):
        CollisionDiscriminator.from_pretrained(folder)


@pytest.mark.parametrize("text", ["", "{", "[1, 2]", "[]", '"text"', "null"])
def test_a_config_that_is_no_json_object_names_the_file(folder, text):
    (folder / "config.json").write_text(text)
    with pytest.raises(CheckpointError, match="config.json is not a JSON object"):
        CollisionDiscriminator.from_pretrained(folder)


@pytest.mark.parametrize(
    ("values", "said"),
    [
        (
            {"prediction_type": "x0"},
            "config.json does not describe a network: prediction_type cannot be 'x0'; legal values: ",
        ),
        (
            {"steps": 20},
            "diffusion cannot be used by model 'diffusion-unranked': the number of sampling steps cannot be 25",
        ),
    ],
)
def test_a_noise_schedule_that_does_not_suit_names_the_checkpoint(values, said, tmp_path):
    place = tmp_path / "diffusion"
    PoseDiffusion(DiffusionConfig(width=16, layers=1, heads=2, feed_forward=16)).save_pretrained(place)
    edit(place, **values)
    with pytest.raises(CheckpointError, match=said):
        load_planner("diffusion-unranked", tmp_path)


@pytest.mark.parametrize("value", ["wide", -4, None, 1.5])
def test_a_value_that_builds_no_network_names_the_file(folder, value):
    edit(folder, width=value)
    with pytest.raises(CheckpointError, match="config.json"):
        CollisionDiscriminator.from_pretrained(folder)


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"points": 0}, "points cannot be 0; legal: a whole number of at least 1"),
        ({"points": -5}, "points cannot be -5"),
        ({"points": True}, "points cannot be True"),
        ({"points": 128.0}, "points cannot be 128.0"),
        ({"steps": 0}, "steps cannot be 0"),
        ({"max_objects": 0}, "max_objects cannot be 0"),
        ({"heads": 0}, "heads cannot be 0"),
        ({"nouns": [1]}, r"nouns cannot be \[1\]; legal: a list of texts"),
        ({"nouns": "plate"}, "nouns cannot be 'plate'"),
        ({"nouns": [["plate"]]}, "nouns cannot be"),
        ({"frame_scale": [float("nan"), 1, 1]}, r"frame_scale cannot be \[nan, 1, 1\]; legal: a list of 3 finite numb"),
        ({"frame_scale": [1, 0, 1]}, "frame_scale cannot be"),
        ({"frame_scale": [1, 1]}, "frame_scale cannot be"),
        ({"frame_scale": 1}, "frame_scale cannot be 1"),
        ({"frame_center": [float("inf"), 0, 0]}, "frame_center cannot be"),
        ({"object_center": [10**400, 0, 0]}, "object_center cannot be"),
        ({"object_scale": ["a", 1, 1]}, "object_scale cannot be"),
        ({"prediction_type": ["v"]}, "prediction_type cannot be"),
    ],
)
def test_a_value_of_another_kind_names_the_key_and_what_is_legal(values, said, tmp_path):
    PoseDiffusion(DiffusionConfig(width=16, layers=1, heads=2, feed_forward=16)).save_pretrained(tmp_path)
    edit(tmp_path, **values)
    with pytest.raises(CheckpointError, match=f"config.json does not describe a network: {said}"):
        PoseDiffusion.from_pretrained(tmp_path)


def test_a_config_of_brackets_in_brackets_names_the_file(folder):
    (folder / "config.json").write_text("[" * 100_000)
    with pytest.raises(CheckpointError, match="config.json is not a JSON object"):
        CollisionDiscriminator.from_pretrained(folder)


@pytest.mark.parametrize("kind", [torch.float8_e4m3fn, torch.float8_e5m2, torch.int8, torch.bool, torch.complex64])
def test_weights_of_a_type_that_is_no_networks_are_refused(folder, kind):
    path = folder / "model.safetensors"
    weights = load_file(path)
    save_file(weights | {"head.0.bias": weights["head.0.bias"].to(kind)}, path)
    with pytest.raises(
        CheckpointError, match=f"'head.0.bias' has the type {str(kind)[6:]}; legal: float16, bfloat16, "
    ):
        CollisionDiscriminator.from_pretrained(folder)


def test_numbers_too_large_for_the_network_are_refused(folder):
    path = folder / "model.safetensors"
    weights = load_file(path)
    save_file(weights | {"head.0.bias": torch.full_like(weights["head.0.bias"], 1e200, dtype=torch.float64)}, path)
    with pytest.raises(CheckpointError, match="'head.0.bias' has numbers that are not finite"):
        CollisionDiscriminator.from_pretrained(folder)


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"width": 12_000}, "has width 12000; a network may have at most 8192"),
        ({"layers": 10**9}, "has layers 1000000000; a network may have at most 64"),
        ({"layers": 10**400}, "has layers 1000000"),
        ({"points": 1e300}, r"points cannot be 1e\+300; legal: a whole number"),
        ({"width": -(10**9)}, "width cannot be -1000000000"),
        ({"width": "x" * 50_000}, "does not describe a network: "),
        ({"points": [10**9]}, r"points cannot be \[1000000000\]"),
        ({"width": 8192, "layers": 64}, "describes a network of 18864032769 numbers; it may have at most 50000000"),
    ],
)
def test_a_config_of_a_network_that_is_too_large_is_refused_before_it_is_made(folder, values, said, monkeypatch):
    edit(folder, **values)
    monkeypatch.setattr("structdiffusion.models.checkpoint.load_file", None)
    forget_peak()
    before = peak_megabytes()
    with pytest.raises(CheckpointError, match=said) as caught:
        CollisionDiscriminator.from_pretrained(folder)
    assert len(str(caught.value)) < 300
    assert peak_megabytes() - before < 100


@pytest.mark.parametrize(("name", "limit"), [("config.json", "CONFIG_BYTES"), ("model.safetensors", "WEIGHTS_BYTES")])
def test_files_that_are_too_large_are_not_read(folder, monkeypatch, name, limit):
    monkeypatch.setattr(f"structdiffusion.models.checkpoint.{limit}", 10)
    with pytest.raises(
        CheckpointError, match=f"{name} .*it has (more than 10 bytes|[0-9]+ bytes; at most 10 are read)"
    ):
        CollisionDiscriminator.from_pretrained(folder)


def test_loading_a_planner_does_not_import_the_compiler():
    """The size of a network is checked on the meta device, where arithmetic imports torch's compiler for a second."""
    code = (
        "import sys; from structdiffusion.planners.factory import load_planner; load_planner('diffusion');"
        "print(*({'torch._dynamo', 'sympy'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == ""
