"""What docs/mcp.md promises: its program runs, and its conversation goes as its table says."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("mcp", reason="needs the extra mcp")

from tests.agent.mcp.conftest import Person, data

MANUAL = (Path(__file__).parents[3] / "docs" / "mcp.md").read_text(encoding="utf-8")


def test_the_program_of_the_manual_runs(tmp_path):
    """As a reader would run it, with the command in the path; the person says no, so that nothing is built."""
    (program,) = re.findall(r"```python\n(.*?)```", MANUAL, re.DOTALL)
    (tmp_path / "client.py").write_text(program)
    command = tmp_path / "structagent"
    command.write_text(f'#!/bin/sh\nPYTHONPATH="{os.pathsep.join(sys.path)}" exec "{sys.executable}" -m agent "$@"\n')
    command.chmod(0o755)
    environment = os.environ | {"PATH": f"{tmp_path}{os.pathsep}{os.environ['PATH']}", "HOME": str(tmp_path)}
    done = subprocess.run(
        [sys.executable, "client.py"], input="n\n", capture_output=True, text=True, cwd=tmp_path, env=environment
    )
    assert done.returncode == 0, done.stderr
    asked = done.stdout.splitlines()[1]
    assert re.match(r"Let the robot arm build plan-\d+: .+\? It moves \"", asked) and "[y/n]" in asked
    assert "the person declined build" in done.stdout


def test_the_conversation_of_the_manual(served):
    """Every line of its table, in its order, on a table with three cups."""
    table = MANUAL.partition("| the person | the client calls |")[2].partition("\n\n")[0]
    rows = re.findall(r'^\| "(.+?)" \| `(\w+)`', table, re.MULTILINE)
    assert [tool for _, tool in rows] == ["look", "propose", "propose", "propose_again", "preview", "build", "undo"]

    async def conversation(client):
        plans = []
        for words, tool in rows:
            arguments = (
                {"text": words} if tool == "propose" else {"plan_id": plans[0]} if tool in ("preview", "build") else {}
            )
            answer = await data(client, tool, **arguments)
            if tool in ("propose", "propose_again"):
                assert answer["status"] == "proposed"
                plans = [plan["plan_id"] for plan in answer["plans"]]
            elif tool == "build":
                assert answer["success"], answer
        assert len(person.asked) == 2 and {"cup 1", "cup 2", "cup 3"} == set(answer["moved"])

    person = Person()
    served.speak(conversation, person)
