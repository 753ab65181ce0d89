"""Build what was asked for on drawn tables, say something meanwhile, and judge what comes of it."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

import agent.arm
import agent.chat
import agent.evaluation.interjections
import grounding
from agent import events
from agent.arm.events import Picked, Placed
from agent.chat.conversation import Conversation
from agent.chat.interjections import Interjection, Script
from agent.chat.steering import Steering
from agent.evaluation.interjections.rows import HALVES, Saying, sayings, tables, write_table
from agent.evaluation.planner_config import BuildConfig, checked_names
from agent.evaluation.report import REPORT, command_line, rate_of, report_frame
from agent.evaluation.result_store import ResultStore, store_folder
from agent.evaluation.rows import LOST, Row, measured
from agent.event_base import Event
from agent.pipeline.candidates import checked_planner
from agent.pipeline.resources import ResourceCache
from agent.pipeline.run import RunOptions
from agent.runtime.progress import progress
from agent.runtime.worker_pool import workforce
from structdiffusion.data.scene_sampling import SceneError
from structdiffusion.objects.libraries import load_objects
from structdiffusion.parallel import Lost

DRAWS = 20  # tables that are drawn at most until the instruction can be proposed on one
RESULTS = ("right", "asked", "late", "wrong", "dropped")


@dataclass(frozen=True)
class SteeringConfig(BuildConfig):
    """The options on which a row depends."""

    objects: str = "ycb"

    def command(self, halves: Sequence[str]) -> str:
        """Return the command that makes these rows."""
        return command_line(
            "steering", half=None if tuple(halves) == HALVES else list(halves), seed=self.seed, model=self.model,
            weights=self.weights, hold=self.hold, allow_unverified=self.allow_unverified,
        )  # fmt: skip


def measure_steering(
    config: SteeringConfig, halves: Sequence[str] | None, *, workers: int | None = None, out: Path | None = None
) -> dict[str, Any]:
    """Say everything once while the arm builds; return a JSON report.

    Args:
        config: the options on which every row depends.
        halves: of what is said; `None` for both.
        workers: processes; `None` for one per core, 0 for this process alone.
        out: folder that stores the rows as they come: the same command resumes an evaluation that was stopped. `None`
            stores nothing.

    Raises:
        UsageError: for an unknown half or planner, or a folder of another evaluation.
        BadInput: for a folder that cannot be written to.
        CheckpointError, NotVerified: for checkpoints that are missing, or differ from their cards.
    """
    chosen = checked_names("half", halves, HALVES)
    checked_planner(config.model, config.weights, config.allow_unverified)
    packages = (grounding, agent.arm, agent.chat, agent.evaluation.interjections)
    fingerprint = config.rows_fingerprint(load_objects(config.objects), [config.model], packages)
    with (
        store_folder(out) as path,
        ResultStore(path, {"evaluation": "steering"} | fingerprint, {"number"}, (REPORT,)) as store,
        workforce(workers, None) as force,
    ):
        rows = {row["number"]: row for row in measured(store.rows)}
        jobs = [one for one in sayings() if one.half in chosen and one.number not in rows]
        with progress("interjections", len(jobs)) as advance:
            for result in force.do(partial(_row_of, config), ResourceCache, (), jobs):
                row = {"number": result.job.number, LOST: result.reason} if isinstance(result, Lost) else result
                store.add(row)
                rows[row["number"]] = row
                advance(LOST not in row)
    return _report(config, [rows[number] for number in sorted(rows)])


def _row_of(config: SteeringConfig, cache: ResourceCache, saying: Saying) -> Row:
    """Build on a drawn table and say something at a drawn moment; return JSON values."""
    started, rng = time.perf_counter(), np.random.default_rng((config.seed, saying.number))
    row = {
        "number": saying.number, "half": saying.half, "table": saying.table, "instruction": saying.instruction,
        "sentence": saying.sentence,
    }  # fmt: skip
    with TemporaryDirectory() as folder:
        for draw in range(DRAWS):
            scene = Path(folder) / f"{draw}.yaml"
            try:
                write_table(saying.table, rng, scene)
            except SceneError:
                continue
            log = _Log()
            options = RunOptions(
                str(scene), config.objects, config.model, config.weights, config.seed,
                allow_unverified=config.allow_unverified, hold=config.hold,
            )  # fmt: skip
            with Conversation(options, cache, [log]) as talk:
                if talk.say(saying.instruction):
                    row |= _said(talk, log, saying, rng)
                    return row | {"seconds": round(time.perf_counter() - started, 1)}
    return row | {"no_scene": "the instruction could not be proposed on any table that was drawn"}


class _Log(list[Event]):
    def on_event(self, event: Event) -> None:
        self.append(event)


def _said(talk: Conversation, log: _Log, saying: Saying, rng: np.random.Generator) -> Row:
    """Build the proposal of a conversation, say something meanwhile, and return what came of it."""
    proposal = talk.situation.proposal
    assert proposal is not None  # the caller has looked
    moves = sum((motion != np.eye(4)).any() for motion in proposal.arrangements_to_try[0].goal_from_initial)
    placed, holding = int(rng.integers(moves)), bool(rng.integers(2))
    said = [Interjection(saying.sentence, placed, holding)]
    said += [Interjection("go on", placed, holding)] if "waits" in saying.outcomes else []
    before = talk.situation.spoken
    stands = talk.go(steering=Steering(talk, Script(said)))
    told = [event for event in log if isinstance(event, events.Interjected) and event.line == saying.sentence]
    result = _judged(log, told, saying, str(talk.situation.spoken.canonical()), str(before.canonical()))
    return {
        "moment": f"{placed}{'+' * holding}",
        "outcome": told[-1].outcome if told else None,
        "message": told[-1].message if told else "",
        "goal": str(talk.situation.spoken.canonical()),
        "result": result,
        "stands": None if "stops" in saying.outcomes else stands,
        "trouble": talk.situation.builds[-1].trouble,
    }


def _judged(log: Sequence[Event], told: Sequence[events.Interjected], saying: Saying, goal: str, before: str) -> str:
    """Return which of `RESULTS` something that was said has come to."""
    if not told:
        return "dropped"
    outcome = told[-1].outcome
    since = list(log[log.index(told[0]) + 1 :])
    placements = [event for event in since if isinstance(event, Placed)]
    expected = saying.outcomes[0]
    if expected == "first":
        name = list(tables()[saying.table])[int(saying.goals[0])]
        was_held = [event.name for event in log[: log.index(told[0])] if isinstance(event, Picked)]
        if outcome == "unchanged":
            return "right" if name in was_held else "wrong"
        own = [event.name for event in placements if not event.aside]
        return "right" if outcome == "changed" and name in own[:2] else "asked" if outcome == "asked" else "wrong"
    if outcome == "asked" and "asked" not in saying.outcomes:
        return "asked"
    if outcome not in saying.outcomes:
        return "wrong"
    if outcome == "changed":
        turned = next((k for k, event in enumerate(since) if isinstance(event, events.Started)), None)
        if goal not in saying.goals or turned is None:
            return "wrong"
        return "right" if sum(isinstance(event, Placed) for event in since[:turned]) <= 1 else "late"
    if outcome == "stops":
        moved = [event for event in since if isinstance(event, Picked | Placed)]  # while it plans, no arm has to stop
        return "right" if not moved else "wrong"
    return "right" if goal == before else "wrong"


def _report(config: SteeringConfig, rows: Sequence[Row]) -> dict[str, Any]:
    halves = [half for half in HALVES if any(row.get("half") == half for row in rows)]
    drawn = [row for row in rows if "no_scene" not in row]
    return {
        **report_frame(config.command(halves), len(drawn), config.seed),
        "rows": list(rows),
        "left_out": len(rows) - len(drawn),
        "aggregate": {
            half: _rates([row for row in drawn if half in ("all", row.get("half"))]) for half in (*halves, "all")
        },
    }


def _rates(rows: Sequence[Row]) -> dict[str, Any]:
    """Return the rates of some rows; one whose worker died counts as dropped."""
    results = [row.get("result", "dropped") for row in rows]
    built = [bool(row["stands"]) for row in rows if row.get("stands") is not None]
    return {"n": len(rows), "stands": rate_of(built)} | {
        result: rate_of([one == result for one in results]) for result in RESULTS
    }
