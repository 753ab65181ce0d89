"""Define the events of carrying out an instruction, one frozen dataclass per step.

The pipeline yields these; the terminal, `report.json` and `report.html` are listeners of the same events, so that they
all report the same. `to_dict` gives the payload, an event's JSON form, which pictures are not part of.
The arm's own events are in `agent.arm.events`. Lengths in metres, angles in radians, times in seconds.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from agent.event_base import EventBase, live_only
from grounding.spec import StructureSpec
from structdiffusion.observation import Arrangement, Scene
from structdiffusion.structures.checks import Check


@dataclass(frozen=True)
class Started(EventBase):
    """The instruction and everything that decides what follows."""

    instruction: str
    options: Mapping[str, Any]


@dataclass(frozen=True)
class Asked(EventBase):
    """The speaker has to say more. `options` are the values of the slot that may be meant, the likeliest first."""

    slot: str
    question: str
    options: tuple[str, ...]


@dataclass(frozen=True)
class Noted(EventBase):
    """Something that the speaker should know, in a sentence."""

    message: str


@dataclass(frozen=True)
class Commanded(EventBase):
    """In a conversation: a line that is no instruction, such as "/undo" or the answer to a question."""

    line: str


@dataclass(frozen=True)
class Answered(EventBase):
    """In a conversation: a question or a greeting, and what the agent says to it, in lines of plain text."""

    question: str
    answer: str


@dataclass(frozen=True)
class Restored(EventBase):
    """In a conversation: the goal and the table are as they were at another time.

    Attributes:
        how: "undo": before the last turn; "redo": after the turn that was undone; "reset": at the start; "put back":
            the table as it was before the last build, with the same goal.
        spec: the goal that holds now, `None` before the first.
        objects: the names of those that took part.
        moved: the names of the objects that were put back.
        parts: one line for each part of a goal of several parts, which `spec` does not hold; empty otherwise.
    """

    how: str
    spec: StructureSpec | None
    objects: tuple[str, ...]
    moved: tuple[str, ...]
    parts: tuple[str, ...] = ()


@dataclass(frozen=True)
class Parsed(EventBase):
    """The instruction was read.

    Attributes:
        spec: the five slots as they were read; an open slot is `None`.
        confidence: slot -> how sure the parser is, in [0, 1].
        evidence: slot -> the words that speak for it.
        parser: which parser read it.
        dropped: slot -> value that was heard but cannot go with the rest, such as a tower's size.
        named: the nouns that say which objects take part; empty when all do.
        viewpoint: whose left and right was meant, "robot" or "opposite".
        prompt_sha256: checksum of the LLM's prompt, where it read.
        fallback: why another parser than the one that was asked for read it, or empty.
        before: in a conversation the goal that this one changes; `None` for a goal of its own.
        goal: the whole goal, as `grounding.goals.goal.Goal.to_dict` has it; its objects are indices into `objects`, and
            those of one plain structure the nouns that were named.
        parts: one line for each part of a goal that is more than the five slots of one structure; empty otherwise.
        objects: the names of the objects that the indices of such a goal mean.
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
        name, category: what it is called, and its noun.
        takes_part: whether the instruction means it.
        position: its cloud's mean, world frame.
        points: how many points the cloud has.
        outline: the corners (x, y) of the cloud seen from above, world frame; empty where it spans no area.
        color: its mean colour (RGB, 0 to 255), or `None`.
        display_name: what an instruction can call it, such as "object 3, red, tall".
        color_name: the name of its colour, where that is known; empty otherwise.
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


@dataclass(frozen=True)
class Perceived(EventBase):
    """The camera looked at the table.

    Attributes:
        objects: those that take part first, in the order of every arrangement, then the distractors.
        table: (x_min, x_max, y_min, y_max), world frame.
        notes: what had to be assumed, a sentence each.
        scene: the clouds and the picture.
        labelled: a picture (H, W, 3) uint8 with the objects marked and named, or `None`.
    """

    objects: tuple[SeenObject, ...]
    table: tuple[float, float, float, float]
    seconds: float
    notes: tuple[str, ...] = ()
    scene: Scene = live_only(kw_only=True)
    labelled: np.ndarray | None = live_only(default=None)


@dataclass(frozen=True)
class Candidate:
    """One proposed arrangement.

    Attributes:
        rank: from 1, the best.
        scores: as in `Arrangement`.
        positions: (N, 3) where the cloud's mean of each object goes, world frame.
        turns: (N,) how far each turns about z on the way there.
    """

    rank: int
    scores: Mapping[str, float]
    positions: tuple[tuple[float, float, float], ...]
    turns: tuple[float, ...] = ()


@dataclass(frozen=True)
class Previewed(EventBase):
    """The model at work: what some of its samples look like after `step` of `steps`; of passing interest.

    Attributes:
        positions: (S, N, 3) where the cloud's means go, world frame.
        turns: (S, N) how far the objects turn about z.
    """

    step: int
    steps: int
    positions: tuple[tuple[tuple[float, float, float], ...], ...]
    turns: tuple[tuple[float, ...], ...]


@dataclass(frozen=True)
class Proposed(EventBase):
    """The model proposed arrangements, and they were ranked, best first.

    `networks` has, by network, the SHA-256 of both files and whether they are those of its card.
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
        rank: counts from 1; it can change when the arm finds no plan for it.
        scores: as in `Arrangement`.
        goals: for each object that takes part its `name`, the `position` that its cloud's mean goes to, and
            `goal_from_initial` (4, 4). For a goal of several parts also `parts`, the numbers of those that name it, from
            1; `stays`, whether it is in its place already; `aside`, whether it only makes room.
    """

    rank: int
    scores: Mapping[str, float]
    goals: tuple[Mapping[str, Any], ...]
    arrangement: Arrangement = live_only()
    scene: Scene = live_only()


@dataclass(frozen=True)
class Pictured(EventBase):
    """A camera picture (H, W, 3) uint8 of the table; `name` is its file's stem, `caption` says when it was taken."""

    name: str
    caption: str
    image: np.ndarray = live_only()


@dataclass(frozen=True)
class Tried(EventBase):
    """The chosen arrangement was released in physics without the arm, on a copy of the table: where everything ended.

    Attributes:
        positions: (N, 3) where the cloud's mean of each object that takes part came to rest, world frame; of one that
            was not released any more, where it stands.
        turns: (N,) how far each turned about z on the way there.
    """

    positions: tuple[tuple[float, float, float], ...]
    turns: tuple[float, ...]


@dataclass(frozen=True)
class Filmed(EventBase):
    """The build as a film: pictures (T, H, W, 3) uint8, `interval` seconds of the arm's time apart."""

    interval: float
    frames: np.ndarray = live_only()


@dataclass(frozen=True)
class Checked(EventBase):
    """The final verdict.

    Attributes:
        success: whether the structure stands as it was asked for.
        failure_class: the first cause of failure, or `None`.
        checks: every check with its measured value.
        detail: the first cause of failure in a sentence, with its value and limit.
        how: "arm" when the structure was built, "released" when the goal was only tried without the arm.
        on: the shapes that were checked: "the true objects", or those that a recording was completed to.
    """

    success: bool
    failure_class: str | None
    checks: tuple[Check, ...]
    detail: str
    how: str
    seconds: float
    on: str = "the true objects"


@dataclass(frozen=True)
class Failed(EventBase):
    """The run ended without a structure: in which step, why, and the exit code that says so."""

    step: str
    message: str
    exit_code: int


@dataclass(frozen=True)
class Finished(EventBase):
    """The end of every run. `seconds` is the time of the whole run."""

    success: bool
    exit_code: int
    seconds: float
