"""Describe what stands around the objects: the table, the camera and the arm."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from agent.arm.arm_model import WORLD_FROM_BASE
from agent.arm.state import ArmState
from structdiffusion.observation import Table
from structdiffusion.simulation.depth_camera import DepthCamera


@dataclass(frozen=True)
class Workcell:
    """A table, the camera that looks at it, and the arm beside it.

    Attributes:
        table: the table top.
        ground: the whole supporting surface, if it is larger than the table top.
        camera: what looks at the table.
        arm: how the arm stands, by default folded.
        world_from_base: (4, 4) pose of its base, upright.
    """

    table: Table = Table()
    ground: Table | None = None
    camera: DepthCamera = DepthCamera()
    arm: ArmState | None = None
    world_from_base: np.ndarray = field(default_factory=WORLD_FROM_BASE.copy)
