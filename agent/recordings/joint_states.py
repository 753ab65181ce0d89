"""Find the joint angles of the Jaco among all joints of a recording, and tell it from other arms.

An arm is a Jaco that is planned for only if its joints, their number and its fingers say so: joint_1 to joint_6 or
joint_7 after one prefix, and three fingers, by the joints of the fingers or by the maker's name for the model
("j2n6s300": generation, wrist, joints, mode, fingers) in the prefix or the topic.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from agent.arm.arm_model import ARM_MODELS, DEFAULT_MODEL
from agent.arm.state import ArmState
from agent.errors import BadInput
from agent.recordings.bag_reader import Bag, Message, Stream
from agent.recordings.message_decoding import ANGLES, JOINTS
from agent.recordings.survey import look_at_first
from agent.recordings.synchronization import Found, around

_JOINT = re.compile(r"(?P<prefix>.*?)(?P<joint>joint_(?:\d|finger_\d|finger_tip_\d))")
_MODEL = re.compile(r"[jmrc]\d[ns](?P<joints>\d)[as](?P<fingers>\d)00")  # the maker's names of all its arms
_NUMBERED = re.compile(r"(?P<before>.*?)(?P<number>\d+)(?P<after>\D*)")
_OF_AN_ARM = re.compile(r"(?P<before>.*?)(?:shoulder|elbow|forearm|wrist)")
_OF_NO_ARM = re.compile(r"wheel|caster|track|finger|gripper|leg|head|torso|door")
_LEAST_JOINTS = 4  # numbered ones in a row that make an arm
_AROUND = 8  # messages on either side of the moment: several nodes may take turns on one topic
_MOST_STREAMS = 16  # that are read around the moment
_MOST_NAMES = 200  # of a topic that are put together
_THREE = {1, 2, 3}
EXPECTED = (
    f"joint_1 to joint_6 or joint_7 and joint_finger_1 to joint_finger_3 of a {', '.join(ARM_MODELS[:-1])} or "
    f"{ARM_MODELS[-1]}"
)


@dataclass(frozen=True)
class ArmFound:
    """The arm of a recording.

    Attributes:
        state: how it stood; `None` if that is not recorded, or if it is none that is planned for.
        stream: where that is from, or `None`.
        notes: what is missing or assumed, a sentence each.
        other: what was found in place of one arm that is planned for, a sentence; "" if nothing was.
    """

    state: ArmState | None
    stream: Stream | None
    notes: tuple[str, ...]
    other: str = ""


@dataclass
class _Arm:
    """The joints of one arm.

    Attributes:
        prefix: of its joints' names.
        topics: that have them.
        names: all its joints' names.
        model: the Jaco that it is, or "".
        note: what was assumed about it, or "".
        beside: the names of other fingers and grippers on the topic.
    """

    prefix: str
    topics: list[str]
    names: list[str]
    model: str = ""
    note: str = ""
    beside: Sequence[str] = ()


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


def arm_state(bag: Bag, streams: Iterable[Stream], moment: int) -> ArmFound:
    """Return the arm's state nearest to `moment` (nanoseconds)."""
    said = {stream: _around(bag, stream, moment) for stream in _with_arm(bag, list(streams))[:_MOST_STREAMS]}
    arms: dict[str, _Arm] = {}
    for stream, found in said.items():
        for arm in _arms(stream, [name for each in found for name in each.value]):
            known = arms.setdefault(arm.prefix, arm)
            known.topics += [topic for topic in arm.topics if topic not in known.topics]
            if arm.model and not known.model:
                known.model, known.note = arm.model, arm.note
    if len(arms) > 1 or any(not arm.model for arm in arms.values()):
        sentence = _of_another(list(arms.values()))
        return ArmFound(None, None, (sentence,), sentence)
    for arm in arms.values():
        for stream, found in said.items():
            for each in found:
                if (joints := _whole(arm, each.value)) is not None:
                    return _found(arm, joints, stream, abs(each.time - moment) / 1e9)
    return ArmFound(None, None, ("the recording does not say how the arm stood",))


def _with_arm(bag: Bag, streams: Sequence[Stream]) -> list[Stream]:
    """Return the likeliest stream, and of the others those that have an arm's joints; these are read in one pass."""
    names: dict[Stream, list[str]] = {stream: [] for stream in streams[1:]}
    known: set[Stream] = set()

    def enough(message: Message) -> bool:
        stream = message.stream
        with suppress(BadInput):
            names[stream] = [*names[stream][-_MOST_NAMES:], *_joints(bag, message)]
        if _arms(stream, names[stream]):
            known.add(stream)
        return stream in known

    with suppress(BadInput):  # a damaged end: what was found before it counts
        look_at_first(bag, streams[1:], enough)
    return [*streams[:1], *(stream for stream in streams[1:] if stream in known)]


def _found(arm: _Arm, joints: dict[str, float], stream: Stream, away: float) -> ArmFound:
    notes = [arm.note] if arm.note else []
    if stream.type == ANGLES:
        notes.append("the fingers' joints are not recorded")
    if away > 1.0:
        notes.append(f"the arm's joints were recorded {away:.1f} s from the picture")
    return ArmFound(ArmState(arm.model, joints, arm.prefix), stream, tuple(notes))


def _around(bag: Bag, stream: Stream, moment: int) -> list[Found[Mapping[str, float]]]:
    """Return the joints in the messages nearest to a moment, the nearest first: name -> angle, rad."""
    try:
        return around(bag, stream, moment, lambda message: _joints(bag, message) or None, _AROUND, _AROUND)
    except BadInput:
        return []


def _joints(bag: Bag, message: Message) -> Mapping[str, float]:
    """Return the joints in a message, name -> angle, rad; nothing if none of them may be an arm's.

    Raises:
        BadInput: for a damaged message.
    """
    decoded, topic = bag.decoded(message), message.stream.topic
    said = _degrees(decoded, topic) if message.stream.type == ANGLES else _radians(decoded)
    known = any(_JOINT.fullmatch(name) or _OF_AN_ARM.match(name) or _is_numbered(name) for name in said)
    return said if known else {}


def _radians(message: Any) -> dict[str, float]:
    """Return the joints of a JointState; NaN where a position is missing, or is stated twice and differs."""
    positions: dict[str, float] = {}
    for name, angle in zip(message.name, map(float, message.position), strict=False):
        positions[name] = angle if positions.get(name, angle) == angle else math.nan
    return {name: positions.get(name, math.nan) for name in message.name}


def _degrees(message: Any, topic: str) -> dict[str, float]:
    """Return the joints in the driver's JointAngles, with the prefix that its topic names; the seventh is 0 on an arm
    of fewer joints.
    """
    degrees = [float(getattr(message, f"joint{number}")) for number in range(1, 8)]
    if not all(map(math.isfinite, degrees)) or not any(degrees):
        return {}
    named = _MODEL.search(topic)
    count = int(named["joints"]) if named else 7 if degrees[6] else 6
    prefix = f"{named[0]}_" if named else ""
    return {f"{prefix}joint_{number}": math.radians(degrees[number - 1]) for number in range(1, min(count, 7) + 1)}


def _arms(stream: Stream, names: Iterable[str]) -> list[_Arm]:
    """Return the arms whose joints have these names."""
    groups: dict[str, list[str]] = {}
    names = list(dict.fromkeys(names))
    beside = [name for name in names if re.search("finger|gripper", name) and not _JOINT.fullmatch(name)]
    for name in names:
        if matched := _JOINT.fullmatch(name):
            groups.setdefault(matched["prefix"], []).append(name)
        elif matched := _OF_AN_ARM.match(name):
            groups.setdefault(matched["before"] + "*", []).append(name)
        elif _is_numbered(name) and (matched := _NUMBERED.fullmatch(name)):
            groups.setdefault(matched["before"] + "*" + matched["after"], []).append(name)
    arms = []
    for prefix, mine in groups.items():
        arm = _Arm(prefix, [stream.topic], mine, beside=beside)
        if "*" not in prefix:
            arm.model, arm.note = _model(prefix, stream.topic, _numbers(mine))
        if arm.model or len(mine) >= _LEAST_JOINTS and ("*" in prefix or _numbers(mine)["joint"]):
            arms.append(arm)
    return arms


def _is_numbered(name: str) -> bool:
    """Return whether a name with a number may be that of an arm's joint: panda_joint1, iiwa_joint_1, joint_a1."""
    return "joint" in name and bool(_NUMBERED.fullmatch(name)) and not _OF_NO_ARM.search(name)


def _numbers(names: Iterable[str]) -> dict[str, set[int]]:
    """Return the numbers of the joints, the fingers and their tips among names that `_JOINT` matches."""
    found: dict[str, set[int]] = {"joint": set(), "joint_finger": set(), "joint_finger_tip": set()}
    for name in names:
        kind, _, number = _JOINT.fullmatch(name)["joint"].rpartition("_")  # type: ignore[index]
        found[kind].add(int(number))
    return found


def _model(prefix: str, topic: str, numbers: Mapping[str, set[int]]) -> tuple[str, str]:
    """Return the Jaco that an arm is, or "", and a note on what was assumed, or ""."""
    joints, fingers = numbers["joint"], numbers["joint_finger"]
    if joints != set(range(1, len(joints) + 1)) or not numbers["joint_finger_tip"] <= _THREE:
        return "", ""
    if named := _MODEL.search(prefix) or _MODEL.search(topic):
        right = named[0] in ARM_MODELS and int(named["joints"]) == len(joints) and fingers in (set(), _THREE)
        return (named[0] if right else ""), ""
    if fingers != _THREE or len(joints) not in (6, 7):
        return "", ""
    model = "j2s7s300" if len(joints) == 7 else "j2n6s300"
    return model, f"no name gives the arm's model; with {len(joints)} joints and 3 fingers it was taken for a {model}"


def _whole(arm: _Arm, said: Mapping[str, float]) -> dict[str, float] | None:
    """Return the arm's joints in a message, without their prefix, if all are there; fingers may be missing."""
    joints = {}
    for name, angle in said.items():
        matched = _JOINT.fullmatch(name)
        if matched and matched["prefix"] == arm.prefix and math.isfinite(angle):
            joints[matched["joint"]] = angle
    needed = {_JOINT.fullmatch(name)["joint"] for name in arm.names if "finger" not in name}  # type: ignore[index]
    return joints if needed <= joints.keys() else None


def _of_another(arms: Sequence[_Arm]) -> str:
    """Say what was found in place of one arm that is planned for."""
    if len(arms) > 1:
        those = "; ".join(f"{_listed(arm.names)} on {arm.topics[0]}" for arm in arms[:4])
        more = f"; and {len(arms) - 4} more" if len(arms) > 4 else ""
        apart = len({topic for arm in arms for topic in arm.topics}) > 1
        how = ", and --topic joints=TOPIC takes the one of a topic" if apart else ""
        what = f"the recording has {len(arms)} arms ({those}{more}): a plan is for one, {EXPECTED}{how}"
    else:
        what = f"the recorded arm is not supported: {arms[0].topics[0]} has {_described(arms[0])}; expected: {EXPECTED}"
    return f"{what}; no trajectory is exported for it, and the twin builds with a folded {DEFAULT_MODEL}"


def _described(arm: _Arm) -> str:
    """Say which joints and fingers an arm has."""
    fingers = [name for name in arm.names if "finger" in name and "tip" not in name]
    tips = [name for name in arm.names if "tip" in name]
    joints = [name for name in arm.names if name not in fingers and name not in tips]
    named = _MODEL.search(arm.prefix) or _MODEL.search(arm.topics[0])
    by_name = f", a {named[0]} by its name" if named else ""
    count = f"{len(joints)} joint{'s' * (len(joints) != 1)}"
    if arm.beside and not fingers:  # joints of a hand that is not the arm's maker's
        count += f", with {_listed(arm.beside)},"
    else:
        count += f" and {len(fingers) or 'no'} finger{'s' * (len(fingers) != 1)}"
    return f"{count} ({_listed([*joints, *fingers])}{by_name})"


def _listed(names: Sequence[str], most: int = 3) -> str:
    """List the first and the last of some names."""
    if len(names) <= most + 1:
        return ", ".join(names)
    return f"{', '.join(names[:most])}, ..., {names[-1]}"
