"""Mesh files as other tools write them: y up, several objects, subfolders, files beside them, other formats."""

import base64
import json
import os

import numpy as np
import pytest
import trimesh

from structdiffusion.objects import folder, mesh_files
from structdiffusion.objects.folder import folder_objects, object_from_file
from structdiffusion.objects.model import ObjectError

TALL = (0.05, 0.05, 0.12)  # z up
TALL_Y_UP = (0.05, 0.12, 0.05)


def box(size=TALL, at=(0.0, 0.0, 0.0)):
    mesh = trimesh.creation.box(size)
    mesh.apply_translation(at)
    return mesh


def scene(**parts):
    made = trimesh.Scene()
    for name, (mesh, pose) in parts.items():
        made.add_geometry(mesh, node_name=name, geom_name=name, transform=pose)
    return made


def moved(x=0.0, y=0.0, z=0.0):
    return trimesh.transformations.translation_matrix((x, y, z))


def embedded(path, mesh=None, change=lambda content: None, uri=None):
    """Write a .gltf file of one mesh, its buffer inside it or under another name."""
    files = (mesh or scene(can=(box(TALL_Y_UP), None))).export(file_type="gltf", merge_buffers=True)
    content = json.loads(files["model.gltf"])
    for buffer in content["buffers"]:
        data = files[buffer["uri"]]
        buffer["uri"] = uri or f"data:application/octet-stream;base64,{base64.b64encode(data).decode()}"
    change(content)
    path.write_text(json.dumps(content))
    return data


@pytest.mark.parametrize("name", ["can.glb", "can.gltf"])
def test_gltf_stands_upright(tmp_path, name):
    if name.endswith("glb"):
        box(TALL_Y_UP).export(tmp_path / name)
    else:
        embedded(tmp_path / name)
    (model,) = folder_objects(tmp_path)
    assert model.category == "can" and model.height == pytest.approx(0.12)
    np.testing.assert_allclose(np.ptp(model.footprint, axis=0), [0.05, 0.05], atol=1e-6)


def test_gltf_is_turned_and_not_mirrored(tmp_path):
    """A bump on the right side seen from the front (+z in glTF is the front, so -y here) stays on the right."""
    mesh = trimesh.util.concatenate([box((0.04, 0.10, 0.04)), box((0.02, 0.02, 0.02), (0.03, 0.04, 0.0))])
    mesh.export(tmp_path / "thing.glb")
    (part,) = mesh_files.read_parts(tmp_path / "thing.glb")
    np.testing.assert_allclose(part.mesh.bounds, [[-0.02, -0.02, -0.05], [0.04, 0.02, 0.05]], atol=1e-6)
    assert part.mesh.volume > 0
    box((0.02, 0.04, 0.06), (0.0, 0.0, 0.1)).export(tmp_path / "front.glb")
    (part,) = mesh_files.read_parts(tmp_path / "front.glb")
    assert part.mesh.bounds[:, 1].max() < 0  # what faces +z in glTF faces -y


def test_transforms_and_scales_of_nodes_are_applied(tmp_path):
    pose = moved(0.4) @ np.diag([0.001, 0.001, 0.001, 1.0])
    scene(can=(box((50.0, 120.0, 50.0)), pose)).export(tmp_path / "millimetres.glb")
    (model,) = folder_objects(tmp_path)
    assert model.height == pytest.approx(0.12)
    mirrored = np.diag([-0.001, 0.001, 0.001, 1.0])
    scene(can=(box((50.0, 120.0, 50.0)), mirrored)).export(tmp_path / "millimetres.glb")
    assert mesh_files.read_parts(tmp_path / "millimetres.glb")[0].mesh.volume > 0


@pytest.mark.parametrize("suffix", [".glb", ".obj"])
def test_what_stands_apart_becomes_several_objects(tmp_path, suffix):
    size = TALL_Y_UP if suffix == ".glb" else TALL
    pack = scene(mug=(box(size), moved(0)), sugar_box=(box(size), moved(0.3)), thing=(box(size), moved(0.6)))
    pack.export(tmp_path / f"pack{suffix}")
    models = folder_objects(tmp_path)
    assert [(model.name, model.category) for model in models] == [
        ("mug", "mug"), ("sugar_box", "box"), ("thing", "thing")
    ]  # fmt: skip
    assert all(model.height == pytest.approx(0.12) and len(model.hulls) == 1 for model in models)
    assert [model.file for model in models] == [tmp_path / f"pack{suffix}" / model.name for model in models]
    path = tmp_path / f"pack{suffix}"
    assert object_from_file(path, "x", part="mug").name == "mug"
    with pytest.raises(ObjectError, match="holds 3 objects that stand apart, mug, sugar_box, thing: name one, such as"):
        object_from_file(path, "x")
    with pytest.raises(ObjectError, match="holds 3 objects"):
        object_from_file(path, "x", part="plate")


def test_nodes_without_a_noun_take_it_from_their_file(tmp_path):
    scene(a=(box(TALL_Y_UP), None), b=(box(TALL_Y_UP), moved(0.3))).export(tmp_path / "mugs.glb")
    scene(a=(box(TALL_Y_UP), None), b=(box(TALL_Y_UP), moved(0.3))).export(tmp_path / "cans.glb")
    models = folder_objects(tmp_path)
    assert [model.category for model in models] == ["can", "can", "mug", "mug"]
    assert [model.name for model in models] == ["a", "b", "mugs.glb/a", "mugs.glb/b"]


def test_what_touches_is_one_object_and_that_is_told(tmp_path, caplog):
    lid = box((0.04, 0.02, 0.04), (0.0, 0.071, 0.0))
    scene(pot=(box(TALL_Y_UP), None), lid=(lid, None)).export(tmp_path / "pot.glb")
    (model,) = folder_objects(tmp_path)
    assert model.name == "pot" and model.height == pytest.approx(0.141, abs=0.002)
    assert "the nodes lid, pot touch, and are one object here" in caplog.text


def test_loose_pieces_without_names_are_told(tmp_path, caplog):
    trimesh.util.concatenate([box(), box(at=(0.3, 0, 0))]).export(tmp_path / "two.stl")
    (model,) = folder_objects(tmp_path)
    assert len(model.hulls) == 2 and "2 pieces stand apart without names" in caplog.text
    caplog.clear()
    specks = [box((0.001,) * 3, (0.1 + n / 50, 0, 0)) for n in range(3)]
    trimesh.util.concatenate([box(), *specks]).export(tmp_path / "two.stl")
    folder_objects(tmp_path)
    assert caplog.text == ""


def test_many_materials_of_one_node_are_one_object(tmp_path, caplog):
    def apart(content):
        parts = [part for mesh in content["meshes"] for part in mesh["primitives"]]
        content["meshes"] = [{"name": "whole", "primitives": parts}]
        content["nodes"] = [{"name": "mug", "mesh": 0}]
        content["scenes"], content["scene"] = [{"nodes": [0]}], 0

    mesh = scene(a=(box(TALL_Y_UP), None), b=(box(TALL_Y_UP, (0.2, 0, 0)), None))
    embedded(tmp_path / "mug.gltf", mesh, apart)
    assert [part.names for part in mesh_files.read_parts(tmp_path / "mug.gltf")] == [("mug",)]


def test_a_mesh_placed_twice_is_two_objects(tmp_path):
    def twice(content):
        content["nodes"] = [{"mesh": 0, "name": "../a\nb"}, {"mesh": 0, "translation": [0.3, 0, 0]}]
        content["scenes"], content["scene"] = [{"nodes": [0, 1]}], 0

    embedded(tmp_path / "cans.gltf", change=twice)
    models = folder_objects(tmp_path)
    assert [model.name for model in models] == ["_a_b", "can"] and {m.category for m in models} == {"can"}


def test_subfolders_are_read_and_give_names_and_nouns(tmp_path):
    for name in ("can.stl", "kitchen/can.stl", "mugs/017/textured.ply", "kitchen/deep/er/bowl.obj"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        box().export(tmp_path / name)
    assert [(model.name, model.category) for model in folder_objects(tmp_path)] == [
        ("can", "can"),
        ("kitchen/can", "can"),
        ("kitchen/deep/er/bowl", "bowl"),
        ("mugs/017/textured", "mug"),
    ]


def test_hidden_files_and_links_to_folders_are_left_out(tmp_path, caplog):
    objects, elsewhere = tmp_path / "objects", tmp_path / "elsewhere"
    for name in ("objects/.trash/mug.stl", "objects/can.stl", "elsewhere/bowl.stl"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        box().export(tmp_path / name)
    (objects / "._can.stl").write_bytes(b"\0\5\26\7 what a Mac leaves on other disks")
    (objects / "round").symlink_to(objects)
    (objects / "out").symlink_to(elsewhere)
    (objects / "bowl.stl").symlink_to(elsewhere / "bowl.stl")
    (objects / "gone.stl").symlink_to(elsewhere / "gone.stl")
    os.mkfifo(objects / "pipe.stl")
    assert [model.name for model in folder_objects(objects)] == ["bowl", "can"]
    assert "without 'out', 'round'" in caplog.text and "links to folders are not followed" in caplog.text


def test_other_formats_are_named_with_the_legal_ones(tmp_path, caplog):
    (tmp_path / "cup.DAE").write_text("<COLLADA/>")
    (tmp_path / "cup.mtl").write_text("newmtl a")
    with pytest.raises(ObjectError, match=r"holds no mesh: .* without 'cup.DAE': meshes end in .*\.glb or \.gltf$"):
        folder_objects(tmp_path)
    box().export(tmp_path / "can.stl")
    assert len(folder_objects(tmp_path)) == 1
    assert "without 'cup.DAE': meshes end in .obj" in caplog.text


def test_a_folder_of_everything_is_not_searched_for_long(tmp_path, monkeypatch):
    monkeypatch.setattr(folder, "FOLDER_FILES", 20)
    for number in range(30):
        (tmp_path / f"{number % 3}").mkdir(exist_ok=True)
        (tmp_path / f"{number % 3}" / f"{number}.txt").touch()
    with pytest.raises(ObjectError, match="holds more than 20 files or 1000 meshes: name the folder"):
        folder_objects(tmp_path)


def test_buffers_of_the_own_folder_are_read(tmp_path):
    (tmp_path / "parts").mkdir()
    data = embedded(tmp_path / "can.gltf", uri="parts/can%20data.bin")
    (tmp_path / "parts" / "can data.bin").write_bytes(data)
    (model,) = folder_objects(tmp_path)
    assert model.height == pytest.approx(0.12)


@pytest.mark.parametrize(
    "uri",
    ["../secret.bin", "..%2Fsecret.bin", "{folder}/secret.bin", "file://{folder}/secret.bin",
     "http://127.0.0.1:1/x.bin", "//127.0.0.1/x.bin", "link.bin", "linked/secret.bin", "missing.bin", "a\0b"],
)  # fmt: skip
def test_buffers_of_elsewhere_are_not_read(tmp_path, uri):
    meshes = tmp_path / "meshes"
    meshes.mkdir()
    data = embedded(meshes / "can.gltf", uri=uri.format(folder=tmp_path))
    (tmp_path / "secret.bin").write_bytes(data)
    (meshes / "link.bin").symlink_to(tmp_path / "secret.bin")
    (meshes / "linked").symlink_to(tmp_path)
    (meshes / "secret.bin").write_bytes(data)  # no other file of the same name in its place
    with pytest.raises(ObjectError, match="can.gltf' cannot be read: "):
        folder_objects(meshes)


@pytest.mark.parametrize(
    ("change", "why"),
    [
        (lambda c: c.update(extensionsRequired=["KHR_draco_mesh_compression"]), "extension KHR_draco_mesh_compression"),
        (lambda c: c["accessors"].append({"count": 10**12, "componentType": 5126, "type": "MAT4"}), "claims 10{12}"),
        (lambda c: c["accessors"][0].update(count="many"), "damaged"),
        (lambda c: c.update(nodes=[{"mesh": 0}] * 30_000), "places 30000 meshes|faces"),
        (lambda c: c.update(meshes=[]), "cannot be (read|used)"),
        (lambda c: c.update(buffers=[]), "cannot be read"),
        (lambda c: c["asset"].update(version="1.0"), "only GLTF 2"),
    ],
)
def test_a_gltf_that_claims_too_much_or_too_little_is_one_sentence(tmp_path, change, why):
    embedded(tmp_path / "can.gltf", change=change)
    with pytest.raises(ObjectError, match=why) as caught:
        folder_objects(tmp_path)
    assert "\n" not in str(caught.value)


def test_materials_and_their_files_are_not_read(tmp_path):
    box().export(tmp_path / "can.obj")
    text = (tmp_path / "can.obj").read_text()
    (tmp_path / "can.obj").write_text("mtllib ../../../etc/passwd\n" + text)
    (model,) = folder_objects(tmp_path)
    assert model.height == pytest.approx(0.12)
