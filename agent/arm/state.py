"""Define the recorded state of a Jaco."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class ArmState:
    """The joint state of the arm.

    Attributes:
        model: "j2s7s300", "j2n6s300" or "j2s6s300", by the number of joints and the prefix.
        joints: "joint_1", ..., "joint_finger_tip_3" -> radians, not wrapped.
        prefix: the prefix of those names in the recording, such as "j2s7s300_".
    """

    model: str
    joints: Mapping[str, float]
    prefix: str = ""
