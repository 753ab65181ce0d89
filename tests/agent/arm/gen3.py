"""The Kinova Gen3 with seven joints and a hand like the Robotiq 2F-85, as files that `load_arm` reads.

The origins, ranges, speeds, efforts and masses of the joints are from gen3_macro.xacro of Kinova's kortex_description,
and the origins of the hand's joints from its robotiq_arg2f_85_model_macro.xacro; the shapes are cylinders and boxes of
our own.
"""

import math
from pathlib import Path

import yaml

# Of each joint: xyz, roll, range (0 for one that turns without limit), rad/s, Nm.
_JOINTS = (
    ("0 0 0.15643", math.pi, 0.0, 1.3963, 39),
    ("0 0.005375 -0.12838", math.pi / 2, 1.4, 1.3963, 39),
    ("0 -0.21038 -0.006375", -math.pi / 2, 0.0, 1.3963, 39),
    ("0 0.006375 -0.21038", math.pi / 2, 2.66, 1.3963, 39),
    ("0 -0.20843 -0.006375", -math.pi / 2, 0.0, 1.2218, 9),
    ("0 0.00017505 -0.10593", math.pi / 2, 2.23, 1.2218, 9),
    ("0 -0.10593 -0.00017505", -math.pi / 2, 0.0, 1.2218, 9),
)
# Of each link: kg, and a cylinder: xyz of its middle, whether it lies along y, radius and length, m.
_LINKS = (
    (1.697, "0 0 0.077", False, 0.046, 0.154),
    (1.377, "0 0 -0.07", False, 0.042, 0.14),
    (1.164, "0 -0.105 -0.006", True, 0.04, 0.21),
    (1.164, "0 -0.003 -0.105", False, 0.04, 0.21),
    (0.930, "0 -0.104 -0.006", True, 0.04, 0.208),
    (0.678, "0 0 -0.053", False, 0.035, 0.106),
    (0.678, "0 -0.053 0", True, 0.035, 0.106),
    (0.500, "0 0 -0.031", False, 0.036, 0.061),
)
KNUCKLE = "finger_joint"
ARM = {
    "urdf": "gen3.urdf",
    "base": "link_0",
    "tool": "tool",
    "fingers": {KNUCKLE: [0.0, 0.8]},
    "pads": ["left_pad", "right_pad"],
    "home": [0.0, -1.0, 3.14, -2.03, 0.0, -1.73, 1.57],
}


def _joint(name: str, kind: str, parent: str, child: str, xyz: str, rpy: str, more: str = "") -> str:
    return (
        f'<joint name="{name}" type="{kind}"><origin xyz="{xyz}" rpy="{rpy}"/>'
        f'<parent link="{parent}"/><child link="{child}"/>{more}</joint>'
    )


def _link(name: str, mass: float, shape: str, xyz: str = "0 0 0", rpy: str = "0 0 0") -> str:
    return (
        f'<link name="{name}"><inertial><origin xyz="{xyz}"/><mass value="{mass}"/>'
        '<inertia ixx="1e-3" iyy="1e-3" izz="1e-3" ixy="0" ixz="0" iyz="0"/></inertial>'
        f'<collision><origin xyz="{xyz}" rpy="{rpy}"/><geometry>{shape}</geometry></collision></link>'
    )


def _hand() -> list[str]:
    """Return two fingers of three joints each, all of which follow the left knuckle; the pads stay parallel."""
    parts = [_link("palm", 0.6, '<cylinder radius="0.04" length="0.09"/>', "0 0 0.045")]
    parts.append(_joint("palm_joint", "fixed", "tool", "palm", "0 0 0", "0 0 0"))
    turning = '<axis xyz="1 0 0"/><limit lower="-1" upper="1" velocity="2.0" effort="1000"/>'
    for side, sign in (("left", -1), ("right", 1)):
        yaw = f"0 0 {math.pi if side == 'left' else 0}"
        follows = "" if side == "left" else f'<mimic joint="{KNUCKLE}"/>'
        knuckle = KNUCKLE if side == "left" else "right_knuckle_joint"
        parts += [
            _link(f"{side}_knuckle", 0.03, '<box size="0.02 0.045 0.012"/>', "0 0.016 -0.002"),
            _link(f"{side}_inner_knuckle", 0.03, '<box size="0.02 0.008 0.05"/>', "0 0.02 0.025", "-0.7 0 0"),
            _link(f"{side}_finger", 0.03, '<box size="0.02 0.014 0.05"/>', "0 0.004 0.024"),
            _link(f"{side}_tip", 0.01, '<box size="0.02 0.01 0.035"/>', "0 -0.012 0.025"),
            _link(f"{side}_pad", 0.01, '<box size="0.022 0.00635 0.0375"/>'),
            _joint(knuckle, "revolute", "palm", f"{side}_knuckle", f"0 {sign * 0.0306011} 0.054904", yaw,
                   turning + follows),
            _joint(f"{side}_inner_knuckle_joint", "revolute", "palm", f"{side}_inner_knuckle",
                   f"0 {sign * 0.0127} 0.06142", yaw, turning + f'<mimic joint="{KNUCKLE}" multiplier="1"/>'),
            _joint(f"{side}_finger_joint", "fixed", f"{side}_knuckle", f"{side}_finger", "0 0.0315 -0.0041", "0 0 0"),
            _joint(f"{side}_tip_joint", "revolute", f"{side}_finger", f"{side}_tip", "0 0.0061 0.0471", "0 0 0",
                   turning + f'<mimic joint="{KNUCKLE}" multiplier="-1"/>'),
            _joint(f"{side}_pad_joint", "fixed", f"{side}_tip", f"{side}_pad", "0 -0.02202 0.03242", "0 0 0"),
        ]  # fmt: skip
    return parts


def write_urdf(folder: Path, axis: str = "0 0 1") -> Path:
    """Write gen3.urdf into `folder`, its first joint about `axis`."""
    parts = ['<link name="tool"/>']
    for k, (mass, middle, lies, radius, length) in enumerate(_LINKS):
        shape = f'<cylinder radius="{radius}" length="{length}"/>'
        parts.append(_link(f"link_{k}", mass, shape, middle, f"{math.pi / 2 if lies else 0} 0 0"))
    for k, (xyz, roll, most, speed, effort) in enumerate(_JOINTS):
        kind = "revolute" if most else "continuous"
        limit = f'<limit lower="{-most}" upper="{most}" velocity="{speed}" effort="{effort}"/>'
        turns = f'<axis xyz="{axis if k == 0 else "0 0 1"}"/>{limit}'
        parts.append(_joint(f"joint_{k + 1}", kind, f"link_{k}", f"link_{k + 1}", xyz, f"{roll} 0 0", turns))
    parts.append(_joint("end_effector", "fixed", "link_7", "tool", "0 0 -0.061525", f"{math.pi} 0 0"))
    path = folder / "gen3.urdf"
    path.write_text(f'<robot name="gen3">{"".join(parts + _hand())}</robot>')
    return path


def write_arm(folder: Path, **changes: object) -> Path:
    """Write gen3.urdf and gen3.yaml with changed keys into `folder`; one that is `None` is left out."""
    write_urdf(folder)
    path = folder / "gen3.yaml"
    path.write_text(yaml.safe_dump({key: value for key, value in (ARM | changes).items() if value is not None}))
    return path
