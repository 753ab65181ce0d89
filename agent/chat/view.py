"""What a conversation looks like in the terminal, live or from a session file; without colour or cursor control where
there is none.
"""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from typing import Any

from rich.console import Console, Group
from rich.live import Live
from rich.spinner import Spinner
from rich.text import Text

from agent.chat.maps import Maps
from agent.event_base import Event
from agent.rendering.object_markers import markers_of_candidate, markers_of_scene
from agent.rendering.text import aligned, duration, number, slot_label
from agent.reporting.event_text import (
    TRIED,
    arm_sentence,
    parse_notes,
    seen_row,
    shortcoming,
    verdict_sentence,
    verdict_title,
)

SHOWN = 3  # candidates, where they are asked for
_PREVIEW_COLUMNS = 24
_PREVIEW_EVERY = 4  # steps: drawing must not slow the model down
_PLANNING = "looking for another plan"
_AT_WORK = "the arm is at work; Ctrl-C stops it"


class ChatScreen:
    """Shows events as they are told.

    Args:
        console: where to show them.
        echo: show what was said too, which a terminal has already shown where it was typed.

    Attributes:
        maps: the maps that it shows.
    """

    def __init__(self, console: Console, echo: bool = False) -> None:
        self.console = console
        self._echo = echo
        self.maps = Maps(console)
        self._live: Live | None = None
        self._scene: Mapping[str, Any] | None = None
        self._imagined: Mapping[str, Any] | None = None
        self._rank = 1
        self._unplanned: list[int] = []  # ranks without a plan, the first of which was told
        self._failed_check = False  # was told last
        self._named: Sequence[str] = ()  # the objects of the last reading
        self._hinted = False  # that more candidates can be shown, to somebody who types

    def on_event(self, event: Event) -> None:
        """Show one event."""
        payload = event.to_dict()
        if payload["kind"] == "previewed":
            self._preview(payload)
            return
        self.idle()
        if payload["kind"] == "plan_failed" and self._unplanned:
            self._unplanned.append(payload["arrangement"] + 1)
            self.busy(_PLANNING)
            return
        self._others_without_a_plan()
        failed_check, self._failed_check = self._failed_check, payload["kind"] == "checked" and not payload["success"]
        match payload["kind"]:
            case "started":
                self._say_line(payload["instruction"])
                self._imagined = None
            case "commanded":
                self._say_line(payload["line"])
            case "parsed":
                self._parsed(payload)
            case "asked":
                self._asked(payload)
            case "noted":
                self.note(payload["message"])
            case "answered":
                self._say_line(payload["question"])
                for line in payload["answer"].splitlines():
                    self._print(line)
            case "restored":
                self._restored(payload)
            case "perceived":
                first, self._scene = self._scene is None, payload
                if first and self._echo:
                    self.scene(payload)
            case "imagined":
                self._imagined, self._rank = payload, 1
                self.candidates(1)
            case "chosen":
                self._chosen(payload)
            case "checked":
                self._checked(payload)
            case "failed":
                if not failed_check:  # which has said it all
                    self.complain(payload["message"])
            case "finished":
                if payload["success"]:
                    self.note(f"done in {duration(payload['seconds'])}")
            case "tried":
                self._tried(payload)
            case "pictured":
                if payload["name"].startswith("placement-"):
                    self.busy(_AT_WORK)
            case "filmed":
                return
            case "plan_failed":
                self._unplanned = [payload["arrangement"] + 1]
                about = f" for {payload['name']}" if payload["name"] else ""
                self._print(f"  no plan for candidate {self._unplanned[0]}{about}: {payload['reason']}")
                self.busy(_PLANNING)
            case _:
                names = [one["name"] for one in self._scene["objects"]] if self._scene else []
                self._print(f"  {arm_sentence(payload, names)}")
                self.busy(_AT_WORK)

    # --- while something is at work ----------------------------------------------------------

    def busy(self, what: str) -> None:
        """Says that something is at work, until the next thing is shown; on a terminal alone."""
        if self.console.is_terminal and not self.console.is_dumb_terminal:
            self._show_live(Spinner("dots", Text(what, "dim")), moving=True)

    def idle(self) -> None:
        """Nothing is at work any more."""
        if self._live is not None:
            self._live.stop()
            self._live = None

    def _show_live(self, content: Any, moving: bool) -> None:
        if self._live is not None and self._live.auto_refresh != moving:
            self.idle()
        if self._live is None:
            self._live = Live(content, console=self.console, transient=True, auto_refresh=moving, refresh_per_second=8)
            self._live.start()
        self._live.update(content, refresh=True)

    def _preview(self, payload: Mapping[str, Any]) -> None:
        live = self.console.is_terminal and not self.console.is_dumb_terminal
        if not live or self._scene is None or (payload["step"] % _PREVIEW_EVERY and payload["step"] != payload["steps"]):
            return
        lines = self.maps.previews(self._scene, payload, _PREVIEW_COLUMNS)
        title = Text(f"out of the noise: step {payload['step']} of {payload['steps']}", "dim")
        self._show_live(Group(title, *lines), moving=False)

    # --- what there is to see ----------------------------------------------------------------

    def scene(self, payload: Mapping[str, Any] | None = None) -> None:
        """The table from above, with the names of what stands on it.

        Args:
            payload: an event `Perceived` in its JSON form; by default the last one.
        """
        payload = payload or self._scene
        if payload is None:
            self.note("nothing was looked at yet")
            return
        self.idle()
        self._scene = payload
        self.maps.show(payload, markers_of_scene(payload))
        for note in payload.get("notes", ()):
            self.note(note)

    def forget(self) -> None:
        """Another table was set: what was imagined on the old one is of no use."""
        self._scene, self._imagined, self._rank = None, None, 1
        self._named = ()
        self.maps.forget_key()

    def scene_read(self, payload: Mapping[str, Any]) -> None:
        """What stands where, in words; takes an event `Perceived` in its JSON form."""
        self.idle()
        self._scene = payload
        self._block(aligned([seen_row(one) for one in payload["objects"]]))

    def candidates(self, count: int) -> None:
        """The best candidates from above, with their scores and what the lower ones lack; several side by side."""
        if self._imagined is None or self._scene is None:
            self.note("nothing was imagined yet")
            return
        payload = self._imagined
        shown = payload["candidates"][:count]
        several = len(shown) > 1
        which = ", the best first" if several else "; the best of them:"
        count = len(payload["candidates"])
        self._title(f"{count} arrangement{'s' * (count != 1)} imagined{which}", payload["seconds"])
        columns = self.maps.beside(len(shown))
        captions = [self._caption(one, payload["candidates"][0], columns) for one in shown]
        self.maps.show_candidates(self._scene, shown, captions)
        if not several and len(payload["candidates"]) > 1 and not self._hinted and not self._echo:
            self._hinted = True
            self.note(f"/candidates shows the best {min(SHOWN, len(payload['candidates']))}, /why what decides")

    def why(self) -> None:
        """What speaks for the chosen candidate, factor by factor, and what was against the others."""
        if self._imagined is None:
            self.note("nothing was imagined yet")
            return
        candidates = self._imagined["candidates"]
        mine = candidates[self._rank - 1]
        self._title(f"candidate {self._rank}: its score is the product of these factors")
        self._block(aligned([(name, number(value, 3)) for name, value in mine["scores"].items()]))
        self._title("the others")
        rows = [_row(one, candidates[0]) for one in candidates[: SHOWN + 2] if one is not mine]
        worst = candidates[-1]
        if worst["rank"] > SHOWN + 2:
            rows.append(_row(worst, candidates[0]))
        self._block(aligned(rows))

    def space(self) -> None:
        """An empty line before the next prompt."""
        self.idle()
        self.console.print()

    def note(self, message: str) -> None:
        """A remark."""
        self.idle()
        self._print(message, "dim")

    def complain(self, message: str) -> None:
        """Why something could not be done."""
        self.idle()
        self._print(message, "red")

    # --- events ------------------------------------------------------------------------------

    def _say_line(self, line: str) -> None:
        if self._echo:
            self.console.print()
            self._print(f"> {line}", "bold")

    def _parsed(self, payload: Mapping[str, Any]) -> None:
        """The slots; of a correction those alone that it changed."""
        before, changed = payload["before"], payload["before"] is not None
        self._title("changed" if changed else "understood", payload["seconds"])
        rows = []
        for slot, value in payload["spec"].items():
            said = value or "left open"
            if changed:
                if before.get(slot) == value:
                    continue
                said = f"{before.get(slot) or 'left open'} -> {said}"
            words = " ".join(payload["evidence"].get(slot) or ())
            sure = payload["confidence"].get(slot)
            note = f"{number(100 * sure, 0)} % sure" if sure is not None else ""
            note += f", from “{words}”" if words else ""
            rows.append((slot_label(slot), said, note))
        same, self._named = list(payload["named"]) == list(self._named), payload["named"]
        if rows:
            self._block(aligned(rows))
        elif same:
            self._print("  nothing; everything is as before")
        if not (changed and same):
            self._print(f"  with {', '.join(payload['named'])}")
        for note in parse_notes({**payload, "named": ()})[:-1]:
            self.note(f"  {note}")

    def _tried(self, payload: Mapping[str, Any]) -> None:
        if self._scene is not None:
            self._title(TRIED)
            self.maps.show(self._scene, markers_of_candidate(self._scene, payload["positions"], payload["turns"]))

    def _checked(self, payload: Mapping[str, Any]) -> None:
        self._title(verdict_title(payload).lower(), payload["seconds"])
        for check in payload["checks"]:
            line = f"{check['name']}: {number(check['measured'], 3)} ({check['limit']})"
            self._print(f"  {'passed' if check['passed'] else 'failed'}  {line}", "" if check["passed"] else "red")
        self._print(f"  {verdict_sentence(payload)}", "bold green" if payload["success"] else "bold red")

    def _asked(self, payload: Mapping[str, Any]) -> None:
        self._print(payload["question"], "bold")
        for place_, option in enumerate(payload["options"], start=1):
            self._print(f"  {place_}  {option}")

    def _restored(self, payload: Mapping[str, Any]) -> None:
        goal, self._named = payload["spec"], payload["objects"]
        what = ", ".join(value for value in goal.values() if value) if goal else ""
        still = "still" if payload["how"] == "put back" else "again"
        said = f"the goal is {still}: {what or 'anything'}" if goal else "there is no goal"
        moved = f"; put back: {', '.join(payload['moved'])}" if payload["moved"] else ""
        self.note(f"{payload['how']}: {said}{moved}")

    def _chosen(self, payload: Mapping[str, Any]) -> None:
        if payload["rank"] == self._rank:
            return
        self._rank = payload["rank"]
        self._print(f"  candidate {self._rank} it is")
        if self._imagined is not None and self._scene is not None:
            one = self._imagined["candidates"][self._rank - 1]
            caption = self._caption(one, self._imagined["candidates"][0], self.maps.columns)
            self.maps.show_candidates(self._scene, [one], [caption])

    def _others_without_a_plan(self) -> None:
        others, self._unplanned = self._unplanned[1:], []
        if others:
            some = ", ".join(str(rank) for rank in others[:4]) + (f" and {len(others) - 4} more" if others[4:] else "")
            self._print(f"  none for {some} either")

    # --- drawing -----------------------------------------------------------------------------

    def _caption(self, one: Mapping[str, Any], best: Mapping[str, Any], columns: int) -> list[Text]:
        head = Text(f"{one['rank']}  score {number(one['scores']['total'], 2)}", "bold")
        if one["rank"] == best["rank"]:
            return [head]
        reason = textwrap.wrap(shortcoming(one["scores"], best["scores"]), columns)
        return [head, *(Text(line, "dim") for line in reason)]

    def _title(self, title: str, seconds: float | None = None) -> None:
        line = Text(title, "bold cyan")
        if seconds is not None:
            line.append(f" {duration(seconds)}", "not bold dim default")
        self.console.print()
        self.console.print(line, highlight=False)

    def _block(self, text: str) -> None:
        for line in text.splitlines():
            self._print(f"  {line}")

    def _print(self, text: str, style: str = "") -> None:
        """A line; where it has to be broken, it goes on a little further to the right."""
        indent = " " * (len(text) - len(text.lstrip()) + 2)
        lines = textwrap.wrap(
            text, self.console.width, subsequent_indent=indent, drop_whitespace=True, break_on_hyphens=False
        )
        self.console.print(Text("\n".join(lines), style), highlight=False, soft_wrap=True)


def _row(one: Mapping[str, Any], best: Mapping[str, Any]) -> tuple[str, str, str]:
    return str(one["rank"]), number(one["scores"]["total"], 3), shortcoming(one["scores"], best["scores"])
