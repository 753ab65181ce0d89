"""Define the group of all evaluations: `structagent evaluate`."""

from __future__ import annotations

import typer

from agent.cli.evaluate.components import completion, coverage, discriminators, nouns, segmentation
from agent.cli.evaluate.goals import goals
from agent.cli.evaluate.language import language, parse
from agent.cli.evaluate.latency import chat
from agent.cli.evaluate.planners import arm, recordings, success

evaluate_app = typer.Typer(rich_markup_mode=None)


@evaluate_app.callback()
def _evaluate() -> None:
    """Measure planners, parsers and their parts.

    Example: structagent evaluate success --objects ycb --scenes 50
    """


_COMMANDS = (
    success, goals, arm, recordings, segmentation, nouns, completion, parse, language, discriminators, coverage, chat,
)  # fmt: skip
for _command in _COMMANDS:
    evaluate_app.command(_command.__name__)(_command)
