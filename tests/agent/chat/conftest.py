"""Models for all chat tests, loaded once, and a small table to talk about."""

from pathlib import Path

import pytest

from agent.chat.conversation import Conversation
from agent.pipeline.resources import ResourceCache
from agent.pipeline.run import RunOptions
from tests.agent.event_log import EventLog

DESK = Path(__file__).parent / "desk.yaml"


@pytest.fixture(scope="session")
def cache() -> ResourceCache:
    return ResourceCache()


@pytest.fixture
def sent() -> EventLog:
    return EventLog()


@pytest.fixture
def conversation(cache, sent):
    """About three cups, two boxes and an orange; the geometric planner, because it is quick and always the same."""
    options = RunOptions(str(DESK), model="geometric")
    with Conversation(options, cache, [sent]) as conversation:
        yield conversation
