"""Options that several commands share are given to a command as one object."""

from dataclasses import dataclass
from typing import Annotated

import pytest
import typer
from typer.testing import CliRunner

from agent.cli.app import command_line
from agent.cli.arguments import with_arguments


@dataclass(frozen=True)
class Inner:
    size: Annotated[int, typer.Option(metavar="N", min=1)] = 3


@dataclass(frozen=True, kw_only=True)
class Outer:
    name: Annotated[str, typer.Option()] = "a"
    inner: Inner


@pytest.fixture
def told():
    """What a command with a group in a group was called with, and the program that has it."""
    calls = []

    @with_arguments
    def command(
        ctx: typer.Context,
        word: Annotated[str, typer.Argument()],
        outer: Outer,
        loud: Annotated[bool, typer.Option("--loud")] = False,
    ) -> None:
        """Say it."""
        calls.append((ctx.command.name, word, outer, loud))

    app = typer.Typer()
    app.command("say")(command)
    return calls, app


@pytest.mark.parametrize(
    "line, outer, loud",
    [
        ("hello", Outer(inner=Inner()), False),
        ("hello --size 7 --loud --name b", Outer(name="b", inner=Inner(7)), True),
    ],
)
def test_every_field_of_a_group_is_an_option(told, line, outer, loud):
    calls, app = told
    assert CliRunner().invoke(app, line.split()).exit_code == 0
    assert calls == [("say", "hello", outer, loud)]


def test_the_options_of_a_group_are_checked_and_listed_in_order(told):
    calls, app = told
    assert CliRunner().invoke(app, ["hello", "--size", "0"]).exit_code == 2 and not calls
    listed = CliRunner().invoke(app, ["--help"]).output
    assert listed.index("--name") < listed.index("--size") < listed.index("--loud")


def test_a_wrong_option_of_a_chat_is_told_before_anything_is_made(tmp_path, capsys):
    out = tmp_path / "session"
    assert command_line(["chat", "--at", "-1", "--out", str(out)]) == 2
    assert capsys.readouterr().err.startswith("structagent: --at cannot be -1")
    assert not out.exists()
