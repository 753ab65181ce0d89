"""Measure how a planner fills the slots that the instruction leaves open: `structagent evaluate coverage`.

If only the shape is specified, samples should differ in everything else. For each open slot, the evaluation measures
which of its values the samples realise, on the estimated bodies, and how evenly they spread over the values that fit.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TextIO

import numpy as np
import torch
from scipy.stats import t as student_t

from agent.evaluation.report import (
    command_line,
    left_out_note,
    percent,
    print_footer,
    print_table,
    report_by_structure,
    report_frame,
)
from agent.evaluation.rows import LOST, Row, collect, lost_scene_row
from agent.evaluation.scenes import with_sentences
from agent.pipeline.candidates import checked_planner, is_viable
from agent.rendering.text import number, slot_label
from grounding.spec import FIRST_SHAPES, SLOTS_OF_SHAPE, X_POSITIONS, StructureSpec
from structdiffusion.benchmark.scenes import EvaluationScene, draw_evaluation_scene
from structdiffusion.completion.estimate import estimate, imagined_bodies
from structdiffusion.data.scene_sampling import layout_item
from structdiffusion.geometry import yaw_of
from structdiffusion.objects.libraries import load_objects
from structdiffusion.objects.model import ObjectModel
from structdiffusion.observation import Arrangement, Scene, StructureGoal
from structdiffusion.parallel import in_parallel
from structdiffusion.planners.factory import Planner
from structdiffusion.protocol.slot_measurement import distinct_values, evenness, fitting_values, realised_spec
from structdiffusion.structures.structure import LayoutError

BEST = 5  # of the ranked samples: as many as success@k tries
# Groups of samples: all, those that the ranking calls viable, and the best of them.
SAMPLED, VIABLE, RANKED = "sampled", "viable", f"best {BEST}"


def measure_coverage(
    objects: str,
    model: str,
    weights: Path | None,
    count: int,
    seed: int,
    candidates: int,
    workers: int,
    allow_unverified: bool = False,
) -> Row:
    """Measure how evenly samples spread over the values of open slots; return a JSON-ready report.

    There are `count` scenes of each kind. The kinds are the four shapes with all other slots open, and an open shape
    with only the x position specified.

    Args: as `measure_arm`.
    """  # fmt: skip
    checked_planner(model, weights, allow_unverified)
    models = tuple(load_objects(objects))
    jobs = [(shape, place) for shape in (*FIRST_SHAPES, None) for place in range(count)]
    drawn = in_parallel(partial(_draw_scene, seed), tuple, (models,), jobs, workers)
    scenes, lost = collect("scenes drawn", drawn, len(jobs))
    scenes = with_sentences(scenes, parsed=False)
    load = partial(checked_planner, model, weights, allow_unverified)
    covered = in_parallel(partial(_coverage_rows, candidates), load, (), scenes, workers)
    found, lost_later = collect("scenes sampled", covered, len(scenes))
    rows = [row for rows in found for row in rows]
    command = command_line(
        "coverage", objects=objects, scenes=count, seed=seed, model=model, weights=weights, candidates=candidates,
        allow_unverified=allow_unverified,
    )  # fmt: skip
    left_out = [lost_scene_row(seed, one) for one in lost + lost_later]
    return report_by_structure(report_frame(command, len(rows), seed), rows, _spread) | {LOST: left_out}


def _draw_scene(seed: int, models: Sequence[ObjectModel], job: tuple[str | None, int]) -> EvaluationScene:
    shape, place = job
    spec = StructureSpec(x_position=X_POSITIONS[place % len(X_POSITIONS)]) if shape is None else StructureSpec(shape)
    return draw_evaluation_scene(models, shape, place, seed=seed, spec=spec)


def open_slots(spec: StructureSpec) -> list[str]:
    """Return the slots in which samples of a spec may differ. A circle without an orientation is closed."""
    if spec.shape is None:
        return ["shape"]  # what the other slots mean depends on it
    carried = [slot for slot in SLOTS_OF_SHAPE[spec.shape] if getattr(spec, slot) is None]
    return [slot for slot in carried if (spec.shape, slot) != ("circle", "rotation")]


def _coverage_rows(candidates: int, planner: Planner, scene: EvaluationScene) -> list[Row]:
    """Sample arrangements for a scene; return a row for each of its open slots."""
    seen, spec, drawn = scene.observed(), scene.spec, scene.drawn
    generator = torch.Generator().manual_seed(scene.planning_seed)
    try:
        goal = StructureGoal(spec, scene.words, scene.embedding)
        arrangements = planner.propose(seen, goal, count=candidates, generator=generator)
    except LayoutError:
        arrangements = []
    realised = _realised(seen, spec, arrangements)
    viable = [found for found, one in zip(realised, arrangements) if is_viable(one)]
    groups = {SAMPLED: realised, VIABLE: viable, RANKED: realised[:BEST]}
    poses = drawn.world_from_initial[: drawn.count]
    items = [layout_item(model, yaw_of(pose)) for model, pose in zip(drawn.models, poses)]
    rows = []
    for slot in open_slots(spec):
        fits = fitting_values(items, spec, slot, drawn.table, np.random.default_rng(scene.planning_seed))
        values = {name: [value for one in group if (value := getattr(one, slot))] for name, group in groups.items()}
        rows.append(
            {
                "structure": scene.structure,
                "slot": slot,
                "number": scene.number,
                "seed": scene.seed,
                "draw": scene.draw,
                "spec": spec.to_dict(),
                "objects": [model.name for model in drawn.models[: drawn.count]],
                "fits": list(fits),
                "realised": {name: dict(Counter(found)) for name, found in values.items()},
                "evenness": {name: evenness(found, fits) for name, found in values.items()},
            }
        )
    return rows


def _realised(scene: Scene, spec: StructureSpec, arrangements: Sequence[Arrangement]) -> list[StructureSpec]:
    objects = [estimate(cloud) for cloud in scene.objects]
    proposed = (imagined_bodies(objects, arrangement.goal_from_initial) for arrangement in arrangements)
    return [realised_spec(bodies, scene.table, spec.shape) for bodies in proposed]


def _spread(rows: Sequence[Row]) -> dict[str, Row]:
    """Return for each slot the number of scenes, and for each group of samples the evenness and the share of each
    value.
    """
    spread: dict[str, Row] = {}
    for slot in dict.fromkeys(row["slot"] for row in rows):
        of_slot = [row for row in rows if row["slot"] == slot]
        spread[slot] = {"n": len(of_slot)} | {
            name: {**_mean([row["evenness"][name] for row in of_slot]), "shares": _shares(of_slot, slot, name)}
            for name in (SAMPLED, VIABLE, RANKED)
        }
    return spread


def _mean(values: Sequence[float | None]) -> Row:
    """Return the mean of the values that are not `None`, with its 95 % interval by Student's t."""
    found = np.array([value for value in values if value is not None])
    if not len(found):
        return {"n": 0, "mean": None, "low": None, "high": None}
    mean, half = float(found.mean()), 1.0  # one scene gives no interval
    if len(found) > 1:
        half = float(student_t.ppf(0.975, len(found) - 1) * found.std(ddof=1)) / math.sqrt(len(found))
    return {"n": len(found), "mean": mean, "low": max(0.0, mean - half), "high": mean + half}


def _shares(rows: Sequence[Row], slot: str, name: str) -> dict[str, float]:
    """Return the share of each value among all samples."""
    total = sum((Counter(row["realised"][name]) for row in rows), Counter())
    shapes = {row["spec"]["shape"] for row in rows}
    legal = dict.fromkeys(value for shape in sorted(shapes, key=str) for value in distinct_values(shape, slot))
    return {value: total[value] / max(1, total.total()) for value in legal}


def print_coverage(report: Row, results: TextIO) -> None:
    """Print the table: a row per structure and open slot."""
    groups = (SAMPLED, VIABLE, RANKED)
    table = [
        ["structure", "open slot", "scenes", *(cell for name in groups for cell in (name, "95 %", "n")), "realised"]
    ]
    for structure, slots in report["aggregate"].items():
        for slot, found in slots.items():
            if structure == "all" and slot == "shape":
                continue  # the same scenes as above
            cells = [structure, slot_label(slot), str(found["n"])]
            for name in groups:
                spread = found[name]
                ends = f"{number(spread['low'], 2)} to {number(spread['high'], 2)}"
                cells += [number(spread["mean"], 2), ends, str(spread["n"])]
            shares = found[SAMPLED]["shares"].items()
            table.append([*cells, ", ".join(f"{value} {percent(share)} %" for value, share in shares)])
    print_table(table, results, left=2)
    explanation = (
        "entropy of the realised values, among those that fit, relative to that of as many even draws: 1 evenly "
        "spread, 0 "
        "all alike; means over n scenes with two such samples, 95 % intervals by Student's t"
    )
    print_footer(report, results, left_out_note(len(report[LOST])), explanation)
