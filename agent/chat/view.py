"""Show a conversation in the terminal, live or from a session file; use no colour or cursor control without a
terminal.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from rich.console import Console, Group
from rich.text import Text

from agent.chat.live_display import LiveDisplay
from agent.chat.maps import Maps
from agent.chat.scores import caption_of, comparison_rows, factor_rows
from agent.chat.text_printer import Printer, TextPrinter
from agent.event_base import Event
from agent.rendering.object_markers import Marker, markers_of_candidate, markers_of_scene
from agent.rendering.text import duration, number, slot_label
from agent.reporting.event_text import (
    TRIED,
    arm_sentence,
    check_sentence,
    describe_row,
    parse_notes,
    part_lines,
    remark_sentence,
    trial_note,
    verdict_sentence,
    verdict_title,
)
from grounding.figures.drawings import without_drawings

SHOWN = 3  # number of candidates that /candidates shows
_PREVIEW_COLUMNS = 24
_PREVIEW_EVERY = 4  # steps between previews, so that drawing does not slow the model down
_PLANNING = "looking for another plan"
_AT_WORK = "the arm is at work"


class MapDisplay(Protocol):
    """A display of tables and candidates; its methods are those of `agent.chat.maps.Maps`."""

    @property
    def columns(self) -> int: ...

    def beside(self, count: int) -> int: ...

    def forget_key(self) -> None: ...

    def show(self, scene: Mapping[str, Any], markers: Sequence[Marker]) -> None: ...

    def show_candidates(
        self, scene: Mapping[str, Any], candidates: Sequence[Mapping[str, Any]], captions: Sequence[Sequence[Text]]
    ) -> None: ...

    def previews(self, scene: Mapping[str, Any], payload: Mapping[str, Any], columns: int) -> list[Text]: ...


class BusyDisplay(Protocol):
    """A display of work in progress; its methods are those of `agent.chat.live_display.LiveDisplay`."""

    @property
    def possible(self) -> bool: ...

    def spin(self, message: str) -> None: ...

    def draw(self, content: Any) -> None: ...

    def stop(self) -> None: ...


@dataclass(frozen=True)
class Surroundings:
    """The parts of a screen that depend on where the chat is shown.

    Attributes:
        text: shows what is said.
        maps: shows the table and the candidates.
        live: shows work in progress.
        stopping: says in a few words how the user stops the arm; empty if the display of work shows it.
        keys: says what the keys do, in a sentence; empty without keys of its own.
        typed: whether lines are typed into the text while the arm works, where a spinner would overwrite them.
    """

    text: Printer
    maps: MapDisplay
    live: BusyDisplay
    stopping: str = ""
    keys: str = ""
    typed: bool = False


def terminal_surroundings(console: Console) -> Surroundings:
    """Return the maps, the spinner and the keys of a terminal."""
    keys = "Ctrl-C stops the current work; Alt-Enter starts a new line; Ctrl-D ends the chat"
    stopping = "type what should be different; Ctrl-C stops it"
    return Surroundings(TextPrinter(console), Maps(console), LiveDisplay(console), stopping, keys, typed=True)


class ChatScreen:
    """A listener that shows events as they happen.

    Args:
        console: the console to show them on; `None` with surroundings of another kind.
        echo: whether to show the user's lines too, for sessions that were not typed on this console.
        surroundings: what depends on where the chat is shown; by default what suits a terminal.

    Attributes:
        maps: the display of maps.
        keys: a sentence about the keys, or empty.
    """

    def __init__(
        self, console: Console | None = None, echo: bool = False, surroundings: Surroundings | None = None
    ) -> None:
        around = surroundings or terminal_surroundings(console or Console())
        self.console = console
        self._echo = echo
        self.maps, self.keys = around.maps, around.keys
        self._live, self._text = around.live, around.text
        self._at_work, self._typed = "; ".join(filter(None, (_AT_WORK, around.stopping))), around.typed
        self._scene: Mapping[str, Any] | None = None
        self._candidates: Mapping[str, Any] | None = None
        self._moved: Mapping[str, Any] = {}  # the scene whose objects the candidates move
        self._rank = 1
        self._unplanned: list[int] = []  # ranks without a plan; the first one was shown
        self._failed_check = False  # whether the last event was a failed check
        self._named: Sequence[str] = ()  # the objects of the last parse
        self._hinted = False  # whether the hint at /candidates and /why was shown

    def on_event(self, event: Event) -> None:
        """Show one event."""
        payload = event.to_dict()
        kind = payload["kind"]
        if kind == "previewed":
            self._preview(payload)
            return
        self.idle()
        if kind == "plan_failed" and self._unplanned:
            self._unplanned.append(payload["arrangement"] + 1)
            self.busy(_PLANNING)
            return
        self._others_without_a_plan()
        _SHOW.get(kind, ChatScreen._arm_event)(self, payload)
        self._failed_check = kind == "checked" and not payload["success"]

    # --- while something is at work ----------------------------------------------------------

    def busy(self, what: str) -> None:
        """Show a spinner until something else is shown; only on a terminal."""
        self._live.spin(what)

    def idle(self) -> None:
        """Remove the spinner."""
        self._live.stop()

    def _preview(self, payload: Mapping[str, Any]) -> None:
        step, steps = payload["step"], payload["steps"]
        if not self._live.possible or self._scene is None or (step % _PREVIEW_EVERY and step != steps):
            return
        lines = self.maps.previews(self._scene, payload, _PREVIEW_COLUMNS)
        self._live.draw(Group(Text(f"denoising: step {step} of {steps}", "dim"), *lines))

    # --- views ----------------------------------------------------------------

    def scene(self, payload: Mapping[str, Any] | None = None) -> None:
        """Show the table from above with the names of its objects.

        Args:
            payload: an event `Perceived` in its JSON form; by default the last one.
        """
        payload = payload or self._scene
        if payload is None:
            self.note("no table has been observed yet")
            return
        self.idle()
        self._scene = payload
        self.maps.show(payload, markers_of_scene(payload))
        for note in payload.get("notes", ()):
            self.note(note)

    def forget(self) -> None:
        """Forget the scene and its candidates after a change of the table."""
        self._scene, self._candidates, self._rank = None, None, 1
        self._named = ()
        self.maps.forget_key()

    def scene_read(self, payload: Mapping[str, Any]) -> None:
        """Print the place of each object in words; takes an event `Perceived` in its JSON form."""
        self.idle()
        self._scene = payload
        self._text.rows([describe_row(one) for one in payload["objects"]])

    def candidates(self, count: int) -> None:
        """Show the best candidates side by side from above, with their scores and shortcomings."""
        if self._candidates is None:
            self.note("no arrangement has been proposed yet")
            return
        payload = self._candidates
        shown = payload["candidates"][:count]
        several = len(shown) > 1
        count = len(payload["candidates"])
        self._text.title(f"{count} arrangement{'s' * (count != 1)} proposed", payload["seconds"])
        if count > 1:
            self._text.line("  the best ones:" if several else "  the best one:")
        columns = self.maps.beside(len(shown))
        captions = [caption_of(one, payload["candidates"][0], columns) for one in shown]
        self.maps.show_candidates(self._moved, shown, captions)
        if not several and len(payload["candidates"]) > 1 and not self._hinted and not self._echo:
            self._hinted = True
            self.note(f"/candidates shows the best {min(SHOWN, len(payload['candidates']))}, /why explains the ranking")

    def why(self) -> None:
        """Print the factors of the chosen candidate's score and the shortcomings of the others."""
        if self._candidates is None:
            self.note("no arrangement has been proposed yet")
            return
        candidates = self._candidates["candidates"]
        self._text.title(f"candidate {self._rank}: its score is the product of these factors")
        self._text.rows(factor_rows(candidates[self._rank - 1]))
        self._text.title("the others")
        self._text.rows(comparison_rows(candidates, self._rank, SHOWN + 2))

    def space(self) -> None:
        """Print an empty line before the next prompt."""
        self.idle()
        self._text.space()

    def listing(self, rows: Sequence[Sequence[str]]) -> None:
        """Print a table."""
        self.idle()
        self._text.rows(rows)

    def said(self, line: str) -> None:
        """Print a line of the user, for a display that does not show what is typed."""
        self._text.said(line)

    def note(self, message: str) -> None:
        """Print a remark."""
        self.idle()
        self._text.line(message, "dim")

    def complain(self, message: str) -> None:
        """Print an error."""
        self.idle()
        self._text.line(message, "red")

    # --- events ------------------------------------------------------------------------------

    def _started(self, payload: Mapping[str, Any]) -> None:
        self._say_line(payload["instruction"])

    def _commanded(self, payload: Mapping[str, Any]) -> None:
        self._say_line(payload["line"])

    def _interjected(self, payload: Mapping[str, Any]) -> None:
        if payload["outcome"] != "answered":  # the answer follows, with the line
            self._say_line(payload["line"])
        if payload["message"]:
            self._text.line(f"  {payload['message']}", "red" if payload["outcome"] == "refused" else "bold")

    def _remembered(self, payload: Mapping[str, Any]) -> None:
        """Ignore the number of a turn, which /timeline shows."""

    def _forked(self, payload: Mapping[str, Any]) -> None:
        self.note(f"{remark_sentence(payload)}; /back {payload['turn']} returns here")

    def _noted(self, payload: Mapping[str, Any]) -> None:
        self.note(payload["message"])

    def _answered(self, payload: Mapping[str, Any]) -> None:
        self._say_line(payload["question"])
        self._text.answer(payload["answer"])

    def _perceived(self, payload: Mapping[str, Any]) -> None:
        first, self._scene = self._scene is None, payload
        if first and self._echo:
            self.scene(payload)

    def _proposed(self, payload: Mapping[str, Any]) -> None:
        if self._scene is not None:
            self._candidates, self._moved, self._rank = payload, self._scene, 1
            self.candidates(1)

    def _failed(self, payload: Mapping[str, Any]) -> None:
        if not self._failed_check:  # the check has already said why
            self.complain(payload["message"])

    def _finished(self, payload: Mapping[str, Any]) -> None:
        if payload["success"]:
            self.note(f"done in {duration(payload['seconds'])}")

    def _pictured(self, payload: Mapping[str, Any]) -> None:
        if payload["name"].startswith("placement-") and not self._typed:
            self.busy(self._at_work)

    def _filmed(self, payload: Mapping[str, Any]) -> None:
        """Ignore a film, which only the HTML page can show."""

    def _plan_failed(self, payload: Mapping[str, Any]) -> None:
        self._unplanned = [payload["arrangement"] + 1]
        about = f" for {payload['name']}" if payload["name"] else ""
        self._text.line(f"  no plan for candidate {self._unplanned[0]}{about}: {payload['reason']}")
        self.busy(_PLANNING)

    def _arm_event(self, payload: Mapping[str, Any]) -> None:
        names = [one["name"] for one in self._scene["objects"]] if self._scene else []
        self._text.line(f"  {arm_sentence(payload, names)}")
        if not self._typed:
            self.busy(self._at_work)
        elif payload["kind"] == "planned" and self._live.possible:
            self.note(f"  {self._at_work}")

    def _say_line(self, line: str) -> None:
        if self._echo:
            self._text.said(line)

    def _parsed(self, payload: Mapping[str, Any]) -> None:
        """Show the parsed slots; for a correction, only those that it changed."""
        before, changed = payload["before"], payload["before"] is not None
        self._text.title("changed" if changed else "understood", payload["seconds"])
        if payload.get("parts"):
            self._text.rows([(line,) for line in part_lines(payload)])
            self._named = payload["named"]
            for note in parse_notes(payload):
                self.note(f"  {note}")
            return
        rows = []
        for slot, value in payload["spec"].items():
            said = without_drawings(value or "left open")
            if changed:
                if before.get(slot) == value:
                    continue
                said = f"{without_drawings(before.get(slot) or 'left open')} -> {said}"
            words = " ".join(payload["evidence"].get(slot) or ())
            sure = payload["confidence"].get(slot)
            note = f"{number(100 * sure, 0)} % sure" if sure is not None else ""
            note += f", from “{words}”" if words else ""
            rows.append((slot_label(slot), said, note))
        same, self._named = list(payload["named"]) == list(self._named), payload["named"]
        if rows:
            self._text.rows(rows)
        elif same:
            self._text.line("  nothing; the goal is unchanged")
        if not (changed and same):
            self._text.line(f"  with {', '.join(payload['named'])}")
        for note in parse_notes({**payload, "named": ()})[:-1]:
            self.note(f"  {note}")

    def _tried(self, payload: Mapping[str, Any]) -> None:
        if self._scene is not None:
            self._text.title(TRIED)
            self.maps.show(self._scene, markers_of_candidate(self._scene, payload["positions"], payload["turns"]))

    def _checked(self, payload: Mapping[str, Any]) -> None:
        self._text.title(verdict_title(payload).lower(), payload["seconds"])
        for check in payload["checks"]:
            self._text.check(check["passed"], check_sentence(check))
        self._text.line(f"  {verdict_sentence(payload)}", "bold green" if payload["success"] else "bold red")
        if note := trial_note(payload):
            self.note(f"  {note}")

    def _asked(self, payload: Mapping[str, Any]) -> None:
        self._text.question(payload["question"], payload["options"])

    def _restored(self, payload: Mapping[str, Any]) -> None:
        goal, self._named = payload["spec"] or payload.get("parts"), payload["objects"]
        what = "; ".join(part_lines(payload)) or ", ".join(filter(None, (payload["spec"] or {}).values()))
        still = "still" if payload["how"] == "put back" else "again"
        said = f"the goal is {still}: {without_drawings(what) or 'anything'}" if goal else "there is no goal"
        moved = f"; put back: {', '.join(payload['moved'])}" if payload["moved"] else ""
        self.note(f"{payload['how']}: {said}{moved}")

    def _chosen(self, payload: Mapping[str, Any]) -> None:
        if payload["rank"] == self._rank:
            return
        self._rank = payload["rank"]
        self._text.line(f"  candidate {self._rank} is chosen")
        if self._candidates is not None:
            one = self._candidates["candidates"][self._rank - 1]
            caption = caption_of(one, self._candidates["candidates"][0], self.maps.columns)
            self.maps.show_candidates(self._moved, [one], [caption])

    def _others_without_a_plan(self) -> None:
        others, self._unplanned = self._unplanned[1:], []
        if others:
            some = ", ".join(str(rank) for rank in others[:4]) + (f" and {len(others) - 4} more" if others[4:] else "")
            self._text.line(f"  none for {some} either")


_SHOW: Mapping[str, Callable[[ChatScreen, Mapping[str, Any]], None]] = {
    "started": ChatScreen._started, "commanded": ChatScreen._commanded, "interjected": ChatScreen._interjected,
    "remembered": ChatScreen._remembered, "forked": ChatScreen._forked, "parsed": ChatScreen._parsed,
    "asked": ChatScreen._asked, "noted": ChatScreen._noted, "answered": ChatScreen._answered,
    "restored": ChatScreen._restored, "perceived": ChatScreen._perceived, "proposed": ChatScreen._proposed,
    "chosen": ChatScreen._chosen, "checked": ChatScreen._checked, "failed": ChatScreen._failed,
    "finished": ChatScreen._finished, "tried": ChatScreen._tried, "pictured": ChatScreen._pictured,
    "filmed": ChatScreen._filmed, "plan_failed": ChatScreen._plan_failed,
}  # fmt: skip
