"""Cancelling a call, or the tool stop, halts the arm at once; it then sets down what it holds and folds."""

import threading
import time

import anyio
import pytest

pytest.importorskip("mcp", reason="needs the extra mcp")

from agent.arm.controller import ArmDriver
from agent.arm.motion_planner import PlanningScene
from agent.mcp.worker import Job
from structdiffusion.simulation.world import TIME_STEP
from tests.agent.mcp.conftest import Person, data, plan, refusal, serving

LIMIT = 0.5  # s until the arm stands still: of the processor from the cancellation, of the arm from Job.stop
STILL = 0.02  # rad/s


@pytest.fixture
def halted(monkeypatch, served):
    """Notes, when the arm has halted, the processor's time, the arm's time since its job was told to stop, and the
    fastest joint. The arm's time does not count from the cancellation: the simulated arm is faster than a real one, and
    how many steps it takes while the message travels depends on the load of the machine."""
    notes, steps, told = [], [], []
    halt, step, stop = ArmDriver.halt, ArmDriver.step, Job.stop

    def stopped(job):
        told.append(len(steps))
        stop(job)

    def counted(driver):
        step(driver)
        steps.append(driver.arm)

    def noted(driver):
        halt(driver)
        before = driver.arm.configuration()
        counted(driver)
        speed = abs(driver.arm.configuration() - before).max() / TIME_STEP
        notes.append((time.process_time(), (len(steps) - told[0]) * TIME_STEP, speed))

    monkeypatch.setattr(Job, "stop", stopped)
    monkeypatch.setattr(ArmDriver, "step", counted)
    monkeypatch.setattr(ArmDriver, "halt", noted)
    return notes, steps


@pytest.mark.parametrize("how", ["cancel", "stop"])
def test_the_arm_halts_within_half_a_second(served, halted, how):
    notes, steps = halted

    async def conversation(client):
        plan_id = await plan(client)
        holding, scope = anyio.Event(), anyio.CancelScope()
        results, began = [], []

        async def progress(number, total, message):
            if message.startswith('picked "orange"'):
                holding.set()

        async def build():
            with scope:
                results.append(await client.call_tool("build", {"plan_id": plan_id}, progress_callback=progress))

        async with anyio.create_task_group() as group:
            group.start_soon(build)
            await holding.wait()
            count = len(steps)
            while len(steps) < count + 20:  # the arm carries the orange
                await anyio.sleep(0.001)
            assert await refusal(client, "look") == (
                f"the table is busy: {plan_id} is being built; wait until that is done, or call stop"
            )
            began.append(time.process_time())
            if how == "cancel":
                scope.cancel()
            else:
                stopped = await data(client, "stop")
                assert stopped == {"stopped": True, "message": f"stopped while {plan_id} is being built"}
        while not notes or served.worker.job is not None:
            await anyio.sleep(0.01)
        (cpu, arm_time, speed), *_ = notes
        assert cpu - began[0] < LIMIT and arm_time < LIMIT and speed < STILL
        if how == "stop":
            assert results[0].structured_content["stopped"] and not results[0].structured_content["success"]
            assert results[0].structured_content["message"] == "interrupted"
        seen = await data(client, "look")
        assert seen["held"] is None and not seen["fallen"] and served.table._talk.table.tidy
        assert "was already used" in await refusal(client, "build", plan_id=plan_id)

    served.speak(conversation, Person())
    (last,) = [line for line in served.audit if line["tool"] == "build" and line["decision"] == "approved"][1:]
    assert last["outcome"] == ("cancelled" if how == "cancel" else "done")


def test_a_client_that_goes_away_stops_the_arm(tmp_path, models, monkeypatch):
    """With --approve-all, which asks nobody."""
    halts = []
    halt = ArmDriver.halt
    monkeypatch.setattr(ArmDriver, "halt", lambda driver: halts.append(halt(driver)))

    async def conversation(client):
        plan_id = await plan(client)
        moving = anyio.Event()

        async def progress(number, total, message):
            if message.startswith('picked "orange"'):
                moving.set()

        async def build(other):
            await other.call_tool("build", {"plan_id": plan_id}, progress_callback=progress)

        async with anyio.create_task_group() as group, served.client() as other:
            group.start_soon(build, other)
            await moving.wait()
            group.cancel_scope.cancel()
        while not halts or served.worker.job is not None:
            await anyio.sleep(0.01)
        assert (await data(client, "look"))["held"] is None

    with serving(tmp_path, models, approve_all=True) as served:
        served.speak(conversation)
        lines = [line for line in served.audit if line["tool"] == "build"]
    assert {line["decision"] for line in lines} == {"approved by --approve-all"}
    assert [line["outcome"] for line in lines] == ["started", "cancelled"]


def test_stop_drops_what_is_open(served):
    async def conversation(client):
        nothing = await data(client, "stop")
        assert not nothing["stopped"] and nothing["message"].startswith("there is nothing to stop")
        asked = await data(client, "propose", text="put the cups")
        assert asked["status"] == "question" and "circle" in asked["options"] and not asked["plans"]
        assert (await data(client, "stop"))["message"] == "the question is dropped; nothing was moved"
        await data(client, "propose", text="put the cups")
        assert (await data(client, "propose", text="line"))["wish"] == 'a line of "cup 1", "cup 2" and "cup 3"'

    served.speak(conversation)


@pytest.mark.parametrize("how", ["cancel", "stop"])
def test_a_search_for_a_plan_ends_within_half_a_second(served, monkeypatch, how):
    """A search that would never end, because every motion that it tries collides."""
    searching, ended = threading.Event(), []

    def endless(self, *_, **__):
        searching.set()
        try:
            while True:
                self.collides(self.kinematics.folded)
        finally:
            ended.append(time.process_time())

    async def conversation(client):
        plan_id = await plan(client)
        scope = anyio.CancelScope()

        async def build():
            with scope:
                await client.call_tool("build", {"plan_id": plan_id})

        monkeypatch.setattr(PlanningScene, "plan", endless)
        async with anyio.create_task_group() as group:
            group.start_soon(build)
            while not searching.is_set():
                await anyio.sleep(0.01)
            began = time.process_time()
            if how == "cancel":
                scope.cancel()
            else:
                stopped = await data(client, "stop")
                assert stopped == {"stopped": True, "message": f"stopped while {plan_id} is being built"}
        while served.worker.job is not None:
            await anyio.sleep(0.01)
        assert ended[0] - began < LIMIT
        seen = await data(client, "look")
        assert seen["held"] is None and served.table._talk.table.tidy

    served.speak(conversation, Person())
