"""`import structagent`: fast, typed, installed beside the other packages, and true to its documents and examples."""

import ast
import os
import re
import runpy
import subprocess
import sys
from pathlib import Path

import pytest
import structagent

from tests.commands import python_program

ROOT = Path(__file__).parents[3]
PACKAGE = ROOT / "agent" / "public" / "structagent"
EXAMPLES = sorted((ROOT / "docs" / "examples").glob("*.py"))
BLOCKS = re.findall(r"^```python\n(.*?)^```$", (ROOT / "docs" / "python-api.md").read_text(), re.MULTILINE | re.DOTALL)


def python(*arguments: str, folder: Path) -> subprocess.CompletedProcess:
    """Runs Python elsewhere, with the installed packages alone."""
    return completed([sys.executable, *arguments], folder)


def completed(command: list[str], folder: Path) -> subprocess.CompletedProcess:
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, timeout=500)


def test_importing_it_loads_nothing_heavy(tmp_path):
    """Beside the standard library only two packages' own files are loaded, not even NumPy; all names are offered."""
    script = (
        "import sys; before = set(sys.modules); import structagent\n"
        "loaded = {name.split('.')[0] for name in set(sys.modules) - before} - sys.stdlib_module_names\n"
        "print(structagent.__version__, *sorted(loaded))\n"
        "print(*dir(structagent))\n"
    )
    ran = python("-X", "importtime", "-c", script, folder=tmp_path)
    loaded, offered = ran.stdout.splitlines()
    assert loaded.split() == [structagent.__version__, "agent", "structagent"], ran.stdout + ran.stderr[-2000:]
    assert offered.split() == sorted(structagent.__all__)
    times = re.findall(r"\|\s+(\d+) \| structagent$", ran.stderr, re.MULTILINE)
    assert int(times[0]) < 500_000  # microseconds: a few thousand where nothing else runs


def test_nothing_heavy_is_loaded_to_refuse_what_cannot_be_used(tmp_path):
    script = (
        "import sys, structagent\n"
        "try:\n    structagent.propose([[[1, 2]]], 'a line')\n"
        "except structagent.StructagentError as error:\n    print(error)\n"
        "print([name for name in ('torch', 'pybullet', 'open3d', 'transformers') if name in sys.modules])\n"
    )
    ran = python("-c", script, folder=tmp_path)
    assert ran.stdout.splitlines()[1:] == ["[]"] and "clouds[0] has the shape" in ran.stdout, ran.stderr


def test_every_public_name_is_there_and_documented():
    for name in structagent.__all__:
        value = getattr(structagent, name)
        assert name.startswith("__") or value.__doc__, name
    with pytest.raises(AttributeError, match="no attribute 'porpose'; it has: .*propose"):
        _ = structagent.porpose


def test_type_checkers_see_the_same_names():
    tree = ast.parse((PACKAGE / "__init__.py").read_text())
    checking = next(node for node in tree.body if isinstance(node, ast.If))
    seen = {alias.name: node.module for node in checking.body for alias in node.names}
    assert seen == structagent._HOME and set(seen) | {"__version__"} == set(structagent.__all__)
    assert (PACKAGE / "py.typed").is_file()


def test_the_wheel_has_the_package_once():
    from setuptools import Distribution
    from setuptools.config.pyprojecttoml import apply_configuration

    distribution = apply_configuration(Distribution({"src_root": str(ROOT)}), str(ROOT / "pyproject.toml"))
    assert distribution.package_dir == {"structagent": "agent/public/structagent"}
    assert [name for name in distribution.packages if "public" in name or "structagent" in name] == ["structagent"]
    assert {"agent", "grounding", "structdiffusion", "prompts"} <= set(distribution.packages)


def test_the_first_example_has_ten_lines_and_works():
    first = [line for line in BLOCKS[0].splitlines() if line.strip()]
    assert len(first) <= 10


def test_code_of_the_document_runs(tmp_path, capsys):
    """The first block in a process of its own, the other here, where everything is loaded already."""
    ran = python("-c", BLOCKS[0], folder=tmp_path)
    assert ran.returncode == 0 and ran.stderr == "", ran.stderr
    assert "goes by" in ran.stdout
    exec(compile(BLOCKS[1], "python-api.md", "exec"), {"__name__": "__main__"})
    said = capsys.readouterr()
    assert "6 clouds[0] is 60 m across" in said.out and said.err == ""
    assert len(BLOCKS) == 2


def test_the_document_names_every_public_name():
    text = (ROOT / "docs" / "python-api.md").read_text()
    assert not [
        name
        for name in structagent.__all__
        if not name.startswith("__") and f"`{name}" not in text and f"structagent.{name}" not in text
    ]


def test_examples_are_short():
    assert len(EXAMPLES) == 3
    assert all(len(path.read_text().splitlines()) < 60 for path in EXAMPLES)


@pytest.mark.parametrize(
    ("name", "arguments", "code", "expected"),
    [
        ("propose_from_clouds", ["--count", "8"], 0,
         ("understood: shape circle, size small", "cup 1  at x", "bowl   at x 0.58, y 0.30 stays")),
        ("run_recording", ["--model", "geometric"], 0,
         ("object 1: ", "seen: object 1, object 2", "tried in physics", "it stands")),
        ("compare_planners", ["--scenes", "1", "--count", "4", "--structures", "line"], 0,
         ("geometric", "1 of 1", "structagent evaluate success")),
    ],
)  # fmt: skip
def test_examples_run(name, arguments, code, expected, tmp_path):
    path = str(ROOT / "docs" / "examples" / f"{name}.py")
    program = f"import runpy, sys; sys.argv = {[path, *arguments]}; runpy.run_path(sys.argv[0], run_name='__main__')"
    done = completed(python_program(program), tmp_path)
    said = done.stdout + done.stderr
    assert done.returncode == code and all(part in said for part in expected), said
    assert "Traceback" not in said
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("name", "argument", "expected"),
    [
        ("propose_from_clouds", "build a bridge", "exit code 3"),
        ("run_recording", "no-such-scene.yaml", "there is no scene file 'no-such-scene.yaml'"),
    ],
)
def test_examples_end_with_a_sentence(name, argument, expected, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", [f"{name}.py", argument])
    with pytest.raises(SystemExit) as ended:
        runpy.run_path(str(ROOT / "docs" / "examples" / f"{name}.py"), run_name="__main__")
    assert isinstance(ended.value.code, str) and expected in ended.value.code  # Python prints it and ends with 1
    assert "Traceback" not in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
