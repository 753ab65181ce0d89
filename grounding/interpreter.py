"""From an instruction to what is to be built with which objects, in the world's frame.

Puts a parser, the selection of objects and the speaker's viewpoint together. Positions and headings
are spoken from the robot's side, or from across the table ("opposite"): then they are turned by 180
degrees, except where they are said of the robot ("close to the robot", "on your left").
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

from grounding.foreign_languages import foreign_language
from grounding.parse_result import OBJECT, Parse, Parser, Question, shortened, unreadable
from grounding.parsers.llm_reply import IllegalReplyError, LLMError
from grounding.parsers.spelling import mend
from grounding.references.selection import AmbiguousReferenceError, SelectionError, mentioned, select_objects
from grounding.spec import StructureSpec
from grounding.unsupported import checked
from grounding.viewpoint import VIEWPOINTS, ViewpointError, turned

if TYPE_CHECKING:
    from grounding.parsers.sentence_encoder import SentenceEncoder


@dataclass(frozen=True)
class Reading:
    """What an instruction asks for.

    Attributes:
        parse: what the parser said, in the speaker's own frame.
        spec: the slots in the world's frame.
        status: "ok", "ask" or "refused"; refused also where the objects that are named are not there.
        message: why it is refused, the question, or what else must be said.
        viewpoint: whose left and right is meant, one of `VIEWPOINTS`.
        objects: names of the selected objects, or the text's words for them where there is no scene;
            `None` for all.
        seconds: how long reading took.
        fallback: why another parser than the one that was asked for spoke, or empty.
        question: what has to be known before building, with status "ask".
    """

    parse: Parse
    spec: StructureSpec
    status: str
    message: str
    viewpoint: str
    objects: tuple[str, ...] | None
    seconds: float
    fallback: str = ""
    question: Question | None = None

    def to_dict(self) -> dict[str, Any]:
        """The row of `structagent parse --json`."""
        parse = self.parse
        question = self.question
        return {
            "text": parse.text,
            "spec": self.spec.to_dict() | {"objects": None if self.objects is None else list(self.objects)},
            "status": self.status,
            "message": self.message,
            "question": {"slot": question.slot, "options": list(question.options)} if question else None,
            "confidence": {slot: round(share, 4) for slot, share in parse.confidence.items()},
            "evidence": {slot: " ".join(words) for slot, words in parse.evidence.items()},
            "dropped": dict(parse.dropped),
            "parser": parse.parser,
            "prompt_sha256": parse.prompt_sha256,
            "fallback": self.fallback,
            "viewpoint": self.viewpoint,
            "seconds": round(self.seconds, 4),
        }


class Reader:
    """Reads instructions with one parser, and with another when that one cannot be used.

    Args:
        parser: makes the parser that is asked for; an `LLMError` counts as "cannot be used", for good, and an
            `IllegalReplyError` for the one text.
        fallback: makes the one that speaks instead; `None` lets the error out.
        viewpoint: one of `VIEWPOINTS`.
        encoder: finds what nouns mean that the selection's tables do not know; `None` does without.

    Raises:
        ViewpointError: for another viewpoint.
    """

    def __init__(
        self,
        parser: Callable[[], Parser],
        fallback: Callable[[], Parser] | None = None,
        viewpoint: str = "robot",
        encoder: SentenceEncoder | None = None,
    ) -> None:
        if viewpoint not in VIEWPOINTS:
            raise ViewpointError(
                f"there is no viewpoint {viewpoint!r}; legal values: {', '.join(VIEWPOINTS)}"
            )
        self.viewpoint = viewpoint
        self._make_parser, self._make_fallback = parser, fallback
        self._encoder = encoder
        self._parser: Parser | None = None
        self._substitute: Parser | None = None
        self.fallback = ""

    @property
    def parser(self) -> Parser:
        """The parser that speaks at present."""
        if self._parser is None:
            try:
                self._parser = self._make_parser()
            except LLMError as error:
                self._parser = self._fall_back(error)
        return self._parser

    def read(self, text: str, names: Sequence[str] | None = None) -> Reading:
        """What one instruction asks for; `names` are those of the scene's objects, where there is a scene."""
        return self.read_many([text], names)[0]

    def read_many(self, texts: Sequence[str], names: Sequence[str] | None = None) -> list[Reading]:
        """What each of many instructions asks for; together they are read faster."""
        _ = self.parser  # loading it is no reading time
        started = time.perf_counter()
        heard = self._heard(texts)
        seconds = (time.perf_counter() - started) / max(1, len(texts))
        return [self._reading(parse, names, seconds, fallback) for parse, fallback in heard]

    @property
    def name(self) -> str:
        """The name of the parser that speaks at present: a reader can stand in for it."""
        return self.parser.name

    def parse(self, text: str) -> Parse:
        """What the parser says of one instruction."""
        return self.parse_batch([text])[0]

    def parse_batch(self, texts: Sequence[str]) -> list[Parse]:
        """Parse each of many instructions, and refuse what no parser was taught.

        Falls back where the parser cannot be used. Text that is not English is refused before any parser sees it, and
        what the slots cannot hold after.
        """
        return [parse for parse, _ in self._heard(texts)]

    def _heard(self, texts: Sequence[str]) -> list[tuple[Parse, str]]:
        """As `parse_batch`, each with why another parser than the one that was asked for spoke, or ""."""
        foreign = [None if not text.strip() else foreign_language(text, partial(self._mended, text)) for text in texts]
        english = [text for text, language in zip(texts, foreign, strict=True) if language is None]
        answers = iter(self._answers(english))
        heard = []
        for text, language in zip(texts, foreign, strict=True):
            if language:
                heard.append((unreadable(text, _not_english(text, language), self.name), self.fallback))
            else:
                parse, fallback = next(answers)
                heard.append((checked(parse, partial(self._mended, text)), fallback))
        return heard

    def _answers(self, texts: Sequence[str]) -> list[tuple[Parse, str]]:
        """What the parser says of texts in English, or the other one where it cannot, with the reason."""
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
        """The text without typing errors, as far as the encoder knows words."""
        return mend(text, self._encoder.whole_words).text if self._encoder is not None else text

    def _fall_back(self, error: LLMError) -> Parser:
        parser = self._other(error)
        self.fallback = f"the LLM cannot be used ({error}); the {parser.name} parser read this"
        return parser

    def _other(self, error: LLMError) -> Parser:
        """The parser that speaks instead; where there is none, `error` is raised."""
        if self._make_fallback is None:
            raise error
        if self._substitute is None:
            self._substitute = self._make_fallback()
        return self._substitute

    def _reading(self, parse: Parse, names: Sequence[str] | None, seconds: float, fallback: str) -> Reading:
        started = time.perf_counter()
        status, message, objects, question = parse.status, parse.message, None, parse.question
        if status != "refused":
            if names is None:
                objects = mentioned(parse.text) or None
            else:
                try:
                    selection = select_objects(parse.text, names, self._encoder)
                    objects = tuple(names[i] for i in selection.indices)
                    message = "; ".join(filter(None, (message, *selection.notes)))
                except AmbiguousReferenceError as doubt:
                    status, message = "ask", str(doubt)
                    question = Question(OBJECT, message, tuple(names[i] for i in doubt.indices))
                except SelectionError as error:
                    status, message, question = "refused", str(error), None
        return Reading(
            parse,
            turned(parse) if self.viewpoint == "opposite" else parse.spec,
            status,
            message,
            self.viewpoint,
            objects,
            seconds + time.perf_counter() - started,
            fallback,
            question,
        )


def _not_english(text: str, language: str) -> str:
    return f"{shortened(text)!r} seems to be in {language}: say it in English, the only language that is understood"
