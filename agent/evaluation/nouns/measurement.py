"""Measure how often objects in recordings get nouns, and how often these are right: `structagent evaluate nouns`.

Scenes are simulated, recorded into bags and perceived from there. A noun is right if an instruction with it means the
object: a mug that is called a cup is right, a carton that is called a bottle is not. Nouns of different confidence are
measured at once, so that the confidence from which on an object is named can be chosen on validation objects.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, TextIO

from agent.errors import BadInput
from agent.evaluation.recorded_masks import MATCHED, RecordingJob, overlaps_of, record_job
from agent.evaluation.recordings import draw_job
from agent.evaluation.report import (
    command_line,
    interval,
    left_out_note,
    percent,
    print_footer,
    print_table,
    rate_of,
    report_frame,
)
from agent.evaluation.rows import LOST, Row, collect, lost_scene_row
from agent.perception.nouns.evidence import likeliest
from agent.perception.nouns.recognition import CONFIDENT, HOW_TO_GET, nouns_available
from agent.perception.perceive import perceive
from agent.recordings.load import read_recording
from grounding.resolve.lexicon import meanings
from grounding.resolve.object_names import read_name
from grounding.spec import FIRST_SHAPES
from structdiffusion.objects.libraries import load_objects
from structdiffusion.parallel import in_parallel

_LEVELS = (0.5, 0.6, 0.65, 0.7, 0.75, 0.8, 0.85, 0.9)  # of confidence


def measure_nouns(objects: str, count: int, seed: int, workers: int) -> Row:
    """Measure the nouns over `count` recorded scenes of each structure; return a JSON-ready report.

    Args:
        objects: as for `load_objects`.
        count: scenes per structure.
        seed: of scenes and sensor noise.
        workers: processes.

    Raises:
        BadInput: if the weights of the network are not installed.
    """
    if not nouns_available():
        raise BadInput(HOW_TO_GET)
    library = load_objects(objects)
    jobs = [draw_job(library, objects, (shape, number), seed) for number in range(count) for shape in FIRST_SHAPES]
    recorded = in_parallel(partial(_rows, objects), tuple, (), jobs, workers)
    scenes, lost = collect("scenes recorded", recorded, len(jobs))
    rows = [row for scene in scenes for row in scene["objects"]]
    frame = report_frame(command_line("nouns", objects=objects, scenes=count, seed=seed), len(rows), seed)
    levels = {f"{level:g}": _rates(rows, level) for level in _LEVELS}
    missing = [lost_scene_row(seed, each) for each in lost]
    return frame | {"rows": rows, "confident": CONFIDENT, "levels": levels, LOST: missing}


def print_nouns(report: dict[str, Any], results: TextIO) -> None:
    """Print the table: a row per confidence."""
    table = [["confidence from", "objects", "named", "95 %", "right", "of the named", "95 %"]]
    for level, rates in report["levels"].items():
        named, right = rates["named"], rates["right"]
        in_use = " (in use)" if float(level) == report["confident"] else ""
        table.append([
            level + in_use, str(named["n"]), str(named["count"]), interval(named), str(right["count"]),
            f"{percent(right['rate'])} %", interval(right),
        ])  # fmt: skip
    print_table(table, results)
    print_footer(report, results, left_out_note(len(report[LOST])))


def is_right(word: str, truth: str) -> bool:
    """Return whether an instruction with a noun means an object whose true name is given."""
    return read_name(truth).head in {kind for kinds in meanings(word) for kind in kinds}


def _rows(objects: str, _: object, job: RecordingJob) -> Row:
    """Record one scene; return a row for each object that was found and exists, with the confidences of its nouns."""
    with TemporaryDirectory() as name:
        recording = record_job(job, objects, job.seed * 10_000 + job.number, Path(name))
        segments = perceive(read_recording(recording.bag))
    names, overlaps = list(recording.masks), overlaps_of(recording.masks, segments.labels)
    rows = []
    for found, overlap in zip(segments.objects, overlaps.T, strict=True):
        if overlap.max(initial=0.0) > MATCHED:
            rows.append({"truth": recording.nouns[names[int(overlap.argmax())]], "nouns": dict(found.nouns)})
    return {"structure": job.structure, "number": job.number, "objects": rows}


def _rates(rows: Sequence[Mapping[str, Any]], level: float) -> Row:
    """Return how many objects are named from a confidence on, and how many of these nouns are right."""
    taken = [(likeliest(row["nouns"], level), row["truth"]) for row in rows]
    named = [(words, truth) for words, truth in taken if words]
    return {
        "named": rate_of([bool(words) for words, _ in taken]),
        "right": rate_of([any(is_right(word, truth) for word in words) for words, truth in named]),
    }
