"""Which arrangements a person can tell apart."""

import numpy as np
import pytest

from agent.chat.other_arrangement import VISIBLE, differs, other_ranks, places_of
from structdiffusion.geometry import pose_from_xyz_yaw
from structdiffusion.observation import Arrangement, ObjectCloud, Scene, Table

MIDDLE = np.array([0.5, 0.1, 0.0])


@pytest.fixture
def scene():
    """A round vessel of which the camera saw the rim and one side, so that the mean of its points
    lies off its middle.
    """
    angles = np.linspace(0, 2 * np.pi, 200, endpoint=False)
    rim = np.stack((0.04 * np.cos(angles), 0.04 * np.sin(angles), np.full(200, 0.1)), axis=1)
    side = np.concatenate([rim[:100] * (1, 1, share) for share in np.linspace(0, 1, 30)])
    points = (np.concatenate((rim, side)) + MIDDLE).astype(np.float32)
    return Scene((ObjectCloud("cup 1", "cup", points),), Table())


def moved(x: float = 0.0, turn: float = 0.0, score: float = 1.0) -> Arrangement:
    """The vessel turned about its middle and moved along x."""
    back = np.eye(4)
    back[:3, 3] = -MIDDLE
    motion = pose_from_xyz_yaw(MIDDLE[0] + x, MIDDLE[1], 0.0, turn) @ back
    return Arrangement(motion[None], {"total": score})


def test_a_turn_on_the_spot_is_not_seen_and_a_step_is(scene):
    here, turned, near, far = places_of([moved(), moved(turn=np.pi), moved(0.9 * VISIBLE), moved(1.1 * VISIBLE)], scene)
    assert not differs(turned, [here]) and not differs(near, [here]) and differs(far, [here])
    assert not differs(far, [here, far]) and differs(here, [])
    assert differs(here, [{"cup 2": here["cup 1"]}])  # other objects


def test_only_what_is_worth_a_try_is_offered(scene):
    arrangements = [moved(), moved(0.05), moved(0.1, score=0.0), moved(0.15)]
    assert other_ranks(arrangements, scene, places_of(arrangements[:1], scene)) == [2, 4]
    assert other_ranks(arrangements, scene, []) == [1, 2, 4]
