import numpy as np
import pytest

from grounding.spec import StructureSpec
from structdiffusion.completion.estimate import ObjectEstimate, imagined_bodies
from structdiffusion.geometry import pose_from_xyz_yaw
from structdiffusion.objects.solids import circle_outline
from structdiffusion.observation import Table
from structdiffusion.postprocessing.table_regions import shift_into_place
from structdiffusion.protocol.semantic import check_structure


def can(x: float, y: float) -> ObjectEstimate:
    outline = circle_outline(0.03) + (x, y)
    points = np.column_stack((outline, np.full(len(outline), 0.1)))
    return ObjectEstimate("can", "can", points, np.array([x, y, 0.05]), outline, 0.1, 0.0, True, False)


ROW = [can(0.3, y) for y in (-0.1, 0.0, 0.1)]
STAY = np.tile(np.eye(4), (3, 1, 1))


def shifted(shift: np.ndarray) -> np.ndarray:
    return np.array([pose_from_xyz_yaw(*shift, 0.0, 0.0)] * 3)


@pytest.mark.parametrize("x", ["left", "center", "right"])
@pytest.mark.parametrize("y", ["top", "middle", "bottom"])
def test_every_third_is_reached(x, y):
    spec = StructureSpec("line", x_position=x, y_position=y)
    motions = shifted(shift_into_place(ROW, STAY, spec, Table()))
    checks = check_structure(imagined_bodies(ROW, motions), spec, Table())
    assert all(check.passed for check in checks), checks


def test_what_hangs_over_the_edge_comes_back_by_no_more_than_it_must():
    over = shifted(np.array([0.5, 0.0]))
    shift = shift_into_place(ROW, over, StructureSpec("line"), Table())
    reach = max(body.footprint[:, 0].max() for body in imagined_bodies(ROW, over))
    assert reach + shift[0] == pytest.approx(0.72 - 0.008)
    assert shift[1] == 0.0


def test_what_is_in_place_stays():
    np.testing.assert_array_equal(shift_into_place(ROW, STAY, StructureSpec("line"), Table()), 0.0)


def test_an_open_shape_or_a_structure_too_large_is_not_moved():
    far = shifted(np.array([2.0, 2.0]))
    np.testing.assert_array_equal(shift_into_place(ROW, far, StructureSpec(x_position="left"), Table()), 0.0)
    narrow = Table(y_min=-0.05, y_max=0.05)
    assert shift_into_place(ROW, STAY, StructureSpec("line", x_position="left"), narrow)[1] == 0.0
