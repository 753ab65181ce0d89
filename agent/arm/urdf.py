"""Read the bodies and joints of any URDF, and write it with simple shapes for the physics engine.

Metres, radians, kilograms.
"""

from __future__ import annotations

import copy
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from agent.arm.arm_model import Joint, Solid
from agent.errors import BadInput
from structdiffusion.geometry import pose_from_xyz_rpy

MOVING = ("revolute", "continuous", "prismatic")
_PACKAGE = "package://"
_GREY = "0.45 0.46 0.48 1"
# kg and kg m2 of a link whose file has none: it counts for nothing beside the others.
_LEAST_INERTIAL = (
    '<inertial><mass value="0.001"/><inertia ixx="1e-6" iyy="1e-6" izz="1e-6" ixy="0" ixz="0" iyz="0"/></inertial>'
)


@dataclass(frozen=True, eq=False)
class Body:
    """The part of a URDF that stands on one link.

    Attributes:
        joints: all of them by name, a parent before its children.
        chain: the moving ones among them, with frames that turn or slide about z.
        solids: the collision shapes, in the frames of `chain`; a mesh is replaced by its box.
        carried: link -> the link of `chain` that carries it, and carrier_from_link (4, 4).
    """

    joints: dict[str, ElementTree.Element]
    chain: tuple[Joint, ...]
    solids: tuple[Solid, ...]
    carried: dict[str, tuple[str, np.ndarray]]
    links: dict[str, ElementTree.Element]

    def way(self, link: str) -> list[ElementTree.Element]:
        """Return the joints that lead from the base to a link; none if it is the base or not on it."""
        above = {link_of(joint, "child"): joint for joint in self.joints.values()}
        way: list[ElementTree.Element] = []
        while link in above:
            way.insert(0, above[link])
            link = link_of(way[0], "parent")
        return way

    def below(self, link: str) -> set[str]:
        """Return a link and all that stand on it."""
        found = {link}
        for joint in self.joints.values():
            if link_of(joint, "parent") in found:
                found.add(link_of(joint, "child"))
        return found


def body_on(root: ElementTree.Element, base: str, path: Path) -> Body:
    """Return what stands on the link `base` of a URDF read from `path`.

    Raises:
        BadInput: for a shape, a number or a type of joint that cannot be used.
    """
    links = {link.get("name", ""): link for link in root.findall("link")}
    joints: dict[str, ElementTree.Element] = {}
    chain: list[Joint] = []
    carried: dict[str, tuple[str, np.ndarray]] = {base: (base, np.eye(4))}
    waiting = [base]
    while waiting:
        parent = waiting.pop(0)
        for joint in root.findall("joint"):
            name, child = joint.get("name", ""), link_of(joint, "child")
            if link_of(joint, "parent") != parent or child in carried:
                continue
            joints[name] = joint
            carrier, pose = carried[parent][0], carried[parent][1] @ origin_of(path, joint)
            if joint.get("type") in MOVING:
                to_axis = _z_along(_axis(path, joint))
                chain.append(Joint(name, carrier, child, pose @ to_axis, joint.get("type") == "prismatic"))
                carrier, pose = child, to_axis.T
            elif joint.get("type") != "fixed":
                raise BadInput(
                    f"{path}: the joint {name!r} cannot be {joint.get('type')!r}; legal: fixed, {', '.join(MOVING)}"
                )
            carried[child] = carrier, pose
            waiting.append(child)
    solids = tuple(
        Solid(carried[name][0], solid.round, solid.sides, carried[name][1] @ solid.link_from_solid)
        for name in carried
        if name in links
        for solid in solids_of(path, links[name])
    )
    return Body(joints, tuple(chain), solids, carried, {name: links[name] for name in carried if name in links})


def link_of(joint: ElementTree.Element, end: str) -> str:
    """Return the name of a joint's "parent" or "child"."""
    found = joint.find(end)
    return "" if found is None else found.get("link", "")


def numbers_of(path: Path, element: ElementTree.Element, part: str, key: str, default: str) -> np.ndarray:
    """Return the three numbers of an attribute of a part of an element, such as the xyz of its origin.

    Raises:
        BadInput: for anything else.
    """
    found = element.find(part)
    text = default if found is None else found.get(key, default)
    try:
        return np.array([float(value) for value in text.split()]).reshape(3)
    except ValueError as error:
        what = f"{element.tag} {element.get('name', '')!r}"
        raise BadInput(f"{path}: the URDF's {what} has {part} {key}={text!r}; legal: 3 numbers") from error


def origin_of(path: Path, element: ElementTree.Element) -> np.ndarray:
    """Return the pose (4, 4) of an element's origin.

    Raises:
        BadInput: as `numbers_of`.
    """
    xyz, rpy = (numbers_of(path, element, "origin", key, "0 0 0") for key in ("xyz", "rpy"))
    return pose_from_xyz_rpy(xyz.tolist(), rpy.tolist())


def solids_of(path: Path, link: ElementTree.Element) -> list[Solid]:
    """Return the collision shapes of a link in its own frame; a mesh is replaced by its box, a sphere by a cylinder.

    Raises:
        BadInput: for a shape that cannot be read.
    """
    name, found = link.get("name", ""), []
    for collision in link.findall("collision"):
        shape = next(iter(collision.find("geometry") or ()), None)
        pose = origin_of(path, collision)
        try:
            if shape is None:
                raise ValueError("it has no geometry")
            sides, middle = _sides(path, shape)
        except (ValueError, OSError) as error:
            raise BadInput(f"{path}: the collision of the URDF's link {name!r} cannot be used: {error}") from error
        shift = np.eye(4)
        shift[:3, 3] = middle
        found.append(Solid(name, shape.tag in ("cylinder", "sphere"), sides, pose @ shift))
    return found


def _sides(path: Path, shape: ElementTree.Element) -> tuple[np.ndarray, np.ndarray]:
    """Return the sides (3,) of a shape, as `Solid` has them, and its middle (3,).

    Raises:
        ValueError, OSError: if it cannot be read.
    """
    if shape.tag == "box":
        sides = np.array([float(side) for side in shape.get("size", "").split()]).reshape(3)
    elif shape.tag in ("cylinder", "sphere"):
        diameter = 2 * float(shape.get("radius", ""))
        sides = np.array([diameter, diameter, float(shape.get("length", "")) if shape.tag == "cylinder" else diameter])
    elif shape.tag == "mesh":
        low, high = _bounds(path, shape)
        return high - low, (low + high) / 2
    else:
        raise ValueError(f"{shape.tag!r} is none of box, cylinder, sphere, mesh")
    if not (np.isfinite(sides).all() and (sides > 0.0).all()):
        raise ValueError(f"the sides of its {shape.tag} are {sides.tolist()}, and have to be above 0")
    return sides, np.zeros(3)


def _bounds(path: Path, shape: ElementTree.Element) -> np.ndarray:
    """Return the corners (2, 3) of a mesh's box.

    Raises:
        ValueError, OSError: if it cannot be read.
    """
    said = shape.get("filename", "")
    file = next((each for each in _places(path, said) if each.is_file()), None)
    if file is None:
        raise OSError(f"there is no mesh {said!r} beside the URDF or above it")
    scale = np.array([float(each) for each in shape.get("scale", "1 1 1").split()]).reshape(3)
    try:
        import trimesh  # not above: it takes long to import, and the own arm is known without

        bounds = trimesh.load(file, force="mesh").bounds
    except Exception as error:  # every format has its own
        raise ValueError(f"the mesh {file} cannot be read: {error}; a box or a cylinder will do") from error
    if bounds is None or not np.isfinite(bounds).all():
        raise ValueError(f"the mesh {file} is empty")
    return np.sort(bounds * scale, axis=0)


def _places(path: Path, said: str) -> Iterator[Path]:
    """Yield where a mesh may be: beside the URDF, or in its package, which is a folder above it."""
    if not said.startswith(_PACKAGE):
        yield path.parent / said.removeprefix("file://")
        return
    package, _, inside = said.removeprefix(_PACKAGE).partition("/")
    for folder in path.absolute().parents:
        yield folder / inside if folder.name == package else folder / package / inside


def _axis(path: Path, joint: ElementTree.Element) -> np.ndarray:
    axis = numbers_of(path, joint, "axis", "xyz", "1 0 0")
    if not np.linalg.norm(axis) > 0.0:
        raise BadInput(f"{path}: the URDF's joint {joint.get('name')!r} has an axis of length 0; legal: any direction")
    return axis


def _z_along(axis: np.ndarray) -> np.ndarray:
    """Return a turn (4, 4) that brings z to the direction of `axis` (3,)."""
    z = axis / np.linalg.norm(axis)
    turn = np.eye(4)
    if abs(z[2] - 1.0) > 1e-9:
        x = np.cross((0.0, 1.0, 0.0) if abs(z[1]) < 0.9 else (1.0, 0.0, 0.0), z)
        x /= np.linalg.norm(x)
        turn[:3, :3] = np.column_stack((x, np.cross(z, x), z))
    return turn


def simple_urdf(body: Body, path: Path, end: str, tool: str, tool_from_end: np.ndarray) -> str:
    """Return the text of a URDF of a body with boxes and cylinders alone, and a frame of its own on it.

    Args:
        body: what stands on the base, which becomes the first link.
        path: the file that it is from.
        end: the name of the frame, its joint and its link. tool: the link that carries it.
        tool_from_end: (4, 4) where it is.
    """
    robot = ElementTree.Element("robot", name=path.stem)
    for name, link in body.links.items():
        there = ElementTree.SubElement(robot, "link", name=name)
        inertial = link.find("inertial")
        mass = None if inertial is None else inertial.find("mass")
        heavy = mass is not None and float(mass.get("value", "0")) > 0.0
        there.append(ElementTree.fromstring(_LEAST_INERTIAL) if inertial is None or not heavy else inertial)
        color = link.find("visual/material/color")
        rgba = _GREY if color is None else color.get("rgba", _GREY)
        for solid in solids_of(path, link):
            for kind in ("visual", "collision"):
                there.append(_shape(kind, solid, f"{name} color", rgba))
    for joint in body.joints.values():
        moving = copy.deepcopy(joint)
        for mimic in moving.findall("mimic"):  # the engine does not know them
            moving.remove(mimic)
        limit = moving.find("limit")
        if moving.get("type") == "continuous" and limit is not None:  # it would keep to a range from 0 to 0
            for end_of_range in ("lower", "upper"):
                limit.attrib.pop(end_of_range, None)
        robot.append(moving)
    last = ElementTree.SubElement(robot, "link", name=end)
    last.append(ElementTree.fromstring(_LEAST_INERTIAL))
    fixed = ElementTree.SubElement(robot, "joint", name=end, type="fixed")
    ElementTree.SubElement(fixed, "parent", link=tool)
    ElementTree.SubElement(fixed, "child", link=end)
    fixed.append(_origin(tool_from_end))
    return ElementTree.tostring(robot, encoding="unicode")


def _shape(kind: str, solid: Solid, material: str, rgba: str) -> ElementTree.Element:
    element = ElementTree.Element(kind)
    element.append(_origin(solid.link_from_solid))
    geometry = ElementTree.SubElement(element, "geometry")
    if solid.round:
        ElementTree.SubElement(geometry, "cylinder", radius=f"{solid.sides[0] / 2}", length=f"{solid.sides[2]}")
    else:
        ElementTree.SubElement(geometry, "box", size=" ".join(map(str, solid.sides.tolist())))
    if kind == "visual":
        ElementTree.SubElement(ElementTree.SubElement(element, "material", name=material), "color", rgba=rgba)
    return element


def _origin(pose: np.ndarray) -> ElementTree.Element:
    angles = Rotation.from_matrix(pose[:3, :3]).as_euler("xyz")
    xyz, rpy = (" ".join(map(str, each.tolist())) for each in (pose[:3, 3], angles))
    return ElementTree.Element("origin", xyz=xyz, rpy=rpy)
