"""Describe what stands around the objects: the table, the camera and the arm."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from agent.arm.arm_model import DEFAULT_MODEL, WORLD_FROM_BASE, ArmModel, arm_model
from agent.arm.kinematics import Kinematics
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
        world_from_base: (4, 4) pose of the Jaco's base, upright.
        model: another arm than the Jaco, which stands where it usually does, folded.
    """

    table: Table = Table()
    ground: Table | None = None
    camera: DepthCamera = DepthCamera()
    arm: ArmState | None = None
    world_from_base: np.ndarray = field(default_factory=WORLD_FROM_BASE.copy)
    model: ArmModel | None = None

    @property
    def kinematics(self) -> Kinematics:
        """Return the arm where it stands."""
        if self.model is not None:
            return Kinematics(self.model, self.model.mounted)
        model = arm_model(DEFAULT_MODEL if self.arm is None else self.arm.model)
        return Kinematics(model, self.world_from_base)
