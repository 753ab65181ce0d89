"""Record everything that happened in a run: `report.json`, the pictures, and `report.html` from both.

`report.json`, schema version 7; every key is always present, `null` or empty if the run did not get that far:

| key | value |
|---|---|
| `schema_version`, `version` | of this layout, of structagent |
| `instruction`, `options` | the request |
| `outcome` | `success`, `exit_code`, `step` and `message` of the failure, `seconds` of the whole run |
| `parse` | spec, confidence and evidence per slot, parser, named nouns; the `goal`, a line for each of its `parts` |
| `remarks` | questions, answers, notes, commands, interjections and restored states in order, each with its `kind` |
| `turn` | in a conversation, the number of the `turn` in its timeline, the turn it comes `after`, and its `branch` |
| `scene` | objects (names, nouns, who takes part, mean position and outline in the world frame, colour), table |
| `proposals` | model, checksums of its networks (`networks`), candidates with scores, positions and turns, best first |
| `chosen` | the rank and the goal of each object; for several parts also which place it, if it stays or makes room |
| `arm` | the arm's events in order, each with its `kind` |
| `tried` | without the arm: the final positions and turns of the released objects, as for a candidate |
| `verdict` | success, failure class, all checks with measured values and limits, `count` of objects, those `left_out` |
| `seconds` | step -> time |
| `pictures` | name, file (WebP; `film` is an animated one, with `interval` seconds between its frames), caption |

Lengths in metres, angles in radians, times in seconds. Schema version 2 has `remarks`, outlines, colours, turns and the
film, and its pictures are WebP files, where those of version 1 were PNG. In version 3 the `display_name` of an object
is what was `called` before. Version 4 has `goal` and `parts`. In version 5 `proposals`, the step `propose` and the
score `rollout` replace `imagination`, `imagination` and `imagined`, and `verdict` has `count` and `left_out`. In
version 6 `placed` says whether the object stands (`trouble`), why it was moved `again` and what it was to rest `on`,
`standing_changed` what fell later, and an object of the scene has its `number` on the table, from 1. In version 7
`remarks` have the lines that came while the arm was building ("interjected"), and `turn` is new.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from agent import __version__
from agent.errors import NotWritten
from agent.event_base import Event
from agent.rendering.image_files import FILM, FORMAT, Picture, pictures_of
from agent.reporting.html.document import run_page
from agent.reporting.html.turn import Turn
from agent.reporting.session_log import RUN_SESSION, SessionWriter
from agent.reporting.table_model import TableModel
from agent.runtime.output_ownership import files_written, mark, own_folder
from agent.runtime.redaction import without_credentials

SCHEMA_VERSION = 7
EXAMPLE = "example.toml"  # beside the report of a run that was like an example: its figure
_REMARKS = ("asked", "answered", "noted", "commanded", "interjected", "forked", "restored")


class RunRecord:
    """A record of the events of one run, live or from a session file.

    Args:
        session: also receives every event and picture; each picture is drawn once.

    Attributes:
        report: the dictionary that becomes `report.json`.
        pictures: name -> WebP bytes, in order.
    """

    def __init__(self, session: SessionWriter | None = None) -> None:
        self._session = session
        self.report: dict[str, Any] = {
            "schema_version": SCHEMA_VERSION,
            "version": __version__,
            "instruction": None,
            "options": {},
            "outcome": {"success": False, "exit_code": None, "step": None, "message": None, "seconds": None},
            "parse": None,
            "remarks": [],
            "turn": None,
            "scene": None,
            "proposals": None,
            "chosen": None,
            "arm": [],
            "tried": None,
            "verdict": None,
            "seconds": {},
            "pictures": [],
        }
        self.pictures: dict[str, bytes] = {}
        self._model = TableModel()
        self._interval = 1.0  # s between two pictures of the film

    @property
    def saw_something(self) -> bool:
        """Return whether the run reached a scene; an earlier end leaves nothing worth a folder."""
        return self.report["scene"] is not None

    @property
    def turn(self) -> Turn:
        """Return the turn as a page shows it."""
        return Turn(self.report, self.pictures, self._model.to_dict())

    def on_event(self, event: Event) -> None:
        """Record one event; for a live event, draw its pictures and keep the bodies on the table for the view in 3D."""
        self._add(event.to_dict())
        part = self._model.on_event(event)
        if self._session is not None:
            self._session.on_event(event)
            if part is not None:
                self._session.on_table(part)
        for picture in pictures_of(event):
            self.on_picture(picture)
            if self._session is not None:
                self._session.on_picture(picture)

    def _add(self, payload: Mapping[str, Any]) -> None:
        report = self.report
        match payload["kind"]:
            case "started":
                report["instruction"], report["options"] = (
                    payload["instruction"],
                    without_credentials(payload["options"]),
                )
            case "parsed":
                report["parse"] = self._timed("parse", payload)
            case "perceived":
                report["scene"] = self._timed("scene", payload)
            case "proposed":
                report["proposals"] = self._timed("propose", payload)
            case "chosen":
                report["chosen"] = _without_kind(payload)
            case "tried":
                report["tried"] = _without_kind(payload)
            case "checked":
                report["verdict"] = self._timed("check", payload)
            case "failed":
                report["outcome"] |= _without_kind(payload)
            case "finished":
                report["outcome"] |= _without_kind(payload)
            case "remembered":
                report["turn"] = _without_kind(payload)
            case kind if kind in _REMARKS:
                report["remarks"].append(payload)
            case "filmed":
                self._interval = payload["interval"]
            case "pictured" | "previewed":
                return  # pictures arrive separately, and previews are not recorded
            case kind:
                report["arm"].append(payload)
                if kind == "planned":  # its time counts from the start of the search
                    report["seconds"]["plan"] = round(payload["seconds"], 3)
                elif kind == "placed":
                    report["seconds"]["build"] = round(report["seconds"].get("build", 0.0) + payload["seconds"], 3)

    def on_table(self, part: Mapping[str, Any]) -> None:
        """Record a part of the table in 3D from a session file."""
        self._model.take(part)

    def on_picture(self, picture: Picture) -> None:
        """Record one picture; it replaces an earlier one with the same name."""
        if picture.name not in self.pictures:
            entry: dict[str, Any] = {
                "name": picture.name,
                "file": f"{picture.name}.{FORMAT}",
                "caption": picture.caption,
            }
            if picture.name == FILM:
                entry["interval"] = self._interval
            self.report["pictures"].append(entry)
        self.pictures[picture.name] = picture.content

    def write(self, folder: Path) -> Path:
        """Write `report.json`, the pictures and `report.html` into `folder`; returns the path of the page.

        Files of an earlier run are replaced once all new files fit on the disk, and its other pictures are removed, so
        that none of them is mistaken for one of this run.

        Raises:
            NotWritten: if that is not possible; an earlier report is then unchanged.
        """
        files: dict[str, bytes | str] = {f"{name}.{FORMAT}": content for name, content in self.pictures.items()}
        files |= {"report.json": self.json() + "\n", "report.html": run_page(self.turn)}
        try:
            with own_folder(folder, "run") as place:
                earlier = files_written(place, "run")
                session = earlier & {RUN_SESSION, *self._example()}
                mark(place, "run", earlier | files.keys())
                place.write(files)
                for name in earlier - files.keys() - session:
                    place.remove(name)
                mark(place, "run", session | files.keys())
        except OSError as error:
            raise NotWritten(f"cannot write the report into {str(folder)!r}: {error.strerror}") from error
        return folder / "report.html"

    def _example(self) -> set[str]:
        """Return the name of the figure's file that the goal of this run refers to, if it has one."""
        return {EXAMPLE} if self.report["options"].get("reading", {}).get("like") else set()

    def json(self) -> str:
        """Return the report as JSON."""
        return json.dumps(self.report, indent=2, ensure_ascii=False, allow_nan=False)

    def _timed(self, step: str, payload: Mapping[str, Any]) -> dict[str, Any]:
        self.report["seconds"][step] = round(payload["seconds"], 3)
        return _without_kind(payload)


def _without_kind(payload: Mapping[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in payload.items() if key != "kind"}
