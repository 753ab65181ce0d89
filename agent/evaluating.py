"""`structagent evaluate success`: every model on the same scenes, in one table with n and 95 % intervals."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, TextIO

from rich.progress import Progress

from agent import __version__
from agent.events import json_value
from agent.planning import checked_planner
from agent.telling import aligned
from agent.training import progress_bar
from grounding.corpus import sentences
from grounding.embedding_parser import EmbeddingParser
from structdiffusion.evaluation import Evaluation, evaluate_success, wilson_interval
from structdiffusion.evaluation_scenes import EvaluationScene, draw_evaluation_scenes
from structdiffusion.objects.libraries import load_objects
from structdiffusion.planners import PLANNERS
from structdiffusion.sampling import load_planner

SCHEMA_VERSION = 1
Row = dict[str, Any]
# Planners that get the sentence. They are ranked by what the parser heard in it, not by the true slots.
SPOKEN_TO = tuple(name for name, parts in PLANNERS.items() if parts.sentence)


def drawn_scenes(objects: str, count: int, seed: int, workers: int, progress: Progress) -> list[EvaluationScene]:
    """`count` scenes of each structure, from a library as `load_objects` takes it."""
    drawing = progress.add_task("scenes", total=None)
    scenes = []
    for scene in draw_evaluation_scenes(load_objects(objects), count, seed=seed, workers=workers):
        scenes.append(scene)
        progress.update(drawing, completed=len(scenes))
    return scenes


def report_of(command: str, rows: Sequence[Row], rates: Callable[[Sequence[Row]], Row]) -> Row:
    """A report of rows that each have a structure: the rows, and what `rates` makes of each structure's and of all."""
    return {
        "schema_version": SCHEMA_VERSION,
        "version": __version__,
        "command": command,
        "rows": list(rows),
        "aggregate": {
            structure: rates([row for row in rows if structure in ("all", row["structure"])])
            for structure in (*dict.fromkeys(row["structure"] for row in rows), "all")
        },
    }


def rate_of(hits: Sequence[bool]) -> dict[str, float]:
    """How many of some trials were hits, JSON-ready, with the 95 % Wilson interval of their rate."""
    count = sum(map(bool, hits))
    low, high = wilson_interval(count, len(hits))
    return {"count": count, "n": len(hits), "rate": count / max(1, len(hits)), "low": low, "high": high}


def measure_success(
    objects: str,
    names: Sequence[str],
    weights: Path | None,
    count: int,
    seed: int,
    candidates: int,
    top_k: int,
    workers: int,
) -> dict[str, Any]:
    """Success, failure classes and success@k of each planner on the same scenes, JSON-ready.

    Args:
        objects: as `load_objects` takes it.
        names: of the planners, as `load_planner` takes them.
        weights: the folder of checkpoints, or `None` for those shipped.
        count: scenes per structure.
        seed: of scenes, sensor noise and sampling.
        candidates: arrangements that a planner proposes per scene.
        top_k: how many of them are tried at most.
        workers: processes.
    """
    for name in names:  # an unknown name or a broken checkpoint is known before any scene is drawn
        checked_planner(name, weights)
    evaluations = []
    with progress_bar() as progress:
        scenes = drawn_scenes(objects, count, seed, workers, progress)
        heard, scenes = spoken_scenes(scenes, heard=True), spoken_scenes(scenes, heard=False)
        for name in names:
            task = progress.add_task(name, total=len(scenes))
            results = []
            told = heard if name in SPOKEN_TO else scenes
            for result in evaluate_success(
                partial(load_planner, name, weights), told, candidates=candidates, top_k=top_k, workers=workers
            ):
                results.append(result)
                progress.update(task, completed=len(results))
            about = {"model": name, "objects": objects, "seed": seed, "candidates": candidates}
            evaluations.append(json_value(Evaluation(tuple(results), top_k, about).to_dict()))
    command = f"structagent evaluate success --objects {objects} --scenes {count} --seed {seed}"
    command += "".join(f" --model {name}" for name in names)
    command += f" --weights {weights}" if weights else ""
    command += f" --candidates {candidates} --top-k {top_k}"
    return {
        "schema_version": SCHEMA_VERSION,
        "version": __version__,
        "command": command,
        "evaluations": evaluations,
    }


def spoken_scenes(scenes: Sequence[EvaluationScene], *, heard: bool) -> list[EvaluationScene]:
    """The scenes with one of the corpus's sentences each, in turn, and its embedding.

    Args:
        heard: put what the parser makes of each sentence along: all that a planner told in words may know.
    """
    words = []
    for scene in scenes:
        templates = sentences(scene.spec)
        words.append(templates[scene.number % len(templates)])
    parser = EmbeddingParser.from_pretrained()
    parses = parser.parse_batch(words) if heard else [None] * len(words)
    rows = zip(scenes, words, parser.encoder.encode(words), parses, strict=True)
    return [
        replace(scene, words=text, embedding=row, heard=parse.spec if parse else None)
        for scene, text, row, parse in rows
    ]


def tell_success(report: dict[str, Any], results: TextIO) -> None:
    """The table for people: a row per model and structure; all but n in percent."""
    top_k = report["evaluations"][0]["top_k"]
    failures = list(report["evaluations"][0]["aggregate"]["all"]["failures"])
    rows = [["model", "structure", "n", "success", "95 %", f"success@{top_k}", *failures]]
    for evaluation in report["evaluations"]:
        for structure, rates in evaluation["aggregate"].items():
            success = rates["success"]
            rows.append(
                [
                    evaluation["about"]["model"],
                    structure,
                    str(rates["n"]),
                    _percent(success["rate"]),
                    f"{_percent(success['low'])} to {_percent(success['high'])}",
                    _percent(rates["success_at"][str(top_k)]["rate"]),
                    *(_percent(rates["failures"][name]["rate"]) for name in failures),
                ]
            )
    print(aligned(rows, left=2), file=results)
    print(f"\nrates in percent, with 95 % Wilson intervals\n{report['command']}", file=results)


def write_report(report: dict[str, Any], path: Path) -> None:
    """The report as a JSON file; its folder is made where it is missing."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")


def _percent(share: float | None) -> str:
    return "-" if share is None else f"{100 * share:.0f}"
