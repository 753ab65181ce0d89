"""The reference says what the commands say, and the shipped file is the reference."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from agent import errors
from agent.cli import reference
from agent.runtime.settings import SETTINGS

ROOT = Path(__file__).parents[3]


def section(text: str, name: str) -> str:
    return text.split(f"\n## {name}\n")[1].split("\n## ")[0]


def test_shipped_reference_has_not_drifted():
    """After a change of the commands: python -m agent.cli.reference"""
    assert reference.FILE.read_text(encoding="utf-8") == reference.reference()


def test_a_command_has_synopsis_description_options_and_example():
    text = section(reference.reference(), "structagent generate")
    assert "```\nstructagent generate [OPTIONS] --out DIR\n```" in text
    assert "Scenes are arranged by the geometric planner" in text
    assert "- `--out DIR`: Folder for the data; finished shards in it are kept. Required." in text
    assert "At least 0. Default: `0`. Environment: `STRUCTAGENT_SEED`." in text
    assert "Worker processes; by default one per core of this machine or the cluster." in text
    assert "Default: the number of cores." in section(reference.reference(), "structagent evaluate coverage")
    assert "STRUCTAGENT_OBJECTS" not in text  # its objects are others than the setting's
    assert "```sh\nstructagent generate --out data/train" in text


def test_arguments_choices_switches_and_nested_commands():
    text = reference.reference()
    assert "structagent parse [OPTIONS] [TEXT...]\n" in text and "structagent run [OPTIONS] TEXT\n" in text
    assert "- `--execute, --no-execute`: " in section(text, "structagent run")
    assert "- `--shape circle|line|tower|table setting|cluster|" in section(text, "structagent scene new")
    group, command = section(text, "structagent evaluate"), section(text, "structagent evaluate success")
    assert "- [`structagent evaluate arm`](#structagent-evaluate-arm): Measure how often" in group
    assert "and the baselines and ablations (see `structagent models list`). Repeatable." in command
    other = section(text, "structagent train cvae")  # the same options as the command before
    assert "**Options**: those of [`structagent train diffusion`](#structagent-train-diffusion).\n" in other
    assert "--device" in section(text, "structagent train diffusion") and "--device" not in other
    assert "```\nversion: 1 " in section(text, "structagent scene")  # the schema as it is laid out


def test_exit_codes_and_variables_are_all_there():
    text = reference.reference()
    codes = {value for name, value in vars(errors).items() if name.isupper() and isinstance(value, int)}
    assert codes == {int(code) for code in re.findall(r"^\| (\d+) \|", section(text, "Exit codes"), re.MULTILINE)}
    assert all(f"`{setting.variable}`" in section(text, "Environment") for setting in SETTINGS)


def test_same_on_every_machine(tmp_path):
    """Other cores, another width, another configuration, another folder: the same text."""
    program = "import os; os.cpu_count = lambda: 37; from agent.cli.reference import reference; print(end=reference())"
    environment = {**os.environ, "COLUMNS": "40", "STRUCTAGENT_SEED": "5", "PYTHONPATH": str(ROOT), "TERM": "dumb"}
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=tmp_path, env=environment, capture_output=True, text=True, check=True
    )
    assert done.stdout == reference.reference()


def test_check_tells_what_drifted(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(reference, "FILE", tmp_path / "cli.md")
    assert reference.main(["--check"]) == 1
    assert reference.main([]) == 0
    capsys.readouterr()
    assert reference.main(["--check"]) == 0 and capsys.readouterr().err == ""
    reference.FILE.write_text(reference.FILE.read_text().replace("`--seed SEED`", "`--sed SEED`", 1))
    assert reference.main(["--check"]) == 1
    told = capsys.readouterr().err
    assert "-- `--sed SEED`" in told and "+- `--seed SEED`" in told


@pytest.mark.parametrize("arguments", [["--chek"], ["--check", "now"]])
def test_usage(arguments, capsys):
    assert reference.main(arguments) == 2
    assert " ".join(arguments) in capsys.readouterr().err
