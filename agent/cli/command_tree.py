"""Collect the declared commands; shell completion and the reference are generated from them.

The signatures of the command functions are read where possible, because typer's inner classes change between versions.
"""

from __future__ import annotations

import inspect
import types
from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Annotated, Any, Union, get_args, get_origin, get_type_hints

FILES, FOLDERS = "files", "folders"
_METAVARS = {int: "N", float: "X", Path: "FILE"}


@dataclass(frozen=True)
class Parameter:
    """An option or an argument.

    Attributes:
        name: in the configuration and in the code.
        flags: such as "--execute", "--no-execute"; empty for an argument.
        metavar: placeholder of its value, such as "FILE"; empty for a switch, which takes none.
        values: legal words; others may be legal too.
        paths: `FILES` or `FOLDERS` if it may be a path, else empty.
        default: as written on the command line; `None` if it has none.
        required, repeated: whether it must be given, and may be given several times.
        least: the smallest legal number, or `None`.
        help: its help text.
    """

    name: str
    flags: tuple[str, ...]
    metavar: str
    values: tuple[str, ...]
    paths: str
    default: str | None
    required: bool
    repeated: bool
    least: float | None
    help: str


@dataclass(frozen=True)
class Command:
    """A command, or a group of commands.

    Attributes:
        path: the words that call it, starting with the program.
        help: its help text, in paragraphs.
        parameters: options and arguments, in order, without hidden ones.
        commands: the commands of a group by name, without hidden ones.
    """

    path: tuple[str, ...]
    help: str
    parameters: tuple[Parameter, ...]
    commands: Mapping[str, Command]


def command_tree(root: Any, program: str = "structagent") -> Command:
    """Read the program and all of its commands from the click command that typer makes."""
    return _command(root, (program,))


def _command(command: Any, path: tuple[str, ...]) -> Command:
    function = inspect.unwrap(command.callback) if command.callback else None
    hints = get_type_hints(function, include_extras=True) if function else {}
    parameters = [
        _parameter(parameter, hints[parameter.name])
        for parameter in command.params
        if parameter.name in hints and not getattr(parameter, "hidden", False)
    ]
    commands = {
        name: _command(inner, (*path, name))
        for name, inner in getattr(command, "commands", {}).items()
        if not inner.hidden
    }
    return Command(path, inspect.cleandoc(command.help or ""), tuple(parameters), commands)


def _parameter(parameter: Any, hint: Any) -> Parameter:
    declared, kind = None, hint
    if get_origin(hint) is Annotated:
        kind, declared = get_args(hint)[:2]
    kind = _value_type(kind)
    flags = (*parameter.opts, *parameter.secondary_opts) if parameter.param_type_name == "option" else ()
    switch = bool(flags) and kind is bool
    metavar = "" if switch else parameter.metavar or _metavar(kind, parameter.name, bool(flags))
    choices = metavar.split("|")
    complete = getattr(declared, "autocompletion", None)
    values = complete() if complete else [choice for choice in choices if choice == choice.lower() and not switch]
    return Parameter(
        parameter.name,
        flags,
        metavar,
        tuple(values),
        _paths(kind, choices),
        _written(parameter.default, parameter),
        parameter.required,
        parameter.multiple or parameter.nargs == -1,
        getattr(declared, "min", None),
        " ".join((parameter.help or "").split()),
    )


def _value_type(kind: Any) -> Any:
    """Return the type of one value: `int` for `list[int] | None`."""
    if get_origin(kind) in (Union, types.UnionType):
        kind = next(each for each in get_args(kind) if each is not type(None))
    return get_args(kind)[0] if get_origin(kind) in (list, tuple) else kind


def _metavar(kind: Any, name: str, option: bool) -> str:
    if isinstance(kind, type) and issubclass(kind, Enum):
        return "|".join(str(member.value) for member in kind)
    return _METAVARS.get(kind, "TEXT") if option else name.upper()


def _paths(kind: Any, choices: list[str]) -> str:
    if any(choice.startswith("FILE") for choice in choices):
        return FILES  # and the folders on the way to them
    if any(choice.startswith("DIR") for choice in choices):
        return FOLDERS
    return FILES if kind is Path else ""


def _written(default: Any, parameter: Any) -> str | None:
    if isinstance(default, bool):
        given = parameter.opts if default else parameter.secondary_opts
        return given[0] if parameter.secondary_opts else None
    if default is None or callable(default) or isinstance(default, list | tuple):
        return None
    return str(default.value if isinstance(default, Enum) else default)
