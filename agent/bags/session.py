"""A recorded session of the simulated arm and its camera: what a kinova-ros driver and a RealSense would have said.

| topic | type | frame | rate |
|---|---|---|---|
| `/camera/color/image_raw` | Image, rgb8 | `camera_color_optical_frame` | the camera's |
| `/camera/aligned_depth_to_color/image_raw` | Image, 16UC1, mm, 0 for nothing | the same | the camera's |
| `/camera/color/camera_info`, `/camera/aligned_depth_to_color/camera_info` | CameraInfo | the same | the camera's |
| `/MODEL_driver/out/joint_state` | JointState, rad | none | 10 Hz |
| `/MODEL_driver/out/joint_angles` | kinova_msgs/JointAngles, degrees | none | 10 Hz |
| `/MODEL_driver/out/finger_position` | kinova_msgs/FingerPosition, turns | none | 10 Hz |
| `/MODEL_driver/out/tool_pose` | PoseStamped | `MODEL_link_base` | 10 Hz |
| `/tf` | TFMessage, the links that joints move | | 10 Hz |
| `/tf_static` | TFMessage: `world`, `root`, `MODEL_link_base`, and from `world` to the camera | | once |

The `world` of tf is the arm's own, as its maker's description has it: it stands where `MODEL_link_base` does. Nothing
moves while it is recorded.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pybullet

from agent.arm.shapes import BASE, link_poses
from agent.bags.composing import (
    color_message,
    depth_message,
    joints_message,
    lens_message,
    pose_message,
    transforms_message,
)
from agent.bags.writing import BagWriter
from structdiffusion.camera import DepthCamera, measured_depth

if TYPE_CHECKING:
    from agent.arm.kinematics import JacoArm
    from agent.scenes.table import TableScene

MODEL = "j2s7s300"
DRIVER_RATE = 10.0  # Hz
CAMERA_RATE = 6.0  # Hz, the lowest that such cameras have
_DEGREES_A_TURN = 80.0 / 6800.0  # of a finger, in the driver's unit
_OPTICAL = "camera_color_optical_frame"
# Where the colour lens sits in the camera's body (x forward, y left, z up), and how the optical frame is turned in it.
_BODY_FROM_COLOR = np.eye(4)
_BODY_FROM_COLOR[1, 3] = 0.015
_COLOR_FROM_OPTICAL = np.array(((0.0, 0, 1, 0), (-1, 0, 0, 0), (0, -1, 0, 0), (0, 0, 0, 1)))


def record_session(
    table: TableScene,
    out: Path,
    noise: np.random.Generator,
    seconds: float = 1.0,
    rate: float = CAMERA_RATE,
    force: bool = False,
) -> None:
    """Writes a bag of a table as it stands now.

    Args:
        table: the table, with the arm beside it.
        out: the new bag, as `BagWriter` takes it.
        noise: draws the depth sensor's noise, anew for each picture.
        seconds: how long the session lasts; everything is there at its beginning.
        rate: pictures a second.
        force: overwrite a bag that is there.

    Raises:
        UsageError: for a path that cannot be a new bag.
        BadInput: where nothing can be written.
    """
    camera, arm = table.world.camera, table.arm
    seen = table.world.look()
    lens, size = ros_intrinsics(camera), (camera.height, camera.width)
    poses, names = link_poses(arm), _link_names(arm)
    with BagWriter(out, force) as writer:
        fixed = _fixed_transforms(arm, names, poses, camera)
        writer.write("/tf_static", transforms_message(writer, fixed, 0.0), 0.0, latched=True)
        pictures = [(k / rate, True) for k in range(_count(seconds, rate))]
        states = [(k / DRIVER_RATE, False) for k in range(_count(seconds, DRIVER_RATE))]
        # The driver speaks first where both do, so that from the first picture on everything is there.
        for when, picture in sorted(states + pictures):
            if not picture:
                _write_driver(writer, arm, names, poses, when)
                continue
            depth = measured_depth(seen.depth, noise)
            for name, image in (
                ("color", color_message(writer, seen.color, when, _OPTICAL)),
                ("aligned_depth_to_color", depth_message(writer, depth, when, _OPTICAL)),
            ):
                info = lens_message(writer, lens, size, when, _OPTICAL)
                writer.write(f"/camera/{name}/image_raw", image, when)
                writer.write(f"/camera/{name}/camera_info", info, when)


def _count(seconds: float, rate: float) -> int:
    """How many messages of a rate fall into a time that begins with one."""
    return max(1, math.ceil(seconds * rate - 1e-9))


def ros_intrinsics(camera: DepthCamera) -> np.ndarray:
    """(3, 3) the camera's lens where pixel centres lie at whole numbers, as in ROS, and not at halves."""
    lens = camera.intrinsics.copy()
    lens[:2, 2] -= 0.5
    return lens


def _link_names(arm: JacoArm) -> dict[int, tuple[str, int]]:
    """Each link's name in a session, and its parent, `BASE` where that is the base."""
    names = {}
    for link in range(pybullet.getNumJoints(arm.body, physicsClientId=arm.client)):
        info = pybullet.getJointInfo(arm.body, link, physicsClientId=arm.client)
        names[link] = f"{MODEL}_{info[12].decode()}", info[16]
    return names


def _fixed_transforms(
    arm: JacoArm, names: dict[int, tuple[str, int]], poses: dict[int, np.ndarray], camera: DepthCamera
) -> dict[tuple[str, str], np.ndarray]:
    """What never moves: the base, the hand's end, and the camera."""
    base_from_optical = np.linalg.inv(poses[BASE]) @ camera.world_from_camera
    body_from_optical = _BODY_FROM_COLOR @ _COLOR_FROM_OPTICAL
    links = _relative(names, poses)
    end = names[arm.end_effector][0]
    return {
        ("world", "root"): np.eye(4),
        ("root", f"{MODEL}_link_base"): np.eye(4),
        **{pair: pose for pair, pose in links.items() if pair[1] == end},
        ("world", "camera_link"): base_from_optical @ np.linalg.inv(body_from_optical),
        ("camera_link", "camera_color_frame"): _BODY_FROM_COLOR,
        ("camera_color_frame", _OPTICAL): _COLOR_FROM_OPTICAL,
    }


def _relative(
    names: dict[int, tuple[str, int]], poses: dict[int, np.ndarray]
) -> dict[tuple[str, str], np.ndarray]:
    """(parent, child) -> parent_from_child (4, 4) of every link."""
    return {
        (f"{MODEL}_link_base" if parent == BASE else names[parent][0], name):
        np.linalg.inv(poses[parent]) @ poses[link]
        for link, (name, parent) in names.items()
    }  # fmt: skip


def _write_driver(
    writer: BagWriter, arm: JacoArm, names: dict[int, tuple[str, int]], poses: dict[int, np.ndarray], when: float
) -> None:
    """What the arm's driver says at one moment, and the links that follow from it."""
    driver, base = f"/{MODEL}_driver/out", f"{MODEL}_link_base"
    joints, fingers = arm.configuration(), arm.finger_angles()
    arms = [f"{MODEL}_joint_{k + 1}" for k in range(len(joints))]
    hand = [f"{MODEL}_joint_{part}_{k}" for part in ("finger", "finger_tip") for k in (1, 2, 3)]
    angles = np.concatenate((joints, fingers, np.zeros(3)))  # the driver cannot measure the tips
    writer.write(f"{driver}/joint_state", joints_message(writer, arms + hand, angles, when), when)
    degrees = {f"joint{k + 1}": float(np.degrees(joints[k])) if k < len(joints) else 0.0 for k in range(7)}
    writer.write(f"{driver}/joint_angles", writer.message("kinova_msgs/msg/JointAngles", **degrees), when)
    turns = {f"finger{k + 1}": float(np.degrees(angle) / _DEGREES_A_TURN) for k, angle in enumerate(fingers)}
    writer.write(f"{driver}/finger_position", writer.message("kinova_msgs/msg/FingerPosition", **turns), when)
    base_from_hand = np.linalg.inv(poses[BASE]) @ poses[arm.end_effector]
    writer.write(f"{driver}/tool_pose", pose_message(writer, base_from_hand, when, base), when)
    end = names[arm.end_effector][0]
    moving = {pair: pose for pair, pose in _relative(names, poses).items() if pair[1] != end}
    writer.write("/tf", transforms_message(writer, moving, when), when)
