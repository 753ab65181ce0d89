"""Score parsers on the parsing benchmark: how many instructions get the right slots, and how often values are
invented.

A row lists the acceptable values of every slot, for sentences in which more than one reading is fair,
and whether the instruction must be refused. `free.jsonl` was written by hand, by other people than the
training language; `templated_rows` are the sentences of the grammar.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib import resources
from pathlib import Path
from typing import Any

from grounding.corpus.grammar import all_sentences, split_of
from grounding.goals.goal import Goal
from grounding.goals.parts import StructurePart
from grounding.instruction_files import JSON, InstructionFileError, read_entries
from grounding.parse_result import DEFECT, Parse
from grounding.spec import FIRST_SHAPES, LEGAL_VALUES, SHAPES, SLOTS, StructureSpec

CALIBRATION_BINS = 10
_LATER_SHAPES = SHAPES[len(FIRST_SHAPES) :]
# Edge of the table -> the slot and value of the side that it is on.
_SIDE_OF_EDGE = {
    "near": ("y_position", "bottom"), "far": ("y_position", "top"), "left": ("x_position", "left"),
    "right": ("x_position", "right"),
}  # fmt: skip
# Bytes of a file of rows: a row has 250.
MOST_BYTES = 50_000_000


class BenchmarkError(ValueError):
    """Raised for an invalid file of sentences; the message names the line, the value and the legal values."""


@dataclass(frozen=True)
class Row:
    """A sentence and its acceptable readings.

    Attributes:
        text: the instruction.
        acceptable: slot -> values that are right, `None` for unspecified; the best first.
        refuse: whether it must be refused.
        stratum: what kind of sentence it is; rates are given for each.
        scene: names of the objects on the table, for sentences that select some of them.
        objects: the indices of the selected objects in `scene`, or `None` if they are not scored.
    """

    text: str
    acceptable: Mapping[str, tuple[str | None, ...]]
    refuse: bool = False
    stratum: str = "all"
    scene: tuple[str, ...] = ()
    objects: tuple[int, ...] | None = None


def free_rows() -> list[Row]:
    """Load the benchmark's hand-written sentences."""
    return _shipped_rows("free")


def development_rows() -> list[Row]:
    """Load the hand-written sentences for model choice and calibration; none of them is in the benchmark."""
    return _shipped_rows("development")


def _shipped_rows(name: str) -> list[Row]:
    with resources.as_file(resources.files("grounding") / "benchmark_data" / f"{name}.jsonl") as path:
        return load_rows(path)


def templated_rows() -> list[Row]:
    """List every sentence of the grammar; the strata are its splits."""
    return [
        Row(text, {slot: (value,) for slot, value in spec.to_dict().items()}, stratum=split_of(text))
        for text, spec in all_sentences()
    ]


def load_rows(path: str | Path) -> list[Row]:
    """Load the rows of a JSON-lines file.

    Raises:
        BenchmarkError: for a line that is not a row; OSError for a file that cannot be read.
    """
    rows = [_row(line, where) for where, line in read_lines(path)]
    if not rows:
        raise BenchmarkError(f"{path} has no row; a row is a JSON object with text, {', '.join(SLOTS)} and refuse")
    return rows


def read_lines(path: str | Path) -> list[tuple[str, str]]:
    """Read the rows of a file of JSON lines, or of a JSON array, each with the words for its place.

    Raises:
        BenchmarkError: for a file that is too large or not UTF-8; OSError for one that cannot be read.
    """
    try:
        with Path(path).open("rb") as file:  # which may be a device, that has no size and no end
            content = file.read(MOST_BYTES + 1)
        if len(content) > MOST_BYTES:
            raise BenchmarkError(f"{path} has more than {MOST_BYTES} bytes, and no more are read; divide it")
        entries = read_entries(content, JSON)
        return [(f"{path}, {entries.unit} {entry.number}", entry.content.decode("utf-8")) for entry in entries.rows]
    except InstructionFileError as error:
        raise BenchmarkError(f"{path} {error}") from None
    except UnicodeDecodeError as error:
        raise BenchmarkError(f"{path} is not UTF-8 text: {error.reason} at byte {error.start}") from error


def _row(line: str, where: str) -> Row:
    try:
        entry = json.loads(line)
    except (ValueError, RecursionError) as error:
        raise BenchmarkError(f"{where} is not valid JSON: {error}") from error
    if not isinstance(entry, dict) or not isinstance(entry.get("text"), str):
        raise BenchmarkError(f"{where} has no text; a row is a JSON object with text, {', '.join(SLOTS)} and refuse")
    refuse = entry.get("refuse", False)
    if not isinstance(refuse, bool):
        raise BenchmarkError(f"{where}: refuse must be true or false, not {refuse!r}")
    scene, objects = entry.get("scene", []), entry.get("objects")
    if not isinstance(scene, list) or not all(isinstance(name, str) for name in scene):
        raise BenchmarkError(f"{where}: scene must be a list of names, not {scene!r}")
    if objects is not None and not (isinstance(objects, list) and all(i in range(len(scene)) for i in objects)):
        raise BenchmarkError(f"{where}: objects must be indices below {len(scene)}, not {objects!r}")
    return Row(
        entry["text"],
        {slot: _values(entry, slot, where) for slot in SLOTS},
        refuse,
        str(entry.get("stratum", "all")),
        tuple(scene),
        None if objects is None else tuple(objects),
    )


def _values(entry: Mapping[str, Any], slot: str, where: str) -> tuple[str | None, ...]:
    values = entry.get(slot, [None])
    values = values if isinstance(values, list) else [values]
    for value in values:
        if value is not None and value not in LEGAL_VALUES[slot]:
            legal = ", ".join(LEGAL_VALUES[slot])
            raise BenchmarkError(f"{where}: {slot} cannot be {value!r}; legal values: {legal}, null")
    if not values:
        raise BenchmarkError(f"{where}: {slot} lists no acceptable value; legal: {', '.join(LEGAL_VALUES[slot])}, null")
    return tuple(values)


def five_slots(parse: Parse, status: str, goal: Goal, choices: Sequence[Goal] = ()) -> Parse:
    """Return the five slots of a reading, as in part one of the evaluation protocol.

    A goal that these cannot hold (several parts, a relation, a further key, a shape beyond the first four) counts as
    refused: rows that no plain structure satisfies must not be read as one, and may well be read as a larger goal. A
        line
    along an edge of the table is what five slots call a line on that side.

    Args:
        parse: the parser's result.
        status: the status of the whole reading, as in `grounding.interpreter.Interpretation`.
        goal: the goal of the whole reading; empty if it is refused or needs a question.
        choices: the goals that a question offers: where five slots can hold none of them, it is no plain reading
            either.
    """
    if status == "ok" and goal.parts:
        spec = _slots_of(goal)
        return (
            replace(parse, status="refused", spec=StructureSpec())
            if spec is None
            else replace(parse, status="ok", spec=spec)
        )
    if status == "refused" or (status == "ask" and choices and all(_slots_of(one) is None for one in choices)):
        return replace(parse, status="refused", spec=StructureSpec())
    return replace(parse, status=status)


def _slots_of(goal: Goal) -> StructureSpec | None:
    """Return the slots of a goal that five slots can hold; else `None`."""
    spec = goal.plain_spec or _along_as_position(goal)
    return spec if spec is not None and spec.shape in (*FIRST_SHAPES, None) else None


def _along_as_position(goal: Goal) -> StructureSpec | None:
    """Return the slots of a single structure whose only further key is an edge; else `None`."""
    if len(goal.parts) != 1 or not isinstance(part := goal.parts[0], StructurePart) or set(part.keys) != {"along"}:
        return None
    slot, value = _SIDE_OF_EDGE[str(part.along)]
    return replace(part.spec, **{slot: value})


def is_exact(row: Row, parse: Parse) -> bool:
    """Tell whether the instruction was refused as it must be, or every slot has an acceptable value."""
    if parse.status == DEFECT:
        return False
    if row.refuse or parse.status == "refused":
        return row.refuse and parse.status == "refused"
    return all(value in row.acceptable[slot] for slot, value in parse.spec.to_dict().items())


def rate(hits: int, n: int) -> dict[str, float | int | None]:
    """Compute a share with its 95 % Wilson interval (shares of nothing are `None`)."""
    from scipy.stats import binomtest

    if n == 0:
        return {"hits": 0, "n": 0, "rate": None, "low": None, "high": None}
    low, high = binomtest(hits, n).proportion_ci(method="wilson")
    return {"hits": hits, "n": n, "rate": hits / n, "low": float(low), "high": float(high)}


def score(rows: Sequence[Row], parses: Sequence[Parse]) -> dict[str, Any]:
    """Compute all rates of a parser on the rows, as JSON values.

    Returns:
        "exact"; "slots": each of the five, over instructions that neither must be nor were refused;
        "false_fills": the share of slots that must stay open and got a value; "refusal" precision and
        recall; "asked": the share answered by a question; "calibration_error": the expected calibration
        error of the slots' confidences (Guo et al. 2017) with ten bins, `None` without confidences;
        "strata": exact per stratum; "confusion": slot -> truth -> answer -> count; "wrong": the rows
        that are not exact.
    """
    pairs = list(zip(rows, parses, strict=True))
    read = [
        (row, parse, parse.spec.to_dict())
        for row, parse in pairs
        if not row.refuse and parse.status not in ("refused", DEFECT)
    ]
    must_stay_open = [
        spec[slot] is not None for row, _, spec in read for slot in SLOTS if row.acceptable[slot] == (None,)
    ]
    refused = sum(parse.status == "refused" for _, parse in pairs)
    must_refuse = sum(row.refuse for row in rows)
    rightly = sum(row.refuse and parse.status == "refused" for row, parse in pairs)
    strata: dict[str, list[bool]] = {row.stratum: [] for row in rows}
    for row, parse in pairs:
        strata[row.stratum].append(is_exact(row, parse))
    return {
        "exact": rate(sum(is_exact(row, parse) for row, parse in pairs), len(pairs)),
        "slots": {
            slot: rate(sum(spec[slot] in row.acceptable[slot] for row, _, spec in read), len(read)) for slot in SLOTS
        },
        "false_fills": rate(sum(must_stay_open), len(must_stay_open)),
        "refusal": {"precision": rate(rightly, refused), "recall": rate(rightly, must_refuse)},
        "asked": rate(sum(parse.status == "ask" for parse in parses), len(pairs)),
        "calibration_error": _calibration_error(read),
        "strata": {name: rate(sum(hits), len(hits)) for name, hits in strata.items()},
        "confusion": {slot: _confusion(slot, read) for slot in SLOTS},
        "wrong": [_wrong_row(row, parse) for row, parse in pairs if not is_exact(row, parse)],
    }


def _calibration_error(read: Iterable[tuple[Row, Parse, Mapping[str, str | None]]]) -> float | None:
    bins: list[list[tuple[float, bool]]] = [[] for _ in range(CALIBRATION_BINS)]
    for row, parse, spec in read:
        for slot, confidence in parse.confidence.items():
            right = spec[slot] in row.acceptable[slot]
            bins[min(int(confidence * CALIBRATION_BINS), CALIBRATION_BINS - 1)].append((confidence, right))
    n = sum(map(len, bins))
    if n == 0:
        return None
    # The size of a bin cancels: |sum of confidences - number right| / n.
    return sum(abs(sum(c for c, _ in entries) - sum(r for _, r in entries)) for entries in bins) / n


def _confusion(slot: str, read: Iterable[tuple[Row, Parse, Mapping[str, str | None]]]) -> dict[str, dict[str, int]]:
    """Count truth -> answer; where several values are right, the answer counts as the truth if it is one of them."""
    read = list(read)
    present = {value for row, _, spec in read for value in (spec[slot], *row.acceptable[slot])}
    # The first shapes always have their places; later ones only where they are asked for or answered.
    shown = (value for value in LEGAL_VALUES[slot] if value not in _LATER_SHAPES or value in present)
    values = (*shown, "open")
    table = {truth: dict.fromkeys(values, 0) for truth in values}
    for row, _, spec in read:
        answer = spec[slot]
        truth = answer if answer in row.acceptable[slot] else row.acceptable[slot][0]
        table[truth or "open"][answer or "open"] += 1
    return table


def _wrong_row(row: Row, parse: Parse) -> dict[str, Any]:
    return {
        "text": row.text,
        "stratum": row.stratum,
        "refuse": row.refuse,
        "acceptable": {slot: list(values) for slot, values in row.acceptable.items()},
        "status": parse.status,
        "spec": parse.spec.to_dict(),
    }
