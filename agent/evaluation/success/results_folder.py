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

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from agent.evaluation.common import Place
from agent.evaluation.result_store import KeptRows
from agent.runtime.jsonl_journal import Journal
from agent.runtime.output_ownership import check_subfolder
from structdiffusion.benchmark.scenes import EvaluationScene
from structdiffusion.benchmark.success import Row
from structdiffusion.worker_process import WORKER_DIED

SCENES = "scenes.jsonl"
FAILURES = "failures"  # a folder of pictures
RESULTS = ("eval.json", "tables.md", "success_at_k.png", "failures.png")


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
        check_subfolder(path / FAILURES)
        keys = {"model", "structure", "number", "failure", "verdicts"}
        self._kept = KeptRows(path, asked, keys, (SCENES, *RESULTS))
        try:
            self._scenes = Journal(path / SCENES, {"structure", "number", "draw"}, "scene of an evaluation")
        except BaseException:
            self._kept.close()
            raise
        self.draws: dict[Place, int] = {
            (entry["structure"], entry["number"]): entry["draw"] for entry in self._scenes.entries
        }
        self.rows: dict[tuple[str, str, int], Row] = {
            (row["model"], row["structure"], row["number"]): row for row in self._kept.rows
        }

    def __enter__(self) -> EvaluationFolder:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def has(self, model: str, place: Place) -> bool:
        """Whether it is known what becomes of a model on a scene; not where the worker died at it."""
        row = self.rows.get((model, *place))
        return row is not None and row["failure"] != WORKER_DIED

    def close(self) -> None:
        """Lets other evaluations into the folder."""
        self._scenes.close()
        self._kept.close()

    def add_scene(self, scene: EvaluationScene) -> None:
        """Keeps which draw of a scene was accepted."""
        place = scene.structure, scene.number
        if place not in self.draws:
            self._scenes.add({"structure": scene.structure, "number": scene.number, "draw": scene.draw})
            self.draws[place] = scene.draw

    def add_row(self, row: Row) -> None:
        """Keeps a row."""
        self._kept.add(row)
        self.rows[row["model"], row["structure"], row["number"]] = row
