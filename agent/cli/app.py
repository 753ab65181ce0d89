"""Assemble the command line: all commands, and the exit code and message of every error.

Heavy modules are imported inside the command that needs them, so that `--help` answers at once.
"""

from __future__ import annotations

import sys
from copy import copy
from typing import Annotated, Any

import typer

from agent import __version__
from agent.cli.bag import bag_app
from agent.cli.batch import batch
from agent.cli.benchmark import benchmark
from agent.cli.chat import chat
from agent.cli.config import ConfiguredGroup, config_app
from agent.cli.doctor import doctor
from agent.cli.evaluate.app import evaluate_app
from agent.cli.export import export_app
from agent.cli.generate import generate
from agent.cli.mcp import mcp
from agent.cli.models import models_app
from agent.cli.options import print_error
from agent.cli.parse import parse
from agent.cli.report import replay, report
from agent.cli.run import run
from agent.cli.scene import scene_app
from agent.cli.serve import serve
from agent.cli.shell_completion import completion
from agent.cli.structures import structures_app, teach
from agent.cli.train import train_app
from agent.errors import BAD_INPUT, DONE, INTERRUPTED, USAGE, exit_code_of, one_sentence
from agent.runtime.interruption import ignore_further_interruptions
from agent.runtime.termination import Terminated, termination_raised

# Typer carries its own copy of click in some versions and uses the installed one in others; its public
# BadParameter is a usage error in both, and that is the general click error.
_ClickError: Any = typer.BadParameter.__bases__[0].__bases__[0]

app = typer.Typer(
    cls=ConfiguredGroup,
    name="structagent",
    help="Turn an instruction into a built structure: parse it, observe the table, sample and rank arrangements, and "
    "build the best one with a simulated Jaco arm.\n\n"
    'Example: structagent run "put the cups in a small circle on the left"',
    epilog="Exit codes: 0 done; 2 usage error; 3 instruction not understood, or not buildable with these objects; "
    "4 no valid goal; 5 execution failed; 6 bad input; 7 a network differs from its model card; "
    "8 built with only some of the requested objects; 130 interrupted; 143 terminated.",
    add_completion=False,
    no_args_is_help=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
app.add_typer(evaluate_app, name="evaluate")
app.add_typer(scene_app, name="scene")
app.add_typer(config_app, name="config")
app.add_typer(bag_app, name="bag")
app.add_typer(export_app, name="export")
app.add_typer(models_app, name="models")
app.add_typer(structures_app, name="structures")
app.command("chat")(chat)


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"structagent {__version__}")
        raise typer.Exit()


@app.callback()
def _common(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version and exit.")
    ] = False,
    trust_project: Annotated[
        bool,
        typer.Option(
            "--trust-project",
            help="Allow the project's structagent.toml to name a language model folder, and endpoints on other "
            "machines. Keys are never sent to an endpoint that the file names.",
        ),
    ] = False,
) -> None:
    """Take the options before the command."""


app.command("run")(run)
app.command("batch")(batch)
app.command("replay")(replay)
app.command("report")(report)
app.command("parse")(parse)
app.command("teach")(teach)
app.command("serve")(serve)
app.command("mcp")(mcp)
app.command("generate")(generate)
app.add_typer(train_app, name="train")
app.command("benchmark")(benchmark)
app.command("doctor")(doctor)
app.command("completion")(completion)


def _usage_sentence(error: Exception) -> str:
    """Return a click error as one sentence, with the legal commands if one was missing or unknown."""
    message = error.format_message().rstrip(".").replace("Value error, ", "")  # type: ignore[attr-defined]
    # Newer versions of typer check values with pydantic, whose messages do not contain the value.
    details: Any = getattr(error.__cause__, "errors", tuple)()
    for detail in details:
        given = repr(detail["input"])
        message += "" if given in message else f" (got {given})"
    command = getattr(getattr(error, "ctx", None), "command", None)
    verbs = getattr(command, "commands", None)
    return message[:1].lower() + message[1:] + (f"; commands: {', '.join(verbs)}" if verbs else "")


_ABOUT_ALL = ("config", "completion")  # they list the options of all commands


def _app_for(arguments: list[str]) -> typer.Typer:
    """Return the app with the called command alone: making all of them from their signatures takes 0.2 seconds.

    Where no command is called, or an unknown one, all are there to be named.
    """
    verb = next((word for word in arguments if not word.startswith("-")), None)
    if verb in _ABOUT_ALL:
        return app
    commands = [each for each in app.registered_commands if each.name == verb]
    groups = [each for each in app.registered_groups if each.name == verb]
    if not (commands or groups):
        return app
    smaller = copy(app)
    smaller.registered_commands, smaller.registered_groups = commands, groups
    return smaller


def main(arguments: list[str] | None = None) -> None:
    """Run the command line and end the process with its exit code; every error is one sentence."""
    sys.exit(command_line(arguments))


def command_line(arguments: list[str] | None = None) -> int:
    """Run one command line; return its exit code. Defects of structagent are raised, all other errors printed as a
    sentence.
    """
    try:
        with termination_raised():
            called = _app_for(sys.argv[1:] if arguments is None else arguments)
            code = called(args=arguments, prog_name="structagent", standalone_mode=False)
        sys.stdout.flush()
        if code == INTERRUPTED:  # typer swallows the interruption itself
            ignore_further_interruptions()
            print_error("interrupted")
        return code if isinstance(code, int) else DONE
    except _ClickError as error:
        print_error(_usage_sentence(error))
        return USAGE
    except Terminated as ended:
        print_error(ended.reason)
        return int(ended.code or 0)
    except (KeyboardInterrupt, typer.Abort):
        ignore_further_interruptions()
        print_error("interrupted")
        return INTERRUPTED
    except MemoryError:
        print_error("there is not enough memory; end other programs, or raise the limit of this one (ulimit -v)")
        return BAD_INPUT
    except ImportError as error:
        if (error.name or "").partition(".")[0] in ("agent", "grounding", "structdiffusion"):
            raise
        print_error(f"cannot load a library: {one_sentence(error)}; `structagent doctor` suggests a repair")
        return BAD_INPUT
    except Exception as error:
        code = exit_code_of(error)
        if code is None:
            raise
        print_error(one_sentence(error))
        return code
