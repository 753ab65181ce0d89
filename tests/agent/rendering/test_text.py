"""Tables fit their width, and lose nothing by it."""

import io
import re

import pytest

from agent.rendering.text import COLUMNS, aligned, columns_of

RATES = [
    ["parser", "data", "n", "exact", "95 %", *(f"share of part {n}" for n in range(14))],
    ["embedding", "templated", "12345", "100.0", "99.9 to 100.0", *(f"{n}.25" for n in range(100, 114))],
]
FAILURES = [("failed", "code", "why"), ("row-1", "3", "the instruction names 'mug'; there is only: " + "bowl, " * 40)]
TOPICS = [
    ("topic", "type", "messages", "a second"),
    ("/camera/aligned_depth_to_color/camera_info/" + "a_long_part/" * 9, "sensor_msgs/CameraInfo", "6", "12.0"),
]
ONE_WORD = [("name", "value"), ("x" * 300, "y" * 300)]


def letters(text: str) -> str:
    return "".join(sorted(re.sub(r"\s", "", text)))


@pytest.mark.parametrize("width", [COLUMNS, 80])
@pytest.mark.parametrize(("rows", "left"), [(RATES, 2), (FAILURES, None), (TOPICS, 2), (ONE_WORD, None), (ONE_WORD, 1)])
def test_a_wide_table_fits_and_keeps_every_cell(rows, left, width):
    text = aligned(rows, left, width)
    if (rows, left) != (ONE_WORD, 1):  # whose number has no place to be broken
        assert max(map(len, text.splitlines())) <= width
    once = "".join(cell for row in rows for cell in row)
    repeated = "".join(cell for row in rows for cell in row[: left or 0]) * text.count("\n\n")
    assert letters(text) == letters(once + repeated)


def test_numbers_that_do_not_fit_go_below_with_their_names():
    blocks = aligned(RATES, 2).split("\n\n")
    assert len(blocks) == 2 and all("embedding  templated" in block for block in blocks)
    assert "99.9 to 100.0" in blocks[0] and "113.25" in blocks[1]  # no number is broken


def test_a_table_that_fits_is_on_one_line_each():
    assert aligned([("a", "bb"), ("ccc", "d")], 1) == "a    bb\nccc   d"


def test_lines_of_a_cell_begin_below_each_other():
    first, *more = aligned(FAILURES).splitlines()[1:]
    place = first.index("the instruction")
    assert more and all(line[:place].isspace() and not line[place].isspace() for line in more)


def test_what_is_no_terminal_has_the_full_width():
    assert columns_of(io.StringIO()) == COLUMNS
