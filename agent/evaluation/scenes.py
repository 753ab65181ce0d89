"""Provide the scenes of the evaluations, and the sentences that go with them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

from agent.evaluation.rows import Place, Row, lost_row
from agent.runtime.progress import progress
from agent.runtime.worker_pool import Workforce
from grounding.corpus.grammar import sentences
from grounding.parsers.embedding import EmbeddingParser
from structdiffusion.benchmark.scenes import Conditions, EvaluationScene, draw_evaluation_scene
from structdiffusion.objects.model import ObjectModel
from structdiffusion.parallel import Lost
from structdiffusion.planners.registry import PLANNERS

# Planners that get the sentence. Their arrangements are ranked by what the parser read in it, not by the true slots.
SENTENCE_PLANNERS = tuple(name for name, parts in PLANNERS.items() if parts.sentence)


def draw_scenes(
    force: Workforce,
    library: Sequence[ObjectModel],
    places: Sequence[Place],
    seed: int,
    conditions: Conditions = Conditions(),
) -> tuple[list[EvaluationScene], list[Row]]:
    """Draw the scenes of these places, in their order.

    Returns:
        The scenes, and a row for each whose worker died.

    Raises:
        SceneError: if a scene cannot be drawn from these objects.
    """
    drawn: dict[Place, EvaluationScene] = {}
    lost = []
    with progress("scenes drawn", len(places)) as advance:
        for scene in force.do(partial(_draw_scene, seed, conditions), tuple, (tuple(library),), places):
            if isinstance(scene, Lost):
                lost.append(lost_row(scene.job, seed, scene.reason))
            else:
                drawn[scene.structure, scene.number] = scene
            advance(not isinstance(scene, Lost))
    return [drawn[place] for place in places if place in drawn], lost


def _draw_scene(seed: int, conditions: Conditions, library: Sequence[ObjectModel], place: Place) -> EvaluationScene:
    return draw_evaluation_scene(library, *place, seed=seed, conditions=conditions)


def with_sentences(scenes: Sequence[EvaluationScene], *, parsed: bool) -> list[EvaluationScene]:
    """Return the scenes with one of the corpus's sentences each, in turn, and its embedding.

    Sentences are read one by one: in a batch, the bits of a sentence's embedding depend on what else is in it.

    Args:
        scenes: without sentences.
        parsed: add the parser's result for each sentence, the only input of sentence-conditioned planners. Shapes that
            the parser of slots was not taught keep their true slots: goals read those sentences, not this parser.
    """
    if not scenes:
        return []
    words = []
    for scene in scenes:
        templates = sentences(scene.spec)
        words.append(templates[scene.number % len(templates)])
    parser = EmbeddingParser.from_pretrained()
    taught = parser.reader.answers["shape"]
    asked = zip(scenes, words, strict=True)
    parses = [parser.parse(text) if parsed and scene.spec.shape in taught else None for scene, text in asked]
    rows = zip(scenes, words, parser.encoder.encode(words, batch_size=1), parses, strict=True)
    return [
        replace(scene, words=text, embedding=row, parsed=parse.spec if parse else None)
        for scene, text, row, parse in rows
    ]
