"""What the help of options says is legal, and what becomes of values that are not."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import get_args

from agent.cli.app import command_line
from agent.cli.options import ObjectsOption
from structdiffusion.objects.libraries import LIBRARIES

ROOT = Path(__file__).parents[3]


def test_every_library_of_objects_is_named():
    option = get_args(ObjectsOption)[1]
    assert sorted(option.metavar.split("|")) == sorted([*LIBRARIES, "DIR"])


VERBS_WITH_A_MODEL = (
    ["run", "make a line"],
    ["chat"],
    ["batch", "orders.txt", "--out", "out"],
    *(["evaluate", verb] for verb in ("success", "arm", "recordings", "coverage", "language")),
)
VERBS_WITH_OBJECTS = (*VERBS_WITH_A_MODEL, ["evaluate", "completion"], ["scene", "new"], ["generate", "--out", "out"])
VERBS_THAT_READ = (["parse", "make a line"], ["evaluate", "parse"], ["evaluate", "language"])
VERBS_WITH_A_PARSER = (*VERBS_WITH_A_MODEL[:3], *VERBS_THAT_READ)


def test_names_that_are_not_there_are_refused_before_anything_is_loaded(tmp_path):
    lines = [[*verb, "--model", "difusion"] for verb in VERBS_WITH_A_MODEL]
    lines += [[*verb, "--objects", "no/such"] for verb in VERBS_WITH_OBJECTS]
    lines += [[*verb, "--parser", "oracle"] for verb in VERBS_WITH_A_PARSER]
    program = """
import contextlib, io, json, sys
from agent.cli.app import command_line
heavy = {"torch", "numpy", "scipy", "pybullet", "trimesh", "transformers"}
for line in json.load(sys.stdin):
    with contextlib.redirect_stderr(io.StringIO()) as said, contextlib.redirect_stdout(said):
        code = command_line(line)
    print(json.dumps([code, said.getvalue(), sorted(heavy & set(sys.modules))]))
"""
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, "-c", program], input=json.dumps(lines), cwd=tmp_path, env=environment, capture_output=True,
        text=True, check=True,
    )  # fmt: skip
    told = [json.loads(line) for line in done.stdout.splitlines()]
    assert len(told) == len(lines)
    for line, (code, said, loaded) in zip(lines, told, strict=True):
        assert code == 2 and loaded == [] and said.count("\n") == 1 and repr(line[-1]) in said, (line, said, loaded)
    assert told[0][1] == (
        "structagent: --model cannot be 'difusion'; did you mean 'diffusion' or 'diffusion-paper' or "
        "'diffusion-tokens'? See `structagent models list`\n"
    )
    assert "legal: ycb, procedural, " in told[len(VERBS_WITH_A_MODEL)][1]
    assert "'embedding', 'llm'" in told[-1][1]
    assert not list(tmp_path.iterdir())


def test_each_of_several_models_is_checked(capsys):
    assert command_line(["evaluate", "success", "--model", "geometric", "--model", "geometrik"]) == 2
    assert "'geometrik'; did you mean 'geometric'" in capsys.readouterr().err
