"""Carry out an instruction as a stream of events: read, look, propose, choose, build, check.

Every known error ends the stream with `Failed` and the exit code that says whose error it was; what listeners do with
the events is not known here.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from agent import events
from agent.arm.fixed_objects import describe_fixed, with_fixed
from agent.errors import DONE, BadInput, NotBuildable, PartlyDone, exit_code_of, one_sentence
from agent.event_base import Event, json_value
from agent.pipeline.building import LAST_PICTURE, build_with_arm
from agent.pipeline.copy_sizes import describe_sizes
from agent.pipeline.disturbance import check_disturbance, make_disturber
from agent.pipeline.drawing_consent import with_consent
from agent.pipeline.event_builders import (
    chosen_event,
    describe_aside,
    describe_shortfall,
    parsed_event,
    perceived_event,
    why_not,
)
from agent.pipeline.instruction_parser import ReadingOptions
from agent.pipeline.laying_out import GoalLayouts, StructureLayouts
from agent.pipeline.proposing import make_goal, propose_arrangements, propose_goal
from agent.pipeline.real_arm import RealArm, RobotOptions
from agent.pipeline.release import release_in_physics
from agent.pipeline.resources import ResourceCache
from agent.pipeline.table_goal import TableGoal, planned_as_structure, put_on_table, structure_of
from agent.recordings.recording import RecordedOptions
from grounding.figures.names import is_figure

if TYPE_CHECKING:
    from agent.arm.disturbances import Disturbance
    from agent.arm.remainder import Replanner
    from agent.recordings.trajectory_export import TrajectoryLog
    from agent.scenes.sources import SceneSource
    from agent.scenes.table_scene import TableScene
    from grounding.figures.figure import Figure
    from grounding.goals.goal import Goal
    from grounding.interpretation import Interpretation
    from grounding.spec import StructureSpec
    from structdiffusion.observation import Arrangement, Scene


@dataclass(frozen=True)
class RunOptions:
    """The options of a run; with its instruction they decide its result.

    Attributes:
        scene: the source of the scene: "simulated", "example", or the path of a scene file or a recording.
        objects: for a simulated scene "ycb", "procedural", "random_urdfs" or a folder of meshes.
        model: the planner's name in `structdiffusion.planners.registry`.
        weights: the folder of its checkpoints, or `None` for those shipped.
        seed: of everything drawn at random.
        execute: build with the arm, or stop at the proposed goal and only try it in physics.
        reading: how the instruction is read.
        recorded: how a recording is taken.
        allow_unverified: take checkpoints that are not what their cards say.
        hold: how the hand holds objects, one of `agent.arm.simulated_arm.HOLDS`.
        disturb: what disturbs the build; `None` for nothing.
        example: the file that instructions speak of as "the same"; the figure that it shows is `reading.like`.
        exact: whether its places are copied to the millimetre.
        record: whether the build is recorded, by whoever listens to it.
        arm: the file of the arm that builds, as `agent.arm.arm_file.load_arm` takes it; `None` for the Jaco.
    """

    scene: str = "simulated"
    objects: str = "ycb"
    model: str = "diffusion"
    weights: Path | None = None
    seed: int = 0
    execute: bool = True
    reading: ReadingOptions = ReadingOptions()
    recorded: RecordedOptions = RecordedOptions()
    allow_unverified: bool = False
    hold: str = "friction"
    disturb: Disturbance | None = None
    example: Path | None = None
    exact: bool = False
    record: bool = False
    arm: Path | None = None


def run_instruction(
    text: str,
    options: RunOptions,
    cache: ResourceCache | None = None,
    on_step: Callable[[TableScene], None] | None = None,
    trajectories: Sequence[Path] = (),
    on_table: Callable[[TableScene], None] | None = None,
    on_drawing: Callable[[Sequence[Figure]], bool] | None = None,
    robot: RobotOptions | None = None,
) -> Generator[Event, None, None]:
    """Carry out an instruction; yields its events, from `Started` to `Finished`.

    Args:
        text: the instruction.
        options: everything else.
        cache: shares models and libraries with other runs; by default this run loads its own.
        on_step: called after every physics step while the arm is at work.
        trajectories: files for the motions that the arm was commanded, as
            `agent.recordings.trajectory_export.write_trajectory` takes them.
        on_table: called once the table is set, before anything on it has moved.
        on_drawing: shows what a language model drew, and returns whether it is to be built; by default the options
            decide.
        robot: the arm that carries out what the twin has built; `None` for the twin alone.
    """
    started = time.perf_counter()
    run = _Run(text, options, cache or ResourceCache(), on_step, trajectories, on_table, on_drawing, robot)
    code = DONE
    yield events.Started(text, json_value(asdict(options)))
    try:
        yield from run.steps()
    except Exception as error:
        known = exit_code_of(error)
        if known is None:
            raise
        code = known
        yield events.Failed(run.step, one_sentence(error), code)
    yield events.Finished(code == DONE, code, time.perf_counter() - started)


class _Run:
    """One run and the step that it is in."""

    def __init__(
        self,
        text: str,
        options: RunOptions,
        cache: ResourceCache,
        on_step: Callable[[TableScene], None] | None,
        trajectories: Sequence[Path],
        on_table: Callable[[TableScene], None] | None,
        on_drawing: Callable[[Sequence[Figure]], bool] | None = None,
        robot: RobotOptions | None = None,
    ) -> None:
        self.text, self.options, self.cache, self.on_step = text, options, cache, on_step
        self.trajectories, self.on_table, self.on_drawing = trajectories, on_table, on_drawing
        self._drawn: tuple[str, ...] = ()  # notes on what a language model drew
        self.robot = robot
        self.real_arm: RealArm | None = None  # once it is connected
        self.step = "parse"

    def steps(self) -> Iterator[Event]:
        options, cache = self.options, self.cache
        source, opening = None, 0.0
        if options.disturb is not None:
            check_disturbance(options.disturb, options.scene, options.execute)
        if options.scene != RunOptions.scene:  # a file that cannot be used should not cost the loading of models
            self.step, began = "scene", time.perf_counter()
            source = cache.source(options.scene, options.objects, options.recorded, options.arm)
            self._check_arm(source)
            opening = time.perf_counter() - began
        self.step, began = "parse", time.perf_counter()
        there = None if source is None else source.referents  # a scene is drawn for what is asked for
        goal = self._ok(cache.interpreter(options.reading).interpret(self.text, there), source)
        seconds = time.perf_counter() - began
        self.step = "model"  # early, because a wrong name or a changed checkpoint should not cost a minute
        cache.check_planner(options.model, options.weights, options.allow_unverified)
        networks = cache.provenance(options.model, options.weights)
        self.step, began = "scene", time.perf_counter() - opening
        if source is None:
            source = cache.source(options.scene, options.objects, options.recorded, options.arm)
            self._check_arm(source)
            goal = self._ok(goal.among(source.referents, source.catalogue), source)
        notes = (*self._drawn, *goal.notes, *(one.card for one in networks.values() if not one.verified))
        spec = goal.goal.plain_spec
        if spec is not None:
            yield parsed_event(goal, seconds)
            yield from map(events.Noted, notes)
        opening = time.perf_counter() - began
        self.step = "model"  # after what was understood is told, because loading a network takes longer than reading
        planner = cache.planner(options.model, options.weights, options.allow_unverified)
        self.step, began = "scene", time.perf_counter() - opening
        with source.open(goal, options.seed) as table, ExitStack() as ends:
            if self.robot is not None:
                self.step = "robot"  # early too: what does not answer should not cost the planning
                self.real_arm = ends.enter_context(RealArm(self.robot, table, lambda: source.open(goal, options.seed)))
                yield from self.real_arm.connect()
                self.step = "scene"
            table.arm.hold_by(options.hold)
            if self.on_table is not None:
                self.on_table(table)
            if planned_as_structure(spec):
                scene = self._with_fixed(table.look(), table)
                yield perceived_event(scene, time.perf_counter() - began, table)
                if fixed := describe_fixed(scene):
                    yield events.Noted(fixed)
                if shortfall := describe_shortfall(table, "take part"):
                    yield events.Noted(shortfall)
                self.step = "propose"
                asked = make_goal(goal.spec, cache.encoder)
                proposed = propose_arrangements(planner, options.model, scene, asked, options.seed)
                replanner = StructureLayouts(
                    goal.spec,
                    lambda now: propose_arrangements(planner, options.model, now, asked, options.seed).arrangements,
                )
                yield from self._carried_out(table, goal.spec, replace(proposed, networks=networks), replanner)
                return
            if spec is not None:
                whole = structure_of(table, goal.spec)
                if source.catalogue and is_figure(spec.shape or ""):  # its table is drawn with others, as for parts
                    whole = self._ok(goal.among(table.referents), source).goal
            else:
                goal = self._ok(goal.among(table.referents), source) if source.catalogue else goal
                whole = goal.goal
                yield parsed_event(goal, seconds, table.original_names)
                yield from map(events.Noted, dict.fromkeys((*notes, *goal.notes)))
            yield from self._whole(table, whole, began)

    def _ok(self, goal: Interpretation, source: SceneSource | None) -> Interpretation:
        """Return a goal that can be built; raise `NotBuildable` for any other."""
        accepts = self.on_drawing or (lambda _: self.options.reading.accept_drawings)
        goal, notes = with_consent(goal, accepts)
        self._drawn += notes
        if goal.status != "ok":
            names = None if source is None else [each.name for each in source.referents]
            raise NotBuildable(why_not(goal, names, "" if source is None else source.hint))
        return goal

    def _check_arm(self, source: SceneSource) -> None:
        """Raise `BadInput` if what is asked for needs a Jaco, and the arm is none."""
        needs_jaco = (("--export-trajectory", self.trajectories), ("--robot", self.robot and not self.options.arm))
        for option, asked in needs_jaco:
            if asked and source.other_arm:
                raise BadInput(f"{source.other_arm}; without {option}, the run builds in the simulation")

    def _with_fixed(self, scene: Scene, table: TableScene) -> Scene:
        """Mark what the arm cannot grasp, if it is to build."""
        return with_fixed(scene, table.arm.hand, self.options.hold) if self.options.execute else scene

    def _whole(self, table: TableScene, goal: Goal, began: float) -> Iterator[Event]:
        """Carry out a goal of several parts in one build; `began` is when the scene's step did."""
        options, cache = self.options, self.cache
        wanted, scene = put_on_table(table, goal)
        scene = self._with_fixed(scene, table)
        looking = time.perf_counter() - began
        yield perceived_event(scene.select(wanted.movable), looking, table)
        if fixed := describe_fixed(scene, wanted.movable):
            yield events.Noted(fixed)
        if shortfall := describe_shortfall(table, "take part"):
            yield events.Noted(shortfall)
        self.step = "propose"
        planner = cache.goal_planner(options.model, options.weights, options.allow_unverified)
        proposed = propose_goal(planner, options.model, scene, wanted, options.seed)
        if len(proposed.scene.objects) > table.count:  # something has to be set aside, and takes part too
            table.involve([cloud.name for cloud in proposed.scene.objects])
            yield perceived_event(proposed.scene, looking, table)
        networks = cache.provenance(options.model, options.weights)
        replanner = GoalLayouts(wanted, lambda now, rest: propose_goal(planner, options.model, now, rest, options.seed))
        yield from self._carried_out(table, wanted, replace(proposed, networks=networks), replanner)

    def _carried_out(
        self,
        table: TableScene,
        wanted: StructureSpec | TableGoal,
        proposed: events.Proposed,
        replanner: Replanner,
    ) -> Iterator[Event]:
        """Choose a proposal, build or try it, and report objects that were left out."""
        from agent.pipeline.candidates import filter_viable

        yield proposed
        scene, spec = proposed.scene, None if isinstance(wanted, TableGoal) else wanted
        arrangements = filter_viable(proposed.arrangements, scene, spec)
        chosen = chosen_event(1, arrangements[0], scene, wanted if isinstance(wanted, TableGoal) else None)
        yield chosen
        if aside := describe_aside(chosen):
            yield events.Noted(aside)
        if sizes := describe_sizes(scene, wanted, arrangements[0]):
            yield events.Noted(sizes)
        if self.options.execute:
            self.step = "build"
            yield from self._built(table, scene, wanted, arrangements, replanner)
        else:
            self.step = "check"
            yield from release_in_physics(table, scene, wanted, arrangements[0])
        if shortfall := describe_shortfall(table, "stand as asked"):
            raise PartlyDone(shortfall)

    def _built(
        self,
        table: TableScene,
        scene: Scene,
        wanted: StructureSpec | TableGoal,
        arrangements: Sequence[Arrangement],
        replanner: Replanner,
    ) -> Iterator[Event]:
        from agent.recordings.trajectory_export import TrajectoryLog

        log = TrajectoryLog() if self.trajectories or self.real_arm else None
        options, disturber = self.options, None
        if options.disturb is not None:
            disturber = make_disturber(options.disturb, table, arrangements, options.objects, options.seed)
        building = build_with_arm(
            table, scene, wanted, arrangements, options.seed, on_step=self.on_step, log=log, disturber=disturber,
            replanner=replanner,
        )  # fmt: skip
        try:
            yield from self._checked_late(self.real_arm.rehearsal(building) if self.real_arm else building)
        except (Exception, KeyboardInterrupt):  # what failed may be looked into too
            yield from self._exported(table, log)
            raise
        yield from self._exported(table, log)
        if self.real_arm and log:
            self.step = "robot"
            yield from self.real_arm.carry_out(log)

    def _exported(self, table: TableScene, log: TrajectoryLog | None) -> Iterator[events.Noted]:
        from agent.recordings.trajectory_export import write_trajectory

        for path in self.trajectories:
            if log is not None and write_trajectory(log, path, table.prefix, table.arm.kinematics.model):
                yield events.Noted(f"the commands of the arm are in {path}")

    def _checked_late(self, building: Iterator[Event]) -> Iterator[Event]:
        """Yield the events of the build; its last picture begins the step "check"."""
        for event in building:
            if isinstance(event, events.Pictured) and event.name == LAST_PICTURE:
                self.step = "check"
            yield event
