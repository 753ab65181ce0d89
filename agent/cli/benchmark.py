"""Measure the seconds to sample and rank arrangements on this machine: `structagent benchmark`."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from agent.cli.options import JsonOption, ModelOption, WeightsOption
from agent.errors import UsageError
from agent.runtime.output_paths import check_folder
from agent.runtime.stdio import import_pybullet_silently, results_stream

REPORT, PLOT = "benchmark.json", "benchmark.png"


def benchmark(
    ctx: typer.Context,
    model: ModelOption = "diffusion-tokens",
    weights: WeightsOption = None,
    objects: Annotated[int, typer.Option(metavar="N", min=1, help="Objects in the structure.")] = 7,
    candidates: Annotated[int, typer.Option(metavar="N", min=1, help="Arrangements to sample and rank.")] = 64,
    runs: Annotated[int, typer.Option(metavar="N", min=1, help="Timed runs, after one warm-up.")] = 5,
    # The tensors are too small to share: two threads that wait for each other take several times as long as one.
    threads: Annotated[int, typer.Option(metavar="N", min=1, help="Threads of PyTorch.")] = 1,
    sweep: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help=f"Vary the numbers of objects and candidates, and write {REPORT} and {PLOT} to DIR.",
        ),
    ] = None,
    json_output: JsonOption = False,
) -> None:
    """Measure the seconds to sample and rank arrangements.

    The time from the observed point clouds to the ranked arrangements is measured, for a circle of procedural objects.
    The time that the physics rollout of the best arrangements adds is reported separately.

    Example: structagent benchmark --candidates 64 --objects 7
    """
    given = [f"--{name}" for name in ("objects", "candidates") if _is_given(ctx, name)]
    if sweep is not None and given:
        raise UsageError(
            f"--sweep varies the numbers of objects and candidates itself; leave out {' and '.join(given)}"
        )
    check_folder(sweep)
    import_pybullet_silently()
    import torch

    from agent.runtime.atomic_files import write_whole
    from structdiffusion.benchmark import latency

    torch.set_num_threads(threads)
    with results_stream() as results:
        if sweep is None:
            rows = [latency.measure(model, objects, candidates, runs, weights)]
        else:
            rows = latency.sweep(model, runs, weights)
            latency.plot(rows, sweep / PLOT)
            write_whole(sweep / REPORT, json.dumps(rows, indent=1) + "\n")
            print(f"wrote {sweep / REPORT}\nwrote {sweep / PLOT}", file=sys.stderr)
        if json_output:
            print(json.dumps(rows if sweep is not None else rows[0]), file=results)
        else:
            print(*map(_sentence, rows), sep="\n", file=results)


def _is_given(ctx: typer.Context, name: str) -> bool:
    """Tell whether an option stands on the command line."""
    source = ctx.get_parameter_source(name)
    return source is not None and source.name == "COMMANDLINE"


def _sentence(row: dict[str, Any]) -> str:
    """Describe one measurement in a sentence."""
    spread = f"median of {row['runs']} runs; {row['seconds_min']:.2f} to {row['seconds_max']:.2f}"
    rollout = f"; the physics rollout adds {row['rollout_seconds']:.2f} s" if row["rollout_seconds"] else ""
    threads = "1 thread" if row["threads"] == 1 else f"{row['threads']} threads"
    return (
        f"{row['model']}, {row['objects']} objects, {row['candidates']} candidates, {threads}: "
        f"{row['seconds_median']:.2f} s ({spread}){rollout}"
    )
