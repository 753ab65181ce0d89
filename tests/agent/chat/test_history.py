"""What undo keeps of a turn: everything that it restores, in little memory."""

import pickle
from dataclasses import replace

import numpy as np
import pytest

from agent.chat.history import History
from agent.chat.state import Proposal, Situation
from agent.events import Candidate, Proposed
from grounding.dialogue.state import Dialogue
from grounding.goals.goal import Goal
from grounding.spec import StructureSpec
from structdiffusion.observation import Arrangement

MOST = 300_000  # bytes of a turn; the picture alone has 921,600


@pytest.fixture
def proposal(scene) -> Proposal:
    """64 arrangements before a camera of 640 by 480 pixels, whose picture has noise on a table in four shades."""
    rng = np.random.default_rng(0)
    picture = np.zeros((480, 640, 3), np.uint8) + np.repeat(np.uint8([40, 80, 120, 200]), 120)[:, None, None]
    picture[100:140, 100:140] = rng.integers(0, 255, (40, 40, 3))
    seen = replace(scene, color=picture)
    arrangements = (Arrangement(np.tile(np.eye(4), (3, 1, 1)), {"total": 0.5}),) * 64
    candidates = tuple(Candidate(rank, {"total": 0.5}, ((0.1, 0.2, 0.3),) * 3, (0.0,) * 3) for rank in range(1, 65))
    return Proposal(
        Goal(), StructureSpec("circle"), seen, Proposed("geometric", candidates, 1.0, seen, arrangements), 64
    )


def situation(name: str, proposal: Proposal | None, shown: Proposal | None) -> Situation:
    return Situation(Dialogue(), (name,), {name: np.eye(4)}, proposal, shown=shown)


def test_a_turn_is_kept_small_and_comes_back_whole(proposal):
    history, present = History(), situation("now", None, None)
    before = situation("before", proposal, proposal)
    history.remember(before)
    for _ in range(4):  # declined, so that only what was shown is left
        history.remember(situation("before", None, pickle.loads(pickle.dumps(proposal))))
    size = len(pickle.dumps(history)) / 5
    print({"bytes_a_turn": round(size)})
    assert size < MOST
    for _ in range(4):
        present = history.undo(present)
        assert present.proposal is None and np.array_equal(present.shown.scene.color, proposal.scene.color)
    present = history.undo(present)
    assert present.shown is present.proposal and present.proposal.scene is present.proposal.proposed.scene
    assert np.array_equal(present.proposal.scene.color, proposal.scene.color)
    assert present.proposal.chosen.scene.objects == before.proposal.scene.objects
    assert history.undo(present) is None


def test_redo_ends_with_a_new_turn(proposal):
    history = History()
    first, second = (situation(name, proposal, replace(proposal, rank=2)) for name in ("one", "two"))
    assert history.undo(first) is None and history.last_poses is None
    history.remember(first)
    assert list(history.last_poses) == ["one"]
    assert history.undo(second).objects == ("one",)
    again = history.redo(first)
    assert (again.objects, again.proposal.rank, again.shown.rank) == (("two",), 1, 2)
    assert np.array_equal(again.shown.scene.color, proposal.scene.color)
    history.undo(again)
    history.remember(first)
    assert history.redo(first) is None


def test_every_turn_stays_reachable_and_a_second_way_on_is_a_branch():
    history, left = History(), [situation(name, None, None) for name in ("start", "one", "two", "other")]
    first = history.remember(left[0], "first")
    second = history.remember(left[1], "second")
    assert history.undo(left[2]).names == ("one",) and history.present == 1
    other = history.remember(left[1], "other")
    assert [(one.number, one.after, one.branch) for one in (first, second, other)] == [(1, 0, 1), (2, 1, 1), (3, 1, 2)]
    assert history.redo(left[3]) is None
    assert history.go_to(2, left[3]).names == ("two",) and history.go_to(3, left[2]).names == ("other",)
    assert history.go_to(0, left[3]).names == ("start",) and history.last_poses is None
    assert [history.situation_of(number, left[0]).names[0] for number in range(4)] == ["start", "one", "two", "other"]


def test_a_fork_lets_the_first_that_follows_begin_a_branch():
    history, here = History(), situation("here", None, None)
    history.remember(here, "first")
    assert history.fork() == 2
    assert history.remember(here, "second").branch == 2 and history.remember(here, "third").branch == 2
