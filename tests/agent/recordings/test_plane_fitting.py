"""Planes, clusters and normals agree with what is known of made-up clouds, and with slower ways to find them."""

import numpy as np

import agent.recordings.plane_fitting as plane_fitting
from agent.perception.clustering import clusters, normals
from agent.recordings.plane_fitting import largest_plane, thinned


def test_the_largest_plane_is_found_among_clutter():
    rng = np.random.default_rng(3)
    normal = np.array([0.2, -0.9, 0.4]) / np.linalg.norm([0.2, -0.9, 0.4])
    across = np.linalg.svd(normal[None])[2][1:]
    flat = rng.uniform(-0.5, 0.5, (3000, 2)) @ across + 0.7 * normal + rng.normal(0, 0.002, (3000, 1)) * normal
    cloud = np.vstack((flat, rng.uniform(-1, 1, (7000, 3))))
    plane, inliers = largest_plane(cloud, 0.012, np.random.default_rng(0))
    plane = plane * np.sign(plane[:3] @ normal)
    assert np.degrees(np.arccos(min(1.0, plane[:3] @ normal))) < 0.5 and abs(plane[3] + 0.7) < 0.002
    assert inliers[:3000].mean() > 0.99 and inliers[3000:].mean() < 0.05


def test_three_points_of_one_line_make_no_plane():
    line = np.column_stack((np.linspace(0, 1, 50), np.zeros(50), np.ones(50)))
    plane, _ = largest_plane(line, 0.01, np.random.default_rng(0))
    assert np.isfinite(plane).all()


def test_thinning_in_pieces_gives_the_means_of_all_points(monkeypatch):
    points = np.random.default_rng(0).uniform(-0.05, 0.05, (5000, 3))
    whole = thinned(points, 0.01)
    monkeypatch.setattr(plane_fitting, "_CHUNK", 700)
    np.testing.assert_allclose(thinned(points, 0.01), whole)
    cells = np.floor((points - points.min(axis=0) + 0.005) / 0.01).astype(int)
    means = [points[(cells == cell).all(axis=1)].mean(axis=0) for cell in np.unique(cells, axis=0)]
    np.testing.assert_allclose(np.sort(whole, axis=0), np.sort(means, axis=0))


def test_clusters_are_those_of_a_chain_of_neighbours():
    rng = np.random.default_rng(1)
    apart = [rng.uniform(-0.02, 0.02, (150, 3)) + (0.1 * k, 0, 0) for k in range(3)]
    lonely = np.array([[0.05, 0.0, 0.0], [0.15, 0.05, 0.0]])
    found = clusters(np.vstack((*apart, lonely)), 0.012)
    assert found[-2:].tolist() == [-1, -1] and found.max() == 2
    for k in range(3):
        assert set(found[150 * k : 150 * (k + 1)]) <= {found[150 * k : 150 * (k + 1)].max(), -1}


def test_normals_of_a_ball_point_outward_where_the_camera_sees_it():
    rng = np.random.default_rng(2)
    outward = rng.normal(size=(4000, 3))
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    outward = outward[outward[:, 2] > 0.2]
    found = normals(5.0 + 0.05 * outward, np.array([5.0, 5.0, 6.0]))  # far from the origin
    assert np.percentile((found * outward).sum(axis=1), 5) > 0.97
