"""The folder of an evaluation: what was found out stays, so that the same command goes on where it was stopped.

| file | content |
|---|---|
| `about.json` | what decides the rows (`Asked.fingerprint`); a command with another one is refused |
| `scenes.jsonl` | which draw of each scene was accepted, so that its reference need not be tried in physics again |
| `rows.jsonl` | a row per model and scene (`SceneResult.to_dict`, and "model"), appended as they come |
| `eval.json`, `tables.md`, `success_at_k.png`, `failures.png` | what all rows tell, written at the end |
| `failures/` | pictures of failed arrangements |
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from agent.errors import BadInput, UsageError
from agent.journal import Journal, locked
from structdiffusion.evaluation import Row
from structdiffusion.evaluation_scenes import EvaluationScene

Place = tuple[str, int]  # a scene's structure and number
ABOUT = "about.json"
SCENES, ROWS = "scenes.jsonl", "rows.jsonl"
FAILURES = "failures"  # a folder of pictures
RESULTS = ("eval.json", "tables.md", "success_at_k.png", "failures.png")
_OPTIONS = ("objects", "seed", "candidates", "top_k", "objects_per_scene", "table", "camera")


class EvaluationFolder:
    """What is known, for one evaluation at a time. Close it, or use it as a context manager.

    Args:
        path: of the folder, made where it is not there.
        asked: `Asked.fingerprint` of what is to be measured.

    Attributes:
        path: of the folder.
        draws: the accepted draw of each scene.
        rows: by model, structure and number.

    Raises:
        UsageError: when the folder is a file, another evaluation is at work in it, or what it holds was asked for
            otherwise.
        BadInput: when it holds something else.
    """

    def __init__(self, path: Path, asked: Mapping[str, Any]) -> None:
        self.path = path
        self._lock = locked(path, "evaluation")
        try:
            _only_files(path)
            self._agree(asked)
            self._scenes = Journal(path / SCENES, {"structure", "number", "draw"}, "scene of an evaluation")
            try:
                keys = {"model", "structure", "number", "failure", "verdicts"}
                self._rows = Journal(path / ROWS, keys, "row of an evaluation")
            except BaseException:
                self._scenes.close()
                raise
        except BaseException:
            os.close(self._lock)
            raise
        self.draws: dict[Place, int] = {
            (entry["structure"], entry["number"]): entry["draw"] for entry in self._scenes.entries
        }
        self.rows: dict[tuple[str, str, int], Row] = {
            (row["model"], row["structure"], row["number"]): row for row in self._rows.entries
        }

    def __enter__(self) -> EvaluationFolder:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Lets other evaluations into the folder."""
        self._rows.close()
        self._scenes.close()
        os.close(self._lock)

    def add_scene(self, scene: EvaluationScene) -> None:
        """Keeps which draw of a scene was accepted."""
        place = scene.structure, scene.number
        if place not in self.draws:
            self._scenes.add({"structure": scene.structure, "number": scene.number, "draw": scene.draw})
            self.draws[place] = scene.draw

    def add_row(self, row: Row) -> None:
        """Keeps a row."""
        self._rows.add(row)
        self.rows[row["model"], row["structure"], row["number"]] = row

    def _agree(self, asked: Mapping[str, Any]) -> None:
        """Compares what is asked with what the folder was made for, and keeps it."""
        path = self.path / ABOUT
        networks: dict[str, str] = {}
        if path.exists():
            try:
                kept = json.loads(path.read_text(encoding="utf-8"))
                networks = dict(kept["networks"])
                differing = next((key for key in asked if key != "networks" and kept[key] != asked[key]), None)
            except (ValueError, KeyError, TypeError) as error:
                raise BadInput(f"{str(path)!r} is not that of an evaluation; choose another --out") from error
            if differing is not None:
                raise self._refusal(_difference(differing, kept[differing], asked[differing]))
            for name, checksum in asked["networks"].items():
                if networks.get(name, checksum) != checksum:
                    raise self._refusal(f"with other weights of the network {name!r}, which have changed since")
        elif (self.path / ROWS).exists():
            raise BadInput(f"{str(self.path)!r} has {ROWS} but no {ABOUT}; choose another --out")
        merged = dict(asked) | {"networks": networks | asked["networks"]}
        new = path.with_name(f".{ABOUT}")
        new.write_text(json.dumps(merged, indent=1) + "\n", encoding="utf-8")
        new.replace(path)

    def _refusal(self, why: str) -> UsageError:
        return UsageError(f"{str(self.path)!r} holds an evaluation {why}; choose another --out")


def _only_files(folder: Path) -> None:
    """Refuses a folder in which another one has a file's name, before there is anything to be written to that file."""
    for name in (ABOUT, SCENES, ROWS, *RESULTS):
        if (folder / name).is_dir():
            raise BadInput(f"{str(folder / name)!r} is a folder, and must be a file; choose another --out")
    if (folder / FAILURES).is_file():
        raise BadInput(f"{str(folder / FAILURES)!r} is a file, and must be a folder; choose another --out")


def _difference(key: str, kept: Any, asked: Any) -> str:
    if key == "version":
        return f"by structagent {kept}, and this is {asked}"
    if key == "code":
        return "by other code, and rows of both may not mix"
    if key not in _OPTIONS:
        return "with other objects of that name, which have changed since"
    option = "--" + key.replace("_", "-")
    said = [f"without {option}" if value is None else f"with {option} {value}" for value in (kept, asked)]
    return f"{said[0]}, not {said[1]}"
