"""What the closing fingers meet of an object, from its widths at the levels of the hand."""

import numpy as np
import pytest

from agent.arm.arm_model import DEFAULT_MODEL, arm_model

JACO = arm_model(DEFAULT_MODEL).hand
END = 0.041  # m below the end effector that tips end which close to 1 rad


@pytest.mark.parametrize("shoulder", (0.0, 0.006))
def test_tips_that_end_on_a_shoulder_press_a_bottle_out_of_the_hand(shoulder):
    """A neck of 15 mm widens to a body of 44 mm; the tips end on the slope, or where the body begins to be straight."""
    slope = 1.2  # of the width
    widths = np.clip(0.015 + slope * (JACO.levels - (END + shoulder - 0.029 / slope)), 0.015, 0.044)
    _, (incline,) = JACO.contacts(widths[None])
    assert incline > 0.25


def test_tips_that_end_well_below_a_shoulder_hold_a_bottle():
    widths = np.where(JACO.levels > 0.01, 0.044, 0.015)
    _, (incline,) = JACO.contacts(widths[None])
    assert incline < 0.1
