"""Check the installation: `structagent doctor`."""

from __future__ import annotations

from typing import Annotated

import typer

from agent.cli.options import JsonOption
from agent.diagnostics.doctor import SECONDS, run_doctor
from agent.errors import DONE
from agent.runtime.stdio import results_stream


def doctor(
    json_output: JsonOption = False,
    timeout: Annotated[
        float, typer.Option(metavar="SECONDS", min=1.0, help="Time after which a check counts as hanging.")
    ] = SECONDS,
) -> None:
    """Check this installation and suggest repairs.

    Packages, weights, language models, physics and GPU are checked. The exit code is 0 if everything that is required
    works, otherwise 6. If this command does not start, try `python -m agent.diagnostics.doctor`.

    Example: structagent doctor --json
    """
    with results_stream() as results:
        code = run_doctor(timeout, json_output, results)
    if code != DONE:
        raise typer.Exit(code)
