"""The events, told in the terminal as they happen; plain text where there is no terminal."""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import Console
from rich.markup import escape

from agent import events
from agent.telling import aligned, arm_sentence, duration, number, place, slot_label

_CANDIDATES_SHOWN = 5


class TerminalReport:
    """Listens to the events of one run and tells them, one step after another.

    Args:
        console: where to tell; rich leaves colours out where it is no terminal.
    """

    def __init__(self, console: Console) -> None:
        self._console = console
        self._names: list[str] = []

    def __call__(self, event: events.Event) -> None:
        """Tells one event."""
        match event:
            case events.Started():
                self._say(f"[bold]“{escape(event.instruction)}”[/bold]")
            case events.Parsed():
                self._parsed(event)
            case events.Perceived():
                self._perceived(event)
            case events.Imagined():
                self._imagined(event)
            case events.Chosen():
                self._chosen(event)
            case events.Checked():
                self._checked(event)
            case events.Failed() | events.Pictured():
                return  # the command ends with the message; pictures are for the page
            case events.Finished():
                self._say(f"\n[bold]The whole run took {duration(event.seconds)}.[/bold]")
            case _:
                self._line(arm_sentence(event.to_dict(), self._names))

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

    def _parsed(self, event: events.Parsed) -> None:
        self._step("Understood", event.seconds)
        rows = []
        for slot, value in event.spec.to_dict().items():
            words = ", ".join(event.evidence.get(slot) or ())
            sure = event.confidence.get(slot)
            note = f"{number(100 * sure, 0)} % sure" if sure is not None else ""
            rows.append((slot_label(slot), value or "left open", note, f"from “{words}”" if words else ""))
        self._columns(rows)
        if event.viewpoint != "robot":
            self._line(f"spoken from the {event.viewpoint} side of the table, turned to the robot's")
        if event.fallback:
            self._line(event.fallback)
        for slot, value in event.dropped.items():
            self._line(f"left out, because it does not go with the rest: {slot_label(slot)} {value}")
        self._line(f"with the objects named: {', '.join(event.named)}" if event.named else "with every object there")

    def _perceived(self, event: events.Perceived) -> None:
        taking_part = [seen for seen in event.objects if seen.takes_part]
        self._names = [seen.name for seen in event.objects]
        self._step("Looked at the table", event.seconds)
        self._line(f"{len(event.objects)} objects, {len(taking_part)} take part")
        self._columns(
            [
                (seen.name, place(seen.position), "" if seen.takes_part else "stays where it is")
                for seen in event.objects
            ]
        )

    def _imagined(self, event: events.Imagined) -> None:
        self._step("Imagined", event.seconds)
        self._line(f"{len(event.candidates)} candidates by the model “{event.model}”, best first:")
        shown = event.candidates[:_CANDIDATES_SHOWN]
        names = list(shown[0].scores)
        self._columns(
            [("rank", *names)]
            + [(str(one.rank), *(number(one.scores[name], 3) for name in names)) for one in shown]
        )

    def _chosen(self, event: events.Chosen) -> None:
        self._step(f"Chose candidate {event.rank}")
        self._columns([(goal["name"], "goes to", place(goal["position"])) for goal in event.goals])

    def _checked(self, event: events.Checked) -> None:
        self._step("Checked on the true objects" if event.how == "arm" else "Tried without the arm", event.seconds)
        for check in event.checks:
            mark = "[green]passed[/green]" if check.passed else "[red]failed[/red]"
            self._say(f"  {mark}  {escape(f'{check.name}: {number(check.measured, 3)} ({check.limit})')}")
        if event.success:
            self._say("  [bold green]It stands as it was asked for.[/bold green]")
        else:
            self._say(f"  [bold red]{escape(f'{event.failure_class}: {event.detail}')}.[/bold red]")
