"""The colour of each object, the same in every picture: in the report, on the page, and in the terminal."""

from __future__ import annotations

RGB = tuple[int, int, int]  # each 0 to 255

# One colour per object, told apart by people who see few colours too (Okabe and Ito, without black and yellow).
COLORS = ((0, 114, 178), (213, 94, 0), (0, 158, 115), (204, 121, 167), (86, 180, 233), (230, 159, 0), (110, 84, 60))
FAINT = (158, 152, 144)  # what takes no part, in the terminal


def color_of(index: int) -> RGB:
    """The colour (RGB) in which object `index` is drawn."""
    return COLORS[index % len(COLORS)]
