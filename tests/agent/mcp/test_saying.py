"""The tool say reaches the build that is under way: read at once, built from the next safe point on,
approved by a person.
"""

import anyio
import pytest

pytest.importorskip("mcp", reason="needs the extra mcp")

from agent.chat.interjections import Moment
from agent.errors import UsageError
from agent.mcp.interjections import MOST_WAITING, SaidByClients
from tests.agent.mcp.conftest import Person, data, plan, refusal

LINE = "put the cups in a line on the right"


async def building(client, text, *said):
    """Build a plan for a text, and call say when the first object is in the hand; return its results,
    and the build's.
    """
    plan_id = await plan(client, text)
    holding, results = anyio.Event(), {}

    async def progress(number, total, message):
        if message.startswith("picked"):
            holding.set()

    async def build():
        results["build"] = (
            await client.call_tool("build", {"plan_id": plan_id}, progress_callback=progress)
        ).structured_content

    async with anyio.create_task_group() as group:
        group.start_soon(build)
        await holding.wait()
        results["said"] = [await client.call_tool("say", {"text": text}) for text in said]
    return [one.structured_content or one.content[0].text for one in results["said"]], results["build"]


def test_a_correction_is_built_from_the_next_safe_point_on(served):
    async def conversation(client):
        (said,), built = await building(client, LINE, "make it a circle instead")
        assert said["outcome"] == "changed" and "takes effect after" in said["message"]
        assert said["wish"] == built["wish"] == 'a circle of "cup 1", "cup 2" and "cup 3" (right)'
        assert built["success"] and built["said"] == ["make it a circle instead"] and not built["unread"]
        assert (await data(client, "report"))["instruction"] == "make it a circle instead"

    person = Person()
    served.speak(conversation, person)
    assert person.asked[1].startswith('Let the robot arm take this while it builds: "make it a circle instead"?')
    assert [line["outcome"] for line in served.audit if line["tool"] == "say"] == ["started", "done"]


def test_questions_waiting_and_stopping_need_no_approval(served):
    async def conversation(client):
        said, built = await building(client, LINE, "wait", "what are you doing?", "go on", "stop")
        assert [one["outcome"] for one in said] == ["waits", "answered", "goes on", "stops"]
        assert said[1]["answer"].startswith("I am building a line of")
        assert not built["success"] and built["stopped"]
        assert (await data(client, "look"))["held"] is None

    person = Person()
    served.speak(conversation, person)
    assert len(person.asked) == 1


def test_what_a_person_declines_changes_nothing(served):
    answers = iter([True, False])

    class Choosy(Person):
        async def __call__(self, context, params):
            self._content = {"approve": next(answers)}
            return await super().__call__(context, params)

    async def conversation(client):
        (said,), built = await building(client, "stack the boxes", "put them on the left")
        assert said == "nothing was changed: the person declined say; ask what should be different"
        assert built["success"] and "tower" in built["wish"] and not built["said"]

    served.speak(conversation, Choosy())


def test_without_a_build_there_is_nothing_to_say(served):
    async def conversation(client):
        assert await refusal(client, "say", text="faster") == (
            "nothing is being built; call propose with what the person said"
        )

    served.speak(conversation, Person())


def test_lines_that_nobody_reads_are_not_piled_up():
    said = SaidByClients()
    waiting = [said.say(f"line {number}") for number in range(MOST_WAITING)]
    with pytest.raises(UsageError, match="16 lines wait to be read"):
        said.say("one more")
    assert said.next(Moment()) == "line 0" and not waiting[0].done()
    said.hear("event")
    assert said.next(Moment()) == "line 1" and waiting[0].result() == ["event"]
    said.close()
    assert waiting[1].result() == []
    with pytest.raises(UsageError, match="the build has ended meanwhile"):
        waiting[2].result()
