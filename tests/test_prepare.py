"""What `scripts/prepare.sh` installs for the tests, with an apt-get that only says what it was asked for."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).resolve().parents[1] / "scripts" / "prepare.sh"
TOOLS = ("bash", "cat", "chmod", "env", "grep", "timeout")
RUNS = "exit 0"
BROWSER = "printf '#!/bin/sh\\nexit 0\\n' >{folder}/chromium; chmod +x {folder}/chromium"


@pytest.fixture
def machine(tmp_path):
    """A machine with only these programs, where root is at work and every library is there."""
    folder = tmp_path / "bin"
    folder.mkdir()
    for tool in TOOLS:
        (folder / tool).symlink_to(shutil.which(tool))
    asked = tmp_path / "asked"

    def program(name: str, does: str) -> None:
        path = folder / name
        path.write_text(f"#!/bin/bash\necho {name} $* >>{asked}\n{does.format(folder=folder)}\n")
        path.chmod(0o755)

    program("id", "echo 0")
    libraries = "libstdc++.so.6 libgomp.so.1 libusb-1.0.so.0 libGL.so.1 libEGL.so.1 libX11.so.6"
    program("ldconfig", "\n".join(f"echo '{name} (x)'" for name in libraries.split()))
    program("apt-cache", "exit 0")
    program("python3", f'exec {sys.executable} "$@"')
    (tmp_path / "venv/bin").mkdir(parents=True)
    (tmp_path / "venv/bin/python").symlink_to(sys.executable)

    def prepared(*arguments: str) -> tuple[str, list[str]]:
        """What the script said, and the calls of apt-get; it succeeds."""
        ran = subprocess.run(
            [str(folder / "bash"), str(SCRIPT), str(tmp_path / "venv"), *arguments],
            env={"PATH": str(folder)}, capture_output=True, text=True, timeout=120,
        )  # fmt: skip
        assert ran.returncode == 0, ran.stderr
        calls = asked.read_text().splitlines() if asked.exists() else []
        return ran.stderr, [call for call in calls if call.startswith("apt-get")]

    return program, prepared


def test_for_the_tests_a_browser_is_installed_without_what_it_only_recommends(machine):
    program, prepared = machine
    program("apt-get", f"case $1 in install) {BROWSER};; esac")
    said, calls = prepared("test")
    assert calls == ["apt-get update -qq", "apt-get install -y -qq --no-install-recommends chromium"]
    assert "skipped" not in said
    assert prepared("test")[1] == calls, "a second time nothing is installed"


def test_the_demo_needs_no_browser(machine):
    program, prepared = machine
    program("apt-get", RUNS)
    assert prepared() == ("", [])


def test_a_browser_that_is_there_is_taken(machine):
    program, prepared = machine
    program("apt-get", RUNS)
    program("google-chrome", RUNS)
    assert prepared("test") == ("", [])


@pytest.mark.parametrize(
    ("programs", "reason"),
    [
        ({}, "there is no apt-get"),
        ({"apt-get": "exit 100"}, "apt-get gave no chromium that runs"),
        ({"apt-get": RUNS}, "apt-get gave no chromium that runs"),
        ({"apt-get": RUNS, "id": "echo 1000"}, "this user may not run apt-get as root"),
        ({"apt-get": RUNS, "apt-cache": "echo PreDepends: snapd"}, "the package chromium is a snap here"),
        ({"apt-get": RUNS, "chromium-browser": "exit 1"}, "apt-get gave no chromium that runs"),
    ],
)
def test_without_a_browser_the_set_up_goes_on_and_says_so(machine, programs, reason):
    program, prepared = machine
    for name, does in programs.items():
        program(name, does)
    said, _ = prepared("test")
    assert f"no browser runs here ({reason}), so the tests of pages are skipped" in said
