"""Load any arm of revolute joints from its URDF and a small YAML file that says how it is used.

| key | what it means |
|---|---|
| `urdf` | the URDF file, beside the YAML file or with a full path |
| `base` | the link that stands on the table |
| `tool` | the link that the hand is fixed to |
| `hand` | where the hand is in it, x, y, z, roll, pitch, yaw; its z is the approach. By default all 0 |
| `fingers` | each finger joint that is commanded, with its angles when open and when closed |
| `home` | the waiting pose, an angle for each joint from the base on |
| `speed` | the fastest that any joint may turn, rad/s, where that is less than in the URDF |

Metres and radians.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from agent.arm.arm_model import END_EFFECTOR, ArmModel, Joint
from agent.errors import BadInput
from structdiffusion.geometry import pose_from_xyz_rpy

_NEEDED = ("urdf", "base", "tool", "fingers", "home")
_KEYS = (*_NEEDED, "hand", "speed")
_TURNING = ("revolute", "continuous")


def load_arm(path: Path) -> ArmModel:
    """Load an arm from a YAML file with the keys of this module's table.

    The joints are those from `base` to `tool`. Joints of the URDF that are fixed, and axes other than z, are taken into
    `chain`, so that its frames turn about z; `solids` is empty.

    Raises:
        BadInput: if a file cannot be read, or a key is missing, unknown or wrong.
    """
    document = _document(path)
    urdf = path.parent / str(document["urdf"])
    try:
        root = ElementTree.parse(urdf).getroot()
        speeds_and_ranges = {joint.get("name", ""): _limits(joint) for joint in root.findall("joint")}
    except (OSError, ElementTree.ParseError, ValueError) as error:
        raise BadInput(f"{path}: urdf {str(urdf)!r} cannot be read as a URDF: {error}") from error
    driven, chain = _chain(path, document, root)
    limits = np.array([speeds_and_ranges[joint.get("name", "")] for joint in driven])
    for joint, row in zip(driven, limits, strict=True):
        if not np.isfinite(row).all() or row[0] > row[1] or row[2] <= 0.0:
            raise BadInput(f"{urdf}: the joint {joint.get('name')!r} needs a limit with lower, upper, velocity, effort")
    speed = document.get("speed", math.inf)
    if not _is_number(speed, endless=True) or speed <= 0.0:
        raise BadInput(f"{path}: speed cannot be {speed!r}; legal: a number above 0, rad/s")
    home = _numbers(path, "home", document["home"], len(driven))
    lower, upper = limits[:, 0], limits[:, 1]
    for joint, angle, low, high in zip(driven, home, lower, upper, strict=True):
        if not low <= angle <= high:
            raise BadInput(f"{path}: home of {joint.get('name')} cannot be {angle}; legal: {low:.3f} to {high:.3f} rad")
    return ArmModel(
        path.stem,
        tuple(joint.get("name", "") for joint in driven),
        lower,
        upper,
        np.array([joint.get("type") == "continuous" for joint in driven]),
        np.minimum(limits[:, 2], speed),
        limits[:, 3],
        home,
        chain,
        (),
        urdf,
        _fingers(path, document["fingers"], root, driven),
    )


def _document(path: Path) -> dict[str, Any]:
    try:
        document = yaml.safe_load(path.read_text(encoding="utf-8"))
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
    return document


def _is_number(value: Any, endless: bool = False) -> bool:
    real = isinstance(value, (int, float)) and not isinstance(value, bool)
    return real and (math.isfinite(value) or (endless and value == math.inf))


def _numbers(path: Path, key: str, value: Any, count: int) -> np.ndarray:
    if not isinstance(value, list) or len(value) != count or not all(map(_is_number, value)):
        raise BadInput(f"{path}: {key} cannot be {value!r}; legal: a list of {count} numbers")
    return np.array(value, dtype=np.float64)


def _fingers(
    path: Path, value: Any, root: ElementTree.Element, driven: list[ElementTree.Element]
) -> dict[str, tuple[float, float]]:
    moving = [joint.get("name", "") for joint in root.findall("joint") if joint.get("type") != "fixed"]
    legal = [name for name in moving if name not in {joint.get("name") for joint in driven}]
    if not isinstance(value, dict) or not value:
        raise BadInput(f"{path}: fingers cannot be {value!r}; legal: a joint of the hand with [open, closed]")
    for name in value:
        if name not in legal:
            raise BadInput(f"{path}: fingers names the joint {name!r}; legal: {', '.join(legal) or 'none in the URDF'}")
    pairs = {name: _numbers(path, f"fingers of {name}", pair, 2) for name, pair in value.items()}
    return {name: (float(pair[0]), float(pair[1])) for name, pair in pairs.items()}


def _limits(joint: ElementTree.Element) -> tuple[float, float, float, float]:
    """Return lower, upper, velocity and effort; NaN for what is missing."""
    limit = joint.find("limit")
    given = {} if limit is None else limit.attrib
    # As for the Jaco: a continuous joint may wind by two turns beyond 0 to 2 pi.
    endless = joint.get("type") == "continuous"
    lower, upper = (-2 * math.pi, 4 * math.pi) if endless else (given.get("lower", 0.0), given.get("upper", 0.0))
    return float(lower), float(upper), float(given.get("velocity", "nan")), float(given.get("effort", "nan"))


def _chain(
    path: Path, document: dict[str, Any], root: ElementTree.Element
) -> tuple[list[ElementTree.Element], tuple[Joint, ...]]:
    """Return the turning joints from the base to the tool, and the frames that turn about z with them."""
    links = [link.get("name", "") for link in root.findall("link")]
    for key in ("base", "tool"):
        if document[key] not in links:
            raise BadInput(f"{path}: {key} cannot be {document[key]!r}; legal: {', '.join(links)}")
    above = {_link(joint, "child"): joint for joint in root.findall("joint")}
    way: list[ElementTree.Element] = []
    link = document["tool"]
    while link != document["base"]:
        if link not in above or len(way) > len(above):
            raise BadInput(
                f"{path}: no joints lead from the base {document['base']!r} to the tool {document['tool']!r}"
            )
        way.insert(0, above[link])
        link = _link(way[0], "parent")
    driven, chain = [], []
    parent, pose = document["base"], np.eye(4)
    for joint in way:
        pose = pose @ _origin(path, joint)
        if joint.get("type") == "fixed":
            continue
        name = joint.get("name", "")
        if joint.get("type") not in _TURNING or joint.find("mimic") is not None:
            raise BadInput(f"{path}: the joint {name!r} before the tool does not turn on its own; legal: an arm of "
                           f"{' and '.join(_TURNING)} joints")  # fmt: skip
        axis = _values(path, joint, "axis", "xyz", "1 0 0")
        if not np.linalg.norm(axis) > 0.0:
            raise BadInput(f"{path}: the URDF's joint {name!r} has an axis of length 0; legal: any direction")
        to_axis = _z_along(axis)
        chain.append(Joint(name, parent, _link(joint, "child"), pose @ to_axis))
        driven.append(joint)
        parent, pose = _link(joint, "child"), to_axis.T
    if not driven:
        raise BadInput(f"{path}: no joint turns between the base {document['base']!r} and the tool")
    hand = _numbers(path, "hand", document.get("hand", [0.0] * 6), 6)
    chain.append(
        Joint(END_EFFECTOR, parent, "end_effector", pose @ pose_from_xyz_rpy(hand[:3].tolist(), hand[3:].tolist()))
    )
    return driven, tuple(chain)


def _link(joint: ElementTree.Element, end: str) -> str:
    found = joint.find(end)
    return "" if found is None else found.get("link", "")


def _values(path: Path, joint: ElementTree.Element, part: str, key: str, default: str) -> np.ndarray:
    element = joint.find(part)
    text = default if element is None else element.get(key, default)
    try:
        return np.array([float(value) for value in text.split()]).reshape(3)
    except ValueError as error:
        name = joint.get("name")
        raise BadInput(f"{path}: the URDF's joint {name!r} has {part} {key}={text!r}; legal: 3 numbers") from error


def _origin(path: Path, joint: ElementTree.Element) -> np.ndarray:
    xyz, rpy = (_values(path, joint, "origin", key, "0 0 0") for key in ("xyz", "rpy"))
    return pose_from_xyz_rpy(xyz.tolist(), rpy.tolist())


def _z_along(axis: np.ndarray) -> np.ndarray:
    """Return a turn (4, 4) that brings z to the direction of `axis` (3,)."""
    z = axis / np.linalg.norm(axis)
    turn = np.eye(4)
    if abs(z[2] - 1.0) > 1e-9:
        x = np.cross((0.0, 1.0, 0.0) if abs(z[1]) < 0.9 else (1.0, 0.0, 0.0), z)
        x /= np.linalg.norm(x)
        turn[:3, :3] = np.column_stack((x, np.cross(z, x), z))
    return turn
