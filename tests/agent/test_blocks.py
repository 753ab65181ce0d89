"""Pictures in characters: everything is where it was told, in true proportions, and readable without colour."""

import io
import subprocess
import sys
from pathlib import Path

import pytest
from rich.console import Console
from rich.text import Text

from agent.blocks import colors_of, legend, picture, side_by_side
from agent.colors import FAINT, color_of
from agent.markers import markers_of_candidate, markers_of_scene

ROOT = Path(__file__).parents[2]
TABLE = [0.0, 0.6, -0.5, 0.5]


def told_object(name, x, y, z=0.05, size=0.1, takes_part=True):
    half = size / 2
    outline = [[x - half, y - half], [x + half, y - half], [x + half, y + half], [x - half, y + half]]
    return {"name": name, "takes_part": takes_part, "position": [x, y, z], "outline": outline if size else []}


def told(*objects):
    return {"objects": list(objects), "table": TABLE}


def drawn(markers, columns=42, colors=0):
    return [line.plain for line in picture(markers, TABLE, columns, colors)]


def places(lines, letter):
    """Rows and columns where a letter stands, edge included."""
    return [(row, column) for row, line in enumerate(lines) for column, one in enumerate(line) if one == letter]


def backgrounds(line: Text, column: int) -> set[tuple[int, int, int]]:
    """The colours of a cell's halves."""
    style = line.get_style_at_offset(Console(), column)
    return {tuple(color.get_truecolor()) for color in (style.color, style.bgcolor) if color is not None}


def test_up_is_away_from_the_robot_and_left_is_left():
    lines = drawn(markers_of_scene(told(told_object("far left", 0.55, 0.45), told_object("near right", 0.05, -0.45))))
    assert len({len(line) for line in lines}) == 1 and len(lines) == 2 + 12  # 40 cells of 2.5 cm, 12 of 5 cm
    assert set(places(lines, "1")) == {(1, c) for c in (1, 2, 3, 4)} | {(2, c) for c in (1, 2, 3, 4)}
    assert set(places(lines, "2")) == {(r, c) for r in (11, 12) for c in (37, 38, 39, 40)}
    assert lines[0] == "+" + "-" * 40 + "+" and lines[-1].count("robot") == 1
    assert set("".join(lines[1:-1])) == {"|", ".", "1", "2"}


def test_color_shows_the_same_place_with_the_report_s_colours():
    lines = picture(markers_of_scene(told(told_object("mug", 0.3, 0.0, size=0.2))), TABLE, 42, 2**24)
    assert {line.cell_len for line in lines} == {42}
    inside = {(row, c) for row, line in enumerate(lines) for c in range(42) if color_of(0) in backgrounds(line, c)}
    assert inside == {(row, column) for row in range(5, 9) for column in range(17, 25)}
    assert [line.plain for line in lines][6].strip("▐▌ ") == "1"


def test_outline_is_smoothed_only_where_there_are_colours_for_it():
    circle = markers_of_scene(told(told_object("mug", 0.312, 0.006, size=0.13)))
    many, few = (
        {color for line in picture(circle, TABLE, 42, colors) for c in range(42) for color in backgrounds(line, c)}
        for colors in (2**24, 16)
    )
    assert len(many) > len(few) == 4  # the table, its edge, the object and its letter


def test_sixteen_colours_keep_seven_objects_and_the_table_apart():
    row = [told_object(str(i), 0.3, 0.42 - 0.14 * i) for i in range(7)]
    away = told_object("away", 0.1, 0.0, takes_part=False)
    out = io.StringIO()
    console = Console(file=out, force_terminal=True, color_system="standard", width=80, _environ={})
    assert colors_of(console) == 16
    for line in legend(markers_of_scene(told(*row, away)), 80, 16) + picture([], TABLE, 42, 16)[1:2]:
        console.print(line)
    codes = {code for part in out.getvalue().split("\x1b[")[1:] for code in part.split("m")[0].split(";")}
    assert len({code for code in codes if 40 <= int(code) <= 47 or 100 <= int(code) <= 107}) == 9


def test_tower_has_a_letter_for_every_object_the_top_first():
    tower = [told_object(name, 0.1 * i, 0.0) for i, name in enumerate(("can", "box", "cup"))]
    markers = markers_of_candidate(told(*tower), [[0.3, 0.2, 0.05], [0.3, 0.2, 0.25], [0.302, 0.2, 0.15]], [0.0, 0, 0])
    assert [marker.label for marker in markers] == ["can", "cup", "box"]
    for colors in (0, 2**24):
        lines = drawn(markers, colors=colors)
        box, cup, can = (places(lines, letter)[0] for letter in "231")
        assert box < cup < can and places(lines, "1") == [can] and places(lines, "3") == [cup]


def test_arrangement_turns_and_moves_what_takes_part_and_nothing_else():
    fork = told_object("fork", 0.1, 0.3) | {"outline": [[0.0, 0.28], [0.2, 0.28], [0.2, 0.32], [0.0, 0.32]]}
    plate = told_object("plate", 0.5, -0.3, takes_part=False)
    scene = told(fork, plate)
    marker = {one.label: one for one in markers_of_candidate(scene, [[0.3, -0.1, 0.1]], [1.5707963])}
    assert marker["fork"].outline.min(axis=0) == pytest.approx([0.28, -0.2], abs=1e-6)
    assert marker["fork"].outline.max(axis=0) == pytest.approx([0.32, 0.0], abs=1e-6)
    assert marker["plate"].outline.tolist() == plate["outline"]
    assert marker["plate"].faint and marker["plate"].color == FAINT and marker["plate"].letter == "a"
    assert not marker["fork"].faint and marker["fork"].color == color_of(0)
    with pytest.raises(ValueError, match="zip"):
        markers_of_candidate(scene, [[0.3, 0.1, 0.1]] * 2, [])


def test_what_is_small_or_off_the_table_still_has_its_letter():
    thin = told_object("pen", 0.3, 0.4) | {"outline": [[0.2, 0.401], [0.4, 0.401], [0.4, 0.403]]}
    dot, gone = told_object("pea", 0.3, 0.0, size=0), told_object("ball", 0.9, -0.2)
    for colors in (0, 2**24):
        lines = drawn(markers_of_scene(told(thin, dot, gone)), 12, colors)
        assert places(lines, "1") and places(lines, "2")
        assert {row for row, _ in places(lines, "3")} == {0}


def test_pictures_stand_side_by_side_as_many_as_fit():
    drawing = picture([], TABLE, 24, 0)
    captions = [["first", "a caption much longer than the picture"], ["zweite"], [Text("third", "bold")]]
    lines = [line.plain for line in side_by_side([drawing] * 3, captions, 60)]
    assert max(map(len, lines)) == 50
    assert lines[0] == drawing[0].plain + "  " + drawing[0].plain
    height = len(drawing)
    assert lines[height] == "first".ljust(26) + "zweite"
    assert lines[height + 1].rstrip() == "a caption much longer t…"
    assert lines[height + 2] == "" and lines[height + 3] == drawing[0].plain and lines[-1] == "third"
    assert len(side_by_side([drawing] * 3, captions, 10)) == 3 * (height + 1) + 3  # one below the other


def test_legend_names_every_letter_and_wraps():
    objects = [told_object(f"red cup {i + 1}", 0.3, 0.0, z=1 - i / 10) for i in range(4)]
    markers = markers_of_scene(told(*objects, told_object("banana", 0.1, 0.1, takes_part=False)))
    lines = [line.plain for line in legend(markers, 24, 0)]
    assert lines == ["1 red cup 1  2 red cup 2", "3 red cup 3  4 red cup 4", "a banana"]
    colored = legend(markers, 80, 2**24)
    assert len(colored) == 1
    assert colored[0].plain == " 1  red cup 1   2  red cup 2   3  red cup 3   4  red cup 4   a  banana"
    assert backgrounds(colored[0], 1) >= {color_of(0)}


@pytest.mark.parametrize(
    ("environment", "options", "colors"),
    [
        ({"TERM": "xterm", "COLORTERM": "truecolor"}, {"force_terminal": True}, 2**24),
        ({"TERM": "xterm-256color"}, {"force_terminal": True}, 256),
        ({"TERM": "xterm"}, {"force_terminal": True}, 16),
        ({"TERM": "dumb"}, {"force_terminal": True}, 0),
        ({"TERM": "xterm-256color", "NO_COLOR": "1"}, {"force_terminal": True}, 0),
        ({"TERM": "xterm-256color"}, {}, 0),  # a pipe
    ],
)
def test_colours_of_a_console(environment, options, colors):
    assert colors_of(Console(file=io.StringIO(), _environ=environment, **options)) == colors


def test_no_half_blocks_where_they_cannot_be_written():
    file = io.TextIOWrapper(io.BytesIO(), encoding="latin-1")
    assert colors_of(Console(file=file, force_terminal=True, color_system="truecolor", _environ={})) == 0


def test_drawing_needs_nothing_heavy():
    program = "import sys, agent.blocks, agent.markers; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=True)
    assert not {"torch", "pybullet", "scipy", "PIL", "shapely"} & set(done.stdout.split())
