"""Load the benchmark of goals: instructions, their scenes and the acceptable goals.

`goals_free.jsonl` was written by hand, by other people than the training language; `goals_templated.jsonl.xz` is of a
grammar. The scenes are in `goal_scenes.json`.
"""

from __future__ import annotations

import json
import lzma
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

from grounding.benchmark import BenchmarkError, read_lines
from grounding.goals.goal import Goal
from grounding.resolve.attributes import ObjectAttributes, SceneObject
from grounding.spec import SpecError

STATUSES = ("ok", "ask", "refused")
KEYS = ("text", "scene", "stratum", "status", "goals", "also")


@dataclass(frozen=True)
class GoalRow:
    """An instruction and its acceptable goals.

    Attributes:
        text: the instruction.
        scene: the name of its scene, or `None` if no scene is known.
        stratum: what kind of instruction it is; rates are given for each.
        status: "ok"; "ask" if a question must be asked first; "refused".
        goals: the acceptable goals; empty unless the status is "ok".
        also: another status that is fair, such as a refusal in place of a question, or `None`.
    """

    text: str
    scene: str | None
    stratum: str
    status: str
    goals: tuple[Goal, ...] = ()
    also: str | None = None

    @property
    def statuses(self) -> tuple[str, ...]:
        """Return the fair statuses, the best first."""
        return (self.status,) if self.also is None else (self.status, self.also)


@cache
def goal_scenes() -> Mapping[str, tuple[SceneObject, ...]]:
    """Load the scenes of the benchmark: name -> objects, with their colours,
    sizes (m) and positions (m, world frame).
    """
    text = (resources.files("grounding") / "benchmark_data" / "goal_scenes.json").read_text(encoding="utf-8")
    return {name: tuple(map(_scene_object, objects)) for name, objects in json.loads(text).items()}


def _scene_object(entry: Mapping[str, Any]) -> SceneObject:
    attributes = ObjectAttributes(tuple(entry["colors"]), tuple(entry["size"]), tuple(entry["position"]))
    return SceneObject(entry["name"], attributes)


def free_goal_rows() -> list[GoalRow]:
    """Load the hand-written instructions."""
    with resources.as_file(resources.files("grounding") / "benchmark_data" / "goals_free.jsonl") as path:
        return load_goal_rows(path)


def templated_goal_rows() -> list[GoalRow]:
    """Load the instructions of a grammar over goals, thinned evenly: of every family of goals at most 400."""
    packed = (resources.files("grounding") / "benchmark_data" / "goals_templated.jsonl.xz").read_bytes()
    lines = lzma.decompress(packed).decode("utf-8").splitlines()
    return [_row(line, f"goals_templated.jsonl, line {number}") for number, line in enumerate(lines, start=1)]


def load_goal_rows(path: str | Path) -> list[GoalRow]:
    """Load the rows of a JSON-lines file.

    Raises:
        BenchmarkError: for a line that is not a row; OSError for a file that cannot be read.
    """
    rows = [_row(line, where) for where, line in read_lines(path)]
    if not rows:
        raise BenchmarkError(f"{path} has no row; a row is a JSON object with {', '.join(KEYS)}")
    return rows


def _row(line: str, where: str) -> GoalRow:
    try:
        entry = json.loads(line)
    except (ValueError, RecursionError) as error:
        raise BenchmarkError(f"{where} is not valid JSON: {error}") from error
    if not isinstance(entry, dict) or not isinstance(entry.get("text"), str):
        raise BenchmarkError(f"{where} has no text; a row is a JSON object with {', '.join(KEYS)}")
    if unknown := sorted(set(entry) - set(KEYS)):
        raise BenchmarkError(f"{where}: unknown key {unknown[0]!r}; legal keys: {', '.join(KEYS)}")
    status, scene, goals = entry.get("status"), entry.get("scene"), entry.get("goals", [])
    if status not in STATUSES:
        raise BenchmarkError(f"{where}: status cannot be {status!r}; legal values: {', '.join(STATUSES)}")
    also, unbuilt = entry.get("also"), [one for one in STATUSES if one not in ("ok", status)]
    if also is not None and (status == "ok" or also not in unbuilt):
        legal = "null" if status == "ok" else f"{', '.join(unbuilt)}, null"
        raise BenchmarkError(f"{where}: also cannot be {also!r} beside the status {status!r}; legal values: {legal}")
    if scene is not None and scene not in goal_scenes():
        legal = ", ".join(goal_scenes())
        raise BenchmarkError(f"{where}: scene cannot be {scene!r}; legal values: {legal}, null")
    if not isinstance(goals, list) or bool(goals) != (status == "ok"):
        legal = "a list of one goal or more" if status == "ok" else "an empty list"
        raise BenchmarkError(f"{where}: goals of a row with the status {status!r} must be {legal}, not {goals!r:.80}")
    made = tuple(_goal(goal, scene, f"{where}, goal {number}") for number, goal in enumerate(goals))
    return GoalRow(entry["text"], scene, str(entry.get("stratum", "all")), status, made, also)


def _goal(values: Any, scene: str | None, where: str) -> Goal:
    try:
        goal = Goal.from_dict(values)
    except SpecError as error:
        raise BenchmarkError(f"{where}: {error}") from error
    if not goal.parts:
        raise BenchmarkError(f"{where} has no parts; an instruction that asks for nothing has the status 'refused'")
    kind, count = (str, 0) if scene is None else (int, len(goal_scenes()[scene]))
    for one in goal.named_objects():
        if not isinstance(one, kind):
            legal = "words, because the row has no scene" if scene is None else "indices, because the row has a scene"
            raise BenchmarkError(f"{where}: objects cannot be {one!r}; legal: {legal}")
        if isinstance(one, int) and one >= count:
            raise BenchmarkError(f"{where}: there is no object {one} in the scene {scene!r}; legal: 0 to {count - 1}")
    return goal
