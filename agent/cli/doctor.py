"""`structagent doctor`."""

from __future__ import annotations

from typing import Annotated

import typer

from agent.cli.options import JsonOption
from agent.diagnostics.doctor import SECONDS, tell_all
from agent.errors import DONE
from agent.runtime.stdio import results_stream


def doctor(
    json_output: JsonOption = False,
    timeout: Annotated[
        float, typer.Option(metavar="SECONDS", min=1.0, help="How long one check may take before it counts as hanging.")
    ] = SECONDS,
) -> None:
    """What works here and what does not: packages, weights, language models, physics, GPU; and what mends it.

    Ends with 0 if everything works that is needed, else with 6. Where this command itself does not start,
    `python -m agent.diagnostics.doctor` does.

    Example: structagent doctor --json
    """
    with results_stream() as results:
        code = tell_all(timeout, json_output, results)
    if code != DONE:
        raise typer.Exit(code)
