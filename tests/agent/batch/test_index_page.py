"""The page of a batch's folder: its cards, their filters, hostile text, and thousands of rows."""

import json
import re
import time
from html.parser import HTMLParser
from pathlib import Path

import pytest

from agent.batch.index_page import index_page, outcome_of
from agent.batch.rows import BadRow, Row
from agent.pipeline.run import RunOptions
from agent.rendering.image_files import FORMAT

OPTIONS = RunOptions()
LINE, CIRCLE = {"kind": "structure", "shape": "line"}, {"kind": "structure", "shape": "circle"}
ON = {"kind": "relation", "relation": "on"}
SETTING = {"kind": "structure", "shape": "table setting"}


def row(row_id: str, text: str = "make a line") -> Row:
    return Row(1, row_id, text, OPTIONS, "00ff")


def result(row_id: str, code: int = 0, message: str | None = None, *parts: dict, report: bool = False) -> dict:
    return {
        "id": row_id, "success": code == 0, "exit_code": code, "message": message, "seconds": {"total": 1.5},
        "spec": parts[0] if parts else None, "goal": {"parts": list(parts)} if parts else None,
        "checks": [{}, {}, {}] if code == 0 else [], "report": f"rows/{row_id}/report.html" if report else None,
    }  # fmt: skip


class Page(HTMLParser):
    """A page as a browser reads it: its elements with their attributes, and the text of each card."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.cards: dict[str, dict] = {}
        self._in_card = False
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list) -> None:
        self.elements.append((tag, dict(attrs)))
        if tag == "li" and "data-outcome" in dict(attrs):
            self._in_card = True
            self.cards[dict(attrs)["id"].removeprefix("row-")] = dict(attrs) | {"text": "", "pictures": [], "links": []}
        elif self._in_card and tag == "img":
            list(self.cards.values())[-1]["pictures"].append(dict(attrs)["src"])
        elif self._in_card and tag == "a":
            list(self.cards.values())[-1]["links"].append(dict(attrs)["href"])

    def handle_endtag(self, tag: str) -> None:
        self._in_card &= tag != "li"

    def handle_data(self, data: str) -> None:
        if self._in_card:
            list(self.cards.values())[-1]["text"] += data

    def of(self, tag: str) -> list[dict[str, str | None]]:
        return [attributes for name, attributes in self.elements if name == tag]


def page_of(results: list[dict], folder: Path, text: str = "make a line") -> Page:
    return Page(index_page([row(one["id"], text) for one in results], {one["id"]: one for one in results}, folder))


@pytest.mark.parametrize(
    ("code", "message", "outcome"),
    [
        (0, None, "stood"),
        (1, "ZeroDivisionError: is it?", "failed"),
        (3, "there is no kettle", "refused"),
        (3, "which shape should it be: circle, line?", "asked"),
        (4, "no candidate is worth trying", "failed"),
        (5, "it does not stand as asked", "failed"),
        (8, "2 of 3 cups stand as asked", "failed"),
    ],
)
def test_outcome(code, message, outcome):
    assert outcome_of(result("a", code, message)) == outcome


def test_a_row_without_a_result_waits(tmp_path):
    page = Page(index_page([row("a"), row("b")], {"a": result("a")}, tmp_path))
    assert [(name, card["data-outcome"]) for name, card in page.cards.items()] == [("a", "stood"), ("b", "waiting")]
    assert "not done yet" in page.cards["b"]["text"]


def test_cards_and_filters_name_outcomes_and_structures(tmp_path):
    page = page_of(
        [
            result("a", 0, None, LINE),
            result("b", 5, "it does not\nstand", CIRCLE, LINE, LINE, ON),
            result("c", 0, None, SETTING),
            result("d", 3, "there is no kettle"),
        ],
        tmp_path,
    )
    found = {name: (card["data-outcome"], card["data-structures"]) for name, card in page.cards.items()}
    assert found == {
        "a": ("stood", "line"), "b": ("failed", "circle line on"), "c": ("stood", "table-setting"), "d": ("refused", "")
    }  # fmt: skip
    assert [button["value"] for button in page.of("button")] == ["", "stood", "failed", "refused"]
    assert [option["value"] for option in page.of("option")] == ["", "circle", "line", "on", "table-setting"]
    assert page.of("input")[0]["type"] == "search"
    assert "hidden" in next(each for each in page.of("div") if each.get("class") == "filters")  # without the script
    text = page.cards["b"]["text"]
    assert "failed: execution failed" in text and "it does not stand" in text and "1.5 s" in text
    assert "passed all 3 checks" in page.cards["a"]["text"]


def test_pictures_of_scene_goal_and_build_are_linked_where_they_exist(tmp_path):
    for name, pictures in {"a": ("camera-before", "scene-before", "proposed-goal", "camera-after"), "b": ()}.items():
        folder = tmp_path / "rows" / name
        folder.mkdir(parents=True)
        for picture in pictures:
            (folder / f"{picture}.webp").touch()
    page = page_of([result(name, report=name != "d") for name in "abcd"], tmp_path)
    assert page.cards["a"]["pictures"] == [
        "rows/a/camera-before.webp", "rows/a/proposed-goal.webp", "rows/a/camera-after.webp"
    ]  # fmt: skip
    assert all(image["loading"] == "lazy" for image in page.of("img"))
    assert [len(card["pictures"]) for card in page.cards.values()] == [3, 0, 0, 0]
    assert set(page.cards["a"]["links"]) == {"#row-a", "rows/a/report.html"}
    assert page.cards["d"]["links"] == ["#row-d"]


HOSTILE = [
    "</script><script>alert(1)</script>",
    '"><img src=x onerror=alert(1)>',
    "<!-- <style>li { display: none }</style>",
    "' onmouseover='alert(1)",
    '<figure class="film" data-interval="1">',
    "&lt;script&gt; &amp; \u202e\u0007",
]


@pytest.mark.parametrize("text", HOSTILE)
def test_hostile_text_is_shown_and_nothing_else(text, tmp_path):
    plain = page_of([result("a", 3, "no", LINE)], tmp_path, "text")
    evil = page_of([result("a", 3, text, LINE | {"shape": text})], tmp_path, text)
    assert [tag for tag, _ in evil.elements] == [tag for tag, _ in plain.elements]
    assert [set(attributes) for _, attributes in evil.elements] == [set(attributes) for _, attributes in plain.elements]
    assert evil.cards["a"]["text"].count(" ".join(text.split())) == 2  # as instruction and as reason
    bad = Page(index_page([BadRow(1, "line-001", text, text, 6)], {}, tmp_path))
    assert text in bad.cards["line-001"]["text"]


def test_the_page_needs_no_network(tmp_path):
    page = index_page([row("a")], {"a": result("a")}, tmp_path)
    assert not re.search(r"https?:|//[a-z]|@import|url\(|fetch\(|XMLHttpRequest", page)
    assert not re.findall(r"<(?:link|iframe|script src)", page)


USES = {
    "document.querySelector('button[value=failed]').click()": ["b"],
    "choose.value = 'line'; choose.onchange()": ["a", "b"],
    "words.value = 'KETTLE there'; words.oninput()": ["d"],
    "choose.value = 'circle'; document.querySelector('button[value=stood]').click()": [],
    "": ["a", "b", "c", "d"],
}


def test_filters_in_a_browser(tmp_path, tab):
    results = [
        result("a", 0, None, LINE),
        result("b", 5, "it does not stand", CIRCLE, LINE),
        result("c", 0, None, SETTING),
        result("d", 3, "there is no kettle"),
    ]
    page = index_page([row(one["id"]) for one in results], {one["id"]: one for one in results}, tmp_path)
    file = tmp_path / "index.html"
    file.write_text(page, encoding="utf-8")
    tab.open(file.as_uri())
    seen = tab.value(f"""(() => {{
      const choose = document.querySelector("select"), words = document.querySelector("input[type=search]");
      const seen = [];
      for (const use of {json.dumps(list(USES))}) {{
        choose.value = ""; words.value = ""; document.querySelector("button").click();
        eval(use);
        seen.push([...document.querySelectorAll(".rows > li")].filter((e) => !e.hidden).map((e) => e.id.slice(4)));
      }}
      return seen;
    }})()""")
    assert seen == list(USES.values())
    assert not tab.value("document.querySelector('.filters').hidden")  # shown, now that there is a script


def test_two_thousand_rows_are_cheap(tmp_path):
    results = []
    for number in range(2000):
        name = f"row-{number:04}"
        code = (0, 0, 3, 5)[number % 4]
        results.append(result(name, code, "so " * 40 if code else None, LINE, report=code != 3))
        folder = tmp_path / "rows" / name
        folder.mkdir(parents=True)
        for picture in ("camera-before", "goal-overlay", "camera-after") if code != 3 else ():
            (folder / f"{picture}.webp").touch()
    rows = [row(one["id"], "put the cups into a circle on the left") for one in results]
    began = time.process_time()
    page = index_page(rows, {one["id"]: one for one in results}, tmp_path)
    seconds, size = time.process_time() - began, len(page.encode())
    print(json.dumps({"cpu_seconds": round(seconds, 3), "megabytes": round(size / 1e6, 2)}))
    assert page.count("<li id=") == 2000 and page.count('loading="lazy"') == 4500
    assert seconds < 2.0 and size < 4e6


@pytest.mark.parametrize("report", ["javascript:alert(1)", "//example.org/x", "../../x.html", "/etc/passwd", 'a"b'])
def test_links_lead_to_the_rows_own_report_whatever_its_result_says(report, tmp_path):
    ended = result("mine", 0, None, LINE) | {"report": report}
    (tmp_path / "rows" / "mine").mkdir(parents=True)
    (tmp_path / "rows" / "mine" / f"scene-before.{FORMAT}").write_bytes(b"")
    page = Page(index_page([row("mine")], {"mine": ended}, tmp_path))
    card = page.cards["mine"]
    assert set(card["links"]) == {"#row-mine", "rows/mine/report.html"}
    assert card["pictures"] == [f"rows/mine/scene-before.{FORMAT}"]
