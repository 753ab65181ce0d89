"""What `structagent serve` keeps in memory, in a process of its own: a forked one would share the tests' libraries."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.agent.live_view.conftest import Client
from tests.memory import resident_megabytes

pytest.importorskip("websockets", reason="needs the extra `view`")

MOST = 700.0  # MB, of the process and all below it
LONG = 300.0  # s on a busy machine
SENTENCE = "put the cups in a small circle on the left"
SCENE = """version: 1
objects:
- {name: cup 1, noun: cup, mesh: ycb/065-d_cups, x: 0.40, y: 0.17}
- {name: cup 2, noun: cup, mesh: ycb/065-c_cups, x: 0.50, y: 0.33}
- {name: cup 3, noun: cup, mesh: ycb/065-e_cups, x: 0.40, y: -0.20}
- {name: box, mesh: ycb/008_pudding_box, x: 0.6, y: -0.33}
"""


def test_two_proposals_leave_less_than_700_megabytes(tmp_path):
    """With the shipped networks and everything else as a user starts it."""
    (tmp_path / "cups.yaml").write_text(SCENE)
    command = [sys.executable, "-m", "agent", "serve", "--port", "0", "--scene", "cups.yaml", "--out", "out"]
    paths = os.pathsep.join(filter(None, (str(Path(__file__).parents[3]), os.environ.get("PYTHONPATH"))))
    environment = os.environ | {"PYTHONPATH": paths}
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, cwd=tmp_path, env=environment) as process:
        try:
            address = next(line for line in process.stderr if line.startswith("live view: "))
            port = int(address.rstrip("/\n").rpartition(":")[2])
            page = Client(type("Server", (), {"access": type("Access", (), {"port": port})}))
            page.until(lambda message: message["kind"] == "asking" and message["prompt"], LONG)
            for _ in range(2):
                page.send(kind="line", line=SENTENCE)
                page.until(lambda message: message["kind"] == "asking" and not message["prompt"], LONG)
                page.until(lambda message: message["kind"] == "asking" and "build it?" in message["prompt"], LONG)
            used = resident_megabytes(process.pid)
            page.close()
        finally:
            process.kill()
    assert 100 < used < MOST
