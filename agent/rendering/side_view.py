"""Draw stacks from the side with characters, because from above only their tops are visible."""

from __future__ import annotations

from collections.abc import Sequence

from rich.text import Text

from agent.rendering.object_markers import Marker, stack_sentence, stacks
from agent.rendering.terminal_canvas import EDGE, LEAST_COLUMNS, chip, cut, style


def side_view(markers: Sequence[Marker], table: Sequence[float], columns: int, colors: int) -> list[Text]:
    """Draw stacks from the robot's side: a line per level, and the table's edge below.

    Every stack stands below its place in the picture from above of the same width.

    Args:
        markers: as for `picture`.
        table, columns, colors: as there.

    Returns:
        The stacks in words, then the lines of the picture; empty if there is no stack.
    """
    columns = max(columns, LEAST_COLUMNS)
    width = columns - 2
    lines: list[Text] = []
    for stack in stacks(markers):
        lines.append(cut(f"stacked: {stack_sentence(stack)}; from the side:", columns))
        level_of: dict[str, int] = {}
        rows: list[list[Marker | None]] = []
        for marker in stack:
            level = level_of[marker.label] = level_of.get(marker.below, -1) + 1
            if level == len(rows):
                rows.append([None] * width)
            first, last = _extent(marker, table, width)
            rows[level][first:last] = [marker] * (last - first)
        lines += [_side_row(row, colors) for row in reversed(rows)]
        lines.append(Text("▔" * columns, style(colors, EDGE)) if colors else Text("=" * columns))
    return lines


def _extent(marker: Marker, table: Sequence[float], width: int) -> tuple[int, int]:
    """Return the first column that an object covers and the one after its last; at least three columns, to fit its
    letter.
    """
    y_min, y_max = table[2:]
    ends = marker.outline[:, 1].max(), marker.outline[:, 1].min()
    left, right = (width * (y_max - y) / (y_max - y_min) for y in ends)
    first, last = round(left), round(right)
    if last - first < 3:
        first = round((left + right) / 2 - 1.5)
        last = first + 3
    first = min(max(first, 0), width - 3)
    return first, min(max(last, first + 3), width)


def _side_row(row: Sequence[Marker | None], colors: int) -> Text:
    line = Text(" ", no_wrap=True)
    column = 0
    while column < len(row):
        marker = row[column]
        end = next((k for k in range(column, len(row)) if row[k] is not marker), len(row))
        if marker is None:
            line.append(" " * (end - column))
        elif colors:
            line.append(marker.letter.center(end - column), chip(marker.color, colors))
        elif end - column < 3:
            line.append(marker.letter.ljust(end - column))
        else:
            line.append("[" + marker.letter.center(end - column - 2) + "]")
        column = end
    line.append(" ")
    return line
