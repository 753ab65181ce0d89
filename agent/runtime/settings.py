"""What is settled once for all commands: flags go before the environment, a project's file, and the user's file.

Needs the standard library alone, so that `structagent doctor` can look at it where everything else is broken.
"""

from __future__ import annotations

import os
import re
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from agent.errors import BadInput
from structdiffusion.limits import SETTINGS_BYTES, read_at_most
from structdiffusion.planners.registry import LEGAL_NAMES, PLANNERS

PROJECT_FILE = "structagent.toml"
PREFIX = "STRUCTAGENT_"
KEY_VARIABLE = "STRUCTAGENT_LLM_KEY"
ENVIRONMENT, PROJECT, USER = "environment", "project file", "user file"
LIBRARIES = ("ycb", "procedural", "random_urdfs", "training", "validation")
_SECRET = re.compile(r"key|token|secret|password|passwd|credential", re.IGNORECASE)
_SWITCH = {"1": True, "true": True, "yes": True, "on": True, "0": False, "false": False, "no": False, "off": False}


class ConfigError(BadInput):
    """A configuration that cannot be used; the message begins with the file and line, or names the variable."""


@dataclass(frozen=True)
class Setting:
    """Something that can be configured: the default of the flag with the same name.

    Attributes:
        name: in files and of the flag; `STRUCTAGENT_` and its capitals make the variable.
        kind: what a file must hold, `str`, `int` or `bool`.
        legal: the legal values, for messages.
        accept: takes a value of that kind and the folder that relative paths start from; gives the value that the
            flag gets, and raises `ValueError` for one that is not legal.
    """

    name: str
    kind: type
    legal: str
    accept: Callable[[Any, Path], Any]

    @property
    def variable(self) -> str:
        """The environment variable."""
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
_BY_NAME = {setting.name: setting for setting in SETTINGS}


@dataclass(frozen=True)
class Value:
    """What a setting was given, and where.

    Attributes:
        value: as the flag takes it; paths are absolute.
        layer: `ENVIRONMENT`, `PROJECT` or `USER`.
        place: the variable's name, or "FILE:LINE".
    """

    value: Any
    layer: str
    place: str


@dataclass(frozen=True)
class Configuration:
    """The settings that were given: name -> the value that counts; and the files, `None` where there is none."""

    values: Mapping[str, Value]
    project_file: Path | None
    user_file: Path | None


def load(
    environment: Mapping[str, str] | None = None, folder: Path | None = None, trust_project: bool = False
) -> Configuration:
    """The configuration as it counts, without flags.

    Args:
        environment: instead of the process's.
        folder: where the search for the project's file begins, upwards; by default the current folder.
        trust_project: let the project's file name a model folder, and endpoints on other machines.

    Raises:
        ConfigError: for a file that cannot be read, an unknown key, a value that is not legal, or a secret in a file;
            also where another layer overrides it.
    """
    environment = os.environ if environment is None else environment
    project, user = find_project_file(folder), user_file(environment)
    values: dict[str, Value] = {}
    if user is not None and _is_file(user):
        values |= _read_file(user, USER)
    if project is not None:
        values |= _read_file(project, PROJECT)
        if not trust_project:
            _check_project(values)
    return Configuration(values | _read_environment(environment, folder), project, user)


def find_project_file(folder: Path | None = None) -> Path | None:
    """`structagent.toml` in the folder (by default the current one) or the nearest folder above that has one."""
    try:
        start = (folder or Path.cwd()).absolute()
    except OSError:  # the current folder was deleted
        return None
    return next((path / PROJECT_FILE for path in (start, *start.parents) if _is_file(path / PROJECT_FILE)), None)


def user_file(environment: Mapping[str, str]) -> Path | None:
    """Where the user's file would be: in `XDG_CONFIG_HOME`, or in `~/.config`; `None` without a home folder."""
    base = environment.get("XDG_CONFIG_HOME", "")
    if not os.path.isabs(base):  # empty, or against the XDG specification, which has it ignored then
        base = os.path.join(environment.get("HOME") or os.path.expanduser("~"), ".config")
    return Path(base) / "structagent" / "config.toml" if os.path.isabs(base) else None


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except OSError:  # a folder that may not be looked into
        return False


def _read_file(path: Path, layer: str) -> dict[str, Value]:
    try:
        text = read_at_most(path, SETTINGS_BYTES).decode("utf-8-sig")
        found = tomllib.loads(text)
    except OSError as error:
        raise ConfigError(f"{path} cannot be read: {error.strerror or error}") from error
    except UnicodeDecodeError as error:
        line = error.object.count(b"\n", 0, error.start) + 1
        raise ConfigError(f"{path}:{line}: this is no UTF-8 text") from error
    except tomllib.TOMLDecodeError as error:
        where = re.search(r"line (\d+)", str(error))
        line = int(where[1]) if where else text.count("\n") + 1
        raise ConfigError(f"{path}:{line}: {str(error).partition(' (at ')[0]}; expected lines as 'seed = 3'") from error
    except (ValueError, RecursionError) as error:  # a number of thousands of digits, or lists in lists
        raise ConfigError(f"{path} cannot be read: {error}") from error
    lines = {name: _line_of(name, text) for name in found}
    values = {}
    for name in sorted(found, key=lines.__getitem__):
        place = f"{path}:{lines[name]}"
        setting = _BY_NAME.get(name)
        if setting is None:
            raise ConfigError(f"{place}: {_unknown('key', name, _BY_NAME)}")
        values[name] = _value(setting, found[name], path.parent, layer, place, place + ": " + name)
    return values


def _read_environment(environment: Mapping[str, str], folder: Path | None) -> dict[str, Value]:
    values = {}
    variables = {setting.variable: setting for setting in SETTINGS}
    for variable in sorted(environment):
        if not variable.startswith(PREFIX) or variable == KEY_VARIABLE or not environment[variable].strip():
            continue
        if variable not in variables:
            raise ConfigError(f"environment: {_unknown('variable', variable, variables)}")
        setting, text = variables[variable], environment[variable].strip()
        given = _from_text(text, setting.kind)
        values[setting.name] = _value(setting, given, folder or Path.cwd(), ENVIRONMENT, variable, variable)
    return values


def _from_text(text: str, kind: type) -> object:
    """The text of a variable as a file would hold it; the text itself where it is nothing of the kind."""
    if kind is bool:
        return _SWITCH.get(text.lower(), text)
    return int(text) if kind is int and re.fullmatch(r"[+-]?[0-9]{1,18}", text) else text


def _value(setting: Setting, given: object, folder: Path, layer: str, place: str, called: str) -> Value:
    try:
        if type(given) is not setting.kind:  # in Python true is a whole number too
            raise ValueError(given)
        value = setting.accept(given, folder)
    except (ValueError, OSError) as error:
        # An address may hold a password, and a table anything: they are not repeated.
        hidden = setting.name == "llm_url" or not isinstance(given, str | int | float)
        said = "this" if hidden else repr(given)
        raise ConfigError(f"{called} cannot be {said}; legal: {setting.legal}") from error
    if setting.name == "llm_url":
        _check_address(value, called)
    return Value(value, layer, place)


def _check_address(address: str, called: str) -> None:
    """Refuses passwords and queries, which reports and help would show."""
    parts = urlsplit(address)
    if "@" in parts.netloc or parts.query:
        raise ConfigError(
            f"{called} must have no user, password or query, which would be shown; the key's place is {KEY_VARIABLE}"
        )


def _check_project(values: Mapping[str, Value]) -> None:
    """Refuses what a project's file, which comes with other people's folders, may not decide by itself."""
    trusting = "or, if you trust this file, call `structagent --trust-project VERB`"
    address = values.get("llm_url")
    if address is not None and address.layer == PROJECT:
        host = (urlsplit(address.value).hostname or "").rstrip(".")
        if host not in ("localhost", "::1") and not re.fullmatch(r"127(\.[0-9]{1,3}){3}", host):
            raise ConfigError(
                f"{address.place}: llm_url of a project can only name this machine (localhost, 127.0.0.1, ::1), because "
                "your instructions are sent there; set another in your own file or as "
                f"{_BY_NAME['llm_url'].variable}, {trusting}"
            )
    for name in ("llm_model", "encoder"):
        model = values.get(name)
        if model is not None and model.layer == PROJECT and _is_path(model.value):
            raise ConfigError(
                f"{model.place}: {name} of a project cannot be a folder, because its files would be loaded; set it in "
                f"your own file or as {_BY_NAME[name].variable}, {trusting}"
            )


def _is_path(model: str) -> bool:
    """Whether a model's name would be taken for a folder; also for one that is made later."""
    return os.path.isabs(model) or model.startswith((".", "~")) or Path(model).exists()


def _unknown(what: str, name: str, legal: Mapping[str, Setting]) -> str:
    if _SECRET.search(name):
        return f"{name} is refused, because no secret is kept here; a key's place is the environment, {KEY_VARIABLE}"
    near = get_close_matches(name.replace("-", "_"), legal, n=1)
    hint = f"did you mean {near[0]}? " if near else ""
    return f"unknown {what} {name}; {hint}legal: {', '.join(legal)}"


def _line_of(name: str, text: str) -> int:
    """The line where a key of the top level, or its table, first stands."""
    key = re.escape(name)
    pattern = re.compile(rf"\s*(?:\[+\s*)?[\"']?{key}[\"']?\s*[=.\]]")
    return next((number for number, line in enumerate(text.split("\n"), 1) if pattern.match(line)), 1)
MOST_SEED = 2**63 - 1  # what every generator takes
