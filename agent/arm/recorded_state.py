"""Convert the recorded state of an arm, joint names and unwrapped angles, to a configuration of its model."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from agent.arm.arm_model import arm_model
from agent.arm.jaco_hand import FINGER_CLOSED, FINGER_OPEN, FINGERS
from agent.arm.simulated_arm import SimulatedArm
from agent.arm.state import ArmState
from agent.errors import BadInput

BEYOND = math.radians(2.0)  # what an encoder may report beyond a limit: the joint then stands at its limit


@dataclass(frozen=True)
class Standing:
    """The configuration of a recorded arm, in the joints of its model.

    Attributes:
        joints: (n,) rad, within the model's limits.
        wound: (n,) rad, the whole turns that were subtracted: a recording counts how far a joint has wound.
        fingers: (3,) rad.
        notes: what was assumed or corrected, a sentence each.
    """

    joints: np.ndarray
    wound: np.ndarray
    fingers: np.ndarray
    notes: tuple[str, ...]


def standing(state: ArmState) -> Standing:
    """Return the configuration of a recorded arm.

    Raises:
        BadInput: for an unknown model, a joint of the arm that is missing, or an angle beyond its limits.
    """
    model = arm_model(state.model)
    notes: list[str] = []
    joints, wound = np.empty(len(model.joints)), np.zeros(len(model.joints))
    for k, name in enumerate(model.joints):
        angle = state.joints.get(name, math.nan)
        if not math.isfinite(angle):
            raise BadInput(
                f"the recording does not say how {name} of its {model.name} stood; needed: {', '.join(model.joints)}"
            )
        lower, upper = float(model.lower[k]), float(model.upper[k])
        # The nearest whole turns that bring it within the limits, or as near to their middle as can be.
        least = 0.0 if lower <= angle <= upper else round((angle - (lower + upper) / 2) / (2 * math.pi))
        wound[k] = 2 * math.pi * least
        joints[k] = _within(name, angle - wound[k], lower, upper, notes)
    untold = [name for name in FINGERS if not math.isfinite(state.joints.get(name, math.nan))]
    if untold:
        notes.append(f"the recording does not have {', '.join(untold)}: taken to be open")
    fingers = [
        FINGER_OPEN if name in untold else _within(name, state.joints[name], 0.0, FINGER_CLOSED, notes)
        for name in FINGERS
    ]
    return Standing(joints, wound, np.array(fingers), tuple(notes))


def _within(name: str, angle: float, lower: float, upper: float, notes: list[str]) -> float:
    if lower <= angle <= upper:
        return angle
    if lower - BEYOND <= angle <= upper + BEYOND:
        mended = min(max(angle, lower), upper)
        notes.append(f"{name} was recorded at {angle:.4f} rad, beyond its limit: taken to stand at {mended:.4f} rad")
        return mended
    raise BadInput(f"the recording's {name} stands at {angle:.4f} rad; legal: {lower:.4f} to {upper:.4f} rad")


def stand(arm: SimulatedArm, state: ArmState) -> tuple[str, ...]:
    """Put the arm into its recorded configuration, at rest; return what was assumed or corrected, a sentence each.

    Raises:
        BadInput: as `standing`.
    """
    found = standing(state)
    arm.teleport(found.joints, found.fingers.tolist())
    arm.wound = found.wound
    return found.notes
