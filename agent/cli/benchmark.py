"""Measure the seconds of decisions on this machine, and how they grow: `structagent benchmark`."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import Annotated, Any

import typer

from agent.cli.benchmark_tables import decision_tables, growth_tables, sampling_table
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
            help="Structure to plan. Repeatable. By default a circle of 7 objects, a tower of 4, a circle of "
            "10, and a tower of up to 10.",
        ),
    ] = None,
    objects: Annotated[int, typer.Option(metavar="N", min=1, help="Objects in the structure.")] = _OBJECTS,
    candidates: Annotated[int, typer.Option(metavar="N", min=1, help="Arrangements to sample and rank.")] = 64,
    runs: Annotated[
        int, typer.Option(metavar="N", min=1, help="Timed decisions, each on a different scene, after one warm-up.")
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
    ray: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS",
            help='With --sweep: read the batches on this Ray cluster as well; "local" starts one here.',
        ),
    ] = None,
    reference: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Checkout of the released StructDiffusion (its code is run): time its network in the same run, on the "
            "scene of the first decision, beside the model.",
        ),
    ] = None,
    json_output: JsonOption = False,
) -> None:
    """Measure the seconds of decisions, step by step.

    A decision runs from the observed point clouds to arrangements that are ranked and tried in physics. Each run uses
    another scene of procedural objects. Tables in Markdown have the medians of the whole and of each step.

    Example: structagent benchmark --structure circle --objects 7
    """
    _check(ctx, structure, sweep, largest, ray, reference)
    check_folder(sweep)
    import_pybullet_silently()
    import torch

    torch.set_num_threads(threads)
    with results_stream() as results:
        if sweep is not None:
            rows = _sweep(model, runs, largest, weights, ray, sweep)
            print(json.dumps(rows) if json_output else growth_tables(rows), file=results)
            return
        from structdiffusion.benchmark import latency

        chosen = structure is not None or _is_given(ctx, "objects")
        decisions = [(shape, objects) for shape in structure or [_SHAPE]] if chosen else latency.DECISIONS
        # A folder that is no checkout is refused before anything is measured.
        sampling = [] if reference is None else _sampling(reference, model, decisions[0], runs, weights)
        rows = latency.measure_decisions(model, decisions, candidates, runs, weights)
        if json_output:
            print(json.dumps([*rows, *sampling]), file=results)
        else:
            tables = [decision_tables(rows), *([sampling_table(sampling, rows[0])] if sampling else [])]
            print("\n\n".join(tables), file=results)


def _sweep(
    model: str, runs: int, largest: int | None, weights: Path | None, ray: str | None, folder: Path
) -> list[dict[str, Any]]:
    """Measure all growths, write them and their plot to a folder, and return them."""
    from agent.runtime.ray_cluster import ray_cluster
    from grounding.atomic_files import write_whole
    from structdiffusion.benchmark import growth

    processes = max(2, os.cpu_count() or 2)
    with nullcontext() if ray is None else ray_cluster(ray, None) as ray_workers:
        grown = growth.measure_growth(model, runs, largest, weights, processes, ray_workers)
    report = growth.growth_json(grown)
    growth.plot(grown, folder / PLOT)
    write_whole(folder / REPORT, report)
    print(f"wrote {folder / REPORT}\nwrote {folder / PLOT}", file=sys.stderr)
    return json.loads(report)


def _sampling(
    checkout: Path, model: str, decision: tuple[str, int], runs: int, weights: Path | None
) -> list[dict[str, Any]]:
    """Time the released network and the model on one scene.

    Raises:
        UsageError: if the model does not denoise.
    """
    from structdiffusion.benchmark import latency, released_network
    from structdiffusion.planners.diffusion import DiffusionPlanner

    released = released_network.ReleasedNetwork(checkout)
    planner = latency.loaded(model, weights)
    if not isinstance(planner, DiffusionPlanner):
        raise UsageError(f"--reference compares denoising steps, but --model {model} has none")
    shape, objects = decision
    (scene,) = latency.observed_scenes(shape, objects, 1)
    return [row.to_dict() for row in released_network.measure_sampling(released, planner, model, shape, scene, runs)]


def _check(
    ctx: typer.Context,
    structure: Sequence[str] | None,
    sweep: Path | None,
    largest: int | None,
    ray: str | None,
    reference: Path | None,
) -> None:
    """Refuse options that contradict one another, and unknown structures."""
    given = [f"--{name}" for name in ("structure", "objects", "candidates") if _is_given(ctx, name)]
    if sweep is not None and given:
        raise UsageError(f"--sweep varies the sizes itself; leave out {' and '.join(given)}")
    if sweep is not None and reference is not None:
        raise UsageError("--reference times a single scene; leave out --sweep")
    if largest is not None and sweep is None:
        raise UsageError("--largest needs --sweep")
    if ray is not None and sweep is None:
        raise UsageError("--ray needs --sweep")
    for shape in structure or ():
        if shape not in SHAPES:
            raise UsageError(f"--structure cannot be {shape!r}; legal values: {', '.join(SHAPES)}")


def _is_given(ctx: typer.Context, name: str) -> bool:
    """Tell whether an option stands on the command line."""
    source = ctx.get_parameter_source(name)
    return source is not None and source.name == "COMMANDLINE"
