"""Show the configuration with `structagent config`, and apply the configured defaults of options."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import typer
from typer.core import TyperGroup

from agent.cli.options import JsonOption, print_error
from agent.rendering.text import aligned, columns_of
from agent.runtime.configuration import ENVIRONMENT, PROJECT, ConfigError, Configuration, load
from agent.runtime.settings import SETTINGS
from agent.runtime.stdio import results_stream

if TYPE_CHECKING:
    from agent.pipeline.instruction_parser import ReadingOptions

config_app = typer.Typer(rich_markup_mode=None)

# Commands that work even if the configuration is broken.
_WITHOUT = ("doctor", "config", "completion")
# Options that share a setting's name and mean something else: nouns on the table, the library of the training data, and
# a number of objects.
_NOT_CONFIGURED = {("parse", "objects"), ("generate", "objects"), ("benchmark", "objects")}
DEFAULT = "default"
_CONFIGURATION = "structagent.configuration"  # where a command's context has it


class ConfiguredGroup(TyperGroup):
    """The top-level group; an option that is named like a setting has the configured value as its default."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Parse the options before the command, then make the configuration the defaults of the commands."""
        asks_for_help = "--help" in args
        rest = super().parse_args(ctx, args)  # ends here for --version and the like
        verb = next((name for name in args if name in self.commands), None)
        if ctx.resilient_parsing or verb in _WITHOUT:
            return rest
        try:
            configuration = load(trust_project=ctx.params.get("trust_project", False))
            ctx.meta[_CONFIGURATION] = configuration
            ctx.default_map = defaults_of(self, configuration)
        except ConfigError:
            if not asks_for_help:  # a user with a broken file may need help
                raise
        return rest


def defaults_of(group: Any, configuration: Configuration) -> dict[str, Any]:
    """Return click's `default_map`: command -> option -> configured value, nested like the groups."""
    defaults: dict[str, Any] = {}
    for path, option in configurable(group):
        if option.name in configuration.values:
            inner = defaults
            for name in path:
                inner = inner.setdefault(name, {})
            value = configuration.values[option.name].value
            inner[option.name] = [value] if option.multiple else value
    return defaults


def reading_options(
    ctx: typer.Context,
    parser: str,
    viewpoint: str,
    llm_model: str | None,
    llm_url: str | None,
) -> ReadingOptions:
    """Return how a command parses instructions; a key is only sent to an endpoint that the user, not the project,
    named.
    """
    from agent.pipeline.instruction_parser import ReadingOptions

    configuration = ctx.meta.get(_CONFIGURATION)
    configured = configuration.values.get("llm_url") if configuration is not None else None
    source = ctx.get_parameter_source("llm_url")
    by_flag = source is not None and source.name == "COMMANDLINE"
    by_project = not by_flag and configured is not None and configured.layer == PROJECT
    key_url = None if by_project else llm_url
    return ReadingOptions(parser, viewpoint, llm_model, llm_url, key_url=key_url)


def configurable(group: Any, path: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Any]]:
    """Give every option whose default comes from a setting, with the path of its command."""
    names = {setting.name for setting in SETTINGS}
    for name, command in group.commands.items():
        here = (*path, name)
        if hasattr(command, "commands"):
            yield from configurable(command, here)
            continue
        for option in command.params:
            named = option.name in names and option.param_type_name == "option"
            if named and (name, option.name) not in _NOT_CONFIGURED:
                yield here, option


@config_app.callback()
def _config() -> None:
    """Show the configuration.

    Options take precedence over the environment (STRUCTAGENT_SEED=3), the environment over structagent.toml in the
    current folder or the nearest one above, and that over structagent/config.toml in XDG_CONFIG_HOME or ~/.config. The
    files have lines such as: seed = 3

    Example: structagent config show
    """


@config_app.command("show")
def show(ctx: typer.Context, json_output: JsonOption = False) -> None:
    """Show all settings, their values, where these come from, and what is wrong with the files.

    Example: structagent config show --json
    """
    configuration = load(trust_project=ctx.find_root().params.get("trust_project", False), tolerant=True)
    _show(ctx, configuration, json_output)
    for problem in configuration.problems:
        print_error(problem)
    if configuration.problems:
        raise typer.Exit(ConfigError.exit_code)


def _show(ctx: typer.Context, configuration: Configuration, json_output: bool) -> None:
    rows = list(_rows(ctx.find_root().command, configuration))
    project, user = configuration.project_file, configuration.user_file
    with results_stream() as results:
        if json_output:
            files = {"project": project and str(project), "user": user and str(user)}
            told = {"settings": rows, "files": files, "problems": configuration.problems}
            print(json.dumps(told, indent=1, ensure_ascii=False), file=results)
            return
        table = [
            (
                row["name"],
                _value_text(row["value"]),
                DEFAULT if row["layer"] == DEFAULT else f"{row['layer']}: {row['place']}",
            )
            for row in rows
        ]
        print(aligned(table, width=columns_of(results)), file=results)
        missing = "" if user is None or user.is_file() else " (does not exist)"
        print(f"\nproject file: {project or 'none in this folder or above'}", file=results)
        print(f"user file:    {user or 'none without a home folder'}{missing}", file=results)


def _rows(root: Any, configuration: Configuration) -> Iterator[dict[str, Any]]:
    from grounding.parsers.llm_endpoint import key_variable

    verbs: dict[str, list[str]] = {}
    defaults: dict[str, Any] = {}
    for path, option in configurable(root):
        verbs.setdefault(option.name, []).append(" ".join(path))
        if option.default is not None:
            defaults.setdefault(option.name, getattr(option.default, "value", option.default))
    for setting in SETTINGS:
        given = configuration.values.get(setting.name)
        yield {
            "name": setting.name,
            "value": defaults.get(setting.name) if given is None else given.value,
            "layer": DEFAULT if given is None else given.layer,
            "place": None if given is None else given.place,
            "verbs": verbs.get(setting.name, []),
        }
    address = configuration.values.get("llm_url")
    key = key_variable(None if address is None else address.value)
    yield {
        "name": "llm_key",
        "value": "set, hidden" if key else None,
        "layer": ENVIRONMENT if key else DEFAULT,
        "place": key,
        "verbs": verbs.get("llm_url", []),
    }


def _value_text(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    return "not set" if value is None else str(value)
