"""ruff and pyrefly find nothing in the code, as `pyproject.toml` has them."""

import importlib.util
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


def assert_finds_nothing(tool: str, *arguments: str) -> None:
    """Run a tool on the whole project; show what it says where it finds something."""
    if importlib.util.find_spec(tool) is None:
        pytest.skip(f"{tool} is not installed; it comes with the tests: pip install 'structagent[test]'")
    found = subprocess.run([sys.executable, "-m", tool, *arguments], cwd=ROOT, capture_output=True, text=True)
    assert found.returncode == 0, found.stdout + found.stderr


def test_lint():
    assert_finds_nothing("ruff", "check", "--no-cache")


def test_format():
    assert_finds_nothing("ruff", "format", "--check", "--no-cache")


def test_types():
    assert_finds_nothing("pyrefly", "check", "--min-severity=error", "--summary=none")
