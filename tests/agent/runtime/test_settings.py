"""The configuration: which layer counts, where a value came from, and errors that name the place."""

import json
import os
import subprocess
import sys
import threading
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path

import pytest
import typer

from agent.cli import app as cli
from agent.cli import options
from agent.cli.config import ConfiguredGroup, config_app, configurable
from agent.runtime import settings


@pytest.fixture(autouse=True)
def elsewhere(tmp_path, monkeypatch):
    """A folder in a folder, and a home, with no configuration but the test's."""
    for name in [*os.environ]:
        if name.startswith(settings.PREFIX) or name in ("XDG_CONFIG_HOME", "OPENAI_API_KEY"):
            monkeypatch.delenv(name)
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    (tmp_path / "project" / "inner").mkdir(parents=True)
    monkeypatch.chdir(tmp_path / "project" / "inner")


@pytest.fixture(autouse=True)
def configured(monkeypatch):
    """The tool's verbs, with their defaults from the configuration."""
    app = typer.Typer(cls=ConfiguredGroup, rich_markup_mode=None, add_completion=False)
    app.callback()(cli._common)
    app.command("run")(cli.run)
    app.command("parse")(cli.parse)
    app.command("generate")(cli.generate)
    app.add_typer(cli.evaluate_app, name="evaluate")
    app.add_typer(config_app, name="config")
    monkeypatch.setattr(cli, "app", app)
    return app


@pytest.fixture
def project(tmp_path) -> Path:
    return tmp_path / "project" / "structagent.toml"


@pytest.fixture
def user(tmp_path) -> Path:
    path = tmp_path / "home" / ".config" / "structagent" / "config.toml"
    path.parent.mkdir(parents=True)
    return path


def shown(capsys) -> dict[str, dict]:
    assert cli.command_line(["config", "show", "--json"]) == 0
    return {row["name"]: row for row in json.loads(capsys.readouterr().out)["settings"]}


def refused(capsys, *arguments: str) -> str:
    assert cli.command_line(list(arguments or ["parse", "make a line"])) == 6
    captured = capsys.readouterr()
    assert captured.out == "" and captured.err.startswith("structagent: ") and captured.err.count("\n") == 1
    return captured.err.removeprefix("structagent: ").rstrip()


def test_environment_before_project_before_user(project, user, monkeypatch, capsys):
    user.write_text('seed = 1\nparser = "llm"\nviewpoint = "opposite"\n')
    project.write_text('# of this project\n\nseed = 2\nparser = "embedding"\n')
    monkeypatch.setenv("STRUCTAGENT_SEED", "3")
    rows = shown(capsys)
    told = {name: (rows[name]["value"], rows[name]["layer"], rows[name]["place"]) for name in rows}
    assert told["seed"] == (3, "environment", "STRUCTAGENT_SEED")
    assert told["parser"] == ("embedding", "project file", f"{project}:4")
    assert told["viewpoint"] == ("opposite", "user file", f"{user}:3")
    assert told["model"] == ("diffusion", "default", None)
    assert {"run", "generate", "evaluate success"} <= set(rows["seed"]["verbs"])


def test_flags_before_everything(project, capsys):
    project.write_text('viewpoint = "opposite"\n')
    sides = []
    for flags in ([], ["--viewpoint", "robot"]):
        assert cli.command_line(["parse", "line up the cups on the left", "--json", *flags]) == 0
        sides.append(json.loads(capsys.readouterr().out)["spec"]["x_position"])
    assert sides == ["right", "left"]


def test_verbs_get_what_is_configured(project, monkeypatch, capsys):
    (project.parent / "meshes").mkdir()
    (project.parent / "desk.yaml").write_text("")
    project.write_text('objects = "meshes"\nmodel = "geometric"\nexecute = false\nworkers = 3\nseed = 7\n')
    taken = {}
    run = lambda text, options, *_, **__: taken.update(run=options) or iter(())  # noqa: E731
    monkeypatch.setattr("agent.pipeline.run.run_instruction", run)
    monkeypatch.setattr("agent.training.generate_data.generate_data", lambda *given: taken.update(generate=given))
    monkeypatch.setattr(
        "agent.evaluation.success.measure.measure_success", lambda *given, **_: taken.update(success=given) or {}
    )
    monkeypatch.setattr("agent.evaluation.success.report.print_success", lambda *_: None)
    cli.command_line(["run", "make a line"])  # comes to no end, and to no exit code that matters here
    assert cli.command_line(["generate", "--out", "data"]) == 0
    assert cli.command_line(["evaluate", "success", "--seed", "8"]) == 0
    run = taken["run"]
    assert (run.objects, run.model, run.execute, run.seed) == (str(project.parent / "meshes"), "geometric", False, 7)
    data, workers, _ = taken["generate"]
    assert (data.objects, data.seed, workers) == ("training", 7, 3)  # what is trained on is another question
    asked, models, *_ = taken["success"]
    assert asked.objects == run.objects and models == ["geometric"] and asked.seed == 8
    assert cli.command_line(["run", "--help"]) == 0
    assert "[default: 7" in capsys.readouterr().out


def test_nearest_project_file(project, tmp_path, capsys):
    project.write_text("seed = 1\n")
    (tmp_path / "structagent.toml").write_text("workers = 5\n")
    rows = shown(capsys)
    assert rows["seed"]["value"] == 1 and rows["workers"]["layer"] == "default"


def test_xdg_config_home(tmp_path, monkeypatch, capsys):
    (tmp_path / "xdg" / "structagent").mkdir(parents=True)
    (tmp_path / "xdg" / "structagent" / "config.toml").write_text("seed = 4\n")
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "xdg"))
    assert shown(capsys)["seed"]["value"] == 4
    monkeypatch.setenv("XDG_CONFIG_HOME", "../../xdg")  # relative: to be ignored
    assert shown(capsys)["seed"]["value"] == 0


@pytest.mark.parametrize(
    ("text", "line", "parts"),
    [
        ("seed = 1\n\nsed = 2\n", 3, ("unknown key sed", "did you mean seed?", "legal: scene, objects")),
        ("seed = 1\n[evaluate]\nworkers = 2\n", 2, ("unknown key evaluate",)),
        ("workers = 1\nseed = 'many'\n", 2, ("seed cannot be 'many'", "a whole number from 0 to 9223372036854775807")),
        ("seed = true\n", 1, ("seed cannot be True",)),
        ("seed = 1.5\n", 1, ("seed cannot be 1.5",)),
        ("seed = -1\n", 1, ("seed cannot be -1",)),
        ("seed = 9223372036854775808\n", 1, ("seed cannot be 9223372036854775808", "to 9223372036854775807")),
        ("workers = 0\n", 1, ("workers cannot be 0", "from 1 to 1024")),
        ("workers = 100000\n", 1, ("workers cannot be 100000", "from 1 to 1024")),
        ("workers = inf\n", 1, ("workers cannot be inf",)),
        ("seed = 1979-05-27\n", 1, ("seed cannot be this",)),
        ("seed = [3]\n", 1, ("seed cannot be this",)),
        ("scene = 3\n", 1, ("scene cannot be 3",)),
        ("scene = 'a\\0b'\n", 1, ("scene cannot be",)),
        ('scene = "a\\u0000b"\n', 1, ("scene cannot be",)),
        (f"objects = '{'a/' * 3000}'\n", 1, ("objects cannot be 'a/", "...; legal")),
        ('llm_model = "a\\nb"\n', 1, ("llm_model cannot be 'a\\nb'",)),
        ("llm_model = ' '\n", 1, ("llm_model cannot be",)),
        ('llm_url = "http://127.0.0.1/v1\\nx"\n', 1, ("llm_url cannot be this", "http or https")),
        ("llm_url = 'http://127.0.0.1:99999/v1'\n", 1, ("llm_url cannot be this",)),
        ("execute = 'no'\n", 1, ("execute cannot be 'no'", "true, false")),
        ("# who\nparser = 'psychic'\n", 2, ("'psychic'", "embedding, llm")),
        ("viewpoint = 'above'\n", 1, ("'above'", "robot, opposite")),
        ("model = 'oracle'\n", 1, ("'oracle'", "diffusion, diffusion-tokens, geometric")),
        ("objects = 'ybc'\n", 1, ("'ybc'", "ycb")),
        ("weights = 'nowhere'\n", 1, ("'nowhere'", "existing folder")),
        ("scene = 'desk.yaml'\n", 1, ("'desk.yaml'", "simulated")),
        ("llm_url = 'ftp://x'\n", 1, ("llm_url", "http or https")),
        ("llm_url = 'http://[1'\n", 1, ("llm_url", "http or https")),
        ("seed = 1\nparser = \n", 2, ("nvalid value",)),
        ("seed = 1\nseed = 2\n", 2, ("overwrite",)),
        ("\n\"seed\" = 'x'\n", 2, ("seed",)),
        ("seed.key = 'hunter2'\n", 1, ("seed cannot be this",)),
    ],
)
@pytest.mark.parametrize("layer", ["project", "user"])
def test_errors_name_file_and_line(layer, text, line, parts, request, capsys):
    path = request.getfixturevalue(layer)
    path.write_text(text)
    sentence = refused(capsys)
    assert sentence.startswith(f"{path}:{line}: "), sentence
    assert all(part in sentence for part in parts), sentence


def test_a_file_that_is_no_text(project, capsys):
    project.write_bytes(b"seed = 1\nparser = '\xff'\n")
    assert refused(capsys) == f"{project}:2: this is not UTF-8 text"


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("x = " + "[" * 50_000, "recursion"),
        ("seed = 1" + "0" * 10_000, "Exceeds the limit"),
        ("x = [" + "1," * 60_000 + "]", "it has more than 100000 bytes, and no more are read"),
    ],
)
def test_a_file_that_is_made_to_hurt(text, why, project, capsys):
    project.write_text(text)
    sentence = refused(capsys)
    assert sentence.startswith(f"{project} cannot be read: ") and why in sentence


def test_every_verb_refuses_a_broken_file_and_still_helps(project, capsys):
    project.write_text("sed = 1\n")
    assert f"{project}:1" in refused(capsys, "run", "make a line")
    assert cli.command_line(["run", "--help"]) == 0
    assert cli.command_line(["--help"]) == 0


@pytest.mark.parametrize(
    ("variable", "value", "parts"),
    [
        ("STRUCTAGENT_SEED", "many", ("STRUCTAGENT_SEED cannot be 'many'", "whole number")),
        ("STRUCTAGENT_SEED", "-1", ("STRUCTAGENT_SEED cannot be -1",)),
        ("STRUCTAGENT_SEED", str(2**63), (f"STRUCTAGENT_SEED cannot be {2**63}",)),
        ("STRUCTAGENT_WORKERS", "9999", ("STRUCTAGENT_WORKERS cannot be 9999", "from 1 to 1024")),
        ("STRUCTAGENT_SED", "1", ("STRUCTAGENT_SED", "did you mean STRUCTAGENT_SEED?")),
        ("STRUCTAGENT_EXECUTE", "perhaps", ("'perhaps'", "true, false")),
        ("STRUCTAGENT_PARSER", "psychic", ("'psychic'", "embedding, llm")),
        ("STRUCTAGENT_OPENAI_KEY", "sk-1", ("STRUCTAGENT_OPENAI_KEY", "STRUCTAGENT_LLM_KEY")),
    ],
)
def test_variables_that_are_wrong(variable, value, parts, monkeypatch, capsys):
    monkeypatch.setenv(variable, value)
    sentence = refused(capsys)
    assert all(part in sentence for part in parts), sentence
    assert "sk-1" not in sentence


@pytest.mark.parametrize(("text", "value"), [("no", False), ("TRUE", True), ("0", False), ("", True), (" on ", True)])
def test_switches_in_the_environment(text, value, monkeypatch, capsys):
    monkeypatch.setenv("STRUCTAGENT_EXECUTE", text)
    assert shown(capsys)["execute"]["value"] is value


@pytest.mark.parametrize("key", ["llm_key", "api_token", "LLM_PASSWORD", "openai-key"])
def test_secrets_are_refused_and_not_repeated(key, project, capsys):
    project.write_text(f'seed = 1\n{key} = "hunter2"\n')
    sentence = refused(capsys)
    assert f"{project}:2" in sentence and "STRUCTAGENT_LLM_KEY" in sentence and "hunter2" not in sentence


def test_the_key_is_told_to_be_set_and_nothing_else(monkeypatch, capsys):
    monkeypatch.setenv("STRUCTAGENT_LLM_KEY", "hunter2")
    for arguments in (["config", "show"], ["config", "show", "--json"]):
        assert cli.command_line(arguments) == 0
        told = capsys.readouterr().out
        assert "set, hidden" in told and "STRUCTAGENT_LLM_KEY" in told and "hunter2" not in told


@pytest.mark.parametrize("url", ["http://me:hunter2@127.0.0.1/v1", "http://127.0.0.1/v1?key=hunter2"])
def test_addresses_carry_no_secrets(url, project, monkeypatch, capsys):
    monkeypatch.setenv("STRUCTAGENT_LLM_URL", url)
    assert "hunter2" not in refused(capsys)
    monkeypatch.delenv("STRUCTAGENT_LLM_URL")
    project.write_text(f'llm_url = "{url}"\n')
    assert "hunter2" not in refused(capsys)


def test_a_project_cannot_have_the_key_sent_elsewhere(project, user, capsys):
    for here in ("http://localhost:8080/v1", "http://127.0.0.1/v1", "http://[::1]:1/v1"):
        project.write_text(f'llm_url = "{here}"\n')
        assert shown(capsys)["llm_url"]["value"] == here
    for there in ("https://example.org/v1", "http://127.0.0.1.example.org/v1", "http://localhost.example.org"):
        project.write_text(f'llm_url = "{there}"\n')
        assert f"{project}:1" in refused(capsys)
        project.unlink()
        user.write_text(f'llm_url = "{there}"\n')
        assert shown(capsys)["llm_url"]["value"] == there


def test_a_project_that_is_trusted_names_endpoints_and_model_folders(project, capsys):
    (project.parent / "own").mkdir()
    for line in ('llm_url = "https://example.org/v1"', 'llm_model = "own"'):
        project.write_text(line + "\n")
        assert "structagent --trust-project VERB" in refused(capsys)
        assert cli.command_line(["--trust-project", "config", "show", "--json"]) == 0
        told = {row["name"]: row for row in json.loads(capsys.readouterr().out)["settings"]}
        name = line.split()[0]
        assert told[name]["layer"] == "project file" and told[name]["value"] is not None


@pytest.mark.parametrize(
    "folder", ["own", "./own", "../project/own", "./made_later", "~/own", "~", "/usr", "mine", "org/own", "."]
)
@pytest.mark.parametrize("arguments", [["parse", "a tower"], ["run", "a tower"]])
def test_a_project_cannot_name_the_folder_of_a_model(folder, arguments, project, tmp_path, capsys):
    """Not seen from the file, and not seen from the current folder, from which a name is looked up."""
    (project.parent / "own").mkdir()
    (project.parent / "inner" / "mine").mkdir()
    (project.parent / "inner" / "org" / "own").mkdir(parents=True)
    project.write_text(f'seed = 1\nllm_model = "{folder}"\n')
    sentence = refused(capsys, *arguments)
    assert sentence.startswith(f"{project}:2: llm_model of a project cannot be a folder")


@pytest.fixture
def outside(project, tmp_path):
    """A folder outside the project with meshes, a scene and checkpoints, and links to it inside the project."""
    for folder in (tmp_path / "outside", project.parent / "own"):
        folder.mkdir()
        (folder / "desk.yaml").write_text("")
    (project.parent / "link").symlink_to(tmp_path / "outside")
    (project.parent / "link.yaml").symlink_to(tmp_path / "outside" / "desk.yaml")
    (tmp_path / "home").mkdir(exist_ok=True)
    return tmp_path / "outside"


@pytest.mark.parametrize(
    ("line", "may"),
    [
        ("objects = 'own'", True), ("objects = 'inner/../own'", True), ("objects = 'blocks'", True),
        ("objects = '../outside'", False), ("objects = '{outside}'", False), ("objects = 'link'", False),
        ("objects = '~'", False), ("objects = '/'", False), ("objects = '..'", False), ("objects = 'own/../..'", False),
        ("scene = 'own/desk.yaml'", True), ("scene = 'simulated'", True), ("scene = 'example'", True),
        ("scene = '../outside/desk.yaml'", False), ("scene = '{outside}/desk.yaml'", False),
        ("scene = 'link/desk.yaml'", False), ("scene = 'link.yaml'", False), ("scene = '/dev/zero'", False),
        ("weights = 'own'", False), ("weights = '{outside}'", False), ("llm_model = 'own'", False),
        ("llm_model = 'org/name'", True), ("seed = 3", True), ("execute = false", True), ("workers = 2", True),
    ],
)  # fmt: skip
def test_what_a_project_may_decide(line, may, project, outside, capsys):
    project.write_text(f"# mine\n{line.format(outside=outside)}\n")
    name = line.split()[0]
    if may:
        assert shown(capsys)[name]["layer"] == "project file"
        return
    sentence = refused(capsys)
    assert sentence.startswith(f"{project}:2: {name} of a project cannot be ")
    assert f"STRUCTAGENT_{name.upper()}" in sentence and "structagent --trust-project VERB" in sentence
    assert cli.command_line(["--trust-project", "config", "show", "--json"]) == 0
    told = {row["name"]: row for row in json.loads(capsys.readouterr().out)["settings"]}
    assert told[name]["layer"] == "project file"


@pytest.mark.parametrize("line", ["objects = '{outside}'", "scene = '{outside}/desk.yaml'", "weights = '{outside}'"])
def test_the_user_may_decide_everything(line, user, outside, capsys):
    user.write_text(line.format(outside=outside) + "\n")
    assert shown(capsys)[line.split()[0]]["layer"] == "user file"


def test_every_setting_of_a_path_says_what_a_project_may_do():
    """A new setting that takes a path must not be forgotten."""
    free = {setting.name for setting in settings.SETTINGS if not any((
        setting.forbidden("/", Path("/nowhere")), setting.forbidden("https://example.org", Path("/nowhere"))
    ))}  # fmt: skip
    assert free == {"model", "seed", "parser", "viewpoint", "execute", "workers"}


def test_config_show_works_with_bad_files_and_says_what_is_wrong(project, user, monkeypatch, capsys):
    user.write_text("seed = 4\nworkers = 0\n")
    project.write_text("sed = 1\nviewpoint = 'opposite'\nweights = '/'\nparser = 3\n")
    monkeypatch.setenv("STRUCTAGENT_EXECUTE", "perhaps")
    assert cli.command_line(["config", "show", "--json"]) == 6
    said = capsys.readouterr()
    told = json.loads(said.out)
    rows = {row["name"]: row for row in told["settings"]}
    assert (rows["seed"]["value"], rows["viewpoint"]["value"]) == (4, "opposite")
    assert all(rows[name]["layer"] == "default" for name in ("workers", "weights", "parser", "execute"))
    starts = [f"{user}:2: workers", f"{project}:1: unknown key sed", f"{project}:3: weights of a project",
              f"{project}:4: parser cannot be 3", "STRUCTAGENT_EXECUTE cannot be"]  # fmt: skip
    assert len(told["problems"]) == len(starts) == said.err.count("structagent: ")
    assert all(problem.startswith(start) for problem, start in zip(told["problems"], starts))
    project.write_bytes(b"\xff")
    assert cli.command_line(["config", "show"]) == 6
    said = capsys.readouterr()
    assert "seed" in said.out and f"{project}:1: this is not UTF-8 text" in said.err


def test_users_name_model_folders(project, user, monkeypatch, capsys):
    (user.parent / "own").mkdir()
    user.write_text('llm_model = "own"\n')
    assert shown(capsys)["llm_model"]["value"] == str(user.parent / "own")
    monkeypatch.setenv("STRUCTAGENT_LLM_MODEL", "..")  # before the project's, which then counts for nothing
    project.write_text('llm_model = "org/name"\n')
    assert Path(shown(capsys)["llm_model"]["value"]).samefile("..")


@pytest.fixture
def endpoint():
    """A language model that reads everything as a tower; its address, and the keys that it was sent."""
    keys: list[str | None] = []
    said = {"decision": "build", "goal": {"parts": [{"kind": "structure", "shape": "tower", "objects": ["the cans"]}]}}
    answer = json.dumps({"choices": [{"message": {"content": json.dumps(said)}}]}).encode()

    class Answers(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            self.rfile.read(int(self.headers["Content-Length"]))
            keys.append(self.headers["Authorization"])
            self.send_response(200)
            self.end_headers()
            self.wfile.write(answer)

        def log_message(self, *_: object) -> None:
            pass

    with HTTPServer(("127.0.0.1", 0), Answers) as here:
        threading.Thread(target=here.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{here.server_port}/v1", keys
        here.shutdown()


@pytest.mark.parametrize(
    ("layers", "sent"),
    [
        ({"project"}, False),
        ({"project", "trusted"}, False),
        ({"user"}, True),
        ({"environment"}, True),
        ({"flag"}, True),
        ({"project", "flag"}, True),
        ({"project", "environment"}, True),
        ({"project", "user"}, False),  # the project's address counts, although it is the same
    ],
    ids=lambda value: "-".join(sorted(value)) if isinstance(value, set) else "",
)
def test_the_key_is_sent_to_the_host_that_the_user_named(layers, sent, endpoint, project, user, monkeypatch, capsys):
    address, keys = endpoint
    monkeypatch.setenv("STRUCTAGENT_LLM_KEY", "hunter2")
    for path in ({"project": project, "user": user}[layer] for layer in layers & {"project", "user"}):
        path.write_text(f'llm_url = "{address}"\n')
    if "environment" in layers:
        monkeypatch.setenv("STRUCTAGENT_LLM_URL", address)
    arguments = ["--trust-project"] if "trusted" in layers else []
    arguments += ["parse", "stack the cans", "--parser", "llm", "--json"]
    arguments += ["--llm-url", address] if "flag" in layers else []
    assert cli.command_line(arguments) == 0
    assert json.loads(capsys.readouterr().out)["parser"] == "llm"
    assert keys == ["Bearer hunter2" if sent else None]


def test_paths_start_from_the_file(project, user, tmp_path, monkeypatch, capsys):
    (project.parent / "runs").mkdir()
    (project.parent / "desk.yaml").write_text("")
    (tmp_path / "home" / "meshes").mkdir(parents=True)
    (user.parent / "runs").mkdir()
    project.write_text('scene = "desk.yaml"\nllm_model = "org/name"\n')
    user.write_text('weights = "runs"\nobjects = "~/meshes"\n')
    rows = shown(capsys)
    assert rows["weights"]["value"] == str(user.parent / "runs")
    assert rows["scene"]["value"] == str(project.parent / "desk.yaml")
    assert rows["objects"]["value"] == str(tmp_path / "home" / "meshes")
    assert rows["llm_model"]["value"] == "org/name"
    monkeypatch.setenv("STRUCTAGENT_WEIGHTS", "../runs")
    assert Path(shown(capsys)["weights"]["value"]).samefile(project.parent / "runs")


def test_show_for_people(project, capsys):
    project.write_text("seed = 12\n")
    assert cli.command_line(["config", "show"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines[:3]] == ["scene", "objects", "model"]
    start = next(number for number, line in enumerate(lines) if line.startswith("seed "))
    shown = "".join("".join(line.split()) for line in lines[start:])  # a long path goes over several lines
    assert shown.startswith(f"seed12projectfile:{project}:1")
    assert any(line.startswith("user file:") and line.endswith("(does not exist)") for line in lines)


def test_legal_values_are_those_of_the_flags(configured):
    from structdiffusion.objects import libraries
    from structdiffusion.planners.registry import LEGAL_NAMES

    legal = {setting.name: setting.legal for setting in settings.SETTINGS}
    assert legal["model"] == LEGAL_NAMES
    assert legal["parser"] == ", ".join(entry.value for entry in options.Parsers)
    assert legal["viewpoint"] == ", ".join(entry.value for entry in options.Viewpoint)
    known = next(value for value in vars(libraries).values() if isinstance(value, dict) and "random_urdfs" in value)
    assert set(settings.LIBRARIES) == set(known)
    found = {option.name for _, option in configurable(typer.main.get_command(configured))}
    assert found == set(legal)


def test_nothing_heavy_is_needed():
    program = (
        "import sys; sys.modules.update(typer=None, numpy=None); from agent.runtime import configuration; "
        "configuration.load()"
    )
    subprocess.run([sys.executable, "-c", program], cwd=Path(cli.__file__).parents[2], check=True)
