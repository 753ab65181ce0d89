"""Load the supported Kinova Jaco 2 arms from their URDFs: joints, limits, links and their solids.

All three models carry the same hand with three fingers. Metres, radians, seconds, newton metres.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, cached_property
from importlib import resources

import numpy as np

from agent.arm.hand import Hand
from agent.arm.jaco_hand import FINGER_CLOSED, FINGER_OPEN, FINGERS, jaco_hand
from agent.errors import BadInput
from structdiffusion.geometry import pose_from_xyz_rpy, pose_from_xyz_yaw

# Waiting poses: the upper arm leans back and the forearm is folded down behind it, so that the table stays in view.
_FOLDED = {
    "j2s7s300": (1.571, 3.93, 0.0, 5.04, 3.142, 5.06, 1.571),
    "j2n6s300": (1.58, 4.317, 4.81, 1.769, 2.802, 4.989),
    "j2s6s300": (1.571, 3.93, 5.04, 3.142, 5.06, 1.571),
}
ARM_MODELS = tuple(_FOLDED)
DEFAULT_MODEL = "j2s7s300"
WORLD_FROM_BASE = pose_from_xyz_yaw(0.0, 0.0, 0.0, math.pi / 2)  # by default
END_EFFECTOR = "joint_end_effector"


@dataclass(frozen=True, eq=False)
class Joint:
    """A joint that carries a link; the joint's angle turns the link about z of `parent_from_joint`.

    Attributes:
        name: the joint's name. parent, child: the names of its links.
        parent_from_joint: (4, 4), at angle 0.
        slides: whether the link slides along z instead, by metres.
    """

    name: str
    parent: str
    child: str
    parent_from_joint: np.ndarray
    slides: bool = False


@dataclass(frozen=True, eq=False)
class Solid:
    """A cylinder or a box that belongs to a link.

    Attributes:
        link: the link's name.
        round: whether it is a cylinder about z.
        sides: (3,) the sides of a box, metres; for a cylinder, its diameter twice, then its length.
        link_from_solid: (4, 4) the pose of its middle.
    """

    link: str
    round: bool
    sides: np.ndarray
    link_from_solid: np.ndarray


@dataclass(frozen=True, eq=False)
class ArmModel:
    """One model of an arm. Arrays have one entry for each of its n joints, from the base on.

    Attributes:
        name: the maker's name for it.
        joints: the names of the joints, without those of the hand.
        lower, upper: (n,) the range; two turns each way for a continuous joint, which limits how far it may wind.
        continuous: (n,) bool: whether the joint turns without limit.
        velocity, effort: (n,) the maker's limits.
        folded: (n,) the waiting pose.
        chain: every joint, including those of the hand; a parent comes before its children.
        solids: the collision solids.
        urdf: the text of its URDF, with cylinders, boxes and spheres alone.
        mounted: (4, 4) where its base usually stands in the world.
        fingers: of each finger joint that is commanded, by its name, the angles when open and when closed.
        hand: the hand, which its last link carries.
    """

    name: str
    joints: tuple[str, ...]
    lower: np.ndarray
    upper: np.ndarray
    continuous: np.ndarray
    velocity: np.ndarray
    effort: np.ndarray
    folded: np.ndarray
    chain: tuple[Joint, ...]
    solids: tuple[Solid, ...]
    urdf: str
    mounted: np.ndarray
    fingers: Mapping[str, tuple[float, float]]
    hand: Hand

    @cached_property
    def origins(self) -> dict[str, np.ndarray]:
        """Return parent_from_joint (4, 4) of every joint by name."""
        return {joint.name: joint.parent_from_joint for joint in self.chain}

    @cached_property
    def joint_origins(self) -> np.ndarray:
        """Return parent_from_joint (n, 4, 4) of the joints of the arm."""
        return np.stack([self.origins[name] for name in self.joints])

    def link_poses(self, angles: Mapping[str, float]) -> dict[str, np.ndarray]:
        """Return base_from_link (4, 4) of every link by name; a joint that `angles` leaves out is at 0."""
        return poses_on(self.chain, self.chain[0].parent, angles)


def poses_on(chain: tuple[Joint, ...], link: str, positions: Mapping[str, float]) -> dict[str, np.ndarray]:
    """Return link_from_other (4, 4) of a link and of every one that stands on it; a joint without position is at 0."""
    poses = {link: np.eye(4)}
    for joint in chain:
        if joint.parent in poses:
            by = positions.get(joint.name, 0.0)
            moved = pose_from_xyz_yaw(0.0, 0.0, by, 0.0) if joint.slides else pose_from_xyz_yaw(0.0, 0.0, 0.0, by)
            poses[joint.child] = poses[joint.parent] @ joint.parent_from_joint @ moved
    return poses


@cache
def arm_model(name: str) -> ArmModel:
    """Return the model with this name.

    Raises:
        BadInput: for a name that is none of `ARM_MODELS`.
    """
    if name not in ARM_MODELS:
        raise BadInput(f"there is no arm model {name!r}; legal: {', '.join(ARM_MODELS)}")
    urdf = resources.files("agent.arm").joinpath(f"{name}.urdf").read_text(encoding="utf-8")
    root = ElementTree.fromstring(urdf)
    driven = [joint for joint in root.iter("joint") if joint.get("name", "").removeprefix("joint_").isdigit()]
    continuous = np.array([joint.get("type") == "continuous" for joint in driven])

    def limits(key: str) -> np.ndarray:
        return np.array([float(_part(joint, "limit").get(key, "nan")) for joint in driven])

    chain = tuple(
        Joint(
            joint.get("name", ""),
            _part(joint, "parent").get("link", ""),
            _part(joint, "child").get("link", ""),
            _origin(joint),
        )
        for joint in root.iter("joint")
    )
    return ArmModel(
        name,
        tuple(joint.get("name", "") for joint in driven),
        np.where(continuous, -2 * math.pi, limits("lower")),
        np.where(continuous, 4 * math.pi, limits("upper")),
        continuous,
        limits("velocity"),
        limits("effort"),
        np.array(_FOLDED[name]),
        chain,
        tuple(_solid(link.get("name", ""), shape) for link in root.iter("link") for shape in link.iter("collision")),
        urdf,
        WORLD_FROM_BASE.copy(),
        dict.fromkeys(FINGERS, (FINGER_OPEN, FINGER_CLOSED)),
        jaco_hand({joint.name: joint.parent_from_joint for joint in chain}, END_EFFECTOR),
    )


def _part(element: ElementTree.Element, name: str) -> ElementTree.Element:
    part = element.find(name)
    assert part is not None  # the files of the arms are part of the package
    return part


def _numbers(element: ElementTree.Element, key: str) -> list[float]:
    return [float(value) for value in element.get(key, "").split()]


def _origin(element: ElementTree.Element) -> np.ndarray:
    origin = _part(element, "origin")
    return pose_from_xyz_rpy(_numbers(origin, "xyz"), _numbers(origin, "rpy"))


def _solid(link: str, collision: ElementTree.Element) -> Solid:
    shape = _part(collision, "geometry")[0]
    if shape.tag == "cylinder":
        diameter = 2 * float(shape.get("radius", "nan"))
        sides = np.array([diameter, diameter, float(shape.get("length", "nan"))])
    else:
        sides = np.array(_numbers(shape, "size"))
    return Solid(link, shape.tag == "cylinder", sides, _origin(collision))
