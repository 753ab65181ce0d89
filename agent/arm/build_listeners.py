"""Name those that follow a build while the arm is at work."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from agent.arm.controller import MotionListener
from agent.arm.remainder import EndsHere, Replanner


@dataclass(frozen=True)
class BuildListeners:
    """Those that follow a build, besides whoever takes its events.

    Attributes:
        on_step: called after every physics step.
        on_check: called for every configuration that planning checks.
        log: receives every motion of the arm.
        replanner: is asked for other arrangements where something is gone or in the way.
        ends_here: is asked before each motion of an object, and once more in the end.
    """

    on_step: Callable[[], None] | None = None
    on_check: Callable[[], None] | None = None
    log: MotionListener | None = None
    replanner: Replanner | None = None
    ends_here: EndsHere | None = None
