"""Measure how well the hand holds single objects: `structagent evaluate picks`.

Each pick takes one object from one side of the table to the other, turned, and lets it go there. What counts is where
the object ends, judged on its true pose. Objects for which the planner has no grasp are left out before anything moves,
and named.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, TextIO

import numpy as np

from agent.arm.events import Picked, PickFailed, PlaceFailed, PlanFailed
from agent.arm.executor import build_structure
from agent.arm.simulated_arm import SimulatedArm
from agent.errors import BadInput
from agent.evaluation.report import (
    command_line,
    interval,
    left_out_note,
    print_footer,
    print_table,
    rate_of,
    report_frame,
)
from agent.evaluation.rows import LOST, Row, collect
from structdiffusion.evaluation_protocol import MAX_DISPLACEMENT, MAX_TILT
from structdiffusion.geometry import pose_from_xyz_yaw, tilt_between
from structdiffusion.objects.libraries import load_objects
from structdiffusion.objects.model import ObjectModel
from structdiffusion.observation import Arrangement
from structdiffusion.parallel import in_parallel
from structdiffusion.simulation.visible_points import ObservationError
from structdiffusion.simulation.world import FALLEN, TabletopWorld

SIDE = (0.08, 0.30)  # m to the left or right of the table's middle
DEPTH = (0.30, 0.60)  # m from the arm's base
TRIES = 10  # poses that are drawn for an object that the camera does not see, or that does not stand


@dataclass(frozen=True)
class Pick:
    """One pick.

    Attributes:
        model: the object.
        number: of the pick; with the seed it decides the poses.
    """

    model: ObjectModel
    number: int


def measure_picks(objects: str, count: int, seed: int, hold: str, workers: int) -> Row:
    """Measure `count` picks of objects drawn in turn from a library; return a JSON-ready report.

    Args:
        objects: as for `load_objects`.
        count: picks.
        seed: of objects, poses, sensor noise and planning.
        hold: how the hand holds objects, one of `agent.arm.simulated_arm.HOLDS`.
        workers: processes.

    Raises:
        BadInput: if no object of the library stands where the camera sees it.
    """
    library = load_objects(objects)
    order = np.random.default_rng(seed).permutation(len(library))
    jobs = [Pick(library[order[number % len(library)]], number) for number in range(count)]
    rows, lost = collect("picks", in_parallel(partial(_pick, hold, seed), tuple, (), jobs, workers), count)
    rows = [row for row in rows if row["stood"]]
    if not rows:
        raise BadInput(f"none of the objects {objects!r} stands where the camera sees it")
    command = command_line("picks", objects=objects, picks=count, seed=seed, hold=hold)
    return report_frame(command, len(rows), seed) | {
        "rows": rows,
        "aggregate": _rates(rows),
        "kinds": {
            kind: _rates([row for row in rows if row["noun"] == kind]) for kind in sorted({row["noun"] for row in rows})
        },
        LOST: [{"pick": one.job.number, "reason": one.reason} for one in lost],
    }


def print_picks(report: dict[str, Any], results: TextIO) -> None:
    """Print the table, a row per kind of object, and what was left out."""
    table = [["objects", "n", "planned", "held at once", "held", "stands", "95 %"]]
    for kind, rates in {"all": report["aggregate"], **report["kinds"]}.items():
        counts = [str(rates[key]["count"]) for key in ("planned", "at_once", "held", "stands")]
        table.append([kind, str(rates["n"]), *counts, interval(rates["stands"])])
    print_table(table, results)
    out = Counter(row["object"] for row in report["rows"] if not row["planned"])
    names = f"left out before anything moved: {', '.join(sorted(out))}" if out else ""
    print_footer(report, results, names, left_out_note(len(report[LOST])))


def _rates(rows: Sequence[Row]) -> Row:
    """Return the shares of rows: planned of all, the others of the planned ones."""
    planned = [row for row in rows if row["planned"]]
    shares = {key: rate_of([row[key] for row in planned]) for key in ("at_once", "held", "stands")}
    return {"n": len(rows), "planned": rate_of([row["planned"] for row in rows]), **shares}


def _pick(hold: str, seed: int, _: object, pick: Pick) -> Row:
    """Carry out one pick; return its row, whose "stood" is false if the object could not be set out."""
    row: Row = {"number": pick.number, "object": pick.model.name, "noun": pick.model.category, "stood": False}
    rng = np.random.default_rng((seed, pick.number))
    for _ in range(TRIES):
        start, goal = (_pose(rng, side) for side in rng.permutation((-1.0, 1.0)))
        with TabletopWorld([pick.model], [start]) as world:
            world.settle()
            stands = world.pose(0)
            if tilt_between(stands, start) > MAX_TILT:
                continue
            arm = SimulatedArm(world.client)
            arm.hold_by(hold)
            try:
                scene = world.observe(rng, [0])
            except ObservationError:
                continue
            motion = goal @ np.linalg.inv(start)
            arrangement = Arrangement(motion[None])
            events = list(build_structure(world, arm, scene, [arrangement], rng=rng))
            end, wanted = world.pose(0), motion @ stands
        return row | {"stood": True} | _outcome(events, end, wanted)
    return row


def _pose(rng: np.random.Generator, side: float) -> np.ndarray:
    """Draw an upright pose (4, 4) on one side of the table."""
    return pose_from_xyz_yaw(rng.uniform(*DEPTH), side * rng.uniform(*SIDE), 0.0, rng.uniform(-np.pi, np.pi))


def _outcome(events: Sequence[object], end: np.ndarray, wanted: np.ndarray) -> Row:
    """Return what happened in a pick; takes the object's last and wanted poses (4, 4)."""
    attempts = [event for event in events if isinstance(event, Picked | PickFailed)]
    error, tilt = float(np.linalg.norm(end[:2, 3] - wanted[:2, 3])), tilt_between(end, wanted)
    failures = [event.reason for event in events if isinstance(event, PickFailed | PlaceFailed | PlanFailed)]
    return {
        "planned": bool(attempts),
        "at_once": bool(attempts) and isinstance(attempts[0], Picked),
        "held": any(isinstance(event, Picked) for event in attempts),
        "stands": bool(attempts and error <= MAX_DISPLACEMENT and tilt <= MAX_TILT and end[2, 3] > FALLEN),
        "grasps": [event.grasp for event in attempts],
        "error_m": error,
        "tilt_rad": float(tilt),
        "failures": failures,
    }
