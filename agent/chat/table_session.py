"""Hold one table, the state of the conversation about it, and its history."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Self

from agent import events
from agent.chat.greeting import Suggestion, suggestion
from agent.chat.history import History, TimelineTurn
from agent.chat.state import Situation
from agent.errors import UsageError
from agent.event_base import Event, Listener, send
from agent.pipeline.event_builders import perceived_event
from agent.pipeline.resources import ResourceCache
from agent.pipeline.run import RunOptions
from grounding.dialogue.state import Dialogue, decline, forget
from grounding.figures.names import LIKE, figure_named
from grounding.goals.description import describe_part
from grounding.parse_result import Question

if TYPE_CHECKING:
    from agent.runtime.output_ownership import OwnFolder
    from agent.scenes.sources import SceneSource
    from agent.scenes.table_scene import TableScene
    from grounding.figures.figure import Figure


class TableSession:
    """A table with its situation, history and options; close it, or use it in a `with` block.

    Args:
        options: the options of a run; its scene is the table.
        cache: the cache of models and scenes.
        listeners: receive every event.

    Attributes:
        options: as given; the seed, the parser, the viewpoint and the example can be changed during the conversation.
        listeners: as given.
        source: the source of the table.
        table: the table.
        situation: the state of the conversation.
    """

    def __init__(self, options: RunOptions, cache: ResourceCache, listeners: Sequence[Listener]) -> None:
        self.options, self._cache, self.listeners = options, cache, listeners
        self._history, self._line = History(), ""
        self._drawn: tuple[str, ...] = ()  # shapes that a language model drew and the user accepted, the latest last
        self.source, self.table = self._set_out(options)
        self._start = self.situation = self._fresh()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the table's physics simulation."""
        self.table.world.close()

    def _set_out(self, options: RunOptions) -> tuple[SceneSource, TableScene]:
        source = self._cache.source(options.scene, options.objects, options.recorded, options.arm)
        table = source.set_out(options.seed)
        table.arm.hold_by(options.hold)
        return source, table

    def _fresh(self) -> Situation:
        viewpoint = self.options.reading.viewpoint
        return Situation(Dialogue(), self.table.original_names, self.table.poses(), viewpoint=viewpoint)

    @property
    def question(self) -> Question | None:
        """Return the unanswered question, or `None`."""
        return self.situation.dialogue.question

    def _close_question(self) -> None:
        self.situation = replace(self.situation, dialogue=decline(self.situation.dialogue))

    def send(self, event: Event) -> None:
        """Send an event to every listener."""
        if isinstance(event, events.Started | events.Commanded):
            self._line = event.instruction if isinstance(event, events.Started) else event.line
        send(event, self.listeners)

    # --- history ------------------------------------------------------------------------

    def _remember(self, situation: Situation) -> None:
        turn = self._history.remember(self.situation, self._line)
        self.situation = situation
        self.send(events.Remembered(turn.number, turn.after or 0, turn.branch))

    def timeline(self) -> list[tuple[TimelineTurn, Situation]]:
        """Return all turns of this table, each with the situation in which it was left."""
        history = self._history
        return [(turn, history.situation_of(turn.number, self.situation)) for turn in history.turns]

    @property
    def turn(self) -> int:
        """Return the number of the present turn in the timeline."""
        return self._history.present

    def back_to(self, number: int) -> None:
        """Return to the state in which a turn was left: the goal, the objects, the proposal and an open question.

        Raises:
            UsageError: if there is no such turn.
        """
        last = len(self._history.turns) - 1
        if not 0 <= number <= last:
            raise UsageError(f"there is no turn {number}; legal: 0, the start, to {last}")
        if number == self._history.present:
            raise UsageError(f"turn {number} is the present one")
        self._go_to(f"turn {number}", self._history.go_to(number, self.situation), keep_question=True)

    def fork(self) -> None:
        """Let the next turn begin a branch of its own, also where it is the first to follow."""
        self.send(events.Forked(self._history.present, self._history.fork()))

    def undo(self) -> None:
        """Restore the goal and the objects as they were one turn ago.

        Raises:
            UsageError: if there is no earlier turn.
        """
        self._go_to("undo", self._history.undo(self.situation))

    @property
    def can_undo(self) -> bool:
        """Return whether there is an earlier turn."""
        return self._history.last_poses is not None

    def moved_by_undo(self) -> tuple[str, ...]:
        """Return the names of the objects that `undo` would put back.

        Raises:
            UsageError: if there is no earlier turn.
        """
        poses = self._history.last_poses
        if poses is None:
            raise UsageError("there is nothing to undo")
        return self.table.moved_since(poses)

    def redo(self) -> None:
        """Revert an undo.

        Raises:
            UsageError: if nothing was undone.
        """
        self._go_to("redo", self._history.redo(self.situation))

    def put_back(self) -> None:
        """Put every object back where it stood before the last build, and keep the goal. Can be undone.

        Raises:
            UsageError: if nothing was moved.
        """
        builds = self.situation.builds
        last = next((number for number in reversed(range(len(builds))) if builds[number].moved), None)
        if last is None:
            raise UsageError("nothing was built, so there is nothing to put back")
        now, build = self.situation, builds[last]
        standing = frozenset(n for n, part in enumerate(now.goal.parts) if part in build.stood)
        dialogue = replace(now.dialogue, standing=standing)
        before = replace(now, dialogue=dialogue, poses=build.before, proposal=None, builds=builds[:last])
        self._return_to("put back", before)

    def reset(self) -> None:
        """Restore the table of the start and drop the goal. Can be undone;
        says so where there is nothing to restore.
        """
        start = self._start
        untouched = not self.situation.asked and self.question is None and not self.situation.builds
        if untouched and not self.table.moved_since(start.poses):
            self.send(events.Noted("reset: everything is as it was at the start; say what to build"))
            return
        self._return_to("reset", replace(start, viewpoint=self.options.reading.viewpoint))

    def _return_to(self, how: str, situation: Situation) -> None:
        self._remember(situation)
        self._close_question()
        moved = self.table.put_back(situation.poses)
        self.table.involve(situation.objects)
        self.send(_restored(how, situation, moved))

    def forget(self) -> None:
        """Drop the goal and any proposal or question, and keep the table. Can be undone;
        says so where there is none.
        """
        if not self.situation.asked and self.question is None:
            self.send(events.Noted("there is no goal to drop; say what to build"))
            return
        now = self.situation
        said = forget(now.dialogue)
        self._remember(replace(now, dialogue=said, poses=self.table.poses(), proposal=None, shown=None, missing={}))
        self.table.involve(self.situation.objects)
        self.send(events.Noted("the goal is dropped, and the table stays as it is; say what to build"))

    def stop(self) -> None:
        """Drop the pending question or proposal and send a note; the goal stays."""
        said = "there is nothing to stop: there is no proposal and no question"
        if self.question is not None:
            said = "the question is dropped; nothing was moved"
        elif self.situation.proposal is not None:
            said = "the proposal is dropped; nothing was moved"
        self.drop()
        self.send(events.Noted(said))

    def _go_to(self, how: str, situation: Situation | None, keep_question: bool = False) -> None:
        if situation is None:
            raise UsageError(f"there is nothing to {how}")
        self.situation = replace(situation, viewpoint=self.options.reading.viewpoint)
        if not keep_question:
            self._close_question()
        moved = self.table.put_back(self.situation.poses)
        self.table.involve(self.situation.objects)
        self.send(replace(_restored(how, self.situation, moved), turn=self._history.present))

    def drop(self) -> None:
        """Forget the question, or else the proposal; the goal stays, so that it can be corrected."""
        if self.question is not None:
            self._close_question()
        else:
            self.situation = replace(self.situation, proposal=None)

    # --- the table ---------------------------------------------------------------------------

    def example(self) -> Suggestion | None:
        """Return an instruction that suits the present table, or `None`."""
        return suggestion(self.table, self.table.look())

    def look(self) -> events.Perceived:
        """Observe the present table without sending an event."""
        began = time.perf_counter()
        scene = self.table.look()
        return perceived_event(scene, time.perf_counter() - began, self.table)

    def another_table(self, scene: str, seed: int) -> None:
        """Replace the table by a simulated one or one from a scene file, and start a new conversation.

        Raises:
            UsageError, BadInput, SceneError: if there is no such scene; the old table stays.
        """
        options = replace(self.options, scene=scene, seed=seed)
        source, table = self._set_out(options)
        self.table.world.close()
        self.options, self.source, self.table = options, source, table
        self._history = History()
        self._start = self.situation = self._fresh()

    def save(self, path: Path) -> None:
        """Write the present table to a scene file.

        Raises:
            BadInput: if it cannot be written.
        """
        from agent.scenes.files import write_scene

        write_scene(self.source.saved(self.table, path.parent), path, "structagent chat")

    def speak_from(self, viewpoint: str) -> None:
        """Set whose left and right is meant; the present goal stays."""
        self.situation = replace(self.situation, viewpoint=viewpoint)
        self.options = replace(self.options, reading=replace(self.options.reading, viewpoint=viewpoint))

    def read_with(self, parser: str) -> None:
        """Set the parser for instructions.

        Raises:
            UsageError: for a language model where "the example" is one.
        """
        if parser == "llm" and self.options.reading.like:
            raise UsageError("/parser cannot be llm here, because /example works only without a language model")
        self.options = replace(self.options, reading=replace(self.options.reading, parser=parser))

    def show_example(self, path: Path, exact: bool, folder: OwnFolder) -> Figure:
        """Let "the example" be what a file shows; the present goal stays.

        Args:
            path: as `agent.figures.examples.read_example` takes it.
            exact: whether its places are copied to the millimetre.
            folder: of the chat, where its figure is kept.
        """
        from agent.figures.examples import keep_example

        self._check_examples()
        return self._set_example(keep_example(path, exact, folder), path, exact)

    def show_arrangement(self, text: str, folder: OwnFolder) -> Figure:
        """Let "the example" be what an arrangement of the present objects shows; the present goal stays.

        Args:
            text: as `agent.chat.commands.ARRANGEMENT` says.
            folder: of the chat, where its figure is kept.

        Raises:
            UsageError: for an arrangement that cannot be read, and with a language model.
            FigureError: for one that shows no figure.
        """
        from agent.chat.arrangement import arranged_figure
        from agent.figures.examples import keep_figure

        self._check_examples()
        like = keep_figure(arranged_figure(text, self.table.look()), folder)
        return self._set_example(like, Path(like.removeprefix(LIKE)), exact=False)

    def _check_examples(self) -> None:
        if self.options.reading.parser == "llm":
            raise UsageError("“the example” works only without a language model; choose /parser embedding first")

    def _set_example(self, like: str, path: Path, exact: bool) -> Figure:
        reading = replace(self.options.reading, like=like, like_always=False)
        self.options = replace(self.options, reading=reading, example=path, exact=exact)
        return figure_named(like)

    def seed_with(self, seed: int) -> None:
        """Set the seed of further proposals and plans; the table stays."""
        self.options = replace(self.options, seed=seed)


def _restored(how: str, situation: Situation, moved: tuple[str, ...]) -> events.Restored:
    spec = situation.spoken.plain_spec
    lines = () if spec is not None else tuple(describe_part(part, situation.names) for part in situation.spoken.parts)
    return events.Restored(how, spec, situation.objects, moved, lines)
