"""Load one moment of a recorded session from any format."""

from __future__ import annotations

import zlib
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from agent.errors import BadInput, UsageError
from agent.recordings.bag_reader import METADATA, STORAGES, Bag, Message, Stream, open_bag
from agent.recordings.cloud_frame import in_optical_frame
from agent.recordings.cloud_picture import UNORGANISED, as_picture
from agent.recordings.depth_scale import ScaleFinder, stored
from agent.recordings.image_decoding import color_picture, compressed_color, compressed_size
from agent.recordings.joint_states import arm_state, joint_streams
from agent.recordings.message_decoding import (
    COMPRESSED,
    Lens,
    frame_name,
    lens_of,
    stamp,
    stored_cloud,
    without_nothing,
)
from agent.recordings.point_count import lens_of_every, step_of, told_of, with_fewer_points
from agent.recordings.recording import DepthFrame, ReadingOf, Recording
from agent.recordings.survey import first_times
from agent.recordings.synchronization import Found, around, fused
from agent.recordings.tf_tree import (
    Frames,
    TransformLoop,
    base_frame,
    base_from_camera,
    read_frames,
    transform_streams,
)
from agent.recordings.topic_selection import Choice, Offer, choose
from structdiffusion.limits import MOST_PIXELS, MOST_PIXELS_TOGETHER

_OTHER_SUFFIXES = (".ply", ".pcd")
_LONGEST_LOOK = 1.0  # s; looks that are further apart show another scene
_SAME_PLACE = 0.003, 0.007  # m, and of a rotation matrix's entries together; a camera that moved less stood still
_SAME_TIME = 0.2  # s; colour that is further from the depth is worth a note


def read_recording(path: Path, options: ReadingOf = ReadingOf()) -> Recording:
    """Read one moment of the session at `path`: a bag of any kind, a cloud, or a folder of pictures.

    Raises:
        BadInput: if nothing is found there, or nothing usable.
        UsageError: for options that exclude each other or do not fit the recording.
    """
    if options.looks < 1:
        raise UsageError(f"at least 1 look is needed, not {options.looks}")
    if path.suffix.lower() in _OTHER_SUFFIXES or path.is_dir() and not _is_bag_folder(path):
        from agent.recordings.other_formats import read_other

        return read_other(path, options)
    with open_bag(path) as bag:
        try:
            return _read(bag, options)
        except BadInput as error:  # what was lost with the end of the bag may be the reason
            raise BadInput("; ".join((str(error), *bag.notes))) from error


def _is_bag_folder(path: Path) -> bool:
    """Return whether a folder is a ROS 2 bag."""
    return (path / METADATA).exists() or any(file.suffix in STORAGES for file in path.iterdir())


@dataclass(frozen=True)
class _Look:
    """One measurement.

    Attributes:
        points: (H, W, 3), the camera's optical frame, metres.
        colors: (H, W, 3) that came with them, or `None`.
        frame: the optical frame.
        stamp: when it was measured, nanoseconds.
        size: the rows and columns of the picture; `points` are those of every `step`-th of them.
        step: more than 1 for a large depth picture.
    """

    points: np.ndarray
    colors: np.ndarray | None
    frame: str
    stamp: int
    size: tuple[int, int]
    step: int = 1


def _read(bag: Bag, options: ReadingOf) -> Recording:
    """Read one moment of an open bag."""
    choice = choose(bag, options.topics)
    joints = joint_streams(bag, options.topics.get("joints"))
    moment = _moment(bag, options.at, choice, joints)
    notes = list(bag.notes)
    lens = None if choice.depth_info is None else _lens(bag, choice.depth_info, choice.source, moment)
    # The points of an unorganised cloud are not those of the next one.
    several = choice.points is None or choice.points.height > 1
    scale = ScaleFinder(bag, choice, options.depth_unit)
    looks = _looks(bag, choice, lens, scale, moment, options.looks if several else 1)
    notes += scale.notes
    look, recorded = looks[0].value, looks[0].time
    frames = read_frames(bag, look.stamp, _ways(choice, look.frame))
    looks = _from_one_place(bag, looks, frames)
    points, taken_from, count = fused([found.value.points for found in looks])
    color = None
    if look.colors is not None:
        color = look.colors.copy()
        for k in set(np.unique(taken_from)) - {0}:
            if looks[k].value.colors is not None:
                color[taken_from == k] = looks[k].value.colors[taken_from == k]
    if choice.color is not None:
        color, said = _color(bag, choice, look, points, recorded, frames, "color" in options.topics)
        notes += said
    if lens is not None:
        lens = lens.scaled(*look.size[::-1])
        notes += [lens.note] if lens.note else []
    arm = arm_state(bag, joints, recorded)
    notes += arm.notes
    try:
        base_pose, said = base_from_camera(frames, look.frame, arm.state.prefix if arm.state else "")
    except TransformLoop:
        if options.world_from_camera is None:
            raise
        base_pose, said = None, []
    notes += said
    intrinsics = None if lens is None else lens_of_every(lens.matrix, look.step)
    notes += [told_of(*look.size)] if look.step > 1 else []
    frame = DepthFrame(points, color, look.frame, (recorded - bag.start) / 1e9, intrinsics, count)
    frame, picture = as_picture(frame)
    frame, told = with_fewer_points(frame)
    notes += [told] if told else []
    if choice.points is not None and base_pose is None and options.world_from_camera is None and not picture:
        frame, told = in_optical_frame(frame)
        notes += [told] if told else []
        frame, picture = as_picture(frame)
    notes += [picture or UNORGANISED] if picture or not frame.organised else []
    return Recording(
        bag.path,
        frame,
        base_pose,
        options.world_from_camera,
        arm.state,
        used(choice, arm.stream, bag if base_pose is not None else None, color is not None),
        tuple(dict.fromkeys(notes)),
        arm.other,
    )


def measuring_notes(bag: Bag, choice: Choice, depth_unit: float | None) -> list[str]:
    """Return what a reading would say about the lens and the unit of the chosen topic, a sentence each.

    Raises:
        BadInput: if it could not be read.
    """
    moment = _moment(bag, None, choice, [])
    lens = None if choice.depth_info is None else _lens(bag, choice.depth_info, choice.source, moment)
    scale = ScaleFinder(bag, choice, depth_unit)
    look = _looks(bag, choice, lens, scale, moment, 1)[0].value
    if lens is not None:
        lens = lens.scaled(*look.size[::-1])
    return [*scale.notes, *([lens.note] if lens is not None and lens.note else [])]


def used(choice: Choice, joints: Stream | None, with_tf: Bag | None, with_color: bool = True) -> dict[str, str]:
    """Return the purpose of each used topic."""
    roles = {role: getattr(choice, role) for role in ("points", "depth", "depth_info")}
    if with_color:
        roles |= {"color": choice.color, "color_info": choice.color_info}
    named = {role: offer.stream.topic for role, offer in roles.items() if offer is not None}
    if joints is not None:
        named["joints"] = joints.topic
    if with_tf is not None:
        named["tf"] = ", ".join(sorted({stream.topic for stream in transform_streams(with_tf)}))
    return named


def _ways(choice: Choice, camera: str) -> list[tuple[str, str]]:
    """Return the pairs of frames that are needed: to the arm's base, and to the colour camera."""
    ways = [(camera, "")]
    if choice.color_info is not None and choice.color_info.frame != camera:
        ways.append((camera, choice.color_info.frame))
    return ways


def _moment(bag: Bag, at: float | None, choice: Choice, joints: list[Stream]) -> int:
    """Return the chosen moment, nanoseconds: by default the first at which every stream has a message."""
    if at is not None:
        if not 0 <= at <= bag.seconds + 1e-3:
            raise BadInput(f"{str(bag.path)!r} has no moment {at:g} s after its first; legal: 0 to {bag.seconds:.1f}")
        return bag.start + round(at * 1e9)
    offered = [choice.points, choice.depth, choice.depth_info, choice.color, choice.color_info]
    needed = [offer.stream for offer in offered if offer is not None] + joints[:1] + transform_streams(bag)
    return max(first_times(bag, needed).values())


def _lens(bag: Bag, info: Offer, picture: Offer, moment: int) -> Lens:
    """Return the lens of a picture from its CameraInfo nearest to the moment.

    Raises:
        BadInput: if no CameraInfo can be used.
    """
    rectified = "rect" in picture.stream.topic.rsplit("/", 2)[-1] or picture.stream.topic.endswith("rect_raw")

    def lens(message: Message) -> Lens:
        return _on_topic(info.stream, lambda: lens_of(bag.decoded(message), rectified))

    found = around(bag, info.stream, moment, lens, before=1, after=1)
    if not found:
        raise BadInput(f"{info.stream.topic} of {str(bag.path)!r} has no messages")
    return found[0].value


def _looks(
    bag: Bag, choice: Choice, lens: Lens | None, scale: ScaleFinder, moment: int, most: int
) -> list[Found[_Look]]:
    """Return the measurements nearest to the moment, the nearest first.

    Raises:
        BadInput: if there is none.
    """
    stream = choice.source.stream
    rays: dict[tuple[int, int], np.ndarray] = {}
    measured: dict[tuple[int, int], _Look | BadInput] = {}
    looked_at = 0  # pixels

    def look(message: Message) -> _Look:
        nonlocal looked_at
        decoded = bag.decoded(message)
        width, height = compressed_size(decoded) if stream.type == COMPRESSED else (decoded.width, decoded.height)
        if width * height <= MOST_PIXELS:  # otherwise it is refused before any work
            if looked_at and looked_at + width * height > MOST_PIXELS_TOGETHER:
                raise BadInput(f"the pictures that were looked at have {MOST_PIXELS_TOGETHER} pixels together")
            looked_at += width * height
        if choice.points is not None:
            points, colors, note = stored_cloud(decoded)
            unit = scale.unit_of(points, 1.0, note, decoded.header, message.recorded)
            points, step = without_nothing(points if unit == 1.0 else points * np.float32(unit)), 1
        else:
            assert lens is not None
            depth, colors = stored(choice, decoded), None
            step = step_of(*depth.values.shape)
            if scale.unit is None:
                seen = _points(depth.values, lens, step, rays)
                scale.unit_of(seen, depth.unit, depth.note, decoded.header, message.recorded)
            points = _points(depth.metres(scale.unit), lens, step, rays)
        if not np.isfinite(points).any():
            raise BadInput("a picture measures nothing: it has no valid point")
        when = stamp(decoded.header, message.recorded)
        return _Look(points, colors, frame_name(decoded.header.frame_id), when, (height, width), step)

    def look_once(message: Message) -> _Look:
        """Return what was found in a message before, as messages are read again over longer and longer times."""
        key = message.recorded, zlib.crc32(message.raw)
        if key not in measured:
            try:
                measured[key] = _on_topic(stream, lambda: look(message))
            except BadInput as error:
                measured[key] = error
        found = measured[key]
        if isinstance(found, BadInput):
            raise found
        return found

    found = around(bag, stream, moment, look_once, most // 2 + 1, most)
    if not found:
        raise BadInput(f"{stream.topic} of {str(bag.path)!r} has no messages")
    near = [look for look in found if abs(look.time - found[0].time) < _LONGEST_LOOK * 1e9]
    return near[:most]


def _points(depth: np.ndarray, lens: Lens, step: int, rays: dict[tuple[int, int], np.ndarray]) -> np.ndarray:
    """Return the points (h, w, 3) float32 of every `step`-th row and column of a depth picture (H, W).

    Args:
        rays: of every size so far; one that is new is added.
    """
    size, depth = depth.shape[::-1], depth[::step, ::step]
    if size not in rays:
        scaled = lens.scaled(*size)
        scaled = replace(scaled, matrix=lens_of_every(scaled.matrix, step))
        rays[size] = scaled.rays(*depth.shape[::-1])
    across, down = np.moveaxis(rays[size], -1, 0)
    return np.stack((across * depth, down * depth, depth), axis=-1)


def _from_one_place(bag: Bag, looks: list[Found[_Look]], frames: Frames) -> list[Found[_Look]]:
    """Keep the measurements at which the camera, according to tf, had the same pose as at the first one."""
    camera, base = looks[0].value.frame, base_frame(frames)
    path = frames.path(base, camera)
    if frames.all_static(path):
        return looks
    first_from_base = np.linalg.inv(frames.pose(path))
    still = looks[:1]
    for look in looks[1:]:
        then = read_frames(bag, look.value.stamp, [(camera, base)], frames)
        moved = first_from_base @ then.pose(then.path(base, camera))
        if np.linalg.norm(moved[:3, 3]) < _SAME_PLACE[0] and np.linalg.norm(moved[:3, :3] - np.eye(3)) < _SAME_PLACE[1]:
            still.append(look)
    return still


def _on_topic(stream: Stream, read: Callable[[], Any]) -> Any:
    """Return the result of `read`; an error in a message is raised with its topic."""
    try:
        return read()
    except BadInput as error:
        if stream.topic in str(error):
            raise
        raise BadInput(f"on {stream.topic}, {error}") from error


def _color(
    bag: Bag, choice: Choice, look: _Look, points: np.ndarray, recorded: int, frames: Frames, demanded: bool
) -> tuple[np.ndarray | None, list[str]]:
    """Return the colour (H, W, 3) of every point, or `None`, and notes.

    Raises:
        BadInput: if the user named a picture that cannot be used.
    """
    assert choice.color is not None
    stream = choice.color.stream

    def picture(message: Any) -> np.ndarray:
        return compressed_color(message) if stream.type == COMPRESSED else color_picture(message)

    try:
        found = around(bag, stream, recorded, bag.decoded, before=3, after=6)
        if not found:
            raise BadInput(f"{stream.topic} of {str(bag.path)!r} has no messages")
        stamps = [stamp(entry.value.header, entry.time) for entry in found]
        nearest = min(range(len(found)), key=lambda k: abs(stamps[k] - look.stamp))
        taken, colors = stamps[nearest], _on_topic(stream, lambda: picture(found[nearest].value))
        late = abs(taken - look.stamp) / 1e9
        notes = [f"the colour was taken {late:.1f} s from the depth"] if late > _SAME_TIME else []
        if not choice.aligned:
            colors = _laid_over(bag, choice, look, points, colors, recorded, frames)
            notes.append(f"the colours of {stream.topic} were laid over the depth by the lenses and tf")
        elif colors.shape[:2] != look.size:
            raise BadInput(f"the pictures on {stream.topic} and {choice.source.stream.topic} differ in size")
        else:
            colors = colors[:: look.step, :: look.step]
    except BadInput as error:
        if demanded:
            raise
        return None, [f"colour was left out: {error}"]
    return colors, notes


def _laid_over(
    bag: Bag, choice: Choice, look: _Look, points: np.ndarray, colors: np.ndarray, recorded: int, frames: Frames
) -> np.ndarray:
    """Return the colour (H, W, 3) that another camera sees at every point; black if it sees none."""
    assert choice.color is not None
    if choice.color_info is None:
        raise BadInput(f"no sensor_msgs/CameraInfo goes with {choice.color.stream.topic}")
    lens = _lens(bag, choice.color_info, choice.color, recorded).scaled(colors.shape[1], colors.shape[0])
    path = frames.path(lens.frame, look.frame)
    if not path and lens.frame != look.frame:
        raise BadInput(f"tf does not connect the frames {lens.frame!r} (colour) and {look.frame!r} (depth)")
    color_from_depth = frames.pose(path)
    pixels = lens.pixels(points @ color_from_depth[:3, :3].T + color_from_depth[:3, 3])
    with np.errstate(invalid="ignore"):
        inside = ((pixels >= -0.5) & (pixels < np.array(colors.shape[1::-1]) - 0.5)).all(axis=-1)
    columns, rows = np.rint(pixels[inside]).astype(int).T
    laid = np.zeros(points.shape, np.uint8)
    laid[inside] = colors[rows, columns]
    return laid
