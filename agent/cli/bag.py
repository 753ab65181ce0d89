"""Inspect and create recordings: the commands of `structagent bag`."""

from __future__ import annotations

import json
import sys
from enum import StrEnum
from pathlib import Path
from typing import Annotated, TextIO

import typer

from agent.cli.options import (
    AtOption,
    CameraPoseOption,
    DepthUnitOption,
    JsonOption,
    ObjectsOption,
    SeedOption,
    TopicOption,
    numbers_of,
    reading_of,
)
from agent.errors import BadInput, UsageError
from agent.runtime.stdio import import_pybullet_silently, results_stream

bag_app = typer.Typer(rich_markup_mode=None)

OutOption = Annotated[
    Path,
    typer.Option(
        metavar="FILE",
        help="Recording to write: .bag (ROS 1), .mcap (ROS 2), or no suffix for a ROS 2 folder.",
        show_default=False,
    ),
]
ForceOption = Annotated[bool, typer.Option("--force", help="Overwrite existing files.")]


class Arm(StrEnum):
    """The supported Jaco arms."""

    j2s7s300 = "j2s7s300"
    j2n6s300 = "j2n6s300"
    j2s6s300 = "j2s6s300"


@bag_app.callback()
def _bag() -> None:
    """Inspect and create recordings.

    Recordings are bags of ROS 1 (.bag) and ROS 2 (.mcap, .db3, a folder), point clouds and folders of images. `run`,
    `chat` and `batch` use them with --scene FILE. ROS is not needed.

    Example: structagent bag info session.bag
    """


@bag_app.command("info")
def info(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="Bag, or example.", show_default=False)],
    topic: TopicOption = None,
    depth_unit: DepthUnitOption = None,
    json_output: JsonOption = False,
) -> None:
    """Show the contents of a bag.

    Lists topics, times and frames, what is missing, and how the bag would be used.

    Example: structagent bag info session.bag
    """
    from agent.recordings import recording_path
    from agent.recordings.inspection import inspect_bag, print_bag_info

    reading = reading_of(topics=topic, depth_unit=depth_unit)
    with results_stream() as results:
        found = inspect_bag(recording_path(file), reading.topics, reading.depth_unit)
        if json_output:
            print(json.dumps(found.to_dict(), indent=1, ensure_ascii=False), file=results)
        else:
            print_bag_info(found, results)


@bag_app.command("objects")
def objects(
    file: Annotated[
        Path,
        typer.Argument(
            metavar="FILE", help="Bag, .ply or .pcd point cloud, folder of images, or example.", show_default=False
        ),
    ],
    at: AtOption = None,
    topic: TopicOption = None,
    camera_pose: CameraPoseOption = None,
    depth_unit: DepthUnitOption = None,
    picture: Annotated[
        Path | None, typer.Option(metavar="FILE", help="PNG file for the camera image with the found objects.")
    ] = None,
    force: ForceOption = False,
    json_output: JsonOption = False,
) -> None:
    """Find the objects in a recording.

    Lists their names, positions, sizes and colours, and the table.

    Example: structagent bag objects session.bag --picture session.png
    """
    if picture is not None:
        _check_new_file(picture, "--picture", (".png",), force)
    reading = reading_of(at, topic, camera_pose, depth_unit)
    from agent.perception.nouns.recognition import HOW_TO_GET, nouns_available
    from agent.perception.overlay import labelled_picture
    from agent.perception.perceive import perceive
    from agent.perception.report import objects_json, print_objects
    from agent.recordings import recording_path
    from agent.recordings.load import read_recording

    with results_stream() as results:
        recording = read_recording(recording_path(file), reading)
        segments = perceive(recording)
        if json_output:
            content = {"file": str(file), "used": dict(recording.used), **objects_json(segments)}
            content["notes"] = [*recording.notes, *segments.notes]
            print(json.dumps(content, indent=1, ensure_ascii=False), file=results)
        else:
            print_objects(segments, results)
            _print_notes(recording.notes, results)
            if not nouns_available():
                _print_notes((HOW_TO_GET,), results)
        if picture is not None:
            from PIL import Image

            try:
                picture.parent.mkdir(parents=True, exist_ok=True)
                Image.fromarray(labelled_picture(recording, segments)).save(picture)
            except OSError as error:
                raise BadInput(f"cannot write {str(picture)!r}: {error.strerror}") from error
            print(f"wrote {picture}", file=sys.stderr)
    if not segments.objects:
        raise BadInput(f"{str(file)!r} shows a table and no object on it")


@bag_app.command("record")
def record(
    out: OutOption,
    seed: SeedOption = 0,
    objects: ObjectsOption = "ycb",
    scene: Annotated[
        str, typer.Option(metavar="simulated|FILE", help="Random scene, or a scene file (.yaml).")
    ] = "simulated",
    instruction: Annotated[
        str | None,
        typer.Option(metavar="TEXT", help="Draw the scene that `run TEXT` draws with the same seed and objects."),
    ] = None,
    arm: Annotated[
        Arm, typer.Option(metavar="|".join(Arm), help="Jaco arm beside the table, in its folded pose.")
    ] = Arm.j2s7s300,
    seconds: Annotated[float, typer.Option(metavar="SECONDS", min=0.1, max=600.0, help="Duration.")] = 1.0,
    rate: Annotated[float, typer.Option(metavar="X", min=0.1, max=60.0, help="Images per second.")] = 15.0,
    truth: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Scene file (.yaml) for the true objects and poses.")
    ] = None,
    force: ForceOption = False,
    json_output: JsonOption = False,
) -> None:
    """Record a simulated scene.

    The messages are those of a kinova-ros driver and a RealSense camera.

    Example: structagent bag record --instruction "put the cups in a small circle" --seed 3 --out cups.bag
    """
    from agent.recordings.bag_writer import check_new

    check_new(out, force)
    if truth is not None:
        _check_new_file(truth, "--truth", (".yaml", ".yml"), force)
    import_pybullet_silently()
    from agent.pipeline.table_to_record import TableToRecord, recordable_table
    from agent.recordings.inspection import inspect_bag
    from agent.scenes.files import write_scene
    from agent.scenes.record_bag import record_session
    from agent.scenes.table_scene import drawing_and_noise

    with results_stream() as results:
        with recordable_table(TableToRecord(scene, objects, instruction, arm.value, seed)) as found:
            record_session(found.table, out, drawing_and_noise(seed)[1], seconds, rate, force)
            if truth is not None:
                write_scene(found.truth(truth.parent), truth, f"what {out.name} shows")
            names = found.table.names
        if json_output:
            content = inspect_bag(out).to_dict() | {
                "objects": list(names),
                "truth": None if truth is None else str(truth),
            }
            print(json.dumps(content, indent=1, ensure_ascii=False), file=results)
    print(f"wrote {out}: {', '.join(names)}", file=sys.stderr)
    if truth is not None:
        print(f"wrote {truth}", file=sys.stderr)


@bag_app.command("from-rgbd")
def from_rgbd(
    folder: Annotated[
        Path,
        typer.Argument(
            metavar="DIR",
            help="Folder with *color*.png or .jpg, *depth*.png, .tiff or .npy, and camera_params.json or K.txt.",
            show_default=False,
        ),
    ],
    out: OutOption,
    name: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="Image to use, such as 000004; by default the first."),
    ] = None,
    intrinsics: Annotated[
        str | None, typer.Option(metavar="FX,FY,CX,CY", help="Camera intrinsics, pixels; needed if no file has them.")
    ] = None,
    depth_unit: DepthUnitOption = None,
    depth_scale: Annotated[str | None, typer.Option(hidden=True, help="The former name of --depth-unit.")] = None,
    force: ForceOption = False,
    json_output: JsonOption = False,
) -> None:
    """Convert colour and depth images to a bag.

    Example: structagent bag from-rgbd pictures --name 000004 --out desk.bag
    """
    from agent.recordings.bag_writer import check_new

    check_new(out, force)
    lens = None
    if intrinsics is not None and (lens := numbers_of(intrinsics, 4)) is None:
        raise UsageError(
            f"--intrinsics cannot be {intrinsics!r}; legal: four numbers FX,FY,CX,CY in pixels, such as "
            "525,525,319.5,239.5"
        )
    if None not in (depth_unit, depth_scale):
        raise UsageError("--depth-scale is the former name of --depth-unit; give --depth-unit alone")
    unit = reading_of(depth_unit=depth_unit or depth_scale).depth_unit
    from agent.recordings.convert import write_rgbd
    from agent.recordings.inspection import inspect_bag
    from agent.recordings.rgbd_folder import read_rgbd

    with results_stream() as results:
        picture = read_rgbd(folder, name, lens, unit)
        write_rgbd(picture, out, force)
        if json_output:
            content = inspect_bag(out).to_dict() | {"name": picture.name, "made_from": picture.used}
            content["notes"] = [*content["notes"], *picture.notes]
            print(json.dumps(content, indent=1, ensure_ascii=False), file=results)
    print(f"wrote {out}: {', '.join(f'{what} {file}' for what, file in picture.used.items())}", file=sys.stderr)
    _print_notes(picture.notes, sys.stderr)


@bag_app.command("from-cloud")
def from_cloud(
    file: Annotated[
        Path,
        typer.Argument(
            metavar="FILE", help="Point cloud (.ply, .pcd) in the optical frame of the camera.", show_default=False
        ),
    ],
    out: OutOption,
    depth_unit: DepthUnitOption = None,
    force: ForceOption = False,
    json_output: JsonOption = False,
) -> None:
    """Convert a point cloud to a bag.

    Example: structagent bag from-cloud desk.pcd --out desk.bag
    """
    from agent.recordings.bag_writer import check_new

    check_new(out, force)
    from agent.recordings.convert import write_cloud
    from agent.recordings.inspection import inspect_bag
    from agent.recordings.point_cloud_files import read_cloud

    with results_stream() as results:
        points, color, notes = read_cloud(file, reading_of(depth_unit=depth_unit).depth_unit)
        write_cloud(points, color, out, force)
        if json_output:
            content = inspect_bag(out).to_dict() | {"made_from": {"points": str(file)}}
            content["notes"] = [*content["notes"], *notes]
            print(json.dumps(content, indent=1, ensure_ascii=False), file=results)
    print(f"wrote {out}: points {file}", file=sys.stderr)
    _print_notes(notes, sys.stderr)


def _print_notes(notes: tuple[str, ...], where: TextIO) -> None:
    for note in notes:
        print(f"note: {note}", file=where)


def _check_new_file(path: Path, option: str, suffixes: tuple[str, ...], force: bool) -> None:
    """Refuse a file with another suffix, and one that exists."""
    if path.suffix.lower() not in suffixes:
        raise UsageError(f"{option} cannot be {str(path)!r}; legal: a file with the suffix {' or '.join(suffixes)}")
    if path.is_dir() or (path.exists() and not force):
        raise UsageError(f"{option} must be a new file, but {str(path)!r} exists; --force overwrites a file")
