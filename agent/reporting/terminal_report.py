"""Print events in the terminal as they happen; print plain text if there is no terminal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from rich.console import Console
from rich.markup import escape

from agent.event_base import Event
from agent.rendering.text import aligned, duration, number, slot_label
from agent.reporting.event_text import (
    arm_sentence,
    check_sentence,
    describe_goal_row,
    describe_row,
    parse_notes,
    part_lines,
    remark_sentence,
    trial_note,
    verdict_sentence,
    verdict_title,
)
from grounding.figures.drawings import without_drawings

_CANDIDATES_SHOWN = 5


class TerminalReport:
    """A listener that prints the events of one run or several, step by step.

    Args:
        console: the console to print on, without colours if it is not a terminal.
    """

    def __init__(self, console: Console) -> None:
        self._console = console
        self._names: list[str] = []

    def on_event(self, event: Event) -> None:
        """Print one event."""
        payload = event.to_dict()
        match payload["kind"]:
            case "started":
                self._say(f"[bold]“{escape(payload['instruction'])}”[/bold]")
            case "parsed":
                self._parsed(payload)
            case "perceived":
                self._perceived(payload)
            case "proposed":
                self._proposed(payload)
            case "chosen":
                self._chosen(payload)
            case "checked":
                self._checked(payload)
            case "asked" | "answered" | "noted" | "commanded" | "restored":
                for line in remark_sentence(payload).splitlines():
                    self._line(line)
            case "failed" | "pictured" | "filmed" | "previewed" | "tried":
                return  # the command ends with the message; pictures are for the page, previews for who shows them
            case "finished":
                self._say(f"\n[bold]The whole run took {duration(payload['seconds'])}.[/bold]")
            case _:
                self._line(arm_sentence(payload, self._names))

    def _say(self, text: str) -> None:
        self._console.print(text, highlight=False, soft_wrap=True)

    def _step(self, title: str, seconds: float | None = None) -> None:
        time = f" [dim]{duration(seconds)}[/dim]" if seconds is not None else ""
        self._say(f"\n[bold cyan]{title}[/bold cyan]{time}")

    def _line(self, text: str) -> None:
        self._say(f"  {escape(text)}")

    def _columns(self, rows: Sequence[Sequence[str]]) -> None:
        for line in aligned(rows).splitlines():
            self._line(line)

    def _parsed(self, payload: Mapping[str, Any]) -> None:
        self._step("Understood", payload["seconds"])
        for line in (*part_lines(payload), *(parse_notes(payload) if payload.get("parts") else ())):
            self._line(line)
        if payload.get("parts"):
            return
        rows = []
        for slot, value in payload["spec"].items():
            words = ", ".join(payload["evidence"].get(slot) or ())
            sure = payload["confidence"].get(slot)
            note = f"{number(100 * sure, 0)} % sure" if sure is not None else ""
            rows.append(
                (slot_label(slot), without_drawings(value or "left open"), note, f"from “{words}”" if words else "")
            )
        self._columns(rows)
        for line in parse_notes(payload):
            self._line(line)

    def _perceived(self, payload: Mapping[str, Any]) -> None:
        seen = payload["objects"]
        self._names = [one["name"] for one in seen]
        self._step("Looked at the table", payload["seconds"])
        self._line(f"{len(seen)} objects, {sum(one['takes_part'] for one in seen)} take part")
        self._columns([describe_row(one) for one in seen])
        for note in payload.get("notes", ()):
            self._line(note)

    def _proposed(self, payload: Mapping[str, Any]) -> None:
        self._step("Proposed", payload["seconds"])
        self._line(f"{len(payload['candidates'])} candidates by the model “{payload['model']}”, best first:")
        shown = payload["candidates"][:_CANDIDATES_SHOWN]
        names = list(shown[0]["scores"])
        self._columns(
            [("rank", *names)]
            + [(str(one["rank"]), *(number(one["scores"].get(name), 3) for name in names)) for one in shown]
        )

    def _chosen(self, payload: Mapping[str, Any]) -> None:
        self._step(f"Chose candidate {payload['rank']}")
        self._columns([describe_goal_row(goal) for goal in payload["goals"]])

    def _checked(self, payload: Mapping[str, Any]) -> None:
        self._step(verdict_title(payload), payload["seconds"])
        for check in payload["checks"]:
            mark = "[green]passed[/green]" if check["passed"] else "[red]failed[/red]"
            self._say(f"  {mark}  {escape(check_sentence(check))}")
        sentence = escape(verdict_sentence(payload))
        style, end = ("bold green", "") if payload["success"] else ("bold red", ".")
        self._say(f"  [{style}]{sentence}{end}[/{style}]")
        if note := trial_note(payload):
            self._line(note)
