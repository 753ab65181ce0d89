"""Make, show and check scene files: the verbs of `structagent scene`."""

from __future__ import annotations

import json
import sys
from enum import Enum
from pathlib import Path
from typing import Annotated, Any

import typer

from agent.cli.options import JsonOption, ObjectsOption, SeedOption
from agent.errors import BadInput, UsageError
from agent.runtime.stdio import import_pybullet_silently, results_stream
from grounding.spec import SHAPES

scene_app = typer.Typer(rich_markup_mode=None)

FileArgument = Annotated[Path, typer.Argument(metavar="FILE", help="Scene file.", show_default=False)]


# What the objects of a new scene can make.
Shape = Enum("Shape", {shape.replace(" ", "_"): shape for shape in SHAPES}, type=str)  # type: ignore[misc]  # the shapes are read from files


@scene_app.callback()
def _scene() -> None:
    """Create, show and validate scene files.

    `run`, `chat` and `batch` set the table from them with --scene FILE.

    \b
    version: 1                 # of the schema
    objects:
    - mesh: ycb/025_mug        # LIBRARY/OBJECT, or a mesh file seen from this file
      x: 0.4                   # m away from the arm, 0.18 to 0.72
      y: -0.1                  # m to its left, -0.45 to 0.45
      yaw: 90                  # degrees; this and the following may be left out
      z: 0                     # m from the table top to the lowest point
      roll: 0                  # degrees about its front
      pitch: 0                 # degrees about its left
      name: grandma's mug      # unique
      noun: mug
      color: blue              # or "#2050ff", in quotes

    Example: structagent scene new --objects ycb --seed 3 --out desk.yaml
    """


@scene_app.command("show")
def show(file: FileArgument, json_output: JsonOption = False) -> None:
    """Show the objects of a scene and their poses.

    Lengths are in metres, angles in degrees.

    Example: structagent scene show desk.yaml
    """
    import_pybullet_silently()
    from agent.scenes.object_placement import load_scene
    from agent.scenes.report import print_scene, scene_report

    with results_stream() as results:
        standing = load_scene(file)
        if json_output:
            print(json.dumps(scene_report(file, standing), indent=1, ensure_ascii=False), file=results)
        else:
            print_scene(standing, results)


@scene_app.command("new")
def new(
    objects: ObjectsOption = "ycb",
    shape: Annotated[Shape | None, typer.Option(help="Structure that the objects can make; by default any.")] = None,
    seed: SeedOption = 0,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="File for the scene; by default standard output.")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Overwrite an existing file.")] = False,
) -> None:
    """Draw a random scene as a file to edit.

    Example: structagent scene new --objects ycb --shape tower --seed 3 --out desk.yaml
    """
    if out is not None and out.exists() and not force:
        raise UsageError(f"--out must be a new file, but {str(out)!r} exists; --force overwrites it")
    import_pybullet_silently()
    from agent.scenes.files import scene_text, write_scene
    from agent.scenes.random_scenes import drawn_scene

    with results_stream() as results:
        lines = drawn_scene(objects, None if shape is None else shape.value, seed, out.parent if out else Path())
        made_by = ["structagent scene new", f"--objects {objects}", *([f"--shape '{shape.value}'"] if shape else [])]
        comment = " ".join([*made_by, f"--seed {seed}"])
        if out is None:
            print(scene_text(lines, comment), end="", file=results)
        else:
            write_scene(lines, out, comment)
            print(f"wrote {out}: {', '.join(str(line.name) for line in lines)}", file=sys.stderr)


@scene_app.command("validate")
def validate(file: FileArgument, json_output: JsonOption = False) -> None:
    """Check a scene file for errors.

    Every error is listed with its line.

    Example: structagent scene validate desk.yaml
    """
    import_pybullet_silently()
    from agent.scenes.files import SceneFileError
    from agent.scenes.object_placement import load_scene

    problems: tuple[Any, ...] = ()
    with results_stream() as results:
        try:
            count = len(load_scene(file))
        except SceneFileError as error:
            problems = error.problems
        if json_output:
            found = [{"line": problem.line, "message": problem.message} for problem in problems]
            print(json.dumps({"file": str(file), "valid": not found, "problems": found}, indent=1), file=results)
        elif problems:
            for problem in problems:
                print(f"{file}:{problem.line}: {problem.message}", file=results)
        else:
            print(f"{file}: {count} object{'s' if count > 1 else ''}, no errors", file=results)
    if problems:
        raise BadInput(f"the scene file {str(file)!r} has {len(problems)} problem{'s' if len(problems) > 1 else ''}")
