"""Recordings of small simulated tables, as a depth camera gives them: noisy, in millimetres, with the truth beside."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from agent.arm.arm_model import WORLD_FROM_BASE, arm_model
from agent.arm.state import ArmState
from agent.recordings.recording import DepthFrame, Recording
from agent.scenes.table_scene import TableScene
from structdiffusion.geometry import pose_from_xyz_yaw

JACO = arm_model("j2s7s300")
FOLDED_ARM = ArmState(JACO.name, dict(zip(JACO.joints, JACO.folded, strict=True)))


@dataclass(frozen=True)
class Recorded:
    """A recording with everything known, and the truth: 1 + the object's place for each pixel, 0 elsewhere."""

    recording: Recording
    truth: np.ndarray
    world_from_camera: np.ndarray


Record = Callable[[Sequence[tuple]], Recorded]  # object, x, y, yaw, and z where that is not 0


@pytest.fixture(scope="session")
def record() -> Record:
    """Records objects that stand at (x, y) with a yaw, and a height where they stand on others, m and rad."""

    def recorded(placed: Sequence[tuple]) -> Recorded:
        models = [model for model, *_ in placed]
        poses = [pose_from_xyz_yaw(x, y, z[0] if z else 0.0, yaw) for _, x, y, yaw, *z in placed]
        poses = np.array(poses).reshape(-1, 4, 4)
        rng = np.random.default_rng(0)
        with TableScene(models, poses, len(models), rng) as table:
            image, camera, bodies = table.world.look(rng), table.world.camera, list(table.world.bodies)
        depth = np.round(image.depth, 3)
        pose = camera.world_from_camera
        points = (camera.points(depth) - pose[:3, 3]) @ pose[:3, :3]
        truth = np.zeros(depth.shape, dtype=int)
        for index, body in enumerate(bodies):
            truth[(image.segmentation == body) & np.isfinite(depth)] = index + 1
        recording = Recording(
            Path("session.bag"),
            DepthFrame(points.astype(np.float32), image.color),
            base_from_camera=np.linalg.inv(WORLD_FROM_BASE) @ pose,
            arm=FOLDED_ARM,
        )
        return Recorded(recording, truth, pose)

    return recorded
