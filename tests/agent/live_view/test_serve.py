"""A whole chat through the real server: two pages, one of them drives, and the arm is stopped from the page."""

import io
import os
import signal
import threading
from dataclasses import replace
from functools import partialmethod

import pytest

from agent.arm.trajectories import trajectory
from agent.chat.run import converse
from agent.cli.app import command_line
from agent.errors import DONE, USAGE
from agent.live_view.driver_lines import DriverLines
from agent.live_view.live_view import LiveView
from agent.live_view.server import ViewServer
from agent.live_view.transcript import page_screen
from agent.pipeline.run import RunOptions
from agent.reporting.session_reader import read_session
from structdiffusion.simulation.depth_camera import BESIDE, VIEWS
from structdiffusion.simulation.world import TabletopWorld
from tests.agent.chat.conftest import DESK
from tests.agent.live_view.conftest import Client, get

pytest.importorskip("websockets", reason="needs the extra `view`")
LONG = 120.0  # s that a proposal or a motion may take on a busy machine


@pytest.fixture(autouse=True)
def quick_arm_and_small_pictures(monkeypatch):
    """As in the tests of the chat: the arm twice as fast, pictures with a sixteenth of the pixels."""
    size = {"width": 160, "height": 120}
    monkeypatch.setattr(
        "agent.arm.controller.trajectory", lambda path, period, limits: trajectory(path, period, 2 * limits)
    )
    monkeypatch.setitem(VIEWS, BESIDE, replace(VIEWS[BESIDE], **size))
    monkeypatch.setattr(TabletopWorld, "picture", partialmethod(TabletopWorld.picture, **size))


class Drive(threading.Thread):
    """What people do with the pages, in a thread, for the chat needs the main one; its error is raised at the end."""

    def __init__(self, act) -> None:
        super().__init__(daemon=True)
        self._act, self.error = act, None
        self._over = threading.Event()

    def run(self) -> None:
        try:
            self._act()
        except BaseException as error:
            self.error = error
        finally:
            # Ctrl-C in the terminal ends the chat; while a prompt is being made it ends that alone: press it again.
            os.kill(os.getpid(), signal.SIGINT)
            while not self._over.wait(5.0):
                os.kill(os.getpid(), signal.SIGINT)

    def finish(self) -> None:
        self._over.set()
        self.join(LONG)
        if self.error is not None:
            raise self.error


def asked(page, prompt: str):
    """Wait until the page is asked with a prompt that begins so."""
    return page.until(lambda message: message["kind"] == "asking" and message["prompt"].startswith(prompt), LONG)


def test_a_chat_with_two_pages(tmp_path):
    lines = DriverLines(files=True)
    session = tmp_path / "session.jsonl"
    with ViewServer("127.0.0.1", 0, actions=lines.actions) as server:
        screen = page_screen(server, echo=False)
        lines.show_on(server, screen.said)

        def act() -> None:
            driver = Client(server)
            (first,) = asked(driver, "> ")["choices"]
            assert first["line"] == "put the cups in a small circle on the left"
            watcher = Client(server)
            driver.send(kind="line", line="put the cups in a circle on the left")
            choices = asked(driver, "build it?")
            assert [one["line"] for one in choices["choices"]] == ["yes", "/again", "no"] and choices["choosing"]
            assert driver.of("candidates")[-1]["count"] > 1 and driver.of("chosen")[-1]["rank"] == 1
            driver.send(kind="line", line="/choose 2")
            assert asked(driver, "build it?")["choices"][0]["label"] == "Build arrangement 2"
            assert driver.of("chosen")[-1]["rank"] == 2
            watcher.until(lambda message: message["kind"] == "chosen" and message["rank"] == 2, LONG)
            assert "understood" in watcher.text and "> put the cups in a circle on the left" in watcher.text
            watcher.send(kind="line", line="yes")
            assert "take over" in watcher.until("refused")["reason"]

            watcher.send(kind="take_over")
            watcher.until(lambda message: message.get("driver") == "you")
            driver.until(lambda message: message.get("driver") == "other")
            driver.close()
            watcher.send(kind="line", line="yes")
            watcher.until(lambda message: message["kind"] == "progress" and "in the hand" in message["stage"], LONG)
            poses = [watcher.until("poses", LONG) for _ in range(6)]
            assert poses[0]["links"] != poses[-1]["links"], "the arm is seen to move"
            watcher.send(kind="stop")
            asked(watcher, "> ")
            assert "interrupted" in watcher.text and "stopped " in watcher.text
            assert watcher.of("asking")[-2]["stopping"]
            assert [one["line"] for one in watcher.of("asking")[-1]["choices"]] == ["/again", "/undo"]

            watcher.send(kind="line", line="/undo")
            asked(watcher, "> ")
            assert watcher.of("candidates")[-1] == {"kind": "candidates", "scene": 2, "count": 0}, "its ghosts are gone"
            for pose in watcher.of("poses")[-1]["objects"].values():
                assert pose[:3] == pytest.approx([0, 0, 0], abs=2e-3), "everything is where it was seen"
            watcher.send(kind="line", line="/reset")
            asked(watcher, "> ")
            assert watcher.of("entry")[-1]["style"] == "dim" and "reset: " in watcher.text
            watcher.send(kind="line", line="/load nowhere.yaml")
            asked(watcher, "> ")
            assert "nowhere.yaml" in watcher.text
            watcher.close()

        drive = Drive(act)
        drive.start()
        options = RunOptions(str(DESK), model="geometric", hold="weld")
        code = converse(options, screen, session, lines.answer_for, False, io.StringIO(), LiveView(server, False))
        drive.finish()
    assert code == DONE
    kinds = [line.event["kind"] for line in read_session(session).lines if line.event is not None]
    assert {"started", "proposed", "chosen", "planned", "picked", "stopped", "restored"} <= set(kinds)


def address_in(capsys) -> str:
    """The address that a command printed to standard error."""
    said = capsys.readouterr().err
    return next(line.removeprefix("live view: ") for line in said.splitlines() if line.startswith("live view: "))


def test_chat_with_a_view_shows_the_same_and_lets_nobody_drive(tmp_path, monkeypatch, capsys):
    seen = {}

    class Lines(io.StringIO):
        """Standard input, whose first line comes after a page has opened."""

        def readline(self, *arguments):
            if "page" not in seen:
                port = int(address_in(capsys).rstrip("/").rpartition(":")[2])
                server = type("Server", (), {"access": type("Access", (), {"port": port})})
                seen["page"] = Client(server)
                seen["page"].until(lambda message: message.get("driver") == "terminal")
                return "put the boxes in a line\n"
            seen["page"].until("candidates", LONG)
            return ""

        def reconfigure(self, **_):
            """Do what a text stream does."""

    monkeypatch.setattr("sys.stdin", Lines())
    arguments = ["chat", "--view", "--scene", str(DESK), "--model", "geometric", "--out", str(tmp_path / "out")]
    assert command_line(arguments) == DONE
    page = seen["page"]
    assert {"scene", "arm", "poses", "picture"} <= {message["kind"] for message in page.messages}
    assert "> put the boxes in a line" in page.text
    page.close()


def test_run_with_a_view_shows_the_table_and_the_goal(tmp_path, monkeypatch, capsys):
    kept = []
    publish = ViewServer.publish
    monkeypatch.setattr(
        ViewServer, "publish", lambda self, kind, payload: kept.append(kind) or publish(self, kind, payload)
    )
    arguments = [
        "run",
        "put the boxes in a line",
        "--view",
        "--no-execute",
        "--scene",
        str(DESK),
        "--model",
        "geometric",
    ]
    assert command_line([*arguments, "--out", str(tmp_path / "out")]) == DONE
    assert kept.index("arm") < kept.index("poses") and {
        "scene",
        "candidates",
        "chosen",
        "progress",
        "entry",
        "picture",
    } <= set(kept)
    address = address_in(capsys)
    with pytest.raises(OSError):  # the view ends with the command
        get(address)


@pytest.mark.parametrize("command", [["serve"], ["chat", "--view"], ["run", "stack the cans", "--view"]])
def test_without_the_extra_one_sentence_names_it(command, tmp_path, monkeypatch, capsys):
    import sys

    for module in [name for name in sys.modules if name.partition(".")[0] == "websockets"]:
        monkeypatch.setitem(sys.modules, module, None)
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(b"")))
    assert command_line([*command, "--out", str(tmp_path / "out")]) == USAGE
    said = capsys.readouterr().err
    assert said == "structagent: the live view needs the package websockets: pip install 'structagent[view]'\n"
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(("more", "anywhere"), [([], False), (["--any-file"], True)])
def test_pages_name_files_of_the_session_and_of_the_working_folder(tmp_path, monkeypatch, more, anywhere):
    given = []
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("agent.live_view.serve.converse", lambda *arguments: given.append(arguments[-1]) or DONE)
    assert command_line(["serve", "--port", "0", "--out", "out", *more]) == DONE
    assert given[0].folders == (None if anywhere else (tmp_path / "out", tmp_path))


def test_a_port_in_use_is_told_before_anything_is_loaded(tmp_path, watched, capsys):
    port = str(watched.access.port)
    assert command_line(["serve", "--port", port, "--out", str(tmp_path / "out")]) == USAGE
    assert f"port {port} of 127.0.0.1 is in use" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_the_screen_of_the_page_says_nothing_of_keys():
    server = type("Server", (), {"publish": lambda *_: None})()
    assert page_screen(server, echo=False).keys == "" and "Ctrl" not in page_screen(server, echo=False)._at_work
