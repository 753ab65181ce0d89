"""Measure the seconds of decisions on this machine, and how they grow: `structagent benchmark`."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from agent.cli.options import JsonOption, ModelOption, WeightsOption
from agent.errors import UsageError
from agent.runtime.output_paths import check_folder
from agent.runtime.stdio import import_pybullet_silently, results_stream
from grounding.spec import SHAPES

REPORT, PLOT = "benchmark.json", "benchmark.png"
_SHAPE, _OBJECTS = "circle", 7


def benchmark(
    ctx: typer.Context,
    model: ModelOption = "diffusion-tokens",
    weights: WeightsOption = None,
    structure: Annotated[
        list[str] | None,
        typer.Option(
            metavar="|".join(SHAPES),
            help="Structure to decide about. Repeatable. By default a circle of 7 objects, a tower of 4, a circle of "
            "10, and a tower of up to 10.",
        ),
    ] = None,
    objects: Annotated[int, typer.Option(metavar="N", min=1, help="Objects in the structure.")] = _OBJECTS,
    candidates: Annotated[int, typer.Option(metavar="N", min=1, help="Arrangements to sample and rank.")] = 64,
    runs: Annotated[
        int, typer.Option(metavar="N", min=1, help="Timed decisions, each about another scene, after one warm-up.")
    ] = 7,
    # The tensors are too small to share: two threads that wait for each other take several times as long as one.
    threads: Annotated[int, typer.Option(metavar="N", min=1, help="Threads of PyTorch.")] = 1,
    sweep: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Measure how seconds and memory grow with candidates, objects, points and instructions, and write "
            f"{REPORT} and {PLOT} to DIR.",
        ),
    ] = None,
    largest: Annotated[
        int | None, typer.Option(metavar="N", min=2, help="With --sweep: leave out sizes above N.")
    ] = None,
    json_output: JsonOption = False,
) -> None:
    """Measure the seconds of decisions, step by step.

    A decision runs from the observed point clouds to arrangements that are ranked and tried in physics. Each run
    decides about another scene of procedural objects. Medians are reported of the whole and of each step.

    Example: structagent benchmark --structure circle --objects 7
    """
    _check(ctx, structure, sweep, largest)
    check_folder(sweep)
    import_pybullet_silently()
    import torch

    from agent.runtime.atomic_files import write_whole
    from structdiffusion.benchmark import growth, latency

    torch.set_num_threads(threads)
    with results_stream() as results:
        if sweep is not None:
            grown = growth.measure_growth(model, runs, largest, weights)
            report = growth.growth_json(grown)
            growth.plot(grown, sweep / PLOT)
            write_whole(sweep / REPORT, report)
            print(f"wrote {sweep / REPORT}\nwrote {sweep / PLOT}", file=sys.stderr)
            rows = json.loads(report)
            print(json.dumps(rows) if json_output else _growth_table(rows), file=results)
            return
        chosen = structure is not None or _is_given(ctx, "objects")
        decisions = [(shape, objects) for shape in structure or [_SHAPE]] if chosen else latency.DECISIONS
        rows = latency.measure_decisions(model, decisions, candidates, runs, weights)
        print(json.dumps(rows) if json_output else "\n\n".join(map(_table, rows)), file=results)


def _check(ctx: typer.Context, structure: Sequence[str] | None, sweep: Path | None, largest: int | None) -> None:
    """Refuse options that contradict one another, and unknown structures."""
    given = [f"--{name}" for name in ("structure", "objects", "candidates") if _is_given(ctx, name)]
    if sweep is not None and given:
        raise UsageError(f"--sweep varies the sizes itself; leave out {' and '.join(given)}")
    if largest is not None and sweep is None:
        raise UsageError("--largest bounds the sizes of --sweep, which is not given")
    for shape in structure or ():
        if shape not in SHAPES:
            raise UsageError(f"--structure cannot be {shape!r}; legal values: {', '.join(SHAPES)}")


def _is_given(ctx: typer.Context, name: str) -> bool:
    """Tell whether an option stands on the command line."""
    source = ctx.get_parameter_source(name)
    return source is not None and source.name == "COMMANDLINE"


def _table(row: dict[str, Any]) -> str:
    """Describe one decision in a sentence, and its steps in a table."""
    threads = "1 thread" if row["threads"] == 1 else f"{row['threads']} threads"
    spread = f"median of {row['runs']} runs; {row['seconds_min']:.2f} to {row['seconds_max']:.2f}"
    objects = " to ".join(map(str, sorted({row["objects"][0], row["objects"][-1]})))
    lines = [
        f"{row['model']}, {row['structure']}, {objects} objects, {row['candidates']} candidates, {threads}: "
        f"{row['seconds_median']:.2f} s ({spread}), CPU {row['cpu_seconds_median']:.2f} s",
        f"  {'step':<20} {'seconds':>8} {'CPU':>8} {'calls':>6}",
    ]
    for step in row["steps"]:
        cost = f"{step['seconds']:8.3f} {step['cpu_seconds']:8.3f} {step['calls']:6.0f}"
        lines.append(f"  {step['step']:<20} {cost}")
    return "\n".join(lines)


def _growth_table(rows: Sequence[dict[str, Any]]) -> str:
    """Describe each growth in a line with its exponent, and its sizes in a table."""
    lines = []
    for row in rows:
        exponent = "" if row["exponent"] is None else f": grows with exponent {row['exponent']:.2f}"
        lines += [f"{row['size']} ({row['held']}){exponent}", f"  {'size':>8} {'seconds':>9} {'CPU':>9} {'MB':>8}"]
        for size, seconds, cpu, memory in zip(row["sizes"], row["seconds"], row["cpu_seconds"], row["megabytes"]):
            lines.append(f"  {size:>8} {seconds:>9.3f} {cpu:>9.3f} {'' if memory is None else f'{memory:.1f}':>8}")
    return "\n".join(lines)
