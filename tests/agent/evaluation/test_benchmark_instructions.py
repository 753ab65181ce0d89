"""What a sentence of the parsing benchmark means, and which of them ask for a structure."""

import numpy as np

from agent.evaluation.benchmark_instructions import NO_WISH, REFUSED, meaning, understood
from agent.pipeline.instruction_parser import ReadingOptions
from grounding.benchmark import Row
from grounding.spec import SLOTS, StructureSpec

OPEN = {slot: (None,) for slot in SLOTS}


def row_of(text="a line on the left", **acceptable):
    return Row(text, OPEN | acceptable, stratum="own")


def test_of_several_readings_the_one_that_was_heard_is_meant():
    row = row_of(shape=("circle", None), size=("small",), rotation=(None, "south"))
    assert meaning(row, None) == meaning(row, StructureSpec("line", "large")) == StructureSpec("circle", "small")
    other = StructureSpec(None, "large", rotation="south")
    assert meaning(row, other) == StructureSpec(None, "small", rotation="south")
    # A tower has no size: what was heard does not go with the rest, so the best values count.
    small = row_of(shape=("line", "tower"), size=("small",))
    assert meaning(small, StructureSpec("tower")) == StructureSpec("line", "small")
    assert meaning(row_of(shape=("tower",), size=("small",)), None) is None


def test_what_asks_for_no_structure_is_left_out_and_counted():
    rows = [
        row_of("put the cans in a circle on the left", shape=("circle",), x_position=("left",)),
        Row("what time is it", OPEN, refuse=True),
        row_of("arrange the things"),
        row_of("a small tower", shape=("tower",), size=("small",)),
    ]
    found, left_out = understood(list(enumerate(rows, start=7)), ReadingOptions())
    assert left_out == {REFUSED: 1, NO_WISH: 2}
    (instruction,) = found
    assert (instruction.number, instruction.understood) == (7, True)
    assert instruction.parse.spec == instruction.meant == StructureSpec("circle", x_position="left")
    assert instruction.embedding.shape == (384,)
    # What was heard right is said as the slots are, in other words than the instruction; or else as it was said.
    np.testing.assert_array_equal(instruction.embedding_heard, instruction.embedding)
    ((as_said,), _) = understood(list(enumerate(rows, start=7)), ReadingOptions(), as_said=True)
    np.testing.assert_array_equal(as_said.embedding_heard, as_said.embedding)
    assert 0.3 < instruction.embedding @ as_said.embedding < 0.999
