"""Hold one table, the state of the conversation about it, and its history."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Self

from agent import events
from agent.chat.greeting import Suggestion, suggestion
from agent.chat.state import Situation
from agent.errors import UsageError
from agent.event_base import Event, Listener, send
from agent.pipeline.event_builders import perceived_event
from agent.pipeline.resources import ResourceCache
from agent.pipeline.run import RunOptions
from grounding.goals.description import describe_part
from grounding.parse_result import Question

if TYPE_CHECKING:
    from agent.scenes.sources import SceneSource
    from agent.scenes.table_scene import TableScene


class TableSession:
    """One table with its situation, its history and its options; close it, or use it in a `with` block.

    Args:
        options: as of a run; its scene is the table.
        cache: the models.
        listeners: get every event.

    Attributes:
        options: as given; the seed, the parser and the viewpoint can be changed during the conversation.
        listeners: as given.
        source, table: where the table comes from, and it.
        situation: where the conversation stands.
        question: what was asked and not yet answered, or `None`.
    """

    def __init__(self, options: RunOptions, cache: ResourceCache, listeners: Sequence[Listener]) -> None:
        self.options, self._cache, self.listeners = options, cache, listeners
        self.question: Question | None = None
        self._past: list[Situation] = []
        self._future: list[Situation] = []
        self.source, self.table = self._set_out(options)
        self._start = self.situation = self._fresh()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """End the table's physics."""
        self.table.world.close()

    def _set_out(self, options: RunOptions) -> tuple[SceneSource, TableScene]:
        source = self._cache.source(options.scene, options.objects, options.recorded)
        return source, source.set_out(options.seed)

    def _fresh(self) -> Situation:
        poses = self.table.poses()
        return Situation(None, self.table.names, poses, viewpoint=self.options.reading.viewpoint)

    def send(self, event: Event) -> None:
        """Send an event to every listener."""
        send(event, self.listeners)

    # --- history ------------------------------------------------------------------------

    def _remember(self, situation: Situation) -> None:
        self._past.append(self.situation)
        self._future.clear()
        self.situation = situation

    def undo(self) -> None:
        """Go back by one turn: the goal, and the objects on the table.

        Raises:
            UsageError: when there is nothing to go back to.
        """
        self._go_to("undo", self._past, self._future)

    def redo(self) -> None:
        """Revert an undo.

        Raises:
            UsageError: when nothing was undone.
        """
        self._go_to("redo", self._future, self._past)

    def put_back(self) -> None:
        """Put everything where it stood before the last build; the goal stays. Can be undone.

        Raises:
            UsageError: when nothing was moved.
        """
        builds = self.situation.builds
        last = next((number for number in reversed(range(len(builds))) if builds[number].moved), None)
        if last is None:
            raise UsageError("nothing was built, so there is nothing to put back")
        before = builds[last].before
        self._return_to("put back", replace(self.situation, poses=before, proposal=None, builds=builds[:last]))

    def reset(self) -> None:
        """Put the table back to its start, and drop the goal. Can be undone.

        Raises:
            UsageError: when everything is as at the start.
        """
        start = self._start
        if not self.situation.asked and self.question is None and not self.situation.builds:
            raise UsageError("everything is as it was at the start; say what to build")
        self._return_to("reset", replace(start, viewpoint=self.options.reading.viewpoint))

    def _return_to(self, how: str, situation: Situation) -> None:
        self._remember(situation)
        self.question = None
        moved = self.table.put_back(situation.poses)
        self.table.involve(situation.objects)
        self.send(_restored(how, situation, moved))

    def forget(self) -> None:
        """Drop the goal, and what is proposed or asked; the table stays. Can be undone.

        Raises:
            UsageError: when there is no goal.
        """
        if not self.situation.asked and self.question is None:
            raise UsageError("there is no goal; say what to build")
        self.question = None
        start, viewpoint = self._start, self.options.reading.viewpoint
        self._remember(replace(start, poses=self.table.poses(), builds=self.situation.builds, viewpoint=viewpoint))
        self.table.involve(self.situation.objects)
        self.send(events.Noted("the goal is dropped, and the table stays as it is; say what to build"))

    def stop(self) -> None:
        """Drop the question or the proposal that stands, and say so; the goal stays."""
        said = "there is nothing to stop: there is no proposal and no question"
        if self.question is not None:
            said = "the question is dropped; nothing was moved"
        elif self.situation.proposal is not None:
            said = "the proposal is dropped; nothing was moved"
        self.drop()
        self.send(events.Noted(said))

    def _go_to(self, how: str, source: list[Situation], other: list[Situation]) -> None:
        if not source:
            raise UsageError(f"there is nothing to {how}")
        other.append(self.situation)
        self.situation = source.pop().seen_from(self.options.reading.viewpoint)
        self.question = None
        moved = self.table.put_back(self.situation.poses)
        self.table.involve(self.situation.objects)
        self.send(_restored(how, self.situation, moved))

    def drop(self) -> None:
        """Forget the proposal or the question; the goal stays, so that it can be corrected."""
        self.question = None
        self.situation = replace(self.situation, proposal=None)

    # --- the table ---------------------------------------------------------------------------

    def example(self) -> Suggestion | None:
        """Return an instruction that suits the table as it stands, if there is one."""
        return suggestion(self.table, self.table.look())

    def look(self) -> events.Perceived:
        """Look at the table as it is now; no event is sent."""
        began = time.perf_counter()
        scene = self.table.look()
        return perceived_event(scene, time.perf_counter() - began, self.table)

    def another_table(self, scene: str, seed: int) -> None:
        """Replace the table by another one, "simulated" or of a scene file; the old conversation ends.

        Raises:
            UsageError, BadInput, SceneError: when there is no such scene; the old table stays.
        """
        options = replace(self.options, scene=scene, seed=seed)
        source, table = self._set_out(options)
        self.table.world.close()
        self.options, self.source, self.table = options, source, table
        self._past, self._future, self.question = [], [], None
        self._start = self.situation = self._fresh()

    def save(self, path: Path) -> None:
        """Write the table as it stands as a scene file.

        Raises:
            BadInput: when it cannot be written.
        """
        from agent.scenes.files import write_scene

        write_scene(self.source.saved(self.table, path.parent), path, "structagent chat")

    def speak_from(self, viewpoint: str) -> None:
        """Change whose left and right is meant; the goal so far is turned with it."""
        self.situation = self.situation.seen_from(viewpoint)
        self.options = replace(self.options, reading=replace(self.options.reading, viewpoint=viewpoint))

    def read_with(self, parser: str) -> None:
        """Change the parser that reads the instructions."""
        self.options = replace(self.options, reading=replace(self.options.reading, parser=parser))

    def seed_with(self, seed: int) -> None:
        """Change the seed of proposals and plans from now on; the table stays."""
        self.options = replace(self.options, seed=seed)


def _restored(how: str, situation: Situation, moved: tuple[str, ...]) -> events.Restored:
    parts = situation.spoken_parts
    lines = () if parts is None else tuple(describe_part(part, situation.names) for part in parts.parts)
    return events.Restored(how, situation.goal, situation.objects, moved, lines)
