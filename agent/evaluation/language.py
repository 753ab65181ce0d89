"""`structagent evaluate language`: sentences straight through parsing, imagination and physics.

Each row of the parsing benchmark gets a scene for what it means. A planner solves the scene twice: told what the
parser heard, and told what is meant. What stands only when told is what parsing costs.
"""

from __future__ import annotations

import shlex
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, TextIO

from agent import __version__
from agent.evaluation.benchmark_instructions import HEARD, Instruction, understood
from agent.evaluation.common import LOST, SCHEMA_VERSION, Row, lost_count, lost_note, rate_of, told
from agent.evaluation.parsing import benchmark_rows, thinned
from agent.evaluation.result_store import KeptRows, fingerprint, kept_folder
from agent.pipeline.candidates import checked_planner
from agent.pipeline.instruction_parser import ReadingOptions
from agent.rendering.text import aligned
from agent.runtime.output_paths import write_report
from agent.runtime.progress import progress
from agent.runtime.worker_pool import workforce
from structdiffusion.benchmark.scenes import ANY_SHAPE, EvaluationScene, draw_evaluation_scene
from structdiffusion.benchmark.success import solve
from structdiffusion.data.scene_sampling import SceneError
from structdiffusion.objects.libraries import load_objects
from structdiffusion.objects.model import ObjectModel
from structdiffusion.parallel import WORKER_DIED, Lost
from structdiffusion.planners.factory import Planner

NO_SCENE = "no scene could be drawn"
NOT_BUILT = "not understood"  # refused, or asked back: nothing is built, as with `structagent run`
REPORT = "eval.json"  # beside the rows
# Where a sentence does not stand: because of what was heard, or just as it does not when the slots are told.
BY_PARSING, BY_ARRANGEMENT = "parsing", "arrangement"


@dataclass(frozen=True)
class LanguageAsked:
    """What every row depends on.

    Attributes:
        data: "free", "templated", or a file of the benchmark's form.
        objects: as `load_objects` takes it.
        model: the planner, as `load_planner` takes it.
        weights: the folder of checkpoints, or `None` for those shipped.
        parser: who reads the sentences, as `ReadingOptions` takes it.
        seed: of scenes, sensor noise and sampling.
        candidates: arrangements that the planner imagines; the best is tried.
        as_said: tell sentence models the instruction itself, and not what was heard in the corpus's words.
        allow_unverified: take checkpoints that are not what their cards say; a folder's rows are told apart by the
            checksums of the networks, whatever this says.
    """

    data: str = "free"
    objects: str = "ycb"
    model: str = "diffusion"
    weights: Path | None = None
    parser: str = "embedding"
    seed: int = 0
    candidates: int = 64
    as_said: bool = False
    allow_unverified: bool = False

    def command(self, limit: int | None) -> str:
        """The command that makes these rows."""
        words = ["structagent", "evaluate", "language", "--data", self.data]
        words += ["--limit", str(limit)] if limit else []
        words += ["--objects", self.objects, "--seed", str(self.seed), "--model", self.model]
        words += ["--weights", str(self.weights)] if self.weights else []
        words += ["--parser", self.parser, "--candidates", str(self.candidates)]
        words += ["--as-said"] * self.as_said + ["--allow-unverified"] * self.allow_unverified
        return shlex.join(words)

    def fingerprint(self, library: Sequence[ObjectModel]) -> Row:
        """What two commands have in common whose rows may stand in one table.

        The sentences and what was heard are compared row by row.
        """
        options = {key: value for key, value in asdict(self).items() if key not in ("weights", "allow_unverified")}
        return fingerprint(options, library, [self.model], self.weights)


def measure_language(
    asked: LanguageAsked,
    limit: int | None = None,
    *,
    workers: int | None = None,
    ray: str | None = None,
    out: Path | None = None,
) -> Row:
    """How often a structure stands that was asked for in free words, and how often when its slots are told, JSON-ready.

    Args:
        asked: what every row depends on.
        limit: read at most so many sentences, evenly spaced; `None` for all.
        workers: processes; `None` for one per core.
        ray: the address of a Ray cluster whose workers do it, or `None` for processes of this machine.
        out: a folder that keeps the rows as they come, in which the same command goes on where it was stopped, and
            another one may take more sentences. `None` keeps nothing.

    Raises:
        UsageError: for an unknown planner, a folder that was made with other options, or a cluster that does not
            answer.
        BadInput: for sentences that cannot be read, or a folder that cannot be written to.
        CheckpointError: for a checkpoint that is missing or does not fit.
    """
    # A broken checkpoint, or a folder without meshes, is known before anything is read.
    checked_planner(asked.model, asked.weights, asked.allow_unverified)
    models = tuple(load_objects(asked.objects))
    rows = thinned(list(enumerate(benchmark_rows(asked.data))), limit)
    with (
        kept_folder(out) as path,
        KeptRows(path, asked.fingerprint(models), {"number", *HEARD}, (REPORT,)) as kept,
        workforce(workers, ray) as force,
    ):
        instructions, left_out = understood(rows, ReadingOptions(parser=asked.parser), asked.as_said)
        done = {row["number"]: row for row in told(kept.rows)}
        missing = [one for one in instructions if not one.is_in(done)]
        # A worker's current folder may be another one.
        weights = asked.weights and asked.weights.absolute()
        task = partial(_carried_out, asked.seed, asked.candidates)
        load = partial(_loaded, models, asked.model, weights, asked.allow_unverified)
        carried_out = force.do(task, load, (), missing)
        with progress("sentences", len(instructions), len(instructions) - len(missing)) as tell:
            for row in carried_out:
                if isinstance(row, Lost):
                    row = _lost(asked.seed, row)
                kept.add(row)
                done[row["number"]] = row
                tell(LOST not in row)
    results = [done[instruction.number] for instruction in instructions]
    measured = [row for row in results if "structure" in row]
    left_out[NO_SCENE] = len(results) - len(measured)
    return {
        "schema_version": SCHEMA_VERSION,
        "version": __version__,
        "command": asked.command(limit),
        "sentences": len(rows),
        "left_out": left_out,
        "rows": measured,
        "aggregate": {key: _grouped(measured, key) for key in ("structure", "stratum")},
    }


def _loaded(
    models: tuple[ObjectModel, ...], name: str, weights: Path | None, allow_unverified: bool
) -> tuple[tuple[ObjectModel, ...], Planner]:
    return models, checked_planner(name, weights, allow_unverified)


def _carried_out(
    seed: int, candidates: int, loaded: tuple[tuple[ObjectModel, ...], Planner], instruction: Instruction
) -> Row:
    """What becomes of one sentence: its row, without a structure where no scene can be drawn for it."""
    models, planner = loaded
    row, meant, parse = instruction.row, instruction.meant, instruction.parse
    about = {"number": instruction.number, **instruction.heard}
    started = time.perf_counter()
    try:
        scene = draw_evaluation_scene(models, meant.shape, instruction.number, seed=seed, spec=meant)
    except SceneError:
        return about
    told = replace(scene, words=row.text, embedding=instruction.embedding)
    failure_told = solve(planner, told, candidates=candidates, top_k=1).failure
    failure = _failure_as_heard(planner, told, instruction, candidates, failure_told)
    return {
        "structure": scene.structure,
        "stratum": row.stratum,
        "seed": seed,
        "draw": scene.draw,
        **about,
        "exact": instruction.understood and parse.spec == meant,
        "objects": [model.name for model in scene.drawn.models[: scene.drawn.count]],
        "failure": failure,
        "failure_told": failure_told,
        "seconds": round(time.perf_counter() - started, 3),
    }


def _lost(seed: int, lost: Lost) -> Row:
    """The row of a sentence whose worker died at it."""
    instruction: Instruction = lost.job
    return {
        "structure": instruction.meant.shape or ANY_SHAPE,
        "stratum": instruction.row.stratum,
        "seed": seed,
        "draw": None,
        "number": instruction.number,
        **instruction.heard,
        "exact": instruction.understood and instruction.parse.spec == instruction.meant,
        "objects": [],
        "failure": WORKER_DIED if instruction.understood else NOT_BUILT,
        "failure_told": WORKER_DIED,
        "seconds": None,
        LOST: lost.reason,
    }


def _failure_as_heard(
    planner: Planner, told: EvaluationScene, instruction: Instruction, candidates: int, failure_told: str | None
) -> str | None:
    heard = instruction.parse.spec
    if not instruction.understood:
        return NOT_BUILT
    if heard == told.spec:  # the planner would do the same again
        return failure_told
    as_heard = replace(told, heard=heard, embedding=instruction.embedding_heard)
    return solve(planner, as_heard, candidates=candidates, top_k=1).failure


def _grouped(rows: Sequence[Row], key: str) -> dict[str, Row]:
    names = sorted({row[key] for row in rows})
    return {name: _rates([row for row in rows if name in ("all", row[key])]) for name in (*names, "all")}


def _rates(rows: Sequence[Row]) -> Row:
    stands, told_slots = [row["failure"] is None for row in rows], [row["failure_told"] is None for row in rows]
    died = lost_count(rows)
    lost = [was_told and not heard for heard, was_told in zip(stands, told_slots)]
    won = [heard and not was_told for heard, was_told in zip(stands, told_slots)]
    return {
        "n": len(rows),
        "exact": rate_of([row["exact"] for row in rows]),
        "understood": rate_of([row["failure"] != NOT_BUILT for row in rows]),
        "success": rate_of(stands),
        "success_told": rate_of(told_slots),
        "lost_by_parsing": rate_of(lost),
        "won_by_parsing": rate_of(won),
        "failures": {BY_PARSING: sum(lost), BY_ARRANGEMENT: stands.count(False) - sum(lost) - died},
        "lost": died,
    }


def tell_language(report: Row, results: TextIO) -> None:
    """The tables for people: by structure, then by kind of sentence."""
    lost = report["aggregate"]["structure"]["all"]["lost"]
    for key, groups in report["aggregate"].items():
        head = [key, "n", "exact", "success", "95 %", "told the slots", "95 %", "lost by parsing", "95 %", "won"]
        table = [[*head, "failures by parsing", "by arrangement", *([WORKER_DIED] if lost else [])]]
        for name, found in groups.items():
            cells = [name, str(found["n"]), _percent(found["exact"])]
            for rate in ("success", "success_told", "lost_by_parsing"):
                cells += [_percent(found[rate]), _interval(found[rate])]
            failures = found["failures"]
            cells += [_percent(found["won_by_parsing"]), str(failures[BY_PARSING]), str(failures[BY_ARRANGEMENT])]
            table.append(cells + ([str(found["lost"])] if lost else []))
        print(aligned(table, left=1) + "\n", file=results)
    others = "; ".join(f"{count} {reason}" for reason, count in report["left_out"].items())
    print(f"of {report['sentences']} sentences left out: {others}", file=results)
    if lost:
        print(lost_note(lost, "sentence"), file=results)
    print(f"rates in percent, with 95 % Wilson intervals\n{report['command']}", file=results)


def write_language(report: Row, folder: Path) -> list[Path]:
    """Writes the report beside the rows; its path."""
    return write_report(report, folder / REPORT)


def _percent(rate: dict[str, Any]) -> str:
    return f"{100 * rate['rate']:.1f}"


def _interval(rate: dict[str, Any]) -> str:
    return f"{100 * rate['low']:.0f} to {100 * rate['high']:.0f}"
