"""Draw the table from above with characters: two square pixels per character cell, or plain ASCII without colour.

As in the report, up is +x (away from the robot) and left is +y. Lengths in metres.
"""

from __future__ import annotations

import colorsys
from collections.abc import Mapping, Sequence

import numpy as np
from rich.color import Color
from rich.console import Console
from rich.style import Style
from rich.text import Text

from agent.rendering.object_markers import Marker
from agent.rendering.palette import COLORS, FAINT, RGB, alike, ink_on, rim_of

LEAST_COLUMNS = 12
_WOOD, EDGE = (240, 222, 188), (140, 100, 45)
# What stands for the colours of things that have none of their own; every other colour goes by its hue.
_OF_SIXTEEN = dict(zip(COLORS, (4, 1, 2, 5, 6, 3, 0), strict=True)) | {FAINT: 8, _WOOD: 7, EDGE: 3}
_BRIGHT_OF_SIXTEEN = (3, 6, 7, 9, 10, 11, 13, 14, 15)  # what black is read on
_HUES_OF_SIXTEEN = ((20, 1), (50, 3), (70, 11), (165, 2), (200, 6), (255, 4), (335, 5), (361, 1))  # up to degrees
_GRAY, _NEARLY_BLACK, _NEARLY_WHITE = 0.22, 0.25, 0.75  # saturation and values
_HATCHED = 0.65  # of the wood in every second pixel of what takes no part
_STAYS = ":"  # drawn without colour
_ROBOT = " robot "  # on the edge, where it stands
_SAMPLES = 4  # along each side of a pixel
_COVERED = 0.4  # of a pixel, from which on it is the object's: a fork is narrower than most pixels
_GAP = 2  # columns between pictures side by side


def colors_of(console: Console) -> int:
    """Return how many colours the console has for a picture: 2 ** 24, 256 or 16; 0 without colour, or without half
    blocks."""
    if console.no_color or not console.encoding.lower().startswith("utf"):
        return 0
    return {None: 0, "truecolor": 2**24, "256": 256}.get(console.color_system, 16)


def picture(markers: Sequence[Marker], table: Sequence[float], columns: int, colors: int) -> list[Text]:
    """Draw the table and its objects from above.

    Every object has its own colour; distractors are hatched, without colour drawn as colons. The letter is in the
    middle of the object; that of an object underneath another is below the other's. The letter of an object that is off
    the table is on the table's edge.

    Args:
        markers: the objects; later ones cover earlier ones.
        table: (x_min, x_max, y_min, y_max), world frame.
        columns: the width, edge included; at least `LEAST_COLUMNS` are drawn. The height follows.
        colors: as from `colors_of`; with 0, ASCII characters are drawn.

    Returns:
        One text per line, all of the same width.
    """
    x_min, x_max, y_min, y_max = table
    width = max(columns, LEAST_COLUMNS) - 2
    rows = max(1, round((x_max - x_min) / (y_max - y_min) * width / 2))  # a cell is twice as high as wide
    tall = 2 * rows if colors else rows
    scale = np.array([tall / (x_max - x_min), width / (y_max - y_min)])
    shapes = [(np.array([x_max, y_max]) - marker.outline) * scale for marker in markers]  # in pixels: rows, columns
    samples = _samples(shapes, tall, width)
    owner = _owners(samples, len(shapes))
    letters = _letters(shapes, owner, (rows, width))
    robot = round(width * y_max / (y_max - y_min) - len(_ROBOT) / 2)
    edge = {min(max(robot, 0), width - len(_ROBOT)) + place: letter for place, letter in enumerate(_ROBOT)}
    if not colors:
        return _plain(markers, owner, letters, edge)
    return _colored(markers, _pixels(markers, samples, owner, colors), letters, edge, colors)


def _pixels(markers: Sequence[Marker], samples: np.ndarray, owner: np.ndarray, colors: int) -> np.ndarray:
    """Return the colour of each pixel, (tall, width, 3)."""
    palette = np.array([*(marker.color for marker in markers), _WOOD])  # the table's number is -1, the last
    # Mixed colours smooth the outlines, where there are enough of them.
    pixels = palette[samples].mean(axis=2) if colors > 16 else palette[owner].astype(float)
    row, column = np.indices(owner.shape)
    faint = np.array([*(marker.faint for marker in markers), False])[owner]
    gaps = faint & ((row + column) % 2 == 1)
    share = _HATCHED if colors > 16 else 1.0
    pixels[gaps] = share * np.array(_WOOD) + (1 - share) * pixels[gaps]
    for number, other in _unparted(palette):
        seam = _seam(owner, number, other)
        pixels[seam] = rim_of(palette[number])
    return pixels.round().astype(int)


def _unparted(palette: np.ndarray) -> list[tuple[int, int]]:
    """Return which objects need an outline against which others, or the table (-1), because their colours are alike."""
    table = len(palette) - 1
    return [
        (number, other if other < table else -1)
        for number in range(table)
        for other in (*range(number), table)
        if alike(palette[number].tolist(), palette[other].tolist())
    ]


def _seam(owner: np.ndarray, number: int, other: int) -> np.ndarray:
    """Return the pixels of either object along the border between two objects."""
    touched = np.zeros(owner.shape, dtype=bool)
    there = owner == other
    touched[1:] |= there[:-1]
    touched[:-1] |= there[1:]
    touched[:, 1:] |= there[:, :-1]
    touched[:, :-1] |= there[:, 1:]
    return (owner == number) & touched


def _samples(shapes: Sequence[np.ndarray], tall: int, width: int) -> np.ndarray:
    """Return which shape is on top at points spread over each pixel, (tall, width, samples); -1 for the table."""
    fine = np.full((tall * _SAMPLES, width * _SAMPLES), -1)
    for index, shape in enumerate(shapes):
        corners = shape * _SAMPLES
        top, left = np.clip(np.floor(corners.min(axis=0)).astype(int), 0, fine.shape)
        bottom, right = np.clip(np.ceil(corners.max(axis=0)).astype(int), 0, fine.shape)
        inside = _inside(corners, np.arange(top, bottom) + 0.5, np.arange(left, right) + 0.5)
        fine[top:bottom, left:right][inside] = index
    pixels = fine.reshape(tall, _SAMPLES, width, _SAMPLES).swapaxes(1, 2)
    return pixels.reshape(tall, width, _SAMPLES**2)


def _owners(samples: np.ndarray, shapes: int) -> np.ndarray:
    """Return which shape each pixel shows, (tall, width); -1 for the table."""
    counts = np.array([(samples == index).sum(axis=2) for index in range(-1, shapes)])
    counts[0] = np.where(counts[0] > (1 - _COVERED) * _SAMPLES**2, _SAMPLES**2, 0)
    return counts.argmax(axis=0) - 1


def _inside(corners: np.ndarray, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """Return which points of a grid are inside a polygon (K, 2), (R, C):
    those with an odd number of sides on the left.
    """
    inside = np.zeros((len(rows), len(columns)), dtype=bool)
    for (row, column), (next_row, next_column) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        crossed = (row > rows) != (next_row > rows)
        if crossed.any():
            at = column + (rows[crossed] - row) / (next_row - row) * (next_column - column)
            inside[crossed] ^= columns > at[:, None]
    return inside


def _letters(shapes: Sequence[np.ndarray], owner: np.ndarray, size: tuple[int, int]) -> dict[tuple[int, int], int]:
    """Return the cells that hold the letters of the shapes, counted without the edge, which is at -1 and at `size`."""
    rows, width = size
    per_row = len(owner) // rows
    row, column = np.mgrid[-1 : rows + 1, -1 : width + 1].astype(float)
    edge = (row < 0) | (row == rows) | (column < 0) | (column == width)
    taken: dict[tuple[int, int], int] = {}
    pile_of: dict[int, int] = {}  # shape -> the one on top of its pile
    last: dict[int, tuple[int, int]] = {}  # pile -> the cell of its last letter
    for index in reversed(range(len(shapes))):
        middle = (shapes[index].min(axis=0) + shapes[index].max(axis=0)) / 2
        on_table = bool((middle >= 0).all() and (middle < owner.shape).all())
        covering = owner[int(middle[0]), int(middle[1])] if on_table else index
        pile = pile_of[index] = pile_of.get(covering, index)
        wanted = (last[pile][0] + 1, last[pile][1]) if pile in last else (middle[0] / per_row - 0.5, middle[1] - 0.5)
        distance = (2 * (row - wanted[0])) ** 2 + (column - wanted[1]) ** 2  # a cell is twice as high as wide
        distance[edge if on_table else ~edge] = np.inf
        for cell in taken:
            distance[cell[0] + 1, cell[1] + 1] = np.inf
        found = np.unravel_index(distance.argmin(), distance.shape)
        last[pile] = (int(found[0]) - 1, int(found[1]) - 1)
        taken[last[pile]] = index
    return taken


def _plain(
    markers: Sequence[Marker], owner: np.ndarray, letters: Mapping[tuple[int, int], int], robot: Mapping[int, str]
) -> list[Text]:
    width = owner.shape[1]
    cells = [["+", *"-" * width, "+"]]
    drawn = [*(_STAYS if marker.faint else marker.letter for marker in markers), "."]  # the table's number is -1
    cells += [["|", *(drawn[one] for one in line), "|"] for line in owner.tolist()]
    cells += [["+", *(robot.get(column, "-") for column in range(width)), "+"]]
    for (row, column), index in letters.items():
        cells[row + 1][column + 1] = markers[index].letter
    return [Text("".join(line)) for line in cells]


def _colored(
    markers: Sequence[Marker],
    pixels: np.ndarray,
    letters: Mapping[tuple[int, int], int],
    robot: Mapping[int, str],
    colors: int,
) -> list[Text]:
    rows, width = pixels.shape[0] // 2, pixels.shape[1]
    lines = []
    for row in range(-1, rows + 1):
        line = Text(no_wrap=True)
        for column in range(-1, width + 1):
            index = letters.get((row, column))
            if index is not None:
                line.append(markers[index].letter, chip(markers[index].color, colors))
            elif row == rows and column in robot:
                line.append(robot[column])
            elif row in (-1, rows) or column in (-1, width):
                line.append(_edge(row, column, rows, width), style(colors, EDGE))
            else:
                upper, lower = (tuple(pixels[2 * row + half, column].tolist()) for half in (0, 1))
                line.append(" " if upper == lower else "▀", style(colors, upper, lower))
        lines.append(line)
    return lines


def _edge(row: int, column: int, rows: int, width: int) -> str:
    """Return half a cell of edge, on the side of the table."""
    if row == -1:
        return "▗" if column == -1 else "▖" if column == width else "▄"
    if row == rows:
        return "▝" if column == -1 else "▘" if column == width else "▀"
    return "▐" if column == -1 else "▌"


def style(colors: int, front: RGB, back: RGB | None = None, bold: bool = False) -> Style:
    """Return the style of a character: its colour, the one behind it, and its weight."""
    return Style(color=_color(colors, front), bgcolor=None if back is None else _color(colors, back), bold=bold)


def _color(colors: int, rgb: RGB) -> Color:
    return Color.from_ansi(_of_sixteen(rgb)) if colors <= 16 else Color.from_rgb(*rgb)


def _of_sixteen(rgb: RGB) -> int:
    """Return the one of 16 colours that names a colour; the nearest one would be grey or brown for most."""
    if rgb in _OF_SIXTEEN:
        return _OF_SIXTEEN[rgb]
    hue, saturation, value = colorsys.rgb_to_hsv(*(part / 255 for part in rgb))
    if value < _NEARLY_BLACK:
        return 0
    if saturation < _GRAY:
        return 15 if value > _NEARLY_WHITE else 8
    return next(code for end, code in _HUES_OF_SIXTEEN if 360 * hue < end)


def chip(color: RGB, colors: int) -> Style:
    """Draw a letter on its object's colour."""
    ink = ink_on(color)
    if colors <= 16:
        bright = _of_sixteen(color) in _BRIGHT_OF_SIXTEEN
        return Style(color=Color.from_ansi(0 if bright else 15), bgcolor=_color(colors, color), bold=True)
    return style(colors, ink, color, bold=True)


def side_by_side(pictures: Sequence[list[Text]], captions: Sequence[Sequence[str | Text]], width: int) -> list[Text]:
    """Put pictures next to each other, as many as fit, with their captions below, cut to the picture's width.

    Args:
        pictures: as from `picture`.
        captions: the lines below each.
        width: of the terminal, in columns.
    """
    blocks = []
    for drawn, caption in zip(pictures, captions, strict=True):
        columns = max(line.cell_len for line in drawn)
        lines = [line.copy() for line in drawn] + [cut(line, columns) for line in caption]
        blocks.append((columns, lines))
    out: list[Text] = []
    while blocks:
        fitting, used = 1, blocks[0][0]
        while fitting < len(blocks) and used + _GAP + blocks[fitting][0] <= width:
            used += _GAP + blocks[fitting][0]
            fitting += 1
        row, blocks = blocks[:fitting], blocks[fitting:]
        out += [Text()] if out else []
        for number in range(max(len(lines) for _, lines in row)):
            line = Text(no_wrap=True)
            for column, (columns, lines) in enumerate(row):
                piece = lines[number] if number < len(lines) else Text()
                line.append_text(piece)
                if column < len(row) - 1:
                    line.append(" " * (columns - piece.cell_len + _GAP))
            out.append(line)
    return out


def cut(line: str | Text, columns: int) -> Text:
    """Cut a line to a number of columns."""
    text = line.copy() if isinstance(line, Text) else Text(line)
    text.truncate(columns, overflow="ellipsis")
    return text


def legend(markers: Sequence[Marker], width: int, colors: int) -> list[Text]:
    """List which letter is which object, in the letters' order, in lines of at most `width` columns.

    Without colour, what takes no part is in brackets.
    """
    lines = [Text(no_wrap=True)]
    for marker in sorted(markers, key=lambda marker: marker.letter):
        entry = Text()
        entry.append(f" {marker.letter} " if colors else marker.letter, chip(marker.color, colors) if colors else None)
        entry.append(f" {marker.label}", "dim" if marker.faint and colors else None)
        if marker.faint and not colors:
            entry = Text(f"({entry.plain})")
        entry = cut(entry, width)
        if lines[-1].cell_len and lines[-1].cell_len + _GAP + entry.cell_len > width:
            lines.append(Text(no_wrap=True))
        if lines[-1].cell_len:
            lines[-1].append(" " * _GAP)
        lines[-1].append_text(entry)
    return lines
