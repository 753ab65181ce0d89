"""Scenes of evaluations with their sentences."""

from agent.evaluation.scenes import with_sentences
from structdiffusion.benchmark.scenes import draw_evaluation_scenes
from structdiffusion.objects.procedural import procedural_objects


def test_a_sentence_is_parsed_where_the_parser_was_taught_its_shape():
    """Of another shape, the parser would name a wrong one: the true slots stay."""
    scenes = list(draw_evaluation_scenes(procedural_objects(34, seed=7), 1, shapes=("line", "triangle"), seed=2))
    line, triangle = with_sentences(scenes, parsed=True)
    assert "line" in line.words or "row" in line.words or "side by side" in line.words
    assert line.parsed.shape == "line" and line.embedding.shape == triangle.embedding.shape == (384,)
    assert "triang" in triangle.words and triangle.parsed is None and triangle.spec.shape == "triangle"
    assert [scene.parsed for scene in with_sentences(scenes, parsed=False)] == [None, None]
