"""The one table that all clients share, and the conversation about it, which is that of a chat.

Every method but `close` and those about what is said while the arm builds is a piece of work for the thread of
`agent.mcp.worker`.
"""

from __future__ import annotations

import asyncio
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any, Literal

from agent import events
from agent.chat.commands import command_of
from agent.chat.conversation import Conversation
from agent.chat.explanations import describe_wish
from agent.chat.preloading import Preloading
from agent.chat.steering import Steering
from agent.errors import DONE, INTERRUPTED, AgentError, NotBuildable, UsageError
from agent.event_base import Event, json_value, kind_of
from agent.mcp.interjections import SaidByClients
from agent.mcp.plans import Plan, PlanLedger
from agent.mcp.quoting import quote_names, quoted
from agent.mcp.results import (
    BuildResult,
    LookResult,
    ParseResult,
    PlanOffer,
    PreviewResult,
    ProposeResult,
    ReportResult,
    SayResult,
    StopResult,
    UndoResult,
)
from agent.mcp.table_results import checked_of, checks_of, moves_of, notes_of, seen_objects
from agent.mcp.worker import Job, StoppedError
from agent.pipeline.release import release_in_physics
from agent.pipeline.resources import ResourceCache
from agent.pipeline.run import RunOptions
from agent.rendering.image_files import pictures_of, webp_of
from agent.reporting.event_text import arm_sentence
from agent.reporting.replay import write_page
from agent.reporting.run_report import RunRecord
from agent.reporting.session_log import SessionWriter
from agent.reporting.turn_records import TurnRecords
from agent.runtime.output_ownership import OwnFolder
from grounding.dialogue.acts import acts_of
from grounding.dialogue.answers import NO, YES, bare_words
from grounding.goals.description import describe_part, describe_parts

SESSION, PAGE = "session.jsonl", "report.html"
OFFERED = 3  # arrangements of a proposal that get a plan
TURNS_KEPT = 20
_ARM = (
    "planned", "plan_failed", "picked", "pick_failed", "placed", "standing_changed", "noticed", "set_aside",
    "place_failed", "stopped",
)  # fmt: skip


class SharedTable:
    """The table, its conversation and its plans; close it.

    Args:
        options: the options of a run; its scene is the table.
        folder: of the session and its page.
        cache: the cache of models and scenes; by default a new one.

    Attributes:
        plans: the plans that clients may build.
        version: a number that is another one after every change of the table or the conversation.

    Raises: as `Conversation` and `SessionWriter`.
    """

    def __init__(self, options: RunOptions, folder: Path, cache: ResourceCache | None = None) -> None:
        self.plans, self.version = PlanLedger(), 0
        self._folder, self._job, self._heard = folder, Job(""), list[Event]()
        self._said: SaidByClients | None = None  # while the arm builds
        self._cache = ResourceCache(OwnFolder(folder, "chat")) if cache is None else cache
        self._writer = SessionWriter(folder / SESSION, json_value(asdict(options)), owner="chat")
        try:
            self._turns = TurnRecords(self._writer, TURNS_KEPT)
            self._talk = Conversation(options, self._cache, [self._turns, self])
        except BaseException:
            self._writer.close()
            raise
        self._preloading = Preloading(self._cache, options)

    def preload(self) -> None:
        """Begin to load the models."""
        self._preloading.start()

    def close(self) -> None:
        """End the conversation and its physics."""
        self._preloading.join()
        self._talk.close()
        self._writer.close()

    def on_event(self, event: Event) -> None:
        """Keep what a result needs of an event, report a step of the arm, and stop the job if that was asked for."""
        if not isinstance(event, events.Previewed | events.Filmed | events.Pictured):
            self._heard.append(event)
        if self._said is not None:
            self._said.hear(event)
        if kind_of(event) in _ARM:
            self._job.on_step(self._arm_sentence(event))
        elif isinstance(event, events.Checked):
            self._job.on_step("the result is checked")
        self._job.check_stop()

    def _begin(self, job: Job) -> None:
        self._job, self._heard = job, []

    def _last(self, kind: type[Any]) -> Any:
        return next((event for event in reversed(self._heard) if isinstance(event, kind)), None)

    def _arm_sentence(self, event: Event) -> str:
        proposal = self._talk.situation.shown
        assert proposal is not None  # the arm works on a proposal alone
        return self._quoted(arm_sentence(event.to_dict(), [cloud.name for cloud in proposal.scene.objects]))

    @property
    def names(self) -> set[str]:
        """Return the names of the objects, and nouns that are more than a word: all of them come from files."""
        table = self._talk.table
        nouns = {model.category for model in table.models if not model.category.isalpha()}
        return nouns.union(table.names, table.display_names, table.original_names)

    def _options(self) -> list[str]:
        """Return the answers that the open question offers: a name as it is, names within a goal in quotes."""
        question, names = self._talk.question, self.names
        return (
            [] if question is None else [one if one in names else quote_names(one, names) for one in question.options]
        )

    def _quoted(self, sentence: str) -> str:
        return quote_names(sentence, self.names)

    # --- looking and reading -----------------------------------------------------------------------

    def look(self, job: Job) -> tuple[LookResult, bytes]:
        """Observe the table; return what is seen, and a picture as a WebP file."""
        self._begin(job)
        talk = self._talk
        seen, example, question = talk.look(), talk.example(), talk.question
        x_min, x_max, y_min, y_max = seen.table
        result = LookResult(
            objects=seen_objects(seen),
            table=(x_min, x_max, y_min, y_max),
            held=talk.table.held,
            fallen=list(talk.table.fallen),
            out_of_reach=list(talk.table.out_of_reach),
            notes=list(map(self._quoted, seen.notes)),
            asked=self._wish(),
            question=self._quoted(question.text) if question else None,
            options=self._options(),
            example=example.text if example else None,
        )
        return result, self.picture(job)

    def picture(self, job: Job) -> bytes:
        """Return a picture of the table through the camera, as a WebP file."""
        self._begin(job)
        return webp_of(self._talk.table.picture())

    def parse(self, job: Job, text: str) -> ParseResult:
        """Read a text as an instruction of its own; nothing is changed."""
        self._begin(job)
        talk, table = self._talk, self._talk.table
        names = table.original_names
        read = self._cache.interpreter(talk.options.reading).interpret(text, table.referents_of(names))
        status: Any = read.status
        return ParseResult(
            status=status,
            message=self._quoted("; ".join(filter(None, (read.message, read.fallback)))),
            options=list(read.question.options) if read.question else [],
            slots=read.spec.to_dict(),
            parts=[self._quoted(describe_part(part, names)) for part in read.goal.parts],
            objects=None if read.objects is None else list(read.objects),
            goal=json_value(read.goal.to_dict()),
            suggestions=[self._quoted(describe_parts(one.parts, names)) for one in read.suggestions],
            confidence={slot: round(share, 4) for slot, share in read.parse.confidence.items()},
        )

    # --- proposing ---------------------------------------------------------------------------------

    def propose(self, job: Job, text: str) -> tuple[ProposeResult, list[bytes]]:
        """Take a line of the conversation as a chat does: an instruction, a correction, an answer or a question.

        Returns:
            What comes of it, and a picture of the best arrangement as a WebP file if there is a proposal.

        Raises:
            UsageError: for a line that is a command.
            AgentError: if it is refused, or there is no proposal.
        """
        self._begin(job)
        talk, line = self._talk, " ".join(text.split())
        if talk.question is not None:  # an option may be sent back with the quotes in which names were told
            line = dict(zip(self._options(), talk.question.options, strict=True)).get(line, line)
        if not line:
            raise UsageError("the text is empty; say what to build")
        found = command_of(line)
        if found is not None and found[0].name == "/again":
            return self.propose_again(job)
        if found is not None:
            raise UsageError(
                f"{quoted(line)} is the command {found[0].name} of a chat; here call a tool such as undo or stop"
            )
        if talk.named(line):
            self.version += 1
            self.plans.drop_all("objects have had other names since")
            offered = talk.situation.proposal is not None
            return self._proposal("answered", self._last(events.Answered).answer, offered), []
        chosen = talk.option_of(line)
        if chosen is None and bare_words(line) in (*YES, *NO):
            raise UsageError(
                f"{line!r} does not ask for anything; call build with a plan_id to build, or stop to drop what is open"
            )
        if chosen is None and talk.replied(line):
            return self._proposal("answered", answer=self._last(events.Answered).answer), []
        self._begin_anew("another request came since")
        return self._proposed(talk.say(line) if chosen is None else talk.answer(chosen), job)

    def propose_again(self, job: Job, seed: int | None = None) -> tuple[ProposeResult, list[bytes]]:
        """Propose other arrangements of what was asked for last, the best of which differs visibly from those shown.

        Args:
            job: the job.
            seed: of the arrangements; by default the next one.

        Raises:
            UsageError: if nothing was asked for.
            AgentError: if there is no proposal.
        """
        self._begin(job)
        if not self._talk.wanted.asked and self._talk.question is None:
            raise UsageError("there is no request yet, so there is no other arrangement; call propose with a wish")
        self._begin_anew("another arrangement was asked for since")
        return self._proposed(self._talk.again(seed), job)

    def _begin_anew(self, why: str) -> None:
        """Make every plan void before something is proposed.

        Raises:
            UsageError: if the arm is not at rest.
        """
        if not self._talk.table.tidy:
            raise UsageError("the arm was stopped before it had folded; call undo, which folds it, and propose again")
        self.version += 1
        self.plans.drop_all(why)

    def _proposed(self, done: bool, job: Job) -> tuple[ProposeResult, list[bytes]]:
        """Return what a line has led to, and the picture of a proposal from above.

        Raises:
            AgentError: if it led to nothing.
        """
        if done:
            proposal = self._talk.situation.proposal
            assert proposal is not None  # a line has led to it
            pictures = [one.content for one in pictures_of(proposal.chosen) if one.name == "proposed-goal"]
            return self._proposal("proposed", offered=True), pictures
        if job.stopped:
            raise StoppedError("the proposal was stopped before it was made")
        if (failed := self._last(events.Failed)) is not None:
            raise NotBuildable(failed.message)
        return self._proposal("question"), []

    def _proposal(
        self, status: Literal["proposed", "question", "answered"], answer: str | None = None, offered: bool = False
    ) -> ProposeResult:
        question = self._talk.question
        return ProposeResult(
            status=status,
            wish=self._wish(),
            notes=list(map(self._quoted, notes_of(self._heard))),
            plans=self._offers() if offered else [],
            question=self._quoted(question.text) if question else None,
            options=self._options(),
            answer=None if answer is None else self._quoted(answer),
        )

    def _wish(self) -> str | None:
        return self._quoted(describe_wish(self._talk.situation)) if self._talk.situation.asked else None

    def _offers(self) -> list[PlanOffer]:
        talk = self._talk
        proposal = talk.situation.proposal
        assert proposal is not None  # there is one when a line has led to a proposal
        poses, offers = talk.table.poses(), []
        offered = talk.ranks[:OFFERED]
        talk.show_ranks(offered)
        for rank in offered:
            chosen = replace(proposal, rank=rank).chosen
            moves = moves_of(chosen)
            names = tuple(move.name for move in moves)
            plan = self.plans.issue(proposal.proposed, rank, self._wish() or "", names, poses)
            offers.append(PlanOffer(plan_id=plan.id, score=round(chosen.scores["total"], 4), moves=moves))
        return offers

    def _choose(self, plan: Plan) -> None:
        """Choose the arrangement of a plan.

        Raises:
            UsageError: if the proposal or the table is not what the plan was made from.
        """
        proposal = self._talk.situation.proposal
        if proposal is None or proposal.proposed is not plan.proposed or not plan.fits(self._talk.table.poses()):
            self.plans.drop(plan.id, "the table has changed since")
            self.plans.look_up(plan.id)
        self._talk.choose(plan.rank)

    def preview(self, job: Job, plan_id: str) -> tuple[PreviewResult, list[bytes]]:
        """Try a plan in physics on a copy of the table; return what comes of it, and pictures as WebP files.

        Raises:
            UsageError: for a plan that cannot be built.
        """
        self._begin(job)
        plan, talk = self.plans.look_up(plan_id), self._talk
        self._choose(plan)
        proposal = talk.situation.proposal
        assert proposal is not None  # it was chosen
        message, checked = "it stands as asked when it is released in physics", None
        pictures = [picture.content for picture in pictures_of(proposal.chosen) if picture.name == "proposed-goal"]
        try:
            for event in release_in_physics(
                talk.table, proposal.scene, proposal.wanted, proposal.arrangements_to_try[0]
            ):
                job.check_stop()
                pictures += [picture.content for picture in pictures_of(event)]
                checked = event if isinstance(event, events.Checked) else checked
        except AgentError as error:
            message = str(error)
        result = PreviewResult(
            plan_id=plan.id,
            wish=plan.wish,
            moves=moves_of(proposal.chosen),
            stands=checked is not None and checked.success,
            message=self._quoted(message),
            checks=checked_of(checked),
        )
        return result, pictures

    # --- building ----------------------------------------------------------------------------------

    def build(self, job: Job, plan_id: str) -> BuildResult:
        """Build a plan with the arm; the plan is spent, however it ends.

        Raises:
            UsageError: for a plan that cannot be built.
        """
        self._begin(job)
        talk = self._talk
        self._choose(self.plans.look_up(plan_id))
        plan = self.plans.take(plan_id)
        self.plans.drop_all(f"the table has changed: {plan_id} was built since")
        self.version += 1
        self._said = said = SaidByClients()
        steering = Steering(talk, said, job.check_stop)
        try:
            built = talk.go(on_step=job.check_stop, on_check=job.check_stop, steering=steering)
        finally:
            self._said = None
            said.close()
        failed, checked, finished = self._last(events.Failed), self._last(events.Checked), self._last(events.Finished)
        shown = talk.situation.shown
        return BuildResult(
            plan_id=plan_id,
            success=built,
            message="everything stands as asked" if failed is None else self._quoted(failed.message),
            moved=list(talk.situation.builds[-1].moved),
            stopped=failed is not None and failed.exit_code == INTERRUPTED,
            other_arrangement=shown is not None and shown.rank != plan.rank,
            wish=self._wish() or "",
            said=[event.line for event in self._heard if isinstance(event, events.Interjected)],
            unread=steering.rest(),
            steps=[self._arm_sentence(event) for event in self._heard if kind_of(event) in _ARM],
            checks=checked_of(checked),
            seconds=round(finished.seconds, 3) if finished else 0.0,
            turn=self._turns.count,
        )

    async def say(self, text: str) -> SayResult:
        """Say a line while the arm builds; return what came of it, once it is read.

        Raises:
            UsageError: if nothing is being built, or the text is empty.
        """
        line, said = self.spoken(text), self._said
        assert said is not None  # `spoken` has looked
        heard = await asyncio.wrap_future(said.say(line))
        question = self._talk.question
        told = [event for event in heard if isinstance(event, events.Interjected)]
        answers = [event.answer for event in heard if isinstance(event, events.Answered)]
        outcome: Any = told[0].outcome if told else "stops"
        return SayResult(
            outcome=outcome,
            message=self._quoted("; ".join(event.message for event in told if event.message)),
            wish=self._wish(),
            answer=self._quoted("\n".join(answers)) if answers else None,
            question=self._quoted(question.text) if question else None,
            options=self._options(),
        )

    def spoken(self, text: str) -> str:
        """Return a text as one line of what is said while the arm builds; an option comes without its quotes.

        Raises:
            UsageError: if nothing is being built, or the text is empty.
        """
        line, question = " ".join(text.split()), self._talk.question
        if self._said is None:
            raise UsageError("nothing is being built; call propose with what the person said")
        if not line:
            raise UsageError("the text is empty; pass on what the person said")
        return line if question is None else dict(zip(self._options(), question.options, strict=True)).get(line, line)

    def only_talks(self, line: str) -> bool:
        """Return whether a line that is said while the arm builds changes nothing that moves: a question, wait,
        stop.
        """
        found = command_of(line)
        return (found is not None and found[0].name in ("/stop", "/wait", "/continue")) or bool(acts_of(line))

    def stop(self, job: Job) -> StopResult:
        """Drop the proposal or the question that is pending; their plans are void."""
        self._begin(job)
        pending = self._talk.question is not None or self._talk.situation.proposal is not None
        self._talk.stop()
        if pending:
            self.version += 1
            self.plans.drop_all("stop dropped the proposal")
        return StopResult(stopped=pending, message=self._last(events.Noted).message)

    def moved_by_undo(self, job: Job) -> tuple[int, tuple[str, ...]]:
        """Return the version of the table, and the names of the objects that `undo` would put back now.

        Raises:
            UsageError: if there is nothing to undo.
        """
        self._begin(job)
        return self.version, self._talk.moved_by_undo()

    def undo(self, job: Job, version: int) -> UndoResult:
        """Revert one turn; every plan is void afterwards.

        Args:
            job: the job.
            version: that of the table for which it was allowed.

        Raises:
            UsageError: if there is nothing to undo, or the table has changed since it was allowed.
        """
        self._begin(job)
        if version != self.version:
            raise UsageError("the table has changed since you were asked; call undo again")
        self.version += 1
        self.plans.drop_all("the table has changed: a turn was undone since")
        self._talk.undo()
        return UndoResult(moved=list(self._last(events.Restored).moved), wish=self._wish())

    # --- reports -----------------------------------------------------------------------------------

    def report(self, job: Job, turn: int | None) -> ReportResult:
        """Write the page of the conversation, and return the report of a turn, by default the last one.

        Raises:
            UsageError: if there is no such turn, or it is not kept any more.
            NotWritten: if the page cannot be written.
        """
        self._begin(job)
        number = self._turns.count if turn is None else turn
        record = self.record(number)
        report = record.report
        page = write_page(self._folder / SESSION, self._folder / PAGE)
        verdict, outcome = report["verdict"], report["outcome"]
        names = [f"structagent://turns/{number}/report.json", f"structagent://turns/{number}/report.html"]
        return ReportResult(
            turn=number,
            turns=self._turns.count,
            instruction=report["instruction"],
            success=outcome["success"] if outcome["exit_code"] is not None else None,
            message=self._quoted(outcome["message"]) if outcome["exit_code"] not in (None, DONE) else None,
            checks=checks_of(verdict["checks"] if verdict else ()),
            seconds=report["seconds"],
            page=str(page.resolve()),
            resources=[*names, *(f"structagent://turns/{number}/pictures/{name}" for name in record.pictures)],
        )

    def record(self, number: int) -> RunRecord:
        """Return the record of a turn.

        Raises:
            UsageError: if there is no such turn, or it is not kept any more.
        """
        record = self._turns.turn(number) if number > 0 else None
        if record is None:
            last = self._turns.count
            legal = f"legal: {max(1, last - TURNS_KEPT + 1)} to {last}" if last else "there is no request yet"
            raise UsageError(f"there is no turn {number}; {legal}")
        return record
