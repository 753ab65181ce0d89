"""An object has one name, one mark and one way of telling its place, in the chat, the terminal,
the report and its page.
"""

import io
import re

import numpy as np
import pytest
from rich.console import Console

from agent import events
from agent.chat.table_facts import object_facts
from agent.chat.view import ChatScreen
from agent.live_view.scene_messages import scene_message
from agent.pipeline.event_builders import chosen_event, perceived_event
from agent.rendering.text import place
from agent.reporting.html.document import run_page
from agent.reporting.run_report import RunRecord
from agent.reporting.terminal_report import TerminalReport
from agent.scenes.table_scene import TableScene
from structdiffusion.geometry import pose_from_xyz_yaw
from structdiffusion.objects.procedural import procedural_object
from structdiffusion.observation import Arrangement

KINDS = ("cup", "box", "cup", "box", "candle")
AT = [(0.3, 0.3), (0.3, 0.0), (0.3, -0.3), (0.55, 0.2), (0.55, -0.2)]
MARKS = {"cup 1": "A", "box 1": "B", "cup 2": "C", "box 2": "D", "candle": "E"}
LISTED = re.compile(r"\(?\b([A-Za-z1-9]) (cup 1|box 1|cup 2|box 2|candle)\b\)?")


@pytest.fixture(scope="module")
def turns():
    """Events of three requests to one table, in each of which other objects take part."""
    models = [procedural_object(kind, index) for index, kind in enumerate(KINDS)]
    poses = np.array([pose_from_xyz_yaw(x, y, 0.0, 0.0) for x, y in AT])
    found = []
    with TableScene(models, poses, 5, np.random.default_rng(0)) as table:
        table.look()
        for names in (MARKS, ("box 2",), ("candle", "cup 2")):
            table.involve(list(names))
            scene = table.look()
            motions = np.tile(np.eye(4), (len(names), 1, 1))
            motions[:, 0, 3] = 0.05
            arrangement = Arrangement(motions, {"total": 0.9})
            chosen = chosen_event(1, arrangement, scene)
            positions = tuple(goal["position"] for goal in chosen.goals)
            candidate = events.Candidate(1, {"total": 0.9}, positions, (0.0,) * len(names))
            proposed = events.Proposed("geometric", (candidate,), 1.0, scene, (arrangement,))
            found.append((perceived_event(scene, 0.1, table), proposed, chosen))
    return found


def heard(listener, turn):
    listener.on_event(events.Started("do it", {}))
    for event in turn:
        listener.on_event(event)


def test_every_map_and_page_gives_an_object_the_same_mark(turns):
    out = io.StringIO()
    screen = ChatScreen(Console(file=out, width=100), echo=True)
    listed = []
    for turn in turns:
        heard(screen, turn)
        record = RunRecord()
        heard(record, turn)
        page = run_page(record.turn)
        legend = re.findall(r'<li><span class="key[^>]*>(\w)</span>([^<]+)</li>', page)
        assert {name: mark for mark, name in legend} == MARKS
        drawing = page.partition('class="candidates"')[2].partition("</svg>")[0]
        assert set(re.findall(r"<text[^>]*>(\w)</text>", drawing)) == set(MARKS.values())
        assert {seen["name"]: seen["number"] for seen in record.report["scene"]["objects"]} == dict(
            zip(MARKS, range(1, 6))
        )
    listed += [
        {name: mark for mark, name in LISTED.findall(line)}
        for line in out.getvalue().splitlines()
        if "candle" in line and "box 2" in line
    ]
    assert len(listed) == 3 and all(one == MARKS for one in listed)  # one for the table and the first proposal
    assert "(A cup 1)" in out.getvalue()  # takes no part in the second and third


def test_every_record_tells_a_place_in_the_same_words(turns):
    perceived, _, chosen = turns[2]
    where = {one.name: place(one.position) for one in perceived.objects}
    goes = {goal["name"]: place(goal["position"]) for goal in chosen.goals}
    facts = {fact.name: fact for fact in object_facts(perceived)}
    assert all(fact.where == f"{fact.place}: {where[name]}" for name, fact in facts.items())
    out, record = io.StringIO(), RunRecord()
    for listener in (TerminalReport(Console(file=out, width=120)), record):
        heard(listener, turns[2])
    page = run_page(record.turn)
    for name, words in where.items():
        assert re.search(rf"^ +{name}\b.* {words}", out.getvalue(), re.M) and words in page
    for name, words in goes.items():
        assert re.search(rf"{name} +goes to +{words}", out.getvalue()) and f"{name} {words}" in page
    for text in (out.getvalue(), page, *(fact.where for fact in facts.values())):
        assert not re.search(r"x -?\d\.\d+ m", text)


def test_the_names_of_the_page_in_three_dimensions_are_those_of_the_report(turns):
    for perceived, proposed, _ in turns:
        scene = proposed.scene
        message = scene_message(1, scene.table, scene.objects, scene.distractors)
        assert [one["name"] for one in message["objects"]] == [one.name for one in perceived.objects]


def test_what_the_picture_takes_an_object_for_does_not_rename_it(turns):
    """ "cup or mug 1" in one line and "object 1" in the next are one object."""
    seen = [
        events.SeenObject("object 1", "cup or mug", True, (0.3, 0.1, 0.05), 300, display_name="cup or mug 1, red, tall",
                          confidence=0.88, number=1),
        events.SeenObject("object 2", "object", True, (0.4, -0.1, 0.05), 300, display_name="object 2, blue", number=2),
    ]  # fmt: skip
    out, record = io.StringIO(), RunRecord()
    chosen = events.Chosen(1, {}, ({"name": "object 1", "position": (0.3, 0.2, 0.05)},), arrangement=None, scene=None)
    perceived = events.Perceived(tuple(seen), (0.18, 0.72, -0.45, 0.45), 0.1, scene=None)
    for listener in (TerminalReport(Console(file=out, width=120)), record):
        listener.on_event(_Told(perceived))
        listener.on_event(_Told(chosen))
    assert "object 1 (cup or mug, 0.88), red, tall" in out.getvalue() and "object 1  goes to" in out.getvalue()
    assert "cup or mug 1" not in out.getvalue() + run_page(record.turn)


class _Told:
    def __init__(self, event):
        self.event = event

    def to_dict(self):
        return self.event.to_dict()
