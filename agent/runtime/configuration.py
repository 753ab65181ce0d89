"""Read the configuration: options override the environment, which overrides a project's file, then the user's file.

This module needs only the standard library, so that `structagent doctor` can read it in a broken installation.
"""

from __future__ import annotations

import os
import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from agent.errors import BadInput
from agent.runtime.settings import BY_NAME, KEY_VARIABLE, PREFIX, PROJECT_FILE, SECRETS, SETTINGS, Setting
from grounding.figures.names import VARIABLE as STRUCTURES  # a folder, and no option
from grounding.user_folder import user_folder
from structdiffusion.limits import SETTINGS_BYTES, read_at_most

ENVIRONMENT, PROJECT, USER = "environment", "project file", "user file"
_SECRET = re.compile(r"key|token|secret|password|passwd|credential", re.IGNORECASE)
_SWITCH = {"1": True, "true": True, "yes": True, "on": True, "0": False, "false": False, "no": False, "off": False}


class ConfigError(BadInput):
    """An invalid configuration; the message begins with the file and line, or names the variable."""


@dataclass(frozen=True)
class Value:
    """The configured value of a setting.

    Attributes:
        value: the value as the option takes it; paths are absolute.
        layer: `ENVIRONMENT`, `PROJECT` or `USER`.
        place: the variable's name, or "FILE:LINE".
    """

    value: Any
    layer: str
    place: str


@dataclass(frozen=True)
class Configuration:
    """The configured settings.

    Attributes:
        values: name -> effective value.
        project_file, user_file: the paths of the files, `None` for a file that is missing.
        problems: a sentence for each thing that is wrong; what it is about has no value here.
    """

    values: Mapping[str, Value]
    project_file: Path | None
    user_file: Path | None
    problems: tuple[str, ...] = ()


def load(
    environment: Mapping[str, str] | None = None,
    folder: Path | None = None,
    trust_project: bool = False,
    tolerant: bool = False,
) -> Configuration:
    """Read the configuration, without the options of the command line.

    Args:
        environment: replaces the environment of the process.
        folder: where the search for the project's file starts, upwards; by default the current folder.
        trust_project: allow the project's file to decide everything; see `Setting.forbidden`.
        tolerant: do without what is wrong, and tell it in `Configuration.problems`.

    Raises:
        ConfigError: unless tolerant, for a file that cannot be read, an unknown key, an illegal value, or a secret in
            a file, even if another layer overrides it.
    """
    environment = os.environ if environment is None else environment
    project, user = find_project_file(folder), user_file(environment)
    values: dict[str, Value] = {}
    problems: list[str] = []
    if user is not None and _is_file(user):
        values |= _read_file(user, USER, True, problems)
    if project is not None:
        values |= _read_file(project, PROJECT, trust_project, problems)
    values |= _read_environment(environment, folder, problems)
    if problems and not tolerant:
        raise ConfigError(problems[0])
    return Configuration(values, project, user, tuple(problems))


def find_project_file(folder: Path | None = None) -> Path | None:
    """Find `structagent.toml` in the folder (by default the current one) or the nearest one above it."""
    try:
        start = (folder or Path.cwd()).absolute()
    except OSError:  # the current folder was deleted
        return None
    return next((path / PROJECT_FILE for path in (start, *start.parents) if _is_file(path / PROJECT_FILE)), None)


def user_file(environment: Mapping[str, str]) -> Path | None:
    """Return the path of the user's file, in `XDG_CONFIG_HOME` or `~/.config`; `None` without a home folder."""
    folder = user_folder(environment)
    return None if folder is None else folder / "config.toml"


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except OSError:  # a folder without permission to read it
        return False


def _read_file(path: Path, layer: str, trusted: bool, problems: list[str]) -> dict[str, Value]:
    """Read the values of a file; tell what is wrong in `problems`."""
    values = {}
    try:
        found, lines = _parsed(path)
    except ConfigError as error:
        problems.append(str(error))
        return {}
    for name in sorted(found, key=lines.__getitem__):
        place = f"{path}:{lines[name]}"
        setting = BY_NAME.get(name)
        if setting is None:
            problems.append(f"{place}: {_unknown('key', name, BY_NAME)}")
            continue
        try:
            value = _value(setting, found[name], path.parent, layer, place, place + ": " + name)
        except ConfigError as error:
            problems.append(str(error))
            continue
        if not trusted and (why := _forbidden(setting, value, path.parent)):
            problems.append(why)
            continue
        values[name] = value
    return values


def _parsed(path: Path) -> tuple[dict[str, Any], dict[str, int]]:
    """Return the keys of a file with their values, and with their lines."""
    try:
        text = read_at_most(path, SETTINGS_BYTES).decode("utf-8-sig")
        found = tomllib.loads(text)
    except OSError as error:
        raise ConfigError(f"{path} cannot be read: {error.strerror or error}") from error
    except UnicodeDecodeError as error:
        line = error.object.count(b"\n", 0, error.start) + 1
        raise ConfigError(f"{path}:{line}: this is not UTF-8 text") from error
    except tomllib.TOMLDecodeError as error:
        where = re.search(r"line (\d+)", str(error))
        line = int(where[1]) if where else text.count("\n") + 1
        raise ConfigError(f"{path}:{line}: {str(error).partition(' (at ')[0]}; expected lines as 'seed = 3'") from error
    except (ValueError, RecursionError) as error:  # a number of thousands of digits, or lists in lists
        raise ConfigError(f"{path} cannot be read: {error}") from error
    return found, {name: _line_of(name, text) for name in found}


def _read_environment(environment: Mapping[str, str], folder: Path | None, problems: list[str]) -> dict[str, Value]:
    values = {}
    variables = {setting.variable: setting for setting in SETTINGS}
    for variable in sorted(environment):
        if not variable.startswith(PREFIX) or variable in (*SECRETS, STRUCTURES) or not environment[variable].strip():
            continue
        if variable not in variables:
            problems.append(f"environment: {_unknown('variable', variable, variables)}")
            continue
        setting, text = variables[variable], environment[variable].strip()
        given = _from_text(text, setting.kind)
        try:
            values[setting.name] = _value(setting, given, folder or Path.cwd(), ENVIRONMENT, variable, variable)
        except ConfigError as error:
            problems.append(str(error))
    return values


def _from_text(text: str, kind: type) -> object:
    """Convert the text of a variable to the type of a setting; return the text itself if that is impossible."""
    if kind is bool:
        return _SWITCH.get(text.lower(), text)
    return int(text) if kind is int and re.fullmatch(r"[+-]?[0-9]{1,30}", text) else text


def _value(setting: Setting, given: object, folder: Path, layer: str, place: str, display_name: str) -> Value:
    try:
        if type(given) is not setting.kind:  # in Python true is a whole number too
            raise ValueError(given)
        value = setting.accept(given, folder)
    except (ValueError, OSError) as error:
        # An address may hold a password, and a table anything: they are not shown.
        hidden = setting.name == "llm_url" or not isinstance(given, str | int | float)
        said = "this" if hidden else repr(given) if len(repr(given)) <= 80 else f"{repr(given)[:77]}..."
        raise ConfigError(f"{display_name} cannot be {said}; legal: {setting.legal}") from error
    if setting.name == "llm_url":
        _check_address(value, display_name)
    return Value(value, layer, place)


def _check_address(address: str, display_name: str) -> None:
    """Refuse passwords and queries, which reports and help would show."""
    parts = urlsplit(address)
    if "@" in parts.netloc or parts.query:
        raise ConfigError(
            f"{display_name} must have no user, password or query, which would be shown; set the key in {KEY_VARIABLE}"
        )


def _forbidden(setting: Setting, value: Value, folder: Path) -> str:
    """Say why a project's file must not decide this; "" where it may."""
    why = setting.forbidden(value.value, folder)
    return why and (
        f"{value.place}: {setting.name} of a project {why}; set it in your own file or as {setting.variable}, or, if "
        "you trust this file, call `structagent --trust-project VERB`"
    )


def _unknown(what: str, name: str, legal: Mapping[str, Setting]) -> str:
    if _SECRET.search(name):
        return f"{name} is refused, because files must not hold secrets; set the key in the environment, {KEY_VARIABLE}"
    near = get_close_matches(name.replace("-", "_"), legal, n=1)
    hint = f"did you mean {near[0]}? " if near else ""
    return f"unknown {what} {name}; {hint}legal: {', '.join(legal)}"


def _line_of(name: str, text: str) -> int:
    """Return the first line of a top-level key, or of its table."""
    key = re.escape(name)
    pattern = re.compile(rf"\s*(?:\[+\s*)?[\"']?{key}[\"']?\s*[=.\]]")
    return next((number for number, line in enumerate(text.split("\n"), 1) if pattern.match(line)), 1)
