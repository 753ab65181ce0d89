"""The doctor: what it says of an environment that works, and of one in which packages crash, hang or are missing."""

import base64
import hashlib
import json
import os
import re
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import pytest
import typer

from agent.cli import app as cli
from agent.cli.doctor import doctor
from agent.diagnostics.doctor import PYTHON, examine, exit_code
from agent.diagnostics.installation import changed_files
from agent.diagnostics.requirements import ROOT, Requirement, required
from agent.diagnostics.subprocess_worker import Outcome, carry_out
from grounding.goals.goal import Goal
from tests.grounding.language_model.oracle import Oracle, OracleRow, completion, serving_oracle

OUTCOMES: dict[str, Outcome] = {}  # of probes that no test of this module can change
CRASH = "import os, signal; os.kill(os.getpid(), signal.SIGSEGV)"
LIMIT = 6.0  # s, for one import of a few lines: long enough for those that work, however busy the machine is
LIBRARY = "raise ImportError('libgomp.so.1: cannot open shared object file: No such file or directory')"


@pytest.fixture(autouse=True)
def unconfigured(tmp_path, monkeypatch):
    for name in [*os.environ]:
        if name.startswith("STRUCTAGENT_") or name in ("XDG_CONFIG_HOME", "OPENAI_API_KEY"):
            monkeypatch.delenv(name)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def command(monkeypatch):
    app = typer.Typer(rich_markup_mode=None, add_completion=False)
    app.callback()(lambda: None)  # as the product has one
    app.command("doctor")(doctor)
    app.command("parse")(cli.parse)
    monkeypatch.setattr(cli, "app", app)
    return cli.command_line


@pytest.fixture
def modules(tmp_path, monkeypatch):
    """Puts modules in front of those that are installed."""
    folder = tmp_path / "modules"
    folder.mkdir()
    monkeypatch.syspath_prepend(str(folder))

    def write(**sources: str) -> Path:
        for name, source in sources.items():
            (folder / f"{name}.py").write_text(source + "\n")
        return folder

    return write


@pytest.fixture
def once(monkeypatch):
    """Carries out each probe once for all tests that take this: importing all packages takes 7 s.

    A probe is its task alone, so a test may take this if it changes nothing that a task uses but does not name.
    """

    def remembered(tasks: Sequence[str], seconds: float) -> Iterator[Outcome]:
        new = [task for task in tasks if task not in OUTCOMES]
        OUTCOMES.update(zip(new, carry_out(new, seconds), strict=True))
        return iter([OUTCOMES[task] for task in tasks])

    monkeypatch.setattr("agent.diagnostics.doctor.carry_out", remembered)


def test_everything_works_here(once, command, capsys):
    code = command(["doctor", "--json"])
    told = json.loads(capsys.readouterr().out)
    broken = [check for check in told["checks"] if check["needed"] and not check["works"]]
    assert code == 0 and told["exit_code"] == 0 and not broken
    names = {check["name"] for check in told["checks"]}
    assert {entry.name for entry in required() if not entry.extra} <= names
    assert {"python", "configuration", "diffusion", "structure", "collision", "sentence encoder", "parser"} <= names
    assert {"local model", "physics", "objects", "gpu", "ray", "cache", "terminal"} <= names
    assert all(bool(check["repair"]) != check["works"] for check in told["checks"])


def test_a_crash_a_hang_and_an_exit_cost_only_themselves(modules):
    modules(
        crashes=CRASH,
        hangs="import time; time.sleep(600)",
        ends="import os; os._exit(3)",
        leaves="raise SystemExit('I do not like it here')",
        prints="import os; os.write(1, b'{}\\n'); print('hello')",
        wants_crash="import crashes",
        lacks="import nowhere.near",
        lacks_library=LIBRARY,
        sound="",
    )
    names = ["crashes", "hangs", "ends", "leaves", "prints", "wants_crash", "lacks", "lacks_library", "sound"]
    outcomes = dict(zip(names, carry_out([f"import {name}" for name in names], LIMIT), strict=True))
    assert [name for name in names if outcomes[name].works] == ["prints", "sound"]
    assert [name for name in names if outcomes[name].crashed] == ["crashes", "hangs", "ends"]
    assert "SIGSEGV" in outcomes["crashes"].said and "6 s" in outcomes["hangs"].said
    assert "exit code 3" in outcomes["ends"].said and "I do not like it here" in outcomes["leaves"].said
    assert outcomes["wants_crash"].said == "crashes, which it needs, does not work"
    assert outcomes["lacks"].absent == "nowhere" and outcomes["lacks_library"].absent == "libgomp.so.1"


def test_no_process_is_left_behind(modules, tmp_path):
    modules(hangs=f"import os, time; open({str(tmp_path / 'pid')!r}, 'w').write(str(os.getpid())); time.sleep(600)")
    assert not next(carry_out(["import hangs", "import json"], LIMIT)).works
    with pytest.raises(ProcessLookupError):
        os.kill(int((tmp_path / "pid").read_text()), 0)


def test_half_of_the_packages_are_broken(modules):
    folder = modules(pybullet=CRASH, torch=LIBRARY, rich="raise RuntimeError('broken')", scipy="import nowhere")
    modules(typer="raise ImportError('no typer today')", httpx="import os; os._exit(1)")
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(folder), str(ROOT)])}
    done = subprocess.run(
        [sys.executable, "-m", "agent", "doctor", "--json"], env=environment, capture_output=True, text=True
    )
    told = {check["name"]: check for check in json.loads(done.stdout)["checks"]}
    assert done.returncode == 6 and "Traceback" not in done.stderr
    pip = f"{sys.executable} -m pip install"
    assert "SIGSEGV" in told["pybullet"]["detail"]
    assert re.fullmatch(re.escape(pip) + r" --force-reinstall 'pybullet>=[\d.]+'", told["pybullet"]["repair"])
    assert told["torch"]["repair"] == "apt-get install libgomp1" == told["diffusion"]["repair"]
    assert "RuntimeError: broken" in told["rich"]["detail"] and "no typer today" in told["typer"]["detail"]
    assert "nowhere" in told["scipy"]["detail"] and "exit code 1" in told["httpx"]["detail"]
    assert told["physics"]["detail"] == "pybullet, which it needs, does not work"
    assert told["physics"]["repair"] == told["pybullet"]["repair"]
    assert all(told[name]["works"] for name in ("python", "numpy", "trimesh", "structagent", "configuration"))
    start = subprocess.run([sys.executable, "-m", "agent", "run", "x"], env=environment, capture_output=True, text=True)
    assert start.returncode == 6 and start.stderr.count("\n") == 1 and "structagent doctor" in start.stderr


def test_a_package_that_is_missing_or_too_old(tmp_path):
    (tmp_path / "pyproject.toml").write_text(
        '[project]\ndependencies = ["numpy>=99", "no-such-package[a]>=1,<2; python_version > \'3\'", "pillow"]\n'
        '[project.optional-dependencies]\ntest = ["nothing"]\nray = ["ray[default]>=2"]\n'
    )
    checks = {check.name: check for check in examine(60.0, tmp_path)}
    assert exit_code(list(checks.values())) == 6 and "nothing" not in checks
    assert "required >=99" in checks["numpy"].detail and "'numpy>=99'" in checks["numpy"].repair
    missing = checks["no-such-package"]
    assert missing.detail == "not installed" and "'no-such-package>=1,<2'" in missing.repair
    assert checks["pillow"].works and not checks["ray"].needed
    assert not checks["diffusion"].works and "config.json" in checks["diffusion"].detail


@pytest.mark.parametrize("name", ["config.json", "model.safetensors"])
def test_weights_that_are_damaged(once, name, tmp_path, monkeypatch):
    shutil.copytree(ROOT / "structdiffusion" / "weights", tmp_path / "own")
    path = tmp_path / "own" / "structure" / name
    path.write_bytes(path.read_bytes()[:-50])
    monkeypatch.setenv("STRUCTAGENT_WEIGHTS", str(tmp_path / "own"))
    checks = {check.name: check for check in examine()}
    assert checks["diffusion"].works and checks["collision"].works and exit_code(list(checks.values())) == 6
    assert str(path) in checks["structure"].detail and str(tmp_path / "own") in checks["structure"].repair


def test_a_broken_configuration_is_one_check_of_many(once, tmp_path, command, capsys):
    (tmp_path / "structagent.toml").write_text("sed = 1\n")
    assert command(["doctor"]) == 6
    captured = capsys.readouterr()
    shown = "".join(captured.out.split())  # a long path goes over several lines
    assert f"FAILconfiguration{tmp_path / 'structagent.toml'}:1:unknownkeysed" in shown
    assert captured.out.rstrip().splitlines()[-1].startswith("configuration: required, but does not work")
    assert "  ok    diffusion" in captured.out and "\x1b" not in captured.out


SENTENCE = OracleRow(
    "put the cups in a small circle on the left", None, Goal(), "build",
    Goal.from_dict({"parts": [
        {"kind": "structure", "shape": "circle", "size": "small", "x_position": "left", "objects": [2, 0, 1]}
    ]}),
)  # fmt: skip


class Keeper(Oracle):
    """A model that answers whoever has the key "hunter2"."""

    row = SENTENCE

    def answer(self, body, headers):
        if headers["Authorization"] != "Bearer hunter2":
            return 401, {}
        return completion(self.row) if self.takes_schema or "response_format" not in body else (400, {})


def asked(task):
    (outcome,) = carry_out([task], 60.0)
    return outcome.works, outcome.said


def test_endpoint(monkeypatch):
    with serving_oracle(Keeper([])) as oracle:
        works, said = asked(f"endpoint {oracle.url}")
        assert not works and "requires a valid key (status 401)" in said
        monkeypatch.setenv("STRUCTAGENT_LLM_KEY", "hunter3")
        works, said = asked(f"endpoint {oracle.url}")
        assert not works and "requires a valid key" in said and "hunter" not in said
        monkeypatch.setenv("STRUCTAGENT_LLM_KEY", "hunter2")
        assert not asked(f"keyless-endpoint {oracle.url}")[0]
        works, said = asked(f"endpoint {oracle.url}/chat/completions some-model")
        shown = f"some-model at {oracle.url}/chat/completions reads 'put the cups in a small circle on the left'"
        assert works and re.fullmatch(re.escape(shown) + r" with the JSON schema in \d+\.\d s", said)
        oracle.takes_schema = False
        works, said = asked(f"endpoint {oracle.url}")
        assert works and "default at " in said and "without the JSON schema, which it refuses" in said
        oracle.row = replace(SENTENCE, decision="refuse", goal=None)
        works, said = asked(f"endpoint {oracle.url}")
        assert not works and said.endswith("as 'refuse: This cannot be done.'")
    works, said = asked("endpoint http://127.0.0.1:1/v1")
    assert not works and "could not be reached" in said


@pytest.mark.parametrize(("parser", "code"), [("embedding", 0), ("llm", 6)])
def test_an_endpoint_is_needed_where_it_reads(once, parser, code, monkeypatch):
    monkeypatch.setenv("STRUCTAGENT_LLM_URL", "http://127.0.0.1:1/v1")
    monkeypatch.setenv("STRUCTAGENT_PARSER", parser)
    checks = list(examine())
    assert not next(check for check in checks if check.name == "endpoint").works and exit_code(checks) == code


def test_installed_files_are_held_to_their_checksums(tmp_path, monkeypatch):
    (tmp_path / "agent").mkdir()
    about = tmp_path / "structagent-9.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: structagent\nVersion: 9.0\n")
    record = []
    for name in ("weights.bin", "sound.bin", "gone.bin"):
        (tmp_path / "agent" / name).write_bytes(name.encode())
        digest = base64.urlsafe_b64encode(hashlib.sha256(name.encode()).digest()).rstrip(b"=").decode()
        record.append(f"agent/{name},sha256={digest},{len(name)}\n")
    (about / "RECORD").write_text("".join(record))
    (about / "direct_url.json").write_text('{"url": "file:///somewhere", "dir_info": {}}')
    monkeypatch.syspath_prepend(str(tmp_path))
    assert changed_files(tmp_path) == (3, [])
    (tmp_path / "agent" / "weights.bin").write_bytes(b"other")
    (tmp_path / "agent" / "gone.bin").unlink()
    assert changed_files(tmp_path) == (3, ["agent/weights.bin", "agent/gone.bin"])
    check = next(check for check in examine(root=tmp_path) if check.name == "structagent")
    assert not check.works and "agent/weights.bin" in check.detail
    assert check.repair.endswith("--force-reinstall --no-deps file:///somewhere")


def prompt_check(root):
    """The check of the prompt of slots, among those of all prompts; what is checked after it is not begun."""
    prompts = (check for check in examine(root=root) if check.name == "prompt")
    return next(check for check in prompts if "parse_structure.txt" in check.detail)


@pytest.mark.parametrize("parser", ["embedding", "llm"])
def test_a_prompt_that_is_not_the_shipped_one(parser, tmp_path, monkeypatch):
    """The language model would read something else, and nothing would say so."""
    monkeypatch.setenv("STRUCTAGENT_PARSER", parser)
    shutil.copytree(ROOT / "prompts", tmp_path / "prompts")
    path = tmp_path / "prompts" / "parse_structure.txt"
    path.write_bytes(path.read_bytes().replace(b"\n", b"\r\n"))  # as a checkout on Windows has it
    assert prompt_check(tmp_path).works and "as shipped" in prompt_check(tmp_path).detail
    for changed in (path.read_bytes() + b"x", path.read_bytes().replace(b"circle", b"line", 1), b"\xff", None):
        path.unlink()
        if changed is not None:
            path.write_bytes(changed)
        check = prompt_check(tmp_path)
        assert not check.works and check.needed is (parser == "llm") and "parse_structure.txt" in check.detail
        path.touch()


@pytest.mark.parametrize(
    ("bounds", "version", "allowed"),
    [
        ("", "1", True),
        (">=2.6,<2.14", "2.13.0+cpu", True),
        (">=2.6,<2.14", "2.14.0", False),
        (">=2.6,<2.14", "2.6rc1", True),
        (">=2.6,<2.14", "2.10", True),
        ("==1.2", "1.2.0", True),
        ("!=1.2", "1.2", False),
        ("~=1.4.2", "1.4.9", True),
        ("~=1.4.2", "1.5", False),
        (">1,<=3", "3.0.0", True),
    ],
)
def test_versions(bounds, version, allowed):
    assert Requirement("x", bounds).allows(version) is allowed


def test_the_python_that_is_asked_for():
    assert tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["requires-python"] == PYTHON.bounds


def test_what_another_machine_needs_is_not_asked_for_here(tmp_path, monkeypatch):
    here = "platform_system == 'Linux' and platform_machine == 'x86_64'"
    elsewhere = "platform_system != 'Linux' or platform_machine != 'x86_64'"
    told = f"""dependencies = ["small>=1; {here}", "large>=1; {elsewhere}", "any; python_version > '3'"]"""
    (tmp_path / "pyproject.toml").write_text(f"[project]\n{told}\n")
    for system, machine, names in (
        ("Linux", "x86_64", ["small", "any"]),
        ("Linux", "aarch64", ["large", "any"]),
        ("Darwin", "x86_64", ["large", "any"]),
    ):
        monkeypatch.setattr("platform.system", lambda system=system: system)
        monkeypatch.setattr("platform.machine", lambda machine=machine: machine)
        assert [entry.name for entry in required(tmp_path)] == names
