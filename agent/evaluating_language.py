"""`structagent evaluate language`: sentences straight through parsing, imagination and physics.

Each row of the parsing benchmark gets a scene for what it means. A planner solves the scene twice: told what the
parser heard, and told what is meant. What stands only when told is what parsing costs.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, TextIO

import numpy as np

from agent import __version__
from agent.evaluating import SCHEMA_VERSION, Row, rate_of
from agent.evaluating_parse import benchmark_rows, thinned
from agent.planning import checked_planner
from agent.progress import followed
from agent.reading import ReadingOptions, make_reader
from agent.telling import aligned
from grounding import benchmark
from grounding.corpus import sentences
from grounding.encoder import SentenceEncoder
from grounding.parse import Parse
from grounding.spec import SLOTS, SpecError, StructureSpec
from structdiffusion.evaluation import solve
from structdiffusion.evaluation_scenes import EvaluationScene, draw_evaluation_scene
from structdiffusion.objects.libraries import load_objects
from structdiffusion.objects.model import ObjectModel
from structdiffusion.sampling import Planner
from structdiffusion.scenes import SceneError
from structdiffusion.workers import in_parallel

REFUSED, NO_WISH, NO_SCENE = "must be refused", "means no structure that the slots can say", "no scene could be drawn"
NOT_BUILT = "not understood"  # refused, or asked back: nothing is built, as with `structagent run`
# Where a sentence does not stand: because of what was heard, or just as it does not when the slots are told.
BY_PARSING, BY_ARRANGEMENT = "parsing", "arrangement"


@dataclass(frozen=True)
class Instruction:
    """A sentence of the benchmark that is about building one structure.

    Attributes:
        number: its place in the benchmark, from which its scene follows.
        row: the benchmark's row.
        meant: its slots.
        parse: what the parser made of it.
        embedding: (384,) of what a sentence model is told when the slots are: they in the corpus's words, or the
            instruction itself.
        embedding_heard: (384,) of what it is told by the parser; the same where that is the instruction itself.
    """

    number: int
    row: benchmark.Row
    meant: StructureSpec
    parse: Parse
    embedding: np.ndarray
    embedding_heard: np.ndarray

    @property
    def understood(self) -> bool:
        """Whether the parser neither refused it nor asked back."""
        return self.parse.status == "ok"


def measure_language(
    data: str,
    limit: int | None,
    objects: str,
    name: str,
    weights: Path | None,
    options: ReadingOptions,
    seed: int,
    candidates: int,
    workers: int,
    as_said: bool = False,
) -> Row:
    """How often a structure stands that was asked for in free words, and how often when its slots are told, JSON-ready.

    Args:
        data: "free", "templated", or a file of the benchmark's form.
        limit: read at most so many rows, evenly spaced; `None` for all.
        objects: as `load_objects` takes it.
        name: of the planner, as `load_planner` takes it.
        weights: the folder of checkpoints, or `None` for those shipped.
        options: how the sentences are read.
        seed: of scenes, sensor noise and sampling.
        candidates: arrangements that the planner imagines; the best is tried.
        workers: processes.
        as_said: tell sentence models the instruction itself, and not what was heard in the corpus's words.
    """
    checked_planner(name, weights)  # a broken checkpoint, or a folder without meshes, is known before anything is read
    models = tuple(load_objects(objects))
    rows = thinned(list(enumerate(benchmark_rows(data))), limit)
    instructions, left_out = understood(rows, options, as_said)
    load = partial(_loaded, models, name, weights)
    carried_out = in_parallel(partial(_carried_out, seed, candidates), load, (), instructions, workers)
    results = list(followed("sentences", carried_out, len(instructions)))
    measured = [row for row in results if row is not None]
    left_out[NO_SCENE] = len(results) - len(measured)
    command = f"structagent evaluate language --data {data}" + (f" --limit {limit}" if limit else "")
    command += f" --objects {objects} --seed {seed} --model {name}" + (f" --weights {weights}" if weights else "")
    command += f" --parser {options.parser} --candidates {candidates}" + (" --as-said" if as_said else "")
    return {
        "schema_version": SCHEMA_VERSION,
        "version": __version__,
        "command": command,
        "sentences": len(rows),
        "left_out": left_out,
        "rows": measured,
        "aggregate": {key: _grouped(measured, key) for key in ("structure", "stratum")},
    }


def understood(
    rows: Sequence[tuple[int, benchmark.Row]], options: ReadingOptions, as_said: bool = False
) -> tuple[list[Instruction], dict[str, int]]:
    """The sentences that ask for one structure, with what was heard; and how many others there are, by reason.

    They are read one by one: in a batch, the bits of a sentence's embedding depend on what else is in it.

    Args:
        rows: rows of the benchmark with their places in it.
        options: how they are read.
        as_said: as `measure_language` takes it.
    """
    building = [(number, row) for number, row in rows if not row.refuse]
    left_out = {REFUSED: len(rows) - len(building), NO_WISH: 0}
    encoder = SentenceEncoder()
    reader = make_reader(options, encoder, strict=True)
    instructions = []
    for number, row in building:
        parse = reader.parse(row.text)
        meant = meaning(row, parse.spec if parse.status == "ok" else None)
        if meant is None or not meant.tokens():
            left_out[NO_WISH] += 1
        else:
            heard = parse.spec if parse.status == "ok" else meant
            texts = [row.text if as_said else sentences(spec)[0] for spec in (meant, heard)]
            told = [encoder.encode([text])[0] for text in texts]
            instructions.append(Instruction(number, row, meant, parse, *told))
    return instructions, left_out


def meaning(row: benchmark.Row, heard: StructureSpec | None) -> StructureSpec | None:
    """The slots that a row means: where several values are right, the one that was heard, else the best.

    `None` for values that no structure can have together.
    """
    best = {slot: row.acceptable[slot][0] for slot in SLOTS}
    said = heard.to_dict() if heard else best
    fair = {slot: said[slot] if said[slot] in row.acceptable[slot] else best[slot] for slot in SLOTS}
    for values in (fair, best):
        try:
            return StructureSpec(**values)
        except SpecError:
            continue
    return None


def _loaded(
    models: tuple[ObjectModel, ...], name: str, weights: Path | None
) -> tuple[tuple[ObjectModel, ...], Planner]:
    return models, checked_planner(name, weights)


def _carried_out(
    seed: int, candidates: int, loaded: tuple[tuple[ObjectModel, ...], Planner], instruction: Instruction
) -> Row | None:
    """What becomes of one sentence; `None` where no scene can be drawn for it."""
    models, planner = loaded
    row, meant, parse = instruction.row, instruction.meant, instruction.parse
    started = time.perf_counter()
    try:
        scene = draw_evaluation_scene(models, meant.shape, instruction.number, seed=seed, spec=meant)
    except SceneError:
        return None
    told = replace(scene, words=row.text, embedding=instruction.embedding)
    failure_told = solve(planner, told, candidates=candidates, top_k=1).failure
    failure = _failure_as_heard(planner, told, instruction, candidates, failure_told)
    return {
        "structure": scene.structure,
        "stratum": row.stratum,
        "number": instruction.number,
        "seed": seed,
        "draw": scene.draw,
        "text": row.text,
        "meant": meant.to_dict(),
        "heard": parse.spec.to_dict(),
        "status": parse.status,
        "exact": instruction.understood and parse.spec == meant,
        "objects": [model.name for model in scene.drawn.models[: scene.drawn.count]],
        "failure": failure,
        "failure_told": failure_told,
        "seconds": round(time.perf_counter() - started, 3),
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
    stands, told = [row["failure"] is None for row in rows], [row["failure_told"] is None for row in rows]
    lost = [was_told and not heard for heard, was_told in zip(stands, told)]
    won = [heard and not was_told for heard, was_told in zip(stands, told)]
    return {
        "n": len(rows),
        "exact": rate_of([row["exact"] for row in rows]),
        "understood": rate_of([row["failure"] != NOT_BUILT for row in rows]),
        "success": rate_of(stands),
        "success_told": rate_of(told),
        "lost_by_parsing": rate_of(lost),
        "won_by_parsing": rate_of(won),
        "failures": {BY_PARSING: sum(lost), BY_ARRANGEMENT: stands.count(False) - sum(lost)},
    }


def tell_language(report: Row, results: TextIO) -> None:
    """The tables for people: by structure, then by kind of sentence."""
    for key, groups in report["aggregate"].items():
        head = [key, "n", "exact", "success", "95 %", "told the slots", "95 %", "lost by parsing", "95 %", "won"]
        table = [[*head, "failures by parsing", "by arrangement"]]
        for name, found in groups.items():
            cells = [name, str(found["n"]), _percent(found["exact"])]
            for rate in ("success", "success_told", "lost_by_parsing"):
                cells += [_percent(found[rate]), _interval(found[rate])]
            failures = found["failures"]
            cells += [_percent(found["won_by_parsing"]), str(failures[BY_PARSING]), str(failures[BY_ARRANGEMENT])]
            table.append(cells)
        print(aligned(table, left=1) + "\n", file=results)
    others = "; ".join(f"{count} {reason}" for reason, count in report["left_out"].items())
    print(f"of {report['sentences']} sentences left out: {others}", file=results)
    print(f"rates in percent, with 95 % Wilson intervals\n{report['command']}", file=results)


def _percent(rate: dict[str, Any]) -> str:
    return f"{100 * rate['rate']:.1f}"


def _interval(rate: dict[str, Any]) -> str:
    return f"{100 * rate['low']:.0f} to {100 * rate['high']:.0f}"
