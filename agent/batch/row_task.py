"""Carry out one row of a batch, write its report, and make its line of `results.jsonl`.

| key | value |
|---|---|
| `id`, `line`, `text`, `seed`, `model` | the row |
| `fingerprint` | of everything that decides the result; a row that has changed is carried out again |
| `success`, `exit_code` | as of a run; 1 for a defect of the tool or a worker that died |
| `step`, `message` | where and why it failed: a step of a run, "row", "example" for a bad one of these, "crash" |
| `spec`, `goal` | the parsed instruction: the five slots of one structure, and the goal with all its parts |
| `rank`, `score` | the arrangement that was tried: its place from 1, and its total score |
| `failure_class`, `checks` | the first cause of failure, and every check with its measured value and limit |
| `report` | the page, seen from the batch's folder |
| `seconds` | step -> time, and the whole as "total": the only key that differs when a row is carried out again |

A key that does not apply is `null`, or empty. Lengths in metres, angles in radians.
"""

from __future__ import annotations

import traceback
from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from agent.batch.result_schema import ROWS, report_of
from agent.batch.rows import BadRow, Row
from agent.errors import DEFECT, defect_sentence, exit_code_of, one_sentence
from agent.figures.examples import keep_example
from agent.pipeline.resources import ResourceCache
from agent.pipeline.run import RunOptions, run_instruction
from agent.reporting.build_recording import BuildRecorder
from agent.reporting.run_report import RunRecord
from agent.reporting.session_log import run_session
from agent.runtime.output_ownership import OwnFolder

CRASHED = DEFECT
TRACEBACK = "traceback.txt"
_REPORT = "report"  # the step at which it could not be written


def carry_out(row: Row, folder: Path, cache: ResourceCache) -> dict[str, Any]:
    """Carry out a row.

    Args:
        row: the row.
        folder: the folder for the report and the session, if the row reaches a scene, and for the traceback of a
            defect; created if needed.
        cache: the models and scenes that rows share.

    Returns:
        The row's line of `results.jsonl`.
    """
    cache.pictures = OwnFolder(folder, "run")
    try:
        options = _with_example(row.options, folder)
    except Exception as error:
        code = exit_code_of(error)
        if code is None:
            raise
        return failed(row, code, "example", one_sentence(error))
    try:
        with run_session(folder, {"id": row.id, "line": row.line, **asdict(options)}) as session:
            record = RunRecord(session)
            recorder = BuildRecorder() if options.record else None
            on_step = recorder.on_physics_step if recorder is not None else None
            for event in run_instruction(row.text, options, cache, on_step):
                record.on_event(event)
                if recorder is not None:
                    recorder.on_event(event)
        page = record.write(folder) if record.saw_something else None
        if recorder is not None:
            recorder.write(folder, record.report)
    except Exception as error:  # the other rows continue, whatever it is
        code = exit_code_of(error)
        if code is not None:
            return failed(row, code, _REPORT, one_sentence(error))
        folder.mkdir(exist_ok=True)
        (folder / TRACEBACK).write_text(traceback.format_exc(), encoding="utf-8")
        where = f"{ROWS}/{row.id}/{TRACEBACK}"
        return failed(row, CRASHED, "crash", f"{defect_sentence(error)}; see {where}")
    return _result(row, record.report, None if page is None else report_of(row.id))


def _with_example(options: RunOptions, folder: Path) -> RunOptions:
    """Return the options of a row with the figure of its example, which is written into the row's folder."""
    if options.example is None:
        return options
    like = keep_example(options.example, options.exact, OwnFolder(folder, "run"))
    return replace(options, reading=replace(options.reading, like=like))


def is_final(result: Mapping[str, Any]) -> bool:
    """Return whether repeating the row would give the same outcome.

    It may not after a defect of the tool, the death of a worker, or a report that could not be written.
    """
    return result["exit_code"] != CRASHED and result["step"] != _REPORT


def refused_result(row: BadRow) -> dict[str, Any]:
    """Return the result of a row that cannot be carried out."""
    return _blank(row.line, row.id, row.text) | _failure(row.exit_code, "row", row.message)


def lost_result(row: Row, reason: str) -> dict[str, Any]:
    """Return the result of a row whose worker died."""
    return failed(row, CRASHED, "crash", reason)


def failed(row: Row, exit_code: int, step: str, message: str) -> dict[str, Any]:
    """Return the result of a row that failed without a report."""
    return _of(row) | _failure(exit_code, step, message)


def _failure(exit_code: int, step: str, message: str) -> dict[str, Any]:
    return {"exit_code": exit_code, "step": step, "message": message}


def _result(row: Row, report: Mapping[str, Any], page: str | None) -> dict[str, Any]:
    outcome, chosen, verdict = report["outcome"], report["chosen"] or {}, report["verdict"] or {}
    return _of(row) | {
        "success": outcome["success"],
        "exit_code": outcome["exit_code"],
        "step": outcome["step"],
        "message": outcome["message"],
        "spec": None if report["parse"] is None else report["parse"]["spec"],
        "goal": None if report["parse"] is None else report["parse"]["goal"],
        "rank": chosen.get("rank"),
        "score": chosen.get("scores", {}).get("total"),
        "failure_class": verdict.get("failure_class"),
        "checks": verdict.get("checks", []),
        "report": page,
        "seconds": {**report["seconds"], "total": round(outcome["seconds"], 3)},
    }


def _of(row: Row) -> dict[str, Any]:
    decided = {"seed": row.options.seed, "model": row.options.model, "fingerprint": row.fingerprint}
    return _blank(row.line, row.id, row.text) | decided


def _blank(line: int, row_id: str, text: str | None) -> dict[str, Any]:
    return {
        "id": row_id,
        "line": line,
        "text": text,
        "seed": None,
        "model": None,
        "fingerprint": None,
        "success": False,
        "exit_code": None,
        "step": None,
        "message": None,
        "spec": None,
        "goal": None,
        "rank": None,
        "score": None,
        "failure_class": None,
        "checks": [],
        "report": None,
        "seconds": {},
    }
