"""Run one instruction from its text to the built structure, with listeners for every event."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from agent.errors import BAD_INPUT, NOT_BUILDABLE, NOT_VERIFIED, USAGE
from grounding.goals.description import describe_parts
from grounding.goals.goal import Goal
from grounding.goals.parts import StructurePart
from grounding.spec import StructureSpec
from structagent.arguments import MOST_SEED, check_choice, check_text, checked_integer, shown, wrong_argument
from structagent.engine import computing
from structagent.errors import StructagentError, in_python, public_errors
from structagent.instructions import PARSERS, VIEWPOINTS, dropped_notes
from structagent.proposals import check_model, checked_weights
from structagent.sources import checked_source, recorded_options

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from agent.event_base import Event, Listener
    from agent.pipeline.run import RunOptions

    EventListener = Callable[[Event], object] | Listener

# Nothing was tried: the instruction or an argument cannot be used.
_REFUSED = (USAGE, NOT_BUILDABLE, BAD_INPUT, NOT_VERIFIED)


@dataclass(frozen=True, eq=False, repr=False)
class RunResult:
    """What became of a run.

    Attributes:
        success: whether the structure stands as it was asked for.
        exit_code: 0; 4 no valid arrangement; 5 the arm failed, or the result does not stand as asked; 8 partly done.
        message: why it is no success, in a sentence; empty otherwise.
        spec: the slots that were understood, world frame.
        names: the N objects that were seen.
        moved: indices of the participants; the other objects are obstacles.
        goal_from_initial: (N, 4, 4) float64 of the arrangement that was chosen last, as `Proposal` has it; `None` where
            none was.
        failure: the class of the first failed check of the evaluation protocol, or `None`.
        checks: every check of the verdict: its name, whether it passed, the measured value and the limit.
        notes: what had to be assumed or left out, a sentence each.
        events: everything that happened, as JSON values, without pictures.
        seconds: how long the run took.
        goal: all parts that were understood, world frame; objects are indices into `names`.
        shown: the live events that a notebook shows as pictures: the goal, and the table at the end.
    """

    success: bool
    exit_code: int
    message: str
    spec: StructureSpec
    names: tuple[str, ...]
    moved: tuple[int, ...]
    goal_from_initial: np.ndarray | None
    failure: str | None
    checks: tuple[Mapping[str, Any], ...]
    notes: tuple[str, ...]
    events: tuple[Mapping[str, Any], ...]
    seconds: float
    goal: Goal
    shown: tuple[Event, ...] = ()

    def __repr__(self) -> str:
        asked = describe_parts(self.goal.parts, self.names) or "nothing"
        return f"RunResult({asked}: {self.message or 'success'}; {self.seconds:.1f} s)"

    def _repr_html_(self) -> str:
        from structagent.notebooks import result_html

        return result_html(self.events, self.shown, self.notes)


@public_errors()
def run(
    instruction: str,
    *,
    scene: str | os.PathLike[str] = "simulated",
    objects: str = "ycb",
    model: str = "diffusion",
    weights: str | os.PathLike[str] | None = None,
    allow_unverified: bool = False,
    seed: int = 0,
    execute: bool = True,
    viewpoint: str = "robot",
    parser: str = PARSERS[0],
    on_event: EventListener | Sequence[EventListener] = (),
    at: float | None = None,
    topics: Mapping[str, str] | None = None,
    world_from_camera: ArrayLike | None = None,
    nouns: Mapping[str, str] | None = None,
    depth_unit: float | str | None = None,
) -> RunResult:
    """Carry an instruction out: read it, look at the table, propose, choose, build with the simulated arm, and check.

    Args:
        instruction: a sentence in English.
        scene, objects, at, topics, world_from_camera, nouns, depth_unit: as for `load_scene`.
        model, weights, allow_unverified: the planner, as for `propose`.
        seed: everything drawn at random follows from it, in [0, 2**63).
        execute: build with the arm; `False` stops at the chosen arrangement and only tries it in physics.
        viewpoint: whose left and right is meant: "robot", or "opposite" for a person across the table.
        parser: "embedding", or "llm" for the local language model.
        on_event: called with every event (`agent.events`, `agent.arm.events`) as it happens: a function, a listener
            (`agent.event_base.Listener`), or a list of these.

    Returns:
        What became of it. A structure that does not stand is a result, with `success` false.

    Raises:
        StructagentError: if nothing was tried, because the instruction or an argument cannot be used.
    """
    check_text(instruction)
    checked_source(scene, objects)
    check_model(model)
    check_choice("viewpoint", viewpoint, VIEWPOINTS)
    check_choice("parser", parser, PARSERS)
    if not isinstance(execute, bool):
        raise wrong_argument(f"execute cannot be {shown(execute)}; legal: True, False")
    listeners = _checked_listeners(on_event)
    seed, folder = checked_integer("seed", seed, 0, MOST_SEED), checked_weights(weights)
    recorded = recorded_options(at, topics, world_from_camera, nouns, depth_unit)
    from agent.pipeline.instruction_parser import ReadingOptions
    from agent.pipeline.run import RunOptions

    reading = ReadingOptions(parser, viewpoint)
    options = RunOptions(os.fspath(scene), objects, model, folder, seed, execute, reading, recorded, allow_unverified)
    log = _Log()
    for event in _events(instruction, options):
        log.take(event)
        for listener in listeners:
            listener(event)
    return log.result()


def _events(instruction: str, options: RunOptions) -> Iterator[Any]:
    """Yield the events of a run; models are in use only between two events, so that listeners may use them too."""
    from agent.pipeline.run import run_instruction

    with computing() as cache:
        stream = run_instruction(instruction, options, cache)
    try:
        while True:
            with computing():
                event = next(stream, None)
            if event is None:
                return
            yield event
    finally:
        with computing():
            stream.close()


def _checked_listeners(on_event: Any) -> tuple[Callable[[Event], object], ...]:
    given = on_event if isinstance(on_event, list | tuple) else (on_event,)
    listeners = tuple(getattr(each, "on_event", each) for each in given)
    if not all(map(callable, listeners)):
        raise wrong_argument(
            f"on_event cannot be {shown(on_event)}; legal: a function of one event, a listener with the method "
            "on_event, or a list of these"
        )
    return listeners  # type: ignore[return-value]  # the checker does not see that all are callable


class _Log:
    """Listens to a run and keeps what its result tells."""

    def __init__(self) -> None:
        self._events: list[Mapping[str, Any]] = []
        self._notes: list[str] = []
        self._last: dict[str, Any] = {}

    def take(self, event: Any) -> None:
        """Take one event in."""
        kind = type(event).__name__
        self._last[kind] = event
        self._events.append(event.to_dict())
        if kind == "Noted":
            self._notes.append(event.message)
        elif kind == "Perceived":
            self._notes += event.notes
        elif kind == "Parsed":
            self._notes += filter(None, (event.fallback, *dropped_notes(event.spec, event.dropped)))

    def result(self) -> RunResult:
        """Return the result of a run that has finished.

        Raises:
            StructagentError: if nothing was tried.
        """
        failed, finished = self._last.get("Failed"), self._last["Finished"]
        if failed is not None and failed.exit_code in _REFUSED:
            raise StructagentError(in_python(failed.message), failed.exit_code)
        chosen, checked = self._last.get("Chosen"), self._last.get("Checked")
        perceived = self._last["Perceived"]
        moved = tuple(index for index, each in enumerate(perceived.objects) if each.takes_part)
        motions = None
        if chosen is not None:
            motions = np.tile(np.eye(4), (len(perceived.objects), 1, 1))
            motions[list(moved)] = chosen.arrangement.goal_from_initial
        return RunResult(
            finished.success,
            finished.exit_code,
            "" if failed is None else failed.message,
            self._last["Parsed"].spec,
            tuple(each.name for each in perceived.objects),
            moved,
            motions,
            None if checked is None else checked.failure_class,
            () if checked is None else tuple(checked.to_dict()["checks"]),
            tuple(dict.fromkeys(self._notes)),
            tuple(self._events),
            finished.seconds,
            self._goal([each.name for each in perceived.objects], moved),
            tuple(self._last[kind] for kind in ("Chosen", "Pictured") if kind in self._last),
        )

    def _goal(self, names: Sequence[str], moved: tuple[int, ...]) -> Goal:
        """Return the goal over the objects that were seen."""
        from agent.pipeline.table_goal import renumbered

        parsed = self._last["Parsed"]
        if not parsed.parts:
            return Goal((StructurePart.of(parsed.spec, moved),))
        return renumbered(
            Goal.from_dict(parsed.goal),
            {index: names.index(name) for index, name in enumerate(parsed.objects) if name in names},
        )
