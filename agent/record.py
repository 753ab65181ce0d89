"""Everything that happened in a run, kept as it is told: `report.json`, the pictures, and `report.html` from both.

`report.json`, schema version 1; every key is always there, `null` or empty where the run did not get so far:

| key | value |
|---|---|
| `schema_version`, `version` | of this layout, of structagent |
| `instruction`, `options` | what was asked for |
| `outcome` | `success`, `exit_code`, `step` and `message` of the failure, `seconds` of the whole run |
| `parse` | spec, confidence and evidence per slot, parser, nouns named |
| `scene` | objects (names, nouns, who takes part, mean position in the world frame), table |
| `imagination` | model and every candidate with its scores and positions, best first |
| `chosen` | the rank and the goal of each object |
| `arm` | the arm's events in order, each with its `kind` |
| `verdict` | success, failure class, every check with its measured value and limit |
| `seconds` | step -> time |
| `pictures` | name, file, caption, in order |

Lengths in metres, angles in radians, times in seconds.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from agent import __version__, events, pictures
from agent.errors import UsageError
from agent.html import page

SCHEMA_VERSION = 1


class RunRecord:
    """Listens to the events of one run.

    Attributes:
        report: the dictionary that becomes `report.json`.
        pictures: name -> PNG bytes, in order.
    """

    def __init__(self) -> None:
        self.report: dict[str, Any] = {
            "schema_version": SCHEMA_VERSION,
            "version": __version__,
            "instruction": None,
            "options": {},
            "outcome": {"success": False, "exit_code": None, "step": None, "message": None, "seconds": None},
            "parse": None,
            "scene": None,
            "imagination": None,
            "chosen": None,
            "arm": [],
            "verdict": None,
            "seconds": {},
            "pictures": [],
        }
        self.pictures: dict[str, bytes] = {}

    @property
    def saw_something(self) -> bool:
        """Whether the run got as far as a scene: before that there is nothing worth a folder."""
        return self.report["scene"] is not None

    def __call__(self, event: events.Event) -> None:
        """Takes one event in."""
        told = event.to_dict()
        report = self.report
        match event:
            case events.Started():
                report["instruction"], report["options"] = told["instruction"], told["options"]
            case events.Parsed():
                report["parse"] = self._timed("parse", told)
            case events.Perceived():
                report["scene"] = self._timed("scene", told)
                if event.scene.color is not None:
                    self._picture("camera-before", "the scene before, through the camera", event.scene.color)
                self._picture("scene-before", "the scene before, from above", pictures.from_above(event.scene))
            case events.Imagined():
                report["imagination"] = self._timed("imagination", told)
            case events.Chosen():
                report["chosen"] = _without_kind(told)
                self._picture("imagined-goal", "the imagined goal", pictures.imagined(event.scene, event.arrangement))
            case events.Pictured():
                self._picture(event.name, event.caption, event.image)
            case events.Checked():
                report["verdict"] = self._timed("check", told)
            case events.Failed():
                report["outcome"] |= {"step": event.step, "message": event.message}
            case events.Finished():
                report["outcome"] |= _without_kind(told)
            case _:
                report["arm"].append(told)
                if told["kind"] == "planned":  # its time counts from the start of the search
                    report["seconds"]["plan"] = round(told["seconds"], 3)
                elif told["kind"] == "placed":
                    report["seconds"]["build"] = round(report["seconds"].get("build", 0.0) + told["seconds"], 3)

    def write(self, folder: Path) -> Path:
        """Writes `report.json`, the pictures and `report.html` into `folder`; the path of the page."""
        try:
            folder.mkdir(parents=True, exist_ok=True)
            _remove_pictures_of_earlier_run(folder)
            for name, content in self.pictures.items():
                (folder / f"{name}.png").write_bytes(content)
            (folder / "report.json").write_text(self.json() + "\n", encoding="utf-8")
            (folder / "report.html").write_text(page(self.report, self.pictures), encoding="utf-8")
        except OSError as error:
            raise UsageError(f"cannot write the report into {str(folder)!r}: {error.strerror}") from error
        return folder / "report.html"

    def json(self) -> str:
        """The report as JSON."""
        return json.dumps(self.report, indent=2, ensure_ascii=False, allow_nan=False)

    def _timed(self, step: str, told: dict[str, Any]) -> dict[str, Any]:
        self.report["seconds"][step] = round(told["seconds"], 3)
        return _without_kind(told)

    def _picture(self, name: str, caption: str, image: Any) -> None:
        if name not in self.pictures:
            self.report["pictures"].append({"name": name, "file": f"{name}.png", "caption": caption})
        self.pictures[name] = pictures.png_of(image)


def _without_kind(told: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in told.items() if key != "kind"}


def _remove_pictures_of_earlier_run(folder: Path) -> None:
    """Removes what an earlier report in this folder lists, so that no picture of it is taken for one of this run."""
    try:
        listed = json.loads((folder / "report.json").read_text(encoding="utf-8"))["pictures"]
        names = [Path(entry["file"]).name for entry in listed]
    except (FileNotFoundError, ValueError, KeyError, TypeError):
        return  # no report of ours
    for name in names:
        (folder / name).unlink(missing_ok=True)
