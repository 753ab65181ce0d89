"""A plan is built once, and only on the table that it was made for."""

import numpy as np
import pytest

from agent import events
from agent.errors import UsageError
from agent.mcp.plans import PlanLedger

POSES = {"cup": np.eye(4)}


@pytest.fixture
def ledger():
    return PlanLedger()


def issue(ledger):
    return ledger.issue(events.Proposed("geometric", (), 0.1, scene=None, arrangements=()), 1, "a line", (), POSES)


def test_a_plan_is_taken_once(ledger):
    plan = issue(ledger)
    assert plan.id == "plan-1" and ledger.look_up("plan-1") is plan and ledger.take("plan-1") is plan
    used = "plan-1 was already used, and a plan can be used only once; call propose for a new one"
    with pytest.raises(UsageError, match=f"^{used}$"):
        ledger.take("plan-1")


def test_an_unknown_plan_is_refused_with_those_that_there_are(ledger):
    with pytest.raises(UsageError, match='^there is no plan "plan-1"; there is none now; call propose for one$'):
        ledger.look_up("plan-1")
    issue(ledger), issue(ledger)
    with pytest.raises(UsageError, match=r'^there is no plan "x+\.\.\."; legal: plan-1, plan-2$'):
        ledger.look_up("x" * 10_000)


def test_a_void_plan_says_what_happened_first(ledger):
    issue(ledger), issue(ledger)
    ledger.drop("plan-1", "a person declined it")
    ledger.drop_all("the table has changed")
    with pytest.raises(UsageError, match="^plan-1 is void because a person declined it; call propose for a new one$"):
        ledger.take("plan-1")
    with pytest.raises(UsageError, match="^plan-2 is void because the table has changed; "):
        ledger.take("plan-2")


def test_only_what_was_forgotten_long_ago_is_unknown(ledger):
    for _ in range(1100):
        ledger.drop(issue(ledger).id, "it was a test")
    with pytest.raises(UsageError, match='there is no plan "plan-1"'):
        ledger.look_up("plan-1")
    with pytest.raises(UsageError, match="plan-1100 is void"):
        ledger.look_up("plan-1100")


def test_a_plan_fits_the_poses_that_it_was_made_for(ledger):
    plan = issue(ledger)
    moved = np.eye(4)
    moved[0, 3] = 1e-4
    assert plan.fits({"cup": np.eye(4)}) and not plan.fits({"cup": moved}) and not plan.fits({})
