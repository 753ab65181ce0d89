"""The command line: exit codes, one-sentence errors, help, and clean standard output."""

import io
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import torch
import trimesh

from agent import __version__
from agent.cli import app as cli
from agent.cli.app import command_line
from agent.cli.benchmark_tables import growth_tables
from grounding.spec import SHAPES
from structdiffusion.benchmark import growth
from tests.commands import structagent
from tests.structdiffusion.benchmark.released_checkout import checkout

ROOT = Path(__file__).parents[3]
EXACT = ("--model", "geometric")
CIRCLE = "put the cups in a small circle on the left"


@pytest.fixture(autouse=True)
def elsewhere(tmp_path, monkeypatch):
    """Reports without --out go to a folder that is thrown away."""
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def fails(capsys):
    """Runs a command that must fail with one sentence on standard error; returns that sentence."""

    def run(code: int, *arguments: str) -> str:
        assert command_line(list(arguments)) == code
        said = [line for line in capsys.readouterr().err.splitlines() if line.startswith("structagent: ")]
        assert len(said) == 1
        assert not list(Path.cwd().glob("out/*"))
        return said[0].removeprefix("structagent: ")

    return run


def mesh_folder(folder: Path, count: int, side: float = 0.05) -> str:
    folder.mkdir()
    for number in range(count):
        trimesh.creation.box((side, side, side + 0.01 * number)).export(folder / f"box_{number}.stl")
    return str(folder)


@pytest.mark.parametrize(
    "arguments",
    [
        [],
        ["run"],
        ["parse"],
        ["generate"],
        ["train"],
        ["train", "diffusion"],
        ["train", "parser"],
        ["train", "llm"],
        ["benchmark"],
        ["evaluate"],
        ["evaluate", "success"],
        ["evaluate", "arm"],
        ["evaluate", "parse"],
        ["evaluate", "language"],
        ["evaluate", "coverage"],
        ["evaluate", "discriminators"],
        ["scene"],
        ["scene", "show"],
        ["scene", "new"],
        ["scene", "validate"],
        ["doctor"],
        ["config"],
        ["config", "show"],
        ["models"],
        ["models", "list"],
        ["models", "show"],
        ["models", "verify"],
        ["models", "card"],
        ["chat"],
        ["batch"],
        ["replay"],
        ["report"],
        ["completion"],
    ],
)
def test_help_has_an_example(arguments, capsys):
    assert command_line([*arguments, "--help"]) == 0
    assert "Example: structagent" in capsys.readouterr().out


def test_help_answers_at_once():
    """Nothing heavy is imported before a verb needs it; seconds are not measured, because the machine may be busy."""
    program = "import sys, agent.cli.app; agent.cli.app.command_line(['--version']); print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=True)
    version, modules = done.stdout.splitlines()
    assert version == f"structagent {__version__}"
    assert not {"torch", "numpy", "scipy", "pybullet", "trimesh", "PIL"} & set(modules.split())


@pytest.mark.parametrize(
    ("arguments", "parts"),
    [
        ([], ("command", "chat, run, batch, replay, report, parse")),
        (["bulid"], ("'bulid'", "chat, run, batch, replay, report, parse")),
        (["train", "everything"], ("'everything'", "diffusion, cvae, structformer_circle")),
        (["train", "parser", "--out", "p", "--data", "d"], ("--data",)),
        (["train", "llm", "--out", "a", "--start", "nowhere"], ("--start", "'nowhere'")),
        (["train", "parser", "--out", "p", "--rate", "0"], ("--rate", "0", "above 0")),
        (["benchmark", "--runs", "0"], ("--runs", "0")),
        (["benchmark", "--sweep", "s", "--objects", "3"], ("--sweep", "--objects")),
        (["benchmark", "--structure", "heap"], ("--structure", "'heap'", "pyramid")),
        (["benchmark", "--largest", "9"], ("--largest", "--sweep")),
        (["benchmark", "--ray", "local"], ("--ray", "--sweep")),
        (["benchmark", "--sweep", "s", "--reference", "d"], ("--sweep", "--reference")),
        (["run"], ("TEXT",)),
        (["run", CIRCLE, "--scene", "bag"], ("'bag'", "simulated")),
        (["run", CIRCLE, "--seed", "many"], ("--seed", "'many'")),
        (["run", CIRCLE, "--seed", "-1"], ("--seed", "-1")),
        (["run", CIRCLE, "--model", "oracle"], ("'oracle'", "diffusion", "geometric")),
        (["evaluate", "arm", "--model", "oracle"], ("'oracle'", "diffusion", "geometric")),
        (["evaluate", "success", "--scenes", "0"], ("--scenes", "0")),
    ],
)
def test_usage_errors_name_the_value_and_the_legal_ones(fails, arguments, parts):
    sentence = fails(2, *arguments)
    assert all(part in sentence for part in parts), sentence


def test_out_that_is_a_file_is_a_usage_error(fails, tmp_path):
    (tmp_path / "notes.txt").write_text("")
    assert "notes.txt" in fails(2, "run", CIRCLE, "--out", str(tmp_path / "notes.txt"))


@pytest.mark.parametrize("text", ["", "   "])
def test_empty_instruction(fails, text):
    assert "empty" in fails(3, "run", text)
    assert "empty" in fails(3, "parse", text)


def test_unknown_object_folder(fails):
    sentence = fails(2, "run", CIRCLE, "--objects", "no/such/folder", *EXACT)
    assert "no/such/folder" in sentence and "ycb" in sentence and "procedural" in sentence


def test_folder_without_meshes(fails, tmp_path):
    (tmp_path / "notes").mkdir()
    (tmp_path / "notes" / "readme.txt").write_text("nothing here")
    sentence = fails(6, "run", CIRCLE, "--objects", str(tmp_path / "notes"), *EXACT)
    assert "notes" in sentence and ".obj" in sentence


def test_broken_mesh(fails, tmp_path):
    folder = mesh_folder(tmp_path / "meshes", 3)
    (Path(folder) / "broken.obj").write_text("v 0 0 zero\nf 1 2 9\n")
    assert "broken.obj" in fails(6, "run", CIRCLE, "--objects", folder, *EXACT)


def test_one_object_makes_no_circle(fails, tmp_path):
    sentence = fails(3, "run", "make a circle", "--objects", mesh_folder(tmp_path / "one", 1), *EXACT)
    assert "circle" in sentence and "1" in sentence


def test_objects_that_are_not_there(fails, tmp_path):
    sentence = fails(3, "run", "put the forks in a line", "--objects", mesh_folder(tmp_path / "boxes", 4), *EXACT)
    assert "fork" in sentence


def test_size_that_cannot_fit(fails, tmp_path):
    folder = mesh_folder(tmp_path / "large", 5, side=0.14)
    sentence = fails(3, "run", "put the five boxes in a large circle", "--objects", folder, *EXACT)
    assert "large" in sentence


@pytest.fixture(scope="module")
def checkpoints(tmp_path_factory) -> Path:
    """Untrained checkpoints of all three networks, which load."""
    from structdiffusion.models.collision import CollisionDiscriminator
    from structdiffusion.models.diffusion import PoseDiffusion
    from structdiffusion.models.structure import StructureDiscriminator

    folder = tmp_path_factory.mktemp("checkpoints")
    torch.manual_seed(1)  # some of those that know nothing are lucky, now that what hardly misses is mended
    for network in (PoseDiffusion, StructureDiscriminator, CollisionDiscriminator):
        network().save_pretrained(folder / network.kind)
    return folder


def test_folder_without_checkpoints(fails, tmp_path):
    sentence = fails(6, "run", CIRCLE, "--weights", str(tmp_path))
    assert f"{tmp_path} lacks diffusion" in sentence and "structagent train diffusion" in sentence


@pytest.mark.parametrize("name", ["config.json", "model.safetensors"])
def test_checkpoint_with_a_missing_file(fails, checkpoints, tmp_path, name):
    shutil.copytree(checkpoints, tmp_path / "weights")
    (tmp_path / "weights" / "structure" / name).unlink()
    sentence = fails(6, "run", CIRCLE, "--weights", str(tmp_path / "weights"))
    assert "structure" in sentence and name in sentence


def test_checkpoint_with_a_wrong_shape(fails, checkpoints, tmp_path):
    shutil.copytree(checkpoints, tmp_path / "weights")
    path = tmp_path / "weights" / "diffusion" / "config.json"
    config = json.loads(path.read_text())
    path.write_text(json.dumps(config | {"feed_forward": config["feed_forward"] * 2}))
    assert "shape" in fails(6, "run", CIRCLE, "--weights", str(tmp_path / "weights"))


def test_models_that_know_nothing_have_no_valid_goal(checkpoints, tmp_path, capsys):
    arguments = ["run", CIRCLE, "--weights", str(checkpoints), "--no-execute", "--out", "report"]
    assert command_line(arguments) == 4
    outcome = json.loads((tmp_path / "report" / "report.json").read_text())["outcome"]
    assert outcome["exit_code"] == 4 and not outcome["success"]
    assert outcome["message"] in capsys.readouterr().err


def test_candidates_that_score_next_to_nothing_are_no_goal():
    from agent.errors import NoValidGoal
    from agent.pipeline.candidates import LEAST_SCORE, filter_viable
    from structdiffusion.observation import Arrangement

    good, bad = (Arrangement(np.eye(4)[None], {"total": score}) for score in (LEAST_SCORE, LEAST_SCORE / 2))
    assert filter_viable([good, bad]) == [good]
    stood = Arrangement(np.eye(4)[None], {"total": LEAST_SCORE / 9, "rollout": 1.0})
    fell = Arrangement(np.eye(4)[None], {"total": LEAST_SCORE / 9, "rollout": 0.1})
    assert filter_viable([stood, good, bad, fell]) == [stood, good]
    with pytest.raises(NoValidGoal, match="none of 2 proposed arrangements is good enough"):
        filter_viable([bad, bad])
    touching = Arrangement(np.eye(4)[None], {"structure": 0.9, "collision": 0.01, "total": 0.009})
    with pytest.raises(NoValidGoal, match="the best scores 0.009, .*; what costs it most is 'collision', 0.01"):
        filter_viable([touching, Arrangement(np.eye(4)[None], {"structure": 0.001, "collision": 1.0, "total": 0.001})])


def test_checkpoint_of_another_model(fails, checkpoints, tmp_path):
    shutil.copytree(checkpoints, tmp_path / "weights")
    shutil.rmtree(tmp_path / "weights" / "collision")
    shutil.copytree(checkpoints / "structure", tmp_path / "weights" / "collision")
    sentence = fails(6, "run", CIRCLE, "--weights", str(tmp_path / "weights"))
    assert "'structure'" in sentence and "'collision'" in sentence


def test_parse_goes_on_after_an_instruction_it_does_not_understand(capsys):
    assert command_line(["parse", "build a tower on the right", "", "--json"]) == 3
    captured = capsys.readouterr()
    first, second = (json.loads(line) for line in captured.out.splitlines())
    assert first["spec"]["shape"] == "tower" and first["spec"]["x_position"] == "right"
    assert first["spec"]["rotation"] is None and 0 <= first["confidence"]["shape"] <= 1
    assert second["status"] == "refused" and "empty" in second["message"]
    assert "empty" in captured.err


@pytest.mark.parametrize(
    ("content", "why"),
    [
        ('[\n{"text": "stack the cans"}\n]', "is JSON; parse takes one instruction per line"),
        ('{"text": "stack the cans"}\n', "is JSON"),
        ('["stack the cans"', "is JSON"),
        ("id,text\na,stack the cans\n", "is a table"),
        ("<html>\n<p>stack the cans", "markup"),
    ],
)
def test_parse_takes_no_data_for_instructions(content, why, monkeypatch, capsys):
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(content.encode())))
    assert command_line(["parse"]) == 6
    said = capsys.readouterr()
    assert why in " ".join(said.err.split()) and said.out == ""


def test_json_among_lines_costs_its_own_line(monkeypatch, capsys):
    content = 'stack the cans\n{"text": "make a line"}\nmake a circle\n'
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(content.encode())))
    assert command_line(["parse", "--json"]) == 3
    said = capsys.readouterr()
    assert [json.loads(line)["status"] for line in said.out.splitlines()] == ["ok", "refused", "ok"]
    assert "is JSON, not an instruction" in " ".join(said.err.split())


def test_parse_tells_viewpoint_objects_and_evidence(capsys):
    line = ["parse", "line up the cups on the left", "--viewpoint", "opposite", "--objects", "mug,bowl,cup,cup"]
    assert command_line(line) == 0
    told = capsys.readouterr().out
    assert "right" in told and "opposite" in told and "cup, cup" in told and "left'" in told
    assert command_line([*line, "--json"]) == 0
    row = json.loads(capsys.readouterr().out)
    assert row["spec"]["x_position"] == "right" and row["spec"]["objects"] == ["cup", "cup"]
    assert row["viewpoint"] == "opposite" and row["parser"] == "embedding" and row["prompt_sha256"] is None


@pytest.mark.parametrize(
    ("arguments", "parts"),
    [
        (["parse", "a row", "--viewpoint", "above"], ("'above'", "robot", "opposite")),
        (["parse", "a row", "--parser", "psychic"], ("'psychic'", "embedding", "llm")),
        (["parse", "a row", "--objects", " , "], ("--objects",)),
    ],
)
def test_reading_options_that_are_wrong(arguments, parts, capsys):
    assert command_line(arguments) == 2
    error = capsys.readouterr().err
    assert all(part in error for part in parts)


def test_parse_asks_where_nothing_but_a_wish_is_said(capsys):
    assert command_line(["parse", "make something nice with the cups", "--json"]) == 0
    row = json.loads(capsys.readouterr().out)
    assert row["status"] == "ask" and row["question"]["options"] == list(SHAPES)


def test_an_unusable_llm_is_told_and_the_other_parser_speaks(capsys):
    arguments = ["parse", "stack the cans", "--parser", "llm", "--llm-url", "http://127.0.0.1:1/v1", "--json"]
    assert command_line(arguments) == 0
    captured = capsys.readouterr()
    row = json.loads(captured.out)
    assert row["parser"] == "embedding" and row["spec"]["shape"] == "tower"
    assert "127.0.0.1:1" in row["fallback"] and "127.0.0.1:1" in captured.err


def test_parse_survives_bytes_that_are_no_text():
    done = subprocess.run(
        structagent("parse", "--json"),
        input=b"make a circle \xff\xfe\n\x00\x1b[31m\n",
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
    )
    rows = [json.loads(line) for line in done.stdout.splitlines()]
    assert [row["status"] for row in rows] == ["refused", "refused"] and all(row["message"] for row in rows)
    assert b"Traceback" not in done.stderr


def test_parse_reads_standard_input():
    done = subprocess.run(
        structagent("parse", "--json"),
        input="make a circle\n\nstack the cans\n",
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
    )
    shapes = [json.loads(line)["spec"]["shape"] for line in done.stdout.splitlines()]
    assert shapes == ["circle", None, "tower"]
    assert done.returncode == 3 and "empty" in done.stderr


def test_run_without_the_arm_reports_json_alone_on_standard_output(tmp_path):
    done = subprocess.run(
        structagent(
            "run",
            "make a line of boxes",
            "--objects",
            mesh_folder(tmp_path / "boxes", 4),
            "--model",
            "geometric",
            "--no-execute",
            "--json",
            "--out",
            str(tmp_path / "report"),
        ),  # fmt: skip
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
    )
    report = json.loads(done.stdout)
    assert done.returncode == 0, done.stderr
    assert report == json.loads((tmp_path / "report" / "report.json").read_text())
    assert report["outcome"]["success"] and report["verdict"]["how"] == "released"
    assert all(seen["category"] == "box" for seen in report["scene"]["objects"] if seen["takes_part"])
    assert np.isfinite(report["proposals"]["candidates"][0]["scores"]["total"])
    assert "Understood" in done.stderr and "report: " in done.stderr
    assert (tmp_path / "report" / "report.html").is_file()


def test_run_with_the_arm_builds_and_reports(tmp_path, capsys):
    arguments = ["run", "stack the cans on the right", *EXACT, "--seed", "1", "--out", str(tmp_path / "report")]
    assert command_line(arguments) == 0
    story = capsys.readouterr().out
    assert "planned candidate" in story and "It stands as asked" in story
    assert story.endswith(f"report: {tmp_path / 'report' / 'report.html'}\n")
    report = json.loads((tmp_path / "report" / "report.json").read_text())
    taking_part = [seen["name"] for seen in report["scene"]["objects"] if seen["takes_part"]]
    placed = [event for event in report["arm"] if event["kind"] == "placed" and not event["aside"]]
    assert sorted(event["name"] for event in placed) == sorted(taking_part)
    assert all(event["position_error_m"] < 0.04 for event in placed)
    assert report["verdict"]["how"] == "arm" and all(check["passed"] for check in report["verdict"]["checks"])
    pictures = {entry["name"] for entry in report["pictures"]}
    assert {"placement-1-picked", "placement-1-after", "camera-after", "proposed-goal"} <= pictures


def test_same_seed_same_report(tmp_path):
    reports, folder = [], mesh_folder(tmp_path / "boxes", 4)
    for attempt in ("first", "second"):
        arguments = ["run", "make a line of boxes", "--objects", folder, "--model", "geometric", "--no-execute"]
        assert command_line([*arguments, "--seed", "5", "--out", str(tmp_path / attempt)]) == 0
        report = json.loads((tmp_path / attempt / "report.json").read_text())
        reports.append((report["scene"]["objects"], report["proposals"]["candidates"], report["verdict"]["checks"]))
    assert reports[0] == reports[1]


def test_interruption(monkeypatch, capsys):
    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("agent.pipeline.run.run_instruction", interrupted)
    assert command_line(["run", CIRCLE]) == 130
    assert capsys.readouterr().err == "structagent: interrupted\n"


@pytest.mark.parametrize("kind", ["diffusion", "structure", "collision", "cvae", "structformer_table_setting"])
def test_training_without_scenes(fails, tmp_path, kind):
    sentence = fails(6, "train", kind, "--data", str(tmp_path / "none"), "--out", str(tmp_path / "run"))
    assert "library.npz" in sentence and "structagent generate" in sentence


def test_every_network_can_be_trained():
    from agent.cli.train import train_app
    from agent.training.recipes import RECIPES, TITLES
    from agent.training.train import _TASKS

    commands = [command.name for command in train_app.registered_commands]
    assert (
        commands == [*RECIPES, "strokes", "parser", "llm", "goals", "verifier", "segmentation"]
        and RECIPES.keys() == TITLES.keys() == _TASKS.keys()
    )


def test_defaults_of_the_parser_trainers_are_those_of_their_modules():
    from agent.training import parsers
    from grounding.training import embedding_parser, llm_adapter

    assert parsers.PARSER_SENTENCES == embedding_parser.SENTENCES
    adapter = llm_adapter.AdapterTraining()
    assert (adapter.steps, adapter.rate) == (parsers.LLM_STEPS, parsers.LLM_LEARNING_RATE)


def test_the_parser_trainers_get_the_options(monkeypatch, tmp_path):
    given = {}
    monkeypatch.setattr("agent.training.parsers.train_embedding_parser", lambda *a: given.update(parser=a))
    monkeypatch.setattr("agent.training.parsers.train_llm_adapter", lambda *a: given.update(llm=a))
    (tmp_path / "old").mkdir()
    line = ["train", "parser", "--out", "new", "--sentences", "64", "--start", "old", "--rate", "0.5", "--seed", "3"]
    assert command_line([*line, "--threads", "2"]) == 0
    assert given["parser"] == (Path("new"), 64, Path("old"), 0.5, 3, 2)
    assert command_line(["train", "llm", "--out", "a.safetensors", "--steps", "7", "--learning-rate", "1e-4"]) == 0
    assert given["llm"] == (Path("a.safetensors"), 7, None, 1e-4, 0, 1)


def test_training_on_an_unknown_device(fails, tmp_path):
    sentence = fails(
        2, "train", "collision", "--data", str(tmp_path), "--out", str(tmp_path / "run"), "--device", "tpu"
    )
    assert "'tpu'" in sentence and "auto, cpu, cuda" in sentence


def test_benchmark_measures_decisions_in_tables_of_markdown(tmp_path, capsys):
    line = ["benchmark", "--model", "diffusion-tokens", "--runs", "1", "--objects", "3", "--candidates", "2"]
    assert command_line([*line, "--reference", str(checkout(tmp_path))]) == 0
    summary, decision, steps, about, sampling, ratio = capsys.readouterr().out.strip().split("\n\n")
    assert summary == "diffusion-tokens, 2 candidates, 1 thread; medians of 1 runs:"
    assert decision.splitlines()[2].startswith("| circle, 3 objects | ")
    assert [row.split(" | ")[0] for row in steps.splitlines()[3:6]] == ["| sample", "| refine", "| rank"]
    assert about.startswith("circle of 3 objects, 10 samples; the released network without its weights")
    assert [row.split(" | ")[0] for row in sampling.splitlines()[2:]] == [
        "| StructDiffusion, as released",
        "| diffusion-tokens",
        "| diffusion-tokens, the whole decision about 2 candidates",
    ]
    for table in (decision, steps, sampling):  # every row has as many cells as the head
        assert len({row.replace(r"\|", "").count("|") for row in table.splitlines()}) == 1
    assert ratio.startswith("A candidate of the released network takes ")


def test_benchmark_measures_growth(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(growth, "INSTRUCTIONS", (2,))
    monkeypatch.setattr(growth, "in_parallel", lambda *_, **__: iter([0.5]))
    line = ["benchmark", "--model", "geometric", "--runs", "1", "--sweep", str(tmp_path / "s"), "--largest", "3"]
    assert command_line([*line, "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)
    expected = [("candidates", [1]), ("objects", [2, 3]), ("instructions", [2]), ("instructions", [2])]
    assert [(row["size"], row["sizes"]) for row in rows] == expected
    assert json.loads((tmp_path / "s" / "benchmark.json").read_text()) == rows
    assert (tmp_path / "s" / "benchmark.png").read_bytes().startswith(b"\x89PNG")
    tables = growth_tables(rows)
    assert "candidates (a circle of 3 objects)\n\n| candidates | seconds | CPU seconds | MB |" in tables
    assert "objects (a line, 3 candidates): CPU seconds grow with exponent " in tables


def test_benchmark_with_options_that_cannot_be(fails):
    assert "there is no folder nowhere with checkpoints" in fails(6, "benchmark", "--weights", "nowhere")
    assert "and the table has room for" in fails(3, "benchmark", "--objects", "40")
    assert "has no file src/StructDiffusion/models/models.py" in fails(6, "benchmark", "--reference", "nowhere")
    folder = checkout(Path("there"))
    assert "--model geometric has none" in fails(2, "benchmark", "--reference", str(folder), *EXACT)


@pytest.mark.usefixtures("in_this_process")
def test_evaluation_measures_every_model_on_the_same_scenes(objects, tmp_path, capsys):
    arguments = ["evaluate", "success", "--scenes", "1", "--workers", "1", "--candidates", "4", "--top-k", "2"]
    arguments += [*EXACT, "--objects", objects, "--out", str(tmp_path / "new" / "reports")]
    assert command_line(arguments) == 0
    table = capsys.readouterr().out
    report = json.loads((tmp_path / "new" / "reports" / "eval.json").read_text())
    rates = report["evaluations"][0]["aggregate"]
    assert [rates[shape]["n"] for shape in ("circle", "line", "tower", "table setting", "all")] == [1, 1, 1, 1, 4]
    assert (
        0 <= rates["all"]["success"]["low"] <= rates["all"]["success"]["rate"] <= rates["all"]["success"]["high"] <= 1
    )
    assert all(row["words"] for row in report["evaluations"][0]["scenes"])
    shown = [line.split()[0] for line in table.splitlines() if line.startswith("           ")]
    assert "setting" in shown  # below "table", as the table is as wide as it may be
    assert "intersection" in table and report["command"] in table


@pytest.mark.parametrize(
    ("error", "sentence"),
    [
        (MemoryError(), "there is not enough memory"),
        (
            ImportError("libtorch_cpu.so: failed to map segment"),
            "cannot load a library: libtorch_cpu.so: failed to map",
        ),
        (ModuleNotFoundError("No module named 'ompl'", name="ompl"), "cannot load a library: No module named 'ompl'"),
    ],
)
def test_a_machine_that_lacks_something_is_one_sentence(error, sentence, monkeypatch, capsys):
    def fails(**_):
        raise error

    monkeypatch.setattr(cli, "_app_for", lambda arguments: fails)
    assert cli.command_line(["parse", "make a line"]) == 6
    told = capsys.readouterr().err
    assert told.startswith(f"structagent: {sentence}") and told.count("\n") == 1


def test_a_module_of_our_own_that_is_missing_is_a_defect(monkeypatch):
    def fails(**_):
        raise ModuleNotFoundError("No module named 'agent.x'", name="agent.x")

    monkeypatch.setattr(cli, "_app_for", lambda arguments: fails)
    with pytest.raises(ModuleNotFoundError):
        cli.command_line(["parse", "make a line"])
