"""Load any arm of revolute joints, with a hand of two fingers, from its URDF and a small YAML file that says how it is
used.

| key | what it means |
|---|---|
| `urdf` | the URDF file, beside the YAML file or with a full path |
| `base` | the link that stands on the table; its x points away over the table |
| `tool` | the link that the hand is fixed to |
| `hand` | where the hand is in it, x, y, z, roll, pitch, yaw; its z is the approach. By default all 0 |
| `fingers` | each finger joint that is commanded, with its angles when open and when closed |
| `pads` | the two links that touch what is held, one on each side |
| `home` | the waiting pose, an angle for each joint from the base on |
| `speed` | the fastest that any joint may turn, rad/s, where that is less than in the URDF |

Across the approach the hand is put midway between the pads, and closes along the line between them. Metres and radians.
"""

from __future__ import annotations

import hashlib
import math
import xml.etree.ElementTree as ElementTree
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from agent.arm.arm_model import END_EFFECTOR, ArmModel, Joint, poses_on
from agent.arm.hand import Hand
from agent.arm.parallel_hand import FingerJoints, Fingers, HandError, centred, parallel_hand
from agent.arm.urdf import Body, body_on, link_of, simple_urdf, solids_of
from agent.errors import BadInput
from structdiffusion.geometry import pose_from_xyz_rpy

_NEEDED = ("urdf", "base", "tool", "fingers", "pads", "home")
_KEYS = (*_NEEDED, "hand", "speed")
_TURNING = ("revolute", "continuous")


def load_arm(path: Path) -> ArmModel:
    """Load an arm with a hand of two fingers from a YAML file with the keys of this module's table.

    The joints are those from `base` to `tool`. Axes other than z are taken into `chain`, so that its frames turn about
    z; a mesh is replaced by its box. The hand is measured by moving its joints. What was loaded before is measured
    again only where the YAML file or the URDF differs.

    Raises:
        BadInput: if a file cannot be read, a key is missing, unknown or wrong, or the arm or its hand cannot be planned
            for.
    """
    described, document = _document(path)
    urdf = path.parent / str(document["urdf"])
    try:
        content = urdf.read_bytes()
    except OSError as error:
        raise _unread(path, urdf, error) from error
    return _loaded(path, described, content)


@lru_cache(maxsize=4)
def _loaded(path: Path, described: str, content: bytes) -> ArmModel:
    """Return the arm of a YAML file whose text and whose URDF's content are known."""
    document = yaml.safe_load(described)
    urdf = path.parent / str(document["urdf"])
    try:
        root = ElementTree.fromstring(content)
        speeds_and_ranges = {joint.get("name", ""): _limits(joint) for joint in root.findall("joint")}
    except (ElementTree.ParseError, ValueError) as error:
        raise _unread(path, urdf, error) from error
    links = [link.get("name", "") for link in root.findall("link")]
    for key in ("base", "tool"):
        if document[key] not in links:
            raise BadInput(f"{path}: {key} cannot be {document[key]!r}; legal: {', '.join(links)}")
    body = body_on(root, document["base"], urdf)
    driven = _driven(path, document, body)
    names = [joint.get("name", "") for joint in driven]
    limits = np.array([speeds_and_ranges[name] for name in names])
    for name, row in zip(names, limits, strict=True):
        if not np.isfinite(row).all() or row[0] > row[1] or row[2] <= 0.0:
            raise BadInput(f"{urdf}: the joint {name!r} needs a limit with lower, upper, velocity, effort")
    speed = document.get("speed", math.inf)
    if not _is_number(speed, endless=True) or speed <= 0.0:
        raise BadInput(f"{path}: speed cannot be {speed!r}; legal: a number above 0, rad/s")
    home = _numbers(path, "home", document["home"], len(driven))
    lower, upper = limits[:, 0], limits[:, 1]
    for name, angle, low, high in zip(names, home, lower, upper, strict=True):
        if not low <= angle <= high:
            raise BadInput(f"{path}: home of {name} cannot be {angle}; legal: {low:.3f} to {high:.3f} rad")
    wrist = link_of(driven[-1], "child")
    fingers = _fingers(path, document["fingers"], body, wrist)
    joints = _finger_joints(path, body, wrist, fingers, speeds_and_ranges)
    hand, wrist_from_end = _hand(path, document, body, wrist, joints)
    tool_from_end = np.linalg.inv(body.carried[document["tool"]][1]) @ wrist_from_end
    return ArmModel(
        path.stem,
        tuple(names),
        lower,
        upper,
        np.array([joint.get("type") == "continuous" for joint in driven]),
        np.minimum(limits[:, 2], speed),
        limits[:, 3],
        home,
        (*body.chain, Joint(END_EFFECTOR, wrist, END_EFFECTOR, wrist_from_end)),
        body.solids,
        simple_urdf(body, urdf, END_EFFECTOR, document["tool"], tool_from_end),
        np.eye(4),
        fingers,
        hand,
    )


def arm_checksum(path: Path) -> str:
    """Return a checksum of everything that decides what `load_arm` returns.

    Raises:
        BadInput: as `load_arm`.
    """
    described = path.read_text(encoding="utf-8") + load_arm(path).urdf
    return hashlib.sha256(described.encode()).hexdigest()


def _unread(path: Path, urdf: Path, error: Exception) -> BadInput:
    return BadInput(f"{path}: urdf {str(urdf)!r} cannot be read as a URDF: {error}")


def _document(path: Path) -> tuple[str, dict[str, Any]]:
    """Return the text of a YAML file, and what it says."""
    try:
        described = path.read_text(encoding="utf-8")
        document = yaml.safe_load(described)
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise BadInput(f"the arm {path} cannot be read as YAML: {' '.join(str(error).split())}") from error
    if not isinstance(document, dict):
        raise BadInput(f"the arm {path} is no mapping; legal keys: {', '.join(_KEYS)}")
    for key in document:
        if key not in _KEYS:
            raise BadInput(f"the arm {path} has the unknown key {key!r}; legal: {', '.join(_KEYS)}")
    for key in _NEEDED:
        if key not in document:
            raise BadInput(f"the arm {path} lacks the key {key!r}; needed: {', '.join(_NEEDED)}")
    return described, document


def _is_number(value: Any, endless: bool = False) -> bool:
    real = isinstance(value, (int, float)) and not isinstance(value, bool)
    return real and (math.isfinite(value) or (endless and value == math.inf))


def _numbers(path: Path, key: str, value: Any, count: int) -> np.ndarray:
    if not isinstance(value, list) or len(value) != count or not all(map(_is_number, value)):
        raise BadInput(f"{path}: {key} cannot be {value!r}; legal: a list of {count} numbers")
    return np.array(value, dtype=np.float64)


def _limits(joint: ElementTree.Element) -> tuple[float, float, float, float]:
    """Return lower, upper, velocity and effort; NaN for what is missing."""
    limit = joint.find("limit")
    given = {} if limit is None else limit.attrib
    # As for the Jaco: a continuous joint may wind by two turns beyond 0 to 2 pi.
    endless = joint.get("type") == "continuous"
    lower, upper = (-2 * math.pi, 4 * math.pi) if endless else (given.get("lower", 0.0), given.get("upper", 0.0))
    return float(lower), float(upper), float(given.get("velocity", "nan")), float(given.get("effort", "nan"))


def _driven(path: Path, document: dict[str, Any], body: Body) -> list[ElementTree.Element]:
    """Return the turning joints from the base to the tool."""
    base, tool = document["base"], document["tool"]
    if tool not in body.carried:
        raise BadInput(f"{path}: no joints lead from the base {base!r} to the tool {tool!r}")
    driven = [joint for joint in body.way(tool) if joint.get("type") != "fixed"]
    for joint in driven:
        if joint.get("type") not in _TURNING or joint.find("mimic") is not None:
            raise BadInput(f"{path}: the joint {joint.get('name')!r} before the tool does not turn on its own; legal: "
                           f"an arm of {' and '.join(_TURNING)} joints")  # fmt: skip
    if not driven:
        raise BadInput(f"{path}: no joint turns between the base {base!r} and the tool")
    if END_EFFECTOR in body.joints or END_EFFECTOR in body.links:
        raise BadInput(f"{path}: the URDF has a joint or link {END_EFFECTOR!r}, which is added to it; rename it")
    return driven


def _fingers(path: Path, value: Any, body: Body, wrist: str) -> dict[str, tuple[float, float]]:
    """Return the commanded joints of the hand, with their positions when open and closed."""
    legal = [name for name in _hand_joints(body, wrist) if body.joints[name].find("mimic") is None]
    if not isinstance(value, dict) or not value:
        raise BadInput(f"{path}: fingers cannot be {value!r}; legal: a joint of the hand with [open, closed]")
    for name in value:
        if name not in legal:
            raise BadInput(f"{path}: fingers names the joint {name!r}; legal: {', '.join(legal) or 'none in the URDF'}")
    pairs = {name: _numbers(path, f"fingers of {name}", pair, 2) for name, pair in value.items()}
    for name, pair in pairs.items():
        if pair[0] == pair[1]:
            raise BadInput(f"{path}: fingers of {name} are {pair[0]} open and closed; legal: two different numbers")
    return {name: (float(pair[0]), float(pair[1])) for name, pair in pairs.items()}


def _hand_joints(body: Body, wrist: str) -> list[str]:
    """Return the names of the moving joints beyond the arm's last link."""
    there = body.below(wrist)
    return [joint.name for joint in body.chain if joint.child in there and joint.child != wrist]


def _finger_joints(
    path: Path,
    body: Body,
    wrist: str,
    fingers: dict[str, tuple[float, float]],
    limits: dict[str, tuple[float, float, float, float]],
) -> FingerJoints:
    """Return how all joints of the hand move with those that are commanded."""
    ends = dict(fingers)
    waiting = [name for name in _hand_joints(body, wrist) if name not in ends]
    while waiting:
        known = []
        for name in waiting:
            mimic = body.joints[name].find("mimic")
            if mimic is not None and mimic.get("joint", "") in ends:
                factor, offset = (float(mimic.get(key, default)) for key, default in (("multiplier", 1), ("offset", 0)))
                opened, closed = ends[mimic.get("joint", "")]
                ends[name] = factor * opened + offset, factor * closed + offset
                known.append(name)
        if not known:
            raise BadInput(f"{path}: the hand's joint {waiting[0]!r} neither is in fingers nor follows one of them")
        waiting = [name for name in waiting if name not in known]
    first = next(iter(fingers))
    span = abs(fingers[first][1] - fingers[first][0])
    _, _, speed, effort = limits[first]
    if not (speed > 0.0 and effort > 0.0):
        raise BadInput(f"{path}: the URDF's joint {first!r} needs a limit with velocity and effort")
    return FingerJoints(
        {name: opened for name, (opened, _) in ends.items()},
        {name: (closed - opened) / span for name, (opened, closed) in ends.items()},
        span,
        speed,
        effort,
    )


def _hand(
    path: Path, document: dict[str, Any], body: Body, wrist: str, joints: FingerJoints
) -> tuple[Hand, np.ndarray]:
    """Return the hand, and wrist_from_end (4, 4)."""
    there = body.below(wrist)
    legal = [name for name in body.links if name in there and body.carried[name][0] != wrist]
    value = document["pads"]
    if not isinstance(value, list) or len(value) != 2 or value[0] == value[1] or not set(map(str, value)) <= set(legal):
        raise BadInput(f"{path}: pads cannot be {value!r}; legal: two of {', '.join(legal) or 'no moving link'}")
    urdf = path.parent / str(document["urdf"])
    solids = [
        tuple(replace(each, link=body.carried[name][0], link_from_solid=body.carried[name][1] @ each.link_from_solid)
              for each in solids_of(urdf, body.links[name]))
        for name in value
    ]  # fmt: skip
    for name, found in zip(value, solids, strict=True):
        if not found:
            raise BadInput(f"{path}: pads names the link {name!r}, which has no collision shape in the URDF")
    xyz_rpy = _numbers(path, "hand", document.get("hand", [0.0] * 6), 6)
    in_tool = pose_from_xyz_rpy(xyz_rpy[:3].tolist(), xyz_rpy[3:].tolist())
    poses = poses_on(body.chain, wrist, joints.at(0.0))
    middles = [np.mean([(poses[each.link] @ each.link_from_solid)[:3, 3] for each in some], axis=0) for some in solids]
    try:
        end = centred(body.carried[document["tool"]][1] @ in_tool, (middles[0], middles[1]))
        carriers = (solids[0][0].link, solids[1][0].link)
        hand = parallel_hand(Fingers(body.chain, body.solids, wrist, end, carriers, (solids[0], solids[1]), joints))
    except HandError as error:
        raise BadInput(f"{path}: the hand cannot be planned for: {error}") from error
    return hand, end
