"""The record, the page and the terminal tell a run completely, and nothing else."""

import base64
import io
import json
import re
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest
from PIL import Image
from rich.console import Console

from agent.arm.events import Stopped
from agent.errors import UsageError
from agent.events import (
    Answered,
    Asked,
    Checked,
    Commanded,
    Failed,
    Filmed,
    Finished,
    Noted,
    Pictured,
    Restored,
    Tried,
)
from agent.rendering.image_files import Picture
from agent.reporting.event_text import verdict_sentence
from agent.reporting.html.document import session_page
from agent.reporting.run_report import SCHEMA_VERSION, RunRecord
from agent.reporting.session_reader import Session
from agent.reporting.terminal_report import TerminalReport

KEYS = {
    "schema_version", "version", "instruction", "options", "outcome", "parse", "scene", "proposals", "chosen", "arm",
    "turn",
    "verdict", "seconds", "pictures", "remarks", "tried",
}  # fmt: skip


def record_of(run_events) -> RunRecord:
    record = RunRecord()
    for event in run_events:
        record.on_event(event)
    return record


def test_report_has_every_key_before_anything_happened():
    record = RunRecord()
    assert set(json.loads(record.json())) == KEYS
    assert not record.saw_something


def test_report_keeps_everything_as_strict_json(run_events):
    report = json.loads(record_of(run_events).json(), parse_constant=lambda name: pytest.fail(f"{name} is no JSON"))
    assert report["schema_version"] == SCHEMA_VERSION
    assert report["parse"]["spec"]["shape"] == "circle" and report["parse"]["spec"]["rotation"] is None
    assert [seen["takes_part"] for seen in report["scene"]["objects"]] == [True, True, True, False]
    assert len(report["proposals"]["candidates"]) == 12
    assert report["proposals"]["candidates"][0]["scores"]["collision"] == 0.97
    assert [entry["kind"] for entry in report["arm"]] == ["planned", "picked", "placed"]
    assert report["verdict"]["checks"][0]["measured"] is None  # infinity
    assert report["outcome"] == {
        "success": False,
        "exit_code": 5,
        "step": "check",
        "message": "the structure was built but does not stand as asked",
        "seconds": 14.0,
    }
    seconds = {"parse": 0.2, "scene": 1.0, "propose": 2.0, "plan": 3.0, "build": 4.0, "check": 2.5}
    assert report["seconds"] == seconds


def test_folder_has_report_page_and_pictures(run_events, tmp_path):
    record = record_of(run_events)
    page = record.write(tmp_path / "new" / "folder")
    assert page.name == "report.html"
    names = {path.name for path in page.parent.iterdir()}
    assert names == {".structagent.json", "report.html", "report.json"} | {
        entry["file"] for entry in record.report["pictures"]
    }
    assert {"camera-before.webp", "scene-before.webp", "proposed-goal.webp", "placement-1-after.webp"} <= names
    for path in page.parent.glob("*.webp"):
        assert Image.open(path).size[0] >= 64


def test_pictures_of_an_earlier_run_are_removed_and_nothing_else(run_events, tmp_path):
    record_of(run_events).write(tmp_path)
    (tmp_path / "mine.webp").write_bytes(b"")
    record_of([*run_events[:3], run_events[-2], run_events[-1]]).write(tmp_path)
    assert {path.name for path in tmp_path.glob("*.webp")} == {"camera-before.webp", "scene-before.webp", "mine.webp"}


def test_page_is_one_self_contained_file(run_events, tmp_path):
    text = record_of(run_events).write(tmp_path).read_text(encoding="utf-8")
    sources = re.findall(r'(?:src|href)="([^"]*)"', text)
    assert sources and all(source.startswith("data:image/webp;base64,") for source in sources)
    assert "http" not in re.sub(r"base64,[^\"]*", "", text)
    assert "@import" not in text and "url(" not in text and "fetch(" not in text
    assert re.findall("<script[^>]*>", text) == ['<script type="application/json">', "<script>"]  # of the view in 3D


def test_a_film_has_controls_and_its_last_picture_where_no_script_runs(run_events, tmp_path):
    frames = np.zeros((5, 48, 64, 3), np.uint8)
    frames[-1] = 200
    text = (
        record_of([*run_events[:-3], Filmed(1.5, frames), *run_events[-3:]]).write(tmp_path).read_text(encoding="utf-8")
    )
    figure = re.search(r'<figure class="film" data-interval="1.500".*?</figure>', text, re.DOTALL).group()
    stills = json.loads(re.search(r'<script type="application/json">(.*?)</script>', figure).group(1))
    assert len(stills) == 5
    shown = re.search(r'src="data:image/webp;base64,([^"]*)"', figure).group(1)
    assert shown == stills[-1]
    with Image.open(io.BytesIO(base64.b64decode(shown))) as last:
        assert last.size == (64, 48) and np.asarray(last).mean() > 150
    for part in ('type="range"', "<button", 'class="controls" hidden'):
        assert part in figure
    sources = re.findall(r'(?:src|href)="([^"]*)"', text)
    assert all(source.startswith("data:image/webp;base64,") for source in sources)
    assert text.count("<script>") == 2 and "<script src" not in text and "fetch(" not in text


def test_a_film_of_an_old_session_still_plays(run_events):
    record = record_of(run_events)
    first, *rest = (Image.new("RGB", (32, 24)) for _ in range(3))
    for number, picture in enumerate(rest):
        picture.paste((250, 250, 250), (8 * number, 0, 8 * number + 8, 8))
    buffer = io.BytesIO()
    first.save(buffer, format="WEBP", save_all=True, append_images=rest, duration=80, loop=0)
    record.on_picture(Picture("film", "the arm at work", buffer.getvalue()))
    text = session_page(Session("0.1.0", "2025-01-31T09:30:00+00:00", "Python", {}, ()), [record.turn])
    assert '<figure><img alt="the arm at work"' in text and '<figure class="film"' not in text


ENDINGS = [
    ([Answered("where is the banana?", "60 cm ahead")], "quiet", "Conversation"),
    ([Asked("shape", "A circle or a line?", ("circle", "line"))], "quiet", "Question"),
    ([Failed("parse", "no arrangement", 3), Finished(False, 3, 0.1)], "quiet", "Refused"),
    ([], "quiet", "Conversation"),
]


@pytest.mark.parametrize(("after", "look", "words"), ENDINGS)
def test_talk_is_no_failure_on_the_page(run_events, after, look, words):
    turn = record_of([run_events[0], *after]).turn
    assert turn.outcome == f'<span class="badge {look}">{words}</span>'
    assert ("60 cm ahead" in turn.sections()) == (words == "Conversation" and bool(after))


@pytest.mark.parametrize(
    ("lines", "words"), [(("n",), "Declined"), (("No.",), "Declined"), (("/why",), "Proposed, not built")]
)
def test_a_proposal_that_was_not_built_is_no_failure(run_events, lines, words):
    turn = record_of([*run_events[:5], *map(Commanded, lines)]).turn
    assert turn.outcome == f'<span class="badge quiet">{words}</span>'


def test_a_failure_stays_one(run_events):
    assert 'badge bad">Not built' in record_of([*run_events, Answered("why?", "because")]).turn.outcome
    stopped = [*run_events[:5], Failed("build", "interrupted", 130), Finished(False, 130, 3.0)]
    assert 'badge quiet">Stopped' in record_of(stopped).turn.outcome


def test_what_was_tried_without_the_arm_is_shown_and_said(run_events, tmp_path):
    tried = Tried(((0.4, 0.1, 0.03), (0.4, 0.1, 0.09), (0.5, 0.3, 0.03)), (0.0,) * 3)
    picture = Pictured("camera-tried", "the goal as it came to rest", np.full((48, 64, 3), 90, np.uint8))
    verdict = Checked(True, None, (), "everything stands as asked", "released", 0.4)
    record = record_of([*run_events[:5], tried, picture, verdict, Finished(True, 0, 3.0)])
    text = record.write(tmp_path).read_text(encoding="utf-8")
    assert "Tried without the arm" in text and "the goal as it came to rest" in text
    assert "stacked: 2 on 1" in text and "It stands as" not in text and "the table is unchanged" in text
    out = io.StringIO()
    terminal = TerminalReport(Console(file=out, width=100))
    for event in (*run_events[:5], tried, picture, verdict):
        terminal.on_event(event)
    assert "It stands" not in out.getvalue() and "the table is unchanged." in out.getvalue()


@pytest.mark.parametrize(
    "how, sentence, badge",
    [
        ("arm", "3 of 4 objects stand as asked (cup 4 is left out).", "Partly built"),
        (
            "released",
            "3 of 4 objects stand as asked (cup 4 is left out) when released without the arm; the table is unchanged.",
            "Valid for some of the objects",
        ),
    ],
)
def test_a_success_without_some_of_the_objects_says_so(run_events, how, sentence, badge):
    verdict = Checked(True, None, (), "everything stands as asked", how, 0.4, count=3, left_out=("cup 4",))
    assert verdict_sentence(verdict.to_dict()) == sentence
    failed = Failed("check", "3 of 4 objects stand as asked; cup 4 is left where it is: out of the arm's reach", 8)
    turn = record_of([*run_events[:5], verdict, failed, Finished(False, 8, 3.0)]).turn
    assert turn.outcome == f'<span class="badge quiet">{badge}</span>'


def test_page_escapes_the_instruction(run_events, tmp_path):
    text = record_of(run_events).write(tmp_path).read_text(encoding="utf-8")
    assert "&lt;script&gt;" in text


class _Nesting(HTMLParser):
    """Whether every element is closed, and every picture and drawing has words."""

    VOID = {"meta", "img", "br", "source", "rect", "polygon", "path", "link", "input"}

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.wordless: list[str] = []

    def handle_starttag(self, tag, attributes):
        words = dict(attributes)
        if (tag == "img" and not words.get("alt")) or (tag == "svg" and not words.get("aria-label")):
            self.wordless.append(tag)
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert tag in self.VOID or self.open.pop() == tag


def test_page_is_well_formed_and_its_pictures_have_words(run_events, tmp_path):
    film = Filmed(0.8, np.zeros((3, 24, 32, 3), np.uint8))
    page = record_of([*run_events[:-3], film, *run_events[-3:]]).write(tmp_path)
    reader = _Nesting()
    reader.feed(page.read_text(encoding="utf-8"))
    assert not reader.open and not reader.wordless


def test_page_shows_candidates_film_and_time(run_events, tmp_path):
    film = Filmed(0.8, np.zeros((3, 24, 32, 3), np.uint8))
    text = record_of([*run_events[:-3], film, *run_events[-3:]]).write(tmp_path).read_text(encoding="utf-8")
    for part in ("candidate 1 from above", "6 times as fast", "Time by step", "✗ failed", "Not built"):
        assert part in text, part
    assert text.count('<figure class="candidate') == 6


def test_remarks_are_kept_and_shown_in_order(run_events, tmp_path):
    remarks = [
        Asked("shape", "A circle or a line?", ("circle", "line")),
        Noted("the bowl is ours <b>now</b>"),
        Commanded("/undo"),
        Restored("undo", None, ("cup 1", "cup 2"), ("cup 2",)),
    ]
    record = record_of([*run_events[:3], *remarks, Stopped(1, "cup 2", True, True), *run_events[-2:]])
    assert [remark["kind"] for remark in record.report["remarks"]] == ["asked", "noted", "commanded", "restored"]
    assert [entry["kind"] for entry in record.report["arm"]] == ["stopped"]
    text, out = record.write(tmp_path).read_text(encoding="utf-8"), io.StringIO()
    terminal = TerminalReport(Console(file=out, width=100))
    for event in (*run_events[:3], *remarks, Stopped(1, "cup 2", True, True)):
        terminal.on_event(event)
    for part in ("A circle or a line? 1) circle, 2) line", "/undo", "undo: put back cup 2", "set the cup 2 down"):
        assert part in text and part in out.getvalue(), part
    assert "ours &lt;b&gt;now" in text and "ours <b>now</b>" in out.getvalue()


def test_an_interrupted_run_has_its_exit_code(run_events):
    record = record_of([*run_events[:3], Failed("run", "interrupted", 130)])
    assert record.report["outcome"]["exit_code"] == 130


def test_session_page_has_every_turn(run_events):
    session = Session("0.1.0", "2025-01-31T09:30:00+00:00", "Python", {}, ())
    text = session_page(session, [record_of(run_events).turn, record_of(run_events[:1]).turn, RunRecord().turn])
    for number in (1, 2, 3):
        assert text.count(f'href="#turn-{number}"') == text.count(f'id="turn-{number}"') == 1
    assert "before the first instruction" in text and "3 turns" in text


def test_page_of_a_run_that_saw_only_the_scene(run_events, tmp_path):
    text = record_of([*run_events[:3], run_events[-2], run_events[-1]]).write(tmp_path).read_text(encoding="utf-8")
    assert "Scene before" in text and "Proposals" not in text


def test_report_into_a_file_is_a_usage_error(run_events, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(UsageError, match="cannot write the report into"):
        record_of(run_events).write(tmp_path / "file" / "folder")


def test_terminal_prints_plain_text_where_there_is_no_terminal(run_events):
    out = io.StringIO()
    terminal = TerminalReport(Console(file=out))
    for event in run_events:
        terminal.on_event(event)
    text = out.getvalue()
    assert "\x1b" not in text
    for part in (
        "circle     99 % sure  from “circle”",
        "rotation    left open",
        "4 objects, 3 take part",
        "12 candidates by the model “diffusion”",
        "planned candidate 1 in 3.0 s: cup 1 (side), then cup 2 (side)",
        "placed cup 1: 0.6 cm and 1.1 deg from its goal, 4.0 s",
        "failed  largest gap over the mean",
        "The whole run took 14.0 s",
    ):
        assert part in text, part


def test_terminal_does_not_read_markup_in_the_instruction(run_events):
    out = io.StringIO()
    from agent.events import Started

    TerminalReport(Console(file=out)).on_event(Started("a [bold]circle[/bold] [/]", {}))
    assert "a [bold]circle[/bold] [/]" in out.getvalue()


# --- goals of several parts ------------------------------------------------------------------------


PARTS = ("circle of cup 1, cup 2, left", 'cup 3 behind <i id="x">banana</i>')


def several_parts(run_events) -> list:
    """The same run for a goal of two parts: the third cup is set aside, the second is in its place."""
    goals = [
        {**goal, "parts": parts, "stays": stays, "aside": not parts}
        for goal, parts, stays in zip(run_events[4].goals, ([1], [1, 2], []), (False, True, False), strict=True)
    ]
    told = {"goal": {"parts": []}, "parts": PARTS, "objects": ("cup 1", "cup 2", "cup 3", "banana")}
    return [run_events[0], replace(run_events[1], **told), *run_events[2:4], replace(run_events[4], goals=tuple(goals))]


def test_the_terminal_lists_the_parts_and_what_happens_to_each_object(run_events):
    output = said(several_parts(run_events))
    assert "  1. circle of cup 1, cup 2, left\n  2. cup 3 behind" in output
    assert "left open" not in output and "with the objects named" not in output
    rows = [line.split() for line in output.splitlines() if line.startswith("  cup ") and " cm " in line][-3:]
    assert [(" ".join(row[:2]), row[2]) for row in rows] == [("cup 1", "goes"), ("cup 2", "stays"), ("cup 3", "is")]
    assert (
        rows[0][-2:] == ["part", "1"]
        and rows[1][-3:] == ["parts", "1,", "2"]
        and rows[2][2:5] == ["is", "set", "aside"]
    )


def test_the_page_lists_the_parts_and_what_happens_to_each_object(run_events):
    record = record_of(several_parts(run_events))
    sections = record.turn.sections()
    assert "<ol><li>circle of cup 1, cup 2, left</li><li>cup 3 behind &lt;i id=" in sections
    assert "left open" not in sections
    assert re.search(r"<td>cup 2</td><td>stays at</td><td>[^<]+</td><td>parts 1, 2</td>", sections)
    assert re.search(r"<td>cup 3</td><td>is set aside to</td>", sections)


def test_one_structure_has_no_table_of_goals(run_events):
    assert "goes to" not in record_of(run_events).turn.sections()


def said(run_events) -> str:
    out = io.StringIO()
    report = TerminalReport(Console(file=out, width=200))
    for event in run_events:
        report.on_event(event)
    return out.getvalue()
