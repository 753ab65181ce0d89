"""`structagent evaluate parse` on a small file: the table, the JSON, the pictures."""

import json

import pytest
from PIL import Image

from agent.cli.app import command_line

ROWS = [
    {"text": "put the cups in a circle", "shape": ["circle"], "stratum": "easy"},
    {"text": "build a tower on the left", "shape": ["tower"], "x_position": ["left"], "stratum": "easy"},
    {"text": "what time is it", "refuse": True, "stratum": "none"},
    {
        "text": "stack the cans", "shape": ["tower"], "stratum": "objects",
        "scene": ["mug", "can", "can"], "objects": [1, 2],
    },
    {"text": "make a row", "shape": ["circle"], "stratum": "mislabelled"},
]  # fmt: skip


@pytest.fixture
def data(tmp_path):
    path = tmp_path / "rows.jsonl"
    path.write_text("".join(json.dumps(row) + "\n" for row in ROWS))
    return path


def test_report_and_pictures(data, tmp_path, capsys):
    assert command_line(["evaluate", "parse", "--data", str(data), "--out", str(tmp_path / "out"), "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    (found,) = report["evaluations"]
    assert found["parser"] == "embedding" and found["rows"] == 5
    assert found["exact"]["hits"] == 4 and found["strata"]["mislabelled"]["hits"] == 0
    assert found["objects"]["rate"] == 1.0 and found["refusal"]["recall"]["rate"] == 1.0
    assert found["wrong"][0]["text"] == "make a row" and found["confusion"]["shape"]["circle"]["line"] == 1
    assert 0 < found["seconds_warm"] <= found["seconds_warm_most"] and found["instructions_per_second"] > 0
    assert json.loads((tmp_path / "out" / "parse.json").read_text()) == report
    with Image.open(tmp_path / "out" / "confusion-embedding-rows.png") as picture:
        assert picture.width > 1000


def test_table(data, capsys):
    assert command_line(["evaluate", "parse", "--data", str(data), "--limit", "2"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].split()[:4] == ["parser", "data", "n", "exact"]
    rows = [line for line in lines if line.startswith("embedding")]
    *tables, command = lines
    assert " 2 " in rows[0] and max(map(len, tables)) <= 120 and command.startswith("structagent evaluate parse ")
    assert any("95 % Wilson" in line for line in lines)


def test_a_file_that_is_no_benchmark(tmp_path, capsys):
    path = tmp_path / "rows.jsonl"
    path.write_text('{"text": "a row", "shape": ["star"]}\n')
    assert command_line(["evaluate", "parse", "--data", str(path)]) == 6
    error = capsys.readouterr().err
    assert "line 1" in error and "'star'" in error and "circle, line, tower, table setting" in error
    assert command_line(["evaluate", "parse", "--data", str(tmp_path / "none.jsonl")]) == 6
