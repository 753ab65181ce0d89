"""A conversation about one table: instructions, corrections, proposals, building, and the way back.

Knows nothing of terminals. Everything that happens is told as events; what stands on the table is the table's own
affair. A wish is kept as it was spoken, so that a correction can be heard in the speaker's own words.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from agent import events
from agent.arm.events import Planned
from agent.chat.answers import answer, unanswerable
from agent.chat.greeting import Suggestion, suggestion
from agent.chat.knowledge import Knowledge
from agent.chat.participants import Taking, UnclearObjectError, meant_objects
from agent.chat.state import Build, Proposal, Situation, answered, completed, with_a_shape
from agent.errors import DONE, INTERRUPTED, NotBuildable, PartlyDone, UsageError, exit_code_of, one_sentence
from agent.pipeline import steps
from agent.pipeline.candidates import worthwhile
from agent.pipeline.resources import Loaded
from agent.pipeline.run import RunOptions, wished
from grounding.dialogue.acts import Act
from grounding.dialogue.revise import Revision
from grounding.parse_result import OBJECT, REFUSALS, Question
from grounding.references.selection import SelectionError, select_objects
from grounding.spec import StructureSpec

if TYPE_CHECKING:
    from agent.scenes.sources import SceneSource
    from agent.scenes.table_scene import TableScene

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
        # What was said before a question, and who took part before it; `None` for those of the situation.
        self._asked: tuple[Revision, Taking | None] | None = None
        self._unclear = ""  # the words of an object that is asked about
        self._resolved: dict[str, str] = {}  # such words -> the object that an answer said they mean
        self._past: list[Situation] = []
        self._future: list[Situation] = []
        self._step, self._busy, self._trouble = "parse", 0.0, ""
        self.source, self.table = self._set_out(options)
        self._start = self.situation = self._fresh()

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
        self._resolved = {}
        self._tell(events.Started(text, events.json_value(asdict(self.options))))
        with self._turn("parse"):
            last = self.situation.wish or StructureSpec()
            revision = self._revised(last, text)
            if revision.status in ("refused", "unchanged"):
                raise NotBuildable(revision.message)
            self._hear(with_a_shape(revision, last))
            return self.question is None
        return False

    def _revised(self, last: StructureSpec, text: str) -> Revision:
        reading = self.options.reading
        return self._loaded.interpreter(reading).revise(last, text, self.situation.stands)

    def answer(self, value: str | None) -> bool:
        """The answer to the question: one of the slot's values, `None` to leave it open; as `say`."""
        question, asked = self.question, self._asked
        if question is None or asked is None:
            raise UsageError("nothing was asked")
        self.question = None
        revision, objects = asked
        with self._turn("parse"):
            if question.slot == OBJECT:
                self._resolved[self._unclear] = value or question.options[0]
                self._hear(revision, objects)
                return self.question is None
            spec = answered(revision.spec, question.slot, value)
            # The parser's guesses have become facts, and what it thought of them is of no interest any more.
            revision = replace(revision, spec=spec, status="ok", message="", question=None, parse=None)
            self._hear(revision.with_objects_of(None), objects)
            return True
        self.question, self._asked = question, asked  # it stands where the answer cannot be carried out
        return False

    def answer_in_words(self, text: str) -> bool:
        """An answer that is none of the options: it completes what was said before the question; as `say`.

        The objects stay those of what was said before, unless the answer adds to them or changes them. The question
        stands where the words say nothing, or what cannot be done; a whole instruction takes its place.
        """
        question, asked = self.question, self._asked
        if question is None or asked is None:
            return self.say(text)
        if question.slot == OBJECT and (name := self._described(text, question.options)):
            return self.answer(name)
        revision, objects = asked
        said = self._revised(revision.spec, text)
        if said.kind == "new" and said.words:
            done = self.say(text)
            if not done and self.question is None:
                self.question, self._asked = question, asked
            return done
        if said.status in ("refused", "unchanged"):
            raise NotBuildable(f"{said.message}; {question.text}")
        spec = completed(said.spec, revision.spec)
        unanswered = question.slot == "shape" and spec.shape is None
        if unanswered or (said.kind == "edit" and said.objects_how and not said.changed):
            still_open: Question | None = question
        else:
            still_open = said.question
        self.question = None
        with self._turn("parse"):
            heard = replace(revision, spec=spec, message=said.message, question=still_open)
            self._hear(heard.with_objects_of(said if said.kind == "edit" else None), objects)
            return self.question is None
        self.question, self._asked = question, asked
        return False

    def _described(self, text: str, names: Sequence[str]) -> str | None:
        """The only one of these objects that the words describe; `None` where there is no such one."""
        referents = dict(zip(self.table.names, self.table.referents, strict=True))
        try:
            found = select_objects(text, [referents[name] for name in names], self._loaded.encoder)
        except SelectionError:
            return None
        return names[found.indices[0]] if len(found.indices) == 1 else None

    def _ask(self, question: Question, revision: Revision, among: Taking | None) -> None:
        self.question, self._asked = question, (revision, among)
        self._tell(events.Asked(question.slot, question.text, question.options))

    def _hear(self, revision: Revision, among: Taking | None = None) -> None:
        """Takes over what was said.

        Args:
            revision: it.
            among: who takes part before what it says of objects; by default those of the situation.
        """
        began, parse, loaded = time.perf_counter(), revision.parse, self._loaded
        before = self.situation
        if among is not None:
            before = replace(before, wish=revision.spec, objects=among.names, missing=among.missing)
        try:  # before anything is asked
            taking = meant_objects(revision, self.table, before, loaded.encoder, self._resolved)
        except UnclearObjectError as doubt:
            self._unclear = doubt.phrase
            self._ask(Question(OBJECT, str(doubt), doubt.names), revision, among)
            return
        except SelectionError as error:
            raise NotBuildable("; ".join(filter(None, (str(error), self.source.hint)))) from error
        if revision.question is not None:
            self._ask(revision.question, revision, taking)
            return
        for note in filter(None, (revision.message, *taking.notes)):
            self._tell(events.Noted(note))
        reading = self.options.reading
        situation = replace(
            self.situation, wish=revision.spec, objects=taking.names, poses=self.table.poses(), proposal=None,
            viewpoint=reading.viewpoint, missing=taking.missing,
        )  # fmt: skip
        self._tell(
            events.Parsed(
                situation.spec,
                parse.confidence if parse else {},
                parse.evidence if parse else {},
                parse.parser if parse else "",
                parse.dropped if parse else {},
                taking.names,
                reading.viewpoint,
                parse.prompt_sha256 if parse else None,
                loaded.interpreter(reading).fallback,
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
        self.table.missing = situation.missing
        if shortfall := steps.shortfall(self.table, "take part"):
            self._tell(events.Noted(shortfall))
        scene = self.table.look()
        self._tell(steps.perceived(scene, time.perf_counter() - began, self.table))
        self._step = "imagination"
        options, loaded = self.options, self._loaded
        planner = loaded.planner(options.model, options.weights, options.allow_unverified)
        networks = loaded.provenance(options.model, options.weights)
        for one in networks.values():
            if not one.verified:
                self._tell(events.Noted(one.card))
        goal = wished(situation.spec, loaded.encoder)
        imagined = steps.imagine(planner, options.model, scene, goal, options.seed, self._tell)
        imagined = replace(imagined, networks=networks)
        self._tell(imagined)
        proposal = Proposal(situation.spec, scene, imagined, len(worthwhile(imagined.arrangements)))
        self._remember(replace(situation, proposal=proposal, shown=proposal))
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
        self.situation = replace(self.situation, proposal=proposal, shown=proposal)
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

    def resume(self) -> bool:
        """Goes on with what was asked last and does not stand yet: proposes it on the table as it is; as `say`."""
        if self.question is not None:
            self._tell(events.Asked(self.question.slot, self.question.text, self.question.options))
            return False
        if self.situation.wish is None:
            raise UsageError("nothing was asked for yet; say what to build")
        last = self.situation.builds[-1] if self.situation.builds else None
        stands = last is not None and not last.trouble and last.moved
        if stands and (last.wish, last.objects) == (self.situation.wish, self.situation.objects):
            raise UsageError("it stands as it was asked for; say what to change, or what to build next")
        self._busy = 0.0
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
        from agent.arm.plan_selection import plan_structure

        proposal = self._proposed()
        rng = np.random.default_rng(self.options.seed)
        kinematics = self.table.arm.kinematics
        for event in plan_structure(proposal.scene, proposal.choice[:1], rng=rng, kinematics=kinematics):
            self._tell(replace(event, arrangement=proposal.rank - 1))

    def go(self) -> bool:
        """Builds the chosen arrangement, and judges it; whether it stands as asked."""
        from agent.scenes.table_scene import MOVED

        proposal, options = self._proposed(), self.options
        built, before = False, self.table.poses()
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
                if shortfall := steps.shortfall(self.table, "stand as asked"):
                    raise PartlyDone(shortfall)
                built = True
        finally:
            poses, wish, objects = self.table.poses(), self.situation.wish, self.situation.objects
            moved = tuple(name for name, pose in poses.items() if np.abs(pose - before[name]).max() > MOVED)
            build = Build(wish or StructureSpec(), objects, before, moved, "" if built else self._trouble)
            builds = (*self.situation.builds, build)
            self.situation = replace(self.situation, poses=poses, proposal=None, builds=builds)
        if built:
            self._tell(events.Finished(True, DONE, self._busy))
        return built

    def _watched(self, event: events.Event) -> Iterator[events.Event]:
        if isinstance(event, Planned) and self.situation.shown is not None:  # it need not be the one that was chosen
            self.situation = replace(self.situation, shown=replace(self.situation.shown, rank=event.arrangement + 1))
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
            message = self._trouble = "interrupted" if code == INTERRUPTED else one_sentence(error)
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

    def put_back(self) -> None:
        """Puts everything where it stood before the last build; the wish stays. Can be undone.

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
        """Puts the table back to its start, and drops the wish. Can be undone.

        Raises:
            UsageError: when everything is as at the start.
        """
        start = self._start
        if self.situation.wish is None and self.question is None and not self.situation.builds:
            raise UsageError("everything is as it was at the start; say what to build")
        self._return_to("reset", replace(start, viewpoint=self.options.reading.viewpoint))

    def _return_to(self, how: str, situation: Situation) -> None:
        self._remember(situation)
        self.question = None
        moved = self.table.put_back(situation.poses)
        self.table.involve(situation.objects)
        self._tell(events.Restored(how, situation.wish, situation.objects, moved))

    def forget(self) -> None:
        """Drops the wish, and what is proposed or asked; the table stays. Can be undone.

        Raises:
            UsageError: when there is no wish.
        """
        if self.situation.wish is None and self.question is None:
            raise UsageError("nothing is wished for; say what to build")
        self.question = None
        start, viewpoint = self._start, self.options.reading.viewpoint
        self._remember(replace(start, poses=self.table.poses(), builds=self.situation.builds, viewpoint=viewpoint))
        self.table.involve(self.situation.objects)
        self._tell(events.Noted("the wish is dropped, and the table stays as it is; say what to build"))

    def stop(self) -> None:
        """Drops the question or the proposal that stands, and says so; the wish stays."""
        said = "nothing is going on: there is no proposal and no question"
        if self.question is not None:
            said = "the question is dropped; nothing was moved"
        elif self.situation.proposal is not None:
            said = "the proposal is dropped; nothing was moved"
        self.drop()
        self._tell(events.Noted(said))

    def _go_to(self, how: str, source: list[Situation], other: list[Situation]) -> None:
        if not source:
            raise UsageError(f"there is nothing to {how}")
        other.append(self.situation)
        self.situation = source.pop().seen_from(self.options.reading.viewpoint)
        self.question = None
        moved = self.table.put_back(self.situation.poses)
        self.table.involve(self.situation.objects)
        self._tell(events.Restored(how, self.situation.wish, self.situation.objects, moved))

    # --- what is answered --------------------------------------------------------------------

    def reply(self, text: str, acts: Sequence[Act]) -> None:
        """Answers small talk and questions; what is proposed or asked stands.

        Args:
            text: what was said.
            acts: what it does; nothing for a question that is none of those that can be answered.
        """
        self._tell(events.Answered(text, answer(acts, self._known()) if acts else unanswerable(self._known())))

    def asks_for_nothing(self, text: str) -> bool:
        """Whether the parser finds no wish in a line, so that it may be a question."""
        reading = self.options.reading
        last = self.situation.wish or StructureSpec()
        revision = self._loaded.interpreter(reading).revise(last, text)
        return revision.status == "refused" and REFUSALS["idle"] in revision.message

    def _known(self) -> Knowledge:
        return Knowledge(
            self.look(), self.situation, self.question, self.example, self.table.held, self.table.fallen,
            self._loaded.encoder,
        )  # fmt: skip

    def example(self) -> Suggestion | None:
        """An instruction that suits the table as it stands, if there is one."""
        return suggestion(self.table, self.table.look())

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
        self._start = self.situation = self._fresh()

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
