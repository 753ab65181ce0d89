"""Large meshes are prepared in bounded time and memory, and no mesh longer than the limit says."""

import numpy as np
import pytest
import trimesh

from agent.cli.app import command_line
from structdiffusion.limits import MESH_FINE_FACES
from structdiffusion.objects import folder, mesh_process
from structdiffusion.objects.folder import object_from_file
from structdiffusion.objects.mesh_preparation import prepare
from structdiffusion.objects.meshes import coarser
from structdiffusion.objects.model import ObjectError


@pytest.fixture(scope="module")
def ball():
    """A sphere of radius 5 cm with 81,920 faces."""
    return trimesh.creation.icosphere(subdivisions=6, radius=0.05)


@pytest.fixture
def large(tmp_path, ball):
    path = tmp_path / "meshes" / "ball.stl"
    path.parent.mkdir()
    ball.export(path)
    return path


def test_a_mesh_that_takes_too_long_is_stopped_with_a_sentence(large, monkeypatch, capsys):
    monkeypatch.setattr(mesh_process, "MESH_SECONDS", 0.2)
    arguments = ["run", "stack the balls", "--objects", str(large.parent), "--out", str(large.parent.parent / "out")]
    assert command_line(arguments) == 6
    told = capsys.readouterr().err
    assert "Traceback" not in told
    sentence = f"preparing the mesh {str(large)!r} takes more than 0.2 s, and was stopped: simplify it"
    assert sentence in " ".join(told.split())


def test_a_large_mesh_is_the_same_object_whether_prepared_apart_or_here(large):
    apart, here = object_from_file(large, "ball", "ball"), prepare(large, "ball", "ball")[0]
    assert (apart.name, apart.category, apart.mass, apart.color) == (here.name, here.category, here.mass, here.color)
    for ours, theirs in zip(apart.hulls, here.hulls, strict=True):
        assert ours.dtype == theirs.dtype and np.array_equal(ours, theirs)
    assert np.array_equal(apart.surface_points, here.surface_points)


def test_what_is_wrong_with_a_large_mesh_is_said_as_of_a_small_one(tmp_path):
    path = tmp_path / "flat.stl"
    grid = trimesh.creation.box((0.1, 0.1, 0.1)).subdivide_to_size(0.003)
    grid.vertices[:, 2] = 0.0
    grid.export(path)
    assert path.stat().st_size > folder.SLOW_BYTES
    with pytest.raises(ObjectError, match="flat.stl' cannot be used: it does not enclose a volume"):
        object_from_file(path, "flat")


def test_a_process_that_dies_is_an_error_of_its_mesh(large, monkeypatch):
    monkeypatch.setattr(mesh_process.sys, "executable", "/bin/false")
    with pytest.raises(ObjectError, match="ball.stl' cannot be prepared: its process ended with exit code 1"):
        object_from_file(large, "ball")


def test_a_fine_mesh_is_made_coarser_within_a_fifth_of_a_millimetre(ball):
    corners = ball.vertices[ball.faces].reshape(-1, 3)
    soup = trimesh.Trimesh(corners, np.arange(len(corners)).reshape(-1, 3), process=False)
    for mesh in (ball, soup):
        coarse = coarser(mesh, MESH_FINE_FACES)
        assert 1000 < len(coarse.faces) <= MESH_FINE_FACES and coarse.is_watertight
        radii = np.linalg.norm(coarse.triangles_center, axis=1)
        assert abs(radii - 0.05).max() < 0.0002
        assert coarse.volume == pytest.approx(ball.volume, rel=0.005)


def test_one_with_holes_is_made_coarser_too(ball):
    half = ball.slice_plane((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    assert not half.is_watertight
    coarse = coarser(half, 10_000)
    assert 5000 < len(coarse.faces) <= 10_000
    assert abs(np.linalg.norm(coarse.vertices, axis=1) - 0.05).max() < 0.0005


def test_a_mesh_that_is_coarse_already_stays_as_it_is():
    box = trimesh.creation.box((0.1, 0.1, 0.1))
    assert coarser(box, 12) is box
