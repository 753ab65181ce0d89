"""Convex parts: quality, the cache, and PyBullet's random bodies."""

import numpy as np
import pytest
import trimesh

from structdiffusion.objects import decomposition
from structdiffusion.objects.libraries import load_objects
from structdiffusion.objects.model import ObjectError
from structdiffusion.objects.urdfs import random_urdfs_objects


def bracket() -> trimesh.Trimesh:
    """An L of one solid piece: 10 x 10 x 3 cm with a 7 x 7 cm notch."""
    outline = np.array([[0, 0], [0.1, 0], [0.1, 0.03], [0.03, 0.03], [0.03, 0.1], [0, 0.1]])
    from shapely.geometry import Polygon

    return trimesh.creation.extrude_polygon(Polygon(outline), 0.03)


def test_parts_follow_a_concave_mesh_and_come_from_the_cache(monkeypatch):
    mesh = bracket()
    parts = decomposition.convex_parts(mesh.vertices, mesh.faces, max_parts=12, resolution=50_000)
    assert 2 <= len(parts) <= 12 and max(map(len, parts)) <= 32
    points = trimesh.sample.sample_surface(mesh, 2000, seed=0)[0]
    assert np.percentile(np.abs(decomposition.signed_distance(points, parts)), 95) < 0.005
    in_the_notch = np.array([[0.07, 0.07, 0.015]])
    assert decomposition.signed_distance(in_the_notch, parts)[0] > 0.02

    def fail(*_, **__):
        raise AssertionError("decomposed again")

    monkeypatch.setattr(decomposition.vhacdx, "compute_vhacd", fail)
    again = decomposition.convex_parts(mesh.vertices, mesh.faces, max_parts=12, resolution=50_000)
    for a, b in zip(parts, again, strict=True):
        np.testing.assert_allclose(a, b, atol=1e-7)
    with pytest.raises(AssertionError, match="decomposed again"):  # other settings are another entry
        decomposition.convex_parts(mesh.vertices, mesh.faces, max_parts=13, resolution=50_000)


def flipped(content: bytes, place: int) -> bytes:
    return content[:place] + bytes([content[place] ^ 0xFF]) + content[place + 1 :]


def test_a_damaged_or_unwritable_cache_only_costs_time(monkeypatch, tmp_path):
    mesh = bracket()
    decomposition.convex_parts(mesh.vertices, mesh.faces, max_parts=4, resolution=20_000)
    (entry,) = decomposition.cache_directory().iterdir()
    whole = entry.read_bytes()
    for spoilt in (whole[:40], *(flipped(whole, place) for place in range(60, 120, 4))):
        entry.write_bytes(spoilt)
        assert len(decomposition.convex_parts(mesh.vertices, mesh.faces, max_parts=4, resolution=20_000)) >= 2
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    assert len(decomposition.convex_parts(mesh.vertices, mesh.faces, max_parts=4, resolution=20_000)) >= 2


def test_a_convex_mesh_is_one_part():
    ball = trimesh.creation.icosphere(subdivisions=4, radius=0.04)
    (part,) = decomposition.convex_parts(ball.vertices, ball.faces)
    assert len(part) == 64
    assert trimesh.convex.convex_hull(part).volume > 0.85 * ball.volume


def test_random_urdfs_are_unions_of_their_convex_pieces():
    models = random_urdfs_objects(20)
    assert len({model.name for model in models}) == 20
    for model in models:
        assert (model.category, model.source) == ("object", "random_urdfs")
        assert 0.02 < 2 * model.radius < 0.25
        distance = decomposition.signed_distance(model.surface_points.astype(float), model.hulls)
        assert np.percentile(np.abs(distance), 90) < 0.002  # no surface points inside the body
        assert abs(min(hull[:, 2].min() for hull in model.hulls)) < 1e-9


def test_counts_and_libraries_that_do_not_exist():
    with pytest.raises(ObjectError, match="between 1 and 1000, got 0"):
        random_urdfs_objects(0)
    with pytest.raises(ObjectError, match="'ikea'.*procedural, random_urdfs, ycb"):
        load_objects("ikea")
    assert {model.source for model in load_objects("ycb")} == {"ycb"}
