"""List the packages that the tool requires, with their version bounds, and those that are installed.

This module needs only the standard library, because anything else may be broken in the environment.
"""

from __future__ import annotations

import importlib.metadata
import platform
import re
import tomllib
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
NAME = "structagent"
_REQUIREMENT = re.compile(r"\s*([A-Za-z0-9][A-Za-z0-9._-]*)\s*(?:\[[^\]]*\])?\s*\(?([^;)]*)\)?\s*(?:;(.*))?$")
_EXTRA = re.compile(r"""extra\s*==\s*["']([^"']+)["']""")
_BOUND = re.compile(r"\s*(>=|<=|==|!=|~=|>|<)\s*([0-9][0-9.]*)")
# Packages that are imported by another name than their own.
_MODULES = {"open3d-cpu": "open3d", "pillow": "PIL", "pyyaml": "yaml", "rerun-sdk": "rerun"}
_CLAUSE = re.compile(r"""\s*\(?\s*(\w+)\s*(==|!=)\s*["']([^"']*)["']\s*\)?\s*$""")


@dataclass(frozen=True)
class Requirement:
    """A package that the tool requires.

    Attributes:
        name: the name of the distribution, as pip takes it.
        bounds: the version bounds, such as ">=2.6,<2.14"; empty for any version.
        extra: the extra that requires it; empty if the tool always requires it.
    """

    name: str
    bounds: str = ""
    extra: str = ""

    @property
    def module(self) -> str:
        """Return the name under which the package is imported."""
        return _MODULES.get(self.name.lower(), self.name.replace("-", "_"))

    def allows(self, version: str) -> bool:
        """Return whether a version is within the bounds; a local label such as "+cpu" does not count."""
        return all(_holds(bound, _numbers(version)) for bound in self.bounds.split(",") if bound.strip())


def required(root: Path = ROOT) -> list[Requirement]:
    """Read the requirements from `pyproject.toml` in a checkout, otherwise from the installed metadata.

    Raises:
        OSError: if neither exists.
        ValueError: for a `pyproject.toml` that is not valid.
    """
    project = root / "pyproject.toml"
    if project.is_file():
        about = tomllib.loads(project.read_text(encoding="utf-8"))["project"]
        listed = [(text, "") for text in about["dependencies"]]
        listed += [(text, extra) for extra, texts in about.get("optional-dependencies", {}).items() for text in texts]
    else:
        try:
            listed = [(text, "") for text in importlib.metadata.requires(NAME) or ()]
        except importlib.metadata.PackageNotFoundError as error:
            raise OSError(f"there is no {project}, and {NAME} is not installed") from error
    return [_parse(text, extra) for text, extra in listed if _applies_here(text.partition(";")[2])]


def installed(name: str) -> str | None:
    """Return the version of an installed distribution, or `None`."""
    try:
        # A folder that is left over from a broken uninstallation has metadata without a version.
        return importlib.metadata.version(name) or None
    except (importlib.metadata.PackageNotFoundError, KeyError, ValueError, OSError):
        return None


def _parse(text: str, extra: str) -> Requirement:
    match = _REQUIREMENT.match(text)
    if match is None:
        raise ValueError(f"{text!r} is not a requirement")
    marked = _EXTRA.search(match[3] or "")
    return Requirement(match[1], re.sub(r"\s", "", match[2]), marked[1] if marked else extra)


def _applies_here(marker: str) -> bool:
    """Return whether a marker applies to this system and processor; clauses about anything else count as true."""
    here = {"platform_system": platform.system(), "platform_machine": platform.machine()}

    def holds(clause: str) -> bool:
        match = _CLAUSE.match(clause)
        if match is None or match[1] not in here:
            return True
        return (here[match[1]] == match[3]) == (match[2] == "==")

    return any(all(map(holds, re.split(r"\band\b", part))) for part in re.split(r"\bor\b", marker))


def _numbers(version: str) -> tuple[int, ...]:
    release = re.match(r"[0-9]+(\.[0-9]+)*", version)
    return tuple(int(part) for part in release[0].split(".")) if release else ()


def _holds(bound: str, version: tuple[int, ...]) -> bool:
    match = _BOUND.match(bound)
    if match is None:
        return True  # nothing that these requirements use
    sign, limit = match[1], _numbers(match[2])
    length = max(len(version), len(limit))
    have, want = version + (0,) * (length - len(version)), limit + (0,) * (length - len(limit))
    return {
        ">=": have >= want,
        "<=": have <= want,
        ">": have > want,
        "<": have < want,
        "==": have == want,
        "!=": have != want,
        "~=": have >= want and have[: len(limit) - 1] == limit[:-1],
    }[sign]
