"""Read transforms between frames from /tf and /tf_static of ROS 1 and ROS 2."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from graphlib import CycleError, TopologicalSorter
from typing import Any

import numpy as np

from agent.errors import BadInput
from agent.recordings.bag_reader import Bag, Stream
from agent.recordings.message_decoding import TRANSFORMS, frame_name, stamp
from structdiffusion.geometry import pose_from_position_quaternion

_REACHES = (2.0, 20.0, 200.0)  # s; how far from the moment a transform is looked for
_MOST_STATIC = 100_000  # messages; a bag with more of them on a static topic is broken
_MOST_TOLD = 8  # frames, or errors, that are named; the rest is counted


class TransformLoop(BadInput):
    """Raised for a tf tree with a loop; the message has its frames."""


@dataclass(frozen=True)
class Transform:
    """The pose of one frame in its parent.

    Attributes:
        position: of the child, metres.
        quaternion: its rotation, x, y, z, w.
        time: when it held, nanoseconds.
        recorded: when it was recorded, nanoseconds.
        static: whether it holds always.
    """

    position: tuple[float, float, float]
    quaternion: tuple[float, float, float, float]
    time: int
    recorded: int
    static: bool

    @property
    def parent_from_child(self) -> np.ndarray:
        """Return the pose (4, 4)."""
        return pose_from_position_quaternion(np.array(self.position), np.array(self.quaternion))


@dataclass
class Frames:
    """The frames at one moment.

    Attributes:
        moment: nanoseconds.
        transforms: (child, parent) -> the latest before the moment, or the first after it if there is none before.
        errors: in transforms, a sentence each.
    """

    moment: int
    transforms: dict[tuple[str, str], Transform] = field(default_factory=dict)
    errors: dict[str, None] = field(default_factory=dict)

    @property
    def spoilt(self) -> list[str]:
        """Return the first errors in transforms, and how many more there are."""
        return _first(list(self.errors), "{} more transforms of tf were left out or mended")

    def add(self, message: Any, recorded: int, static: bool) -> None:
        """Take in the transforms of a TFMessage."""
        for said in message.transforms:
            child, parent = frame_name(said.child_frame_id), frame_name(said.header.frame_id)
            shift, turn = said.transform.translation, said.transform.rotation
            position, quaternion = (shift.x, shift.y, shift.z), (turn.x, turn.y, turn.z, turn.w)
            length = math.hypot(*quaternion)
            if not (all(map(math.isfinite, (*position, *quaternion))) and 1e-6 < length < 1e6):
                self.spoil(f"tf has no rotation or no position for {child!r} in {parent!r}; it was left out")
                continue
            if not child or not parent or child == parent:
                self.spoil(f"tf has no usable transform for {child!r} in {parent!r}; it was left out")
                continue
            if abs(length - 1) > 0.001:
                self.spoil(f"tf has a quaternion of length {length:.3g} for {child!r} in {parent!r}; it was normalised")
            time = recorded if static else stamp(said.header, recorded)
            new = Transform(position, quaternion, time, recorded, static)
            old = self.transforms.get((child, parent))
            if old is None or static or self._nearer(new, old):
                self.transforms[child, parent] = new

    def spoil(self, sentence: str) -> None:
        """Note an error, once."""
        self.errors[_cut(sentence, 300)] = None

    def _nearer(self, new: Transform, old: Transform) -> bool:
        """Return whether a transform fits the moment better than another; of two of one time, the last recorded."""
        if new.time <= self.moment:
            return old.time > self.moment or (new.time, new.recorded) >= (old.time, old.recorded)
        return (new.time, new.recorded) < (old.time, old.recorded)

    def static_alone(self, moment: int) -> Frames:
        """Return the frames at another moment as far as they never move."""
        kept = {edge: transform for edge, transform in self.transforms.items() if transform.static}
        return Frames(moment, kept, dict(self.errors))

    @property
    def names(self) -> set[str]:
        """Return the names of all frames."""
        return {name for edge in self.transforms for name in edge}

    def parents(self) -> dict[str, list[str]]:
        """Return the parents of each frame that has any; in a valid tree it has one."""
        parents_of: dict[str, list[str]] = {}
        for child, parent in self.transforms:
            parents_of.setdefault(child, []).append(parent)
        return parents_of

    def loop(self, name: str) -> list[str]:
        """Return the frames of a loop above `name`, the first again at the end; nothing if there is none."""
        parents_of = self.parents()
        above: dict[str, list[str]] = {}
        waiting = [name]
        while waiting:
            at = waiting.pop()
            if at not in above:
                above[at] = sorted(parents_of.get(at, ()))
                waiting += above[at]
        try:
            TopologicalSorter(above).prepare()
        except CycleError as error:
            return error.args[1]
        return []

    def path(self, start: str, goal: str) -> list[str]:
        """Return the frames from one to the other by the fewest transforms, both ends included; nothing where tf has
        a gap."""
        neighbours: dict[str, set[str]] = {}
        for child, parent in self.transforms:
            neighbours.setdefault(child, set()).add(parent)
            neighbours.setdefault(parent, set()).add(child)
        came_from = {start: ""}
        waiting = deque([start])
        while waiting and goal not in came_from:
            at = waiting.popleft()
            for other in sorted(neighbours.get(at, ())):
                if other not in came_from:
                    came_from[other] = at
                    waiting.append(other)
        if goal not in came_from:
            return []
        path = [goal]
        while path[-1] != start:
            path.append(came_from[path[-1]])
        return path[::-1]

    def all_static(self, path: Sequence[str]) -> bool:
        """Return whether nothing on the path can have moved."""
        steps = zip(path, path[1:], strict=False)
        return all((self.transforms.get(step) or self.transforms[step[::-1]]).static for step in steps)

    def pose(self, path: Sequence[str]) -> np.ndarray:
        """Return (4, 4): the frame at the path's end, seen from the frame at its start."""
        pose = np.eye(4)
        for at, following in zip(path, path[1:], strict=False):
            up, down = self.transforms.get((at, following)), self.transforms.get((following, at))
            if down is not None:
                pose = pose @ down.parent_from_child
                continue
            assert up is not None  # the path is one of the tree
            pose = pose @ np.linalg.inv(up.parent_from_child)
        return pose


def transform_streams(bag: Bag) -> list[Stream]:
    """Return the streams that carry tf."""
    return [stream for stream in bag.streams if stream.type in TRANSFORMS]


def is_static(stream: Stream) -> bool:
    """Return whether the transforms of the stream are static."""
    return stream.topic.endswith("tf_static")


def read_frames(bag: Bag, moment: int, ways: Iterable[tuple[str, str]] = (), known: Frames | None = None) -> Frames:
    """Read the frames at `moment` (nanoseconds), around it until every one of `ways` is known, as far as tf goes.

    Args:
        bag: open.
        moment: of the recording.
        ways: pairs of frames that are asked for; a frame "" stands for the arm's base.
        known: the frames of the same bag at another moment, whose static transforms are not read again.
    """
    ways = [(frame_name(start), frame_name(goal)) for start, goal in ways]
    static = [stream for stream in transform_streams(bag) if is_static(stream)]
    moving = [stream for stream in transform_streams(bag) if not is_static(stream)]
    frames = Frames(moment) if known is None else known.static_alone(moment)
    if known is None:
        _take(bag, frames, static, None, None, True)
    before = after = moment
    for reach in _REACHES:
        start, stop = max(0, moment - round(reach * 1e9)), moment + round(reach * 1e9)
        for span in ((start, before), (after, stop)):  # what is between them has been read
            if span[0] < span[1]:
                _take(bag, frames, moving, *span, False)
        before, after = start, stop
        if all(frames.path(start, goal or base_frame(frames)) for start, goal in ways):
            break
        if start <= bag.start and stop > bag.end:
            break
    return frames


def _take(bag: Bag, frames: Frames, streams: list[Stream], start: int | None, stop: int | None, static: bool) -> None:
    """Add the messages of `streams` in a span of time."""
    for number, message in enumerate(bag.messages(streams, start, stop)):
        if static and number == _MOST_STATIC:
            frames.spoil(f"only the first {_MOST_STATIC} messages of tf's static transforms were read")
            return
        try:
            frames.add(bag.decoded(message), message.recorded, static)
        except BadInput as error:
            frames.spoil(str(error))


def base_frame(frames: Frames, prefix: str = "") -> str:
    """Return the frame of the arm's base: the maker's `link_base` with the arm's prefix, or an equivalent frame."""
    names = sorted(frames.names)
    bases = [name for name in names if name.endswith("link_base")]
    bases.sort(key=lambda name: name != f"{prefix}link_base")
    return next(iter([*bases, *(name for name in ("root", "base_link") if name in names)]), "")


def base_from_camera(frames: Frames, camera: str, prefix: str) -> tuple[np.ndarray | None, list[str]]:
    """Return the camera's pose (4, 4) in the frame of the arm's base, and notes.

    Args:
        frames: at the moment of the picture.
        camera: the optical frame.
        prefix: the prefix of the arm's names, if known.

    Raises:
        TransformLoop: when tf has a loop. If tf does not reach the arm, which is common, a note says so.
    """
    notes = list(frames.spoilt)
    if not frames.transforms:
        return None, [*notes, "the recording has no usable tf: it does not say where the camera stood"]
    if camera not in frames.names:
        return None, [*notes, f"tf does not know the camera's frame {camera!r}; it knows {_some(frames.names)}"]
    base = base_frame(frames, prefix)
    if not base:
        known = _some(frames.names)
        return None, [*notes, f"tf knows no frame of the arm's base (PREFIX_link_base, root, base_link), only {known}"]
    for name in (camera, base):
        if loop := frames.loop(name):
            raise TransformLoop(
                f"tf runs in a loop ({_in_turn(loop)}), so it does not say where the camera stood; "
                "--camera-pose X,Y,Z,ROLL,PITCH,YAW does"
            )
    path = frames.path(base, camera)
    if not path:
        return None, [*notes, f"tf does not connect the camera's frame {camera!r} with the arm's {base!r}"]
    parents_of = frames.parents()
    several = {name: parents_of[name] for name in path if len(parents_of.get(name, ())) > 1}
    told = [
        f"tf gives the frame {name!r} {len(parents)} parents ({_some(parents)})" for name, parents in several.items()
    ]
    notes += _first(told, "tf gives {} more frames several parents")
    if not base.endswith("link_base"):
        notes.append(f"tf has no PREFIX_link_base; the frame {base!r} was taken for the arm's base")
    return frames.pose(path), notes


def _in_turn(loop: Sequence[str], most: int = 8) -> str:
    """Return the frames of a loop, without the middle of a long one."""
    shown = loop if len(loop) <= most else [*loop[: most - 2], f"{len(loop) - most + 1} more", loop[-1]]
    return " -> ".join(shown)


def _some(names: Iterable[str], most: int = _MOST_TOLD) -> str:
    """Join some of many names."""
    ordered = sorted(names)
    listed = ", ".join(_cut(name, 100) for name in ordered[:most])
    return listed + (f" and {len(ordered) - most:,} more" if len(ordered) > most else "")


def _cut(text: str, most: int) -> str:
    """Return a text without its end where it is very long."""
    return text if len(text) <= most else f"{text[:most]} ..."


def _first(sentences: list[str], rest: str) -> list[str]:
    """Return the first of many sentences, and one with the number of the others."""
    more = len(sentences) - _MOST_TOLD
    return sentences if more < 1 else [*sentences[:_MOST_TOLD], "... and " + rest.format(f"{more:,}")]
