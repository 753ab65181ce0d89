"""What the packages load at run time is in the wheel too."""

import tomllib
from fnmatch import fnmatch
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGES = ("agent", "grounding", "structdiffusion", "prompts")


@pytest.fixture(scope="module")
def project() -> dict:
    return tomllib.loads((ROOT / "pyproject.toml").read_text())


def test_every_data_file_matches_a_pattern(project):
    patterns = project["tool"]["setuptools"]["package-data"]["*"]
    left_out = [
        str(path.relative_to(ROOT))
        for package in PACKAGES
        for path in (ROOT / package).rglob("*")
        if path.is_file() and path.suffix not in (".py", ".pyc") and not any(fnmatch(path.name, p) for p in patterns)
    ]
    assert not left_out


def test_every_imported_package_is_a_dependency(project):
    import ast
    import re
    import sys
    from importlib.metadata import packages_distributions

    extras = project["project"]["optional-dependencies"]
    entries = [*project["project"]["dependencies"], *extras["ray"], *extras["viz"]]
    wanted = {re.split(r"[<>=~!\[ ]", entry)[0].lower().replace("_", "-") for entry in entries}
    owners = packages_distributions()
    missing = set()
    for package in PACKAGES:
        for path in (ROOT / package).rglob("*.py"):
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
                if isinstance(node, ast.ImportFrom) and node.level == 0:
                    names = [node.module]
                for name in names:
                    top = name.split(".")[0]
                    if top in sys.stdlib_module_names or top in PACKAGES:
                        continue
                    distributions = {owner.lower().replace("_", "-") for owner in owners.get(top, [top])}
                    if not distributions & wanted:
                        missing.add(f"{top} in {path.relative_to(ROOT)}")
    assert not missing
