"""Define the settings: defaults of options that can be configured, their variables and legal values.

This module needs only the standard library, so that `structagent doctor` can read them in a broken installation.
"""

from __future__ import annotations

import os
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
LIBRARIES = ("ycb", "procedural", "random_urdfs", "training", "validation", "blocks")


@dataclass(frozen=True)
class Setting:
    """The configurable default of the option with the same name.

    Attributes:
        name: the name in files and of the option; the variable is `STRUCTAGENT_` and the name in capitals.
        kind: type of the value in a file, `str`, `int` or `bool`.
        legal: the legal values, for messages.
        accept: takes a value of that type and the folder that relative paths start from; returns the value of the
            option, and raises `ValueError` for an illegal one.
    """

    name: str
    kind: type
    legal: str
    accept: Callable[[Any, Path], Any]

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


def _at_least(least: int) -> Callable[[int, Path], int]:
    def accept(value: int, folder: Path) -> int:
        if value < least:
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
    if not value.strip():
        raise ValueError(value)
    path = _path(value, folder)  # a name on a model hub, or of an endpoint, is no folder here
    return str(path) if value.startswith((".", "~")) or path.is_dir() else value


def _web_address(value: str, folder: Path) -> str:
    parts = urlsplit(value.strip())
    if parts.scheme not in ("http", "https") or not parts.hostname or parts.port == 0:
        raise ValueError(value)
    return value.strip()


SETTINGS = (
    Setting("scene", str, "simulated, example, or an existing scene file or recording", _scene),
    Setting("objects", str, f"{', '.join(LIBRARIES)}, or an existing folder of meshes", _objects),
    Setting("model", str, LEGAL_NAMES, _one_of(*PLANNERS)),
    Setting("weights", str, "an existing folder of checkpoints", _existing_folder),
    Setting("seed", int, "a whole number of at least 0", _at_least(0)),
    Setting("parser", str, "embedding, llm", _one_of("embedding", "llm")),
    Setting("viewpoint", str, "robot, opposite", _one_of("robot", "opposite")),
    Setting("encoder", str, "a sentence encoder's folder or name", _model_name),
    Setting("llm_model", str, "a model folder or name", _model_name),
    Setting("llm_url", str, "an http or https address", _web_address),
    Setting("execute", bool, "true, false", lambda value, folder: value),
    Setting("workers", int, "a whole number of at least 1", _at_least(1)),
)
BY_NAME = {setting.name: setting for setting in SETTINGS}
