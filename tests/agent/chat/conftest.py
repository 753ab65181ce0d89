"""Models for all chat tests, loaded once, and a small table to talk about; a quick arm and small pictures."""

from dataclasses import replace
from functools import partial, partialmethod
from pathlib import Path

import pytest

from agent.arm.trajectories import trajectory
from agent.chat.conversation import Conversation
from agent.pipeline.proposing import propose_arrangements, propose_goal
from agent.pipeline.resources import ResourceCache
from agent.pipeline.run import RunOptions
from structdiffusion.simulation.depth_camera import BESIDE, VIEWS
from structdiffusion.simulation.world import TabletopWorld
from tests.agent.event_log import EventLog

DESK = Path(__file__).parent / "desk.yaml"


@pytest.fixture(autouse=True)
def quick_arm(monkeypatch):
    """Let the arm move three times as fast as its limits: how it moves is the subject of `tests/agent/arm`."""
    def quick(path, period, limits):
        return trajectory(path, period, 3 * limits)

    monkeypatch.setattr("agent.arm.controller.trajectory", quick)


@pytest.fixture(autouse=True)
def few_candidates(monkeypatch):
    """Propose 16 arrangements and not 64: how good they are is the subject of `tests/structdiffusion`."""
    for propose in (propose_arrangements, propose_goal):
        monkeypatch.setattr(f"agent.chat.build_session.{propose.__name__}", partial(propose, count=16))


@pytest.fixture(autouse=True)
def small_pictures(monkeypatch):
    """Draw pictures of the arm at work with a sixteenth of the pixels; what the camera observes stays as it is."""
    size = {"width": 160, "height": 120}
    monkeypatch.setitem(VIEWS, BESIDE, replace(VIEWS[BESIDE], **size))
    monkeypatch.setattr(TabletopWorld, "picture", partialmethod(TabletopWorld.picture, **size))


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
