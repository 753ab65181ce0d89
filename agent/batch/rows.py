"""Read and check the rows of a batch file; an invalid row becomes a `BadRow`, and the others are carried out.

What a file is follows from its content (`grounding.instruction_files`): an instruction a line, JSON lines, a JSON
array, or a table whose first line names the columns. A name that ends in .jsonl, .ndjson or .json promises JSON, one in
.csv or .tsv a table. Blank lines and lines that begin with "#" are left out.

A JSON row is a string, the instruction, or an object with these keys, which are the columns of a table, too; only
`text` is required, and `null` or an empty cell counts as missing. An id names a folder on any disk: upper and lower
case count as the same, and names of devices such as "con" are refused. A row without an id has that of its line, such
as "line-007", or in an array of its place, such as "row-007":

| key | value |
|---|---|
| `id` | 1 to 80 letters a-z, digits, ".", "_", "-"; begins with a letter or digit, ends without "." |
| `text` | the instruction |
| `scene`, `objects`, `model`, `weights`, `seed`, `execute` | as the flags of `run`; by default the batch's own flags |
| `parser`, `viewpoint`, `llm_model`, `llm_url`, `like`, `exact` | likewise |

Relative paths in a row start from the file's folder; from the current folder if the rows come from standard input.
"""

from __future__ import annotations

import hashlib
import json
import re
import sys
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from agent.arm.arm_file import arm_checksum
from agent.errors import AgentError, BadInput, UsageError
from agent.event_base import json_value
from agent.pipeline.run import RunOptions
from agent.runtime.settings import SETTINGS
from grounding.instruction_files import JSON, TABLE, TEXT, InstructionFileError, looks_like_json, read_entries
from grounding.untrusted_files import GivenTwiceError, each_key_once
from structdiffusion.limits import BATCH_BYTES, ROW_BYTES

STANDARD_INPUT = "-"
_SETTINGS = {setting.name: setting for setting in SETTINGS if setting.name != "workers"}
_EXAMPLE: dict[str, type] = {"like": str, "exact": bool}
KEYS = ("id", "text", *_SETTINGS, *_EXAMPLE)
_PLACES = ("scene", "objects", "weights")  # what is not there is bad input; any other illegal value is wrong usage
_READING = ("parser", "viewpoint", "llm_model", "llm_url")
ID = re.compile(r"(?=.{1,80}$)[A-Za-z0-9]([A-Za-z0-9._-]*[A-Za-z0-9_-])?")
# Names of devices, with any ending, where Windows or one of its disks holds the folder.
_DEVICE = re.compile(r"(con|prn|aux|nul|com\d|lpt\d)(\..*)?", re.IGNORECASE)
_PROMISED = {".jsonl": JSON, ".ndjson": JSON, ".json": JSON, ".csv": TABLE, ".tsv": TABLE}
_KIND = {str: "a string", int: "a whole number", bool: "true or false"}


@dataclass(frozen=True)
class Row:
    """One instruction to carry out.

    Attributes:
        line: its line number in the file, or its place in a JSON array, from 1.
        id: its id, unique in the file, and the name of its report's folder.
        text: the instruction.
        options: all other inputs of the result; paths are absolute.
        fingerprint: a checksum of these inputs; a result with the same one need not be computed again. A scene file
            counts by its content, folders of meshes and weights only by their paths.
    """

    line: int
    id: str
    text: str
    options: RunOptions
    fingerprint: str


@dataclass(frozen=True)
class BadRow:
    """A row that cannot be carried out, with the reason in a sentence and the exit code."""

    line: int
    id: str
    text: str | None
    message: str
    exit_code: int


def read_rows(source: str, defaults: RunOptions) -> list[Row | BadRow]:
    """Read the rows of a batch file, in order.

    Args:
        source: the file's path, or "-" for standard input.
        defaults: the options of rows that do not give their own.

    Raises:
        BadInput: if the file does not exist or has no rows.
        UsageError, BadInput: if the defaults are not legal.
    """
    if source == STANDARD_INPUT and sys.stdin is None:
        raise BadInput("the rows should come from standard input, which is closed")
    if source == STANDARD_INPUT:
        content, folder = sys.stdin.buffer.read(BATCH_BYTES + 1), Path.cwd()
    else:
        path = Path(source)
        if not path.is_file():
            raise BadInput(f"there is no batch file {source!r}")
        with path.open("rb") as file:
            content, folder = file.read(BATCH_BYTES + 1), path.resolve().parent
    if len(content) > BATCH_BYTES:
        raise BadInput(f"the batch file {source!r} has more than {BATCH_BYTES} bytes; divide it into several batches")
    defaults = with_options(defaults, flags_of(defaults), Path.cwd(), flags=True)
    name = "standard input" if source == STANDARD_INPUT else repr(source)
    try:
        entries = read_entries(content, _PROMISED.get(Path(source).suffix.lower()))
    except InstructionFileError as error:
        raise BadInput(f"{name} {error}") from None
    reader = _Reader(folder, defaults, entries.kind, entries.unit)
    rows = [reader.row(entry.number, entry.content) for entry in entries.rows]
    if not rows:
        raise BadInput(f"{name} has no rows")
    return rows


def flags_of(options: RunOptions) -> dict[str, Any]:
    """Return the given options by the names of their flags."""
    values = asdict(options) | asdict(options.reading)
    named = {name: values[name] for name in _SETTINGS if values[name] is not None}
    return named | ({"weights": str(options.weights)} if options.weights is not None else {})


def with_options(base: RunOptions, given: Mapping[str, Any], folder: Path, flags: bool = False) -> RunOptions:
    """Return `base` with the checked values of some flags.

    Args:
        base: the options for flags that are not given.
        given: flag -> value.
        folder: the folder to which paths are relative.
        flags: whether messages are about flags of the command line, or about the keys of a row.

    Raises:
        UsageError: for a value that is not legal.
        BadInput: for a value of the wrong type, or a missing file or folder.
    """
    values = {name: _accepted(name, value, folder, flags) for name, value in given.items() if name not in _EXAMPLE}
    example = _example(base, given, folder, flags)
    if "weights" in values:
        values["weights"] = Path(values["weights"])
    reading = {name: values.pop(name) for name in _READING if name in values}
    found = replace(base, **values, **example, reading=replace(base.reading, **reading))
    if found.exact and found.example is None:
        raise UsageError("exact needs an example; name it with like")
    if found.example is not None and found.reading.parser == "llm":
        raise UsageError("like works only without a language model; legal: the parser embedding")
    return found


def _example(base: RunOptions, given: Mapping[str, Any], folder: Path, flags: bool) -> dict[str, Any]:
    """Return the options that name an example, its path absolute."""
    for key, kind in _EXAMPLE.items():
        if key in given and type(given[key]) is not kind:
            raise BadInput(f"{key} must be {_KIND[kind]}, got {_json_excerpt(given[key])}")
    like = given.get("like", None if base.example is None else str(base.example))
    path = None if like is None else (folder / like).absolute()
    if path is not None and not path.exists():
        place = "--like" if flags else "like"
        raise BadInput(f"{place} cannot be {_json_excerpt(like)}; legal: an existing file or the folder of a run")
    return {"example": path, "exact": given.get("exact", base.exact)}


def _accepted(name: str, value: Any, folder: Path, flags: bool) -> Any:
    setting = _SETTINGS[name]
    place = "--" + name.replace("_", "-") if flags else name
    if type(value) is not setting.kind:
        shown = "this" if name == "llm_url" else _json_excerpt(value)
        raise BadInput(f"{place} must be {_KIND[setting.kind]}, got {shown}")
    try:
        accepted = setting.accept(value, folder)
    except (ValueError, OSError):
        kind = BadInput if name in _PLACES else UsageError
        shown = "this" if name == "llm_url" else _json_excerpt(value)  # an address may hold a password
        raise kind(f"{place} cannot be {shown}; legal: {setting.legal}") from None
    return accepted


def _json_excerpt(value: Any) -> str:
    """Return a value as JSON, shortened if it is long."""
    text = json.dumps(value, ensure_ascii=False)
    text = "".join(c if c.isprintable() else c.encode("ascii", "backslashreplace").decode() for c in text)
    return text if len(text) <= 60 else text[:57] + "..."


class _Reader:
    """A reader of the rows of one file, which remembers the ids in use."""

    def __init__(self, folder: Path, defaults: RunOptions, kind: str, unit: str) -> None:
        self._folder, self._defaults, self._kind, self._unit = folder, defaults, kind, unit
        self._default_id = re.compile(rf"{unit}-\d+", re.IGNORECASE)
        self._lines: dict[str, int] = {}  # id, in small letters, because not every disk tells "A" from "a" -> line

    def row(self, line: int, content: bytes) -> Row | BadRow:
        """Return the row of a line that is neither blank nor a comment."""
        own, text = f"{self._unit}-{line:03d}", None
        try:
            if len(content) > ROW_BYTES:
                raise BadInput(f"the row has {len(content)} bytes; at most {ROW_BYTES} are read")
            said = content.decode()
            if self._kind == TEXT:
                if looks_like_json(said):
                    raise BadInput("this is JSON in a file of plain text; JSON rows come from the first line on")
                return self._checked(line, own, said.strip(), {})
            keys = {key: value for key, value in _object(said).items() if value is not None}
            if self._kind == TABLE:
                keys = {key: _of_cell(key, cell) for key, cell in keys.items()}
            text = keys["text"] if isinstance(keys.get("text"), str) else None
            own = self._id(line, own, keys.pop("id", own))
            if unknown := [key for key in keys if key not in KEYS]:
                raise BadInput(f"the key {_json_excerpt(unknown[0])} is unknown; legal: {', '.join(KEYS)}")
            if "text" not in keys:
                raise BadInput('the key "text", which holds the instruction, is missing')
            if text is None:
                raise BadInput(f"text must be a string, got {_json_excerpt(keys['text'])}")
            del keys["text"]
            return self._checked(line, own, text, keys)
        except UnicodeDecodeError as error:
            message = f"byte {content[error.start]:#04x} at place {error.start + 1} is not UTF-8 text"
            return BadRow(line, own, None, f"{self._unit} {line}: {message}", BadInput.exit_code)
        except AgentError as error:
            return BadRow(line, own, text, f"{self._unit} {line}: {error}", error.exit_code)

    def _id(self, line: int, own: str, given: Any) -> str:
        if not isinstance(given, str) or not ID.fullmatch(given):
            raise BadInput(
                f"the id cannot be {_json_excerpt(given)}, because it names a folder; legal: a string of 1 to 80 "
                'letters a-z, digits, ".", "_" and "-", the first a letter or a digit, the last no "."'
            )
        if _DEVICE.fullmatch(given):
            raise BadInput(
                f"the id cannot be {_json_excerpt(given)}, because some systems do not allow a folder of that name"
            )
        if given != own and self._default_id.fullmatch(given):
            raise BadInput(
                f"the id {_json_excerpt(given)} is reserved for rows without one; this row would be "
                f"{_json_excerpt(own)}"
            )
        earlier = self._lines.setdefault(given.lower(), line)
        if earlier != line:
            where = f"{self._unit} {earlier}"
            raise BadInput(f"the id {_json_excerpt(given)} is already that of {where}; each must be unique")
        return given

    def _checked(self, line: int, own: str, text: str, given: Mapping[str, Any]) -> Row:
        options = with_options(self._defaults, given, self._folder)
        return Row(line, own, text, options, fingerprint(text, options))


def _object(line: str) -> dict[str, Any]:
    """Return the object of a JSON row; a string is that of its instruction.

    Raises:
        BadInput: if the row is neither.
    """
    try:
        value = json.loads(line, object_pairs_hook=each_key_once)
        json.dumps(value, ensure_ascii=False).encode()
    except json.JSONDecodeError as error:
        raise BadInput(f"this is not JSON: {error.msg} at place {error.colno}") from None
    except UnicodeEncodeError:
        raise BadInput("this is not text: it has one half of a surrogate pair without the other") from None
    except GivenTwiceError as error:
        raise BadInput(f"the key {_json_excerpt(error.key)} is given twice") from None
    except (ValueError, RecursionError) as error:  # a number of thousands of digits; brackets in thousands of brackets
        raise BadInput(f"this is not JSON that can be read: {error}") from None
    if isinstance(value, str):
        return {"text": value}
    if not isinstance(value, dict):
        raise BadInput(f'a row must be an object such as {{"text": "make a line"}}, got {_json_excerpt(value)}')
    return value


def _of_cell(key: str, cell: str) -> Any:
    """Return the value of a table's cell, of the kind that its column has; the cell where it is none of that kind."""
    kind = _SETTINGS[key].kind if key in _SETTINGS else _EXAMPLE.get(key, str)
    cell = cell if key == "text" else cell.strip()
    if kind is bool:
        return {"true": True, "false": False}.get(cell.lower(), cell)
    return int(cell) if kind is int and re.fullmatch(r"-?\d{1,30}", cell) else cell


def fingerprint(text: str, options: RunOptions) -> str:
    """Return a checksum of sixteen hexadecimal digits of all inputs of a row's result; see `Row`."""
    decides = json_value(asdict(options)) | {"text": text}
    if not options.allow_unverified:  # as before there was a choice
        del decides["allow_unverified"]
    if options.hold == "weld":  # likewise
        del decides["hold"]
    if options.disturb is None:  # likewise
        del decides["disturb"]
    if not options.reading.accept_drawings:  # likewise
        del decides["reading"]["accept_drawings"]
    if options.example is None:  # likewise
        del decides["example"], decides["exact"]
    elif options.example.is_file():
        decides["example"] = hashlib.sha256(options.example.read_bytes()).hexdigest()
    if not options.record:  # likewise
        del decides["record"]
    if options.arm is None:  # likewise
        del decides["arm"]
    elif options.arm.is_file():
        decides["arm"] = arm_checksum(options.arm)
    del decides["reading"]["key_url"]  # who is trusted with a key decides no result
    scene = Path(options.scene)
    if scene.is_file():
        decides["scene"] = hashlib.sha256(scene.read_bytes()).hexdigest()
    return hashlib.sha256(json.dumps(decides, sort_keys=True).encode()).hexdigest()[:16]
