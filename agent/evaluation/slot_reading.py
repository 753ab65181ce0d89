"""Read the five slots alone: of whole readings, or with the paper's prompt for a language model."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

from agent.pipeline.instruction_parser import ReadingOptions, make_interpreter, make_slot_parser
from agent.pipeline.reading_alone import Reads
from grounding.interpretation import Interpretation, Objects
from grounding.parse_result import Parser
from grounding.parsers.sentence_encoder import SentenceEncoder


def slot_reader(options: ReadingOptions, encoder: SentenceEncoder | None = None) -> Reads:
    """Return what the five slots of instructions are measured with: the interpreter, or a language model's parser.

    Args:
        options: how to read.
        encoder: share a loaded built-in one.
    """
    if options.parser == "llm":
        return SlotReader(make_slot_parser(options), options.viewpoint)
    return make_interpreter(options, encoder, strict=True)


@dataclass(frozen=True)
class SlotReader:
    """A reader that makes no goals: it takes a parser's five slots as they are.

    Attributes:
        parser: of the five slots.
        viewpoint: whose left and right is meant.
    """

    parser: Parser
    viewpoint: str = "robot"

    @property
    def name(self) -> str:
        """Return the parser's name."""
        return self.parser.name

    def interpret_many(self, texts: Sequence[str], objects: Objects | None) -> list[Interpretation]:
        """Parse each of many texts; the objects play no part."""
        started = time.perf_counter()
        parses = self.parser.parse_batch(texts)
        each = (time.perf_counter() - started) / max(1, len(texts))
        return [Interpretation(one, one.spec, one.status, one.message, self.viewpoint, None, each) for one in parses]
