"""Define what the tools return: their JSON schemas are made from these models, and clients get both.

In sentences, names of objects stand in quotes (`agent.mcp.quoting`); a field that is a name has it as it is.
"""

from __future__ import annotations

from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field

Position = tuple[float, float, float]
_POSITION = "x, y, z of its middle in metres; x points away from the robot, y to its left, z up from the table top"


class Result(BaseModel):
    """What a tool returns."""

    model_config = ConfigDict(frozen=True)


class SeenObject(Result):
    """An object on the table."""

    name: str = Field(description="what an instruction can call it")
    category: str = Field(description="its noun")
    color: str = Field(description="the name of its colour; empty if it is not known")
    position: Position = Field(description=_POSITION)
    size_cm: tuple[float, float, float] = Field(
        description="width, depth and height in centimetres of what is seen of it: the longer side, the shorter, "
        "upwards"
    )


class LookResult(Result):
    """What the camera sees, and what the conversation is at."""

    objects: list[SeenObject]
    table: tuple[float, float, float, float] = Field(
        description="x_min, x_max, y_min, y_max of the table top in metres"
    )
    held: str | None = Field(description="the object in the hand")
    fallen: list[str] = Field(description="objects that fell off the table")
    out_of_reach: list[str] = Field(description="objects that the arm cannot take")
    notes: list[str] = Field(description="assumptions about the table, a sentence each")
    asked: str | None = Field(description="what was asked for last, in words")
    question: str | None = Field(description="a question that is open; the next call of propose answers it")
    options: list[str] = Field(description="the answers that the question offers")
    example: str | None = Field(description="an instruction that suits this table")


class ParseResult(Result):
    """How an instruction of its own is read; nothing is proposed."""

    status: Literal["ok", "ask", "refused"]
    message: str = Field(description="the question, the reason of a refusal, or a remark; may be empty")
    options: list[str] = Field(description="with 'ask': the possible answers")
    slots: dict[str, str | None] = Field(description="the slots of one structure; null where the text leaves it open")
    parts: list[str] = Field(description="each part of the goal in words")
    objects: list[str] | None = Field(description="the objects that are meant; null for all")
    goal: dict[str, Any] = Field(description="the whole goal; objects are indices into the objects of look")
    suggestions: list[str] = Field(description="with 'refused': goals that the text may mean; ask the person")
    confidence: dict[str, float] = Field(description="how sure the parser is of each slot, 0 to 1")


class Move(Result):
    """Where an object goes."""

    name: str
    position: Position = Field(description=_POSITION)
    turn_deg: float = Field(
        description="how far it is turned about z from how it stands now, in degrees, counter-clockwise from above"
    )
    orientation: tuple[float, float, float, float] = Field(
        description="the whole rotation from how it stands now, as a unit quaternion x, y, z, w"
    )
    aside: bool = Field(description="whether it only makes room")


class PlanOffer(Result):
    """An arrangement that can be built."""

    plan_id: str = Field(description="what preview and build take; it is used once and void when the table changes")
    score: float = Field(description="0 to 1, larger is better")
    moves: list[Move] = Field(description="the objects that are moved, and where to")


class ProposeResult(Result):
    """A proposal, a question, or an answer to a question."""

    status: Literal["proposed", "question", "answered"]
    wish: str | None = Field(description="what was understood; check it against what was asked for")
    notes: list[str] = Field(description="remarks on the interpretation; tell them to the person")
    plans: list[PlanOffer] = Field(description="the best arrangements, best first")
    question: str | None = Field(description="with 'question': ask the person, and call propose with the answer")
    options: list[str] = Field(description="with 'question': the answers that it offers")
    answer: str | None = Field(description="with 'answered': the reply to a text that does not ask for a build")


class Check(Result):
    """A check of the evaluation protocol."""

    name: str
    passed: bool
    measured: float | None
    limit: str


class PreviewResult(Result):
    """A plan, tried in physics on a copy of the table without the arm."""

    plan_id: str
    wish: str
    moves: list[Move]
    stands: bool = Field(description="whether it stands as asked when the objects are released at their goals")
    message: str
    checks: list[Check]


class BuildResult(Result):
    """What the arm built."""

    plan_id: str
    success: bool = Field(description="whether everything stands as asked")
    message: str = Field(description="the verdict, or why it failed")
    moved: list[str] = Field(description="the objects that are elsewhere now")
    stopped: bool = Field(description="whether it was stopped; the arm then set down what it held and folded")
    other_arrangement: bool = Field(
        description="whether the arm built another arrangement of the same wish, because it found no way for this one"
    )
    wish: str = Field(description="what was built: the goal of the plan, or the goal after corrections by say")
    said: list[str] = Field(description="the lines that came while the arm was building")
    unread: list[str] = Field(
        description="the lines of these that could not be read before the end; call propose with each"
    )
    steps: list[str] = Field(description="what the arm did")
    checks: list[Check]
    seconds: float
    turn: int = Field(description="the number of the turn, for report")


class SayResult(Result):
    """What came of a sentence that was said while the arm builds."""

    outcome: Literal["changed", "asked", "answered", "refused", "unchanged", "later", "waits", "goes on", "stops"] = (
        Field(
            description="'changed': something else is built from the next safe point on; 'later': call propose with it "
            "after the build"
        )
    )
    message: str = Field(description="the immediate reaction; tell it to the person")
    wish: str | None = Field(description="what is wanted now; check it against what was asked for")
    answer: str | None = Field(description="with 'answered': the reply to a question")
    question: str | None = Field(description="a question that is open; the next call of say answers it")
    options: list[str] = Field(description="the answers that the question offers")


class StopResult(Result):
    """What was stopped."""

    stopped: bool = Field(description="whether anything was under way or pending")
    message: str


class UndoResult(Result):
    """The state after one turn was reverted."""

    moved: list[str] = Field(description="the objects that were put back")
    wish: str | None = Field(description="what is asked for now")


class ReportResult(Result):
    """The report of one turn."""

    turn: int
    turns: int = Field(description="how many turns there were")
    instruction: str | None
    success: bool | None = Field(description="whether it was built as asked; null if it was not built")
    message: str | None = Field(description="why it failed; null if it did not")
    checks: list[Check]
    seconds: dict[str, float] = Field(description="the time of each step")
    page: str = Field(description="the file of the page of the whole conversation, for a browser")
    resources: list[str] = Field(description="what can be read of this turn: the report and the pictures")
