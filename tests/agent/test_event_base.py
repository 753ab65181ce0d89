"""One interface for all listeners, for live events and for recorded ones."""

import io

import numpy as np
import pytest
from rich.console import Console

from agent.chat.view import ChatScreen
from agent.event_base import RecordedEvent, json_value, send
from agent.events import Noted, Pictured
from agent.live_view.live_view import LiveView
from agent.reporting.rerun_log import RerunLog
from agent.reporting.run_report import RunRecord
from agent.reporting.session_log import SessionWriter
from agent.reporting.terminal_report import TerminalReport
from tests.agent.event_log import EventLog


@pytest.mark.parametrize("listener", [ChatScreen, LiveView, RerunLog, RunRecord, SessionWriter, TerminalReport])
def test_every_listener_has_the_same_interface(listener):
    assert callable(listener.on_event)
    assert vars(listener).keys().isdisjoint({"__call__", "tell", "take", "watch"})


def test_an_event_is_sent_to_every_listener():
    first, second = EventLog(), EventLog()
    send(Noted("one"), [first, second])
    send(Noted("two"), [first])
    assert first == [Noted("one"), Noted("two")] and second == [Noted("one")]


def test_pictures_are_no_part_of_a_payload():
    assert Pictured("a", "b", np.zeros((2, 2, 3), np.uint8)).to_dict() == {
        "kind": "pictured",
        "name": "a",
        "caption": "b",
    }


def test_numbers_that_are_not_finite_are_null():
    assert json_value({"a": np.array([1.0, np.inf]), "b": (np.float64("nan"), np.int64(3))}) == {
        "a": [1.0, None], "b": [None, 3],
    }  # fmt: skip


@pytest.mark.parametrize("listener", [TerminalReport, ChatScreen])
def test_recorded_events_show_the_same_as_live_ones(run_events, listener):
    shown = []
    for sent in (run_events, [RecordedEvent(event.to_dict()) for event in run_events]):
        screen = listener(Console(file=io.StringIO(), width=100))
        console = screen.console if listener is ChatScreen else screen._console
        for event in sent:
            screen.on_event(event)
        shown.append(console.file.getvalue())
    assert shown[0] == shown[1] != ""
