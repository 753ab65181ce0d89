"""Pictures in characters: everything is where it should be, in true proportions, and readable without colour."""

import io
import subprocess
import sys
from pathlib import Path

import pytest
from rich.console import Console
from rich.text import Text

from agent.rendering.object_markers import markers_of_candidate, markers_of_scene, stack_sentence, stacks
from agent.rendering.palette import FAINT, color_of, ink_on, luma, rim_of
from agent.rendering.side_view import side_view
from agent.rendering.terminal_canvas import colors_of, legend, picture, side_by_side

ROOT = Path(__file__).parents[3]
TABLE = [0.0, 0.6, -0.5, 0.5]


def told_object(name, x, y, z=0.05, size=0.1, takes_part=True):
    half = size / 2
    outline = [[x - half, y - half], [x + half, y - half], [x + half, y + half], [x - half, y + half]]
    return {"name": name, "takes_part": takes_part, "position": [x, y, z], "outline": outline if size else []}


def run_events(*objects):
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
    lines = drawn(
        markers_of_scene(run_events(told_object("far left", 0.55, 0.45), told_object("near right", 0.05, -0.45)))
    )
    assert len({len(line) for line in lines}) == 1 and len(lines) == 2 + 12  # 40 cells of 2.5 cm, 12 of 5 cm
    assert set(places(lines, "A")) == {(1, c) for c in (1, 2, 3, 4)} | {(2, c) for c in (1, 2, 3, 4)}
    assert set(places(lines, "B")) == {(r, c) for r in (11, 12) for c in (37, 38, 39, 40)}
    assert lines[0] == "+" + "-" * 40 + "+" and lines[-1].count("robot") == 1
    assert set("".join(lines[1:-1])) == {"|", ".", "A", "B"}


def test_color_shows_the_same_place_with_the_report_s_colours():
    lines = picture(markers_of_scene(run_events(told_object("mug", 0.3, 0.0, size=0.2))), TABLE, 42, 2**24)
    assert {line.cell_len for line in lines} == {42}
    inside = {(row, c) for row, line in enumerate(lines) for c in range(42) if color_of(0) in backgrounds(line, c)}
    assert inside == {(row, column) for row in range(5, 9) for column in range(17, 25)}
    assert [line.plain for line in lines][6].strip("▐▌ ") == "A"


def test_outline_is_smoothed_only_where_there_are_colours_for_it():
    circle = markers_of_scene(run_events(told_object("mug", 0.312, 0.006, size=0.13)))
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
    for line in legend(markers_of_scene(run_events(*row, away)), 80, 16) + picture([], TABLE, 42, 16)[1:2]:
        console.print(line)
    codes = {code for part in out.getvalue().split("\x1b[")[1:] for code in part.split("m")[0].split(";")}
    assert len({code for code in codes if 40 <= int(code) <= 47 or 100 <= int(code) <= 107}) == 9


def test_tower_has_a_letter_for_every_object_the_top_first():
    tower = [told_object(name, 0.1 * i, 0.0) for i, name in enumerate(("can", "box", "cup"))]
    markers = markers_of_candidate(
        run_events(*tower), [[0.3, 0.2, 0.05], [0.3, 0.2, 0.25], [0.302, 0.2, 0.15]], [0.0, 0, 0]
    )
    assert [marker.label for marker in markers] == ["can", "cup", "box"]
    for colors in (0, 2**24):
        lines = drawn(markers, colors=colors)
        box, cup, can = (places(lines, letter)[0] for letter in "BCA")
        assert box < cup < can and places(lines, "A") == [can] and places(lines, "C") == [cup]


def test_arrangement_turns_and_moves_what_takes_part_and_nothing_else():
    fork = told_object("fork", 0.1, 0.3) | {"outline": [[0.0, 0.28], [0.2, 0.28], [0.2, 0.32], [0.0, 0.32]]}
    plate = told_object("plate", 0.5, -0.3, takes_part=False)
    scene = run_events(fork, plate)
    marker = {one.label: one for one in markers_of_candidate(scene, [[0.3, -0.1, 0.1]], [1.5707963])}
    assert marker["fork"].outline.min(axis=0) == pytest.approx([0.28, -0.2], abs=1e-6)
    assert marker["fork"].outline.max(axis=0) == pytest.approx([0.32, 0.0], abs=1e-6)
    assert marker["plate"].outline.tolist() == plate["outline"]
    assert marker["plate"].faint and marker["plate"].color == FAINT and marker["plate"].letter == "B"
    assert not marker["fork"].faint and marker["fork"].color == color_of(0)
    with pytest.raises(ValueError, match="zip"):
        markers_of_candidate(scene, [[0.3, 0.1, 0.1]] * 2, [])


@pytest.mark.parametrize(
    ("names", "letters"),
    [
        (("object 1", "object 2", "object 3"), "123"),
        (("object 1", "mug 3", "object 2"), "132"),  # the user named the third
        (("can 2", "can 1"), "21"),
        (("candle 1", "box 1", "candle 2", "box 2"), "ABCD"),  # two of them are the first of their kind
        (("plate", "cup 2", "cup 1", "fork"), "a21b"),
        (("can", "box"), "AB"),
        (("cup 12",), "C"),
    ],
)
def test_an_object_has_one_mark_whoever_takes_part(names, letters):
    """It is the number in its name, or no number at all; later observations list those first that take part."""
    objects = [told_object(name, 0.1 * k, 0.0) | {"number": k} for k, name in enumerate(names, start=1)]
    for staying in (set(), set(names[:1]), set(names)):
        seen = sorted(
            ({**one, "takes_part": one["name"] not in staying} for one in objects),
            key=lambda one: not one["takes_part"],
        )
        found = {marker.label: marker.letter for marker in markers_of_scene(run_events(*seen))}
        assert found == dict(zip(names, letters, strict=True))


def test_without_colour_what_takes_no_part_is_drawn_otherwise():
    two = [told_object("block", 0.3, 0.2, size=0.2), told_object("stone", 0.3, -0.2, size=0.2, takes_part=False)]
    markers = markers_of_scene(run_events(*two))
    text = "".join(line.plain for line in picture(markers, TABLE, 42, 0))
    assert text.count("A") > 9 and text.count("B") == 1 and text.count(":") > 9
    assert legend(markers, 80, 0)[0].plain == "A block  (B stone)"


ORANGE, BLACK, WHITE, GRAY = [230, 126, 34], [12, 12, 14], [250, 250, 246], [140, 140, 140]


def test_objects_have_their_own_colours():
    """The palette is for sessions that know no colours alone."""
    objects = [told_object("orange", 0.3, 0.2) | {"color": ORANGE}, told_object("cube", 0.3, 0.0)]
    away = told_object("can", 0.3, -0.3, takes_part=False) | {"color": BLACK}
    scene = run_events(*objects, away)
    for markers in (markers_of_scene(scene), markers_of_candidate(scene, [[0.4, 0.1, 0.05], [0.1, 0.1, 0.05]], [])):
        color = {marker.label: marker.color for marker in markers}
        assert color == {"orange": tuple(ORANGE), "cube": color_of(1), "can": tuple(BLACK)}
    lines = picture(markers_of_scene(scene), TABLE, 42, 2**24)
    shown = {color for line in lines for c in range(42) for color in backgrounds(line, c)}
    assert {tuple(ORANGE), color_of(1), tuple(BLACK)} <= shown
    chips = [backgrounds(legend(markers_of_scene(scene), 80, 2**24)[0], column) for column in (1, 13, 23)]
    assert {tuple(ORANGE), color_of(1), tuple(BLACK)} == {c for chip in chips for c in chip} - {(0, 0, 0), (255,) * 3}


def test_what_takes_no_part_is_hatched_and_a_gray_thing_that_does_is_not():
    two = [told_object("block", 0.3, 0.2, size=0.2) | {"color": GRAY}]
    two.append(told_object("stone", 0.3, -0.2, size=0.2, takes_part=False) | {"color": GRAY})
    lines = picture(markers_of_scene(run_events(*two)), TABLE, 42, 2**24)

    def inside(middle: int) -> set[tuple[int, int, int]]:
        return {color for row in (5, 8) for c in range(middle - 2, middle + 3) for color in backgrounds(lines[row], c)}

    assert inside(13) == {tuple(GRAY)}
    assert tuple(GRAY) in inside(29) and len(inside(29)) == 2


@pytest.mark.parametrize("color", [WHITE, [240, 222, 188]])  # as bright as the table, and as the table
def test_an_object_as_bright_as_the_table_has_an_outline(color):
    lines = picture(
        markers_of_scene(run_events(told_object("box", 0.3, 0.0, size=0.2) | {"color": color})), TABLE, 42, 2**24
    )
    found = {(row, c) for row, line in enumerate(lines) for c in range(42) if rim_of(color) in backgrounds(line, c)}
    assert {(5, 17), (5, 24), (8, 17), (8, 24)} <= found and not {(6, 19), (7, 22)} & found


def test_two_objects_of_one_colour_that_touch_are_parted():
    pair = [told_object(name, 0.3, y, size=0.2) | {"color": [200, 30, 30]} for name, y in (("a", 0.1), ("b", -0.1))]
    lines = picture(markers_of_scene(run_events(*pair)), TABLE, 42, 2**24)
    seam = {c for c in range(42) if rim_of((200, 30, 30)) in backgrounds(lines[6], c)}
    assert seam and seam <= {20, 21}
    alone = picture(markers_of_scene(run_events(pair[0])), TABLE, 42, 2**24)
    assert not any(rim_of((200, 30, 30)) in backgrounds(line, c) for line in alone for c in range(42))


@pytest.mark.parametrize("color", [ORANGE, BLACK, WHITE, GRAY, [30, 61, 144], [202, 169, 32]])
def test_letters_and_outlines_contrast_with_the_colour(color):
    assert abs(luma(ink_on(color)) - luma(color)) > 100 and abs(luma(rim_of(color)) - luma(color)) > 40


@pytest.mark.parametrize(
    ("color", "code"),
    [(ORANGE, 43), ([200, 30, 30], 41), ([36, 101, 45], 42), ([30, 61, 144], 44), (BLACK, 40), (WHITE, 107)],
)
def test_sixteen_colours_call_a_colour_what_people_call_it(color, code):
    out = io.StringIO()
    console = Console(file=out, force_terminal=True, color_system="standard", width=80, _environ={})
    console.print(legend(markers_of_scene(run_events(told_object("thing", 0.3, 0.0) | {"color": color})), 80, 16)[0])
    codes = {part for piece in out.getvalue().split("\x1b[")[1:] for part in piece.split("m")[0].split(";")}
    assert str(code) in codes


def test_stacks_are_reported_from_bottom_to_top():
    tower = [told_object(name, 0.1 + 0.15 * i, 0.0) for i, name in enumerate(("can", "box", "cup"))]
    apart = told_object("mug", 0.5, -0.4, takes_part=False)
    markers = markers_of_candidate(
        run_events(*tower, apart), [[0.3, 0.2, 0.05], [0.3, 0.2, 0.25], [0.302, 0.2, 0.15]], []
    )
    (stack,) = stacks(markers)
    assert [marker.label for marker in stack] == ["can", "cup", "box"] and stack_sentence(stack) == "B on C on A"
    assert stacks(markers_of_scene(run_events(*tower, apart))) == []


def test_stacks_that_stand_on_the_table_now_are_stacks():
    objects = [told_object("plate", 0.3, 0.0, z=0.02, size=0.2), told_object("bowl", 0.3, 0.02, z=0.06)]
    objects += [told_object("fork", 0.3, -0.2, z=0.01), told_object("cube", 0.3, 0.06, z=0.12, size=0.04)]
    (stack,) = stacks(markers_of_scene(run_events(*objects)))
    assert stack_sentence(stack) == "D on B on A"
    objects[3] = told_object("cube", 0.3, -0.07, z=0.06, size=0.04)
    (stack,) = stacks(markers_of_scene(run_events(*objects)))
    assert stack_sentence(stack) == "B on A, D on A"


def test_what_is_only_pushed_over_another_is_no_stack():
    """It collides with it: nothing was lifted."""
    tall, flat = told_object("can", 0.3, 0.3, z=0.06), told_object("plate", 0.3, 0.0, z=0.01, size=0.2)
    assert stacks(markers_of_candidate(run_events(tall, flat), [[0.3, 0.0, 0.06], [0.3, 0.0, 0.01]], [])) == []
    assert stacks(markers_of_candidate(run_events(tall, flat), [[0.3, 0.0, 0.08], [0.3, 0.0, 0.01]], [])) != []


@pytest.mark.parametrize("colors", [0, 16, 2**24])
def test_a_stack_is_drawn_from_the_side_below_its_place(colors):
    tower = [told_object(name, 0.3, 0.3, z=0.05 + 0.1 * i, size=0.2 - 0.05 * i) for i, name in enumerate("abc")]
    lines = [line.plain for line in side_view(markers_of_scene(run_events(*tower)), TABLE, 42, colors)]
    assert lines[0] == "stacked: C on B on A; from the side:" and {len(line) for line in lines[1:]} == {42}
    assert [line.strip(" []") for line in lines[1:4]] == ["C", "B", "A"]
    assert all(abs(line.index(letter) - 9) <= 1 for line, letter in zip(lines[1:4], "CBA", strict=True))
    assert side_view(markers_of_scene(run_events(tower[0])), TABLE, 42, colors) == []


def test_what_is_small_or_off_the_table_still_has_its_letter():
    thin = told_object("pen", 0.3, 0.4) | {"outline": [[0.2, 0.401], [0.4, 0.401], [0.4, 0.403]]}
    dot, gone = told_object("pea", 0.3, 0.0, size=0), told_object("ball", 0.9, -0.2)
    for colors in (0, 2**24):
        lines = drawn(markers_of_scene(run_events(thin, dot, gone)), 12, colors)
        assert places(lines, "A") and places(lines, "B")
        assert {row for row, _ in places(lines, "C")} == {0}


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
    markers = markers_of_scene(run_events(*objects, told_object("banana", 0.1, 0.1, takes_part=False)))
    lines = [line.plain for line in legend(markers, 24, 0)]
    assert lines == ["1 red cup 1  2 red cup 2", "3 red cup 3  4 red cup 4", "(a banana)"]
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
    program = "import sys, agent.rendering.terminal_canvas, agent.rendering.object_markers; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=True)
    assert not {"torch", "pybullet", "scipy", "PIL", "shapely"} & set(done.stdout.split())
