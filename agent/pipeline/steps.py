"""The steps of a run, each telling its own events.

`agent.pipeline.run` takes them one after the other, a conversation as they are asked for.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Generator, Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import shapely

from agent import events
from agent.errors import ExecutionFailed, NotBuildable, NoValidGoal

if TYPE_CHECKING:
    from agent.pipeline.film import Film
    from agent.recordings.trajectory_export import TrajectoryLog
    from agent.scenes.table_scene import TableScene
    from grounding.interpreter import Interpretation
    from grounding.spec import StructureSpec
    from structdiffusion.observation import Arrangement, Goal, ObjectCloud, Scene
    from structdiffusion.planners.factory import Planner

CANDIDATES = 64
FEWEST_IN_A_CIRCLE = 3
LAST_PICTURE = "camera-after"  # taken when the arm is done and what it built is about to be judged
TRIED_PICTURE = "camera-tried"  # of a goal that was released without the arm
PREVIEWED = 3  # samples whose way out of the noise is shown
_OUTLINE_DETAIL = 0.002  # m: finer than a character, and than most of the pictures


def parsed(goal: Interpretation, seconds: float) -> events.Parsed:
    """Report what was parsed, with the nouns that name the objects."""
    parse = goal.parse
    return events.Parsed(
        goal.spec,
        parse.confidence,
        parse.evidence,
        parse.parser,
        parse.dropped,
        goal.named,
        goal.viewpoint,
        parse.prompt_sha256,
        goal.fallback,
        seconds,
    )


def perceived(scene: Scene, seconds: float, table: TableScene | None = None) -> events.Perceived:
    """What the camera saw, and what the table that it looked at has to say of that."""
    called = {} if table is None else dict(zip(table.names, table.called, strict=True))
    colors = {} if table is None else dict(zip(table.names, table.color_names, strict=True))
    seen = [
        events.SeenObject(
            cloud.name,
            cloud.category,
            number < len(scene.objects),
            tuple(cloud.centroid.tolist()),
            len(cloud.points),
            _outline(cloud),
            None if cloud.colors is None else tuple(cloud.colors.mean(axis=0).round().astype(int).tolist()),
            called.get(cloud.name, cloud.name),
            colors.get(cloud.name, ""),
        )
        for number, cloud in enumerate((*scene.objects, *scene.distractors))
    ]
    top = scene.table
    rectangle = (top.x_min, top.x_max, top.y_min, top.y_max)
    notes, labelled = ((), None) if table is None else (table.notes, table.labelled)
    return events.Perceived(tuple(seen), rectangle, seconds, notes, scene=scene, labelled=labelled)


def shortfall(table: TableScene, what: str) -> str:
    """Say how many of the objects that were asked for do `what`, and why not the others; empty where all take part."""
    if not table.missing:
        return ""
    reasons = "; ".join(f"{name} is left where it is: {why}" for name, why in table.missing.items())
    return f"{table.count} of {table.count + len(table.missing)} objects {what}; {reasons}"


def _outline(cloud: ObjectCloud) -> tuple[tuple[float, float], ...]:
    hull = shapely.MultiPoint(cloud.points[:, :2]).convex_hull
    if hull.geom_type != "Polygon":
        return ()
    corners = shapely.get_coordinates(hull.simplify(_OUTLINE_DETAIL))[:-1]
    return tuple((round(x, 4), round(y, 4)) for x, y in corners.tolist())


def imagine(
    planner: Planner,
    model: str,
    scene: Scene,
    goal: Goal,
    seed: int,
    on_preview: Callable[[events.Previewed], None] | None = None,
    count: int = CANDIDATES,
) -> events.Imagined:
    """Proposes arrangements and ranks them.

    Args:
        planner: proposes them.
        model: its name.
        scene: what was seen.
        goal: what is asked for.
        seed: the samples follow from it.
        on_preview: told how the first samples come out of the noise, where the planner can show it.
        count: how many arrangements are proposed.

    Raises:
        NotBuildable: when too few objects take part, or something that has to stay stands on one of them.
        NoValidGoal: when there is no arrangement at all.
    """
    import torch

    from structdiffusion.planners.diffusion import DiffusionPlanner
    from structdiffusion.structures.structure import LayoutError

    def preview(step: int, steps: int, motions: np.ndarray) -> None:
        shown = motions[:PREVIEWED]
        positions = tuple(tuple(_goal_positions(each, flat)) for each in shown)
        on_preview(events.Previewed(step, steps, positions, tuple(_turns(each) for each in shown)))  # type: ignore[misc]

    began = time.perf_counter()
    if goal.spec.shape == "circle" and len(scene.objects) < FEWEST_IN_A_CIRCLE:
        raise NotBuildable(f"a circle needs {FEWEST_IN_A_CIRCLE} objects or more, and {len(scene.objects)} take part")
    _refuse_loaded(scene)
    # The models were taught with objects that stand on the table; what stands on others is lowered for them.
    flat = scene.on_the_table()
    shows = on_preview is not None and isinstance(planner, DiffusionPlanner)
    more = {"preview": preview} if shows else {}
    generator = torch.Generator().manual_seed(seed)
    try:
        arrangements = planner.propose(flat, goal, count=count, generator=generator, **more)
    except LayoutError as error:
        raise NoValidGoal(f"the model {model!r} imagined no valid arrangement: {error}") from error
    lowering = np.tile(np.eye(4), (len(scene.objects), 1, 1))
    lowering[:, 2, 3] = [-cloud.bottom for cloud in scene.objects]
    arrangements = [replace(each, goal_from_initial=each.goal_from_initial @ lowering) for each in arrangements]
    candidates = tuple(
        events.Candidate(
            rank,
            dict(arrangement.scores),
            tuple(_goal_positions(arrangement.goal_from_initial, scene)),
            _turns(arrangement.goal_from_initial),
        )
        for rank, arrangement in enumerate(arrangements, start=1)
    )
    return events.Imagined(
        model, candidates, time.perf_counter() - began, scene=scene, arrangements=tuple(arrangements)
    )


def _refuse_loaded(scene: Scene) -> None:
    """Raises `NotBuildable` when a distractor stands on an object that takes part, and would fall with it."""
    from agent.arm.placement_order import stands_above

    clouds = (*scene.objects, *scene.distractors)
    outlines = [shapely.MultiPoint(cloud.points[:, :2]).convex_hull for cloud in clouds]
    bottoms = [cloud.bottom for cloud in clouds]
    for upper in range(len(scene.objects), len(clouds)):
        for lower in range(len(scene.objects)):
            if stands_above(upper, lower, outlines, bottoms):
                above, below = clouds[upper].name, clouds[lower].name
                raise NotBuildable(f"the {above} stands on the {below} and would fall: let the {above} take part too")


def _turns(motions: np.ndarray) -> tuple[float, ...]:
    """(N,) radians about z of rigid motions (N, 4, 4)."""
    return tuple(round(angle, 4) for angle in np.arctan2(motions[:, 1, 0], motions[:, 0, 0]).tolist())


def _goal_positions(motions: np.ndarray, scene: Scene) -> list[tuple[float, float, float]]:
    """Where the clouds' means go by motions (N, 4, 4)."""
    return [
        tuple((motion[:3, :3] @ cloud.centroid + motion[:3, 3]).tolist())
        for motion, cloud in zip(motions, scene.objects, strict=True)
    ]


def chosen(rank: int, arrangement: Arrangement, scene: Scene) -> events.Chosen:
    """The choice of an arrangement; `rank` counts from 1."""
    motions = arrangement.goal_from_initial
    goals = tuple(
        {"name": cloud.name, "position": position, "goal_from_initial": motion}
        for cloud, position, motion in zip(scene.objects, _goal_positions(motions, scene), motions, strict=True)
    )
    return events.Chosen(rank, dict(arrangement.scores), goals, arrangement=arrangement, scene=scene)


def release(
    table: TableScene, scene: Scene, spec: StructureSpec, arrangement: Arrangement
) -> Generator[events.Event, None, None]:
    """Tries a goal under the physical part of the evaluation protocol, without the arm, on a copy of the table.

    Args:
        table: where it would be built; it stays as it is.
        scene: what was seen there.
        spec: what was asked for.
        arrangement: the goal.

    Raises:
        NoValidGoal: when it does not hold.
    """
    from structdiffusion.protocol.physical_stability import place_and_check
    from structdiffusion.simulation.world import TabletopWorld

    began = time.perf_counter()
    poses = table.world.poses()
    pictures: list[np.ndarray] = []

    def photograph(world: TabletopWorld) -> None:
        pictures.append(world.picture(camera=table.world.camera))

    initial = np.array(poses[: table.count])
    there = [i for i in range(table.count, len(poses)) if table.names[i] not in table.fallen]
    verdict = place_and_check(
        table.models[: table.count],
        initial,
        arrangement.goal_from_initial,
        spec,
        table.world.table,
        [(table.models[i], poses[i]) for i in there],  # what has fallen off goes on falling
        [*table.names[: table.count], *(table.names[i] for i in there)],
        table.world.ground,
        on_end=photograph,
    )
    seconds = time.perf_counter() - began
    yield _tried(scene, initial, verdict.world_from_final)
    caption = "the goal as it came to rest in physics, released without the arm; the table itself is unchanged"
    yield events.Pictured(TRIED_PICTURE, caption, pictures[0])
    yield events.Checked(
        verdict.success, verdict.failure, verdict.checks, verdict.detail, "released", seconds, table.bodies
    )
    if not verdict.success:
        raise NoValidGoal(f"the best imagined goal does not hold ({verdict.failure}): {verdict.detail}")


def _tried(scene: Scene, initial: np.ndarray, final: np.ndarray) -> events.Tried:
    """Where objects ended that were released from goals; poses (N, 4, 4), NaN for those never released."""
    motions = final @ np.linalg.inv(initial)
    motions[np.isnan(motions).any(axis=(1, 2))] = np.eye(4)
    return events.Tried(tuple(_goal_positions(motions, scene)), _turns(motions))


def build(
    table: TableScene,
    scene: Scene,
    spec: StructureSpec,
    arrangements: Sequence[Arrangement],
    seed: int,
    *,
    ranks: Sequence[int] | None = None,
    film: bool = True,
    watch: Callable[[TableScene], None] | None = None,
    log: TrajectoryLog | None = None,
) -> Generator[events.Event, None, None]:
    """Builds with the arm, looks after every placement, and judges what stands.

    Args:
        table: where it is built.
        scene: what was seen there.
        spec: what was asked for.
        arrangements: imagined goals, best first.
        seed: what the arm's planning draws follows from it.
        ranks: of the arrangements, from 1; by default they are numbered in order.
        film: tell a film of the arm at work too, however that ends.
        watch: called after every physics step while the arm is at work.
        log: told of every motion of the arm.

    Raises:
        ExecutionFailed: when not everything was placed, or what was built does not stand as asked.
        KeyboardInterrupt: when somebody interrupts it; `Stopped` is told first where the arm was at work.
    """
    from agent.arm.events import Picked, Placed, PlaceFailed, PlanFailed, Planned
    from agent.arm.executor import build_structure
    from agent.pipeline.film import Film
    from agent.scenes.table_scene import SHOULDER

    initial = np.array(table.world.poses()[: table.count])
    rng = np.random.default_rng(seed)
    numbers = ranks or range(1, len(arrangements) + 1)
    placed: list[int] = []  # one that was pushed away may be placed twice
    index, trouble = 0, "no arrangement could be planned"
    reel = Film(lambda: table.picture(SHOULDER))

    def on_step() -> None:
        if film:
            reel.step()
        if watch is not None:
            watch(table)

    def illustrated(event: events.Event) -> Iterator[events.Event]:
        nonlocal index, trouble
        if isinstance(event, Planned) and event.arrangement != index:
            index = event.arrangement
            yield chosen(numbers[index], arrangements[index], scene)
        if isinstance(event, Planned | PlanFailed):
            event = replace(event, arrangement=numbers[event.arrangement] - 1)
        yield event
        if isinstance(event, PlaceFailed):
            trouble = f"{event.name} could not be placed: {event.reason}"
        if isinstance(event, Picked):
            picture = table.picture(SHOULDER)
            yield events.Pictured(f"placement-{len(placed) + 1}-picked", f"{event.name} in the hand", picture)
        if isinstance(event, Placed) and not event.aside:
            placed.append(event.object)
            caption = f"after placement {len(placed)}: {event.name}"
            yield events.Pictured(f"placement-{len(placed)}-after", caption, table.picture())

    try:
        work = build_structure(table.world, table.arm, scene, arrangements, rng=rng, on_step=on_step, log=log)
        yield from each_of(work, illustrated)
    except (Exception, KeyboardInterrupt):  # not `finally`: a generator that is closed may tell nothing more
        yield from _told(reel)
        raise
    yield from _told(reel)
    yield from _judge(table, spec, arrangements[index].goal_from_initial @ initial, len(set(placed)), trouble)


def each_of(
    work: Generator[events.Event, None, None], more: Callable[[events.Event], Iterator[events.Event]]
) -> Generator[events.Event, None, None]:
    """What `more` makes of each event of `work`, in turn.

    An interruption (KeyboardInterrupt) that meets whoever takes an event is handed on to `work`, which may be moving an
    arm: what it tells of that is told too, before the interruption goes on its way.
    """
    event = next(work, None)
    while event is not None:
        try:
            yield from more(event)
        except KeyboardInterrupt as interruption:
            event = work.throw(interruption)
        else:
            event = next(work, None)


def _told(reel: Film) -> Iterator[events.Filmed]:
    filmed = reel.finish()
    if filmed is not None:
        yield filmed


def _judge(
    table: TableScene, spec: StructureSpec, goals: np.ndarray, placed: int, trouble: str
) -> Iterator[events.Event]:
    from agent.pipeline.verdict import judge_built

    began = time.perf_counter()
    if placed < table.count:
        yield events.Pictured(LAST_PICTURE, "the scene in the end, through the camera", table.picture())
        raise ExecutionFailed(f"{placed} of {table.count} objects were placed: {trouble}")
    failure, checks = judge_built(table.world, range(table.count), goals, spec)
    yield events.Pictured(LAST_PICTURE, "the scene in the end, through the camera", table.picture())
    failed = next((check for check in checks if not check.passed), None)
    detail = f"{failed.name}: {failed.measured:.3g}, allowed {failed.limit}" if failed else "everything stands as asked"
    yield events.Checked(failure is None, failure, checks, detail, "arm", time.perf_counter() - began, table.bodies)
    if failure is not None:
        raise ExecutionFailed(f"the structure was built but does not stand as asked ({failure}): {detail}")
