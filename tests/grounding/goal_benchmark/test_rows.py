"""The rows of the benchmark of goals: what is legal, and what the errors say."""

import json

import pytest

from grounding.benchmark import BenchmarkError
from grounding.goal_benchmark.rows import goal_scenes, load_goal_rows
from grounding.goals.goal import Goal
from grounding.goals.parts import RelationPart, StructurePart

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
            assert 0 < min(thing.attributes.size) and max(thing.attributes.size) < 0.4


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
        ({"text": 7}, ["has no text", "text, scene, stratum, status, goals"]),
        ({"comment": "x"}, ["unknown key 'comment'", "text, scene, stratum, status, goals"]),
        ({"status": "fine"}, ["status cannot be 'fine'", "ok, ask, refused"]),
        ({"scene": "moon"}, ["scene cannot be 'moon'", "breakfast", "null"]),
        ({"goals": []}, ["goals", "'ok'", "one goal or more"]),
        ({"status": "refused"}, ["goals", "'refused'", "an empty list"]),
        ({"goals": [{"parts": []}]}, ["goal 0", "no parts", "refused"]),
        ({"goals": [LINE, {"parts": [{"kind": "structure", "shape": "star"}]}]}, ["goal 1", "'star'", "circle"]),
        ({"goals": [{"parts": [{"kind": "structure", "shape": "line", "gap": -1}]}]}, ["gap", "-1"]),
        ({"goals": [{"parts": [{"kind": "structure", "shape": "line", "objects": [0, 6]}]}]}, ["no object 6", "0 to 5"]),
        ({"goals": [{"parts": [{"kind": "structure", "shape": "line", "objects": ["mug"]}]}]}, ["'mug'", "indices"]),
        ({"scene": None}, ["0", "words"]),
    ],
)
def test_errors_name_the_line_the_value_and_what_is_legal(tmp_path, change, says):
    with pytest.raises(BenchmarkError) as caught:
        load_goal_rows(written(tmp_path, ROW, ROW | change))
    assert all(piece in str(caught.value) for piece in ["line 2", *says]), caught.value


def test_what_is_no_json_and_an_empty_file(tmp_path):
    with pytest.raises(BenchmarkError, match="line 1 is not valid JSON"):
        load_goal_rows(written(tmp_path, "{\n"))
    with pytest.raises(BenchmarkError, match="holds no row"):
        load_goal_rows(written(tmp_path, "\n"))
