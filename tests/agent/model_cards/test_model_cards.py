"""`structagent models`: the catalogue, cards, and whether weights are what their cards say."""

import json
import shutil
from pathlib import Path

import pytest
import torch
from safetensors.torch import load_file, save_file

from agent.cli.app import command_line
from agent.model_cards.card import facts_of, files_of
from agent.model_cards.card_text import card_text
from agent.model_cards.catalogue import SHIPPED, networks, networks_of
from agent.model_cards.verify import verify
from structdiffusion.benchmark.success import Evaluation
from structdiffusion.models.checkpoint import CheckpointError, parameter_count
from structdiffusion.models.collision import CollisionDiscriminator
from structdiffusion.models.collision.model import CollisionConfig
from structdiffusion.models.cvae import PoseCVAE
from structdiffusion.models.cvae.model import CVAEConfig
from structdiffusion.models.diffusion import PoseDiffusion
from structdiffusion.models.diffusion.model import DiffusionConfig
from structdiffusion.models.outcome import OutcomeDiscriminator
from structdiffusion.models.outcome.model import OutcomeConfig
from structdiffusion.models.structformer import StructFormer
from structdiffusion.models.structformer.model import StructFormerConfig
from structdiffusion.models.structure import StructureDiscriminator
from structdiffusion.models.structure.model import StructureConfig
from structdiffusion.planners.factory import load_planner
from structdiffusion.planners.registry import PLANNERS
from structdiffusion.training.loop import TrainingOptions, train
from structdiffusion.training.run_record import RunMetadata

SMALL = {"width": 16, "layers": 1, "heads": 2, "feed_forward": 16}


@pytest.fixture(scope="module")
def checkpoints(tmp_path_factory) -> Path:
    """Small untrained networks of every kind, by name."""
    folder = tmp_path_factory.mktemp("checkpoints")
    PoseDiffusion(DiffusionConfig(**SMALL)).save_pretrained(folder / "diffusion")
    PoseCVAE(CVAEConfig(**SMALL)).save_pretrained(folder / "cvae")
    for shape in ("circle", "line", "tower", "table setting"):
        name = f"structformer_{shape.replace(' ', '_')}"
        StructFormer(StructFormerConfig(**SMALL, shape=shape)).save_pretrained(folder / name)
    StructureDiscriminator(StructureConfig(width=8, layers=1)).save_pretrained(folder / "structure")
    CollisionDiscriminator(CollisionConfig(width=8, layers=1)).save_pretrained(folder / "collision")
    OutcomeDiscriminator(OutcomeConfig(width=8, layers=1)).save_pretrained(folder / "outcome")
    return folder


@pytest.fixture
def trained(tmp_path) -> tuple[Path, Path]:
    """A collision discriminator that was trained for a moment, in a folder of weights; and the run's folder."""
    torch.manual_seed(0)
    model = CollisionDiscriminator(CollisionConfig(width=8, layers=1, points=8))

    def loss(generator):
        clouds = torch.randn(2, 4, 8, 3, generator=generator) * 0.03
        return {"loss": model(clouds[0], clouds[1]).square().mean()}

    run = tmp_path / "runs" / "mine"
    here = RunMetadata("1.0", {"name": "toys", "pairs": 40, "seed": 3}, 4, "pairs")
    options = TrainingOptions(steps=4, log_every=2, seed=11)
    list(train(model, loss, run, options, torch.device("cpu"), metadata=here))
    weights = tmp_path / "weights"
    (weights / "collision").mkdir(parents=True)
    for name in ("config.json", "model.safetensors"):
        shutil.copy(run / name, weights / "collision")
    return weights, run


@pytest.fixture
def report(tmp_path) -> Path:
    """What `evaluate success` writes of two planners on four scenes: one is made of the discriminators, one is not."""
    evaluations = []
    for name, successes in (("diffusion", 3), ("geometric", 4)):
        rows = tuple(
            {"structure": "line", "number": i, "model": name, "plan_seconds": 0.1, "seconds": 1.0,
             "success": i < successes, "first_success_rank": 1 if i < successes else None,
             "failure": None if i < successes else "semantic", "verdicts": []}
            for i in range(4)
        )  # fmt: skip
        evaluations.append(Evaluation(rows, 5, {"model": name}).to_dict())
    path = tmp_path / "eval.json"
    report = {"version": "1.0", "command": "structagent evaluate success --seed 7", "evaluations": evaluations}
    path.write_text(json.dumps(report))
    return path


def fails(code: int, arguments: list[str], capsys) -> str:
    assert command_line(["models", *arguments]) == code
    return capsys.readouterr().err


def test_the_list_has_every_network_that_comes_along(capsys):
    assert command_line(["models", "list", "--json"]) == 0
    rows = {row["name"]: row for row in json.loads(capsys.readouterr().out)}
    others = {"embedding", "goals", "verifier", "llm", "segmentation"}
    assert set(rows) == {path.parent.name for path in SHIPPED.glob("*/config.json")} | others
    model = PoseDiffusion.from_pretrained(SHIPPED / "diffusion")
    assert rows["diffusion"]["parameters"] == parameter_count(model)
    files = ("config.json", "model.safetensors")
    assert rows["diffusion"]["bytes"] == sum((SHIPPED / "diffusion" / name).stat().st_size for name in files)
    assert rows["diffusion"]["steps"] > 1000
    assert command_line(["models", "list", "--all"]) == 0
    planners = capsys.readouterr().out.split("planners (--model")[1].split("\n", 1)[1].replace("\n    ", " ")
    assert {name for line in planners.splitlines() for name in line.split(": ")[1].split(", ")} == set(PLANNERS)
    assert command_line(["models", "list"]) == 0
    table, few = capsys.readouterr().out.split("planners (--model")
    assert "geometric+rollout" in few and "--all" in few and "cvae" not in few
    assert all(name in table for name in rows)


@pytest.mark.parametrize("name", list(networks()))
def test_cards_that_come_along_are_what_their_facts_and_files_give(name):
    one = networks()[name]
    facts = facts_of(one)
    assert one.text_path.read_text() == card_text(facts)
    assert facts["files"] == files_of(one)
    assert facts["training"]
    for heading in ("Input and output", "Limits", "Licence", "Training", "Results"):
        assert f"\n## {heading}\n" in one.text_path.read_text()


@pytest.mark.parametrize("name", [name for name in networks() if not name.startswith("llm")])
def test_networks_that_come_along_are_verified(name):
    findings = list(verify(networks()[name]))
    assert [finding.check for finding in findings] == ["files", "weights", "answer"]
    assert all(finding.passed for finding in findings), findings


def test_networks_of_every_kind_answer_a_fake_input(checkpoints):
    found = networks(checkpoints)
    assert len(found) == 9
    for one in found.values():
        files, weights, answer = verify(one)
        assert not files.passed and "no checksum is written" in files.detail
        assert weights.passed and answer.passed, (weights, answer)


def test_a_planner_needs_just_the_networks_that_it_is_said_to_be_made_of(checkpoints, tmp_path):
    for made, planner in {tuple(networks_of(name)): name for name in PLANNERS}.items():
        folder = tmp_path / planner
        folder.mkdir()
        for name in made:
            (folder / name).symlink_to(checkpoints / name)
        load_planner(planner, folder)
        for name in made:
            (folder / name).unlink()
            with pytest.raises(CheckpointError):
                load_planner(planner, folder)
            (folder / name).symlink_to(checkpoints / name)


def test_show_prints_the_card_or_what_a_planner_is_made_of(capsys):
    assert command_line(["models", "show", "structure"]) == 0
    text = capsys.readouterr().out
    assert text.startswith((SHIPPED / "structure" / "card.md").read_text()) and "\n## Planners\n" in text
    assert command_line(["models", "show", "structure", "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == json.loads((SHIPPED / "structure" / "card.json").read_text())
    assert command_line(["models", "show", "cvae+cem"]) == 0
    text = capsys.readouterr().out
    assert "`cvae`" in text and "`collision`\n" in text and "| cem | yes |" in text
    error = fails(2, ["show", "oracle"], capsys)
    assert (
        "'oracle'" in error and "networks here: diffusion, cvae, structformer_circle" in error and "geometric" in error
    )


def test_a_card_is_written_from_what_training_and_evaluation_wrote(trained, report, capsys):
    weights, run = trained
    place = ["--weights", str(weights)]
    arguments = ["card", "collision", "--run", str(run), "--eval", str(report), *place]
    assert command_line(["models", *arguments]) == 0
    capsys.readouterr()
    assert command_line(["models", "show", "collision", *place]) == 0
    text = capsys.readouterr().out
    assert text.startswith((weights / "collision" / "card.md").read_text())
    assert "4 steps in" in text and "| 4 pairs |" in text and "| 11 | `toys`: pairs 40, seed 3 |" in text
    assert "| diffusion | all | 4 | 75.0 (30.1-95.4) | semantic 1 |" in text and "| geometric |" not in text
    assert "structagent evaluate success --seed 7" in text
    assert command_line(["models", "list", "--json", *place]) == 0
    (row,) = json.loads(capsys.readouterr().out)
    assert row["headline"] == "75 % stand (diffusion, n = 4)" and row["steps"] == 4
    assert command_line(["models", "verify", *place]) == 0
    # What is known stays where nothing new is given.
    before = (weights / "collision" / "card.json").read_text()
    assert command_line(["models", "card", "collision", *place]) == 0
    assert (weights / "collision" / "card.json").read_text() == before


def test_a_card_of_other_weights_or_of_no_evaluation_is_refused(trained, report, tmp_path, capsys):
    weights, run = trained
    place = ["--weights", str(weights)]
    CollisionDiscriminator(CollisionConfig(width=8, layers=1, points=8)).save_pretrained(weights / "collision")
    assert "for other weights" in fails(6, ["card", "collision", "--run", str(run), *place], capsys)
    assert not (weights / "collision" / "card.json").exists()
    assert "training.json" in fails(6, ["card", "collision", "--run", str(tmp_path), *place], capsys)
    report.write_text('{"evaluations": [{"about": {}}]}')
    assert "is not a report" in fails(6, ["card", "collision", "--eval", str(report), *place], capsys)
    report.write_text('{"version": "1", "evaluations": [{"about": {"model": "geometric"}, "aggregate": {}}]}')
    assert "does not measure 'collision'" in fails(6, ["card", "collision", "--eval", str(report), *place], capsys)
    assert "networks here: collision" in fails(2, ["card", "structure", *place], capsys)


def test_cards_and_records_that_lack_something_are_told_what(trained, tmp_path, capsys):
    weights, run = trained
    place = ["--weights", str(weights)]
    (weights / "collision" / "card.json").write_text('{"schema": "structagent-card/1", "name": "collision"}')
    for code, verb in ((6, ["list"]), (7, ["verify"]), (6, ["show", "collision"])):
        assert "card.json lacks 'family', 'parameters', 'files'" in fails(code, [*verb, *place], capsys)
    (weights / "collision" / "card.json").unlink()
    (run / "training.json").write_text('{"steps": 4, "seconds": 1.0, "losses": {}, "sessions": []}')
    assert "lacks 'files'" in fails(6, ["card", "collision", "--run", str(run), *place], capsys)


def test_a_network_for_one_structure_is_measured_on_that_alone(checkpoints, tmp_path, capsys):
    weights, path = tmp_path / "weights", tmp_path / "eval.json"
    shutil.copytree(checkpoints, weights)
    rows = tuple(
        {"structure": structure, "number": i, "model": "structformer", "plan_seconds": 0.1, "seconds": 1.0,
         "success": structure == "line", "first_success_rank": 1 if structure == "line" else None,
         "failure": None if structure == "line" else "semantic", "verdicts": []}
        for structure in ("line", "tower")
        for i in range(4)
    )  # fmt: skip
    evaluations = [Evaluation(rows, 5, {"model": "structformer"}).to_dict()]
    path.write_text(json.dumps({"version": "1.0", "command": "evaluate", "evaluations": evaluations}))
    for shape, rate in (("line", "100.0"), ("tower", "0.0")):
        name = f"structformer_{shape}"
        assert command_line(["models", "card", name, "--eval", str(path), "--weights", str(weights)]) == 0
        text = (weights / name / "card.md").read_text()
        assert f"| structformer | {shape} | 4 | {rate} (" in text and "| all |" not in text
    capsys.readouterr()
    assert command_line(["models", "list", "--json", "--weights", str(weights)]) == 0
    found = {row["name"]: row["headline"] for row in json.loads(capsys.readouterr().out)}
    assert found["structformer_line"] == "100 % stand (structformer, n = 4)"
    assert found["structformer_tower"] == "0 % stand (structformer, n = 4)"


def spoil(folder: Path, kind: str) -> None:
    path, config = folder / "model.safetensors", folder / "config.json"
    if kind == "byte":
        content = bytearray(path.read_bytes())
        content[-1] ^= 1
        path.write_bytes(content)
    elif kind == "nan":
        weights = load_file(path)
        weights["head.0.bias"][0] = torch.nan
        save_file(weights, path)
    elif kind == "more":
        save_file(load_file(path) | {"extra": torch.zeros(1)}, path)
    elif kind == "less":
        path.unlink()
    else:
        values = json.loads(config.read_text())
        del values["points"]
        config.write_text(json.dumps(values))


@pytest.mark.parametrize(
    ("kind", "check", "said"),
    [
        ("byte", "files", "the checksums differ"),
        ("nan", "weights", "not finite"),
        ("more", "weights", "has 'extra', which its config does not ask for"),
        ("less", "files", "has no model.safetensors"),
        ("config", "weights", "lacks 'points'"),
    ],
)
def test_weights_that_were_spoilt(kind, check, said, trained, capsys):
    weights, run = trained
    place = ["--weights", str(weights)]
    assert command_line(["models", "card", "collision", "--run", str(run), *place]) == 0
    spoil(weights / "collision", kind)
    capsys.readouterr()
    assert command_line(["models", "verify", "collision", "--json", *place]) == 7
    captured = capsys.readouterr()
    found = {finding["check"]: finding for finding in json.loads(captured.out)}
    assert not found["files"]["passed"]  # whatever was changed
    assert not found[check]["passed"] and said in found[check]["detail"]
    assert "checks failed, first the files of 'collision'" in captured.err


def test_a_folder_without_networks(tmp_path, capsys):
    assert "has no checkpoints" in fails(6, ["list", "--weights", str(tmp_path)], capsys)
    assert "there is no folder" in fails(6, ["list", "--weights", str(tmp_path / "none")], capsys)
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "config.json").write_text('{"kind": "oracle"}')
    assert "'oracle'" in fails(6, ["verify", "--weights", str(tmp_path)], capsys)
    (tmp_path / "mine" / "config.json").write_text("[]")
    assert 'needs a JSON object with "kind"' in fails(6, ["verify", "--weights", str(tmp_path)], capsys)


DEEP = {"a": 1}
for _ in range(400):
    DEEP = {"a": DEEP}


@pytest.mark.parametrize(
    "changes",
    [
        {"files": []}, {"files": [1]}, {"files": "x"}, {"files": {"config.json": []}}, {"files": {"config.json": {}}},
        {"parameters": "many"}, {"parameters": None}, {"training": "x"}, {"training": ["x"]},
        {"training": {"sessions": 3}}, {"training": {"sessions": [3]}}, {"training": {"sessions": [{}], "losses": []}},
        {"results": 3}, {"results": [3]}, {"results": [{"rows": []}]}, {"results": [{"rows": [{"n": 0}]}]},
        {"results": {"rows": 1}}, {"name": []}, {"family": "../../x"}, {"family": []}, {"training": {"x": DEEP}},
    ],
    ids=lambda changes: json.dumps(changes)[:40],
)  # fmt: skip
def test_a_card_of_anybodys_making_is_one_sentence(changes, trained, capsys):
    weights, _ = trained
    assert command_line(["models", "card", "collision", "--weights", str(weights)]) == 0
    path = weights / "collision" / "card.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | changes))
    for code, verb in ((6, ["list"]), (6, ["show", "collision"]), (7, ["verify", "collision"])):
        if changes == {"training": {"x": DEEP}}:  # how deep is too deep is Python's to say
            assert command_line(["models", *verb, "--weights", str(weights)]) in (0, code)
            continue
        assert str(path) in fails(code, [*verb, "--weights", str(weights)], capsys)


@pytest.mark.parametrize("text", ["[" * 100_000, '{"kind": []}', '{"kind": {}}'])
def test_a_config_of_no_kind_is_one_sentence(text, trained, capsys):
    (trained[0] / "collision" / "config.json").write_text(text)
    assert "config.json" in fails(6, ["list", "--weights", str(trained[0])], capsys)


def test_no_steps_at_all_are_told(trained, capsys):
    weights, run = trained
    assert command_line(["models", "card", "collision", "--run", str(run), "--weights", str(weights)]) == 0
    path = weights / "collision" / "card.json"
    card = json.loads(path.read_text())
    card["training"] |= {"steps": 0, "seconds": 0}
    path.write_text(json.dumps(card))
    for verb in (["list"], ["show", "collision"], ["verify", "collision"]):
        assert command_line(["models", *verb, "--weights", str(weights)]) == 0
