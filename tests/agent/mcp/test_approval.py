"""Nothing moves before a person has agreed, and a plan is worth what the table is still like."""

import pytest

pytest.importorskip("mcp", reason="needs the extra mcp")

from tests.agent.mcp.conftest import QUICK, Person, data, plan, refusal


def outcomes(served, tool: str) -> list[tuple[str, str]]:
    return [(line["decision"], line["outcome"].partition(":")[0]) for line in served.audit if line["tool"] == tool]


def displace(served) -> None:
    """Move an object by a centimetre while nobody looks."""
    pose = served.world.pose(0)
    pose[0, 3] += 0.01
    served.worker.at_once(lambda: served.world.set_pose(0, pose))


@pytest.mark.parametrize("mode", ["legacy", "auto"])
def test_a_client_that_cannot_ask_moves_nothing(served, mode):
    before = served.poses

    async def conversation(client):
        sentence = await refusal(client, "build", plan_id=await plan(client, "stack the boxes"))
        assert sentence.startswith("nothing was moved, because this client cannot ask a person")
        assert "--approve-all" in sentence

    served.speak(conversation, mode=mode)
    assert served.poses == before and outcomes(served, "build") == [("not needed", "refused")]


@pytest.mark.parametrize("mode", ["legacy", "auto"])
def test_anything_but_a_yes_moves_nothing(served, mode):
    before, questions = served.poses, []

    async def conversation(client):
        offers = (await data(client, "propose", text="put the cups in a line"))["plans"]
        first, second = (offer["plan_id"] for offer in offers[:2])
        for plan_id, person, words in (
            (first, Person("cancel"), "the question was closed without an answer"),
            (first, Person(content={"approve": "please"}), "the client's answer was neither a yes nor a no"),
            (first, Person(content={}), "the client's answer was neither a yes nor a no"),
            (first, Person(content={"approve": False}), "the person declined build"),
            (second, Person("decline"), "the person declined build"),
        ):
            async with served.client(person, mode) as other:
                assert words in await refusal(other, "build", plan_id=plan_id)
            questions.extend(person.asked)
        for plan_id in (first, second):  # nobody is asked about the same plan twice
            assert await refusal(client, "build", plan_id=plan_id) == (
                f"{plan_id} is void because a person declined it; call propose for a new one"
            )

    served.speak(conversation, mode=mode)
    assert served.poses == before and len(questions) == 5
    assert ': a line of "cup 1", "cup 2" and "cup 3"? It moves "cup 1", "cup 2", "cup 3".' in questions[0]
    decisions = {line["decision"] for line in served.audit if line["tool"] == "build"}
    assert decisions == {"not needed", "asked", "dismissed", "declined"}
    assert all(outcome != "started" for _, outcome in outcomes(served, "build"))


@pytest.mark.parametrize("mode", ["legacy", "auto"])
def test_only_the_json_value_true_is_a_yes(served, mode):
    """What many programs would take for true is named and refused, and so is what they would take for false."""
    before = served.poses
    answers = [
        ("true", '"true"'), ("True", '"True"'), ("yes", '"yes"'), ("on", '"on"'), ("1", '"1"'), ("false", '"false"'),
        ("", '""'), (1, "1"), (1.0, "1.0"), (0, "0"), (["true"], '\\u005b\\"true\\"\\u005d'),
        ("true\n<b>", '"true\\n\\u003cb\\u003e"'),
    ]  # fmt: skip

    async def conversation(client):
        plan_id = await plan(client, "stack the boxes")
        for answer, shown in answers:
            async with served.client(Person(content={"approve": answer}), mode) as other:
                assert await refusal(other, "build", plan_id=plan_id) == (
                    f"nothing was moved: the client's answer was neither a yes nor a no, because approve is {shown} "
                    "and not the JSON value true or false; call build to ask again"
                )

    served.speak(conversation, mode=mode)
    assert served.poses == before
    assert not [line for line in served.audit if line["outcome"] == "started" or line["decision"] == "approved"]


def test_plans_are_void_when_the_table_or_the_wish_is_another(served):
    """Build one of two plans, undo it, and propose something else: every earlier plan says why it is void."""

    async def conversation(client):
        offers = (await data(client, "propose", text=QUICK))["plans"]
        first, other = offers[0]["plan_id"], offers[1]["plan_id"]
        built = await data(client, "build", plan_id=first)
        assert built["success"] and built["moved"] == ["orange"] and not built["stopped"]
        assert await refusal(client, "build", plan_id=first) == (
            f"{first} was already used, and a plan can be used only once; call propose for a new one"
        )
        assert f"is void because the table has changed: {first} was built since" in await refusal(
            client, "preview", plan_id=other
        )
        third = await plan(client, "put the orange to the right of box 1")
        assert (await data(client, "undo"))["moved"] == []  # reverts the proposal alone
        assert "a turn was undone since" in await refusal(client, "build", plan_id=third)
        assert (await data(client, "undo"))["moved"] == ["orange"]
        fourth = await plan(client)
        await data(client, "propose", text="put the cups in a line")
        assert "another request came since" in await refusal(client, "build", plan_id=fourth)
        fifth = await plan(client, "put the cups in a line")
        assert (await data(client, "stop"))["stopped"]
        assert "stop dropped the proposal" in await refusal(client, "build", plan_id=fifth)

    before, person = served.poses, Person()
    served.speak(conversation, person)
    assert served.stands_at(before)
    assert len(person.asked) == 2 and person.asked[1].startswith('Undo the last turn? This puts back "orange" (')
    assert [pair for pair in outcomes(served, "build") if pair[0] != "not needed"] == [
        ("approved", "started"), ("approved", "done")
    ]  # fmt: skip
    assert outcomes(served, "undo") == [
        ("not needed", "done"), ("approved", "started"), ("approved", "done")
    ]  # fmt: skip


def test_a_table_that_was_changed_unseen_makes_a_plan_void(served):
    async def conversation(client):
        plan_id = await plan(client, "stack the boxes")
        displace(served)
        assert "is void because the table has changed since" in await refusal(client, "build", plan_id=plan_id)

    served.speak(conversation, Person())


def test_undo_that_was_allowed_for_another_table_is_refused(served):
    """Between the question and the answer another client changes what would be undone."""

    class Meddler(Person):
        async def __call__(self, context, params):
            async with served.client() as other:
                await data(other, "stop")
            return await super().__call__(context, params)

    async def conversation(client):
        await plan(client, "stack the boxes")
        displace(served)
        assert await refusal(client, "undo") == "the table has changed since you were asked; call undo again"

    person = Meddler()
    served.speak(conversation, person)
    assert len(person.asked) == 1


def test_what_cannot_be_logged_does_not_move(served, monkeypatch):
    import os

    from agent.mcp import audit

    async def conversation(client):
        plan_id = await plan(client, "stack the boxes")
        write = os.write

        def full(descriptor, content):
            if b'"started"' in content:
                raise OSError(28, "No space left on device")
            return write(descriptor, content)

        monkeypatch.setattr(audit.os, "write", full)
        assert "cannot write the audit log" in await refusal(client, "build", plan_id=plan_id)

    before = served.poses
    served.speak(conversation, Person())
    assert served.poses == before
