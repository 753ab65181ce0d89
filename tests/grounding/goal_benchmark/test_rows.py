"""The rows of the benchmark of goals: what is legal, and what the errors say."""

import json
import re

import numpy as np
import pytest

from grounding.benchmark import BenchmarkError
from grounding.corpus.paraphrases import paraphrase
from grounding.goal_benchmark.rows import free_goal_rows, goal_scenes, load_goal_rows
from grounding.goals.goal import Goal
from grounding.goals.parts import RELATIONS, RelationPart, StructurePart
from grounding.spec import SHAPES
from grounding.structure_words import KEYS
from prompts import load_prompt, prompt_lines, prompt_names

LINE = {"parts": [{"kind": "structure", "shape": "line", "objects": [0, 1]}]}
ROW = {"text": "line up the mugs", "scene": "breakfast", "stratum": "plain", "status": "ok", "goals": [LINE]}


def written(tmp_path, *rows):
    path = tmp_path / "rows.jsonl"
    path.write_text("".join(row if isinstance(row, str) else json.dumps(row) + "\n" for row in rows))
    return path


def test_the_scenes_have_names_colours_sizes_and_places():
    scenes = goal_scenes()
    assert len(scenes) >= 10
    for objects in scenes.values():
        assert len({thing.name for thing in objects}) == len(objects) >= 5
        for thing in objects:
            x, y = thing.attributes.position
            assert thing.attributes.colors and 0.1 < x < 0.8 and -0.5 < y < 0.5
            assert min(thing.attributes.size) > 0 and max(thing.attributes.size) < 0.4


def test_rows_are_loaded(tmp_path):
    asked = {"text": "put the mug in the corner", "scene": None, "status": "ask"}
    plain, question = load_goal_rows(written(tmp_path, ROW, "\n", asked))
    assert plain.goals == (Goal((StructurePart("line", objects=(0, 1)),)),) and plain.stratum == "plain"
    assert question.status == "ask" and question.goals == () and question.scene is None and question.stratum == "all"


def test_words_stand_for_objects_where_no_scene_is_known(tmp_path):
    goal = {"parts": [{"kind": "relation", "relation": "on", "objects": ["the apple"], "reference": ["the plate"]}]}
    (row,) = load_goal_rows(written(tmp_path, ROW | {"scene": None, "goals": [goal]}))
    assert row.goals == (Goal((RelationPart("on", ("the apple",), ("the plate",)),)),)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"text": 7}, ["has no text", "text, scene, stratum, status, goals, also"]),
        ({"comment": "x"}, ["unknown key 'comment'", "text, scene, stratum, status, goals, also"]),
        ({"status": "fine"}, ["status cannot be 'fine'", "ok, ask, refused"]),
        ({"scene": "moon"}, ["scene cannot be 'moon'", "breakfast", "null"]),
        ({"goals": []}, ["goals", "'ok'", "one goal or more"]),
        ({"status": "refused"}, ["goals", "'refused'", "an empty list"]),
        ({"goals": [{"parts": []}]}, ["goal 0", "no parts", "refused"]),
        ({"goals": [LINE, {"parts": [{"kind": "structure", "shape": "giraffe"}]}]}, ["goal 1", "'giraffe'", "circle"]),
        ({"goals": [{"parts": [{"kind": "structure", "shape": "line", "gap": -1}]}]}, ["gap", "-1"]),
        (
            {"goals": [{"parts": [{"kind": "structure", "shape": "line", "objects": [0, 6]}]}]},
            ["no object 6", "0 to 5"],
        ),
        ({"goals": [{"parts": [{"kind": "structure", "shape": "line", "objects": ["mug"]}]}]}, ["'mug'", "indices"]),
        ({"scene": None}, ["0", "words"]),
        ({"also": "refused"}, ["also", "'refused'", "null"]),
        ({"status": "ask", "goals": [], "also": "ask"}, ["also", "'ask'", "refused, null"]),
    ],
)
def test_errors_name_the_line_the_value_and_what_is_legal(tmp_path, change, says):
    with pytest.raises(BenchmarkError) as caught:
        load_goal_rows(written(tmp_path, ROW, ROW | change))
    assert all(piece in str(caught.value) for piece in ["line 2", *says]), caught.value


def test_what_is_no_json_and_an_empty_file(tmp_path):
    with pytest.raises(BenchmarkError, match="line 1 is not valid JSON"):
        load_goal_rows(written(tmp_path, "{\n"))
    with pytest.raises(BenchmarkError, match="has no row"):
        load_goal_rows(written(tmp_path, "\n"))


def test_the_free_benchmark_has_what_it_promises():
    rows = free_goal_rows()
    strata = {row.stratum for row in rows}
    assert len(rows) >= 400 and len(strata) == 10
    assert all(sum(row.stratum == stratum for row in rows) >= 40 for stratum in strata)
    assert len({row.text.lower() for row in rows}) == len(rows) and all(row.scene for row in rows)
    assert sum(row.status == "refused" for row in rows) >= 25 and sum(row.status == "ask" for row in rows) >= 10
    structures = [part for row in rows for goal in row.goals for part in goal.structures]
    assert {part.shape for part in structures} == {*SHAPES, None}
    assert {key for part in structures for key in part.keys} == set(KEYS)
    assert {part.relation for row in rows for goal in row.goals for part in goal.relations} == set(RELATIONS)


def test_training_text_never_contains_a_sentence_of_the_benchmark():
    def plain(text):
        return " ".join(re.findall(r"\w+", text.lower()))

    held_out = {plain(row.text) for row in free_goal_rows()}
    rng = np.random.default_rng(11)
    assert not {plain(paraphrase(rng).text) for _ in range(5_000)} & held_out
    shown = {plain(text) for name in prompt_names() for text, _ in prompt_lines(load_prompt(name))}
    assert shown and not shown & held_out
