"""The sentences from which the local language model learns goals: every line is legal and says what its text says."""

from importlib import resources

import numpy as np

from grounding.goal_benchmark.rows import load_goal_rows
from grounding.goals.goal import Goal
from grounding.goals.parts import RELATIONS
from grounding.llm_goals.lines import NO_GOAL, Said, parts_of
from grounding.llm_goals.local import said_lengths
from grounding.spec import SHAPES
from grounding.training.goal_sentences import GoalSentences


def drawn(count, seed=0):
    sentences = GoalSentences(np.random.default_rng(seed))
    return [sentences.draw() for _ in range(count)]


def certain(sentences):
    """Those without "4 in", which may be inches or the beginning of a place."""
    return [sentence for sentence in sentences if not any(length.endswith(" in") for length in sentence.lengths)]


def test_the_same_seed_draws_the_same_sentences():
    assert drawn(20) == drawn(20) != drawn(20, seed=1)


def test_every_line_is_legal_and_nearly_every_one_a_goal():
    goals = 0
    for sentence in certain(drawn(400)):
        parts = parts_of(sentence.line, Said.of(sentence.text, sentence.lengths, sentence.counts))
        if isinstance(parts, str):
            assert parts in NO_GOAL
            continue
        metres = said_lengths(sentence.text)
        parts = [
            part
            | {key: metres[part[key]] for key in ("gap", "radius", "length", "distance") if part.get(key) in metres}
            for part in parts
        ]
        try:
            goals += bool(Goal.from_dict({"parts": parts}).parts)
        except ValueError as error:  # chance names an object twice, or takes everything twice
            assert "object" in str(error) or "both take" in str(error) or "itself" in str(error), (sentence, error)
    assert goals > 300


def test_all_lengths_of_a_text_are_read_as_they_are_labelled():
    """The line copies a length's words; the text's own reader finds the same words."""
    missed = [s.text for s in certain(drawn(400)) if not set(s.lengths) <= set(said_lengths(s.text))]
    assert missed == []


def test_all_shapes_and_relations_are_taught():
    lines = "\n".join(sentence.line for sentence in drawn(3000))
    for shape in SHAPES:
        assert f" {shape} of" in lines
    for relation in RELATIONS:
        word = {"in": "inside", "moved": "move of", "swapped": "swap of"}.get(relation, relation)
        assert word in lines


def test_no_development_sentence_is_taught():
    taught = {" ".join(sentence.text.strip(".! ").split()) for sentence in drawn(3000)}
    with resources.as_file(resources.files("grounding") / "benchmark_data" / "goals_development_llm.jsonl") as path:
        rows = load_goal_rows(path)
    assert len(rows) >= 60
    assert not taught & {" ".join(row.text.lower().strip(".! ").split()) for row in rows}
