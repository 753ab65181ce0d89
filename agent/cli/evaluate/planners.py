"""Judge arrangements and builds in physics: `structagent evaluate success`, `arm` and `recordings`."""

from __future__ import annotations

from enum import StrEnum
from functools import partial
from typing import Annotated, Any

import typer

from agent.cli.arguments import with_arguments
from agent.cli.evaluate.options import EvaluationArguments, RowsOption, ScenesOption, finish
from agent.cli.options import (
    ArmOption,
    ForceOutOption,
    Hold,
    HoldOption,
    JsonOption,
    ModelOption,
    ModelsOption,
    ObjectsOption,
    PoolOption,
    RayOption,
    SeedOption,
    UnverifiedOption,
    WeightsOption,
    arm_file,
)
from agent.runtime.output_ownership import claim_folder
from agent.runtime.stdio import import_pybullet_silently
from grounding.spec import SHAPES


class Difficulty(StrEnum):
    """How hard scenes are to perceive."""

    plain = "plain"
    hard = "hard"


StructuresOption = Annotated[
    list[str] | None,
    typer.Option(
        metavar="|".join(SHAPES),
        help="Structure to measure. Repeatable.  [default: the first four, which every planner builds]",
    ),
]
CountOption = Annotated[
    str | None,
    typer.Option(metavar="LOW-HIGH", help="Number of objects in the structure; by default as in training."),
]


@with_arguments
def success(
    arguments: EvaluationArguments,
    model: ModelsOption = None,
    structure: StructuresOption = None,
    scenes: ScenesOption = 50,
    top_k: Annotated[
        int | None,
        typer.Option(metavar="N", min=1, help="Largest k of success@k; by default 5, or --candidates if that is less."),
    ] = None,
    objects_per_scene: CountOption = None,
    table: Annotated[
        str | None, typer.Option(metavar="DEPTHxBREADTH", help="Size of the table, m; by default 0.54x0.90.")
    ] = None,
    camera: Annotated[
        str, typer.Option(metavar="robot|opposite|left|right", help="Side of the table from which the camera looks.")
    ] = "robot",
    ray: RayOption = None,
    pictures: Annotated[
        int,
        typer.Option(metavar="N", min=0, help="With --out: largest number of pictures per planner and failure class."),
    ] = 5,
) -> None:
    """Measure how often planned structures stand.

    The best-ranked arrangement of each scene is released in physics, object by object and without the arm. All planners
    get the same scenes.

    \b
    DIR gets rows.jsonl with a row per planner and scene: the same command resumes an
    evaluation that was stopped, and one with more planners or scenes adds to it. At the
    end eval.json, tables.md, success_at_k.png and failures.png report all rows, and
    failures/ has pictures of failed arrangements.

    Example: structagent evaluate success --objects ycb --model diffusion --model geometric --out out/success
    """
    arguments.begin()
    from agent.evaluation.success.config import TOP_K, SuccessConfig
    from agent.evaluation.success.measure import checked_structures, measure_success
    from agent.evaluation.success.report import print_success, write_success

    most = min(TOP_K, arguments.candidates) if top_k is None else top_k
    config = SuccessConfig(
        **arguments.settings, top_k=most, objects_per_scene=objects_per_scene, table=table, camera=camera
    )
    structures = checked_structures(structure)
    options: dict[str, Any] = {"ray": ray, "pictures": pictures, **arguments.storing}
    measure = partial(measure_success, config, model or ["diffusion"], structures, scenes, **options)
    arguments.finish(measure, print_success, write_success)


@with_arguments
def arm(
    arguments: EvaluationArguments,
    model: ModelOption = "diffusion",
    structure: StructuresOption = None,
    scenes: ScenesOption = 5,
    objects_per_scene: CountOption = None,
    hold: HoldOption = Hold.friction,
    arm: ArmOption = None,
) -> None:
    """Measure how often the arm builds a structure.

    Reports how often the arm finds a plan, and how often the structure that it builds stands as specified.

    \b
    DIR gets rows.jsonl with a row per scene: the same command resumes an evaluation that
    was stopped, and one with more scenes adds to it. At the end eval.json has the report.

    Example: structagent evaluate arm --objects ycb --scenes 5 --out out/arm
    """
    file = arm_file(arm)
    arguments.begin()
    from agent.evaluation.arm import ArmConfig, measure_arm, print_arm
    from agent.evaluation.success.measure import checked_structures

    config = ArmConfig(
        **arguments.settings,
        model=model,
        hold=hold.value,
        objects_per_scene=objects_per_scene,
        arm=None if file is None else str(file),
    )
    measure = partial(measure_arm, config, checked_structures(structure), scenes, **arguments.storing)
    arguments.finish(measure, print_arm)


def recordings(
    objects: ObjectsOption = "ycb",
    model: ModelOption = "diffusion",
    weights: WeightsOption = None,
    allow_unverified: UnverifiedOption = False,
    scenes: ScenesOption = 8,
    seed: SeedOption = 0,
    execute: Annotated[
        bool, typer.Option("--execute/--no-execute", help="Build with the arm, or only check each goal without it.")
    ] = True,
    difficulty: Annotated[
        Difficulty,
        typer.Option(
            help="Separate objects and one camera, or stacked, touching and hidden objects, four sides, three sensors."
        ),
    ] = Difficulty.plain,
    workers: PoolOption = None,
    out: RowsOption = None,
    force: ForceOutOption = False,
    json_output: JsonOption = False,
) -> None:
    """Compare runs on recordings with simulation.

    Simulated scenes are recorded into bags. Reports which objects are found in the bags, and whether runs on them end
    as in simulation.

    \b
    DIR gets rows.jsonl with a row per scene: the same command resumes an evaluation that
    was stopped, and one with more scenes adds to it. At the end eval.json has the report.

    Example: structagent evaluate recordings --objects ycb --scenes 8 --out out/recordings
    """
    claim_folder(out, "evaluation", force)
    import_pybullet_silently()
    from agent.evaluation.recordings import measure_recordings, print_recordings
    from agent.evaluation.report import write_evaluation

    options: dict[str, Any] = {"workers": workers, "out": out, "allow_unverified": allow_unverified}
    options["hard"] = difficulty is Difficulty.hard
    measure = partial(measure_recordings, objects, model, weights, scenes, seed, execute, **options)
    finish(measure, print_recordings, out, json_output, write_evaluation)
