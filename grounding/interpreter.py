"""Interpret an instruction together with the available objects: what to build, and with which objects.

This module combines a parser of the five slots of one structure, the reader of goals of several parts, the selection
of objects and the speaker's viewpoint. Positions and headings
are spoken from the robot's side, or from across the table ("opposite"): then they are turned by 180
degrees, except where they are said of the robot ("close to the robot", "on your left").
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING

from grounding.foreign_languages import foreign_language
from grounding.goal_network.network_reading import NetworkReading
from grounding.goal_network.second_reader import SecondReader
from grounding.goal_reading.reader import GoalReader, GoalReading, ReadsGoals
from grounding.goals.goal import Goal
from grounding.goals.parts import StructurePart
from grounding.instruction_files import looks_like_json
from grounding.interpretation import Interpretation
from grounding.parse_result import Parse, Parser, shortened, unreadable
from grounding.parsers.llm_reply import IllegalReplyError, LLMError
from grounding.parsers.spelling import mend
from grounding.references.attributes import SceneObject
from grounding.references.selection import (
    mentioned,
)
from grounding.spec import StructureSpec
from grounding.unsupported import checked
from grounding.viewpoint import VIEWPOINTS, ViewpointError, turned

if TYPE_CHECKING:
    from grounding.dialogue.revise import Revision
    from grounding.goal_network.writer import NetworkWriter
    from grounding.parsers.sentence_encoder import SentenceEncoder


class Interpreter:
    """An interpreter of instructions with one parser, and with a fallback if that parser cannot be used.

    Args:
        parser: makes the configured parser; an `LLMError` counts as "cannot be used", for good, and an
            `IllegalReplyError` for the one text.
        fallback: makes the one that is used instead; `None` raises the error.
        viewpoint: one of `VIEWPOINTS`.
        encoder: finds what nouns mean that the selection's tables do not know; `None` does without.
        goal_reader: makes the reader of goals of several parts from the grammar's; `None` for the grammar's own.
        network: makes the goal network, which reads what the grammar's reader refuses, asks about, or reads as more
            than one plain structure; `None` does without.
        corrector: makes the network that was taught corrections, which reads what is said about a goal; `None` does
            without. It needs `network` too.
        default: reads the instructions that `goal_reader` cannot read, as if there were no other interpreter; `None`
            leaves them to the grammar's reader.

    Raises:
        ViewpointError: for another viewpoint.
    """

    def __init__(
        self,
        parser: Callable[[], Parser],
        fallback: Callable[[], Parser] | None = None,
        viewpoint: str = "robot",
        encoder: SentenceEncoder | None = None,
        goal_reader: Callable[[GoalReader], ReadsGoals] | None = None,
        network: Callable[[], NetworkWriter] | None = None,
        corrector: Callable[[], NetworkWriter] | None = None,
        default: Interpreter | None = None,
    ) -> None:
        if viewpoint not in VIEWPOINTS:
            raise ViewpointError(f"there is no viewpoint {viewpoint!r}; legal values: {', '.join(VIEWPOINTS)}")
        self.viewpoint = viewpoint
        self._make_parser, self._make_fallback = parser, fallback
        self._encoder = encoder
        self._grammar = GoalReader(encoder, viewpoint == "opposite")
        self._reader = self._grammar if goal_reader is None else goal_reader(self._grammar)
        self._second = None if network is None else SecondReader(
            network, encoder, viewpoint == "opposite", corrector
        )
        self._default = default
        self._parser: Parser | None = None
        self._substitute: Parser | None = None
        self.fallback = ""

    def interpret(
        self, text: str, objects: Sequence[SceneObject | str | None] | None = None, strictly: bool = False
    ) -> Interpretation:
        """Interpret one instruction.

        Args:
            text: any string.
            objects: what is there, as for `select_objects`: names, or objects with what is known of them;
                `None` if that is not known yet (`Interpretation.among` takes it later).
            strictly: do without the goal network, which reads words that the grammar does not know.
        """
        return self.interpret_many([text], objects, strictly)[0]

    def interpret_many(
        self, texts: Sequence[str], objects: Sequence[SceneObject | str | None] | None = None, strictly: bool = False
    ) -> list[Interpretation]:
        """Interpret many instructions about the same objects, faster than one by one; see `interpret`."""
        _ = self.parser  # loading it is not part of the time
        started = time.perf_counter()
        parses = self._parses(texts)
        seconds = (time.perf_counter() - started) / max(1, len(texts))
        return [self._interpretation(parse, seconds, fallback, strictly).read(objects) for parse, fallback in parses]

    def unread(self, text: str, strictly: bool = False) -> Interpretation:
        """Parse the five slots of an instruction only; `Interpretation.read` goes on from there."""
        started = time.perf_counter()
        ((parse, fallback),) = self._parses([text])
        return self._interpretation(parse, time.perf_counter() - started, fallback, strictly)

    def revise(self, last: StructureSpec, text: str, stands: StructureSpec | None = None) -> Revision:
        """Interpret the next sentence of a conversation; see `grounding.dialogue.revise.revise`."""
        from grounding.dialogue.revise import revise

        return revise(last, text, self, self.viewpoint, stands)

    def continued(
        self, goal: Goal, text: str, objects: Sequence[SceneObject | str | None], about: int | None = None
    ) -> GoalReading:
        """Read a sentence that continues a goal: what it adds, or says anew, is in the goal that is read.

        Args:
            goal: as spoken; its objects are indices.
            text: any string.
            objects: what is there.
            about: the part of the goal that is spoken of, where that is known.
        """
        return self._grammar.read(text, objects, before=goal, about=about)

    def corrected(
        self, goal: Goal, text: str, objects: Sequence[SceneObject | str | None]
    ) -> NetworkReading | None:
        """Read what is said about a goal with the goal network; `None` where there is none.

        Args:
            goal: as spoken; its objects are indices.
            text: any string.
            objects: what is there.
        """
        return None if self._second is None else self._second.correct(goal, text, objects)

    @property
    def parser(self) -> Parser:
        """Return the parser that is used at present."""
        if self._parser is None:
            try:
                self._parser = self._make_parser()
            except LLMError as error:
                self._parser = self._fall_back(error)
        return self._parser

    @property
    def name(self) -> str:
        """Return the name of the parser that is used at present: an interpreter is itself a `Parser`."""
        return self.parser.name

    def parse(self, text: str) -> Parse:
        """Parse one instruction."""
        return self.parse_batch([text])[0]

    def parse_batch(self, texts: Sequence[str]) -> list[Parse]:
        """Parse each of many instructions, and refuse what no parser was taught.

        If the parser cannot be used, the fallback is. Text that is not English is refused before parsing, wishes that
        the slots cannot express are refused after it.
        """
        return [parse for parse, _ in self._parses(texts)]

    def _parses(self, texts: Sequence[str]) -> list[tuple[Parse, str]]:
        """Parse as `parse_batch` does; return with each the reason for the fallback, or ""."""
        refused = [self._why_unreadable(text) for text in texts]
        answers = iter(self._answers([text for text, why in zip(texts, refused, strict=True) if not why]))
        parses = []
        for text, why in zip(texts, refused, strict=True):
            if why:
                parses.append((unreadable(text, why, self.name), self.fallback))
            else:
                parse, fallback = next(answers)
                parses.append((checked(parse, partial(self._mended, text)), fallback))
        return parses

    def _why_unreadable(self, text: str) -> str:
        """Say why a text is not for a parser: data, or another language; "" for any other."""
        if looks_like_json(text):
            return f"{shortened(text)!r} is JSON, and no instruction; say what to build, as 'a small circle'"
        language = foreign_language(text, partial(self._mended, text)) if text.strip() else None
        return _not_english(text, language) if language else ""

    def _answers(self, texts: Sequence[str]) -> list[tuple[Parse, str]]:
        """Parse texts in English, with the other parser if the configured one fails, and return the reason."""
        try:
            return [(parse, self.fallback) for parse in self.parser.parse_batch(texts)]
        except IllegalReplyError as error:
            if len(texts) > 1:  # an illegal reply costs its own text and no other
                return [answer for text in texts for answer in self._answers([text])]
            parser = self._other(error)
            return [(parse, f"{error}; the {parser.name} parser read this") for parse in parser.parse_batch(texts)]
        except LLMError as error:
            self._parser = self._fall_back(error)
            return [(parse, self.fallback) for parse in self._parser.parse_batch(texts)]

    def _mended(self, text: str) -> str:
        """Return the text without typing errors, as far as the encoder knows words."""
        return mend(text, self._encoder.whole_words).text if self._encoder is not None else text

    def _fall_back(self, error: LLMError) -> Parser:
        parser = self._other(error)
        self.fallback = f"the LLM cannot be used ({error}); the {parser.name} parser read this"
        return parser

    def _other(self, error: LLMError) -> Parser:
        """Return the fallback parser; raise `error` if there is none."""
        if self._make_fallback is None:
            raise error
        if self._substitute is None:
            self._substitute = self._make_fallback()
        return self._substitute

    def _interpretation(self, parse: Parse, seconds: float, fallback: str, strictly: bool) -> Interpretation:
        """Return the interpretation of the five slots, from which the reading of goals goes on."""
        started = time.perf_counter()
        words = mentioned(parse.text) if parse.status != "refused" else ()
        spec = turned(parse) if self.viewpoint == "opposite" else parse.spec
        seconds += time.perf_counter() - started
        return Interpretation(
            parse, spec, parse.status, parse.message, self.viewpoint, words or None, seconds, fallback,
            parse.question, words=words, named=words, goal=_plain_goal(parse, spec, words), _reader=self._reader,
            _encoder=self._encoder, _second=None if strictly else self._second,
            _default=None if self._default is None else partial(self._default.unread, parse.text, strictly),
        )  # fmt: skip


def _plain_goal(parse: Parse, spec: StructureSpec, words: tuple[str, ...]) -> Goal:
    """Return the goal of one structure whose objects are not known yet."""
    return Goal((StructurePart.of(spec, words or None),)) if parse.status == "ok" else Goal()


def _not_english(text: str, language: str) -> str:
    return f"{shortened(text)!r} seems to be in {language}: say it in English, the only language that is understood"
