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


@pytest.fixture
def asked(monkeypatch) -> list[int]:
    """What V-HACD makes of the first mesh of a test it makes of each; has an entry for every time that it is asked."""
    compute, known, times = decomposition.vhacdx.compute_vhacd, [], []

    def once(*mesh, **settings):
        times.append(len(times))
        if not known:
            known.extend(compute(*mesh, **settings))
        return known

    monkeypatch.setattr(decomposition.vhacdx, "compute_vhacd", once)
    return times


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
        assert (a.dtype, a.flags.c_contiguous, a.tobytes()) == (b.dtype, b.flags.c_contiguous, b.tobytes())
    with pytest.raises(AssertionError, match="decomposed again"):  # other settings are another entry
        decomposition.convex_parts(mesh.vertices, mesh.faces, max_parts=13, resolution=50_000)


def test_a_mesh_that_differs_in_the_last_digits_has_an_entry_of_its_own():
    mesh = bracket()
    moved = mesh.vertices * (1 + 1e-9)
    assert (moved.astype(np.float32) == mesh.vertices.astype(np.float32)).all()
    for vertices in (mesh.vertices, moved):
        decomposition.convex_parts(vertices, mesh.faces, max_parts=3, resolution=10_000)
    assert len(list(decomposition.cache_directory().iterdir())) == 2


def unlike(whole: dict[str, np.ndarray]) -> dict[str, dict[str, np.ndarray]]:
    """Entries of the cache that are whole files and no parts."""
    vertices, counts = whole["vertices"], whole["counts"]
    infinite = vertices.copy()
    infinite[0, 0] = np.inf
    return {
        "rounded": {"vertices": vertices.astype(np.float32), "counts": counts},
        "flat": {"vertices": vertices[:, :2], "counts": counts},
        "one row": {"vertices": vertices.ravel(), "counts": counts},
        "texts": {"vertices": vertices.astype(str), "counts": counts},
        "infinite": {"vertices": infinite, "counts": counts},
        "counts with a point": {"vertices": vertices, "counts": counts.astype(float)},
        "counts in a table": {"vertices": vertices, "counts": counts[None]},
        "too few counted": {"vertices": vertices, "counts": counts - 1},
        "below none counted": {"vertices": vertices, "counts": np.array([-4, len(vertices) + 4])},
        "one part of all": {"vertices": vertices, "counts": np.array([len(vertices)])},
        "no part": {"vertices": vertices[:0], "counts": counts[:0]},
        "other names": {"points": vertices, "counts": counts},
        "pickled": {"vertices": vertices.astype(object), "counts": counts},
        "a large one": {"vertices": np.zeros((200_000, 3)), "counts": counts},
    }


def test_an_entry_of_a_wrong_shape_or_type_is_made_anew(asked):
    mesh = bracket()
    settings = {"max_parts": 4, "resolution": 20_000}
    parts = decomposition.convex_parts(mesh.vertices, mesh.faces, **settings)
    (entry,) = decomposition.cache_directory().iterdir()
    whole = dict(np.load(entry))
    assert sum(map(len, parts)) > decomposition.MAX_PART_VERTICES  # so that one part of all is too large
    for what, spoilt in unlike(whole).items():
        np.savez_compressed(entry, **spoilt)
        again = decomposition.convex_parts(mesh.vertices, mesh.faces, **settings)
        assert [part.tobytes() for part in again] == [part.tobytes() for part in parts], what
        assert dict(np.load(entry))["vertices"].tobytes() == whole["vertices"].tobytes(), what
    np.save(entry.open("wb"), whole["vertices"])  # an array and no archive
    assert len(decomposition.convex_parts(mesh.vertices, mesh.faces, **settings)) == len(parts)
    assert len(asked) == 2 + len(unlike(whole))


def flipped(content: bytes, place: int) -> bytes:
    return content[:place] + bytes([content[place] ^ 0xFF]) + content[place + 1 :]


def test_a_damaged_or_unwritable_cache_only_costs_time(asked, monkeypatch, tmp_path):
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
