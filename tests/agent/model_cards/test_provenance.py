"""Networks are held to their cards whenever they are loaded, not only when somebody asks."""

import hashlib
import json
import shutil
from dataclasses import replace

import pytest
from safetensors.torch import load_file, save_file

from agent.batch.rows import fingerprint
from agent.cli.app import command_line
from agent.errors import NotVerified, UsageError
from agent.evaluation import arm, coverage, language, recordings
from agent.evaluation.success import measure
from agent.model_cards.catalogue import SHIPPED
from agent.model_cards.provenance import MATCHES, NO_CARD, provenance_of
from agent.pipeline.candidates import checked_planner
from agent.pipeline.resources import ResourceCache
from agent.pipeline.run import RunOptions
from structdiffusion.planners.registry import PLANNERS

MADE_OF = ("diffusion", "structure", "collision")


@pytest.fixture
def weights(tmp_path):
    """The networks that come along, with their cards, in a folder that may be changed."""
    for name in MADE_OF:
        shutil.copytree(SHIPPED / name, tmp_path / "weights" / name)
    return tmp_path / "weights"


def change_a_weight(folder):
    path = folder / "model.safetensors"
    tensors = load_file(path)
    name = sorted(tensors)[0]
    tensors[name].view(-1)[0] += 0.01
    save_file(tensors, path)


def change_the_config(folder):
    path = folder / "config.json"
    path.write_text(path.read_text().replace('"points"', '"points" '))


def change_the_card(**changes):
    def change(folder):
        path = folder / "card.json"
        path.write_text(json.dumps(json.loads(path.read_text()) | changes))

    return change


WAYS = {
    "weight": change_a_weight,
    "config": change_the_config,
    "grown": lambda folder: (folder / "model.safetensors").write_bytes(
        (folder / "model.safetensors").read_bytes() + b" "
    ),
    "card_of_nothing": change_the_card(files={}),
    "card_with_a_list": change_the_card(files=[]),
    "card_of_another": lambda folder: shutil.copy(SHIPPED / "cvae" / "card.json", folder / "card.json"),
    "card_of_brackets": lambda folder: (folder / "card.json").write_text("[" * 100_000),
    "card_empty": lambda folder: (folder / "card.json").write_text(""),
    "card_is_a_folder": lambda folder: ((folder / "card.json").unlink(), (folder / "card.json").mkdir()),
}


def test_what_comes_along_is_as_on_its_card():
    for model in PLANNERS:
        assert {one.card for one in provenance_of(model, None).values()} <= {MATCHES}, model
    assert set(provenance_of("diffusion", None)) == set(MADE_OF)


@pytest.mark.parametrize("name", MADE_OF)
@pytest.mark.parametrize("way", WAYS)
def test_a_network_unlike_its_card_is_not_loaded(way, name, weights):
    WAYS[way](weights / name)
    with pytest.raises(NotVerified, match=f"{name}.* --allow-unverified"):
        checked_planner("diffusion", weights)
    with pytest.raises(NotVerified):
        ResourceCache().planner("diffusion", weights)
    found = provenance_of("diffusion", weights)
    assert [one for one in MADE_OF if not found[one].verified] == [name]


@pytest.mark.parametrize("way", [way for way in WAYS if way != "grown"])
def test_it_is_loaded_where_that_is_allowed(way, weights):
    WAYS[way](weights / "collision")
    checked_planner("diffusion", weights, allow_unverified=True)


def test_a_network_without_a_card_is_loaded_and_its_checksum_known(weights):
    for name in MADE_OF:
        (weights / name / "card.json").unlink()
    change_a_weight(weights / "structure")
    checked_planner("diffusion", weights)
    for name, one in provenance_of("diffusion", weights).items():
        assert one.card == NO_CARD and one.verified
        content = (weights / name / "model.safetensors").read_bytes()
        assert one.sha256["model.safetensors"] == hashlib.sha256(content).hexdigest()


def test_a_run_refuses_them_unless_told_and_its_report_has_the_checksums(weights, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    change_a_weight(weights / "structure")
    arguments = ["run", "put the cups in a small circle on the left", "--weights", str(weights), "--no-execute"]
    assert command_line([*arguments, "--out", "refused"]) == 7
    told = capsys.readouterr().err
    assert "structure/model.safetensors differs from its model card" in told and "Traceback" not in told
    assert command_line([*arguments, "--out", "allowed", "--allow-unverified"]) in (0, 4, 5)  # as the arm fares
    report = json.loads((tmp_path / "allowed" / "report.json").read_text())
    networks = report["proposals"]["networks"]
    assert set(networks) == set(MADE_OF) and networks["diffusion"]["card"] == MATCHES
    content = (weights / "structure" / "model.safetensors").read_bytes()
    assert networks["structure"]["sha256"]["model.safetensors"] == hashlib.sha256(content).hexdigest()
    assert any("differs from its model card" in json.dumps(remark) for remark in report["remarks"])


def test_a_batchs_results_are_another_where_unverified_networks_are_allowed():
    options = RunOptions(model="geometric")
    assert fingerprint("a row", options) != fingerprint("a row", replace(options, allow_unverified=True))


def test_discriminators_that_are_measured_are_held_to_their_cards(weights, tmp_path, capsys):
    change_a_weight(weights / "collision")
    arguments = ["evaluate", "discriminators", "--data", str(tmp_path), "--weights", str(weights)]
    assert command_line(arguments) == 7
    assert "collision/model.safetensors differs from its model card" in capsys.readouterr().err
    assert command_line([*arguments, "--allow-unverified"]) == 6  # and goes on to the data, of which there are none
    assert "differs from its model card" not in capsys.readouterr().err


EVALUATED = {
    "success": ["--structure", "line", "--candidates", "2", "--top-k", "1", "--workers", "1"],
    "arm": ["--candidates", "2", "--workers", "1"],
    "recordings": ["--no-execute", "--workers", "1"],
    "coverage": ["--candidates", "2", "--workers", "1"],
    "language": ["--candidates", "2", "--limit", "2", "--workers", "1"],
}


@pytest.mark.parametrize("verb", EVALUATED)
def test_an_evaluation_refuses_them_unless_told(verb, weights, tmp_path, capsys, monkeypatch):
    change_a_weight(weights / "structure")
    monkeypatch.chdir(tmp_path)
    arguments = ["evaluate", verb, "--objects", "procedural", "--weights", str(weights), *EVALUATED[verb]]
    arguments += ["--scenes", "1"] if verb != "language" else []
    arguments += ["--out", "report.json" if verb == "coverage" else "out"]
    assert command_line(arguments) == 7
    told = capsys.readouterr().err
    assert "structure/model.safetensors differs from its model card" in told and "Traceback" not in told
    assert "run, chat, batch and evaluate take --allow-unverified" in told
    for module in (arm, coverage, language, recordings, measure):
        monkeypatch.setattr(module, "load_objects", objects_are_loaded)
    assert command_line([*arguments, "--allow-unverified"]) == 2
    assert capsys.readouterr().err == "structagent: the networks were taken\n"


def objects_are_loaded(source):
    raise UsageError("the networks were taken")


@pytest.mark.usefixtures("in_this_process")
def test_an_evaluation_that_is_told_to_has_a_result_and_says_so(weights, tmp_path, capsys):
    change_a_weight(weights / "structure")
    arguments = ["evaluate", "success", "--objects", "procedural", "--scenes", "1", *EVALUATED["success"]]
    assert command_line([*arguments, "--weights", str(weights), "--allow-unverified", "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["evaluations"][0]["aggregate"]["all"]["n"] == 1
    assert report["command"].endswith(" --allow-unverified")
