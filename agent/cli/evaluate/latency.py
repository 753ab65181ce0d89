"""Measure how fast the chat answers: `structagent evaluate chat`."""

from __future__ import annotations

import json
from typing import Annotated, Any

import typer

from agent.cli.options import JsonOption, ModelOption, SceneOption
from agent.runtime.stdio import import_pybullet_silently, results_stream


def chat(
    scene: SceneOption = "simulated",
    model: ModelOption = "diffusion",
    runs: Annotated[int, typer.Option(metavar="N", min=5, help="Number of timed lines, after one for warming up.")] = 6,
    json_output: JsonOption = False,
) -> None:
    """Measure how fast the chat answers.

    An instruction and corrections of it are given one after another. Reports the seconds from Enter to the first words,
    and to the ranked arrangements.

    Example: structagent evaluate chat --scene desk.yaml --runs 10
    """
    import_pybullet_silently()
    from agent.chat.latency import measure

    with results_stream() as results:
        report = measure(runs, scene, model)
        print(json.dumps(report) if json_output else _sentence(report), file=results)


def _sentence(report: dict[str, Any]) -> str:
    return (
        f"{report['model']} on {report['scene']}: {report['reaction_seconds_median']:.3f} s from Enter to the first "
        f"words, {report['proposal_seconds_median']:.2f} s to ranked arrangements (medians of {report['runs']}; at "
        f"most {report['proposal_seconds_max']:.2f} s)"
    )
