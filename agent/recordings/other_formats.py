"""Read recordings that are not bags: a cloud on disk, or a folder of pictures."""

from __future__ import annotations

from pathlib import Path

from agent.errors import BadInput, UsageError
from agent.recordings.cloud_frame import in_optical_frame
from agent.recordings.cloud_picture import UNORGANISED, as_picture
from agent.recordings.point_cloud_files import SUFFIXES, read_cloud
from agent.recordings.point_count import with_fewer_points
from agent.recordings.recording import DepthFrame, ReadingOf, Recording
from agent.recordings.rgbd_folder import read_rgbd


def read_other(path: Path, options: ReadingOf = ReadingOf()) -> Recording:
    """Read a .ply or .pcd file, or the first frame of a folder of images as described in
    `agent.recordings.rgbd_folder`.

    Such recordings do not contain the arm's pose: only `options.world_from_camera` can.

    Raises:
        BadInput: if the path does not exist, or has no usable data.
        UsageError: for options that only bags know.
    """
    for given, name in ((options.at is not None, "--at"), (bool(options.topics), "--topic")):
        if given:
            what = "a folder of pictures" if path.is_dir() else "a cloud"
            raise UsageError(f"{name} is for bags, but {str(path)!r} is {what}")
    if path.suffix.lower() in SUFFIXES:
        points, color, notes = read_cloud(path, options.depth_unit)
        frame, picture = as_picture(DepthFrame(points, color))
        frame, reduced = with_fewer_points(frame)
        said = ""
        if options.world_from_camera is None and not picture:  # such a picture is in the optical frame
            frame, said = in_optical_frame(frame)
            frame, picture = as_picture(frame)
        said = said or "the cloud was taken to be in the camera's optical frame: z forward, x right, y down"
        notes = (said, picture or ("" if frame.organised else UNORGANISED), *notes)
        notes = tuple(filter(None, notes))
        notes = (*notes, reduced) if reduced else notes
        return Recording(path, frame, None, options.world_from_camera, used={"points": path.name}, notes=notes)
    if not path.exists():
        raise BadInput(f"there is no recording {str(path)!r}")
    folder = read_rgbd(path, depth_unit=options.depth_unit)
    frame, reduced = with_fewer_points(DepthFrame(folder.points, folder.color, intrinsics=folder.intrinsics))
    notes = (*folder.notes, reduced) if reduced else folder.notes
    return Recording(path, frame, None, options.world_from_camera, used=folder.used, notes=notes)
