"""What a cold command imports before its first answer; seconds are not measured, because the machine may be busy."""

import subprocess
import sys

import pytest

HEAVY = {
    "torch",
    "transformers",
    "sentence_transformers",
    "open3d",
    "pybullet",
    "scipy",
    "trimesh",
    "matplotlib",
    "mcp",
}
TWO_PARTS = "put the cups in a circle on the left and the forks in a line on the right"
COMMAND = "import sys; from agent.cli.app import command_line; print(command_line(sys.argv[1:]), *sys.modules)"


@pytest.mark.parametrize(
    ("code", "arguments"),
    [
        (0, ["--help"]),
        (0, ["run", "--help"]),
        (0, ["mcp", "--help"]),
        (0, ["parse", "put the cups in a small circle on the left"]),
        (0, ["parse", "--json", TWO_PARTS, "build a tower of the gizmos"]),
        (0, ["parse", "--objects", "mug,bowl,plate", "put everything in a line"]),
        (0, ["config", "show"]),
        (0, ["models", "list"]),
        (2, ["prase", "a line"]),
        (2, ["parse", "--viewpoint", "moon", "a line"]),
    ],
    ids=str,
)
def test_nothing_heavy_is_imported(code, arguments):
    done = subprocess.run([sys.executable, "-c", COMMAND, *arguments], capture_output=True, text=True, check=True)
    ended, *modules = done.stdout.splitlines()[-1].split()
    assert int(ended) == code
    assert not HEAVY & set(modules)


def test_objects_of_a_recording_are_found_without_simulator_and_networks():
    done = subprocess.run(
        [sys.executable, "-c", COMMAND, "bag", "objects", "example"], capture_output=True, text=True, check=True
    )
    ended, *modules = done.stdout.splitlines()[-1].split()
    assert int(ended) == 0
    assert HEAVY & set(modules) == {"scipy"}
