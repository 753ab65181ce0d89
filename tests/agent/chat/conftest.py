"""Models for all chat tests, loaded once, and a small table to talk about."""

from pathlib import Path

import pytest

from agent.chat.conversation import Conversation
from agent.pipeline.resources import Loaded
from agent.pipeline.run import RunOptions
from tests.agent.event_log import EventLog

DESK = Path(__file__).parent / "desk.yaml"


@pytest.fixture(scope="session")
def loaded() -> Loaded:
    return Loaded()


@pytest.fixture
def sent() -> EventLog:
    return EventLog()


@pytest.fixture
def conversation(loaded, sent):
    """About three cups, two boxes and an orange; the geometric planner, because it is quick and always the same."""
    options = RunOptions(str(DESK), model="geometric")
    with Conversation(options, loaded, [sent]) as conversation:
        yield conversation
