"""Write the sections of one turn: an instruction and everything that followed from it."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from html import escape
from typing import Any

from agent.errors import DONE, ENDED_FROM_OUTSIDE, EXECUTED, NOT_BUILDABLE, PARTLY_DONE, ROBOT_REFUSED
from agent.rendering.image_files import FILM
from agent.rendering.object_markers import markers_of_scene
from agent.rendering.text import number, place, slot_label
from agent.reporting.event_text import (
    arm_sentence,
    describe_goal_row,
    describe_object,
    parse_notes,
    remark_sentence,
    trial_note,
    verdict_sentence,
)
from agent.reporting.html.charts import gauge, timing
from agent.reporting.html.figures import candidates, legend, swatch, tried
from agent.reporting.html.markup import album, bar, figure, film, paragraph, section, table, table_view
from grounding.figures.drawings import without_drawings

_NO = re.compile(r"(n|no|nope|never ?mind|cancel|stop)\b", re.IGNORECASE)  # how a proposal is declined


@dataclass(frozen=True)
class Turn:
    """The report and the pictures of one turn.

    Attributes:
        report: `agent.reporting.run_report`'s dictionary.
        pictures: name -> the bytes of a WebP file.
        model: the table in 3D, as in `agent.reporting.table_model`; `None` where it is not known.
    """

    report: Mapping[str, Any]
    pictures: Mapping[str, bytes]
    model: Mapping[str, Any] | None = None

    @property
    def title(self) -> str:
        """Return the user's text."""
        said = self.report["instruction"]
        return "before the first instruction" if said is None else f"“{said}”"

    @property
    def outcome(self) -> str:
        """Return the outcome as HTML; empty if nothing was asked for.

        Only a goal can fail: a question, its answer, a greeting and a declined proposal are no failures.
        """
        if self.report["instruction"] is None:
            return ""
        kind, words = self._ending()
        return f'<span class="badge {kind}">{words}</span>'

    def _ending(self) -> tuple[str, str]:
        """Return the style of the badge and its words."""
        report, outcome = self.report, self.report["outcome"]
        said = {remark["kind"] for remark in report["remarks"]}
        code = outcome["exit_code"]
        if outcome["success"] and report["verdict"] is not None:
            return "good", "Built as asked" if report["verdict"]["how"] == "arm" else "A valid goal was found"
        if code in ENDED_FROM_OUTSIDE:
            return "quiet", "Stopped"
        if code == NOT_BUILDABLE and report["proposals"] is None:
            return "quiet", "Refused"
        if code == PARTLY_DONE and report["verdict"] is not None:
            return "quiet", "Partly built" if report["verdict"]["how"] == "arm" else "Valid for some of the objects"
        if code == EXECUTED:
            return "quiet", "Executed, not verified"
        if code == ROBOT_REFUSED:
            return "bad", "The arm was not moved"
        if code not in (None, DONE):
            return "bad", "Not built"
        if any(remark["kind"] == "interjected" and remark["outcome"] == "changed" for remark in report["remarks"]):
            return "quiet", "Changed while it was built"
        if report["chosen"] is not None:
            return "quiet", "Declined" if self._declined else "Proposed, not built"
        return "quiet", "Question" if "asked" in said else "Conversation"

    @property
    def _declined(self) -> bool:
        lines = [remark["line"] for remark in self.report["remarks"] if remark["kind"] == "commanded"]
        return any(_NO.match(line) for line in lines)

    def sections(self) -> str:
        """Return all that there is to show, as HTML."""
        parts = (
            self._parse(), self._space(), self._scene(), self._proposals(), self._arm(), self._verdict(),
            self._remarks(), self._time(), self._options(),
        )  # fmt: skip
        return "\n".join(part for part in parts if part)

    @cached_property
    def _figures(self) -> Mapping[str, str]:
        entries = {entry["name"]: entry for entry in self.report["pictures"]}
        return {
            name: film(content, entries[name]["caption"], entries[name]["interval"])
            if name == FILM
            else figure(content, entries[name]["caption"])
            for name, content in self.pictures.items()
        }

    def _seconds(self, step: str) -> float | None:
        return self.report["seconds"].get(step)

    def _parse(self) -> str:
        parse = self.report["parse"]
        if parse is None:
            return ""
        notes = "".join(map(paragraph, parse_notes(parse)))
        if parse.get("parts"):
            parts = "".join(f"<li>{escape(part)}</li>" for part in parse["parts"])
            return section("Instruction as read", f"<ol>{parts}</ol>{notes}", self._seconds("parse"))
        slots = []
        for slot, value in parse["spec"].items():
            words = ", ".join(parse["evidence"].get(slot) or ())
            sure = parse["confidence"].get(slot)
            slots.append(
                f'<div class="{"slot" if value else "slot open"}"><span class="soft">{escape(slot_label(slot))}</span>'
                f"<b>{escape(without_drawings(value or 'left open'))}</b>"
                + (f'<span class="soft">{number(100 * sure)} % sure</span>{bar(sure)}' if sure is not None else "")
                + (f'<span class="soft">from “{escape(words)}”</span>' if words else "")
                + "</div>"
            )
        content = f'{notes}<div class="slots">{"".join(slots)}</div>'
        return section("Instruction as read", content, self._seconds("parse"))

    def _remarks(self) -> str:
        lines = "".join(f'<li class="answer">{_remark(remark)}</li>' for remark in self.report["remarks"])
        return section("Remarks", f'<ul class="story">{lines}</ul>') if lines else ""

    def _space(self) -> str:
        return "" if self.model is None else table_view(self.model)

    def _scene(self) -> str:
        scene = self.report["scene"]
        if scene is None:
            return ""
        marker_of = {marker.label: marker for marker in markers_of_scene(scene)}
        rows = [
            (
                f"{swatch(marker_of[seen['name']])}{escape(describe_object(seen))}",
                escape(seen["category"]),
                "takes part" if seen["takes_part"] else '<span class="soft">stays where it is</span>',
                place(seen["position"]),
                str(seen["points"]),
            )
            for seen in scene["objects"]
        ]
        seen = table(("object", "noun", "role", "where, seen from the robot", "points seen"), rows)
        names = ("camera-before", "objects-found", "scene-before")
        pictures = album([self._figures.get(name) for name in names])
        notes = "".join(map(paragraph, scene.get("notes", ())))
        return section("Scene before", pictures + seen + notes, self._seconds("scene"))

    def _proposals(self) -> str:
        proposals = self.report["proposals"]
        if proposals is None:
            return ""
        ranked = proposals["candidates"]
        content = f"<p>{len(ranked)} candidates by the model “{escape(proposals['model'])}”, best first. "
        content += "A score is the product of its factors; up is away from the robot.</p>"
        if self.report["scene"] is not None and ranked:
            content += legend(self.report["scene"]) + candidates(self.report)
        content += album([self._figures.get("goal-overlay"), self._figures.get("proposed-goal")])
        content += self._goals()
        return section("Proposals", content + self._scores(ranked), self._seconds("propose"))

    def _goals(self) -> str:
        """Return a table of where each object goes, and for which part, of a goal of several parts; empty otherwise."""
        chosen = self.report["chosen"]
        if chosen is None or not any("parts" in goal for goal in chosen["goals"]):
            return ""
        rows = [[escape(cell) for cell in describe_goal_row(goal)] for goal in chosen["goals"]]
        return table(("object", "", "goal", "of"), rows)

    def _scores(self, ranked: list[Mapping[str, Any]]) -> str:
        names = list(ranked[0]["scores"]) if ranked else []
        rows = [
            [str(each["rank"])]
            + [number(each["scores"].get(name), 3) + bar(each["scores"].get(name) or 0.0) for name in names]
            for each in ranked
        ]
        chosen = self.report["chosen"]
        index = chosen["rank"] - 1 if chosen else None
        every = table(["rank", *names], rows, index)
        return f"<details><summary>every score of all {len(rows)}</summary>{every}</details>" if rows else ""

    def _arm(self) -> str:
        if not self.report["arm"]:
            return ""
        scene = self.report["scene"]
        names = [seen["name"] for seen in scene["objects"]] if scene else []
        lines = "".join(f"<li>{escape(arm_sentence(event, names))}</li>" for event in self.report["arm"])
        steps = [shown for name, shown in self._figures.items() if name.startswith("placement-")]
        reel = self._figures.get(FILM, "")
        content = f'<div class="{"beside" if reel else ""}">{reel}<ol class="story">{lines}</ol></div>'
        return section("Build", content + album(steps, "pictures small"), self._seconds("build"))

    def _verdict(self) -> str:
        verdict, without_arm = self.report["verdict"], self.report.get("tried") is not None
        drawn = tried(self.report) if without_arm and self.report["scene"] is not None else None
        after = album([self._figures.get("camera-tried"), drawn, self._figures.get("camera-after")])
        if verdict is None:
            return section("After", after) if after else ""
        rows = [
            (
                '<span class="good">✓ passed</span>' if check["passed"] else '<span class="bad">✗ failed</span>',
                escape(check["name"]) + gauge(check["measured"], check["limit"]),
                _measured(check["measured"]),
                escape(check["limit"]),
            )
            for check in verdict["checks"]
        ]
        on = verdict.get("on", "the true objects")
        checked = trial_note(verdict) or f"Checked on {on} at rest, built by the arm."
        content = paragraph(verdict_sentence(verdict)) + paragraph(checked)
        if rows:
            content += table(("", "check", "measured", "allowed"), rows)
        title = "Tried without the arm" if without_arm else "After"
        return section(title, after + content, self._seconds("check"))

    def _time(self) -> str:
        bars = timing(self.report["seconds"], self.report["outcome"]["seconds"])
        return section("Time by step", bars, self.report["outcome"]["seconds"]) if bars else ""

    def _options(self) -> str:
        rows = [
            (escape(slot_label(name)), escape(_option_value(value))) for name, value in _flat(self.report["options"])
        ]
        options = table(("option", "value"), rows) if rows else ""
        return f"<details><summary>every option of this run</summary>{options}</details>" if options else ""


def _remark(payload: Mapping[str, Any]) -> str:
    """Return a remark as HTML; an answer follows its question."""
    sentence = escape(remark_sentence(payload))
    return f"<b>{escape(payload['question'])}</b>\n{sentence}" if payload["kind"] == "answered" else sentence


def _measured(value: float | None) -> str:
    """Format a measured value; a count as a whole number."""
    return number(value, 0 if value is not None and float(value).is_integer() else 3)


def _flat(options: Mapping[str, Any]) -> list[tuple[str, Any]]:
    """Yield the options; nested options follow under their own names."""
    plain = [(name, value) for name, value in options.items() if not isinstance(value, Mapping)]
    return plain + [entry for inner in options.values() if isinstance(inner, Mapping) for entry in _flat(inner)]


def _option_value(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    return "not set" if value is None else str(value)
