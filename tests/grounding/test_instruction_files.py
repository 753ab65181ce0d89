"""Files of instructions are told by their content, and what is no instruction is never read as one."""

import bz2
import json
import lzma

import pytest

from grounding.instruction_files import JSON, TABLE, TEXT, InstructionFileError, as_utf8, looks_like_json, read_entries

ROWS = [{"id": "a", "text": "stack the blocks"}, {"id": "b", "text": "make a line"}]
LINES = "\n".join(map(json.dumps, ROWS))
TEXTS = ["stack the blocks", "make a line"]


def texts(content, kind=None):
    """Its kind, unit, numbers, and instructions."""
    found = read_entries(content if isinstance(content, bytes) else content.encode(), kind)
    values = [json.loads(row.content) if found.kind != TEXT else row.content.decode().strip() for row in found.rows]
    said = [value["text"] if isinstance(value, dict) else value for value in values]
    return found.kind, found.unit, [row.number for row in found.rows], said


@pytest.mark.parametrize(
    ("content", "kind", "unit", "numbers"),
    [
        ("stack the blocks\nmake a line\n", TEXT, "line", [1, 2]),
        ("# mine\n\n stack the blocks \r\n\r\nmake a line", TEXT, "line", [3, 5]),
        (LINES, JSON, "line", [1, 2]),
        ("# mine\n" + LINES, JSON, "line", [2, 3]),
        (json.dumps(ROWS), JSON, "row", [1, 2]),
        (json.dumps(ROWS, indent=2), JSON, "row", [1, 2]),
        ("\n [\n" + LINES.replace("\n", ",\n") + "\n]\n", JSON, "row", [1, 2]),
        (json.dumps(TEXTS), JSON, "row", [1, 2]),
        (json.dumps(TEXTS, indent=1), JSON, "row", [1, 2]),
        ("\n".join(map(json.dumps, TEXTS)), JSON, "line", [1, 2]),
        ("\n".join(json.dumps(row, indent=1) for row in ROWS), JSON, "row", [1, 2]),
        ("id,text\na,stack the blocks\nb,make a line\n", TABLE, "line", [2, 3]),
        ("id\tInstruction\r\na\tstack the blocks\r\n\r\nb\tmake a line\r\n", TABLE, "line", [2, 4]),
        ('"text";"id"\n"stack the blocks";a\n"make a line";b', TABLE, "line", [2, 3]),
        ("text\nstack the blocks\nmake a line\n", TABLE, "line", [2, 3]),
        ("id|text\na|stack the blocks\nb|make a line\n", TABLE, "line", [2, 3]),
        ("sep=;\r\ntext;id\r\nstack the blocks;a\r\nmake a line;b\r\n", TABLE, "line", [3, 4]),
        ('"sep=\t"\nid\ttext\na\tstack the blocks\nb\t"make a line"\n', TABLE, "line", [3, 4]),
        ("# mine\nSEP=,\nid,text\na,stack the blocks\nb,make a line\n", TABLE, "line", [4, 5]),
        ("stack the blocks\rmake a line\r", TEXT, "line", [1, 2]),
        ("text,id\rstack the blocks,a\rmake a line,b", TABLE, "line", [2, 3]),
        (LINES.replace("\n", "\r"), JSON, "line", [1, 2]),
    ],
)
@pytest.mark.parametrize(
    "encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "utf-32", "utf-32-le", "utf-32-be"]
)
def test_a_file_is_what_its_content_is(content, kind, unit, numbers, encoding):
    assert texts(content.encode(encoding)) == (kind, unit, numbers, TEXTS)


@pytest.mark.parametrize(
    "content",
    [
        "[left] stack the blocks\n[right] make a line",
        "[1] stack the blocks",
        '"stack" the blocks',
        "put the cups, please, on the left; then stack the cans",
        "put the cups, please, on the left\nput the cans, please, on the left",
        "{ stack the blocks",
        "text me when the blocks are stacked",
        "- stack the blocks\n- make a line",
        "a < b",
    ],
)
def test_sentences_are_sentences(content):
    assert texts(content)[0] == TEXT


@pytest.mark.parametrize(
    ("content", "why"),
    [
        ('[{"text": "stack the blocks"},', "begins like JSON, but cannot be read as JSON: .* in line 1"),
        ('[\n "stack the blocks"\n "make a line"\n]', "cannot be read as JSON: .* in line 3"),
        ("[" * 100_000, "cannot be read as JSON"),
        ('{\n "text": "stack the blocks",\n', "cannot be read as JSON"),
        ("PK\3\4\0\0\0\0", "is not text"),
        (b"\xff\xfe\x00", "begins like UTF-16-LE text"),
        ("<!DOCTYPE html><p>stack the blocks", "markup"),
        ('<?xml version="1.0"?><rows/>', "markup"),
        ("- text: stack the blocks\n- text: make a line", "looks like YAML"),
        ("---\nrows:\n", "looks like YAML"),
        ("| id | text |\n|---|---|\n| a | stack the blocks |", "Markdown table"),
        ("a\tstack the blocks\t7\nb\tmake a line\t8", "names no column 'text'"),
        ("a,stack the blocks,7\nb,make a line,8", "names no column 'text'"),
        ("text,text\na,b", "two columns have the same name"),
        ('text\n"' + "a" * 200_000, "cannot be read: field larger"),
        ('text,seed\nstack the blocks,1\n"make a line,2\nmake a circle,3\n', "in line 3 never ends"),
        ("sep=;\nwish;seed\nmake a line;3\n", "names no column"),
        (bz2.compress(b"stack the blocks\nmake a line\n"), "is not text"),
        (lzma.compress(b"stack the blocks\nmake a line\n"), "is not text"),
        ("%PDF-1.7\n1 0 obj\n<< >>\nendobj\n", "looks like PDF"),
        ("{\\rtf1\\ansi make a line\\par}", "looks like RTF"),
        ("[batch]\ntext = make a line\n", "looks like a file of settings"),
        ('rows = [{"text": "make a line"}]\n', "looks like a file of settings"),
    ],
)
def test_what_else_a_file_is_is_named(content, why):
    with pytest.raises(InstructionFileError, match=why) as caught:
        read_entries(content if isinstance(content, bytes) else content.encode())
    assert "\n" not in str(caught.value)


def test_a_damaged_line_costs_no_other():
    assert len(read_entries((LINES + '\n{"text": \n').encode()).rows) == 3
    assert len(read_entries(('{"text": \n' + LINES).encode()).rows) == 3
    assert len(read_entries(("this is no JSON\n" + LINES).encode(), JSON).rows) == 3


def test_an_object_that_holds_the_rows_is_one_row_and_none_of_its_lines_is():
    content = '{\n"rows": [\n' + LINES.replace("\n", ",\n") + "\n]\n}"
    (row,) = read_entries(content.encode()).rows
    assert list(json.loads(row.content)) == ["rows"]


def test_a_table_that_is_promised_names_its_columns():
    with pytest.raises(InstructionFileError, match="its first line names no column 'text' or 'instruction'"):
        read_entries(b"stack the blocks\n", TABLE)


def test_cells_may_hold_lines_and_be_too_many():
    found = read_entries(b'id,text\na,"stack,\nthe blocks"\nb,c,d,e\n')
    assert [row.number for row in found.rows] == [2, 4]
    assert [json.loads(row.content) for row in found.rows] == [
        {"id": "a", "text": "stack,\nthe blocks"}, {"id": "b", "text": "c", "column 3": "d", "column 4": "e"}
    ]  # fmt: skip


def test_damaged_bytes_stay_in_their_line():
    assert [row.content for row in read_entries(b"make a \xff line\nstack").rows] == [b"make a \xff line", b"stack"]
    assert as_utf8(b"\xef\xbb\xbfa") == b"a"


def test_what_is_nearly_json_is_no_instruction():
    for content in ("{'text': 'make a line', 'seed': 3}\n{'text': 'stack'}\n", "{text: 'make a line'}\n"):
        assert read_entries(content.encode()).kind == JSON


@pytest.mark.parametrize("text", ["[", "{", '{"a": 1}', '["a"]', "[[1]]", "[1, 2]", "[]", "{}", ' [ {"a"', "[null]"])
def test_json_is_recognised(text):
    assert looks_like_json(text)
