"""A user's own meshes: what loads, under which noun, and one clear sentence for what does not."""

import json
import os
import struct
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import trimesh

from structdiffusion.objects import decomposition, mesh_files
from structdiffusion.objects.file_nouns import category_of
from structdiffusion.objects.folder import folder_objects
from structdiffusion.objects.libraries import load_objects
from structdiffusion.objects.meshes import clean
from structdiffusion.objects.model import ObjectError


def cup() -> trimesh.Trimesh:
    """A cup of 4 mm wall, 8 cm wide and 9 cm high, somewhere in space."""
    profile = [(0, 0), (0.04, 0), (0.04, 0.09), (0.036, 0.09), (0.036, 0.005), (0, 0.005)]
    mesh = trimesh.creation.revolve(profile, sections=48)
    mesh.apply_translation([0.3, -0.2, 0.7])
    return mesh


@pytest.mark.parametrize(
    ("stem", "noun"),
    [
        ("red_mug_2", "mug"),
        ("SoupCan", "can"),
        ("sugar box", "box"),
        ("knives-3", "knife"),
        ("002_glasses", "glass"),
        ("mug box", "box"),
        ("gizmo_7", "gizmo"),
        ("42", "42"),
    ],
)
def test_category_from_the_file_name(stem, noun):
    assert category_of(stem) == noun


def test_a_pointed_thing_is_no_vessel_whatever_it_is_called(tmp_path):
    trimesh.creation.cone(0.03, 0.08).export(tmp_path / "cup.obj")
    (model,) = load_objects(tmp_path)
    assert model.category == "cup" and len(model.hulls) == 1 and model.height == pytest.approx(0.08, abs=1e-3)


def test_every_format_loads_in_the_object_frame(tmp_path):
    for suffix in (".obj", ".stl", ".ply"):
        trimesh.creation.box([0.04, 0.10, 0.06]).export(tmp_path / f"box_{suffix[1:]}{suffix}")
    trimesh.creation.box([0.04, 0.06, 0.10]).export(tmp_path / "box_glb.glb")  # with y up
    (tmp_path / "notes.txt").write_text("not a mesh")
    models = load_objects(tmp_path)
    assert [model.name for model in models] == ["box_glb", "box_obj", "box_ply", "box_stl"]
    for model in models:
        assert (model.category, model.source, len(model.hulls)) == ("box", "folder", 1)
        np.testing.assert_allclose(np.ptp(model.footprint, axis=0), [0.04, 0.10], atol=1e-6)
        assert model.height == pytest.approx(0.06)
        assert model.stackable and model.flat_bottom
        assert (np.abs(np.linalg.norm(model.surface_normals, axis=1) - 1) < 1e-5).all()


def test_a_cup_stays_hollow_and_stands(tmp_path, drop):
    cup().export(tmp_path / "tall_cup.stl")
    (model,) = load_objects(str(tmp_path))
    assert model.category == "cup"
    assert np.abs(model.footprint.mean(axis=0)).max() < 0.001
    inside = np.array([[0.0, 0.0, 0.02], [0.03, 0.0, 0.06]])
    assert (decomposition.signed_distance(inside, model.hulls) > 0.001).all()
    deviation = np.abs(decomposition.signed_distance(model.surface_points.astype(float), model.hulls))
    assert np.percentile(deviation, 99) < 0.002
    assert drop(model, 0.01, 0.5) < 1.0


def test_same_stem_twice_gives_two_names(tmp_path):
    for suffix in (".stl", ".ply"):
        trimesh.creation.box([0.05] * 3).export(tmp_path / f"block{suffix}")
    assert [model.name for model in folder_objects(tmp_path)] == ["block", "block.stl"]


def test_unknown_folder(tmp_path):
    with pytest.raises(ObjectError, match=r"no folder of meshes at .*nowhere.*procedural, random_urdfs, ycb"):
        load_objects(str(tmp_path / "nowhere"))


def test_folder_without_meshes(tmp_path):
    (tmp_path / "readme.txt").write_text("none")
    with pytest.raises(ObjectError, match=r"holds no mesh: .* ending in \.obj, \.stl, \.ply, \.glb, \.gltf$"):
        load_objects(tmp_path)


@pytest.mark.parametrize("name", ["broken.obj", "broken.stl", "broken.ply", "broken.glb"])
def test_broken_mesh_is_named(tmp_path, name):
    (tmp_path / name).write_bytes(b"this is \x00\xff no mesh")
    with pytest.raises(ObjectError, match=rf"{name}' can"):
        load_objects(tmp_path)


def test_flat_sheet_and_missing_numbers(tmp_path):
    (tmp_path / "sheet.obj").write_text("v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nf 1 2 3\n")
    with pytest.raises(ObjectError, match=r"sheet.obj' cannot be used: it does not enclose a volume"):
        load_objects(tmp_path)
    (tmp_path / "sheet.obj").write_text("v nan 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nf 1 2 3\nf 1 2 4\n")
    with pytest.raises(ObjectError, match=r"sheet.obj' cannot be used: some of its coordinates are"):
        load_objects(tmp_path)


@pytest.mark.parametrize(
    ("side", "hint"), [(60.0, r"; if its unit is the millimetre, scale it by 0\.001"), (0.001, "")]
)
def test_absurd_size_speaks_of_units(tmp_path, side, hint):
    trimesh.creation.box([side] * 3).export(tmp_path / "block.stl")
    with pytest.raises(ObjectError, match=rf"block.stl' is .* m long: .* metres.*0\.005 and 0\.5 m{hint}$"):
        load_objects(tmp_path)


def test_a_mesh_that_is_too_large_is_refused_before_it_is_read(tmp_path, monkeypatch):
    cup().export(tmp_path / "cup.stl")
    size = (tmp_path / "cup.stl").stat().st_size
    monkeypatch.setattr(mesh_files, "MESH_BYTES", size - 1)
    monkeypatch.setattr(mesh_files.trimesh, "load_scene", None)
    with pytest.raises(ObjectError, match=f"cup.stl' has {size} bytes; at most {size - 1} are read: simplify it"):
        load_objects(tmp_path)


@pytest.mark.parametrize("suffix", [".obj", ".stl", ".ply", ".glb"])
def test_a_mesh_of_too_many_faces_is_refused(tmp_path, monkeypatch, suffix):
    cup().export(tmp_path / f"cup{suffix}")
    monkeypatch.setattr(mesh_files, "MESH_FACES", 100)
    with pytest.raises(ObjectError, match=f"cup{suffix}' has [0-9]+ faces; at most 100 are read: simplify it"):
        load_objects(tmp_path)


def test_a_scene_that_places_a_mesh_too_often_is_refused_before_it_is_made(tmp_path, monkeypatch):
    trimesh.creation.box([0.04, 0.10, 0.06]).export(tmp_path / "box.glb")
    content = (tmp_path / "box.glb").read_bytes()
    length = int.from_bytes(content[12:16], "little")
    told = json.loads(content[20 : 20 + length])
    told["nodes"] += [{"mesh": 0}] * 100_000
    text = json.dumps(told).encode()
    text += b" " * (-len(text) % 4)
    rest = content[20 + length :]
    header = b"glTF" + struct.pack("<IIII", 2, 20 + len(text) + len(rest), len(text), 0x4E4F534A)
    (tmp_path / "box.glb").write_bytes(header + text + rest)
    monkeypatch.setattr(mesh_files.trimesh, "load_scene", None)
    with pytest.raises(ObjectError, match="has 12[0-9]{5} faces; at most 600000 are read"):
        load_objects(tmp_path)
    (tmp_path / "box.glb").write_bytes(header[:12] + struct.pack("<I", 2**31) + text)
    with pytest.raises(ObjectError, match="text has 2147483648 bytes; at most 10000000 are read"):
        load_objects(tmp_path)


def test_specks_are_left_out_without_being_made(monkeypatch):
    mesh = cup()
    specks = np.repeat(mesh.vertices[:100, None], 3, axis=1) + np.eye(3) * 0.0005
    scan = trimesh.util.concatenate(
        [mesh, trimesh.Trimesh(specks.reshape(-1, 3) + 1.0, np.arange(300).reshape(-1, 3), process=False)]
    )
    made = []
    monkeypatch.setattr(trimesh.Trimesh, "fix_normals", lambda piece: made.append(len(piece.faces)))
    (piece,) = clean(scan)
    assert made == [len(mesh.faces)] and len(piece.faces) == len(mesh.faces)
    assert clean(trimesh.Trimesh(specks.reshape(-1, 3), np.arange(300).reshape(-1, 3), process=False)) == []


def test_a_fine_round_mesh_takes_little_memory(tmp_path):
    trimesh.creation.icosphere(subdivisions=6, radius=0.04).export(tmp_path / "ball.stl")
    program = (
        "import sys; from structdiffusion.objects.folder import folder_objects; from pathlib import Path\n"
        "from tests.memory import peak_megabytes; folder_objects(Path(sys.argv[1])); print(peak_megabytes() < 700)"
    )
    done = subprocess.run(
        [sys.executable, "-c", program, tmp_path], capture_output=True, text=True,
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[3])},
    )  # fmt: skip
    assert done.stdout == "True\n", done.stderr
