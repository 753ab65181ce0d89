"""The view in 3D in a real browser, from a file."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from agent import events
from agent.arm.visual_shapes import LinkShape
from agent.rendering.palette import COLORS
from agent.reporting.replay import write_page
from agent.reporting.run_report import RunRecord
from agent.reporting.session_log import SessionWriter
from structdiffusion.geometry import pose_from_xyz_yaw

FIGURE = "document.querySelector('.table-view')"


def recorded(run_events, scene, record: RunRecord) -> RunRecord:
    """A run that looked, at objects without colours, proposed, and built: the arm, a single block, drove along y."""
    plain = replace(scene, objects=tuple(replace(cloud, colors=None) for cloud in scene.objects))
    way = np.array([pose_from_xyz_yaw(0.0, y, 0.0, 3 * y) for y in np.linspace(0.0, 0.2, 9)])
    image = np.zeros((48, 64, 3), np.uint8)
    pictured = events.Pictured("placement-1-after", "after placement 1: cup 1", image, {"cup 1": way[4]})
    arm = LinkShape(0, (0.06, 0.06, 0.3), True, (0.45, 0.0, 0.25), (0.0, 0.0, 0.0, 1.0), (20, 220, 220))
    motions = {"cup 1": way, "cup 2": np.tile(np.eye(4), (9, 1, 1))}
    film = events.Filmed(1.25, np.zeros((2, 48, 64, 3), np.uint8), 0.5, motions, {0: way}, (arm,))
    perceived = replace(run_events[2], scene=plain, base=np.zeros(3))
    for event in (*run_events[:2], perceived, *run_events[3:5], pictured, film):
        record.on_event(event)
    return record


@pytest.fixture
def page(run_events, scene, tmp_path) -> Path:
    return recorded(run_events, scene, RunRecord()).write(tmp_path / "out")


@pytest.fixture
def table_view(tab, page):
    tab.open(page.as_uri())
    if tab.value(f"{FIGURE}.closest('section').hidden"):
        pytest.skip("the browser has no WebGL here")
    return tab


def slid(tab, place) -> str:
    return tab.value(f"(f => {{ const s = f.querySelector('input'); s.value = {place}; s.oninput();"
                     f" return f.querySelector('output').textContent; }})({FIGURE})")  # fmt: skip


def drawn(tab) -> np.ndarray:
    """The view as it is drawn, (H, W, 3)."""
    tab.value(f"{FIGURE}.scrollIntoView()")
    tab.value("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
    left, top, width, height = tab.value(f"(b => [b.x, b.y, b.width, b.height])({FIGURE}.querySelector('canvas')"
                                         ".getBoundingClientRect())")  # fmt: skip
    return tab.picture()[round(top) : round(top + height), round(left) : round(left + width)].astype(int)


def test_the_buttons_and_the_slider_choose_what_is_shown(table_view):
    table_view.press(".table-view button[value=scene]")
    assert table_view.value(f"{FIGURE}.querySelector('output').textContent") == "the table as it was seen"
    assert table_view.value(f"{FIGURE}.querySelector('input').hidden && {FIGURE}.querySelector('.play').hidden")
    table_view.press(".table-view button[value=goal]")
    assert slid(table_view, 4) == "candidate 5, score 0.900 (5 of 12)"


def test_objects_are_drawn_in_their_colours(table_view):
    table_view.press(".table-view button[value=scene]")
    seen = drawn(table_view)
    for color in COLORS[:3]:  # of the three cups
        assert (np.abs(seen - color).max(axis=2) < 6).sum() > 30


def middle_of(seen: np.ndarray, color: tuple[int, int, int]) -> float:
    return float((np.abs(seen - color).max(axis=2) < 6).nonzero()[1].mean())


def test_time_runs_smoothly_between_the_moments_of_a_build(table_view):
    table_view.press(".table-view button[value=build]")
    assert slid(table_view, 0) == "0 s of 4 s"
    columns, arms = [], []
    for moment in (0, 3.25, 3.75, 8):
        told = slid(table_view, moment)
        seen = drawn(table_view)
        columns.append(middle_of(seen, COLORS[0]))
        cyan = (seen[..., 1] > seen[..., 0] + 60) & (seen[..., 2] > seen[..., 0] + 60)
        arms.append(cyan.nonzero()[1].mean())
    assert told == "after placement 1: cup 1, 4 s of 4 s"
    assert columns[0] > columns[1] + 8 > columns[2] + 9 > columns[3] + 20  # to the left, between whole moments too
    assert arms[0] > arms[1] > arms[2] > arms[3]


def test_a_build_plays(table_view):
    table_view.press(".table-view button[value=build]")
    table_view.press(".table-view .play")
    table_view.wait(f"{FIGURE}.querySelector('.play').getAttribute('aria-label') === 'play'")  # it has ended
    assert float(table_view.value(f"{FIGURE}.querySelector('input').value")) == 8


def test_the_page_of_a_session_has_the_view_too(run_events, scene, tmp_path, tab):
    with SessionWriter(tmp_path / "session.jsonl", {}) as writer:
        recorded(run_events, scene, RunRecord(writer))
    again = write_page(tmp_path / "session.jsonl", tmp_path / "session.html")
    tab.open(again.as_uri())
    if tab.value(f"{FIGURE}.closest('section').hidden"):
        pytest.skip("the browser has no WebGL here")
    assert slid(tab, 4) == "after placement 1: cup 1, 2 s of 4 s"
    assert (np.abs(drawn(tab) - COLORS[0]).max(axis=2) < 6).sum() > 30


def test_without_webgl_the_pictures_stay_alone(page, tab):
    tab.without_webgl()
    tab.open(page.as_uri())
    assert tab.value(f"{FIGURE}.closest('section').hidden")
    shown = tab.value("[...document.images].filter((image) => image.getClientRects().length).map((image) => image.alt)")
    assert len(shown) == 4 and all("the scene before" in alt or "the proposed goal" in alt for alt in shown)
