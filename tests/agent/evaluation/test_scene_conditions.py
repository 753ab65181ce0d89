import pytest

from agent.errors import UsageError
from agent.evaluation.scene_conditions import conditions_of, parsed_count, parsed_table
from structdiffusion.benchmark.scenes import Conditions, camera_beside
from structdiffusion.observation import Table


def test_nothing_said_is_as_in_training():
    assert conditions_of(None, None, "robot") == Conditions()


def test_what_is_said_holds():
    conditions = conditions_of("8-10", "0.70x1.20", "left")
    assert conditions.objects == (8, 10) and parsed_count(" 9 ") == (9, 9)
    assert conditions.camera == camera_beside("left", conditions.table)
    assert conditions.camera.eye[1] > conditions.table.y_max


def test_tables_lie_about_the_usual_middle():
    assert vars(parsed_table("0.4 x 0.6")) == pytest.approx({"x_min": 0.25, "x_max": 0.65, "y_min": -0.3, "y_max": 0.3})
    assert vars(parsed_table("0.54x0.90")) == pytest.approx(vars(Table()))


@pytest.mark.parametrize("text", ["", "many", "10-8", "1-4", "8-13", "8-10-12", "-3", "8.5"])
def test_what_is_no_number_of_objects(text):
    with pytest.raises(UsageError, match="--objects-per-scene cannot be .*a number from 2 to 12.*such as 8-10"):
        parsed_count(text)


@pytest.mark.parametrize("text", ["", "0.4", "0.4x", "0.4x0.1", "40x60", "0.4x0.6x0.1", "-0.4x0.6", "nanx0.6"])
def test_what_is_no_table(text):
    with pytest.raises(UsageError, match="--table cannot be .*each from 0.2 to 2, such as 0.40x0.60"):
        parsed_table(text)


def test_what_is_no_side():
    with pytest.raises(UsageError, match="--camera cannot be 'behind'; legal values: robot, opposite, left, right"):
        conditions_of(None, None, "behind")
