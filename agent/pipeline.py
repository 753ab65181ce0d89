"""From an instruction to a structure, as a stream of events: read, look, imagine, choose, build, check.

Every known error ends the stream with `Failed` and the exit code that says whose error it was; what listeners do with
the events is their own affair.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from agent import events
from agent.errors import DONE, ExecutionFailed, NotBuildable, NoValidGoal, exit_code_of, one_sentence
from agent.reading import ReadingOptions, make_reader

if TYPE_CHECKING:
    from agent.scenes.table import TableScene
    from grounding.encoder import SentenceEncoder
    from grounding.reading import Reading
    from grounding.spec import StructureSpec
    from structdiffusion.observation import Arrangement, Scene
    from structdiffusion.sampling import Planner

CANDIDATES = 64


@dataclass(frozen=True)
class RunOptions:
    """What decides a run besides its instruction.

    Attributes:
        scene: where the scene comes from: "simulated", or the path of a scene file.
        objects: for a simulated scene "ycb", "procedural", "random_urdfs" or a folder of meshes.
        model: the planner's name, as `structdiffusion.sampling` has it.
        weights: the folder of its checkpoints, or `None` for those shipped.
        seed: everything drawn at random follows from it.
        execute: build with the arm, or stop at the imagined goal and only try it in physics.
        reading: how the instruction is read.
    """

    scene: str = "simulated"
    objects: str = "ycb"
    model: str = "diffusion"
    weights: Path | None = None
    seed: int = 0
    execute: bool = True
    reading: ReadingOptions = ReadingOptions()


def run_instruction(text: str, options: RunOptions) -> Iterator[events.Event]:
    """Carries an instruction out; yields what happens, from `Started` to `Finished`.

    Args:
        text: the instruction.
        options: everything else.
    """
    started = time.perf_counter()
    run = _Run(text, options)
    code = DONE
    yield events.Started(text, events.json_value(asdict(options)))
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

    def __init__(self, text: str, options: RunOptions) -> None:
        self.text, self.options = text, options
        self.step = "parse"
        self._since = time.perf_counter()

    def _enter(self, step: str) -> None:
        self.step, self._since = step, time.perf_counter()

    def _seconds(self) -> float:
        return time.perf_counter() - self._since

    def steps(self) -> Iterator[events.Event]:
        import torch

        from agent.planning import checked_planner
        from agent.scenes.sources import scene_source
        from grounding.encoder import SentenceEncoder
        from grounding.selection import select_objects

        torch.set_num_threads(1)  # the tensors are too small to share; threads would wait for each other
        self._enter("parse")
        encoder = SentenceEncoder()
        reading = make_reader(self.options.reading, encoder).read(self.text)
        if reading.status != "ok":
            raise NotBuildable(reading.message)
        seconds = self._seconds()
        self._enter("model")  # early, because a wrong name or a broken checkpoint should not cost a minute
        planner = checked_planner(self.options.model, self.options.weights)
        self._enter("scene")
        source = scene_source(self.options.scene, self.options.objects)
        selection = select_objects(self.text, source.called, encoder)
        parse = reading.parse
        yield events.Parsed(
            reading.spec,
            parse.confidence,
            parse.evidence,
            parse.parser,
            parse.dropped,
            selection.named,
            reading.viewpoint,
            parse.prompt_sha256,
            reading.fallback,
            seconds,
        )

        def meant(nouns: Sequence[str]) -> Sequence[int]:
            return select_objects(self.text, nouns, encoder).indices

        with source.open(reading.spec, meant, self.options.seed) as table:
            scene = table.look()
            yield self._perceived(scene)
            yield from self._imagine_and_build(planner, table, scene, reading, encoder)

    def _perceived(self, scene: Scene) -> events.Perceived:
        seen = [
            events.SeenObject(
                cloud.name, cloud.category, number < len(scene.objects), tuple(cloud.centroid.tolist()), len(cloud.points)
            )
            for number, cloud in enumerate((*scene.objects, *scene.distractors))
        ]
        table = scene.table
        rectangle = (table.x_min, table.x_max, table.y_min, table.y_max)
        return events.Perceived(tuple(seen), rectangle, self._seconds(), scene=scene)

    def _imagine_and_build(
        self, planner: Planner, table: TableScene, scene: Scene, reading: Reading, encoder: SentenceEncoder
    ) -> Iterator[events.Event]:
        import torch

        from agent.planning import worthwhile
        from grounding.corpus import sentences
        from structdiffusion.layouts import LayoutError
        from structdiffusion.observation import Goal

        self._enter("imagination")
        # The planner hears the world's frame: what was said from across the table is said anew.
        words = self.text if reading.spec == reading.parse.spec else sentences(reading.spec)[0]
        goal = Goal(reading.spec, words, encoder.encode([words])[0])
        generator = torch.Generator().manual_seed(self.options.seed)
        try:
            arrangements = planner.propose(scene, goal, count=CANDIDATES, generator=generator)
        except LayoutError as error:
            raise NoValidGoal(f"the model {self.options.model!r} imagined no valid arrangement: {error}") from error
        yield events.Imagined(
            self.options.model,
            tuple(_candidate(rank, arrangement, scene) for rank, arrangement in enumerate(arrangements, start=1)),
            self._seconds(),
            scene=scene,
            arrangements=tuple(arrangements),
        )
        arrangements = worthwhile(arrangements)
        yield _chosen(1, arrangements[0], scene)
        if self.options.execute:
            yield from self._build(table, scene, reading.spec, arrangements)
        else:
            yield from self._release(table, reading.spec, arrangements[0])

    def _release(self, table: TableScene, spec: StructureSpec, arrangement: Arrangement) -> Iterator[events.Event]:
        """Tries the goal under the contract's physical protocol, without the arm."""
        from structdiffusion.physical import place_and_check

        self._enter("check")
        verdict = place_and_check(
            table.models[: table.count],
            table.world_from_initial[: table.count],
            arrangement.goal_from_initial,
            spec,
            table.world.table,
            list(zip(table.models, table.world_from_initial, strict=True))[table.count :],
            table.names,
        )
        yield events.Checked(
            verdict.success, verdict.failure, verdict.checks, verdict.detail, "released", self._seconds()
        )
        if not verdict.success:
            raise NoValidGoal(f"the best imagined goal does not hold ({verdict.failure}): {verdict.detail}")

    def _build(
        self, table: TableScene, scene: Scene, spec: StructureSpec, arrangements: list[Arrangement]
    ) -> Iterator[events.Event]:
        """Builds with the arm, looks after every placement, and judges what stands."""
        from agent.arm.events import Picked, Placed, PlaceFailed, Planned
        from agent.arm.executor import build_structure
        from agent.judging import judge_built

        self._enter("build")
        initial = np.array(table.world.poses()[: table.count])
        rng = np.random.default_rng(self.options.seed)
        rank, placed, trouble = 0, 0, "no arrangement could be planned"
        for event in build_structure(table.world, table.arm, scene, arrangements, rng=rng):
            if isinstance(event, Planned) and event.arrangement != rank:
                rank = event.arrangement
                yield _chosen(rank + 1, arrangements[rank], scene)
            yield event
            if isinstance(event, PlaceFailed):
                trouble = f"{event.name} could not be placed: {event.reason}"
            if isinstance(event, Picked):
                yield events.Pictured(
                    f"placement-{placed + 1}-picked", f"{event.name} in the hand", table.picture("opposite")
                )
            if isinstance(event, Placed) and not event.aside:
                placed += 1
                yield events.Pictured(
                    f"placement-{placed}-after", f"after placement {placed}: {event.name}", table.picture()
                )
        self._enter("check")
        if placed < table.count:
            yield events.Pictured("camera-after", "the scene in the end, through the camera", table.picture())
            raise ExecutionFailed(f"{placed} of {table.count} objects were placed: {trouble}")
        goals = arrangements[rank].goal_from_initial @ initial
        failure, checks = judge_built(table.world, range(table.count), goals, spec)
        yield events.Pictured("camera-after", "the scene in the end, through the camera", table.picture())
        failed = next((check for check in checks if not check.passed), None)
        detail = f"{failed.name}: {failed.measured:.3g}, allowed {failed.limit}" if failed else "everything stands as asked"
        yield events.Checked(failure is None, failure, checks, detail, "arm", self._seconds())
        if failure is not None:
            raise ExecutionFailed(f"the structure was built but does not stand as asked ({failure}): {detail}")


def _goal_positions(arrangement: Arrangement, scene: Scene) -> list[tuple[float, float, float]]:
    return [
        tuple((motion[:3, :3] @ cloud.centroid + motion[:3, 3]).tolist())
        for motion, cloud in zip(arrangement.goal_from_initial, scene.objects, strict=True)
    ]


def _candidate(rank: int, arrangement: Arrangement, scene: Scene) -> events.Candidate:
    return events.Candidate(rank, dict(arrangement.scores), tuple(_goal_positions(arrangement, scene)))


def _chosen(rank: int, arrangement: Arrangement, scene: Scene) -> events.Chosen:
    goals = tuple(
        {"name": cloud.name, "position": position, "goal_from_initial": motion}
        for cloud, position, motion in zip(
            scene.objects, _goal_positions(arrangement, scene), arrangement.goal_from_initial, strict=True
        )
    )
    return events.Chosen(rank, dict(arrangement.scores), goals, arrangement=arrangement, scene=scene)
