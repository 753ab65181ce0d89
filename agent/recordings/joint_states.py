"""Find the joint angles of the Jaco among all joints of a recording."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from typing import Any

from agent.arm.state import ArmState
from agent.errors import BadInput
from agent.recordings.bag_reader import Bag, Message, Stream
from agent.recordings.message_decoding import ANGLES, JOINTS
from agent.recordings.survey import look_at_first
from agent.recordings.synchronization import nearest

_JOINT = re.compile(r"(?P<prefix>.*?)(?P<joint>joint_(?:\d|finger_\d|finger_tip_\d))")
_MODEL = re.compile(r"j2(?P<wrist>[ns])(?P<joints>[67])s[23]00")


def joint_streams(bag: Bag, topic: str | None = None) -> list[Stream]:
    """Return the streams that may hold the arm's joint angles, the most likely first.

    Args:
        topic: the only topic to use, or `None` for all.
    """
    found = [
        stream
        for stream in bag.streams
        if stream.count and stream.type in (JOINTS, ANGLES) and topic in (None, stream.topic)
    ]
    return sorted(found, key=_likelihood)


def _likelihood(stream: Stream) -> tuple[bool, bool, bool, str]:
    """Rank the arm's driver first, then nodes that collect joint states; commanded angles are not measured ones."""
    commanded = "command" in stream.topic or "torque" in stream.topic
    return commanded, stream.type != JOINTS, "driver/out" not in stream.topic, stream.topic


def arm_state(bag: Bag, streams: Iterable[Stream], moment: int) -> tuple[ArmState | None, Stream | None, list[str]]:
    """Return the arm's state nearest to `moment` (nanoseconds), its stream, and notes."""

    def state(message: Message) -> tuple[ArmState, list[str]] | None:
        decoded = bag.decoded(message)
        return _of_angles(decoded, message.stream.topic) if message.stream.type == ANGLES else _of_state(decoded)

    for stream in _with_arm(bag, list(streams), state):
        found = nearest(bag, stream, moment, state)
        if found is not None:
            away = abs(found.time - moment) / 1e9
            arm, notes = found.value
            if away > 1.0:
                notes = [*notes, f"the arm's joints were recorded {away:.1f} s from the picture"]
            return arm, stream, notes
    return None, None, ["the recording does not say how the arm stood"]


def _with_arm(
    bag: Bag, streams: Sequence[Stream], state: Callable[[Message], tuple[ArmState, list[str]] | None]
) -> Iterator[Stream]:
    """Give the likeliest stream, and of the others those that say how an arm stands; these are read in one pass."""
    yield from streams[:1]
    known: set[Stream] = set()

    def enough(message: Message) -> bool:
        try:
            said = state(message)
        except BadInput:
            said = None
        known.update([message.stream] if said is not None else [])
        return said is not None

    with suppress(BadInput):  # a damaged end: what was found before it counts
        look_at_first(bag, streams[1:], enough)
    yield from (stream for stream in streams[1:] if stream in known)


def _of_state(message: Any) -> tuple[ArmState, list[str]] | None:
    """Return the Jaco in a JointState; `None` for other robots, and for a hand alone."""
    arms: dict[str, dict[str, float]] = {}
    for name, position in zip(message.name, message.position, strict=False):
        matched = _JOINT.fullmatch(name)
        if matched and math.isfinite(position):
            arms.setdefault(matched["prefix"], {})[matched["joint"]] = float(position)
    whole = {prefix: joints for prefix, joints in arms.items() if _arm_joints(joints) in (6, 7)}
    if not whole:
        return None
    best = min(whole, key=lambda prefix: (_MODEL.search(prefix) is None, "joint_finger_1" not in whole[prefix], prefix))
    notes = []
    if len(whole) > 1:
        notes.append(f"the recording has {len(whole)} arms ({', '.join(map(repr, sorted(whole)))}); {best!r} was taken")
    return _state(best, best, whole[best], notes)


def _of_angles(message: Any, topic: str) -> tuple[ArmState, list[str]] | None:
    """Return the Jaco in the driver's JointAngles: degrees, with the seventh 0 on an arm of six joints."""
    degrees = [getattr(message, f"joint{number}") for number in range(1, 8)]
    if not all(map(math.isfinite, degrees)) or not any(degrees):
        return None
    named = _MODEL.search(topic)
    count = int(named["joints"]) if named else 7 if degrees[6] else 6
    joints = {f"joint_{number}": math.radians(degrees[number - 1]) for number in range(1, count + 1)}
    prefix = f"{named[0]}_" if named else ""
    return _state(prefix, topic, joints, ["the fingers' joints are not recorded"])


def _state(prefix: str, model_text: str, joints: dict[str, float], notes: Sequence[str]) -> tuple[ArmState, list[str]]:
    """Return the arm with these joints; `model_text` and their number determine its model."""
    count = _arm_joints(joints)
    named = _MODEL.search(model_text)
    if named and int(named["joints"]) == count:
        return ArmState(f"j2{named['wrist']}{count}s300", joints, prefix), list(notes)
    model = "j2s7s300" if count == 7 else "j2n6s300"
    said = f"no name gives the arm's model; with {count} joints it was taken for a {model}"
    return ArmState(model, joints, prefix), [*notes, said]


def _arm_joints(joints: Iterable[str]) -> int:
    """Count the arm's joints if they are consecutive from the first; otherwise return 0."""
    numbers = sorted(int(name[6:]) for name in joints if name[6:].isdigit())
    return len(numbers) if numbers == list(range(1, len(numbers) + 1)) else 0
