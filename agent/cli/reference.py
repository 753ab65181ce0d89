"""Generate the reference of the command line, `docs/cli.md`, from the commands.

`python -m agent.cli.reference` writes it; with `--check` it compares the file with the commands, and ends with 1 if
they differ. The result is the same on every machine, whatever is configured there.
"""

from __future__ import annotations

import difflib
import re
import sys
from collections.abc import Iterator
from pathlib import Path

import typer

import agent
from agent.cli.app import app
from agent.cli.command_tree import Command, Parameter, command_tree
from agent.cli.config import configurable
from agent.runtime.settings import KEY_VARIABLE, PROJECT_FILE, SETTINGS
from grounding.figures.names import VARIABLE as STRUCTURES

FILE = Path(agent.__file__).resolve().parents[1] / "docs" / "cli.md"

# Defaults that depend on the machine: command and option -> text instead of the number.
_OF_THE_MACHINE = {
    ("evaluate arm", "workers"): "the number of cores",
    ("evaluate recordings", "workers"): "the number of cores",
    ("evaluate completion", "workers"): "the number of cores",
    ("evaluate segmentation", "workers"): "the number of cores",
    ("evaluate picks", "workers"): "the number of cores",
    ("evaluate nouns", "workers"): "the number of cores",
    ("evaluate language", "workers"): "the number of cores",
    ("evaluate coverage", "workers"): "the number of cores",
}
_VARIABLE = {setting.name: setting.variable for setting in SETTINGS}
_EXAMPLE = "Example: "
_DEFAULT = re.compile(r"\s*\[default: (.*)\]$")  # in a help text, if it replaces the default of the code

_TITLE = """\
# Command-line reference

This page is generated from the commands by `python -m agent.cli.reference`; do not edit it by hand.
"""

_EXIT_CODES = """\
## Exit codes

| code | meaning |
|---|---|
| 0 | done |
| 1 | a defect of structagent itself; a chat, a batch or a reading of many lines continues all the same |
| 2 | usage error: an illegal option or value |
| 3 | the instruction was not understood, or cannot be built with these objects |
| 4 | no valid goal was found |
| 5 | the arm could not build the structure, or it does not stand as specified |
| 6 | bad input: a file, folder or setting that cannot be used |
| 7 | a network differs from its model card (`structagent models verify`) |
| 8 | built with only some of the requested objects, because the others could not take part |
| 9 | an arm (`--robot`) carried out every motion; what stands there was not verified |
| 10 | an arm (`--robot`) was not moved: it cannot be reached, is not as planned, or nobody approved |
| 130 | interrupted: Ctrl-C, at any moment; a second one does not wait for the end of the first |
| 143, 129 | ended by SIGTERM; the terminal was closed (SIGHUP) |

An error is one sentence on standard error. Standard output has only results.
"""

_FILES = f"""\
## Files

| file | what |
|---|---|
| `{PROJECT_FILE}` | settings of a project, in the current folder or one above: lines such as `seed = 3` |
| `~/.config/structagent/config.toml` | settings of a user; in `XDG_CONFIG_HOME` if that is set |
| `~/.cache/structagent/` | what need not be computed or downloaded twice; in `XDG_CACHE_HOME` if that is set |
| `out/TIME-seedSEED/` | the report of a run without `--out`: `report.html`, `report.json`, pictures |

Options take precedence over the environment, then come the file of the project, the file of the user, and the default.
"""


def reference() -> str:
    """Return the reference as Markdown."""
    root = typer.main.get_command(app)
    program = command_tree(root)
    configured = {(" ".join(path), option.name) for path, option in configurable(root)}
    return "\n".join([_TITLE, *_section(program, configured), _EXIT_CODES, _environment(), _FILES])


def _section(command: Command, configured: set[tuple[str, str]], alike: Command | None = None) -> Iterator[str]:
    """Describe a command, then its subcommands; the options are left to `alike`, a command that has the same."""
    about, example = _described(command.help)
    name = " ".join(command.path)
    yield f"## {name}\n"
    yield f"```\n{_synopsis(command)}\n```\n"
    yield from about
    arguments = [each for each in command.parameters if not each.flags]
    options = [each for each in command.parameters if each.flags]
    if alike is not None:
        other = " ".join(alike.path)
        yield f"**Options**: those of [`{other}`](#{other.replace(' ', '-')}).\n"
    for title, parameters in (("Arguments", arguments), ("Options", options)):
        if parameters and alike is None:
            yield f"**{title}**\n"
            yield "\n".join(_item(command, each, configured) for each in parameters) + "\n"
    if command.commands:
        yield "**Commands**\n"
        yield (
            "\n".join(
                f"- [`{name} {inner}`](#{name.replace(' ', '-')}-{inner}): {_first(each.help)}"
                for inner, each in command.commands.items()
            )
            + "\n"
        )
    if example:
        yield f"**Example**\n\n```sh\n{example}\n```\n"
    described: list[Command] = []
    for inner in command.commands.values():
        alike = next((one for one in described if one.parameters and one.parameters == inner.parameters), None)
        yield from _section(inner, configured, alike)
        described.append(inner)


def _described(text: str) -> tuple[list[str], str]:
    """Return the paragraphs of a help text, and its example, empty if there is none."""
    paragraphs, example = [], ""
    for paragraph in text.split("\n\n"):
        if paragraph.startswith("\b\n"):  # preformatted
            paragraphs.append("```\n" + paragraph[2:].rstrip() + "\n```\n")
        elif paragraph.startswith(_EXAMPLE):
            example = " ".join(paragraph.removeprefix(_EXAMPLE).split())
        elif paragraph.strip():
            paragraphs.append(" ".join(paragraph.split()) + "\n")
    return paragraphs, example


def _first(text: str) -> str:
    return " ".join(text.partition("\n\n")[0].split())


def _synopsis(command: Command) -> str:
    words = [*command.path, "[OPTIONS]"]
    words += [f"{'/'.join(each.flags)} {each.metavar}" for each in command.parameters if each.flags and each.required]
    if command.commands:
        return " ".join([*words, "COMMAND ..."])
    for each in command.parameters:
        if not each.flags:
            name = each.metavar + ("..." if each.repeated else "")
            words.append(name if each.required else f"[{name}]")
    return " ".join(words)


def _item(command: Command, parameter: Parameter, configured: set[tuple[str, str]]) -> str:
    """Return an option or argument as a list item."""
    path = " ".join(command.path[1:])
    flags = ", ".join(parameter.flags) + (f" {parameter.metavar}" if parameter.flags and parameter.metavar else "")
    text, explained = _DEFAULT.sub("", parameter.help), _DEFAULT.search(parameter.help)
    default = explained[1] if explained else parameter.default and f"`{parameter.default}`"
    default = _OF_THE_MACHINE.get((path, parameter.name), default)
    variable = _VARIABLE[parameter.name] if parameter.flags and (path, parameter.name) in configured else ""
    notes = [
        text.rstrip(".") + "." if text else "",
        f"At least {parameter.least:g}." if parameter.least is not None else "",
        "Required." if parameter.required and parameter.flags else "",
        f"Default: {default}." if default else "",
        f"Environment: `{variable}`." if variable else "",
    ]
    described = " ".join(note for note in notes if note)
    return f"- `{flags or parameter.metavar}`" + (f": {described}" if described else "")


def _environment() -> str:
    rows = [
        f"| `{setting.variable}` | the default of `--{setting.name.replace('_', '-')}`: {setting.legal} |"
        for setting in SETTINGS
    ]
    rows += [
        f"| `{KEY_VARIABLE}` | the key of the endpoint that `--llm-url`, `STRUCTAGENT_LLM_URL` or the user's file "
        "names, sent to no other host; where it is not set, `OPENAI_API_KEY` is sent to https://api.openai.com alone |",
        f"| `{STRUCTURES}` | the folder of taught [figures](figures.md), in place of the one beside the user's file |",
        "| `NO_COLOR`, `TERM=dumb` | no colour and no cursor control; pictures are drawn with ASCII characters |",
    ]
    return "\n".join(["## Environment\n", "| variable | what |", "|---|---|", *rows]) + "\n"


def main(arguments: list[str]) -> int:
    """Write the reference, or check it (`--check`); return the exit code."""
    if arguments not in ([], ["--check"]):
        print(f"python -m agent.cli.reference takes --check or nothing, not {' '.join(arguments)!r}", file=sys.stderr)
        return 2
    made = reference()
    if not arguments:
        FILE.write_text(made, encoding="utf-8")
        return 0
    kept = FILE.read_text(encoding="utf-8") if FILE.is_file() else ""
    changes = difflib.unified_diff(kept.splitlines(), made.splitlines(), FILE.name, "the commands", lineterm="")
    print(*changes, sep="\n", end="\n" if kept != made else "", file=sys.stderr)
    return int(kept != made)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
