"""Show a run or a chat in the page while it happens: the one listener of its events, and of the table in between."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from agent import events
from agent.arm.events import ArmEvent, Picked, Placed, Planned, StandingChanged
from agent.event_base import Event
from agent.live_view.scene_messages import (
    arm_message,
    candidates_message,
    picture_message,
    poses_message,
    preview_message,
    scene_message,
)
from agent.live_view.server import ViewServer
from agent.live_view.transcript import page_screen
from structdiffusion.observation import ObjectCloud, Scene

if TYPE_CHECKING:
    from agent.chat.conversation import Conversation
    from agent.scenes.table_scene import TableScene

_POSES_EVERY = 0.08  # s between two messages about the moving arm; the page moves smoothly from one to the next
_PREVIEWS_EVERY = 0.15  # s


@dataclass(frozen=True)
class Progress:
    """How far a request has come.

    Attributes:
        stage: what is being done or, in the end, how it ended.
        placed, motions: the motions of the arm that are done, less the objects that do not stand as placed, and all
            that were planned; 0 before there is a plan.
        outcome: "success" or "failure" in the end, otherwise empty.
    """

    stage: str = ""
    placed: int = 0
    motions: int = 0
    outcome: str = ""


class LiveView:
    """A listener that shows events and the table in the page.

    Args:
        server: sends the messages.
        transcript: whether it also writes what happens as text, because the chat itself is elsewhere.
    """

    def __init__(self, server: ViewServer, transcript: bool) -> None:
        self._server = server
        self._screen = page_screen(server, echo=True) if transcript else None
        self._table: TableScene | None = None
        self._number = 0  # of the scene
        self._clouds: tuple[ObjectCloud, ...] = ()  # of the objects that take part
        self._seen: Mapping[str, np.ndarray] = {}
        self._shown: events.Proposed | None = None
        self._rank = 0
        self._progress = self._waited_with = Progress()
        self._done, self._down = 0, set[str]()  # motions of the arm, and what does not stand as placed
        self._next_poses = self._next_preview = 0.0

    def on_event(self, event: Event) -> None:
        """Show one event."""
        if self._screen is not None:
            self._screen.on_event(event)
        self._follow(event)
        match event:
            case events.Perceived():
                self._perceived(event)
            case events.Previewed():
                self._preview(event)
            case events.Proposed():
                self._propose(event, 1)
            case events.Chosen():
                self._choose(event.rank)
            case events.Asked():
                self._forget_proposal()  # it is no longer what is talked about
            case events.Pictured():
                self._server.publish("picture", picture_message(event.image, event.caption))
            case ArmEvent():
                self._show_poses()

    # --- the table ---------------------------------------------------------------------------

    def on_table(self, table: TableScene) -> None:
        """Take a table before anything on it has moved; its clouds follow with an event or are known already."""
        self._table = table
        self._server.publish("arm", arm_message(table))
        self._show_scene(table.remembered())
        picture = table.picture() if table.labelled is None else table.labelled
        self._server.publish("picture", picture_message(picture, "the table, through the camera"))

    def on_physics_step(self, table: TableScene) -> None:
        """Show the objects and the arm from time to time, if anybody watches."""
        if self._server.watched and time.monotonic() >= self._next_poses:
            self._table = table
            self._show_poses()

    def on_waiting(self, conversation: Conversation) -> None:
        """Show the table at rest and the pending proposal before a line is asked for: either may have been restored."""
        if conversation.table is not self._table:
            self.on_table(conversation.table)
        self._show_poses()
        self._forget_outcome()
        proposal = None if conversation.question is not None else conversation.situation.proposal
        if proposal is None:
            self._forget_proposal()
        elif proposal.proposed is not self._shown:
            self._propose(proposal.proposed, proposal.rank)
        elif proposal.rank != self._rank:
            self._choose(proposal.rank)

    def _perceived(self, event: events.Perceived) -> None:
        self._show_scene(event.scene)
        picture = event.labelled if event.labelled is not None else event.scene.color
        if picture is not None:
            self._server.publish("picture", picture_message(picture, "the table, through the camera"))

    def _show_scene(self, scene: Scene) -> None:
        self._number += 1
        self._clouds, self._shown, self._rank = scene.objects, None, 0
        self._seen = {} if self._table is None else self._table.poses()
        self._server.publish("scene", scene_message(self._number, scene.table, scene.objects, scene.distractors))
        self._show_poses()

    def _show_poses(self) -> None:
        if self._table is not None:
            self._next_poses = time.monotonic() + _POSES_EVERY
            self._server.publish("poses", poses_message(self._number, self._table, self._seen))

    # --- proposals ---------------------------------------------------------------------------

    def _preview(self, event: events.Previewed) -> None:
        if self._server.watched and time.monotonic() >= self._next_preview:
            self._next_preview = time.monotonic() + _PREVIEWS_EVERY
            self._server.publish("preview", preview_message(self._number, self._clouds, event))

    def _propose(self, proposed: events.Proposed, rank: int) -> None:
        """Show the arrangements of a proposal, on the clouds that they move."""
        moved = {cloud.name for cloud in proposed.scene.objects}
        if self._shown is not None or moved != {cloud.name for cloud in self._clouds}:
            self._show_scene(proposed.scene)
        self._server.publish("candidates", candidates_message(self._number, proposed))
        self._shown = proposed
        self._choose(rank)

    def _choose(self, rank: int) -> None:
        self._rank = rank
        self._server.publish("chosen", {"scene": self._number, "rank": rank})

    def _forget_proposal(self) -> None:
        if self._shown is not None:
            self._shown, self._rank = None, 0
            self._server.publish("candidates", {"scene": self._number, "count": 0})

    # --- progress ----------------------------------------------------------------------------

    def _forget_outcome(self) -> None:
        """Drop how a turn ended when the next one has ended too without any progress of its own."""
        if self._progress is self._waited_with and self._progress.outcome:
            self._progress = Progress()
            self._server.publish("progress", asdict(self._progress))
        self._waited_with = self._progress

    def _follow(self, event: Event) -> None:
        now = self._progress
        match event:
            case events.Started():
                now = Progress("reading the instruction")
            case events.Parsed():
                now = replace(now, stage="looking at the table")
            case events.Perceived() if now.stage:
                now = replace(now, stage="proposing arrangements")
            case events.Proposed() | events.Chosen() if not now.outcome:
                now = replace(now, stage="arrangements are proposed")
            case events.Asked():
                now = replace(now, stage="a question is open")
            case Planned():
                self._done, self._down = 0, set()
                now = Progress("building", 0, len(event.order))
            case Picked():
                now = replace(now, stage=f"{event.name} is in the hand", motions=max(now.motions, self._done + 1))
            case Placed():
                self._done += 1
                now = self._stands(now, event.name, not event.trouble)
                how = "is out of the way" if event.aside else "is in its place"
                stage = (
                    f"{event.name} {how}" if not event.trouble else f"{event.name} does not stand: it {event.trouble}"
                )
                now = replace(now, stage=stage, motions=max(now.motions, self._done))
            case StandingChanged():
                now = self._stands(now, event.name, event.stands)
                how = "stands again" if event.stands else f"no longer stands: it {event.trouble}"
                now = replace(now, stage=f"{event.name} {how} since {event.during}")
            case events.Checked():
                now = replace(now, stage="checked")
            case events.Restored():
                now = Progress()
            case events.Commanded() | events.Answered() if now.outcome:
                now = Progress()  # the next turn begins
            case events.Failed():
                now = replace(now, stage=event.message, outcome="failure")
            case events.Finished() if event.success:
                now = replace(now, stage="it stands as asked" if now.placed else "done", outcome="success")
        if now != self._progress:
            self._progress = now
            self._server.publish("progress", asdict(now))

    def _stands(self, now: Progress, name: str, stands: bool) -> Progress:
        """Return the progress with one object that stands as placed, or not."""
        self._down = self._down - {name} if stands else self._down | {name}
        return replace(now, placed=max(0, self._done - len(self._down)))
