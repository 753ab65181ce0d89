"""What the packages load at run time is in the wheel too."""

import re
import shutil
import subprocess
import sys
import tarfile
import tomllib
import zipfile
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


def test_the_weights_of_baselines_stay_in_the_clone(project):
    from setuptools import find_namespace_packages

    found = project["tool"]["setuptools"]["packages"]["find"]
    packages = find_namespace_packages(str(ROOT), exclude=found["exclude"], include=found["include"])
    shipped = {path.name for path in (ROOT / "structdiffusion/weights").iterdir()}
    left_out = {name for name in shipped if f"structdiffusion.weights.{name}" not in packages}
    assert left_out == {"cvae", *(name for name in shipped if name.startswith("structformer_"))}


def test_every_imported_package_is_a_dependency(project):
    import ast
    from importlib.metadata import packages_distributions

    extras = project["project"]["optional-dependencies"]
    optional = [entry for name, entries in extras.items() if name != "test" for entry in entries]
    entries = [*project["project"]["dependencies"], *optional]
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
                    if top in sys.stdlib_module_names or top in (*PACKAGES, "structagent"):
                        continue
                    distributions = {owner.lower().replace("_", "-") for owner in owners.get(top, [top])}
                    if not distributions & wanted:
                        missing.add(f"{top} in {path.relative_to(ROOT)}")
    assert not missing


@pytest.fixture(scope="module")
def distributions(tmp_path_factory) -> Path:
    """A wheel and a source distribution of the project without its data:
    what counts here is what goes beside the code.
    """
    folder = tmp_path_factory.mktemp("project")
    for name in ("pyproject.toml", "README.md", "LICENSE", "THIRD_PARTY.md"):
        shutil.copy(ROOT / name, folder)
    for package in PACKAGES:
        (folder / package).mkdir()
        shutil.copy(ROOT / package / "__init__.py", folder / package)
    program = (
        "from setuptools.build_meta import build_sdist, build_wheel; "
        "print('made', build_wheel('dist')); print('made', build_sdist('dist'))"
    )
    subprocess.run([sys.executable, "-c", program], cwd=folder, check=True, capture_output=True, timeout=300)
    return folder / "dist"


@pytest.mark.parametrize("name", ["LICENSE", "THIRD_PARTY.md"])
def test_wheel_and_source_distribution_contain_the_licences(distributions, name):
    text = (ROOT / name).read_bytes()
    with zipfile.ZipFile(next(distributions.glob("*.whl"))) as wheel:
        stored = next(entry for entry in wheel.namelist() if entry.endswith(f".dist-info/licenses/{name}"))
        assert wheel.read(stored) == text
    with tarfile.open(next(distributions.glob("*.tar.gz"))) as source:
        stored = next(entry for entry in source.getnames() if entry.count("/") == 1 and entry.endswith(f"/{name}"))
        assert source.extractfile(stored).read() == text


def test_metadata_names_the_licence(distributions):
    with zipfile.ZipFile(next(distributions.glob("*.whl"))) as wheel:
        metadata = wheel.read(next(entry for entry in wheel.namelist() if entry.endswith("/METADATA"))).decode()
    assert "\nLicense-Expression: MIT\n" in metadata


def test_every_dependency_is_listed_with_its_licence(project):
    entries = project["project"]["dependencies"] + sum(project["project"]["optional-dependencies"].values(), [])
    names = {re.split(r"[<>=~!\[; ]", entry)[0] for entry in entries}
    table = (ROOT / "THIRD_PARTY.md").read_text(encoding="utf-8")
    assert not {name for name in names if not re.search(rf"(?<![\w-]){re.escape(name)}(?![\w-])", table)}
