"""What TAB offers, asked of the tool and of a real bash."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pexpect
import pytest
import typer

from agent.cli.app import app, command_line
from agent.cli.command_tree import command_tree
from agent.cli.shell_completion import Shell, offer

ROOT = Path(__file__).parents[3]


@pytest.fixture(scope="module")
def program():
    return command_tree(typer.main.get_command(app))


def words(program, *line: str) -> list[str]:
    return [word for word, _ in offer(program, line).words]


@pytest.mark.parametrize(
    ("line", "offered"),
    [
        (["ev"], ["evaluate"]),
        (
            ["evaluate", ""],
            [
                "success",
                "goals",
                "figures",
                "arm",
                "loop",
                "steering",
                "environment",
                "picks",
                "recordings",
                "segmentation",
                "nouns",
                "completion",
                "parse",
                "language",
                "discriminators",
                "coverage",
                "chat",
            ],
        ),
        (["evaluate", "a"], ["arm"]),
        (["bulid", ""], []),
        (["run", "--viewp"], ["--viewpoint"]),
        (["run", "make a line", "--no-e"], ["--no-execute"]),
        (["run", "--help"], ["--help"]),
        (["run", "--viewpoint", ""], ["robot", "opposite"]),
        (["run", "--viewpoint", "=", "o"], ["opposite"]),  # as bash splits it
        (["run", "--viewpoint", "="], ["robot", "opposite"]),
        (["run", "--viewpoint=o"], ["--viewpoint=opposite"]),  # as zsh and fish do not
        (["run", "--viewpoint", "robot", "--viewp"], []),  # once is enough
        (["evaluate", "parse", "--parser", "llm", "--parser", ""], ["embedding", "llm"]),
        (["evaluate", "parse", "--parser", "llm", "--pars"], ["--parser"]),
        (["evaluate", "loop", "--disturb", "s"], ["swap"]),
        (["run", "--json", ""], []),  # a switch takes no value
        (["run", "--seed", ""], []),
        (["scene", "new", "--shape", "t"], ["tower", "table setting", "triangle"]),
        (["train", "structu"], ["structure"]),
        (["train", "structure", ""], []),
        (["run", "--model", "geo"], ["geometric", "geometric+rollout"]),
        (["train", "p"], ["parser"]),
        (["parse", "--", "--vie"], []),
        (["completion", ""], ["bash", "zsh", "fish"]),
    ],
)
def test_words_that_could_come_next(program, line, offered):
    assert words(program, *line) == offered


def test_every_verb_and_every_option_is_offered_with_what_it_means(program):
    pending = [program]
    while pending:
        command = pending.pop()
        path = command.path[1:]
        if command.commands:
            assert words(program, *path, "") == list(command.commands)
        options = dict(offer(program, [*path, "-"]).words)
        assert set(options) == {flag for each in command.parameters for flag in each.flags} | {"--help"}
        assert all(options.values())
        pending += command.commands.values()


@pytest.mark.parametrize(
    ("line", "paths"),
    [
        (["run", "--out", ""], "folders"),
        (["run", "--objects", ""], "folders"),
        (["run", "--scene="], "files"),
        (["scene", "show", ""], "files"),
        (["scene", "show", "a.yaml", ""], ""),
        (["run", "--seed", ""], ""),
    ],
)
def test_where_paths_may_stand(program, line, paths):
    assert offer(program, line).paths == paths


@pytest.mark.parametrize("shell", list(Shell))
def test_scripts_are_read_by_their_shells(shell, capsys):
    """The syntax, where the shell is there; that they are printed, and ask for their own shell, everywhere."""
    assert command_line(["completion", shell.value]) == 0
    script = capsys.readouterr().out
    assert f"completion {shell.value} -- " in script
    if shutil.which(shell.value):
        subprocess.run([shell.value, "-n"], input=script, text=True, check=True)


def test_the_answer_to_a_shell(capsys):
    assert command_line(["completion", "zsh", "--", "run", "--objects", "y"]) == 0
    assert capsys.readouterr().out == "folders\nycb\tObject library, or a folder of meshes.\n"


def test_a_broken_configuration_does_not_stop_it(monkeypatch, capsys):
    monkeypatch.setenv("STRUCTAGENT_SEED", "many")
    assert command_line(["completion", "bash", "--", "tra"]) == 0
    assert capsys.readouterr().out.startswith("words\ntrain\t")


def test_answering_imports_nothing_heavy():
    """Seconds are not measured, because the machine may be busy."""
    program = "import sys; from agent.cli.app import command_line; command_line(sys.argv[1:]); print(*sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", program, "completion", "bash", "--", "run", "--viewpoint", ""],
        cwd=ROOT, capture_output=True, text=True, check=True,
    )  # fmt: skip
    *answer, modules = done.stdout.splitlines()
    assert [line.split("\t")[0] for line in answer] == ["words", "robot", "opposite"]
    assert not {"torch", "numpy", "scipy", "pybullet", "trimesh", "PIL", "prompt_toolkit"} & set(modules.split())


@pytest.fixture
def bash(tmp_path):
    """An interactive bash that has read the script; gives what a line becomes when TAB is pressed."""
    shell = shutil.which("bash")
    assert shell, "structagent completion is for bash first; it must be there to be tested"
    command = tmp_path / "structagent"
    command.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m agent "$@"\n')
    command.chmod(0o755)
    (tmp_path / "desk.yaml").write_text("")
    settings = tmp_path / "inputrc"
    settings.write_text("set enable-bracketed-paste off\n")
    environment = {
        **os.environ, "PATH": f"{tmp_path}:{os.environ['PATH']}", "PYTHONPATH": str(ROOT), "TERM": "dumb", "PS1": "> ",
        "INPUTRC": str(settings), "LC_ALL": "C.UTF-8",
    }  # fmt: skip
    options = {"cwd": tmp_path, "env": environment, "encoding": "utf-8", "timeout": 300, "dimensions": (24, 200)}
    child = pexpect.spawn(shell, ["--norc", "--noprofile", "-i"], **options)
    child.expect_exact("> ")  # what is typed before readline has set up the terminal can be lost
    child.sendline("source <(structagent completion bash); echo re''ady")
    child.expect("ready\r\n> ")

    def completed(begun: str, expected: str) -> None:
        child.send(begun + "\t")
        child.expect_exact(expected)
        child.sendcontrol("u")

    yield completed
    child.close(force=True)


def test_bash_completes_verbs_options_values_and_paths(bash):
    bash("structagent ev", "structagent evaluate ")
    bash("structagent evaluate su", "structagent evaluate success ")
    bash("structagent run 'a line' --viewp", "--viewpoint ")
    bash("structagent run 'a line' --viewpoint o", "opposite ")
    bash("structagent run 'a line' --viewpoint=o", "=opposite ")
    bash("structagent scene new --shape ta", r"table\ setting ")
    bash("structagent scene show de", "desk.yaml ")
