"""Define the settings: defaults of options that can be configured, their variables and legal values.

This module needs only the standard library, so that `structagent doctor` can read them in a broken installation.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from structdiffusion.planners.registry import LEGAL_NAMES, PLANNERS

PROJECT_FILE = "structagent.toml"
PREFIX = "STRUCTAGENT_"
KEY_VARIABLE = "STRUCTAGENT_LLM_KEY"
TOKEN_VARIABLE = "STRUCTAGENT_MCP_TOKEN"
SECRETS = (KEY_VARIABLE, TOKEN_VARIABLE)  # variables that no file may hold
MOST_SEED = 2**63 - 1  # largest seed that every generator takes
MOST_WORKERS = 1024  # more than any machine has cores
LIBRARIES = ("ycb", "procedural", "random_urdfs", "training", "validation", "blocks", "unseen_urdfs")


@dataclass(frozen=True)
class Setting:
    """The configurable default of the option with the same name.

    Attributes:
        name: the name in files and of the option; the variable is `STRUCTAGENT_` and the name in capitals.
        kind: type of the value in a file, `str`, `int` or `bool`.
        legal: the legal values, for messages.
        accept: takes a value of that type and the folder that relative paths start from; returns the value of the
            option, and raises `ValueError` for an illegal one.
        forbidden: what keeps a project's file, which may come from somebody else, from deciding it: takes the value of
            the option and the file's folder; returns the reason, in words that continue "scene of a project ", or "".
    """

    name: str
    kind: type
    legal: str
    accept: Callable[[Any, Path], Any]
    forbidden: Callable[[Any, Path], str] = lambda value, folder: ""

    @property
    def variable(self) -> str:
        """Return the environment variable."""
        return PREFIX + self.name.upper()


def _one_of(*names: str) -> Callable[[str, Path], str]:
    def accept(value: str, folder: Path) -> str:
        if value not in names:
            raise ValueError(value)
        return value

    return accept


def _within(least: int, most: int) -> Callable[[int, Path], int]:
    def accept(value: int, folder: Path) -> int:
        if not least <= value <= most:
            raise ValueError(value)
        return value

    return accept


def _path(value: str, folder: Path) -> Path:
    # Without a home folder `expanduser` has no answer, and "~" is a name like any other.
    return folder / (os.path.expanduser(value) if value.startswith("~") else value)


def _existing_folder(value: str, folder: Path) -> str:
    path = _path(value, folder)
    if not value or not path.is_dir():
        raise ValueError(value)
    return str(path)


def _objects(value: str, folder: Path) -> str:
    return value if value in LIBRARIES else _existing_folder(value, folder)


def _scene(value: str, folder: Path) -> str:
    if value in ("simulated", "example"):
        return value
    path = _path(value, folder)
    if not value or not path.exists():
        raise ValueError(value)
    return str(path)


def _model_name(value: str, folder: Path) -> str:
    if not value.strip() or not value.isprintable():
        raise ValueError(value)
    path = _path(value, folder)  # a name on a model hub, or of an endpoint, is no folder here
    return str(path) if value.startswith((".", "~")) or path.is_dir() else value


def _web_address(value: str, folder: Path) -> str:
    value = value.strip()
    if any(char.isspace() or not char.isprintable() for char in value):
        raise ValueError(value)  # urlsplit leaves out line breaks in silence
    parts = urlsplit(value)
    if parts.scheme not in ("http", "https") or not parts.hostname or parts.port == 0:
        raise ValueError(value)
    return value


def _only_inside(value: str, folder: Path) -> str:
    """Forbid files outside the project, links resolved; names of what comes with the tool are no paths."""
    if not os.path.isabs(value) or Path(value).resolve().is_relative_to(folder.resolve()):
        return ""
    return "cannot be outside its folder, because it would choose among all your files"


def _no_folder(value: str, folder: Path) -> str:
    """Forbid what would be taken for a folder, even one that is created later."""
    is_path = os.path.isabs(value) or value.startswith((".", "~")) or Path(value).exists()
    return "cannot be a folder, because its files would be loaded" if is_path else ""


def _nothing(value: str, folder: Path) -> str:
    return "cannot be set, because its networks would decide what the arm does"


def _only_here(value: str, folder: Path) -> str:
    host = (urlsplit(value).hostname or "").rstrip(".")
    if host in ("localhost", "::1") or re.fullmatch(r"127(\.[0-9]{1,3}){3}", host):
        return ""
    return "can only name this machine (localhost, 127.0.0.1, ::1), because your instructions are sent there"


SETTINGS = (
    Setting("scene", str, "simulated, example, or an existing scene file or recording", _scene, _only_inside),
    Setting("objects", str, f"{', '.join(LIBRARIES)}, or an existing folder of meshes", _objects, _only_inside),
    Setting("model", str, LEGAL_NAMES, _one_of(*PLANNERS)),
    Setting("weights", str, "an existing folder of checkpoints", _existing_folder, _nothing),
    Setting("seed", int, f"a whole number from 0 to {MOST_SEED}", _within(0, MOST_SEED)),
    Setting("parser", str, "embedding, llm", _one_of("embedding", "llm")),
    Setting("viewpoint", str, "robot, opposite", _one_of("robot", "opposite")),
    Setting("llm_model", str, "a model folder or name", _model_name, _no_folder),
    Setting("llm_url", str, "an http or https address", _web_address, _only_here),
    Setting("execute", bool, "true, false", lambda value, folder: value),
    Setting("workers", int, f"a whole number from 1 to {MOST_WORKERS}", _within(1, MOST_WORKERS)),
)
BY_NAME = {setting.name: setting for setting in SETTINGS}
