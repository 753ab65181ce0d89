"""A conversation about one table: instructions, corrections, proposals, building, and the way back.

Knows nothing of terminals. Everything that happens is told as events; what stands on the table is the table's own
affair. A wish is kept as it was spoken, so that a correction can be heard in the speaker's own words.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from agent import events, steps
from agent.chat.situation import Proposal, Situation, answered, completed, meant_objects, with_a_shape
from agent.errors import DONE, INTERRUPTED, NotBuildable, UsageError, exit_code_of, one_sentence
from agent.loaded import Loaded
from agent.pipeline import RunOptions, wished
from agent.planning import worthwhile
from grounding.dialogue import Revision, revise
from grounding.parse import Question
from grounding.selection import SelectionError, mentioned
from grounding.spec import StructureSpec

if TYPE_CHECKING:
    from agent.scenes.sources import SceneSource
    from agent.scenes.table import TableScene

Listener = Callable[[events.Event], None]


class Conversation:
    """One table and what was said about it; close it, or use it in a `with` block.

    Args:
        options: as of a run; its scene is the table.
        loaded: the models.
        tell: told every event.

    Attributes:
        options: as given; the seed, the parser and the viewpoint can be changed as the conversation goes on.
        source, table: where the table comes from, and it.
        situation: where the conversation stands.
        question: what was asked and not yet answered, or `None`.
    """

    def __init__(self, options: RunOptions, loaded: Loaded, tell: Listener) -> None:
        self.options, self._loaded, self._tell = options, loaded, tell
        self.question: Question | None = None
        self._asked: Revision | None = None
        self._past: list[Situation] = []
        self._future: list[Situation] = []
        self._step, self._busy = "parse", 0.0
        self.source, self.table = self._set_out(options)
        self.situation = self._fresh()

    def __enter__(self) -> Conversation:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Ends the table's physics."""
        self.table.world.close()

    def _set_out(self, options: RunOptions) -> tuple[SceneSource, TableScene]:
        source = self._loaded.source(options.scene, options.objects, options.recorded)
        return source, source.set_out(options.seed)

    def _fresh(self) -> Situation:
        poses = self.table.poses()
        return Situation(None, self.table.names, poses, viewpoint=self.options.reading.viewpoint)

    # --- what is said ------------------------------------------------------------------------

    def say(self, text: str) -> bool:
        """An instruction or a correction, up to a proposal or a question; whether there is a proposal."""
        self._busy = 0.0
        self.question = None
        self._tell(events.Started(text, events.json_value(asdict(self.options))))
        with self._turn("parse"):
            last = self.situation.wish or StructureSpec()
            revision = revise(last, text, self._loaded.reader(self.options.reading), self.options.reading.viewpoint)
            if revision.status in ("refused", "unchanged"):
                raise NotBuildable(revision.message)
            self._hear(with_a_shape(revision, last))
            return self.question is None
        return False

    def answer(self, value: str | None) -> bool:
        """The answer to the question: one of the slot's values, `None` to leave it open; as `say`."""
        question, revision = self.question, self._asked
        if question is None or revision is None:
            raise UsageError("nothing was asked")
        self.question = None
        with self._turn("parse"):
            spec = answered(revision.spec, question.slot, value)
            # The parser's guesses have become facts, and what it thought of them is of no interest any more.
            self._hear(replace(revision, spec=spec, status="ok", message="", question=None, parse=None))
            return True
        return False

    def answer_in_words(self, text: str) -> bool:
        """An answer that is none of the options: it completes what was said before the question; as `say`.

        Words that name objects are an instruction of their own. The question stands where the words say nothing.
        """
        question, asked = self.question, self._asked
        if question is None or asked is None or mentioned(text):
            return self.say(text)
        said = revise(asked.spec, text, self._loaded.reader(self.options.reading), self.options.reading.viewpoint)
        if said.status in ("refused", "unchanged"):
            raise NotBuildable(f"{said.message}; {question.text}")
        self.question = None
        with self._turn("parse"):
            spec = completed(said.spec, asked.spec)
            still_open = question if question.slot == "shape" and spec.shape is None else said.question
            self._hear(replace(asked, spec=spec, message=said.message, question=still_open))
            return self.question is None
        return False

    def _hear(self, revision: Revision) -> None:
        began, parse, loaded = time.perf_counter(), revision.parse, self._loaded
        try:  # before anything is asked
            objects = meant_objects(revision, self.table, self.situation, loaded.encoder)
        except SelectionError as error:
            raise NotBuildable("; ".join(filter(None, (str(error), self.source.hint)))) from error
        if revision.question is not None:
            self.question, self._asked = revision.question, revision
            question = revision.question
            self._tell(events.Asked(question.slot, question.text, question.options))
            return
        if revision.message:
            self._tell(events.Noted(revision.message))
        reading = self.options.reading
        situation = Situation(revision.spec, objects, self.table.poses(), viewpoint=reading.viewpoint)
        self._tell(
            events.Parsed(
                situation.spec,
                parse.confidence if parse else {},
                parse.evidence if parse else {},
                parse.parser if parse else "",
                parse.dropped if parse else {},
                objects,
                reading.viewpoint,
                parse.prompt_sha256 if parse else None,
                loaded.reader(reading).fallback,
                time.perf_counter() - began,
                self.situation.spec if revision.kind == "edit" else None,
            )
        )
        self._propose(situation)

    # --- what is proposed --------------------------------------------------------------------

    def _propose(self, situation: Situation) -> None:
        self._step, began = "scene", time.perf_counter()
        if self.table.tidy_up():
            self._tell(events.Noted("the arm emptied its hand and folded"))
            situation = replace(situation, poses=self.table.poses())
        self.table.involve(situation.objects)
        scene = self.table.look()
        self._tell(steps.perceived(scene, time.perf_counter() - began, self.table))
        self._step = "imagination"
        options, loaded = self.options, self._loaded
        planner = loaded.planner(options.model, options.weights)
        goal = wished(situation.spec, loaded.encoder)
        imagined = steps.imagine(planner, options.model, scene, goal, options.seed, self._tell)
        self._tell(imagined)
        proposal = Proposal(situation.spec, scene, imagined, len(worthwhile(imagined.arrangements)))
        self._remember(replace(situation, proposal=proposal))
        self._tell(proposal.chosen)

    def choose(self, rank: int) -> None:
        """Makes another arrangement the one that would be built.

        Raises:
            UsageError: when there is no such arrangement.
        """
        proposal = self._proposed()
        if not 1 <= rank <= len(proposal.imagined.arrangements):
            raise UsageError(f"there is no candidate {rank}; legal: 1 to {len(proposal.imagined.arrangements)}")
        proposal = replace(proposal, rank=rank)
        self.situation = replace(self.situation, proposal=proposal)
        self._tell(proposal.chosen)

    def again(self) -> bool:
        """Imagines anew, from the next seed; as `say`."""
        if self.situation.wish is None:
            raise UsageError("nothing was asked for yet")
        self.options = replace(self.options, seed=self.options.seed + 1)
        with self._turn("scene"):
            self._propose(replace(self.situation, poses=self.table.poses()))
            return True
        return False

    def drop(self) -> None:
        """Forgets the proposal or the question; the wish stays, so that it can be corrected."""
        self.question = None
        self.situation = replace(self.situation, proposal=None)

    def _proposed(self) -> Proposal:
        proposal = self.situation.proposal
        if proposal is None:
            raise UsageError("there is no proposal; say what to build, or /again")
        return proposal

    # --- what is built -----------------------------------------------------------------------

    def plan(self) -> None:
        """Tells the plan for the chosen arrangement, and moves nothing."""
        from agent.arm.choosing import plan_structure

        proposal = self._proposed()
        rng = np.random.default_rng(self.options.seed)
        kinematics = self.table.arm.kinematics
        for event in plan_structure(proposal.scene, proposal.choice[:1], rng=rng, kinematics=kinematics):
            self._tell(replace(event, arrangement=proposal.rank - 1))

    def go(self) -> bool:
        """Builds the chosen arrangement, and judges it; whether it stands as asked."""
        proposal, options = self._proposed(), self.options
        built = False
        self._future.clear()
        try:
            with self._turn("build"):
                arrangements = proposal.choice
                if options.execute:
                    building = steps.build(
                        self.table, proposal.scene, proposal.spec, arrangements, options.seed, ranks=proposal.ranks
                    )
                else:
                    building = steps.release(self.table, proposal.scene, proposal.spec, arrangements[0])
                for _ in steps.each_of(building, self._watched):
                    pass
                built = True
        finally:
            self.situation = replace(self.situation, poses=self.table.poses(), proposal=None)
        if built:
            self._tell(events.Finished(True, DONE, self._busy))
        return built

    def _watched(self, event: events.Event) -> Iterator[events.Event]:
        if isinstance(event, events.Pictured) and event.name == steps.LAST_PICTURE:
            self._step = "check"
        self._tell(event)
        yield event

    @contextmanager
    def _turn(self, step: str) -> Iterator[None]:
        """Part of a turn: what goes wrong in it is told, and ends it."""
        self._step, began = step, time.perf_counter()
        try:
            yield
        except (Exception, KeyboardInterrupt) as error:
            code = exit_code_of(error)
            if code is None:
                raise
            self._busy += time.perf_counter() - began
            message = "interrupted" if code == INTERRUPTED else one_sentence(error)
            self._tell(events.Failed(self._step, message, code))
            self._tell(events.Finished(False, code, self._busy))
        else:
            self._busy += time.perf_counter() - began

    # --- the way back ------------------------------------------------------------------------

    def _remember(self, situation: Situation) -> None:
        self._past.append(self.situation)
        self._future.clear()
        self.situation = situation

    def undo(self) -> None:
        """Goes back by one turn: the wish, and what stands on the table.

        Raises:
            UsageError: when there is nothing to go back to.
        """
        self._go_to("undo", self._past, self._future)

    def redo(self) -> None:
        """Takes an undo back.

        Raises:
            UsageError: when nothing was undone.
        """
        self._go_to("redo", self._future, self._past)

    def _go_to(self, how: str, source: list[Situation], other: list[Situation]) -> None:
        if not source:
            raise UsageError(f"there is nothing to {how}")
        other.append(self.situation)
        self.situation = source.pop().seen_from(self.options.reading.viewpoint)
        self.question = None
        moved = self.table.put_back(self.situation.poses)
        self.table.involve(self.situation.objects)
        self._tell(events.Restored(how, self.situation.wish, self.situation.objects, moved))

    # --- the table ---------------------------------------------------------------------------

    def look(self) -> events.Perceived:
        """The table as it is now; told to nobody."""
        began = time.perf_counter()
        scene = self.table.look()
        return steps.perceived(scene, time.perf_counter() - began, self.table)

    def another_table(self, scene: str, seed: int) -> None:
        """Clears the table and sets another one, "simulated" or of a scene file; the talk about the old one ends.

        Raises:
            UsageError, BadInput, SceneError: when there is no such scene; the old table stays.
        """
        options = replace(self.options, scene=scene, seed=seed)
        source, table = self._set_out(options)
        self.table.world.close()
        self.options, self.source, self.table = options, source, table
        self._past, self._future, self.question = [], [], None
        self.situation = self._fresh()

    def save(self, path: Path) -> None:
        """Writes the table as it stands as a scene file.

        Raises:
            BadInput: when it cannot be written.
        """
        from agent.scenes.files import write_scene

        write_scene(self.source.saved(self.table, path.parent), path, "structagent chat")

    def speak_from(self, viewpoint: str) -> None:
        """Changes whose left and right is meant; the wish so far is turned with it."""
        self.situation = self.situation.seen_from(viewpoint)
        self.options = replace(self.options, reading=replace(self.options.reading, viewpoint=viewpoint))

    def read_with(self, parser: str) -> None:
        """Changes who reads the instructions."""
        self.options = replace(self.options, reading=replace(self.options.reading, parser=parser))

    def seed_with(self, seed: int) -> None:
        """Changes the seed of what is imagined and planned from now on; the table stays."""
        self.options = replace(self.options, seed=seed)
