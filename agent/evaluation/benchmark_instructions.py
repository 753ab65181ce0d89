"""Sentences of the parsing benchmark that ask for a structure: what each means, and what a parser hears in it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from agent.evaluation.common import Row
from agent.pipeline.instruction_parser import ReadingOptions, make_interpreter
from grounding import benchmark
from grounding.corpus.grammar import sentences
from grounding.parse_result import Parse
from grounding.parsers.sentence_encoder import SentenceEncoder
from grounding.spec import SLOTS, SpecError, StructureSpec

REFUSED, NO_WISH = "must be refused", "means no structure that the slots can say"
HEARD = ("text", "meant", "heard", "status")  # what a row tells of its sentence


@dataclass(frozen=True)
class Instruction:
    """A sentence of the benchmark that is about building one structure.

    Attributes:
        number: its place in the benchmark, from which its scene follows.
        row: the benchmark's row.
        meant: its slots.
        parse: what the parser made of it.
        embedding: (384,) of what a sentence model is told when the slots are: they in the corpus's words, or the
            instruction itself.
        embedding_heard: (384,) of what it is told by the parser; the same where that is the instruction itself.
    """

    number: int
    row: benchmark.Row
    meant: StructureSpec
    parse: Parse
    embedding: np.ndarray
    embedding_heard: np.ndarray

    @property
    def understood(self) -> bool:
        """Whether the parser neither refused it nor asked back."""
        return self.parse.status == "ok"

    @property
    def heard(self) -> Row:
        """What its row tells of the sentence and how it was read, JSON-ready."""
        meant, heard = self.meant.to_dict(), self.parse.spec.to_dict()
        return {"text": self.row.text, "meant": meant, "heard": heard, "status": self.parse.status}

    def is_in(self, rows: Mapping[int, Row]) -> bool:
        """Whether it is among these rows, by number, with the same words, read in the same way."""
        row = rows.get(self.number)
        return row is not None and self.heard == {key: row[key] for key in HEARD}


def understood(
    rows: Sequence[tuple[int, benchmark.Row]], options: ReadingOptions, as_said: bool = False
) -> tuple[list[Instruction], dict[str, int]]:
    """The sentences that ask for one structure, with what was heard; and how many others there are, by reason.

    They are read one by one: in a batch, the bits of a sentence's embedding depend on what else is in it.

    Args:
        rows: rows of the benchmark with their places in it.
        options: how they are read.
        as_said: as `LanguageAsked` has it.
    """
    building = [(number, row) for number, row in rows if not row.refuse]
    left_out = {REFUSED: len(rows) - len(building), NO_WISH: 0}
    encoder = SentenceEncoder()
    interpreter = make_interpreter(options, encoder, strict=True)
    instructions = []
    for number, row in building:
        parse = interpreter.parse(row.text)
        meant = meaning(row, parse.spec if parse.status == "ok" else None)
        if meant is None or not meant.tokens():
            left_out[NO_WISH] += 1
        else:
            heard = parse.spec if parse.status == "ok" else meant
            texts = [row.text if as_said else sentences(spec)[0] for spec in (meant, heard)]
            told = [encoder.encode([text])[0] for text in texts]
            instructions.append(Instruction(number, row, meant, parse, *told))
    return instructions, left_out


def meaning(row: benchmark.Row, heard: StructureSpec | None) -> StructureSpec | None:
    """The slots that a row means: where several values are right, the one that was heard, else the best.

    `None` for values that no structure can have together.
    """
    best = {slot: row.acceptable[slot][0] for slot in SLOTS}
    said = heard.to_dict() if heard else best
    fair = {slot: said[slot] if said[slot] in row.acceptable[slot] else best[slot] for slot in SLOTS}
    for values in (fair, best):
        try:
            return StructureSpec(**values)
        except SpecError:
            continue
    return None
