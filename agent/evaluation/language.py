"""Run sentences through parser, planner and physics: `structagent evaluate language`.

Each row of the parsing benchmark gets a scene for its true slots. A planner solves the scene twice: with the parsed
slots, and with the true ones (the oracle). The scenes that succeed only with the true slots are the cost of parsing.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, TextIO

from agent.evaluation.benchmark_instructions import READING, Instruction, read_instructions
from agent.evaluation.parsing import benchmark_rows, thinned
from agent.evaluation.report import (
    REPORT,
    command_line,
    interval,
    missing_note,
    percent,
    print_footer,
    print_table,
    rate_of,
    report_frame,
)
from agent.evaluation.result_store import ResultStore, fingerprint, store_folder
from agent.evaluation.rows import LOST, Row, add_rows, lost_count, measured
from agent.pipeline.candidates import checked_planner
from agent.pipeline.instruction_parser import ReadingOptions
from agent.runtime.worker_pool import workforce
from grounding.parse_result import DEFECT
from structdiffusion.benchmark.scenes import ANY_SHAPE, EvaluationScene, draw_evaluation_scene
from structdiffusion.benchmark.success import solve
from structdiffusion.data.scene_sampling import SceneError
from structdiffusion.objects.libraries import load_objects
from structdiffusion.objects.model import ObjectModel
from structdiffusion.parallel import Lost
from structdiffusion.planners.factory import Planner
from structdiffusion.worker_process import WORKER_DIED

NO_SCENE = "no scene could be drawn"
NOT_BUILT = "not understood"  # refused, or asked back: nothing is built, as with `structagent run`
# Why a sentence does not stand: because of how it was parsed, or just as with the true slots.
BY_PARSING, BY_ARRANGEMENT = "parsing", "arrangement"


@dataclass(frozen=True)
class LanguageConfig:
    """What every row depends on.

    Attributes:
        data: "free", "templated", or a file in the format of the benchmark.
        objects: as for `load_objects`.
        model: the planner, as for `load_planner`.
        weights: folder of the checkpoints; `None` for the shipped ones.
        parser: the parser, as in `ReadingOptions`.
        seed: of scenes, sensor noise and sampling.
        candidates: arrangements that the planner proposes; the best is tried.
        as_said: give planners of sentences the instruction itself, not the parsed slots in the corpus's words.
        allow_unverified: use checkpoints that differ from their model cards. Rows are distinguished by the checksums of
            the networks in any case.
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
        """Return the command that makes these rows."""
        return command_line(
            "language", data=self.data, limit=limit, objects=self.objects, seed=self.seed, model=self.model,
            weights=self.weights, parser=self.parser, candidates=self.candidates,
            as_said=self.as_said, allow_unverified=self.allow_unverified,
        )  # fmt: skip

    def fingerprint(self, library: Sequence[ObjectModel]) -> Row:
        """Return what two commands must have in common for their rows to stand in one table.

        The sentences and how they were read are compared row by row.
        """
        options = {key: value for key, value in asdict(self).items() if key not in ("weights", "allow_unverified")}
        return fingerprint(options, library, [self.model], self.weights)


def measure_language(
    config: LanguageConfig,
    limit: int | None = None,
    *,
    workers: int | None = None,
    ray: str | None = None,
    out: Path | None = None,
) -> Row:
    """Measure how often structures of free instructions stand, with parsed and with true slots; JSON-ready.

    Args:
        config: what every row depends on.
        limit: read at most that many sentences, evenly spaced; `None` for all.
        workers: processes; `None` for one per core.
        ray: address of a Ray cluster that does the work; `None` for processes of this machine.
        out: folder that stores the rows as they come: the same command resumes an evaluation that was stopped, and
            another one may add sentences. `None` stores nothing.

    Raises:
        UsageError: for an unknown planner, a folder of another evaluation, or a cluster that does not answer.
        BadInput: for sentences that cannot be read, or a folder that cannot be written to.
        CheckpointError: for a checkpoint that is missing or does not fit.
        NotVerified: for checkpoints that differ from their cards, unless that is allowed.
    """
    # A broken checkpoint, or a folder without meshes, is reported before anything is read.
    checked_planner(config.model, config.weights, config.allow_unverified)
    models = tuple(load_objects(config.objects))
    rows = thinned(list(enumerate(benchmark_rows(config.data))), limit)
    with (
        store_folder(out) as path,
        ResultStore(path, config.fingerprint(models), {"number", *READING}, (REPORT,)) as store,
        workforce(workers, ray) as force,
    ):
        reading = ReadingOptions(parser=config.parser)
        instructions, left_out = read_instructions(rows, reading, config.as_said)
        done = {row["number"]: row for row in measured(store.rows)}
        missing = [one for one in instructions if not one.is_in(done)]
        # A worker's current folder may be another one.
        weights = config.weights and config.weights.absolute()
        task = partial(_evaluate_instruction, config.seed, config.candidates)
        computing = force.do(task, partial(_load, models, config.model, weights, config.allow_unverified), (), missing)
        known = len(instructions) - len(missing)
        computed = add_rows(
            store.add, computing, partial(_lost_row, config.seed), "sentences", len(instructions), known
        )
        done |= {row["number"]: row for row in computed}
    results = [done[instruction.number] for instruction in instructions]
    built = [row for row in results if "structure" in row]
    left_out[NO_SCENE] = len(results) - len(built)
    return {
        **report_frame(config.command(limit), len(built), config.seed),
        "sentences": len(rows),
        "left_out": left_out,
        "defects": [
            {"text": one.row.text, "message": one.parse.message} for one in instructions if one.parse.status == DEFECT
        ],
        "rows": built,
        "aggregate": {key: _grouped(built, key) for key in ("structure", "stratum")},
    }


def _load(
    models: tuple[ObjectModel, ...], name: str, weights: Path | None, allow_unverified: bool
) -> tuple[tuple[ObjectModel, ...], Planner]:
    return models, checked_planner(name, weights, allow_unverified)


def _evaluate_instruction(
    seed: int, candidates: int, loaded: tuple[tuple[ObjectModel, ...], Planner], instruction: Instruction
) -> Row:
    """Solve the scene of one sentence and return its row, which has no structure if no scene can be drawn for it."""
    models, planner = loaded
    truth = instruction.ground_truth
    about = {"number": instruction.number, **instruction.reading}
    started = time.perf_counter()
    try:
        scene = draw_evaluation_scene(models, truth.shape, instruction.number, seed=seed, spec=truth)
    except SceneError:
        return about
    oracle = replace(scene, words=instruction.row.text, embedding=instruction.embedding)
    failure_oracle = solve(planner, oracle, candidates=candidates, top_k=1).failure
    failure = _failure_as_parsed(planner, oracle, instruction, candidates, failure_oracle)
    return {
        "structure": scene.structure,
        "stratum": instruction.row.stratum,
        "seed": seed,
        "draw": scene.draw,
        **about,
        "exact": instruction.understood and instruction.parse.spec == truth,
        "objects": [model.name for model in scene.drawn.models[: scene.drawn.count]],
        "failure": failure,
        "failure_oracle": failure_oracle,
        "seconds": round(time.perf_counter() - started, 3),
    }


def _lost_row(seed: int, lost: Lost) -> Row:
    """Return the row of a sentence whose worker died."""
    instruction: Instruction = lost.job
    return {
        "structure": instruction.ground_truth.shape or ANY_SHAPE,
        "stratum": instruction.row.stratum,
        "seed": seed,
        "draw": None,
        "number": instruction.number,
        **instruction.reading,
        "exact": instruction.understood and instruction.parse.spec == instruction.ground_truth,
        "objects": [],
        "failure": WORKER_DIED if instruction.understood else NOT_BUILT,
        "failure_oracle": WORKER_DIED,
        "seconds": None,
        LOST: lost.reason,
    }


def _failure_as_parsed(
    planner: Planner, oracle: EvaluationScene, instruction: Instruction, candidates: int, failure_oracle: str | None
) -> str | None:
    parsed = instruction.parse.spec
    if not instruction.understood:
        return NOT_BUILT
    if parsed == oracle.spec:  # the planner would do the same again
        return failure_oracle
    scene = replace(oracle, parsed=parsed, embedding=instruction.embedding_parsed)
    return solve(planner, scene, candidates=candidates, top_k=1).failure


def _grouped(rows: Sequence[Row], key: str) -> dict[str, Row]:
    names = sorted({row[key] for row in rows})
    return {name: _rates([row for row in rows if name in ("all", row[key])]) for name in (*names, "all")}


def _rates(rows: Sequence[Row]) -> Row:
    parsed, oracle = [row["failure"] is None for row in rows], [row["failure_oracle"] is None for row in rows]
    died = lost_count(rows)
    lost = [with_truth and not as_parsed for as_parsed, with_truth in zip(parsed, oracle, strict=True)]
    won = [as_parsed and not with_truth for as_parsed, with_truth in zip(parsed, oracle, strict=True)]
    return {
        "n": len(rows),
        "exact": rate_of([row["exact"] for row in rows]),
        "understood": rate_of([row["failure"] != NOT_BUILT for row in rows]),
        "success": rate_of(parsed),
        "success_oracle": rate_of(oracle),
        "lost_by_parsing": rate_of(lost),
        "won_by_parsing": rate_of(won),
        "failures": {BY_PARSING: sum(lost), BY_ARRANGEMENT: parsed.count(False) - sum(lost) - died},
        "lost": died,
    }


def print_language(report: Mapping[str, Any], results: TextIO) -> None:
    """Print the tables: by structure, then by kind of sentence."""
    lost = report["aggregate"]["structure"]["all"]["lost"]
    for key, groups in report["aggregate"].items():
        head = [key, "n", "exact", "success", "95 %", "true slots", "95 %", "lost by parsing", "95 %", "won"]
        table = [[*head, "failures by parsing", "by arrangement", *([WORKER_DIED] if lost else [])]]
        for name, found in groups.items():
            cells = [name, str(found["n"]), percent(found["exact"]["rate"], 1)]
            for rate in ("success", "success_oracle", "lost_by_parsing"):
                cells += [percent(found[rate]["rate"], 1), interval(found[rate])]
            failures = found["failures"]
            cells += [percent(found["won_by_parsing"]["rate"], 1), str(failures[BY_PARSING])]
            table.append([*cells, str(failures[BY_ARRANGEMENT]), *([str(found["lost"])] if lost else [])])
        print_table(table, results)
        print(file=results)
    others = "; ".join(f"{count} {reason}" for reason, count in report["left_out"].items())
    print(f"of {report['sentences']} sentences left out: {others}", file=results)
    print_footer(report, results, missing_note(lost, "sentence"), "rates in percent, with 95 % Wilson intervals")
