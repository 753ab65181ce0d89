"""Clouds that a stranger brings: whatever holds good numbers is taken, and all else is refused in one sentence."""

import re

import numpy as np
import pytest
import structagent
import torch
from structagent import Scene, StructagentError

from tests.agent.public.conftest import box_cloud

FAST = {"model": "geometric", "count": 4}


def goals(clouds, **options) -> np.ndarray:
    return structagent.propose(clouds, {"shape": "line"}, **FAST, **options).best.goal_from_initial


def refused(clouds, *parts: str, exit_code: int = 6, **options) -> str:
    """The sentence with which clouds are refused; it holds all the parts and no trace of the depths."""
    with pytest.raises(StructagentError) as caught:
        structagent.propose(clouds, {"shape": "line"}, **FAST, **options)
    message = str(caught.value)
    assert all(part in message for part in parts), message
    assert "\n" not in message and len(message) < 600
    assert caught.value.exit_code == exit_code and isinstance(caught.value, ValueError)
    assert caught.value.__cause__ is None
    return message


@pytest.mark.parametrize(
    "given",
    [
        lambda clouds: [cloud.astype(np.float32) for cloud in clouds],
        lambda clouds: [np.asfortranarray(cloud) for cloud in clouds],
        lambda clouds: tuple(clouds),
        lambda clouds: np.stack(clouds),
        lambda clouds: [cloud.tolist() for cloud in clouds],
        lambda clouds: [torch.from_numpy(cloud) for cloud in clouds],
        lambda clouds: torch.tensor(np.stack(clouds), requires_grad=True),
        lambda clouds: [clouds[0].tolist(), torch.from_numpy(clouds[1]), *map(np.asfortranarray, clouds[2:])],
        lambda clouds: [np.repeat(cloud, 2, axis=0)[::2] for cloud in clouds],
        lambda clouds: [cloud.astype(">f8") for cloud in clouds],
        lambda clouds: np.array([*clouds, None], dtype=object)[:4],
    ],
    ids="float32 fortran tuple stacked lists tensors gradient mixed strided big-endian objects".split(),
)
def test_every_container_and_dtype_gives_the_same_goals(clouds, given):
    assert np.allclose(goals(given(clouds)), goals(clouds), atol=1e-4)


@pytest.mark.parametrize("dtype", [np.float16, torch.bfloat16], ids=str)
def test_short_floats_are_taken(clouds, dtype):
    short = [torch.from_numpy(c).to(dtype) if isinstance(dtype, torch.dtype) else c.astype(dtype) for c in clouds]
    assert goals(short).shape == (4, 4, 4)


def test_read_only_arrays_are_taken_and_nothing_of_the_callers_is_changed(clouds):
    before = [cloud.copy() for cloud in clouds]
    for cloud in clouds:
        cloud.flags.writeable = False
    goals(clouds)
    assert all(np.array_equal(cloud, old) for cloud, old in zip(clouds, before, strict=True))


def test_what_is_given_can_be_changed_after_without_changing_the_scene(clouds):
    scene = Scene.from_clouds([cloud.astype(np.float32) for cloud in clouds])
    kept = scene.clouds[0].copy()
    clouds[0][:] = np.nan
    assert np.array_equal(scene.clouds[0], kept)
    with pytest.raises(ValueError, match="read-only"):
        scene.clouds[0][0, 0] = 1.0


def test_integers_in_millimetres_are_refused_with_the_factor(clouds):
    whole = [(1000 * cloud).round().astype(np.int16) for cloud in clouds]
    refused(whole, "clouds[0] is ", "m across", "legal: 0.002 to 0.5 m", "are these millimetres? Divide them by 1000")


def test_units_are_guessed_from_the_size(clouds):
    refused([1000.0 * cloud for cloud in clouds], "are these millimetres? Divide them by 1000")
    refused([100.0 * cloud for cloud in clouds], "are these centimetres? Divide them by 100")
    refused([cloud / 1000.0 for cloud in clouds], "hardly more than one point")
    assert "are these" not in refused([1e30 * cloud for cloud in clouds], "clouds[0]", "across")
    refused([clouds[0], clouds[1], 1000.0 * clouds[2], clouds[3]], "clouds[2]")


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_one_coordinate_that_is_not_finite_is_named(clouds, value):
    clouds[2][17, 1] = value
    refused(clouds, "clouds[2]", "point 17", str(value), "np.isfinite(clouds[2])")


@pytest.mark.parametrize(
    ("bad", "parts"),
    [
        (np.zeros((600, 2)), ("clouds[1] has the shape (600, 2)", "legal: an array (P, 3)")),
        (np.zeros((600, 6)), ("clouds[1] has the shape (600, 6)", "colours go into colors=")),
        (np.zeros((3, 600)), ("clouds[1] has the shape (3, 600)",)),
        (np.zeros(600), ("clouds[1] has the shape (600,)",)),
        (np.zeros((0, 3)), ("clouds[1] has 0 points; legal: 20 or more",)),
        ([], ("clouds[1] has the shape (0,)",)),
        (np.ones((19, 3)), ("clouds[1] has 19 points",)),
        (np.ones((600, 3)), ("clouds[1] is 0 m across, hardly more than one point",)),
        (np.zeros((600, 3), bool), ("clouds[1] has the dtype bool",)),
        (np.zeros((600, 3), complex), ("clouds[1] has the dtype complex128",)),
        (np.full((600, 3), "0.1"), ("clouds[1] has the dtype <U3",)),
        ([[0.1, 0.2, 0.3], [0.1, 0.2]] * 20, ("clouds[1] is not an array of numbers",)),
        (None, ("clouds[1] has the dtype object",)),
        ("cup.ply", ("clouds[1] has the dtype <U7",)),
        ([[None, 0.0, 0.0]] * 30, ("clouds[1] has the dtype object",)),
        ([[10**400, 0, 0]] * 30, ("clouds[1]",)),
        (np.full((300, 3), 127, np.int8) - np.arange(3, dtype=np.int8), ("clouds[1]",)),
        (
            np.stack([np.linspace(0.3, 0.4, 90), np.linspace(0, 0.1, 90), np.zeros(90)], 1),
            ("clouds[1] is 0.00 mm wide",),
        ),
        (np.random.default_rng(0).uniform(0, 0.1, (90, 3)) * (1, 0, 1) + (0.4, 0, 0), ("wide seen from above",)),
        ({"x": 1}, ("clouds[1] has the dtype object",)),
    ],
)
def test_what_is_no_cloud_is_named(clouds, bad, parts):
    clouds[1] = bad
    refused(clouds, *parts)


@pytest.mark.parametrize(
    ("bad", "parts"),
    [
        ([], ("clouds is empty",)),
        (np.zeros((0, 5, 3)), ("clouds is empty",)),
        (None, ("clouds cannot be None; legal: a list of (P, 3) arrays",)),
        (3, ("clouds cannot be 3",)),
        ("clouds.npz", ("clouds cannot be 'clouds.npz'",)),
        ({"cup": np.zeros((30, 3))}, ("clouds cannot be {'cup'",)),
        (np.zeros((30, 3)), ("clouds is an array of shape (30, 3); legal: a list",)),
        (np.zeros((2, 2, 30, 3)), ("clouds is an array of shape (2, 2, 30, 3)",)),
        (torch.zeros(30, 3), ("clouds is an array of shape (30, 3)",)),
        (np.float64(1.0), ("clouds",)),
        (np.zeros((41, 30, 3)), ("clouds has 41 objects; legal: 2 to 40",)),
    ],
)
def test_what_is_no_list_of_clouds_is_refused(bad, parts):
    refused(bad, *parts)


def test_an_endless_iterator_is_refused_at_once(clouds):
    from itertools import repeat

    refused(repeat(clouds[0]), "clouds cannot be repeat(")
    refused((cloud for cloud in clouds), "clouds cannot be <generator")


def test_clouds_in_another_frame_are_refused_with_the_table(clouds):
    aside = [cloud + (0.0, 5.0, 0.0) for cloud in clouds]
    refused(aside, "clouds[0] lies about x 0.2872, y 4.7", "m off the table", "x 0.18 to 0.72")
    high = [cloud + (0.0, 0.0, 0.9) for cloud in clouds]
    refused(high, "the lowest point of clouds[0] is at z 0.8", "z = 0 on the table top")
    refused([cloud - (0.0, 0.0, 0.2) for cloud in clouds], "the lowest point of clouds[0] is at z -0.2")
    assert goals(aside, table=(0.18, 0.72, 4.55, 5.45)).shape == (4, 4, 4)


def test_a_million_points_take_no_longer_than_thousands(clouds):
    import time

    clouds[0] = box_cloud(0.3, -0.3, points=1_000_000)
    started = time.process_time()
    goals(clouds)
    assert time.process_time() - started < 30
    assert len(Scene.from_clouds(clouds).clouds[0]) == 1_000_000


@pytest.mark.parametrize(
    ("options", "parts", "exit_code"),
    [
        ({"names": ["cup"]}, ("names has 1 entries and clouds 4",), 2),
        ({"names": "cup"}, ("names cannot be 'cup'",), 2),
        ({"names": ["cup", "cup", 3, None]}, ("names[2] cannot be 3",), 2),
        ({"names": ["cup", "c\nup", "cup", "cup"]}, ("names[1] must be one printable line",), 2),
        ({"names": ["x" * 81, "a", "b", "c"]}, ("names[0] must be one printable line of at most 80",), 2),
        ({"colors": [(255, 0, 0)]}, ("colors has 1 entries and clouds 4",), 6),
        ({"colors": "red"}, ("colors cannot be 'red'",), 6),
        ({"colors": [(256, 0, 0), None, None, None]}, ("colors[0]", "values of 0 to 256"), 6),
        ({"colors": [None, (2.0, 0.0, 0.0), None, None]}, ("colors[1]", "floats of 0 to 1"), 6),
        ({"colors": [np.zeros((5, 3)), None, None, None]}, ("colors[0] has the shape (5, 3)", "600 points"), 6),
        ({"colors": [(np.nan, 0, 0), None, None, None]}, ("colors[0]",), 6),
        ({"bottoms": [0.0]}, ("bottoms has the shape (1,)",), 6),
        ({"bottoms": [0, 0, -1, 0]}, ("bottoms[2] is -1",), 6),
        ({"bottoms": [0, 0.3, 0, 0]}, ("bottoms[1] is 0.3 m, and the lowest point of clouds[1] is below",), 6),
        ({"bottoms": [0, np.nan, 0, 0]}, ("bottoms[1] is nan",), 6),
        ({"table": (0, 1)}, ("table has the shape (2,)", "(x_min, x_max, y_min, y_max)"), 2),
        ({"table": (0.7, 0.2, -0.5, 0.5)}, ("table cannot be (0.7, 0.2, -0.5, 0.5)",), 2),
        ({"table": (180, 720, -450, 450)}, ("table cannot be", "sides of 0.1 to 5 m"), 2),
        ({"table": (0, np.inf, 0, 1)}, ("table cannot be",), 2),
        ({"table": "desk"}, ("table has the dtype <U4",), 6),
    ],
)
def test_what_goes_with_clouds_is_checked_too(clouds, options, parts, exit_code):
    refused(clouds, *parts, exit_code=exit_code, **options)


def test_names_are_numbered_where_several_are_alike(clouds):
    assert Scene.from_clouds(clouds, names=["cup", "mug", "cup", None]).names == ("cup 1", "mug", "cup 2", "object 4")
    assert Scene.from_clouds(clouds, names=["cup", "cup 1", "cup", "object 9"]).names[:3] == ("cup 2", "cup 1", "cup 3")
    assert Scene.from_clouds(clouds).names == ("object 1", "object 2", "object 3", "object 4")


@pytest.mark.parametrize("scale", [1, 255])
def test_colours_choose_objects(clouds, scale):
    red, blue = (0.75, 0.1, 0.1), (0.1, 0.2, 0.7)
    shades = [
        np.array(c) * scale if scale == 1 else (np.array(c) * scale).astype(np.uint8) for c in (red, blue, red, blue)
    ]
    whole = [np.tile(shades[0], (600, 1)), *shades[1:]]
    found = structagent.propose(clouds, "put the red things in a line", colors=whole, **FAST)
    assert found.moved == (0, 2)


def test_every_refusal_lists_what_is_legal(clouds):
    """No sentence ends without saying what would have been right."""
    for bad in (None, [], np.zeros((30, 3)), [np.zeros((600, 2))] * 3, [np.ones((600, 3))] * 3):
        assert re.search(r"legal: |leave them out", refused(bad))
