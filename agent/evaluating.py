"""What evaluations share: scenes with sentences, rates with 95 % intervals, and the frame of their reports."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

from agent import __version__
from agent.progress import followed
from grounding.corpus import sentences
from grounding.embedding_parser import EmbeddingParser
from grounding.spec import SHAPES
from structdiffusion.evaluation import wilson_interval
from structdiffusion.evaluation_scenes import EvaluationScene, draw_evaluation_scenes
from structdiffusion.objects.libraries import load_objects
from structdiffusion.planners import PLANNERS

SCHEMA_VERSION = 1
Row = dict[str, Any]
# Planners that get the sentence. They are ranked by what the parser heard in it, not by the true slots.
SPOKEN_TO = tuple(name for name, parts in PLANNERS.items() if parts.sentence)


def drawn_scenes(objects: str, count: int, seed: int, workers: int) -> list[EvaluationScene]:
    """`count` scenes of each structure, from a library as `load_objects` takes it."""
    scenes = draw_evaluation_scenes(load_objects(objects), count, seed=seed, workers=workers)
    return list(followed("scenes drawn", scenes, count * len(SHAPES)))


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
