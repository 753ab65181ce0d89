"""Define the events of the arm while it plans and builds: one frozen dataclass per step.

Objects are named by their index in `Scene.objects` and by their name. Metres, radians, seconds.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from agent.event_base import EventBase


@dataclass(frozen=True)
class ArmEvent(EventBase):
    """Any of the events below."""


@dataclass(frozen=True)
class Planned(ArmEvent):
    """Grasps and motions were found for every object of an arrangement.

    Attributes:
        arrangement: the arrangement's place in the ranked list, from 0.
        order: the indices of the objects in the order of their motions; an object that is first moved aside comes
            twice.
        grasps: the kind of each object's grasp, in that order.
        seconds: the time of the search over all arrangements so far.
    """

    arrangement: int
    order: tuple[int, ...]
    grasps: tuple[str, ...]
    seconds: float


@dataclass(frozen=True)
class PlanFailed(ArmEvent):
    """No plan was found for this arrangement; `object` is the index of the one that could not be moved, `None` when
    time ran out.
    """

    arrangement: int
    object: int | None
    name: str
    reason: str


@dataclass(frozen=True)
class Picked(ArmEvent):
    """The object is in the hand.

    Attributes:
        grasp: the kind of grasp.
        attempt: 1 for the first try.
        fingers: the number of fingers, of three, that touched it.
        hold: what held it from then on: "weld after contact on both sides" or "friction".
    """

    object: int
    name: str
    grasp: str
    attempt: int
    fingers: int
    hold: str


@dataclass(frozen=True)
class PickFailed(ArmEvent):
    """An attempt to pick the object failed; another grasp may follow."""

    object: int
    name: str
    grasp: str
    attempt: int
    reason: str


@dataclass(frozen=True)
class Placed(ArmEvent):
    """The object was released and has come to rest; its pose was then measured.

    Attributes:
        aside: whether it was only moved out of another's way and will be moved again.
        position_error_m: distance in the plane from its goal.
        angle_error_rad: angle between its rotation and the goal's (for round things: of their upright axis).
        world_from_object: (4, 4) its pose now.
        seconds: planning and execution time of this object.
        trouble: why it does not stand as placed, in words that follow its name; empty if it does.
        again: why it was moved although it had been moved before, in words that follow its name; empty if it had not.
        on: what it was to rest on, "the table" or a name; empty if that is not known.
    """

    object: int
    name: str
    aside: bool
    position_error_m: float
    angle_error_rad: float
    world_from_object: np.ndarray
    seconds: float
    trouble: str = ""
    again: str = ""
    on: str = ""


@dataclass(frozen=True)
class StandingChanged(ArmEvent):
    """An object that had been placed stands no longer as placed, or does so again.

    Attributes:
        stands: whether it does now.
        trouble: why not, in words that follow its name; empty if it does.
        during: what the arm had done since it last stood: "can 3 was placed".
    """

    object: int
    name: str
    stands: bool
    trouble: str
    during: str


@dataclass(frozen=True)
class Noticed(ArmEvent):
    """Something is otherwise than it should be: what the camera or the fingers told, and what is done about it.

    Attributes:
        object: its index, or `None` for something that takes no part, or belongs to no known object.
        name: its name; "something" where nothing known looks like it.
        what: "moved", "gone", "appeared", "fallen", "blocked", "in the way", "not in the hand" or "off".
        detail: in words that follow the name.
        action: "go on", "place again", "take down", "set aside", "lay out anew", "leave out" or "end".
    """

    object: int | None
    name: str
    what: str
    detail: str
    action: str


@dataclass(frozen=True)
class SetAside(ArmEvent):
    """Something that was in the way, and has no place in the structure, was set aside, or could not be.

    Attributes:
        object: its index, or `None` for something that belongs to no known object.
        name: its name; "something" where nothing known looks like it.
        detail: where it was: "in the way at (0.50, 0.10)".
        trouble: why it could not be; empty if it was.
        seconds: the time that it took.
    """

    object: int | None
    name: str
    detail: str
    trouble: str
    seconds: float


@dataclass(frozen=True)
class PlaceFailed(ArmEvent):
    """The object could not be brought to its goal."""

    object: int
    name: str
    reason: str


@dataclass(frozen=True)
class Stopped(ArmEvent):
    """The arm was stopped during its work.

    Attributes:
        object, name: the object that was in the hand, or `None` and an empty name.
        set_down: whether it was set down below where it was; `False` if the hand was empty.
        folded: whether the arm is back in its waiting pose.
    """

    object: int | None
    name: str
    set_down: bool
    folded: bool


@dataclass(frozen=True)
class Disturbed(ArmEvent):
    """Somebody has disturbed the build on purpose; reports tell of it, and nothing that decides may read it.

    Attributes:
        disturbance: "push", "remove", "add", "drop", "topple" or "swap".
        object: `None` for an object that was brought.
        detail: what happened to it, in words that follow the name.
    """

    disturbance: str
    object: int | None
    name: str
    detail: str
