"""Define the data taken from a recording, with the frame, unit and shape of every input.

| input | dtype, shape | frame, unit | range |
|---|---|---|---|
| `DepthFrame.points` | float32 (H, W, 3) | camera: z forward, x right, y down; m | NaN where nothing was measured |
| `DepthFrame.color` | uint8 (H, W, 3) | RGB | 0 to 255; `None` if the camera has no colour |
| `DepthFrame.intrinsics` | float64 (3, 3) | pixels | `None` if they are unknown |
| `ArmState.joints` | float | rad, not wrapped | a name without the arm's prefix -> angle |
| `Recording.base_from_camera` | float64 (4, 4) | the arm's `link_base`: x left, y back, z up; m | or `None` |
| `Recording.world_from_camera` | float64 (4, 4) | `world` of the project; m | only if given by the user |

An unorganised cloud is one row: H = 1. `link_base` is the frame of the manufacturer's description: its origin is the
    centre of
the base's bottom, and the usual workspace lies on its -y side.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from agent.arm.state import ArmState


@dataclass(frozen=True)
class DepthFrame:
    """The measurement of a depth camera at one moment, or several fused ones while it stood still.

    Attributes:
        points: (H, W, 3) float32, the camera's optical frame, metres; NaN where nothing was measured.
        color: (H, W, 3) uint8 RGB, or `None`.
        frame_id: the name of the optical frame; "" if it is unknown.
        seconds: since the recording's first message.
        intrinsics: (3, 3) of the pinhole camera, pixels, or `None`.
        looks: how many measurements were fused.
    """

    points: np.ndarray
    color: np.ndarray | None = None
    frame_id: str = ""
    seconds: float = 0.0
    intrinsics: np.ndarray | None = None
    looks: int = 1

    @property
    def organised(self) -> bool:
        """Return whether neighbours in the array are neighbours in the picture."""
        return self.points.shape[0] > 1


@dataclass(frozen=True)
class Recording:
    """One moment of a recorded session in any format.

    Attributes:
        path: the file or folder.
        frame: the measurement of the camera.
        base_from_camera: (4, 4), or `None`.
        world_from_camera: (4, 4) as given by hand, or `None`.
        arm: how the arm stood, or `None`.
        used: purpose -> topic, such as "depth" -> "/camera/depth/image_raw".
        notes: assumptions, omissions and repairs, a sentence each for the report.
        other_arm: what was recorded in place of an arm that is planned for, one of the notes; "" if nothing was.
    """

    path: Path
    frame: DepthFrame
    base_from_camera: np.ndarray | None = None
    world_from_camera: np.ndarray | None = None
    arm: ArmState | None = None
    used: Mapping[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    other_arm: str = ""


@dataclass(frozen=True, eq=False)
class ReadingOf:
    """Options for reading a recording.

    Attributes:
        at: seconds after the first message; by default the first moment at which everything is there.
        topics: "points", "depth", "depth_info", "color", "joints" -> the topic to use for it.
        looks: how many frames may be fused while the camera stands still.
        world_from_camera: (4, 4) the pose of the camera's optical frame, given by hand; it overrides tf.
        depth_unit: metres per stored unit of depths or coordinates; by default what fits the data.
    """

    at: float | None = None
    topics: Mapping[str, str] = field(default_factory=dict)
    looks: int = 5
    world_from_camera: np.ndarray | None = None
    depth_unit: float | None = None


@dataclass(frozen=True, eq=False)
class RecordedOptions:
    """Options for using a recorded scene.

    Attributes:
        reading: how it is read.
        nouns: "object 3" -> what people call it, such as "mug".
    """

    reading: ReadingOf = ReadingOf()
    nouns: Mapping[str, str] = field(default_factory=dict)

    @property
    def given(self) -> bool:
        """Return whether any option requires a recording."""
        reading = self.reading
        values = (reading.at, reading.world_from_camera, reading.depth_unit)
        return bool(reading.topics or self.nouns or any(value is not None for value in values))
