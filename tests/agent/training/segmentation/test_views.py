"""Training tables: objects stand where they should, none is of the test part, and views come with their truth."""

import numpy as np
import pytest

from agent.synthetic_tables.shapes import PARTS
from agent.training.segmentation.batches import varied
from agent.training.segmentation.objects import TRAINING
from agent.training.segmentation.scenes import training_camera, training_scene
from agent.training.segmentation.views import HEIGHT, WIDTH, draw_views
from structdiffusion.geometry import transform_points


@pytest.fixture(scope="module")
def views():
    return [view for seed in range(3) for view in draw_views(np.random.default_rng(seed), 2)]


def test_no_object_of_the_test_part_is_drawn():
    test, own = PARTS["test"], PARTS["development"]
    kept_apart = {*test.any, *test.boxes, *test.hollow, *test.small} - {*own.any}
    assert not kept_apart & {*TRAINING.any, *TRAINING.boxes, *TRAINING.hollow, *TRAINING.small, *TRAINING.tall}


@pytest.mark.parametrize("draw", sorted(set(TRAINING.any) | set(TRAINING.boxes), key=lambda draw: draw.__name__))
def test_every_object_stands_on_the_table_about_its_axis(draw):
    shape = draw(np.random.default_rng(0))
    low, high = shape.mesh.bounds
    assert low[2] == pytest.approx(0.0, abs=1e-6) and 0.0 < high[2] < 0.4
    assert (low[:2] < 0).all() and (high[:2] > 0).all() and (high - low).max() < 0.5


def test_objects_on_others_stand_higher_and_parts_are_numbered():
    placed, parts = training_scene(np.random.default_rng(4))
    assert [part.number for part in parts if part.number > 0] == list(range(1, len(placed) + 1))
    for one in placed:
        assert one.pose[2, 3] >= (0.0 if one.on is None else placed[one.on].pose[2, 3])


def test_an_empty_table_is_looked_at_in_its_middle():
    camera = training_camera([], np.random.default_rng(0))
    assert np.isfinite(camera).all()
    away = camera[:2, 3] - camera[2, 3] / camera[2, 2] * camera[:2, 2]  # where the line of sight meets the table
    assert np.abs(away).max() < 0.3


def test_a_view_shows_its_table_at_height_zero_and_objects_above(views):
    assert len(views) >= 3
    for view in views:
        assert view.depth.shape == view.truth.shape == (HEIGHT, WIDTH) and view.truth.max() >= 2
        points = points_of(view)
        heights = transform_points(view.level_from_camera, points)[:, 2]
        truth = view.truth.ravel()[view.depth.ravel() > 0]
        assert np.median(np.abs(heights[truth == 1])) < 0.01
        assert np.median(heights[truth > 1]) > 0.005


def points_of(view):
    depth = view.depth * 1e-4
    columns = (np.arange(WIDTH) + 0.5 - WIDTH / 2) / view.focal
    rows = (np.arange(HEIGHT) + 0.5 - HEIGHT / 2) / view.focal
    points = np.stack((*np.meshgrid(columns, rows), np.ones(depth.shape)), axis=-1) * depth[..., None]
    return points[depth > 0].astype(np.float64)


def test_a_seed_gives_one_view():
    first, again = (draw_views(np.random.default_rng(1), 1)[0] for _ in range(2))
    np.testing.assert_array_equal(first.depth, again.depth)
    np.testing.assert_array_equal(first.color, again.color)


def test_variation_keeps_heights_and_objects(views):
    """Whatever is turned, scaled and cut, the table stays at height zero and objects keep their pixels."""
    rng = np.random.default_rng(0)
    for view in views:
        for _ in range(4):
            one = varied(view, rng)
            assert np.isfinite(one.maps).all() and not one.truth[~one.known].any()
            table = one.level[one.truth == 1]
            assert len(table) == 0 or np.median(np.abs(table[:, 2])) < 0.02
            assert set(np.unique(one.truth)) <= set(np.unique(view.truth)) | {0}
            assert not one.level[~one.known].any() and not one.maps[:, ~one.known].any()
