"""Batch files: what a row says, what is wrong with it, and that the rest goes on."""

import base64
import io
import json
import sys
import threading
import unicodedata
from dataclasses import replace
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path

import pytest

from agent.batch import rows
from agent.batch.rows import BadRow, Row, fingerprint, read_rows
from agent.errors import BadInput, UsageError
from agent.pipeline.instruction_parser import ReadingOptions, make_interpreter
from agent.pipeline.run import RunOptions
from agent.runtime.settings import MOST_SEED
from grounding.parsers.llm_reply import LLMError
from tests.counting import counted_calls

DEFAULTS = RunOptions(model="geometric", seed=7)
GOOD = '{"text": "stack the cans"}'


@pytest.fixture
def read(tmp_path):
    """Reads a file with the given content."""

    def rows(content: str | bytes, name: str = "orders.jsonl") -> list[Row | BadRow]:
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return read_rows(str(path), DEFAULTS)

    return rows


def test_plain_text_has_an_instruction_a_line(read):
    rows = read("\ufeff# tables\r\n\r\n make a line \r\n  # not this\nstack the cans", "orders.txt")
    assert [(row.line, row.id, row.text) for row in rows] == [
        (3, "line-003", "make a line"),
        (5, "line-005", "stack the cans"),
    ]
    assert all(row.options == DEFAULTS for row in rows)


def test_keys_are_called_as_the_flags(read, tmp_path):
    (tmp_path / "desk.yaml").write_text("version: 1")
    (tmp_path / "checkpoints").mkdir()
    given = {
        "id": "mine", "text": "stack the cans", "scene": "desk.yaml", "objects": "procedural", "model": "diffusion",
        "weights": "checkpoints", "seed": 3, "execute": False, "parser": "llm", "viewpoint": "opposite",
        "llm_url": "http://127.0.0.1:1/v1",
    }  # fmt: skip
    row, plain = read(json.dumps(given) + "\n\n" + '{"text": "a row", "seed": null}')
    options = row.options
    assert (row.id, row.line, row.text) == ("mine", 1, "stack the cans")
    assert (options.scene, options.weights) == (str(tmp_path / "desk.yaml"), tmp_path / "checkpoints")
    assert (options.objects, options.model, options.seed, options.execute) == ("procedural", "diffusion", 3, False)
    assert (options.reading.parser, options.reading.viewpoint) == ("llm", "opposite")
    assert options.reading.llm_url == given["llm_url"]
    assert (plain.id, plain.line, plain.options) == ("line-003", 3, DEFAULTS)


@pytest.mark.parametrize(
    ("line", "code", "parts"),
    [
        ('{"text": "a"', 6, ("not JSON", "place 13")),
        ("make a line", 6, ("not JSON",)),
        ("[" * 100_000, 6, ("not JSON",)),
        ('{"text": "a", "seed": ' + "9" * 5000 + "}", 6, ("not JSON",)),
        ('["a"]', 6, ("must be an object", '["a"]')),
        ('{"seed": 1}', 6, ('"text"', "is missing")),
        ('{"text": 5}', 6, ("text must be a string", "5")),
        ('{"text": "half \\ud800"}', 6, ("surrogate",)),
        ('{"text": "a", "sceen": "x"}', 6, ('"sceen"', "legal: id, text, scene, objects")),
        ('{"text": "a", "text": "b"}', 6, ('"text" is given twice',)),
        ('{"text": "a", "seed": "3"}', 6, ("seed must be a whole number", '"3"')),
        ('{"text": "a", "seed": 3.5}', 6, ("seed must be a whole number", "3.5")),
        ('{"text": "a", "seed": true}', 6, ("seed must be a whole number", "true")),
        ('{"text": "a", "execute": 1}', 6, ("execute must be true or false", "1")),
        ('{"text": "a", "scene": "nowhere.yaml"}', 6, ('scene cannot be "nowhere.yaml"', "simulated")),
        ('{"text": "a", "objects": "nowhere"}', 6, ('objects cannot be "nowhere"', "ycb")),
        ('{"text": "a", "weights": "nowhere"}', 6, ('weights cannot be "nowhere"',)),
        ('{"text": "a", "seed": -1}', 2, ("seed cannot be -1", "from 0 to")),
        (f'{{"text": "a", "seed": {MOST_SEED + 1}}}', 2, ("seed cannot be", str(MOST_SEED))),
        ('{"text": "a", "model": "oracle"}', 2, ('model cannot be "oracle"', "diffusion", "geometric")),
        ('{"text": "a", "parser": "psychic"}', 2, ('parser cannot be "psychic"', "embedding", "llm")),
        ('{"text": "a", "viewpoint": "above"}', 2, ('viewpoint cannot be "above"', "robot", "opposite")),
        ('{"text": "a", "id": 7}', 6, ("id cannot be 7", "letter")),
        ('{"text": "a", "id": ""}', 6, ('id cannot be ""',)),
        ('{"text": "a", "id": "../up"}', 6, ('id cannot be "../up"', "folder")),
        ('{"text": "a", "id": ".hidden"}', 6, ('id cannot be ".hidden"',)),
        ('{"text": "a", "id": "first."}', 6, ('id cannot be "first."', 'the last no "."')),
        ('{"text": "a", "id": "first "}', 6, ('id cannot be "first "',)),
        ('{"text": "a", "id": "first\\n"}', 6, ("id cannot be",)),
        ('{"text": "a", "id": "a/b"}', 6, ('id cannot be "a/b"',)),
        ('{"text": "a", "id": "a\\\\b"}', 6, ("id cannot be",)),
        ('{"text": "a", "id": "a\\u0000b"}', 6, ("id cannot be",)),
        ('{"text": "a", "id": "caf\u00e9"}', 6, ("id cannot be", "letters a-z")),
        ('{"text": "a", "id": "cafe\u0301"}', 6, ("id cannot be", "letters a-z")),
        ('{"text": "a", "id": "\uff46irst"}', 6, ("id cannot be",)),
        ('{"text": "a", "id": "\u202eabc"}', 6, (r'id cannot be "\u202eabc"',)),
        ('{"text": "a", "id": "CON"}', 6, ('id cannot be "CON"', "some systems")),
        ('{"text": "a", "id": "lpt1.txt"}', 6, ('id cannot be "lpt1.txt"',)),
        ('{"text": "a", "id": "' + "a" * 81 + '"}', 6, ("id cannot be", "80 letters")),
        ('{"text": "a", "id": ["a"]}', 6, ('id cannot be ["a"]',)),
        ('{"text": "a", "id": "LINE-7"}', 6, ('"LINE-7" is reserved',)),
        ('{"text": "a", "id": "line-007"}', 6, ('"line-007" is reserved', '"line-002"')),
        ('{"text": "a", "id": "First"}', 6, ('"First" is already that of line 1',)),
    ],
)
def test_a_bad_row_is_reported_in_its_place(read, line, code, parts):
    first, bad, last = read(f'{{"text": "make a line", "id": "first"}}\n{line}\n{GOOD}\n')
    assert isinstance(first, Row) and isinstance(last, Row)
    assert isinstance(bad, BadRow) and (bad.line, bad.id, bad.exit_code) == (2, "line-002", code)
    assert bad.message.startswith("line 2: ") and "\n" not in bad.message and len(bad.message) < 400
    assert all(part in bad.message for part in parts), bad.message


def test_a_bad_row_keeps_an_id_that_is_its_own(read):
    (bad,) = read('{"id": "mine", "text": "a", "seed": -1}')
    assert (bad.id, bad.text) == ("mine", "a")


def test_bytes_that_are_no_text(read):
    bad, good = read(b"make a \xff line\nstack the cans\n", "orders.txt")
    assert "0xff at place 8" in bad.message and bad.exit_code == 6 and good.text == "stack the cans"


@pytest.mark.parametrize(
    ("name", "content", "texts"),
    [
        ("orders", f"\n  {GOOD}\n", ["stack the cans"]),
        ("orders", 'a row\n{"text": "b"}', ["a row", None]),
        ("orders.txt", '{"text": "b"}', ["b"]),
        ("orders.txt", f"[{GOOD}]", ["stack the cans"]),
        ("orders.json", f"[{GOOD},\n{GOOD}]", ["stack the cans"] * 2),
        ("orders.jsonl", f"[{GOOD}]", ["stack the cans"]),
        ("orders.txt", '["a row", "stack the cans"]', ["a row", "stack the cans"]),
        ("orders.txt", "text\ta row".replace("a row", "seed") + "\na row\t7", ["a row"]),
        ("orders.NDJSON", GOOD, ["stack the cans"]),
        ("orders.txt", GOOD.encode("utf-16"), ["stack the cans"]),
    ],
)
def test_format_by_content(read, name, content, texts):
    assert [row.text for row in read(content, name)] == texts


def test_a_bad_element_of_an_array_costs_no_other_and_is_named_by_its_place(read):
    content = f'[{GOOD}, {{"text": "a", "text": "b"}}, 7, {{"text": "a", "id": "row-009"}}, {{"seed": 1}}, {GOOD}]'
    first, twice, number, reserved, textless, last = read(content, "orders.json")
    assert isinstance(first, Row) and isinstance(last, Row) and (first.id, last.id) == ("row-001", "row-006")
    assert twice.message == 'row 2: the key "text" is given twice' and "an object such as" in number.message
    assert '"row-009" is reserved' in reserved.message and '"text"' in textless.message
    assert {row.exit_code for row in (twice, number, reserved, textless)} == {6}


def test_json_among_lines_of_text_is_no_instruction(read):
    good, bad = read('make a line\n{"text": "stack the cans"}', "orders.txt")
    assert good.text == "make a line" and bad.message.startswith("line 2: this is JSON in a file of plain text")


def test_a_table_gives_rows_with_the_kinds_of_the_keys(read):
    content = "id,text,seed,execute\nmine,make a line,7,FALSE\n,stack the cans,,\n"
    content += "other,a row,x,true\nodd,a row,1,maybe\n"
    mine, plain, *bad = read(content, "orders.csv")
    assert (mine.id, mine.line, mine.options.seed, mine.options.execute) == ("mine", 2, 7, False)
    assert (plain.id, plain.text, plain.options) == ("line-003", "stack the cans", DEFAULTS)
    assert 'seed must be a whole number, got "x"' in bad[0].message
    assert 'execute must be true or false, got "maybe"' in bad[1].message
    (odd,) = read("text,colour\nmake a line,red\n", "orders.csv")
    assert 'the key "colour" is unknown' in odd.message


@pytest.mark.parametrize(
    ("content", "why"), [("[1, 2", "cannot be read as JSON"), (b"PK\x03\x04\0\0", "not text"), ("<html>", "markup")]
)
def test_a_file_of_another_kind_is_one_sentence(read, content, why):
    with pytest.raises(BadInput, match=f"orders.txt' .*{why}.*; legal: one instruction per line"):
        read(content, "orders.txt")


def test_fingerprint_changes_with_what_decides_the_result_and_nothing_else(read, tmp_path):
    scene = tmp_path / "desk.yaml"
    scene.write_text("version: 1")
    lines = [
        GOOD,
        '{"text": "stack the cans", "id": "other"}',
        '{"text": "stack the cans", "seed": 7}',
        '{"text": "stack the mugs"}',
        '{"text": "stack the cans", "seed": 8}',
        '{"text": "stack the cans", "execute": false}',
        '{"text": "stack the cans", "viewpoint": "opposite"}',
        '{"text": "stack the cans", "scene": "desk.yaml"}',
    ]
    prints = [row.fingerprint for row in read("\n".join(lines))]
    assert len(set(prints[:3])) == 1 and len(set(prints[2:])) == len(prints[2:])
    scene.write_text("version: 1 # edited")
    again = [row.fingerprint for row in read("\n".join(lines))]
    assert again[:-1] == prints[:-1] and again[-1] != prints[-1]


def test_standard_input(monkeypatch):
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(b"make a line\n\n# no\nstack the cans\n")))
    assert [(row.line, row.text) for row in read_rows("-", DEFAULTS)] == [(1, "make a line"), (4, "stack the cans")]


@pytest.mark.parametrize("content", ["", "\n \n", "# nothing\n"])
def test_a_file_without_rows(read, content):
    with pytest.raises(BadInput, match="orders.txt' has no rows"):
        read(content, "orders.txt")


def test_a_file_that_is_not_there(tmp_path):
    with pytest.raises(BadInput, match="there is no batch file 'orders.txt'"):
        read_rows("orders.txt", DEFAULTS)


def test_flags_that_are_not_legal_end_the_batch(tmp_path):
    (tmp_path / "orders.txt").write_text("make a line")
    with pytest.raises(UsageError, match='--model cannot be "oracle"; legal: diffusion'):
        read_rows(str(tmp_path / "orders.txt"), RunOptions(model="oracle"))
    with pytest.raises(BadInput, match='--weights cannot be "nowhere"'):
        read_rows(str(tmp_path / "orders.txt"), RunOptions(weights=Path("nowhere")))


def test_a_rows_endpoint_has_no_key_but_on_the_host_that_the_user_named(tmp_path, monkeypatch):
    """Batches come from other people, and a key that is sent to a row's address would be theirs."""
    monkeypatch.setenv("STRUCTAGENT_LLM_KEY", "hunter2")
    sent: dict[str, str | None] = {}

    class Answers(BaseHTTPRequestHandler):
        def do_POST(self):
            sent[self.path] = self.headers["Authorization"]
            self.rfile.read(int(self.headers["Content-Length"]))
            self.send_response(401)
            self.end_headers()

        def log_message(self, *_):
            pass

    with HTTPServer(("127.0.0.1", 0), Answers) as mine, HTTPServer(("127.0.0.1", 0), Answers) as theirs:
        for server in (mine, theirs):
            threading.Thread(target=server.serve_forever, daemon=True).start()
        here, there = (f"http://127.0.0.1:{server.server_port}" for server in (mine, theirs))
        path = tmp_path / "orders.jsonl"
        addresses = (None, f"{here}/same", f"{there}/theirs", f"http://127.0.0.1:{mine.server_port}@{there[7:]}/trick")
        lines = (json.dumps({"text": "a tower", "parser": "llm", "llm_url": address}) for address in addresses)
        path.write_text("\n".join(lines) + "\n")
        reading = ReadingOptions(llm_url=f"{here}/mine", key_url=f"{here}/mine")
        for row in read_rows(str(path), replace(DEFAULTS, reading=reading)):
            with pytest.raises(LLMError, match="key"):
                make_interpreter(row.options.reading, strict=True).interpret("a tower")
        for server in (mine, theirs):
            server.shutdown()
    key = "Bearer hunter2"
    sent = {path.split("/")[1]: key for path, key in sent.items()}
    trick = sent.pop("trick")
    assert sent == {"mine": key, "same": key, "theirs": None}
    assert trick.startswith("Basic ") and "hunter2" not in base64.b64decode(trick[6:]).decode()


def test_a_rows_password_is_not_repeated(read):
    for address in ("ftp://me:hunter2@host/", "http://me:hunter2@[1/", ["http://me:hunter2@host/"]):
        (row,) = read(json.dumps({"text": "a tower", "llm_url": address}))
        assert isinstance(row, BadRow) and "llm_url" in row.message and "hunter2" not in row.message


def test_who_is_trusted_with_a_key_decides_no_result(read, tmp_path):
    (row,) = read(GOOD)
    trusting = replace(row.options, reading=replace(row.options.reading, key_url="http://127.0.0.1:1"))
    assert fingerprint(row.text, trusting) == row.fingerprint


def test_a_row_with_many_keys_is_read_at_once_and_a_long_one_not_at_all(read):
    many = "{" + ", ".join(f'"{number}": 1' for number in range(8000)) + "}"
    twice = many[:-1] + ', "text": "a", "text": "b"}'
    long = json.dumps({"text": "a" * 100_000})
    with counted_calls() as steps:
        unknown, double, too_long, good = read("\n".join((many, twice, long, GOOD)))
    assert steps.count < 4000  # fewer than there are keys: nothing is searched for each of them
    assert 'the key "0" is unknown' in unknown.message and 'the key "text" is given twice' in double.message
    assert (too_long.message, too_long.exit_code) == ("line 3: the row has 100012 bytes; at most 100000 are read", 6)
    assert good.text == "stack the cans"


def test_a_batch_file_that_is_too_large_is_refused(read, monkeypatch):
    monkeypatch.setattr(rows, "BATCH_BYTES", len(GOOD) - 1)
    with pytest.raises(BadInput, match="orders.jsonl' has more than 25 bytes; divide it into several batches"):
        read(GOOD)
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(GOOD.encode() * 10)))
    with pytest.raises(BadInput, match="'-' has more than 25 bytes"):
        read_rows("-", DEFAULTS)


def test_ids_that_look_like_something_else_are_legal(read):
    names = ["console", "com", "a" * 80, "7", "a..b", "x-", "x_", "null1"]
    rows = read("".join(f'{{"id": "{name}", "text": "make a line"}}\n' for name in names))
    assert [row.id for row in rows] == names and all(isinstance(row, Row) for row in rows)


def test_no_two_rows_share_a_folder_on_a_disk_that_knows_no_case_and_no_accents(read):
    names = ["a", "A", "\u00e9", "e\u0301", "b", "b.", "B", "line-1", "LINE-001", "\uff41"]
    rows = read("".join(json.dumps({"id": name, "text": "make a line"}) + "\n" for name in names))
    folded = [unicodedata.normalize("NFKC", row.id).casefold().rstrip(". ") for row in rows]
    assert len(set(folded)) == len(rows)
    refused = [row for row in rows if isinstance(row, BadRow)]
    assert [row.line for row in refused] == [2, 3, 4, 6, 7, 8, 9, 10]
    assert refused[0].message == 'line 2: the id "A" is already that of line 1; each must be unique'


def test_a_row_names_its_example(read, tmp_path):
    (tmp_path / "gate.toml").write_text("")
    other, own = read(b'{"text": "a line"}\n{"text": "the same", "like": "gate.toml", "exact": true}')
    assert (other.options.example, other.options.exact) == (None, False)
    assert (own.options.example, own.options.exact) == (tmp_path / "gate.toml", True)
    (tmp_path / "gate.toml").write_text("another")
    assert read(b'{"text": "the same", "like": "gate.toml", "exact": true}')[0].fingerprint != own.fingerprint
    assert read(b'{"text": "a line"}')[0].fingerprint == other.fingerprint


@pytest.mark.parametrize(("row", "message"), [
    ('{"text": "the same", "like": "none.yaml"}', 'like cannot be "none.yaml"; legal: an existing file or'),
    ('{"text": "the same", "like": 3}', "like must be a string, got 3"),
    ('{"text": "the same", "exact": true}', "exact needs an example; name it with like"),
    ('{"text": "the same", "like": ".", "parser": "llm"}', "like works only without a language model"),
])  # fmt: skip
def test_a_row_with_a_wrong_example_is_told(read, row, message):
    (bad,) = read(row.encode())
    assert message in bad.message
