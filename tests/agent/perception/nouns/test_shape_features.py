"""The numbers of a shape do not depend on where the object stands, and tell hollow from solid."""

import numpy as np
import pytest

from agent.evaluation.nouns.object_views import Surface, object_view
from agent.perception.nouns.shape_features import COUNT, shape_features
from agent.perception.nouns.shape_head import shape_head
from agent.synthetic_tables.shapes import PARTS
from structdiffusion.geometry import pose_from_xyz_yaw, transform_points

EYE = np.array([-0.5, 0.1, 0.6])


def cylinder(radius: float, height: float, hollow: bool) -> np.ndarray:
    """The points (P, 3) of a cylinder at the origin that a camera at `EYE` sees: near side, and top or inside."""
    angles, rise = np.meshgrid(np.linspace(np.pi / 2, 3 * np.pi / 2, 60), np.linspace(0.005, height, 40))
    side = np.stack((radius * np.cos(angles), radius * np.sin(angles), rise), axis=-1).reshape(-1, 3)
    angles, share = np.meshgrid(np.linspace(0.0, 2 * np.pi, 60), np.linspace(0.05, 0.95, 20))
    disc = np.stack((radius * share * np.cos(angles), radius * share * np.sin(angles)), axis=-1).reshape(-1, 2)
    return np.concatenate((side, np.column_stack((disc, np.full(len(disc), 0.02 if hollow else height)))))


def test_place_and_heading_do_not_matter():
    points, eye = cylinder(0.04, 0.1, hollow=True), EYE[None]
    motion = pose_from_xyz_yaw(0.4, -0.3, 0.0, 2.0)
    moved = shape_features(transform_points(motion, points), transform_points(motion, eye)[0])
    assert shape_features(points, EYE).shape == (COUNT,) and np.allclose(moved, shape_features(points, EYE), atol=0.02)
    raised = shape_features(points + (0.0, 0.0, 0.2), EYE + (0.0, 0.0, 0.2), bottom=0.2)
    assert np.allclose(raised, shape_features(points, EYE), atol=0.02)


def test_the_middle_of_a_hollow_object_is_low():
    hollow, solid = (shape_features(cylinder(0.04, 0.1, each), EYE)[10:12] for each in (True, False))
    assert hollow.max() < 0.4 < 0.9 < solid.min()


@pytest.mark.parametrize("count", [1, 2, 5])
def test_few_points_are_no_error(count):
    points = np.random.default_rng(0).uniform(0.0, 0.02, (count, 3))
    assert np.isfinite(shape_features(points, EYE)).all()


@pytest.mark.parametrize("kind", ["bowl", "plate", "tin"])
def test_clear_shapes_are_told_apart(kind):
    rng = np.random.default_rng(11)
    draws = {"bowl": 5, "plate": 8, "tin": 3}
    shares = []
    while len(shares) < 5:
        shape = PARTS["development"].any[draws[kind]](rng)
        assert shape.kind == kind
        if (view := object_view([Surface(shape.mesh)], rng, picture=False)) is not None:
            shares.append(shape_head().shares(shape_features(view.points, view.eye)))
    told = [max(each, key=each.__getitem__) for each in shares]
    assert told.count("can" if kind == "tin" else kind) >= 3  # something hides a part of every fourth
