"""Select the sentences of the parsing benchmark that ask for a structure: their true slots, and a parser's reading."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from agent.evaluation.rows import Row
from agent.evaluation.slot_reading import slot_reader
from agent.pipeline.instruction_parser import ReadingOptions
from agent.pipeline.reading_alone import itself, read_alone
from grounding import benchmark
from grounding.benchmark import five_slots
from grounding.corpus.grammar import sentences
from grounding.parse_result import Parse
from grounding.parsers.sentence_encoder import SentenceEncoder
from grounding.spec import SLOTS, SpecError, StructureSpec

REFUSED, NO_STRUCTURE = "must be refused", "ask for no structure that the slots can express"
READING = ("text", "ground_truth", "parsed", "status")  # keys of what a row says of its sentence


@dataclass(frozen=True)
class Instruction:
    """A sentence of the benchmark that asks for one structure.

    Attributes:
        number: its place in the benchmark, which decides its scene.
        row: the benchmark's row.
        ground_truth: its true slots.
        parse: the parser's result.
        embedding: (384,) of the sentence that a planner gets with the true slots: these in the corpus's words, or the
            instruction itself.
        embedding_parsed: (384,) of the sentence that it gets with the parsed slots; the same if that is the instruction
            itself.
    """

    number: int
    row: benchmark.Row
    ground_truth: StructureSpec
    parse: Parse
    embedding: np.ndarray
    embedding_parsed: np.ndarray

    @property
    def understood(self) -> bool:
        """Tell whether the parser neither refused it nor asked back."""
        return self.parse.status == "ok"

    @property
    def reading(self) -> Row:
        """Return what its row says of the sentence and how it was read, JSON-ready."""
        truth, parsed = self.ground_truth.to_dict(), self.parse.spec.to_dict()
        return {"text": self.row.text, "ground_truth": truth, "parsed": parsed, "status": self.parse.status}

    def is_in(self, rows: Mapping[int, Row]) -> bool:
        """Tell whether it is among these rows, by number, with the same words, read in the same way."""
        row = rows.get(self.number)
        return row is not None and self.reading == {key: row[key] for key in READING}


def read_instructions(
    rows: Sequence[tuple[int, benchmark.Row]], options: ReadingOptions, as_said: bool = False
) -> tuple[list[Instruction], dict[str, int]]:
    """Read the sentences that ask for one structure.

    They are read one by one: in a batch, the bits of a sentence's embedding depend on what else is in it.

    Args:
        rows: rows of the benchmark with their places in it.
        options: how they are read.
        as_said: as in `LanguageConfig`.

    Returns:
        The instructions, and the number of other sentences by reason.
    """
    building = [(number, row) for number, row in rows if not row.refuse]
    left_out = {REFUSED: len(rows) - len(building), NO_STRUCTURE: 0}
    encoder = SentenceEncoder()
    reader = slot_reader(options, encoder)
    instructions = []
    for number, row in building:
        (read,) = read_alone(reader, [row.text], None, itself)  # the other sentences are read all the same
        parse = five_slots(read.parse, read.status, read.goal, read.choices)
        truth = true_slots(row, parse.spec if parse.status == "ok" else None)
        if truth is None or not truth.tokens():
            left_out[NO_STRUCTURE] += 1
        else:
            parsed = parse.spec if parse.status == "ok" else truth
            texts = [row.text if as_said else sentences(spec)[0] for spec in (truth, parsed)]
            embeddings = [encoder.encode([text])[0] for text in texts]
            instructions.append(Instruction(number, row, truth, parse, *embeddings))
    return instructions, left_out


def true_slots(row: benchmark.Row, parsed: StructureSpec | None) -> StructureSpec | None:
    """Return the true slots of a row; of several acceptable values, the parsed one if it is acceptable, otherwise the
    best.

    `None` for values that no structure can have together.
    """
    best = {slot: row.acceptable[slot][0] for slot in SLOTS}
    read = parsed.to_dict() if parsed else best
    fair = {slot: read[slot] if read[slot] in row.acceptable[slot] else best[slot] for slot in SLOTS}
    for values in (fair, best):
        try:
            return StructureSpec(**values)
        except SpecError:
            continue
    return None
