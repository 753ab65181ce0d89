"""`--arm FILE`: which files are refused and why, and a run with another arm than the Jaco."""

from pathlib import Path

import pytest

from agent.arm.arm_file import arm_checksum
from agent.arm.events import Placed
from agent.batch.rows import fingerprint
from agent.cli.app import command_line
from agent.cli.options import arm_file
from agent.errors import BAD_INPUT, USAGE
from agent.pipeline.run import RunOptions, run_instruction
from agent.recordings import example_path
from tests.agent.arm.gen3 import write_arm

TABLE = """\
version: 1
objects:
- {mesh: ycb/062_dice, x: 0.35, y: -0.2}
- {mesh: ycb/073-b_lego_duplo, x: 0.45, y: 0.2}
"""


@pytest.mark.parametrize(
    ("code", "command", "changes", "parts"),
    [
        (USAGE, "run TEXT", None, ("--arm cannot be", "legal: jaco, or the YAML file of an arm")),
        (USAGE, "chat", None, ("--arm cannot be", "legal: jaco, or the YAML file of an arm")),
        (BAD_INPUT, "run TEXT", {"home": None}, ("gen3.yaml", "lacks the key 'home'")),
        (BAD_INPUT, "batch orders.txt --out rows", {"pads": ["palm", "left_pad"]}, ("gen3.yaml", "pads cannot be")),
        (BAD_INPUT, "evaluate arm", {"urdf": "none.urdf"}, ("gen3.yaml", "none.urdf")),
        (USAGE, "run TEXT --scene example", {}, ("--arm cannot be", "with the recording 'example'")),
        (BAD_INPUT, "run TEXT --export-trajectory plan.json", {}, ("gen3.yaml", "is no Jaco")),
    ],
)
def test_what_is_wrong_is_one_sentence(tmp_path, monkeypatch, capsys, code, command, changes, parts):
    monkeypatch.chdir(tmp_path)
    Path("orders.txt").write_text("make a line\n")
    arm = "gen3.yaml" if changes is None else str(write_arm(tmp_path, **changes))
    words = ["put the cups in a line" if word == "TEXT" else word for word in command.split()]
    assert command_line([*words, "--arm", arm, *(["--model", "geometric"] if words[0] == "run" else [])]) == code
    said = [line for line in capsys.readouterr().err.splitlines() if line.startswith("structagent: ")]
    assert len(said) == 1 and all(part in said[0] for part in parts), said


def test_the_jaco_needs_no_file(tmp_path):
    assert arm_file(None) is None and arm_file("jaco") is None and arm_file("jaco:left") is None
    assert arm_file(str(write_arm(tmp_path))) == tmp_path / "gen3.yaml"
    assert example_path().exists()


def test_another_arm_builds(tmp_path):
    scene = tmp_path / "desk.yaml"
    scene.write_text(TABLE)
    options = RunOptions(str(scene), model="geometric", arm=write_arm(tmp_path))
    tables = []
    happened = list(run_instruction("put everything in a line", options, on_table=tables.append))
    assert happened[-1].to_dict()["exit_code"] == 0
    assert sum(isinstance(event, Placed) for event in happened) >= 2
    assert tables[0].arm.model.name == "gen3" and len(tables[0].arm.fingers) == 2


def test_a_row_is_carried_out_again_when_its_arm_has_changed(tmp_path):
    arm = write_arm(tmp_path)
    before, jaco = fingerprint("a line", RunOptions(arm=arm)), fingerprint("a line", RunOptions())
    checksum = arm_checksum(arm)
    write_arm(tmp_path, speed=0.5)
    assert len({before, jaco, fingerprint("a line", RunOptions(arm=arm))}) == 3
    assert arm_checksum(arm) != checksum
