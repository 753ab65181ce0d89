"""What is drawn is where it belongs: goals over the camera's picture, candidates, gauges, timing bars."""

import io
import math
import re
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest
from PIL import Image

from agent.event_base import RecordedEvent
from agent.rendering.image_files import Picture, pictures_of, webp_of
from agent.rendering.palette import color_of
from agent.rendering.scene_images import goal_from_above, goal_overlay
from agent.reporting.event_text import shortcoming
from agent.reporting.html.charts import gauge, timing
from agent.reporting.html.figures import CANDIDATES_SHOWN, candidates, legend
from agent.reporting.run_report import RunRecord
from structdiffusion.observation import Arrangement
from structdiffusion.simulation.depth_camera import VIEWS


def near(image: np.ndarray, column: float, row: float, color: tuple[int, int, int], reach: int = 12) -> bool:
    """Whether there is a pixel of about this colour within `reach` pixels of the place."""
    part = image[max(0, int(row) - reach) : int(row) + reach, max(0, int(column) - reach) : int(column) + reach]
    return bool((np.abs(part.astype(int) - color).max(axis=2) < 40).any())


@pytest.fixture
def large(scene):
    """The scene as the real camera sees it: 640 x 480, the clouds without colours of their own."""
    plain = tuple(replace(cloud, colors=None) for cloud in scene.objects)
    lens = VIEWS["robot"].intrinsics
    return replace(scene, objects=plain, color=np.full((480, 640, 3), 120, np.uint8), intrinsics=lens)


def test_goal_is_drawn_where_the_camera_would_see_it(large):
    motions = np.tile(np.eye(4), (3, 1, 1))
    motions[:, :2, 3] = (0.15, 0.1)
    overlay = goal_overlay(large, Arrangement(motions))
    assert overlay.shape == (480, 640, 3)
    for index, cloud in enumerate(large.objects):
        now, goal = VIEWS["robot"].pixels(np.stack((cloud.centroid, cloud.centroid + (0.15, 0.1, 0.0))))
        assert near(overlay, *goal, color_of(index), reach=4)
        assert not near(overlay, *now, color_of(index), reach=4)


def test_goals_are_drawn_in_the_objects_own_colours(large):
    colors = [(170, 200, 30), (20, 20, 20), (160, 20, 30)]
    own = tuple(
        replace(cloud, colors=np.tile(np.array(color, np.uint8), (len(cloud.points), 1)))
        for cloud, color in zip(large.objects, colors, strict=True)
    )
    motions = np.tile(np.eye(4), (3, 1, 1))
    motions[:, 1, 3] = 0.12
    scene, arrangement = replace(large, objects=own), Arrangement(motions)
    overlay, above = goal_overlay(scene, arrangement), goal_from_above(scene, arrangement)
    for cloud, color in zip(own, colors, strict=True):
        goal = cloud.centroid + (0.0, 0.12, 0.0)
        assert near(overlay, *VIEWS["robot"].pixels(goal), color, reach=4)
        assert near(above, *from_above_pixels(goal), color, reach=4)
    for index in range(3):  # no outline and no name in a colour of the palette
        for image in (overlay, above):
            assert not (np.abs(image.astype(int) - color_of(index)).max(axis=2) < 25).any()


def from_above_pixels(point) -> tuple[float, float]:
    """Column and row of a point in the drawings from above: 750 pixels a metre, 5 cm around the table."""
    return 750 * (0.45 + 0.05 - point[1]), 750 * (0.72 + 0.05 - point[0])


def test_goals_are_in_front_of_faded_starts_with_an_arrow_s_head_between(large):
    blue = (0, 60, 200)
    one = replace(large.objects[0], colors=np.tile(np.array(blue, np.uint8), (len(large.objects[0].points), 1)))
    motion = np.eye(4)[None].copy()
    motion[0, 1, 3] = 0.4
    image = goal_from_above(replace(large, objects=(one,), distractors=()), Arrangement(motion)).astype(int)
    blueness = image[..., 2] - image[..., 0]
    column, row = (round(value) for value in from_above_pixels(one.centroid))
    goal, _ = (round(value) for value in from_above_pixels(one.centroid + (0.0, 0.4, 0.0)))
    assert 10 < blueness[row, column] < 120 < blueness[row, goal]
    thickness = (np.abs(image - blue).max(axis=2) < 30)[row - 20 : row + 20, goal + 24 : column - 24].sum(axis=0)
    shaft = np.median(thickness)
    assert 2 <= shaft <= 6 and thickness[:14].max() >= 2 * shaft  # the head is at the goal
    assert thickness[len(thickness) // 2 :].max() <= shaft + 1


def test_what_takes_no_part_has_a_dashed_outline_in_its_own_colour(large):
    red = np.tile(np.array((200, 30, 30), np.uint8), (len(large.distractors[0].points), 1))
    stays = replace(large.distractors[0], colors=red)
    image = goal_from_above(replace(large, distractors=(stays,)), Arrangement(np.tile(np.eye(4), (3, 1, 1)))).astype(
        int
    )
    column, row = (round(value) for value in from_above_pixels(stays.centroid))
    part = image[row - 15 : row + 15, column - 15 : column + 15]
    assert 15 < np.median(part[..., 0] - part[..., 2]) < 110  # reddish, and faded
    top = image[row - 26 : row - 18, column - 18 : column + 18]
    dark = (top.max(axis=2) < 150).any(axis=0)
    assert dark.any() and not dark.all()


def test_no_picture_to_draw_upon_is_said(scene):
    with pytest.raises(ValueError, match="without a picture"):
        goal_overlay(replace(scene, color=None), Arrangement(np.tile(np.eye(4), (3, 1, 1))))


def test_names_of_a_tower_stand_below_each_other_however_long_they_are(large):
    tower = np.tile(np.eye(4), (3, 1, 1))
    for index, cloud in enumerate(large.objects):
        tower[index, :2, 3] = np.array((0.6, 0.44)) - cloud.centroid[:2]  # all at the table's left edge
    names = [f"an exceptionally long-named object number {number}" for number in range(3)]
    named = tuple(replace(cloud, name=name) for cloud, name in zip(large.objects, names, strict=True))
    image = goal_from_above(replace(large, objects=named), Arrangement(tower)).astype(int)
    below = round(750 * (0.72 + 0.05 - 0.57)) + 4  # the row of the clouds' nearest edge; 750 pixels a metre
    found = [np.nonzero((np.abs(image - color_of(i)).max(axis=2) < 20)[below:]) for i in range(3)]
    lines = sorted(np.median(rows) for rows, _ in found)
    assert np.diff(lines).min() > 10
    for _, columns in found:
        assert columns.min() > 2 and np.ptp(columns) > 100


def test_live_events_bring_their_pictures(run_events):
    named = [picture.name for event in run_events for picture in pictures_of(event)]
    assert named == ["camera-before", "scene-before", "goal-overlay", "proposed-goal", "placement-1-after"]


def test_a_picture_is_kept_as_it_is():
    image = np.zeros((48, 64, 3), np.uint8)
    image[:24] = (200, 30, 30)
    with Image.open(io.BytesIO(webp_of(image))) as kept:
        assert kept.format == "WEBP" and np.abs(np.asarray(kept).astype(int) - image)[[5, -5]].max() < 25


@pytest.fixture
def report(run_events):
    record = RunRecord()
    for event in run_events:
        record.on_event(RecordedEvent(event.to_dict()))
    return record.report


def test_candidates_are_drawn_from_the_report(report):
    ranked = report["proposals"]["candidates"]
    ranked[1]["scores"] = ranked[1]["scores"] | {"total": 0.45, "collision": 0.48}
    ranked[1]["positions"] = [[0.4, 0.1, 0.03], [0.5, 0.2, 0.03], [0.6, 0.3, 0.03]]
    text = candidates(report)
    drawn = [ElementTree.fromstring(svg) for svg in re.findall(r"<svg.*?</svg>", text)]
    assert len(drawn) == CANDIDATES_SHOWN
    assert "too close to each other (collision 0.480, the best has 0.970)" in text
    words = [svg.get("aria-label") for svg in drawn]
    assert "cup 1 40 cm ahead, 10 cm to the left; cup 2 50 cm ahead, 20 cm to the left; cup 3 60 cm ahead" in words[1]
    table = drawn[1].find("rect")
    first = drawn[1].findall("polygon[@class='object']")[0]
    columns, rows = zip(*(map(int, corner.split(",")) for corner in first.get("points").split()), strict=True)
    # 40 cm ahead is (0.72 - 0.40) m below the table's far edge, 10 cm left (0.45 - 0.10) m right of its left edge.
    assert sum(rows) / len(rows) - int(table.get("y")) == pytest.approx(320, abs=15)
    assert sum(columns) / len(columns) - int(table.get("x")) == pytest.approx(350, abs=15)


def test_a_stack_is_drawn_from_the_side_too(report):
    ranked = report["proposals"]["candidates"]
    ranked[0]["positions"] = [[0.4, 0.1, 0.03], [0.4, 0.1, 0.15], [0.4, 0.1, 0.09]]
    first, second = re.findall(r"<figcaption>.*?</figcaption>", candidates(report))[:2]
    assert "stacked: 2 on 3 on 1" in first and "stack" not in second
    assert re.findall(r'<span class="key"[^>]*>(\d)</span>', first) == ["2", "3", "1"]


def test_the_letter_of_what_lies_below_stands_where_it_is_seen(report):
    """That of a plate beside the bowl on it; that of a cup below a cup is in the caption alone."""
    ranked = report["proposals"]["candidates"]
    ranked[0]["positions"] = [[0.4, 0.1, 0.01], [0.4, 0.1, 0.06], [0.5, 0.3, 0.03]]
    letters = re.findall(r"<text[^>]*>(\w)</text>", candidates(report).partition("</svg>")[0])
    assert sorted(letters) == ["2", "3", "a"]
    plate = report["scene"]["objects"][0]
    middle = plate["position"][:2]
    plate["outline"] = [[middle[0] + 0.12 * x, middle[1] + 0.12 * y] for x, y in ((1, 1), (1, -1), (-1, -1), (-1, 1))]
    drawing = candidates(report).partition("</svg>")[0]
    rows = {letter: int(row) for row, letter in re.findall(r'<text x="\d+" y="(\d+)"[^>]*>(\w)</text>', drawing)}
    assert set(rows) == {"1", "2", "3", "a"}
    assert rows["1"] - rows["2"] == pytest.approx(75, abs=8)  # mm: between the edges of the bowl and of the plate


def test_what_is_drawn_on_a_colour_is_read_on_it(report):
    for color, ink in (((250, 250, 240), "rgb(0, 0, 0)"), ((10, 10, 12), "rgb(255, 255, 255)")):
        report["scene"]["objects"][0]["color"] = color
        text = legend(report["scene"])
        assert f'style="background:rgb{color};color:{ink}">1</span>' in text
        assert f"--color:rgb{color}" in candidates(report)


def test_chosen_candidate_is_drawn_though_it_is_not_among_the_best(report):
    report["chosen"]["rank"] = 11
    text = candidates(report)
    assert text.count("<svg") == CANDIDATES_SHOWN + 1 and "<b>11</b>" in text and text.count("chosen</b>") == 1


@pytest.mark.parametrize(
    ("scores", "best", "part"),
    [
        ({"total": 0.4, "a": 0.5, "structure": 0.8}, {"total": 0.8, "a": 1.0, "structure": 0.8}, "its a is lower"),
        ({"total": 0.4, "a": 1.0, "structure": 0.4}, {"total": 0.8, "a": 1.0, "structure": 0.8}, "less like"),
        ({"total": 0.78, "bounds": 0.78}, {"total": 0.8, "bounds": 0.8}, "almost as good, but it reaches beyond"),
        ({"total": 0.8, "bounds": 0.8}, {"total": 0.8, "bounds": 0.8}, "as good as the best"),
        ({"total": 0.0, "bounds": 0.0}, {"total": 0.0, "bounds": 0.0}, "almost zero"),
        ({"total": 0.2}, {"total": 0.8}, "total 0.20 against 0.80"),
        ({"total": None, "bounds": None}, {"total": 0.8, "bounds": 0.8}, "bounds -, the best has 0.800"),
    ],
)
def test_why_a_candidate_lost_is_its_costliest_factor(scores, best, part):
    assert part in shortcoming(scores, best)


def parts(svg: str) -> tuple[float, float, float]:
    """Start and end of the allowed band, and the mark's middle."""
    rectangles = {each.get("class"): each for each in ElementTree.fromstring(svg)}
    start = float(rectangles["allowed"].get("x"))
    mark = float(rectangles["mark"].get("x")) + float(rectangles["mark"].get("width")) / 2
    return start, start + float(rectangles["allowed"].get("width")), mark


@pytest.mark.parametrize(
    ("measured", "limit", "inside"),
    [
        (0.01, "<= 0.02", True), (0.03, "<= 0.02", False), (4, ">= 3", True), (2, ">= 3", False),
        (1.5, ">= 1.2 and < 2", True), (2.4, ">= 1.2 and < 2", False), (0.7, "0.67 to 1.00", True),
        (0.1, "0.67 to 1.00", False), (3.0, "at most 15", True), (-0.2, "< -0.130", True), (0.15, "< -0.130", False),
        (0.3, "> 0", True), (-0.3, "> 0", False), (22, "<= 22.5", True),
    ],
)  # fmt: skip
def test_gauge_has_its_mark_inside_the_band_when_the_check_holds(measured, limit, inside):
    start, end, mark = parts(gauge(measured, limit))
    assert 0 <= start < end <= 100 and 0 < mark < 100
    assert (start - 0.1 <= mark <= end + 0.1) == inside


@pytest.mark.parametrize(("measured", "limit"), [(3, "3"), (None, "<= 3"), (math.nan, "<= 3"), (0, "0")])
def test_no_gauge_where_there_is_no_range(measured, limit):
    assert gauge(measured, limit) == ""


def test_timing_bar_has_every_step_and_the_rest():
    text = timing({"parse": 1.0, "scene": 3.0}, 8.0)
    shares = [float(share) for share in re.findall(r"flex-grow:([\d.]+)", text)]
    assert shares == [0.125, 0.375, 0.5]
    assert "everything else" in text and "4.0 s" in text
    assert "everything else" not in timing({"parse": 1.0}, None)
    assert timing({}, 0.4) == ""


def test_a_later_picture_takes_the_place_of_one_of_its_name():
    record = RunRecord()
    for content in (b"first", b"second"):
        record.on_picture(Picture("camera-after", "after", content))
    assert record.pictures == {"camera-after": b"second"} and len(record.report["pictures"]) == 1
