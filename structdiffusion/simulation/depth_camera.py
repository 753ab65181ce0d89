"""The fixed depth camera: its geometry, its noise, and the conversion of depth pictures to points.

The camera is above the robot and looks at the table, so left in the picture is +y, which is left for a person on the
robot's side. Camera frame: z forward, x right, y down.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

DROPPED_PIXELS = 0.01


@dataclass(frozen=True)
class DepthCamera:
    """A pinhole camera. Lengths in metres, world frame; pixel centres lie at half-integers.

    Attributes:
        eye: position of the camera.
        target: the point in the middle of the picture.
        up: the world direction that points up in the picture.
        width, height: pixels.
        vertical_field: the vertical field of view, radians.
        near, far: the depth range that it measures.
    """

    eye: tuple[float, float, float] = (0.02, 0.0, 1.05)
    target: tuple[float, float, float] = (0.45, 0.0, 0.0)
    up: tuple[float, float, float] = (0.0, 0.0, 1.0)
    width: int = 640
    height: int = 480
    vertical_field: float = math.radians(46.0)
    near: float = 0.05
    far: float = 3.0

    @property
    def focal(self) -> float:
        """Return the focal length in pixels, the same in both directions."""
        return self.height / 2 / math.tan(self.vertical_field / 2)

    @property
    def world_from_camera(self) -> np.ndarray:
        """Return the camera's pose (4, 4): z forward, x right, y down in the picture."""
        forward = np.subtract(self.target, self.eye)
        forward /= np.linalg.norm(forward)
        right = np.cross(forward, self.up)
        right /= np.linalg.norm(right)
        pose = np.eye(4)
        pose[:3, :3] = np.stack((right, np.cross(forward, right), forward), axis=1)
        pose[:3, 3] = self.eye
        return pose

    @property
    def view_matrix(self) -> list[float]:
        """Return the OpenGL view matrix (eye frame: x right, y up, z backward), 16 numbers in column order."""
        world_from_eye = self.world_from_camera @ np.diag((1.0, -1.0, -1.0, 1.0))
        return np.linalg.inv(world_from_eye).T.ravel().tolist()

    @property
    def projection_matrix(self) -> list[float]:
        """Return the OpenGL projection matrix, 16 numbers in column order."""
        f, near, far = 1 / math.tan(self.vertical_field / 2), self.near, self.far
        matrix = np.zeros((4, 4))
        matrix[0, 0], matrix[1, 1] = f * self.height / self.width, f
        matrix[2, 2], matrix[2, 3] = -(far + near) / (far - near), -2 * far * near / (far - near)
        matrix[3, 2] = -1.0
        # PyBullet's software renderer samples a pixel at its lower left corner; this shifts the picture by half a pixel
        # in both directions, so that it samples the middle.
        matrix[0, 2], matrix[1, 2] = 1 / self.width, 1 / self.height
        return matrix.T.ravel().tolist()

    def depth_from_buffer(self, buffer: np.ndarray) -> np.ndarray:
        """Return the depth along the camera's z, metres, of an OpenGL depth buffer (H, W); NaN for background."""
        buffer = buffer.astype(np.float64)
        depth = self.far * self.near / (self.far - (self.far - self.near) * buffer)
        depth[buffer >= 1.0] = np.nan
        return depth

    def points(self, depth: np.ndarray) -> np.ndarray:
        """Return the world points (H, W, 3) of a depth picture (H, W); NaN where the depth is NaN."""
        columns = (np.arange(self.width) + 0.5 - self.width / 2) / self.focal
        rows = (np.arange(self.height) + 0.5 - self.height / 2) / self.focal
        points = np.empty((*depth.shape, 3))
        np.multiply(columns, depth, out=points[..., 0])
        np.multiply(rows[:, None], depth, out=points[..., 1])
        points[..., 2] = depth
        pose = self.world_from_camera
        found = points.reshape(-1, 3) @ pose[:3, :3].T  # all at once: row by row it takes three times as long
        found += pose[:3, 3]
        return found.reshape(points.shape)

    @property
    def intrinsics(self) -> np.ndarray:
        """Return the pinhole matrix (3, 3), pixels."""
        return np.array([[self.focal, 0.0, self.width / 2], [0.0, self.focal, self.height / 2], [0.0, 0.0, 1.0]])

    def pixels(self, points: np.ndarray) -> np.ndarray:
        """Project world points (..., 3) into the picture: (..., 2) column and row, in pixels."""
        return project(points, self.world_from_camera, self.intrinsics)


def project(points: np.ndarray, world_from_camera: np.ndarray, intrinsics: np.ndarray) -> np.ndarray:
    """Project world points (..., 3) into a pinhole camera's picture: (..., 2) column and row, in pixels.

    Args:
        points: world frame, metres.
        world_from_camera: (4, 4), the camera's frame: z forward, x right, y down.
        intrinsics: (3, 3), pixels.
    """
    camera = (points - world_from_camera[:3, 3]) @ world_from_camera[:3, :3]
    pixels = camera @ np.asarray(intrinsics).T
    return pixels[..., :2] / pixels[..., 2:]


def camera_at(
    world_from_camera: np.ndarray, width: int = 640, height: int = 480, focal: float | None = None
) -> DepthCamera:
    """Return the camera at a pose (4, 4), its axis through the middle of the picture; by default the usual field of
    view.

    Args:
        width, height: pixels.
        focal: the focal length, pixels.
    """
    rotation, eye = world_from_camera[:3, :3], world_from_camera[:3, 3]
    field = DepthCamera.vertical_field if focal is None else 2 * math.atan(height / 2 / focal)
    return DepthCamera(
        tuple(eye.tolist()), tuple((eye + rotation[:, 2]).tolist()), tuple((-rotation[:, 1]).tolist()), width, height,
        field,
    )  # fmt: skip


BESIDE = "beside"  # the view in which the arm is seen at work
# Viewpoints of pictures for reports: the depth camera's own; from the robot's side, at its right, so that the hand is
# visible; above the table; and across the table.
VIEWS = {
    "robot": DepthCamera(),
    BESIDE: DepthCamera(eye=(-0.40, -1.12, 1.08), target=(0.25, 0.0, 0.14), vertical_field=math.radians(42.0)),
    "top": DepthCamera(eye=(0.45, 0.0, 1.35), target=(0.45, 0.0, 0.0), up=(1.0, 0.0, 0.0)),
    "opposite": DepthCamera(eye=(1.55, 0.0, 0.75), target=(0.36, 0.0, 0.08)),
}


def measured_depth(depth: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Add the noise of a time-of-flight or stereo sensor to a depth picture (H, W).

    The noise is Gaussian, 1.2 mm at 0.4 m, and grows with the square of the distance; one pixel in a hundred is lost
    (NaN).
    """
    sigma = 0.0012 + 0.0019 * (depth - 0.4) ** 2
    noisy = depth + sigma * rng.standard_normal(depth.shape)
    noisy[rng.random(depth.shape) < DROPPED_PIXELS] = np.nan
    return noisy


@dataclass(frozen=True)
class CameraImage:
    """One picture of the depth camera.

    Attributes:
        color: (H, W, 3) uint8 RGB.
        depth: (H, W) float64 metres along the camera's z, NaN where not measured.
        segmentation: (H, W) int, the physics engine's body id at each pixel; -1 for none.
        points: (H, W, 3) float64 world points, NaN where not measured.
        world_from_camera: (4, 4).
    """

    color: np.ndarray
    depth: np.ndarray
    segmentation: np.ndarray
    points: np.ndarray
    world_from_camera: np.ndarray
