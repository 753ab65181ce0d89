"""The view in 3D in a real browser, from a file."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from agent.rendering.palette import COLORS
from agent.reporting.run_report import RunRecord
from tests.dumped_page import dumped_page


@pytest.fixture
def page(run_events, scene, tmp_path) -> Path:
    """The page of a run that looked, at objects without colours, and proposed."""
    plain = replace(scene, objects=tuple(replace(cloud, colors=None) for cloud in scene.objects))
    record = RunRecord()
    for event in (*run_events[:2], replace(run_events[2], scene=plain), *run_events[3:5]):
        record.on_event(event)
    return record.write(tmp_path / "out")


def view_of(document: str) -> str:
    return re.search(r"<section[^>]*>\s*<h3>The table in 3D</h3>.*?</section>", document, re.DOTALL).group()


def test_the_buttons_and_the_slider_choose_what_is_shown(page):
    use = """<script>
      const figure = document.querySelector(".table-view"), slider = figure.querySelector("input");
      figure.querySelector("button[value=scene]").click();
      const first = figure.querySelector("output").textContent + " " + slider.hidden;
      figure.querySelector("button[value=goal]").click();
      slider.value = 4;
      slider.oninput();
      document.title = first + "|" + figure.querySelector("output").textContent + " " + slider.hidden;
    </script>"""
    page.write_text(page.read_text(encoding="utf-8").replace("</body>", use + "</body>"), encoding="utf-8")
    document = dumped_page(page)
    if view_of(document).startswith('<section hidden=""'):
        pytest.skip("the browser has no WebGL here")
    title = re.search("<title>(.*?)</title>", document).group(1)
    assert title == "the table as it was seen true|candidate 5, score 0.900 (5 of 12) false"


def test_objects_are_drawn_in_their_colours(page, tmp_path):
    if view_of(dumped_page(page)).startswith('<section hidden=""'):
        pytest.skip("the browser has no WebGL here")
    text = page.read_text(encoding="utf-8")
    alone = text.replace("</style>", "section:not(:has(.table-view)), header { display: none }</style>")
    page.write_text(alone, encoding="utf-8")
    dumped_page(page, picture=tmp_path / "seen.png")
    seen = np.asarray(Image.open(tmp_path / "seen.png").convert("RGB")).astype(int)
    for color in COLORS[:3]:  # of the three cups
        assert (np.abs(seen - color).max(axis=2) < 6).sum() > 30


def test_without_webgl_the_pictures_stay_alone(page):
    document = dumped_page(page, webgl=False)
    assert view_of(document).startswith('<section hidden=""')
    assert document.count("<img ") == 4
