"""Inspect a bag: topics, times, frames, the data that a run needs, and how it would be used."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, TextIO

from agent.errors import BadInput
from agent.recordings.bag_reader import Bag, open_bag
from agent.recordings.joint_states import arm_state, joint_streams
from agent.recordings.load import measuring_notes, used
from agent.recordings.survey import first_times, last_times
from agent.recordings.tf_tree import TransformLoop, base_from_camera, is_static, read_frames, transform_streams
from agent.recordings.topic_selection import Choice, Offer, check_named, choose, offers
from agent.rendering.text import aligned, columns_of, number

SCHEMA_VERSION = 2
_MOST_LINES = 200  # of the frames' tree that are printed
_DEEPEST = 20  # the frames' tree is not indented further


@dataclass(frozen=True)
class TopicInfo:
    """The messages of one type on one topic.

    Attributes:
        name: the topic.
        type: such as "sensor_msgs/msg/Image".
        count: messages.
        rate: messages a second between the first and the last; `None` for fewer than two.
        first, last: seconds since the bag's first message; `None` without messages.
        frame: the frame of a camera's first message, or "".
        role: "points", "depth", "color" or "depth_info" for a topic of a camera; else "".
        problem: why it cannot be used for that, or "".
    """

    name: str
    type: str
    count: int
    rate: float | None
    first: float | None
    last: float | None
    frame: str = ""
    role: str = ""
    problem: str = ""


@dataclass(frozen=True)
class FrameInfo:
    """One tf frame in one of its parents.

    Attributes:
        name: the frame.
        parent: its parent frame.
        static: whether its pose in the parent never changes.
    """

    name: str
    parent: str
    static: bool


@dataclass(frozen=True)
class BagInfo:
    """The content of a bag.

    Attributes:
        path: the file or folder.
        seconds: the duration of the recording.
        topics: by name.
        frames: tf, by parents and names.
        available: input of a run -> whether the bag has it: "points", "colour", "intrinsics", "arm's joints",
            "camera to arm".
        used: purpose -> topic that would be used.
        notes: missing inputs, assumptions and repairs, a sentence each.
    """

    path: Path
    seconds: float
    topics: tuple[TopicInfo, ...]
    frames: tuple[FrameInfo, ...]
    available: Mapping[str, bool]
    used: Mapping[str, str]
    notes: tuple[str, ...]

    def to_dict(self) -> dict[str, Any]:
        """Return the content as JSON values."""
        values = asdict(self)
        return {
            "schema_version": SCHEMA_VERSION,
            "file": str(values.pop("path")),
            **values,
            "topics": list(values["topics"]),
            "frames": list(values["frames"]),
            "notes": list(values["notes"]),
        }


def inspect_bag(path: Path, named: Mapping[str, str] | None = None, depth_unit: float | None = None) -> BagInfo:
    """Inspect the bag at `path`; only a few messages of large topics are read.

    Args:
        path: a bag of any kind.
        named: role -> topic, as in `ReadingOf.topics`.
        depth_unit: as in `ReadingOf`.

    Raises:
        BadInput: if it is not a bag, or too damaged to be read, or has no topic that is named.
        UsageError: for an unknown role.
    """
    with open_bag(path) as bag:
        check_named(bag, named or {})
        there = offers(bag)
        offer_of = {offer.stream: offer for offer in there}
        began = first_times(bag, bag.streams)
        ended = last_times(bag, began)
        topics = []
        for stream in bag.streams:
            first, last = ((times[stream] - bag.start) / 1e9 if stream in times else None for times in (began, ended))
            rate = None
            if first is not None and last is not None and last > first:
                rate = (stream.count - 1) / (last - first)
            offer = offer_of.get(stream)
            of_camera = (offer.frame, offer.role, offer.problem) if offer else ()
            topics.append(TopicInfo(stream.topic, stream.type, stream.count, rate, first, last, *of_camera))
        frames, available, use, notes = _use(bag, dict(named or {}), there, depth_unit)
        return BagInfo(path, bag.seconds, tuple(topics), frames, available, use, (*bag.notes, *notes))


def _use(
    bag: Bag, named: Mapping[str, str], there: list[Offer], depth_unit: float | None
) -> tuple[tuple[FrameInfo, ...], dict[str, bool], dict[str, str], list[str]]:
    """Return the frames of tf, the available data, its use, and notes."""
    choice, notes, camera = Choice(), [], ""
    try:
        choice = choose(bag, named, there)
        camera = choice.source.frame
        notes += [f"{choice.source.stream.topic}: {choice.source.problem}"] if choice.source.problem else []
        notes += measuring_notes(bag, choice, depth_unit)
    except BadInput as error:
        notes.append(str(error))
    moving = [stream for stream in transform_streams(bag) if not is_static(stream)]
    moment = max(first_times(bag, moving).values(), default=bag.start)
    found = arm_state(bag, joint_streams(bag, named.get("joints")), moment)
    arm = found.state
    notes += found.notes
    tf = read_frames(bag, moment, [(camera, "")] if camera else [])
    try:
        pose, said = base_from_camera(tf, camera, arm.prefix if arm else "") if camera else (None, tf.spoilt)
    except TransformLoop as error:
        pose, said = None, [*tf.spoilt, str(error)]
    notes += said
    frames = sorted((parent, child, edge.static) for (child, parent), edge in tf.transforms.items())
    chosen = bool(camera) or choice != Choice()
    available = {
        "points": chosen,
        "colour": choice.color is not None or choice.points is not None and choice.points.colored,
        "intrinsics": choice.depth_info is not None,
        "arm's joints": arm is not None,
        "camera to arm": pose is not None,
    }
    use = used(choice, found.stream, bag if pose is not None else None)
    return tuple(FrameInfo(child, parent, static) for parent, child, static in frames), available, use, notes


def print_bag_info(info: BagInfo, results: TextIO) -> None:
    """Print the content of a bag as text."""
    columns = columns_of(results)
    print(f"{info.path}: {info.seconds:.1f} s, {sum(topic.count for topic in info.topics)} messages\n", file=results)
    rows: list[tuple[str, ...]] = [("topic", "type", "frame", "messages", "a second", "from s", "to s")]
    rows += [
        (
            topic.name,
            topic.type.replace("/msg/", "/"),
            topic.frame,
            str(topic.count),
            number(topic.rate),
            number(topic.first),
            number(topic.last),
        )
        for topic in info.topics
    ]
    print(aligned(rows, 3, columns), file=results)
    if info.frames:
        print("\nframes", file=results)
        lines = _tree(info.frames)
        for line in lines[:_MOST_LINES]:
            print(f"  {line}", file=results)
        if len(lines) > _MOST_LINES:
            print(f"  ... and {len(lines) - _MOST_LINES:,} more; --json has all", file=results)
    print("\navailable", file=results)
    rows = [(f"  {what}", "yes" if given else "no") for what, given in info.available.items()]
    print(aligned(rows, width=columns), file=results)
    if info.used:
        print("\nused as", file=results)
        rows = [(f"  {role.replace('_', ' ')}", topic) for role, topic in info.used.items()]
        print(aligned(rows, width=columns), file=results)
    for sentence in info.notes:
        print(f"\nnote: {sentence}", file=results)


def _tree(frames: tuple[FrameInfo, ...]) -> list[str]:
    """Return the frames as an indented tree, one per line; frames in a loop are listed once, at its end."""
    children: dict[str, list[FrameInfo]] = {}
    for frame in frames:
        children.setdefault(frame.parent, []).append(frame)
    lines: list[str] = []
    listed: set[FrameInfo] = set()
    below = {frame.name for frame in frames}
    for root in [*sorted(set(children) - below), *sorted(set(children) & below)]:
        waiting = [(1, frame) for frame in reversed(children[root]) if frame not in listed]
        if waiting:
            lines.append(root)
        while waiting:
            depth, frame = waiting.pop()
            if frame in listed:
                continue
            listed.add(frame)
            lines.append(f"{'  ' * min(depth, _DEEPEST)}{frame.name}{'' if frame.static else ' (moving)'}")
            waiting += [(depth + 1, child) for child in reversed(children.get(frame.name, []))]
    return lines
