"""Store the rows of a success evaluation in a folder, so that the same command resumes one that was stopped.

| file | content |
|---|---|
| `about.json` | the inputs of the rows (`SuccessConfig.fingerprint`); a command with different ones is refused |
| `scenes.jsonl` | the accepted draw of each scene, so that its reference is not checked in physics again |
| `rows.jsonl` | a row per planner and scene (`SceneResult.to_dict`, and "model"), appended as they come |
| `eval.json`, `tables.md`, `success_at_k.png`, `failures.png` | the report of all rows, written at the end |
| `failures/` | pictures of failed arrangements |
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from agent.evaluation.result_store import ResultStore
from agent.evaluation.rows import Place
from agent.runtime.jsonl_journal import Journal
from agent.runtime.output_ownership import check_subfolder
from structdiffusion.benchmark.scenes import EvaluationScene
from structdiffusion.benchmark.success import Row
from structdiffusion.worker_process import WORKER_DIED

SCENES = "scenes.jsonl"
FAILURES = "failures"  # a folder of pictures
RESULTS = ("eval.json", "tables.md", "success_at_k.png", "failures.png")


class EvaluationFolder:
    """The stored rows and scenes of one evaluation. Close it, or use it as a context manager.

    Args:
        path: of the folder, which is made if it does not exist.
        config: the `SuccessConfig.fingerprint` of the evaluation.

    Attributes:
        path: of the folder.
        draws: the accepted draw of each scene.
        rows: by planner, structure and number.

    Raises:
        UsageError, BadInput: as `ResultStore`.
    """

    def __init__(self, path: Path, config: Mapping[str, Any]) -> None:
        self.path = path
        check_subfolder(path / FAILURES)
        keys = {"model", "structure", "number", "failure", "verdicts"}
        self._store = ResultStore(path, config, keys, (SCENES, *RESULTS))
        try:
            self._scenes = Journal(self._store.place, SCENES, {"structure", "number", "draw"}, "scene of an evaluation")
        except BaseException:
            self._store.close()
            raise
        self.draws: dict[Place, int] = {
            (entry["structure"], entry["number"]): entry["draw"] for entry in self._scenes.entries
        }
        self.rows: dict[tuple[str, str, int], Row] = {
            (row["model"], row["structure"], row["number"]): row for row in self._store.rows
        }

    def __enter__(self) -> EvaluationFolder:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def has(self, model: str, place: Place) -> bool:
        """Tell whether the row of a planner and a scene is stored; a row whose worker died does not count."""
        row = self.rows.get((model, *place))
        return row is not None and row["failure"] != WORKER_DIED

    def close(self) -> None:
        """Release the folder."""
        self._scenes.close()
        self._store.close()

    def add_scene(self, scene: EvaluationScene) -> None:
        """Store the accepted draw of a scene."""
        place = scene.structure, scene.number
        if place not in self.draws:
            self._scenes.add({"structure": scene.structure, "number": scene.number, "draw": scene.draw})
            self.draws[place] = scene.draw

    def add_row(self, row: Row) -> None:
        """Store a row."""
        self._store.add(row)
        self.rows[row["model"], row["structure"], row["number"]] = row
