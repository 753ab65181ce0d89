"""The Kinova Gen3 with seven joints and a two-finger gripper, as files that `load_arm` reads.

The origins, ranges, speeds and efforts of the joints are from gen3_macro.xacro of Kinova's kortex_description; the base
and the gripper are reduced to what the kinematics need.
"""

import math
from pathlib import Path

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
KNUCKLE = "robotiq_85_left_knuckle_joint"
ARM = {
    "urdf": "gen3.urdf",
    "base": "link_0",
    "tool": "tool",
    "fingers": {KNUCKLE: [0.0, 0.8]},
    "home": [0.0, 0.26, 3.14, -2.27, 0.0, 0.96, 1.57],
}


def write_urdf(folder: Path, axis: str = "0 0 1") -> Path:
    """Write gen3.urdf into `folder`, its first joint about `axis`."""
    parts = [f'<link name="link_{k}"/>' for k in range(8)] + ['<link name="tool"/>', '<link name="knuckle"/>']
    for k, (xyz, roll, most, speed, effort) in enumerate(_JOINTS):
        kind = "revolute" if most else "continuous"
        parts.append(
            f'<joint name="joint_{k + 1}" type="{kind}"><origin xyz="{xyz}" rpy="{roll} 0 0"/>'
            f'<parent link="link_{k}"/><child link="link_{k + 1}"/><axis xyz="{axis if k == 0 else "0 0 1"}"/>'
            f'<limit lower="{-most}" upper="{most}" velocity="{speed}" effort="{effort}"/></joint>'
        )
    parts.append(
        f'<joint name="end_effector" type="fixed"><origin xyz="0 0 -0.061525" rpy="{math.pi} 0 0"/>'
        '<parent link="link_7"/><child link="tool"/></joint>'
        f'<joint name="{KNUCKLE}" type="revolute"><parent link="tool"/><child link="knuckle"/><axis xyz="0 1 0"/>'
        '<limit lower="0" upper="0.8" velocity="0.5" effort="50"/></joint>'
    )
    path = folder / "gen3.urdf"
    path.write_text(f'<robot name="gen3">{"".join(parts)}</robot>')
    return path
