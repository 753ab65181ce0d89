"""Models for all chat tests, loaded once, and a small table to talk about."""

from pathlib import Path

import pytest

from agent.chat.conversation import Conversation
from agent.pipeline.resources import Loaded
from agent.pipeline.run import RunOptions

DESK = Path(__file__).parent / "desk.yaml"


@pytest.fixture(scope="session")
def loaded() -> Loaded:
    return Loaded()


@pytest.fixture
def heard() -> list:
    return []


@pytest.fixture
def conversation(loaded, heard):
    """About three cups, two boxes and an orange; the geometric planner, because it is quick and always the same."""
    options = RunOptions(str(DESK), model="geometric")
    with Conversation(options, loaded, heard.append) as conversation:
        yield conversation
