"""Read from the events of a build what the tool says of it: what stands, what it noticed, and whether it gave up."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

from agent.arm.events import (
    Disturbed,
    Noticed,
    Picked,
    Placed,
    PlaceFailed,
    StandingChanged,
    Stopped,
)
from agent.event_base import Event

WITHOUT_IT = ("leave out", "lay out anew")  # actions after which the build may be done without an object
WITHIN = 2  # the placement by which a disturbance has to be noticed: the one under way ends, and one more is too many


@dataclass(frozen=True)
class Account:
    """What the tool says of a build.

    Attributes:
        stands: the objects that it says are in their places.
        left_out: the objects without which it says that it goes on.
        gave_up: whether it says that it has ended early.
        disturbed: what happened, which the tool does not say; `None` if nothing did.
        noticed: whether it noticed something before the second placement after that; `None` if nothing happened.
        replans: how often it noticed something and did otherwise than planned.
    """

    stands: frozenset[int]
    left_out: frozenset[int]
    gave_up: bool
    disturbed: Disturbed | None
    noticed: bool | None
    replans: int


def account_of(happened: Sequence[Event], in_place: Collection[int] = ()) -> Account:
    """Read the events of a build.

    Args:
        happened: all of them, in order.
        in_place: objects that are in their places without being moved.
    """
    stands, left_out, gave_up = set(in_place), set[int](), False
    for event in happened:
        match event:
            case Placed(aside=False) | StandingChanged():
                stood = event.stands if isinstance(event, StandingChanged) else not event.trouble
                stands = stands | {event.object} if stood else stands - {event.object}
            case Picked() | PlaceFailed():
                stands.discard(event.object)
            case Noticed():
                gave_up = event.action == "end"
                if event.action != "go on" and event.object is not None:
                    stands.discard(event.object)
                    left_out |= {event.object} if event.action in WITHOUT_IT else set()
            case Stopped():
                gave_up = True
    disturbed = next((event for event in happened if isinstance(event, Disturbed)), None)
    replans = sum(isinstance(event, Noticed) and event.action != "go on" for event in happened)
    noticed = None if disturbed is None else _noticed(happened[list(happened).index(disturbed) :])
    return Account(frozenset(stands), frozenset(left_out - stands), gave_up, disturbed, noticed, replans)


def _noticed(since: Sequence[Event]) -> bool:
    """Return whether something was noticed before the second placement since a disturbance."""
    placements = 0
    for event in since:
        placements += isinstance(event, Placed)
        if isinstance(event, Noticed):
            return True
        if placements == WITHIN:
            break
    return False
