"""What a sentence of the parsing benchmark means, and which of them ask for a structure."""

import numpy as np

from agent.evaluation.benchmark_instructions import NO_STRUCTURE, REFUSED, read_instructions, true_slots
from agent.pipeline.instruction_parser import ReadingOptions
from grounding.benchmark import Row
from grounding.spec import SLOTS, StructureSpec

OPEN = dict.fromkeys(SLOTS, (None,))


def row_of(text="a line on the left", **acceptable):
    return Row(text, OPEN | acceptable, stratum="own")


def test_of_several_readings_the_parsed_one_is_the_ground_truth():
    row = row_of(shape=("circle", None), size=("small",), rotation=(None, "south"))
    assert true_slots(row, None) == true_slots(row, StructureSpec("line", "large")) == StructureSpec("circle", "small")
    other = StructureSpec(None, "large", rotation="south")
    assert true_slots(row, other) == StructureSpec(None, "small", rotation="south")
    # A tower has no size: the parsed slots do not fit the rest, so the best values count.
    small = row_of(shape=("line", "tower"), size=("small",))
    assert true_slots(small, StructureSpec("tower")) == StructureSpec("line", "small")
    assert true_slots(row_of(shape=("tower",), size=("small",)), None) is None


def test_what_asks_for_no_structure_is_left_out_and_counted():
    rows = [
        row_of("put the cans in a circle on the left", shape=("circle",), x_position=("left",)),
        Row("what time is it", OPEN, refuse=True),
        row_of("arrange the things"),
        row_of("a small tower", shape=("tower",), size=("small",)),
    ]
    found, left_out = read_instructions(list(enumerate(rows, start=7)), ReadingOptions())
    assert left_out == {REFUSED: 1, NO_STRUCTURE: 2}
    (instruction,) = found
    assert (instruction.number, instruction.understood) == (7, True)
    assert instruction.parse.spec == instruction.ground_truth == StructureSpec("circle", x_position="left")
    assert instruction.embedding.shape == (384,)
    # Parsed slots that are right make the same sentence as the true ones, other than the instruction; or the
    # instruction is used.
    np.testing.assert_array_equal(instruction.embedding_parsed, instruction.embedding)
    ((as_said,), _) = read_instructions(list(enumerate(rows, start=7)), ReadingOptions(), as_said=True)
    np.testing.assert_array_equal(as_said.embedding_parsed, as_said.embedding)
    assert 0.3 < instruction.embedding @ as_said.embedding < 0.999
