import numpy as np
import pytest

from grounding.spec import StructureSpec
from structdiffusion.completion.estimate import ObjectEstimate
from structdiffusion.geometry import pose_from_xyz_yaw, yaw_of
from structdiffusion.objects.solids import circle_outline
from structdiffusion.observation import Arrangement, ObjectCloud, Scene
from structdiffusion.postprocessing.anchoring import anchor, those_as_asked
from structdiffusion.structures.structure import LayoutError

MOTIONS = np.array([[pose_from_xyz_yaw(0.1 * k, 0.2, 0.0, 0.3 + k) for k in range(3)]] * 2)
FRAMES = np.array([pose_from_xyz_yaw(0.4, 0.1, 0.0, 0.5)] * 2)


def can(x, y):
    outline = circle_outline(0.03) + (x, y)
    points = np.column_stack((outline, np.full(len(outline), 0.1)))
    return ObjectEstimate("can", "can", points, np.array([x, y, 0.05]), outline, 0.1, 0.0, True, False)


ROW = [can(0.3, y) for y in (-0.1, 0.0, 0.1)]


def places(motions):
    return np.array([(motion @ np.append(thing.mean, 1.0))[:3] for motion, thing in zip(motions, ROW)])


@pytest.mark.parametrize("rotation", [None, "north"])
def test_structures_move_as_a_whole_until_the_fixed_object_is_where_it_stands(rotation):
    moved, frames = anchor(ROW, MOTIONS, FRAMES, StructureSpec("line", rotation=rotation), (1,))
    np.testing.assert_array_equal(moved[:, 1], np.tile(np.eye(4), (2, 1, 1)))
    for k in range(2):
        before, after = places(MOTIONS[k]), places(moved[k])
        apart = [np.linalg.norm(each[0] - each[2]) for each in (before, after)]
        assert apart[0] == pytest.approx(apart[1]) and after[1] == pytest.approx(ROW[1].mean)
        in_frame = [
            np.linalg.inv(frame) @ np.append(place, 1.0)
            for frame, place in ((FRAMES[k], before[0]), (frames[k], after[0]))
        ]
        assert in_frame[0] == pytest.approx(in_frame[1])
    turns = [yaw_of(moved[k, 0]) - yaw_of(MOTIONS[k, 0]) for k in range(2)]
    assert turns == pytest.approx([0.0, 0.0 if rotation else -1.3])  # else the fixed object keeps its own rotation


def test_without_a_fixed_object_nothing_changes():
    moved, frames = anchor(ROW, MOTIONS, FRAMES, StructureSpec("line"), ())
    assert moved is MOTIONS and frames is FRAMES


def test_only_what_is_as_asked_is_left_around_what_stays():
    good, bad = (Arrangement(MOTIONS[0], {"checks": share, "total": share}) for share in (0.9, 0.4))
    cloud = ObjectCloud("plate 1", "plate", np.zeros((1, 3), np.float32))
    fixed, free = Scene((cloud,), fixed=(0,)), Scene((cloud,))
    assert those_as_asked([bad, good], free) == [bad, good] and those_as_asked([bad, good], fixed) == [good]
    with pytest.raises(LayoutError, match="no grasp fits the plate 1"):
        those_as_asked([bad], fixed)
