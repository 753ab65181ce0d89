"""Define the events of carrying out an instruction, one frozen dataclass per step.

The pipeline yields these; the terminal, `report.json` and `report.html` are listeners of the same events, so that they
all report the same. `to_dict` returns the payload, an event's JSON form without pictures.
The arm's own events are in `agent.arm.events`. Lengths in metres, angles in radians, times in seconds.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from agent.event_base import EventBase, live_only
from grounding.spec import StructureSpec
from structdiffusion.observation import Arrangement, Scene
from structdiffusion.structures.checks import Check


@dataclass(frozen=True)
class Started(EventBase):
    """The instruction and all options of the run."""

    instruction: str
    options: Mapping[str, Any]


@dataclass(frozen=True)
class Asked(EventBase):
    """A question to the speaker. `options` are the possible values of the slot, the most likely first."""

    slot: str
    question: str
    options: tuple[str, ...]


@dataclass(frozen=True)
class Noted(EventBase):
    """A remark for the speaker, in a sentence."""

    message: str


@dataclass(frozen=True)
class Commanded(EventBase):
    """In a conversation: a line that is not an instruction, such as "/undo" or the answer to a question."""

    line: str


@dataclass(frozen=True)
class Answered(EventBase):
    """In a conversation: a question or a greeting, and the agent's reply in lines of plain text."""

    question: str
    answer: str


@dataclass(frozen=True)
class Interjected(EventBase):
    """In a conversation: a line was said while the arm builds, and read at once.

    Attributes:
        line: what was said.
        outcome: "changed": something else is built from the next safe point on, in a turn that begins there; "asked": a
            question is open, which follows; "answered": it is a question, whose answer follows; "refused", "unchanged";
            "later": it is read when nothing is built any more; "waits", "goes on", "stops": what the arm does.
        message: what was told at once; empty where an answer follows.
        placed: how many placements there were.
    """

    line: str
    outcome: str
    message: str
    placed: int


@dataclass(frozen=True)
class Remembered(EventBase):
    """In a conversation: a turn of the timeline begins, to which "/back TURN" returns.

    Attributes:
        turn: its number, from 1; 0 is the start.
        after: the number of the turn that it follows.
        branch: of the timeline, from 1.
    """

    turn: int
    after: int
    branch: int


@dataclass(frozen=True)
class Forked(EventBase):
    """In a conversation: the turn that follows begins a branch of the timeline.

    Attributes:
        turn: the number of the present turn, which it will follow.
        branch: of the turn to come.
    """

    turn: int
    branch: int


@dataclass(frozen=True)
class Restored(EventBase):
    """In a conversation: the goal and the table were restored to another state.

    Attributes:
        how: "undo": the state before the last turn; "redo": the state after the turn that was undone; "reset": the
            start; "put back": the table as it was before the last build, with the same goal; "turn 2": the state in
            which that turn of the timeline was left.
        spec: the present goal, `None` before the first one.
        objects: the names of the participants.
        moved: the names of the objects that were put back.
        parts: one line for each part of a goal of several parts, which `spec` does not hold; empty otherwise.
        turn: the number of the turn of the timeline that is the present one again; `None` where a turn was added.
    """

    how: str
    spec: StructureSpec | None
    objects: tuple[str, ...]
    moved: tuple[str, ...]
    parts: tuple[str, ...] = ()
    turn: int | None = None


@dataclass(frozen=True)
class Parsed(EventBase):
    """The instruction was read.

    Attributes:
        spec: the five parsed slots; an open slot is `None`.
        confidence: slot -> the parser's confidence in [0, 1].
        evidence: slot -> the words that its value is based on.
        parser: the parser that was used.
        dropped: slot -> parsed value that does not fit the other slots, such as a tower's size.
        named: the nouns of the objects that take part; empty if all do.
        viewpoint: whose left and right is meant, "robot" or "opposite".
        prompt_sha256: checksum of the LLM's prompt if an LLM was the parser.
        fallback: why another parser than the requested one was used, or empty.
        before: in a conversation the goal that this one changes; `None` for a new goal.
        goal: the whole goal, as from `grounding.goals.goal.Goal.to_dict`; its objects are indices into `objects`, or
            for one plain structure the nouns of `named`.
        parts: one line for each part of a goal that goes beyond the slots of one structure; empty otherwise.
        objects: the names to which the indices of such a goal refer.
    """

    spec: StructureSpec
    confidence: Mapping[str, float]
    evidence: Mapping[str, tuple[str, ...]]
    parser: str
    dropped: Mapping[str, str]
    named: tuple[str, ...]
    viewpoint: str
    prompt_sha256: str | None
    fallback: str
    seconds: float
    before: StructureSpec | None = None
    goal: Mapping[str, Any] = field(default_factory=dict)
    parts: tuple[str, ...] = ()
    objects: tuple[str, ...] = ()


@dataclass(frozen=True)
class SeenObject:
    """One object of the scene.

    Attributes:
        name, category: its name and its noun.
        takes_part: whether it takes part in the goal.
        position: the mean of its cloud, world frame.
        points: the number of points in the cloud.
        outline: the corners (x, y) of the cloud seen from above, world frame; empty if it spans no area.
        color: its mean colour (RGB, 0 to 255), or `None`.
        display_name: its name with descriptions for instructions, such as "object 3, red, tall".
        color_name: the name of its colour, or empty if unknown.
        confidence: in its noun, from 0 to 1, if that comes from the picture; `None` if it is known.
        number: its place among all objects of the table, from 1, whichever take part; 0 if that was not recorded.
    """

    name: str
    category: str
    takes_part: bool
    position: tuple[float, float, float]
    points: int
    outline: tuple[tuple[float, float], ...] = ()
    color: tuple[int, int, int] | None = None
    display_name: str = ""
    color_name: str = ""
    confidence: float | None = None
    number: int = 0


@dataclass(frozen=True)
class Perceived(EventBase):
    """The camera observed the table.

    Attributes:
        objects: the participants in the order of every arrangement, then the distractors.
        table: (x_min, x_max, y_min, y_max), world frame.
        notes: assumptions that were made, a sentence each.
        scene: the clouds and the picture.
        labelled: a picture (H, W, 3) uint8 with the objects marked and named, or `None`.
        surfaces: name -> vertices (V, 3), world frame, and faces (F, 3) of the body that an object has in physics.
        base: (3,) where the arm stands, world frame, or `None`.
    """

    objects: tuple[SeenObject, ...]
    table: tuple[float, float, float, float]
    seconds: float
    notes: tuple[str, ...] = ()
    scene: Scene = live_only(kw_only=True)
    labelled: np.ndarray | None = live_only(default=None)
    surfaces: Mapping[str, tuple[np.ndarray, np.ndarray]] = live_only(default_factory=dict)
    base: np.ndarray | None = live_only(default=None)


@dataclass(frozen=True)
class Candidate:
    """One proposed arrangement.

    Attributes:
        rank: from 1, the best.
        scores: as in `Arrangement`.
        positions: (N, 3) goal of the mean of each object's cloud, world frame.
        turns: (N,) rotation of each object about z from its initial pose.
    """

    rank: int
    scores: Mapping[str, float]
    positions: tuple[tuple[float, float, float], ...]
    turns: tuple[float, ...] = ()


@dataclass(frozen=True)
class Previewed(EventBase):
    """Some samples of the model after `step` of `steps`; shown live and not recorded.

    Attributes:
        positions: (S, N, 3) goals of the means of the clouds, world frame.
        turns: (S, N) rotations of the objects about z.
    """

    step: int
    steps: int
    positions: tuple[tuple[tuple[float, float, float], ...], ...]
    turns: tuple[tuple[float, ...], ...]


@dataclass(frozen=True)
class Proposed(EventBase):
    """The model proposed arrangements, and they were ranked, best first.

    `networks` maps each network to the SHA-256 of both files and whether they match its card.
    """

    model: str
    candidates: tuple[Candidate, ...]
    seconds: float
    scene: Scene = live_only()
    arrangements: tuple[Arrangement, ...] = live_only()
    networks: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Chosen(EventBase):
    """The arrangement that will be built.

    Attributes:
        rank: its rank from 1; another one may be chosen later if the arm finds no plan for it.
        scores: as in `Arrangement`.
        goals: for each participant its `name`, the goal `position` of the mean of its cloud, and `goal_from_initial`
            (4, 4). For a goal of several parts also `parts`, the numbers from 1 of the parts that name it; `stays`,
            whether it is in its place already; `aside`, whether it is only moved to make room.
    """

    rank: int
    scores: Mapping[str, float]
    goals: tuple[Mapping[str, Any], ...]
    arrangement: Arrangement = live_only()
    scene: Scene = live_only()


@dataclass(frozen=True)
class Pictured(EventBase):
    """A camera picture (H, W, 3) uint8 of the table; `name` is its file's stem, `caption` says when it was taken.

    `motions` maps names of objects to their motions (4, 4), world frame, from where they were seen to where they are on
    the picture; it is empty where that was not measured.
    """

    name: str
    caption: str
    image: np.ndarray = live_only()
    motions: Mapping[str, np.ndarray] = live_only(default_factory=dict)


@dataclass(frozen=True)
class Tried(EventBase):
    """The chosen arrangement was released in physics without the arm, on a copy of the table.

    Attributes:
        positions: (N, 3) final mean of the cloud of each participant, world frame; for an object that was not released,
            its present one.
        turns: (N,) rotation of each about z from its initial pose.
    """

    positions: tuple[tuple[float, float, float], ...]
    turns: tuple[float, ...]


@dataclass(frozen=True)
class Filmed(EventBase):
    """The build as a film: pictures (T, H, W, 3) uint8, `interval` seconds of the arm's time apart.

    Attributes:
        every: seconds between the moments of `motions` and `links`.
        motions: name -> (M, 4, 4) the motion of an object, world frame, from where it was seen to where it is at each
            moment.
        links: link -> world_from_link (M, 4, 4) of the arm.
        shapes: the solids of the arm, as `agent.arm.visual_shapes.LinkShape` describes them.
    """

    interval: float
    frames: np.ndarray = live_only()
    every: float = live_only(default=1.0)
    motions: Mapping[str, np.ndarray] = live_only(default_factory=dict)
    links: Mapping[int, np.ndarray] = live_only(default_factory=dict)
    shapes: Sequence[Any] = live_only(default=())


@dataclass(frozen=True)
class Checked(EventBase):
    """The final verdict.

    Attributes:
        success: whether the result stands as asked.
        failure_class: the first cause of failure, or `None`.
        checks: every check with its measured value.
        detail: the first cause of failure in a sentence, with its value and limit.
        how: "arm" if the goal was built, "released" if it was only tried without the arm.
        on: the bodies that were checked: "the true objects", or the completed bodies of a recording.
        count: the number of objects that take part.
        left_out: the names of requested objects that could not take part.
    """

    success: bool
    failure_class: str | None
    checks: tuple[Check, ...]
    detail: str
    how: str
    seconds: float
    on: str = "the true objects"
    count: int = 0
    left_out: tuple[str, ...] = ()


@dataclass(frozen=True)
class Failed(EventBase):
    """The run failed: the step, the reason and the exit code."""

    step: str
    message: str
    exit_code: int


@dataclass(frozen=True)
class Finished(EventBase):
    """The run ended. `seconds` is the time of the whole run."""

    success: bool
    exit_code: int
    seconds: float
