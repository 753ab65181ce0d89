"""Define the group of all evaluations: `structagent evaluate`."""

from __future__ import annotations

from collections.abc import Callable

import typer

from agent.cli.evaluate.components import ON_SCENES, coverage, discriminators, evaluate_on_scenes, picks, segmentation
from agent.cli.evaluate.environment import environment
from agent.cli.evaluate.figures import figures
from agent.cli.evaluate.goals import goals
from agent.cli.evaluate.language import language, parse
from agent.cli.evaluate.latency import chat
from agent.cli.evaluate.loop import loop
from agent.cli.evaluate.planners import arm, recordings, success
from agent.cli.evaluate.steering import steering

evaluate_app = typer.Typer(rich_markup_mode=None)


@evaluate_app.callback()
def _evaluate() -> None:
    """Measure planners, parsers and their parts.

    Example: structagent evaluate success --objects ycb --scenes 50
    """


def _add(*commands: Callable[..., None]) -> None:
    """Add commands that are named like their functions."""
    for command in commands:
        evaluate_app.command(command.__name__)(command)


_add(success, goals, figures, arm, loop, steering, environment, picks, recordings, segmentation)
for _name, _help in ON_SCENES.items():
    evaluate_app.command(_name, help=_help)(evaluate_on_scenes)
_add(parse, language, discriminators, coverage, chat)
