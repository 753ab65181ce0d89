"""The command itself: what it refuses before it serves anybody."""

import pytest

from agent.cli import mcp as module
from agent.cli.app import command_line
from agent.errors import BAD_INPUT, DONE, USAGE


def test_without_the_package_one_sentence_says_how_to_install_it(monkeypatch, capsys, tmp_path):
    monkeypatch.setattr(module, "find_spec", lambda name: None)
    assert command_line(["mcp", "--out", str(tmp_path / "out")]) == USAGE
    assert capsys.readouterr().err == (
        "structagent: structagent mcp needs the package mcp, and it is not installed; "
        "pip install 'structagent[mcp]' does it\n"
    )
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("option", [("--host", "0.0.0.0"), ("--port", "8000"), ("--allow-host", "robot.example")])
def test_options_of_http_need_http(option, capsys):
    assert command_line(["mcp", *option]) == USAGE
    assert capsys.readouterr().err == "structagent: --host, --port and --allow-host need --transport http\n"


def test_a_table_that_cannot_be_set_ends_the_server(tmp_path, capsys):
    pytest.importorskip("mcp", reason="needs the extra mcp")
    assert command_line(["mcp", "--scene", str(tmp_path / "none.yaml"), "--out", str(tmp_path / "out")]) == BAD_INPUT
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("structagent: ") and "none.yaml" in line


def test_the_token_is_no_unknown_setting(monkeypatch, capsys):
    monkeypatch.setenv("STRUCTAGENT_MCP_TOKEN", "a-token-of-enough-characters")
    assert command_line(["config", "show"]) == DONE
    assert "a-token" not in capsys.readouterr().out
