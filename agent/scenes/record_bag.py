"""Record a session of the simulated arm and its camera as a kinova-ros driver and a RealSense would publish it.

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
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from agent.arm.arm_model import END_EFFECTOR
from agent.arm.jaco_hand import FINGER_TIPS, FINGERS
from agent.recordings.bag_writer import BagWriter
from agent.recordings.message_builders import (
    color_message,
    depth_message,
    joints_message,
    lens_message,
    pose_message,
    transforms_message,
)
from structdiffusion.simulation.depth_camera import DepthCamera, measured_depth

if TYPE_CHECKING:
    from agent.scenes.table_scene import TableScene

CAMERA_RATE = 15.0  # Hz
_DRIVER_RATE = 10.0  # Hz
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
    """Write a bag of a table in its present state.

    Args:
        table: the table, with the arm beside it.
        out: the new bag, as for `BagWriter`.
        noise: draws the depth sensor's noise, again for each picture.
        seconds: how long the session lasts; everything is there at its beginning.
        rate: pictures a second.
        force: overwrite a bag that is there.

    Raises:
        UsageError: for a path that cannot be a new bag.
        BadInput: if nothing can be written.
    """
    camera, seen = table.world.camera, table.world.look()
    write_session(table, camera, seen.color, lambda: measured_depth(seen.depth, noise), out, seconds, rate, force)


def write_session(
    table: TableScene,
    camera: DepthCamera,
    color: np.ndarray,
    measure: Callable[[], np.ndarray],
    out: Path,
    seconds: float = 1.0,
    rate: float = CAMERA_RATE,
    force: bool = False,
) -> None:
    """Write a bag of what a camera measures, anywhere about a table in its present state.

    Args:
        table: the table, with the arm beside it.
        camera: its pose and lens.
        color: (H, W, 3) uint8, its picture.
        measure: returns a depth picture (H, W), metres, NaN for nothing; called for each picture.
        out, seconds, rate, force: as for `record_session`.

    Raises: as `record_session`.
    """
    lens, size = ros_intrinsics(camera), (camera.height, camera.width)
    driver = _Driver(table)
    with BagWriter(out, force) as writer:
        fixed = driver.fixed() | _mounted(driver.base_from_world @ camera.world_from_camera)
        writer.write("/tf_static", transforms_message(writer, fixed, 0.0), 0.0, latched=True)
        pictures = [(k / rate, True) for k in range(_count(seconds, rate))]
        states = [(k / _DRIVER_RATE, False) for k in range(_count(seconds, _DRIVER_RATE))]
        # The driver speaks first where both do, so that from the first picture on everything is there.
        for when, picture in sorted(states + pictures):
            if not picture:
                driver.say(writer, when)
                continue
            for name, image in (
                ("color", color_message(writer, color, when, _OPTICAL)),
                ("aligned_depth_to_color", depth_message(writer, measure(), when, _OPTICAL)),
            ):
                writer.write(f"/camera/{name}/image_raw", image, when)
                writer.write(f"/camera/{name}/camera_info", lens_message(writer, lens, size, when, _OPTICAL), when)


def _count(seconds: float, rate: float) -> int:
    """Count the messages of a rate in a duration that begins with one."""
    return max(1, math.ceil(seconds * rate - 1e-9))


def ros_intrinsics(camera: DepthCamera) -> np.ndarray:
    """Return (3, 3) the camera's lens with pixel centres at whole numbers, as in ROS, instead of halves."""
    lens = camera.intrinsics.copy()
    lens[:2, 2] -= 0.5
    return lens


def _mounted(base_from_optical: np.ndarray) -> dict[tuple[str, str], np.ndarray]:
    """Return the camera's frames, and its measured pose relative to the arm."""
    body_from_optical = _BODY_FROM_COLOR @ _COLOR_FROM_OPTICAL
    return {
        ("world", "camera_link"): base_from_optical @ np.linalg.inv(body_from_optical),
        ("camera_link", "camera_color_frame"): _BODY_FROM_COLOR,
        ("camera_color_frame", _OPTICAL): _COLOR_FROM_OPTICAL,
    }


class _Driver:
    """The messages of the arm's driver and its link publisher, for an arm at rest."""

    def __init__(self, table: TableScene) -> None:
        model = table.arm.kinematics.model
        self._joints, self._fingers = table.arm.configuration(), table.arm.finger_angles()
        # The driver cannot measure the finger tips.
        names = (*model.joints, *FINGERS, *FINGER_TIPS)
        angles = dict(zip(names, (*self._joints, *self._fingers, 0.0, 0.0, 0.0), strict=True))
        links = model.link_poses(angles)
        self._prefix, self._out = f"{model.name}_", f"/{model.name}_driver/out"
        self._angles = {self._prefix + name: angle for name, angle in angles.items()}
        hung = {
            joint.name: (
                (self._prefix + joint.parent, self._prefix + joint.child),
                np.linalg.inv(links[joint.parent]) @ links[joint.child],
            )
            for joint in model.chain
        }
        self._end = dict([hung.pop(END_EFFECTOR)])
        self._moving = dict(hung.values())
        self._base = self._prefix + model.chain[0].parent
        self._base_from_hand = links[next(joint.child for joint in model.chain if joint.name == END_EFFECTOR)]
        self.base_from_world = np.linalg.inv(table.arm.kinematics.world_from_base)

    def fixed(self) -> dict[tuple[str, str], np.ndarray]:
        """Return the links that no joint moves."""
        return {("world", "root"): np.eye(4), ("root", self._base): np.eye(4), **self._end}

    def say(self, writer: BagWriter, when: float) -> None:
        """Write all messages of one moment."""
        degrees, turns = np.zeros(7), np.degrees(self._fingers) / _DEGREES_A_TURN
        degrees[: len(self._joints)] = np.degrees(self._joints)
        said = {
            f"{self._out}/joint_state": joints_message(writer, tuple(self._angles), [*self._angles.values()], when),
            f"{self._out}/joint_angles": writer.message(
                "kinova_msgs/msg/JointAngles", **{f"joint{k}": angle for k, angle in enumerate(degrees.tolist(), 1)}
            ),
            f"{self._out}/finger_position": writer.message(
                "kinova_msgs/msg/FingerPosition", **{f"finger{k}": turn for k, turn in enumerate(turns.tolist(), 1)}
            ),
            f"{self._out}/tool_pose": pose_message(writer, self._base_from_hand, when, self._base),
            "/tf": transforms_message(writer, self._moving, when),
        }
        for topic, message in said.items():
            writer.write(topic, message, when)
