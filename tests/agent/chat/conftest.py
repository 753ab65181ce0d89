"""Models for all chat tests, loaded once, and a small table to talk about; a quick arm and small pictures."""

from dataclasses import replace
from functools import partial, partialmethod
from pathlib import Path

import pytest

from agent.chat.conversation import Conversation
from agent.pipeline.proposing import propose_arrangements, propose_goal
from agent.pipeline.resources import ResourceCache
from agent.pipeline.run import RunOptions
from structdiffusion.simulation.depth_camera import BESIDE, VIEWS
from structdiffusion.simulation.world import TabletopWorld
from tests.agent.event_log import EventLog
from tests.grounding.scripted_reader import ScriptedReader

DESK = Path(__file__).parent / "desk.yaml"


@pytest.fixture(autouse=True)
def quick_arm(quick_arm):
    """Let the arm move quickly in every test."""


@pytest.fixture(autouse=True)
def few_candidates(monkeypatch):
    """Propose 16 arrangements and not 64: how good they are is the subject of `tests/structdiffusion`."""
    for propose in (propose_arrangements, propose_goal):
        monkeypatch.setattr(f"agent.chat.proposal_session.{propose.__name__}", partial(propose, count=16))


@pytest.fixture(autouse=True)
def small_pictures(monkeypatch):
    """Draw pictures of the arm at work with a sixteenth of the pixels; what the camera observes stays as it is."""
    size = {"width": 160, "height": 120}
    monkeypatch.setitem(VIEWS, BESIDE, replace(VIEWS[BESIDE], **size))
    monkeypatch.setattr(TabletopWorld, "picture", partialmethod(TabletopWorld.picture, **size))


@pytest.fixture(scope="session")
def cache() -> ResourceCache:
    return ResourceCache()


# What the sentences of the tests mean on the desk: cups 0 to 2 (red, green, purple), boxes 3 and 4, the orange 5.
MEANINGS = {
    "put the cups in a small circle on the left": "circle of 0, 1, 2, small, left",
    "put the cups in a circle on the left": "circle of 0, 1, 2, left",
    "put the cups in a circle": "circle of 0, 1, 2",
    "put the cups in a line": "line of 0, 1, 2",
    "put the cups in a row": "line of 0, 1, 2",
    "stack the boxes": "tower of 3, 4",
    "stack the boxes on the right": "tower of 3, 4, right",
    "put the boxes in a line on the left": "line of 3, 4, left",
    "put the orange to the left of box 1": "5 left of 3",
    "circle of 0, 1, 2, small, left > now as a line": "line of 0, 1, 2, small, left",
    "tower of 3, 4, right > now a line": "line of 3, 4, right",
    "put everything in a line with gaps of 30 cm": "line of everything else, gap 30 cm",
    "put cup 2 and the orange in a line": "line of 1, 5",
    "make a line of the cups and box 1": "line of 0, 1, 2, 3",
    "make a line of the cups and box 2": "line of 0, 1, 2, 4",
    "make it a line": "line of 0, 1, 2, right",
    "again, please, as a line": "line of 0, 1, 2, small, left",
    "put the cups": "? " + " | ".join(f"{shape} of 0, 1, 2" for shape in ("circle", "line", "tower")),
    "hello, can you put the cups in a line?": "line of 0, 1, 2",
    "thanks, what about a circle?": "circle of 0, 1, 2",
    "who won the football match?": "-",
    "what a nice day": "-",
    "make something nice with the cups": "? circle of 0, 1, 2 | line of 0, 1, 2 | tower of 0, 1, 2",
}  # fmt: skip


@pytest.fixture
def told(cache, monkeypatch):
    """Tell a conversation what sentences mean, besides `MEANINGS`; see `ScriptedReader`."""

    def tell(meanings):
        script = MEANINGS | meanings
        monkeypatch.setattr(
            cache, "interpreter", lambda options: ScriptedReader(script, options.viewpoint, cache.encoder)
        )

    tell({})
    return tell


@pytest.fixture
def sent() -> EventLog:
    return EventLog()


@pytest.fixture
def hold():
    """How the hand holds in a conversation; a test may be parametrised with another way."""
    return "weld"


@pytest.fixture
def conversation(cache, sent, hold):
    """About three cups, two boxes and an orange; the geometric planner, because it is quick and always the same.

    The hand is joined to what it holds: to press by friction the engine takes four times as many iterations a step, and
    how the hand holds is the subject of `tests/agent/arm`.
    """
    options = RunOptions(str(DESK), model="geometric", hold=hold)
    with Conversation(options, cache, [sent]) as conversation:
        yield conversation
