"""The events of the arm while it plans and builds: one frozen dataclass per step.

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
    """Grasps and motions for every object of an arrangement were found.

    Attributes:
        arrangement: the arrangement's place in the ranked list, from 0.
        order: the objects' indices in the order in which they will be moved; one that is first moved aside comes twice.
        grasps: the kind of each one's grasp, in that order.
        seconds: how long the search took, over all arrangements so far.
    """

    arrangement: int
    order: tuple[int, ...]
    grasps: tuple[str, ...]
    seconds: float


@dataclass(frozen=True)
class PlanFailed(ArmEvent):
    """No plan for this arrangement. `object` is the index of the one that could not be moved, `None` for time."""

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
        fingers: how many of the three fingers touched it.
        hold: "weld after contact on both sides" or "friction": what held it from then on.
        slip_m, slip_rad: how far it moved in the world while the fingers closed.
    """

    object: int
    name: str
    grasp: str
    attempt: int
    fingers: int
    hold: str
    slip_m: float
    slip_rad: float


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
    """The object was released and has come to rest; a look measured it.

    Attributes:
        aside: it was only moved out of another's way, and will be moved again.
        position_error_m: distance in the plane from its goal.
        angle_error_rad: angle between its rotation and the goal's (for round things: of their upright axis).
        world_from_object: (4, 4) its pose now.
        seconds: planning and execution time of this object.
    """

    object: int
    name: str
    aside: bool
    position_error_m: float
    angle_error_rad: float
    world_from_object: np.ndarray
    seconds: float


@dataclass(frozen=True)
class PlaceFailed(ArmEvent):
    """The object could not be brought to its goal."""

    object: int
    name: str
    reason: str


@dataclass(frozen=True)
class Stopped(ArmEvent):
    """The arm was stopped while it was at work.

    Attributes:
        object, name: what was in the hand then, or `None` and empty.
        set_down: whether that was set down below where it was; `False` where nothing was in the hand.
        folded: whether the arm is back in its waiting pose.
    """

    object: int | None
    name: str
    set_down: bool
    folded: bool
