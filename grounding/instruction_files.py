"""Tell what a file of instructions is by its content: lines of text, JSON rows, a JSON array, or a table.

A file that is none of these is named as what it is; nothing but plain text is taken for instructions.
"""

from __future__ import annotations

import codecs
import csv
import io
import json
import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass

LEGAL = (
    "legal: one instruction per line, JSON lines, a JSON array of rows, and a table whose first line names the columns"
)
TEXT, JSON, TABLE = "text", "json", "table"
TEXT_COLUMNS = ("text", "instruction")
_BYTE_ORDER_MARKS = (
    (codecs.BOM_UTF8, "utf-8"), (codecs.BOM_UTF32_LE, "utf-32-le"), (codecs.BOM_UTF32_BE, "utf-32-be"),
    (codecs.BOM_UTF16_LE, "utf-16-le"), (codecs.BOM_UTF16_BE, "utf-16-be"),
)  # fmt: skip
_DELIMITERS = "\t,;|"
# How spreadsheets tell each other, before a table, what separates its cells.
_SAID_DELIMITER = re.compile(r'\s*"?sep=(.)"?[\t,;|]*\s*', re.IGNORECASE)
# What begins a JSON object or array, and no sentence.
_JSON_BEGINNING = re.compile(
    r'\s*(?:\{\s*(?:$|"|\}\s*$|\'?\w+\'?\s*:)|\[\s*(?:$|[\[{"]|\]\s*$|-?\d+(?:\.\d+)?\s*,|(?:null|true|false)\b))'
)
_MARKUP = re.compile(rb"\s*<(?:!doctype|html|\?xml|[a-z]+[ >])", re.IGNORECASE)
# What else a file can begin with, and a list of sentences does not.
_OTHERS = {
    "YAML": re.compile(rb"(?:---|%YAML|- *\w+:|\w+: *$)"),
    "a file of settings": re.compile(rb"\[[\w. -]+\] *$|\w+ *= *[\[{\"']"),
    "PDF": re.compile(rb"%PDF-"),
    "RTF": re.compile(rb"\{\\rtf"),
    "a Markdown table": re.compile(rb" *\|"),
}
# Characters that files of other programs are full of, and no text has: not those for lines, columns and records.
_CONTROL = re.compile(rb"[\x00-\x08\x0e-\x19\x1c\x1d\x7f]")
_HEAD = 1000  # bytes by which a file is known
_SEPARATOR = re.compile(rb"\t|;(?! )|,(?! )")


class InstructionFileError(ValueError):
    """A file of another kind; the message follows its name."""


@dataclass(frozen=True)
class Entry:
    """One row of a file.

    Attributes:
        number: of its line, or of its place in an array, from 1.
        content: UTF-8, which may be damaged: a line of text, a JSON value, or the JSON object of a table's cells.
    """

    number: int
    content: bytes


@dataclass(frozen=True)
class Entries:
    """The rows of a file.

    Attributes:
        kind: `TEXT`, `JSON`, or `TABLE`, whose cells are all strings.
        unit: what a number counts: "line" or "row".
        rows: in order; blank lines and comments are left out.
    """

    kind: str
    unit: str
    rows: list[Entry]


def encoding_of(content: bytes) -> tuple[str, int]:
    """Return the encoding of a file's beginning, and the length of its byte order mark."""
    for mark, encoding in _BYTE_ORDER_MARKS:
        if content.startswith(mark):
            return encoding, len(mark)
    # Latin letters in UTF-16 have a zero in every second byte.
    head = content[:200]
    zeros = [head[place::4].count(0) / max(1, len(head) // 4) for place in range(4)]
    for encoding, high in (("utf-32-le", zeros[1:]), ("utf-32-be", zeros[:3])):
        if len(head) >= 4 and min(high) > 0.8:
            return encoding, 0
    odd, even = head[1::2].count(0), head[::2].count(0)
    if len(head) >= 2 and max(odd, even) > 0.8 * (len(head) // 2):
        return ("utf-16-le" if odd > even else "utf-16-be"), 0
    return "utf-8", 0


def as_utf8(content: bytes) -> bytes:
    """Return a text in UTF-8 without a byte order mark; bytes that are no text stay where the file is UTF-8.

    Raises:
        InstructionFileError: for bytes that are no text.
    """
    encoding, mark = encoding_of(content)
    body = content[mark:]
    if encoding != "utf-8":
        try:
            body = body.decode(encoding).encode()
        except UnicodeError:
            raise InstructionFileError(f"begins like {encoding.upper()} text, but is not") from None
    if b"\0" in body:
        raise InstructionFileError(f"is not text: it has zero bytes; {LEGAL}")
    head = body[:_HEAD]
    if len(_CONTROL.findall(head)) > len(head) / 50:
        raise InstructionFileError(f"is not text: it has control characters; {LEGAL}")
    return body


def read_entries(content: bytes, kind: str | None = None) -> Entries:
    """Divide a file into its rows.

    Args:
        content: of the file.
        kind: that its name promises, if any.

    Raises:
        InstructionFileError: for a file of another kind.
    """
    content = as_utf8(content)
    if b"\n" not in content:
        content = content.replace(b"\r", b"\n")  # as some programs still end lines
    if _MARKUP.match(content):
        raise InstructionFileError(f"is a page or a document in markup; {LEGAL}")
    lines = [Entry(number, line.rstrip(b"\r")) for number, line in enumerate(content.split(b"\n"), start=1)]
    lines = [line for line in lines if line.content.strip()]
    said = [line for line in lines if not line.content.lstrip().startswith(b"#")]
    if not said:
        return Entries(kind or TEXT, "line", lines if kind == JSON else [])
    first = said[0].content.decode("utf-8", "replace")
    if kind != JSON and (said_delimiter := _SAID_DELIMITER.fullmatch(first)) and len(said) > 1:
        return _table_entries(content, said[1].content.decode("utf-8", "replace"), said_delimiter[1])
    if kind != TABLE and (kind == JSON or looks_like_json(first) or _all_quoted(said)):
        return _json_entries(content, lines if kind == JSON else said, promised=kind == JSON)
    for other, beginning in _OTHERS.items():
        if kind is None and beginning.match(said[0].content):
            raise InstructionFileError(f"looks like {other}; {LEGAL}")
    delimiter = _delimiter(first, _DELIMITERS)
    if kind == TABLE or delimiter is not None:
        return _table_entries(content, first, delimiter)
    if _like_a_table(said):
        raise InstructionFileError(
            "looks like a table, but its first line names no column "
            f"{' or '.join(map(repr, TEXT_COLUMNS))}; without a table, leave out its separators"
        )
    return Entries(TEXT, "line", said)


def looks_like_json(text: str) -> bool:
    """Tell whether a text begins as a JSON object or array does, and not as a sentence does."""
    return _JSON_BEGINNING.match(text) is not None


def _like_a_table(lines: Sequence[Entry]) -> bool:
    """Tell whether lines have as many cells each, between separators as no sentence has them."""
    cells = {tuple(_SEPARATOR.findall(line.content.strip())) for line in lines}
    return len(lines) > 1 and len(cells) == 1 and bool(next(iter(cells)))


def _all_quoted(lines: Collection[Entry]) -> bool:
    return all(line.content.lstrip().startswith(b'"') and _is_json(line.content, str) for line in lines)


def _is_json(content: bytes, kind: type) -> bool:
    try:
        return isinstance(json.loads(content), kind)
    except (ValueError, RecursionError):
        return False


def _json_entries(content: bytes, lines: list[Entry], promised: bool) -> Entries:
    """Divide JSON into its rows: the lines, or the elements of an array, or objects of several lines each."""
    by_lines = Entries(JSON, "line", lines)
    is_array = content.lstrip().startswith(b"[")
    # Each line is judged on its own, so that one that is damaged costs no other.
    if not is_array and (_is_json(lines[0].content, dict) or _all_quoted(lines)):
        return by_lines
    try:
        values = _values(content.decode("utf-8", "replace"))
    except (ValueError, RecursionError) as error:
        begun = [line.content.lstrip().startswith(b"{") for line in lines]
        if not is_array and (promised or all(begun) or any(_is_json(line.content, dict) for line in lines)):
            return by_lines
        where = f": {error.msg} in line {error.lineno}" if isinstance(error, json.JSONDecodeError) else ""
        raise InstructionFileError(f"begins like JSON, but cannot be read as JSON{where}; {LEGAL}") from None
    if is_array and len(values) > 1:
        return by_lines
    rows = _values(values[0].strip()[1:-1], commas=True) if is_array else values
    return Entries(JSON, "row", [Entry(number, each.encode()) for number, each in enumerate(rows, start=1)])


def _values(text: str, commas: bool = False) -> list[str]:
    """Return the texts of JSON values that follow each other, with commas between them where these are wanted."""
    found: list[str] = []
    decoder, at = json.JSONDecoder(), 0
    space = re.compile(r"\s*,?\s*" if commas else r"\s*")
    while True:
        gap = space.match(text, at if found else 0)
        assert gap is not None
        at = gap.end()
        if at >= len(text):
            return found
        _, end = decoder.raw_decode(text, at)
        found.append(text[at:end])
        at = end


def _delimiter(line: str, delimiters: str) -> str | None:
    """Return which of some delimiters separates the cells of a table's first line, which names the column of the
    instructions.
    """
    for delimiter in delimiters:
        cells = [cell.strip().strip('"').lower() for cell in line.split(delimiter)]
        if any(cell in TEXT_COLUMNS for cell in cells) and all(" " not in cell for cell in cells):
            return delimiter
    return None


def _is_open(lines: list[str], delimiter: str) -> bool:
    """Tell whether the quotation mark of a cell in the last row of a table, of these lines, has no end."""
    try:
        list(csv.reader([f"{line}\n" for line in lines], delimiter=delimiter, strict=True))
    except csv.Error as error:
        return "unexpected end" in str(error)
    return False


def _table_entries(content: bytes, first: str, delimiter: str | None) -> Entries:
    """Divide a table into its rows, from the line that names its columns."""
    if delimiter is None or _delimiter(first, delimiter) is None:
        raise InstructionFileError(
            f"has the suffix of a table, but its first line names no column {' or '.join(map(repr, TEXT_COLUMNS))}"
        )
    text = content.decode("utf-8", "replace")
    text = "\n" * text[: text.index(first)].count("\n") + text[text.index(first) :]  # without comments before it
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=delimiter)
    rows: list[Entry] = []
    names: list[str] = []
    begins = 1
    try:
        for cells in reader:
            number, begins = begins, reader.line_num + 1
            if not any(cell.strip() for cell in cells):
                continue
            if not names:
                names = [name.strip().lower() for name in cells]
                names = ["text" if name in TEXT_COLUMNS else name for name in names]
                if len(set(names)) < len(names):
                    raise InstructionFileError("is a table in which two columns have the same name")
                continue
            # A cell too many has no name, and costs its row as an unknown column does.
            named = {**dict(zip(names, cells, strict=False)), **{f"column {n}": cells[n - 1]
                     for n in range(len(names) + 1, len(cells) + 1)}}  # fmt: skip
            filled = {name: cell for name, cell in named.items() if name and cell.strip()}
            rows.append(Entry(number, json.dumps(filled, ensure_ascii=False).encode()))
    except csv.Error as error:
        raise InstructionFileError(f"is a table that cannot be read: {error} in line {reader.line_num}") from None
    if rows and _is_open(text.split("\n")[rows[-1].number - 1 :], delimiter):
        raise InstructionFileError(
            f"is a table in which the quotation mark of a cell in line {rows[-1].number} never ends; what follows it "
            "would be one cell"
        )
    return Entries(TABLE, "line", rows)
