"""The events, told in the terminal as they happen; plain text where there is no terminal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from rich.console import Console
from rich.markup import escape

from agent.event_base import Event
from agent.rendering.text import aligned, duration, number, place, slot_label
from agent.reporting.event_text import (
    arm_sentence,
    parse_notes,
    remark_sentence,
    seen_row,
    verdict_sentence,
    verdict_title,
)

_CANDIDATES_SHOWN = 5


class TerminalReport:
    """Listens to the events of one run, or of several, and tells them, one step after another.

    Args:
        console: where to tell; rich leaves colours out where it is no terminal.
    """

    def __init__(self, console: Console) -> None:
        self._console = console
        self._names: list[str] = []

    def on_event(self, event: Event) -> None:
        """Print one event."""
        told = event.to_dict()
        match told["kind"]:
            case "started":
                self._say(f"[bold]“{escape(told['instruction'])}”[/bold]")
            case "parsed":
                self._parsed(told)
            case "perceived":
                self._perceived(told)
            case "imagined":
                self._imagined(told)
            case "chosen":
                self._chosen(told)
            case "checked":
                self._checked(told)
            case "asked" | "answered" | "noted" | "commanded" | "restored":
                for line in remark_sentence(told).splitlines():
                    self._line(line)
            case "failed" | "pictured" | "filmed" | "previewed" | "tried":
                return  # the command ends with the message; pictures are for the page, previews for who shows them
            case "finished":
                self._say(f"\n[bold]The whole run took {duration(told['seconds'])}.[/bold]")
            case _:
                self._line(arm_sentence(told, self._names))

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

    def _parsed(self, told: Mapping[str, Any]) -> None:
        self._step("Understood", told["seconds"])
        rows = []
        for slot, value in told["spec"].items():
            words = ", ".join(told["evidence"].get(slot) or ())
            sure = told["confidence"].get(slot)
            note = f"{number(100 * sure, 0)} % sure" if sure is not None else ""
            rows.append((slot_label(slot), value or "left open", note, f"from “{words}”" if words else ""))
        self._columns(rows)
        for line in parse_notes(told):
            self._line(line)

    def _perceived(self, told: Mapping[str, Any]) -> None:
        seen = told["objects"]
        self._names = [one["name"] for one in seen]
        self._step("Looked at the table", told["seconds"])
        self._line(f"{len(seen)} objects, {sum(one['takes_part'] for one in seen)} take part")
        self._columns([seen_row(one) for one in seen])
        for note in told.get("notes", ()):
            self._line(note)

    def _imagined(self, told: Mapping[str, Any]) -> None:
        self._step("Imagined", told["seconds"])
        self._line(f"{len(told['candidates'])} candidates by the model “{told['model']}”, best first:")
        shown = told["candidates"][:_CANDIDATES_SHOWN]
        names = list(shown[0]["scores"])
        self._columns(
            [("rank", *names)]
            + [(str(one["rank"]), *(number(one["scores"].get(name), 3) for name in names)) for one in shown]
        )

    def _chosen(self, told: Mapping[str, Any]) -> None:
        self._step(f"Chose candidate {told['rank']}")
        self._columns([(goal["name"], "goes to", place(goal["position"])) for goal in told["goals"]])

    def _checked(self, told: Mapping[str, Any]) -> None:
        self._step(verdict_title(told), told["seconds"])
        for check in told["checks"]:
            mark = "[green]passed[/green]" if check["passed"] else "[red]failed[/red]"
            line = f"{check['name']}: {number(check['measured'], 3)} ({check['limit']})"
            self._say(f"  {mark}  {escape(line)}")
        sentence = escape(verdict_sentence(told))
        style, end = ("bold green", "") if told["success"] else ("bold red", ".")
        self._say(f"  [{style}]{sentence}{end}[/{style}]")
