"""What evaluations share: scenes with sentences, rates with 95 % intervals, and the frame of their reports."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

from agent import __version__
from agent.evaluation.result_store import KeptRows
from agent.runtime.progress import progress
from agent.runtime.worker_pool import Workforce
from grounding.corpus.grammar import sentences
from grounding.parsers.embedding import EmbeddingParser
from structdiffusion.benchmark.scenes import EvaluationScene, draw_evaluation_scene
from structdiffusion.benchmark.success import wilson_interval
from structdiffusion.objects.model import ObjectModel
from structdiffusion.parallel import Lost, WorkerError
from structdiffusion.planners.registry import PLANNERS
from structdiffusion.worker_process import WORKER_DIED

SCHEMA_VERSION = 1
LOST = "lost"  # what a row has, beside its scene, whose worker died at it: why
Row = dict[str, Any]
Place = tuple[str, int]  # a scene's structure and number
# Planners that get the sentence. They are ranked by what the parser heard in it, not by the true slots.
SPOKEN_TO = tuple(name for name, parts in PLANNERS.items() if parts.sentence)


def drawn_scene(seed: int, library: Sequence[ObjectModel], place: Place) -> EvaluationScene:
    """The scene of a place, for whoever draws many.

    Raises:
        SceneError: when it cannot be drawn from these objects.
    """
    return draw_evaluation_scene(library, *place, seed=seed)


def drawn_scenes(
    force: Workforce, library: Sequence[ObjectModel], places: Sequence[Place], seed: int
) -> tuple[list[EvaluationScene], list[Row]]:
    """The scenes of these places, in their order, and a row for each at which a worker died.

    Raises:
        SceneError: when one cannot be drawn from these objects.
    """
    drawn: dict[Place, EvaluationScene] = {}
    lost = []
    with progress("scenes drawn", len(places)) as tell:
        for scene in force.do(partial(drawn_scene, seed), tuple, (tuple(library),), places):
            if isinstance(scene, Lost):
                lost.append(row_of_lost(scene.job, seed, scene.reason))
            else:
                drawn[scene.structure, scene.number] = scene
            tell(not isinstance(scene, Lost))
    return [drawn[place] for place in places if place in drawn], lost


def rows_by_place(rows: Iterable[Row]) -> dict[Place, Row]:
    """The rows of scenes by their place; those whose worker died are left out."""
    return {(row["structure"], row["number"]): row for row in told(rows)}


def keep_as_they_end(
    kept: KeptRows, ended: Iterable[Row | Lost], tell: Callable[..., None], seed: int
) -> dict[Place, Row]:
    """Keeps rows of scenes as they end, and one for each scene at which a worker died.

    Args:
        kept: gets them.
        ended: the rows, and what was lost, whose jobs have a structure and a number.
        tell: takes whether a row succeeded, as `progress` gives it.
        seed: of the scenes.
    """
    rows = {}
    for row in ended:
        if isinstance(row, Lost):
            row = row_of_lost((row.job.structure, row.job.number), seed, row.reason)
        kept.add(row)
        rows[row["structure"], row["number"]] = row
        tell(LOST not in row)
    return rows


def row_of_lost(place: Place, seed: int, reason: str) -> Row:
    """The row of a scene whose worker died at it; `LOST` says so."""
    structure, number = place
    return {"structure": structure, "number": number, "seed": seed, LOST: reason}


def told(rows: Iterable[Row]) -> list[Row]:
    """The rows that were found out: those whose worker died are left out."""
    return [row for row in rows if LOST not in row]


def parted(results: Iterable[Any]) -> tuple[list[Any], list[Lost]]:
    """Results, and what was lost because a worker died at it.

    Raises:
        WorkerError: when everything was lost.
    """
    found, lost = [], []
    for result in results:
        (lost if isinstance(result, Lost) else found).append(result)
    if lost and not found:
        raise WorkerError(f"nothing could be measured: every {lost[0].reason}")
    return found, lost


def lost_count(rows: Sequence[Row]) -> int:
    """How many rows' workers died."""
    return len(rows) - len(told(rows))


def lost_note(count: int, what: str) -> str:
    """What is to be said under the table where workers died, and rows are told as failed for it."""
    each, them = (f"1 {what} is", "it") if count == 1 else (f"{count} {what}s are", "them")
    return f"{each} missing because a {WORKER_DIED}, counted as failed; the same command with --out tries {them} again"


def left_out_note(count: int) -> str:
    """What is to be said under the table where workers died, and nothing of their scenes can be counted."""
    return f"{count} {'scene is' if count == 1 else 'scenes are'} left out of these figures because a {WORKER_DIED}"


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


def spoken_scenes(scenes: Sequence[EvaluationScene], *, heard: bool) -> list[EvaluationScene]:
    """The scenes with one of the corpus's sentences each, in turn, and its embedding.

    Sentences are read one by one: in a batch, the bits of a sentence's embedding depend on what else is in it.

    Args:
        heard: put what the parser makes of each sentence along: all that a planner told in words may know.
    """
    words = []
    for scene in scenes:
        templates = sentences(scene.spec)
        words.append(templates[scene.number % len(templates)])
    parser = EmbeddingParser.from_pretrained()
    parses = [parser.parse(text) if heard else None for text in words]
    rows = zip(scenes, words, parser.encoder.encode(words, batch_size=1), parses, strict=True)
    return [
        replace(scene, words=text, embedding=row, heard=parse.spec if parse else None)
        for scene, text, row, parse in rows
    ]
