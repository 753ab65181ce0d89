"""Interpret what is said, together with the objects that are there and the goal so far: the only way into language.

A proposer writes goals in the text's words, their objects are found in the scene, the verifier judges them, and two
thresholds decide: build, ask or refuse. A scene that is known later takes up the same proposals; no text is read twice.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, cached_property, partial
from typing import TYPE_CHECKING, Protocol

from grounding.candidates import added_up, checked, judged
from grounding.decide import Candidate, decide
from grounding.figures.drawings import drawings_among
from grounding.foreign_languages import foreign_language
from grounding.goals.goal import Goal
from grounding.instruction_files import looks_like_json
from grounding.interpretation import Interpretation, Objects
from grounding.language_model.first_model import Context, FirstModel
from grounding.language_model.goal_message import OpenQuestion, Turn
from grounding.language_model.goal_reply import new_drawings
from grounding.parse_result import Parse, Parser, Slots, parse_of, shortened, unreadable
from grounding.parsers.embedding import EmbeddingParser
from grounding.parsers.spelling import mend
from grounding.propose.figure_mentions import mentions_of
from grounding.propose.proposal import Proposal, WordedGoal
from grounding.propose.resolution import resolved
from grounding.propose.stand_ins import StandIns
from grounding.resolve.articles import definite_where_single
from grounding.resolve.attributes import SceneObject, scene_objects
from grounding.resolve.numbered_names import numbered_apart
from grounding.resolve.object_names import as_named
from grounding.resolve.referents import Referents
from grounding.structure_words import is_shape
from grounding.verdicts import Verdicts
from grounding.verify.named_objects import named_objects
from grounding.verify.verifier import Verifier
from grounding.viewpoint import VIEWPOINTS, ViewpointError, spoken_across

if TYPE_CHECKING:
    from grounding.language_model.goal_model import GoalModel
    from grounding.language_model.goal_reply import ModelReply
    from grounding.parsers.sentence_encoder import SentenceEncoder

MOST_CHARACTERS = 2000  # beyond, a text is no instruction of a few parts


class Proposes(Protocol):
    """A proposer of goals in a text's words: the goal network."""

    def propose(
        self, text: str, objects: Sequence[SceneObject] | None = None, before: Goal = Goal()
    ) -> tuple[WordedGoal, ...]:
        """Propose goals; see `NetworkProposer.propose`."""

    def ahead(self, asked: Iterable[tuple[str, Sequence[SceneObject] | None, Goal]]) -> None:
        """Do at once what `propose` will do for many texts; see `NetworkProposer.ahead`."""


@dataclass(frozen=True)
class _Said:
    """A text that was read, before its objects are looked up.

    Attributes:
        text: as it was given.
        heard: as the speaker's own words: where the speaker sits across the table, what is said of the robot is turned.
        slots: the five slots, or what reads them.
        worded: the proposals in the text's words.
        before: the goal so far, in the speaker's frame.
        why_not: why it cannot be read at all, or "".
        reply: what a language model made of it; `None` where none is asked, or it cannot be used.
        fallback: why the language model's answer is not used, or "".
        drawn: noun -> shape of what a language model drew before.
    """

    text: str
    heard: str
    slots: Slots
    worded: tuple[WordedGoal, ...] = ()
    before: Goal = Goal()
    why_not: str = ""
    reply: ModelReply | None = None
    fallback: str = ""
    drawn: Mapping[str, str] = field(default_factory=dict)

    @property
    def as_taught(self) -> str:
        """Return what was heard in the words of the taught shapes, as the proposer read it."""
        stand_ins = self.worded[0].stand_ins if self.worded else StandIns()
        return stand_ins.text if stand_ins.shapes else self.heard


class Interpreter:
    """An interpreter of what people say.

    Args:
        parser: makes the parser of the five slots.
        encoder: the sentence encoder, which also finds what unknown nouns mean.
        proposer: writes goals in a text's words.
        verifier: makes the verifier.
        viewpoint: one of `VIEWPOINTS`.
        model: makes a language model that is asked first, also about what is said of a goal; `None` does without.
        instead: makes the parser that reads the five slots where a language model cannot be used; `None` raises its
            errors.

    Attributes:
        encoder: as given.
        viewpoint: as given.

    Raises:
        ViewpointError: for another viewpoint.
    """

    def __init__(
        self,
        parser: Callable[[], Parser],
        encoder: SentenceEncoder,
        proposer: Proposes,
        verifier: Callable[[], Verifier],
        viewpoint: str = "robot",
        model: Callable[[], GoalModel] | None = None,
        instead: Callable[[], Parser] | None = None,
    ) -> None:
        if viewpoint not in VIEWPOINTS:
            raise ViewpointError(f"there is no viewpoint {viewpoint!r}; legal values: {', '.join(VIEWPOINTS)}")
        self.viewpoint = viewpoint
        self._make_parser, self._make_verifier = parser, verifier
        self.encoder, self._proposer = encoder, proposer
        self._model = FirstModel(model, instead)

    @cached_property
    def parser(self) -> Parser:
        """Return the parser of the five slots.

        Raises:
            LLMError: for a language model that cannot be used, where nothing reads instead.
        """
        return self._model.parser(self._make_parser)

    @cached_property
    def verifier(self) -> Verifier:
        """Return the verifier."""
        return self._make_verifier()

    @property
    def name(self) -> str:
        """Return the name of the parser of the five slots."""
        return self.parser.name

    def interpret(
        self,
        text: str,
        objects: Objects | None = None,
        before: Goal = Goal(),
        question: OpenQuestion | None = None,
        turns: Sequence[Turn] = (),
        drawn: Sequence[str] = (),
    ) -> Interpretation:
        """Interpret an instruction, or what is said about a goal.

        Args:
            text: any string.
            objects: what is there: names, or objects with what is known of them; `None` if that is not known yet
                (`Interpretation.among` takes it later).
            before: the goal so far, in the world's frame; without parts for an instruction.
            question: that is open, for a language model.
            turns: of the conversation, the oldest first, for a language model.
            drawn: the shapes that a language model drew in this conversation, and that were accepted.

        Raises:
            LLMError: for a language model that cannot be used, where nothing reads instead.
        """
        shapes = (*drawn, *(part.shape for part in before.structures))
        context = Context(self._as_spoken(before), question, tuple(turns), drawings_among(shapes))
        return self._interpreted([text], scene_objects(objects), context)[0]

    def interpret_many(self, texts: Sequence[str], objects: Objects | None = None) -> list[Interpretation]:
        """Interpret many instructions about the same objects, faster than one by one; see `interpret`."""
        return self._interpreted(texts, scene_objects(objects), Context())

    def read_ahead(self, asked: Iterable[tuple[str, Objects | None, Goal]]) -> None:
        """Let the goal network read many texts side by side, which takes less time; `interpret` takes what it read.

        Args:
            asked: texts, each with what is there and the goal so far, as `interpret` will be given them.
        """
        heard = [(text, scene_objects(objects), self._as_spoken(before)) for text, objects, before in asked]
        self._proposer.ahead(
            (self._heard(text, objects), objects, before)
            for text, objects, before in heard
            if not self._why_unreadable(text)
        )

    def _interpreted(
        self, texts: Sequence[str], objects: Sequence[SceneObject] | None, context: Context
    ) -> list[Interpretation]:
        _ = self.parser  # loading it is not part of the time
        started = time.perf_counter()
        said = self._read(texts, objects, context)
        each = (time.perf_counter() - started) / max(1, len(texts))
        return [self._decided(one, each, objects) for one in said]

    def _read(self, texts: Sequence[str], objects: Sequence[SceneObject] | None, context: Context) -> list[_Said]:
        """Read texts: the five slots, and goals in the text's words, or what a language model makes of them."""
        before = context.before
        heard = [self._heard(text, objects) for text in texts]
        why_not = [self._why_unreadable(text) for text in texts]
        if len(texts) > 1 and not self._model.is_asked:
            self._proposer.ahead((said, objects, before) for said, why in zip(heard, why_not, strict=True) if not why)
        decisive = objects is None and not before.parts and not self._model.is_asked
        slots = iter(self._slots([text for text, why in zip(heard, why_not, strict=True) if not why], decisive))
        found = []
        for text, said, why in zip(texts, heard, why_not, strict=True):
            if why:
                found.append(_Said(text, said, unreadable(text, why, self.name), before=before, why_not=why))
                continue
            read = _with_text(next(slots), text)
            reply, fallback = self._model.read(text, objects, context, self.viewpoint)
            worded = self._proposer.propose(said, objects, before) if reply is None else ()
            found.append(_Said(text, said, read, worded, before, reply=reply, fallback=fallback, drawn=context.drawn))
        return found

    def _heard(self, text: str, objects: Sequence[SceneObject] | None) -> str:
        """Return a text in the words in which it is read."""
        names = [each.name for each in objects or ()]
        said = spoken_across(text) if self.viewpoint == "opposite" else text
        return definite_where_single(as_named(numbered_apart(said, names), names), names)

    def _slots(self, texts: Sequence[str], decisive: bool) -> list[Slots]:
        """Return the five slots of texts, or what reads them: where they decide nothing, few look at them.

        Args:
            texts: as the parser reads them.
            decisive: whether they take part in what is decided.
        """
        if decisive or not isinstance(self.parser, EmbeddingParser):  # another's errors are to be raised now
            return list(self.parser.parse_batch(texts))
        return [partial(self.parser.parse, text) for text in texts]

    def _why_unreadable(self, text: str) -> str:
        """Say why a text is not read: without words, data, too long, and without a language model another language;
        "" for any other.
        """
        if not any(char.isalnum() for char in text):
            return (
                f"the instruction {'has no words' if text.strip() else 'is empty'}; say what to build, for example "
                "'a small circle'"
            )
        if looks_like_json(text):
            return f"{shortened(text)!r} is JSON, not an instruction; say what to build, for example 'a small circle'"
        if len(text) > MOST_CHARACTERS:
            return f"the instruction is too long: {len(text)} characters; legal: up to {MOST_CHARACTERS}"
        if self._model.is_asked:
            return ""  # it may know the language
        # Their names may be words of no language
        figures = [one for one in mentions_of(text, None) if is_shape(one.name)]
        language = foreign_language(StandIns.of(text, figures).text, partial(self._mended, text))
        said = "say it in English, the only language that structagent understands"
        return f"{shortened(text)!r} seems to be in {language}: {said}" if language else ""

    def _mended(self, text: str) -> str:
        """Return the text without typing errors, as far as the encoder knows words."""
        return mend(text, self.encoder.whole_words).text

    def _decided(self, said: _Said, seconds: float, objects: Sequence[SceneObject] | None) -> Interpretation:
        """Find the objects of all proposals, judge them, and decide."""
        started, chosen = time.perf_counter(), None
        names = None if objects is None else [each.name for each in objects]
        verdicts = Verdicts(said.text, said.slots, said.before, self.viewpoint, names)
        if said.why_not:
            found = verdicts.refused(said.why_not)
        elif said.reply is not None:
            proposal = self._with_objects(said.reply.goal, said, objects)
            found = verdicts.of_reply(said.reply, proposal)
            chosen = None if proposal is None else Candidate(proposal)
        else:
            proposals = self._proposals(said, objects)
            candidates = self._candidates(said, proposals, objects)
            follows, scene = bool(said.before.parts), objects is not None
            decision = decide(candidates, proposals, self.verifier.weights_of(said.before), follows, scene)
            found, chosen = verdicts.of_decision(decision, proposals), decision.chosen
        found = replace(found, fallback=said.fallback, seconds=seconds + time.perf_counter() - started)
        if found.status == "ok" and chosen is not None and chosen.proposal.worded is not None:
            found = replace(found, _among=partial(self._placed, found, said, chosen))
        new = () if said.reply is None else new_drawings(found.goal, said.drawn)
        return verdicts.of_drawings(found, new) if new else found

    def _placed(
        self, found: Interpretation, said: _Said, chosen: Candidate, objects: Objects, catalogue: bool
    ) -> Interpretation:
        """Find the objects of a goal that was decided on; see `Interpretation.among`."""
        there, words = scene_objects(objects) or (), chosen.proposal.worded
        assert words is not None  # every goal was proposed in words
        proposal = resolved(words, said.heard, there, self.encoder, catalogue, self.viewpoint == "opposite")
        known = {name: getattr(found, name) for name in ("seconds", "fallback", "probability", "by_model")}
        verdicts = Verdicts(said.text, found.slots, said.before, self.viewpoint, [each.name for each in there], known)
        placed = verdicts.of_choice(replace(chosen, proposal=proposal))
        return replace(placed, _among=partial(self._placed, found, said, chosen))

    def _with_objects(self, goal: Goal | None, said: _Said, objects: Sequence[SceneObject] | None) -> Proposal | None:
        """Return a language model's goal as a proposal; words for objects are looked up where something is there."""
        if goal is None:
            return None
        worded = WordedGoal(1.0, tuple(part.to_dict() for part in goal.parts))
        if objects is None or not any(isinstance(one, str) for one in goal.named_objects()):
            return Proposal(goal, 1.0, worded=worded)
        return resolved(worded, said.text, objects, self.encoder, opposite=self.viewpoint == "opposite")

    def candidates(
        self, text: str, objects: Objects | None = None, before: Goal = Goal()
    ) -> tuple[list[Candidate], list[Proposal]]:
        """Return what would be decided on: the goals that can be built, judged, and all proposals; see `interpret`."""
        there = scene_objects(objects)
        (said,) = self._read([text], there, Context(self._as_spoken(before)))
        proposals = self._proposals(said, there)
        return self._candidates(said, proposals, there), proposals

    def _proposals(self, said: _Said, objects: Sequence[SceneObject] | None) -> list[Proposal]:
        """Return the proposals with the objects found, those of the same goal as one, the most certain first."""
        opposite = self.viewpoint == "opposite"
        found = [resolved(one, said.heard, objects, self.encoder, opposite=opposite) for one in said.worded]
        return added_up(found, None if objects is None else len(objects))

    def _candidates(
        self, said: _Said, proposals: Sequence[Proposal], objects: Sequence[SceneObject] | None
    ) -> list[Candidate]:
        parse = None if said.before.parts or objects is not None else parse_of(said.slots)
        found = judged(said.heard, proposals, self.verifier, objects, said.before, parse)
        taught = said.as_taught
        named = named_objects(taught, Referents(objects, self.encoder, opposite=self.viewpoint == "opposite"))
        return [checked(one, taught, said.before, named, self.encoder.whole_words) for one in found]

    def _as_spoken(self, goal: Goal) -> Goal:
        return goal.turned() if self.viewpoint == "opposite" else goal


def _with_text(slots: Slots, text: str) -> Slots:
    """Return slots as those of a text that was given in other words; what reads them does so once."""
    if isinstance(slots, Parse):
        return replace(slots, text=text)
    return cache(lambda: replace(slots(), text=text))
