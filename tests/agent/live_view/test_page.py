"""The page in a real browser: what is drawn, what its controls send, and how it fits a phone."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from agent import events
from agent.arm.events import Planned
from agent.chat.view import ChatScreen
from agent.live_view.live_view import LiveView
from agent.live_view.server import ViewServer
from agent.live_view.transcript import page_screen
from agent.pipeline.event_builders import chosen_event, perceived_event
from structdiffusion.geometry import pose_from_xyz_yaw
from structdiffusion.observation import Arrangement

pytest.importorskip("websockets", reason="needs the extra `view`")
DESKTOP, PHONE = (1280, 800), (390, 844)
SHOTS = os.environ.get("STRUCTAGENT_TEST_SHOTS")  # a folder for the pictures, for who wants to look at them
STAGE = (slice(60, 600), slice(40, 840))  # of a desktop's picture, where no control lies over the table


@pytest.fixture
def lines() -> list[str]:
    return []


@pytest.fixture
def server(lines):
    with ViewServer("127.0.0.1", 0, actions={"line": lambda asked: lines.append(asked["line"]) or ""}) as server:
        yield server


@pytest.fixture
def screen(server) -> ChatScreen:
    return page_screen(server, echo=False)


@pytest.fixture
def view(server, table) -> LiveView:
    """Two boxes of which three arrangements are proposed; the second moves them forward, the third to the left."""
    view, scene = LiveView(server, transcript=False), table.look()
    view.on_table(table)
    view.on_event(events.Started("put the boxes in a line", {}))
    view.on_event(perceived_event(scene, 0.1, table))
    motions = [pose_from_xyz_yaw(x, y, 0.0, 0.0) for x, y in ((-0.15, 0.1), (0.2, 0.0), (0.0, 0.2))]
    arrangements = tuple(
        Arrangement(np.tile(motion, (2, 1, 1)), {"total": 0.9 - 0.1 * k}) for k, motion in enumerate(motions)
    )
    candidates = tuple(
        events.Candidate(k + 1, one.scores, ((0.0, 0.0, 0.0),) * 2) for k, one in enumerate(arrangements)
    )
    view.on_event(events.Proposed("geometric", candidates, 0.5, scene=scene, arrangements=arrangements))
    view.on_event(chosen_event(1, arrangements[0], scene))
    choices = [{"label": "Build arrangement 1", "line": "yes"}, {"label": "No", "line": "no"}]
    ask(server, "build it? [y/n] > ", True, choices)
    return view


def ask(server, prompt: str = "> ", choosing: bool = False, choices=()) -> None:
    """Let the server ask for a line, as the chat does."""
    server.publish("asking", {"prompt": prompt, "choices": list(choices), "choosing": choosing, "stopping": False})


@pytest.fixture
def opened(browser, server):
    pages = []

    def opened(size=DESKTOP, address=None):
        page = browser.page()
        pages.append(page)
        page.size(*size, phone=size == PHONE)
        page.open(address or server.access.address)
        page.wait("structagent.state.role !== ''")
        return page

    yield opened
    for page in pages:
        page.close()


def drawn(page, name=""):
    """What the page shows once everything that moves has arrived."""
    page.wait("structagent.scene.frames > 0 && structagent.scene.waiting === 0")
    return page.picture(Path(SHOTS) / f"{name}.png" if SHOTS and name else None)


def changed(before, after) -> int:
    """The number of pixels of the stage that differ."""
    return int((np.abs(before[STAGE].astype(int) - after[STAGE].astype(int)).max(axis=-1) > 24).sum())


def test_the_table_the_arm_the_clouds_and_the_goal_are_drawn(opened, view):
    page = opened()
    page.wait("document.querySelectorAll('#labels span').length === 2")
    whole = drawn(page, "desktop")
    wood = np.abs(whole[STAGE].astype(int) - (200, 180, 155)).max(axis=-1) < 40
    assert wood.mean() > 0.1, "the table is there"
    page.press("#arm")
    without_arm = drawn(page)
    assert changed(whole, without_arm) == 0, "at rest it is nearly transparent: the table is not covered by it"
    assert (whole != without_arm).any(), "the arm is there"
    page.press("#ghosts")
    without_goal = drawn(page)
    assert changed(without_arm, without_goal) > 150, "the goal is there"
    page.value("structagent.scene.setScene({scene: 99, table: [0.18, 0.72, -0.45, 0.45], objects: []})")
    assert changed(without_goal, drawn(page)) > 500, "the clouds are there"
    assert page.errors == []


def test_candidates_are_stepped_through_and_chosen(opened, view, lines):
    page = opened()
    page.press("#arm")
    first = drawn(page)
    assert page.wait("document.getElementById('rank').textContent") == "1 of 3, score 0.90, chosen"
    page.press("#next")
    second = drawn(page)
    assert changed(first, second) > 150
    assert page.value("document.getElementById('rank').textContent").startswith("2 of 3, score 0.80")
    page.press("#next")
    assert changed(second, drawn(page)) > 150
    assert page.value("document.getElementById('next').disabled")
    page.press("#choose")
    page.press("#choices button")
    wait_for_lines(page, lines, ["/choose 3", "yes"])


def places(page) -> dict[str, list[float]]:
    """Where objects are arranged: x, y, and the turn in degrees."""
    line = page.value("structagent.arranging.line()").removeprefix("/arrange ")
    named = [one.rpartition(": ") for one in line.split("; ")]
    return {name: [float(number) for number in numbers.split(", ")] for name, _, numbers in named}


def test_objects_are_dragged_and_become_the_example(opened, server, view, table, lines):
    page = opened()
    drawn(page)
    page.press("#arrange")
    clouds = {cloud.name: cloud.points.mean(axis=0) for cloud in table.look().objects}
    (first, second), before = clouds, places(page)
    for name in clouds:  # the ghosts of the proposal are taken over
        assert np.allclose(before[name][:2], clouds[name][:2] + (-0.15, 0.1), atol=2e-3) and before[name][2] == 0

    def seen(name: str, x: float, y: float) -> tuple[float, float]:
        place = [x, y, float(clouds[name][2])]
        across, down = page.value(f"structagent.scene.seenAt({place})")
        left, top = page.value("(r => [r.left, r.top])(structagent.scene.canvas.getBoundingClientRect())")
        return left + across, top + down

    page.drag(seen(first, *before[first][:2]), seen(first, 0.5, -0.2))
    page.drag(seen(second, *before[second][:2]), tuple(np.add(seen(second, *before[second][:2]), (45, 0))), shift=True)
    after = places(page)
    assert np.allclose(after[first], (0.5, -0.2, 0), atol=5e-3)
    assert np.allclose(after[second], (*before[second][:2], 45), atol=1e-3)
    page.drag(seen(first, *after[first][:2]), seen(first, 5.0, -0.2))
    assert places(page)[first][0] == pytest.approx(0.72), "what is dragged stays on the table"
    drawn(page, "arranging")
    azimuth = page.value("structagent.scene.eye.azimuth")
    page.drag((200.0, 560.0), (260.0, 560.0))
    assert page.value("structagent.scene.eye.azimuth") != azimuth, "beside the objects the view turns"
    line = page.value("structagent.arranging.line()")
    page.press("#like-this")
    wait_for_lines(page, lines, [line])
    assert page.value("document.getElementById('like-this').hidden")
    assert page.value("structagent.scene.ghosts.length") == 2, "the proposal is shown again"
    page.press("#arrange")
    server.publish("asking", {"prompt": "", "choices": [], "choosing": False, "stopping": False})
    page.wait("document.getElementById('arrange').hidden && document.getElementById('like-this').hidden")
    assert page.errors == []


def test_objects_and_the_arm_move(opened, view, table):
    page = opened()
    before = drawn(page)
    place = page.value("document.querySelector('#labels span').style.transform")
    table.world.set_pose(0, pose_from_xyz_yaw(0.0, 0.25, 0.1, 0.5) @ table.poses()[table.names[0]])
    table.arm.teleport(table.arm.configuration() + 0.3)
    assert page.value("structagent.scene.armSeen") < 0.1
    view._show_poses()
    page.wait("structagent.scene.armSeen === 1", 5)
    page.wait(f"document.querySelector('#labels span').style.transform !== {place!r}")
    assert changed(before, drawn(page)) > 3000
    page.wait("structagent.scene.armSeen < 0.1", 10)


def test_the_chat_is_shown_as_text_and_lines_are_sent(opened, view, screen, lines):
    page = opened()
    hostile = '<img src=x onerror="alert(1)"><script>alert(2)</script>'
    screen.note(hostile)
    screen.on_event(events.Asked("object", hostile, (hostile, "cup 1")))
    screen.listing([(hostile, hostile)])
    screen.said(hostile)
    screen.on_event(events.Answered("what is there?", "two objects:\n  cup 1   red\n  cup 22  blue"))
    screen.complain("that cannot be built")
    page.wait("document.querySelector('#log .red')?.textContent === 'that cannot be built'")
    assert page.value("document.querySelectorAll('#log img, #log script').length") == 0
    assert page.value("document.getElementById('log').textContent.split('<script>').length") == 7
    screen.said("bigger")  # the next turn begins: the error is history
    page.wait(
        "!document.querySelector('#log .red') && [...document.querySelectorAll('#log > p')].some(p => p.textContent "
        "=== 'that cannot be built')"
    )
    screen.complain("that cannot be built either")
    page.wait("document.querySelectorAll('#log .red').length === 1")
    cells = page.value(
        "[...[...document.querySelectorAll('#log table')].at(-1).rows].map(r => [...r.cells].map(c => c.textContent))"
    )
    assert cells == [["cup 1", "red"], ["cup 22", "blue"]]
    assert page.value("getComputedStyle(document.querySelector('#log .red')).fontFamily").find("mono") < 0
    page.type("#line", "put the boxes in a circle")
    wait_for_lines(page, lines, ["put the boxes in a circle"])
    assert page.value("document.getElementById('line').value") == ""
    assert page.errors == []


def test_the_second_page_watches_until_it_takes_over(opened, view, lines):
    first, second = opened(), opened()
    second.wait("document.getElementById('role').textContent === 'you watch; another page drives (2 pages)'")
    assert second.value("document.getElementById('form').hidden && document.getElementById('choices').hidden")
    assert second.value("document.getElementById('choose').hidden")
    second.press("#take-over")
    second.wait("!document.getElementById('form').hidden")
    first.wait("document.getElementById('form').hidden")
    assert first.value("structagent.state.role") == "other"


def test_a_phone_shows_everything_within_its_width(opened, view, screen):
    for number in range(30):
        screen.note(f"line {number} of a conversation that is longer than the screen of a phone is high and wide")
    page = opened(PHONE)
    page.wait(
        "document.querySelectorAll('#log p').length >= 30 && document.querySelectorAll('#choices button').length === 2"
    )
    drawn(page, "phone")
    assert page.value("document.documentElement.scrollWidth") <= PHONE[0]
    outside = page.value(
        "[...document.querySelectorAll('button, input, #scene, #log')].filter(e => e.getClientRects().length)"
        ".map(e => [e.id || e.textContent, e.getBoundingClientRect()])"
        f".filter(([, r]) => r.left < 0 || r.right > {PHONE[0]} || r.top < 0 || r.bottom > {PHONE[1]})"
        ".map(([name]) => name)"
    )
    assert outside == []
    last = "(r => r.bottom)(document.querySelector('#log p:last-child').getBoundingClientRect())"
    assert page.value(last) <= page.value("document.getElementById('log').getBoundingClientRect().bottom") + 1
    assert page.value("document.getElementById('scene').clientHeight") > 260
    too_small = page.value(
        "[...document.querySelectorAll('button, input')].filter(e => e.getClientRects().length)"
        ".map(e => [e.id || e.textContent, e.getBoundingClientRect()])"
        ".filter(([, r]) => r.height < 40 || r.width < 40).map(([name]) => name)"
    )
    assert too_small == [], "a finger hits every button"
    over = "((a, b) => a.bottom <= b.top || a.top >= b.bottom)(...['camera', 'scene'].map(box))"
    page.value("window.box = id => document.getElementById(id).getBoundingClientRect()")
    assert page.value(over), "the picture of the camera lies beside the table, not over it"
    assert page.errors == []


def test_without_webgl_the_picture_and_the_chat_work(browser, opened, server, view, screen, lines):
    page = browser.page()
    page.without_webgl()
    page.size(*DESKTOP)
    page.open(server.access.address)
    page.wait("structagent.state.role === 'you' && !document.getElementById('no-webgl').hidden")
    page.wait("document.getElementById('picture').naturalWidth > 0")
    page.press("#next")
    page.type("#line", "bigger")
    wait_for_lines(page, lines, ["bigger"])
    assert page.errors == []
    page.close()


def test_the_printed_address_opens_a_guarded_page_and_hides_its_token(opened):
    with ViewServer("127.0.0.1", 0, token=True, actions={}) as guarded:
        page = opened(address=guarded.access.address)
        assert page.value("location.search") == "" and page.value("document.cookie") == ""
        assert page.errors == []


def test_the_end_is_shown_and_the_last_state_stays(opened, server, view):
    page = opened()
    before = drawn(page)
    server.close()
    page.wait("document.getElementById('role').textContent.startsWith('structagent has ended')")
    assert changed(before, drawn(page)) < 50


def test_a_long_session_keeps_the_page_small(opened, server, view, screen, table):
    page, scene = opened((480, 480)), table.look()
    page.value(
        "(gl => { const make = gl.createBuffer.bind(gl), drop = gl.deleteBuffer.bind(gl); gl.kept = 0;"
        " gl.createBuffer = () => (gl.kept++, make()); gl.deleteBuffer = one => (gl.kept--, drop(one)); })"
        "(structagent.scene.gl)"
    )

    def round_of(name: str) -> tuple[int, int]:
        for number in range(400):
            screen.note(f"note {number}")
            if number % 25 == 0:
                view.on_event(events.Perceived((), (0.18, 0.72, -0.45, 0.45), 0.1, scene=scene))
                page.value("1")  # the page keeps up
        screen.note(name)
        page.wait(f"document.querySelector('#log p:last-child')?.textContent === {name!r}")
        return page.value("structagent.scene.gl.kept"), least_heap()

    def least_heap() -> int:
        """Return the bytes that several collections leave: one alone may come while a picture is being drawn."""
        sizes = []
        for _ in range(5):
            page.value("new Promise(done => setTimeout(done, 100))")
            page.value("gc()")
            sizes.append(page.value("performance.memory.usedJSHeapSize"))
        return min(sizes)

    round_of("first")
    buffers, heap = round_of("second")
    assert round_of("third")[0] == buffers
    assert round_of("fourth")[1] < heap + 200_000, "32 scenes have more than a million bytes"
    assert page.value("document.querySelectorAll('#log p').length") == 600


def wait_for_lines(page, lines, expected) -> None:
    for _ in range(200):
        if lines == expected:
            return
        page.value("new Promise(done => setTimeout(done, 50))")
    assert lines == expected


def test_small_pictures_show_the_best_arrangements_and_choose(opened, view, lines):
    page = opened()
    page.wait("document.querySelectorAll('#thumbnails button').length === 3")
    names = page.value("[...document.querySelectorAll('#thumbnails button')].map(b => b.getAttribute('aria-label'))")
    assert names[0] == "arrangement 1, score 0.90, the best" and names[1].startswith("arrangement 2, score 0.80")
    pixels = page.value(
        "[...document.querySelectorAll('#thumbnails canvas')].map(c => [...c.getContext('2d')"
        ".getImageData(0, 0, c.width, c.height).data].join())"
    )
    assert len(set(pixels)) == 3, "each shows its own arrangement"
    page.press("#thumbnails button:nth-child(2)")
    wait_for_lines(page, lines, ["/choose 2"])


def test_who_watches_only_looks_at_the_small_pictures(opened, view, lines):
    opened()
    watcher = opened()
    watcher.press("#thumbnails button:nth-child(3)")
    watcher.wait("document.getElementById('rank').textContent.startsWith('3 of 3')")
    assert lines == []


def test_no_bar_and_no_small_pictures_beside_a_question_and_while_building(opened, server, view):
    page = opened()
    page.wait("!document.getElementById('candidates').hidden")
    view.on_event(Planned(0, (0, 1), ("side", "side"), 1.0))
    ask(server, prompt="")
    hidden = "document.getElementById('candidates').hidden && document.getElementById('thumbnails').hidden"
    page.wait(hidden)
    assert page.value("structagent.scene.ghosts.length") == 2, "what is being built is seen"
    view.on_event(events.Asked("shape", "Which shape?", ("circle", "line")))
    ask(server, "1-2> ", choices=[{"label": "circle", "line": "1"}, {"label": "line", "line": "2"}])
    page.wait("document.querySelectorAll('#choices button').length === 2")
    assert page.value(hidden) and page.value("structagent.scene.ghosts.length") == 0


def test_what_is_understood_and_checked_stands_in_tables(opened, server, run_events):
    screen = page_screen(server, echo=True)
    for event in run_events:
        screen.on_event(event)
    page = opened()
    page.wait("document.querySelectorAll('#log table.checks tr').length > 0")
    assert page.value("document.querySelector('#log .card h2').textContent").startswith("understood")
    slots = page.value("[...document.querySelector('#log .card table').rows].map(r => r.cells[0].textContent)")
    assert slots == ["shape", "size", "x position", "y position", "rotation"]
    checks = page.value("[...document.querySelector('#log table.checks').rows].map(r => r.className)")
    assert "failed" in checks and set(checks) <= {"passed", "failed"}


def test_a_red_message_goes_when_the_next_turn_begins(opened, server, screen, view):
    page = opened()
    server.publish("refused", {"reason": "not now"})
    page.wait("!document.getElementById('refused').hidden")
    screen.said("put the boxes in a line")
    page.wait("document.getElementById('refused').hidden")


SERVER = """
import sys, time
from agent.live_view.server import ViewServer
from agent.live_view.transcript import page_screen
with ViewServer("127.0.0.1", int(sys.argv[1]), actions={"line": lambda asked: ""}) as server:
    {more}
    print("ready", flush=True)
    time.sleep(600)
"""
OLD = """
    page_screen(server, echo=False).note("of the first start")
    server.publish("candidates", {"scene": 1, "count": 0})
    server.publish("progress", {"stage": "cup 1 is in the hand", "placed": 1, "motions": 3, "outcome": ""})
    server.publish("busy", {"what": "reading"})
    server.publish("refused", {"reason": "not now"})
    server.publish("asking", {"prompt": "build it?", "choosing": True, "stopping": False,
                              "choices": [{"label": "Build arrangement 1", "line": "yes"}]})
"""


def started(port: int, more: str) -> subprocess.Popen[str]:
    """Start a server in a process of its own that tells its pages more."""
    code = SERVER.replace("{more}", more.strip())
    process = subprocess.Popen([sys.executable, "-c", code, str(port)], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None and process.stdout.readline() == "ready\n"
    return process


def test_after_a_kill_and_a_restart_the_page_shows_the_state_that_is(opened):
    with ViewServer("127.0.0.1", 0) as free:
        port = free.access.port
    first = started(port, OLD)
    try:
        page = opened(address=f"http://127.0.0.1:{port}/")
        page.wait("document.querySelectorAll('#choices button').length === 1 && structagent.state.placed === 1")
        first.kill()
        first.wait()
        page.wait("document.getElementById('role').textContent === 'the connection is lost; trying again'")
        unusable = "['form', 'choices', 'take-over', 'stop'].every(id => document.getElementById(id).hidden)"
        assert page.value(unusable), "nothing can be pressed that nobody answers"
    finally:
        first.kill()
        first.wait()
    second = started(port, 'page_screen(server, echo=False).note("of the second start")')
    try:
        page.wait("document.getElementById('log').textContent.includes('of the second start')", 30)
        shown = page.value("document.body.innerText")
        assert "structagent was started again" in shown and "you drive" in shown
        for old in ("of the first start", "Build arrangement 1", "cup 1 is in the hand", "not now", "reading"):
            assert old not in shown
        assert page.value("document.getElementById('bar').hidden && document.getElementById('candidates').hidden")
    finally:
        second.kill()
        second.wait()
