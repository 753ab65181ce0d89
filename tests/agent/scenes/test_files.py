"""Scene files: read, refused with the line, drawn, saved, shown, and used by a run."""

import json
from pathlib import Path

import numpy as np
import pytest
import trimesh
import typer

from agent.cli import app as cli
from agent.cli.scene import scene_app
from agent.errors import BadInput
from agent.pipeline.run import RunOptions, run_instruction
from agent.reporting.run_report import RunRecord
from agent.scenes.files import PlacedObject, SceneFileError, parse_scene, read_text, write_scene
from agent.scenes.object_placement import drawn_objects, load_scene, placement_of, pose_of, saved_objects
from agent.scenes.sources import FileSource, scene_source
from tests.agent.scenes.goals import a_line

CUPS = """\
version: 1
objects:
- {mesh: ycb/065-g_cups, x: 0.30, y: -0.30, name: Alice, color: red}
- {mesh: ycb/065-h_cups, x: 0.30, y: 0.30, name: Bob}
- {mesh: ycb/065-i_cups, x: 0.60, y: 0.0}
- {mesh: ycb/banana, x: 0.40, y: 0.0, yaw: 90}
"""


@pytest.fixture
def scene(monkeypatch, capsys):
    """Runs `structagent scene ...`: (exit code, standard output, standard error)."""
    app = typer.Typer(rich_markup_mode=None)
    app.add_typer(scene_app, name="scene")
    monkeypatch.setattr(cli, "app", app)

    def run(*arguments: object) -> tuple[int, str, str]:
        code = cli.command_line(["scene", *map(str, arguments)])
        said = capsys.readouterr()
        return code, said.out, said.err

    return run


def written(path: Path, text: str) -> Path:
    path.write_text(text)
    return path


def problems(tmp_path: Path, *rows: str) -> list[tuple[int, str]]:
    """What is wrong with a file of these objects, of which the first is in line 3."""
    path = written(tmp_path / "scene.yaml", "version: 1\nobjects:\n" + "".join(f"- {{{row}}}\n" for row in rows))
    with pytest.raises(SceneFileError) as caught:
        load_scene(path)
    return [(problem.line, problem.message) for problem in caught.value.problems]


@pytest.mark.parametrize(
    ("text", "line", "parts"),
    [
        ("", 1, ("empty", "version", "objects")),
        ("- 7\n", 1, ("version, objects", "a list")),
        ("objects: []\n", 1, ("no 'version'", "version: 1")),
        ("version: 1\n", 1, ("no 'objects'",)),
        ("version: 1\nobjects: []\n", 2, ("at least one",)),
        ("version: 2\nobjects: [{mesh: a.stl, x: 0, y: 0}]\n", 1, ("'2'", "legal: 1")),
        ("version: 1\nobjcts: 3\n", 2, ("'objcts'", "did you mean 'objects'")),
        ("version: 1\nobjects:\n- mesh: ycb/mug\n  x: 0.4\n  y: 0\n  colour: red\n", 6, ("did you mean 'color'",)),
        ("version: 1\nobjects:\n- mesh: ycb/mug\n  x: 0.4\n  y: 0\n  spin: 3\n", 6, ("'spin'", "legal keys: mesh")),
        ("version: 1\nobjects:\n- mesh: ycb/mug\n  x: 0.4\n  x: 0.4\n  y: 0\n", 5, ("twice", "line 4")),
        ("version: 1\nobjects:\n- mesh: ycb/mug\n  x: 0.4\n", 3, ("no 'y'",)),
        ("version: 1\nobjects:\n- mesh: ycb/mug\n  x: 0.4\n  y: north\n", 5, ("'north'", "metres")),
        ("version: 1\nobjects:\n- mesh: ycb/mug\n  x: 0.4\n  y: '0.1'\n", 5, ("'0.1' in quotes",)),
        ("version: 1\nobjects:\n- mesh: ycb/mug\n  x: .inf\n  y: 0\n", 4, ("'.inf'",)),
        ("version: 1\nobjects:\n- mesh: ycb/mug\n  x: 0\n  y: 0\n  yaw: 1e999\n", 6, ("degrees", "'1e999'")),
        ("version: 1\nobjects:\n- mesh: ycb/mug\n  x: 0\n  y: 0\n  z: -1\n", 6, ("below the table",)),
        ("version: 1\nobjects:\n- mesh: ycb/mug\n  x: 0\n  y: 0\n  color: #f00\n", 6, ("in quotes",)),
        ("version: 1\nobjects:\n- mesh: ycb/mug\n  x: 0\n  y: 0\n  color: mauve\n", 6, ("'mauve'", "red", "#rrggbb")),
        ("version: 1\nobjects:\n- mug\n", 3, ("'mug'", "mesh, x, y")),
        ("version: 1\nobjects:\n- mesh: [a\n  b: c: d\n", 4, ("not YAML",)),
        ("a: \x01\n", 1, ("not YAML", "x01")),
        ("[" * 20_000, 1, ("nested too deeply",)),
    ],
)
def test_what_is_wrong_is_said_with_its_line(text, line, parts):
    _, found = parse_scene(text)
    assert found and found[0].line == line, found
    assert all(part in found[0].message for part in parts), found


def test_a_file_that_is_no_text(scene, tmp_path):
    path = tmp_path / "scene.yaml"
    path.write_bytes(b"version: 1\n\xff\n")
    code, said, _ = scene("validate", path)
    assert code == 6 and said == f"{path}:2: byte 0xff is not UTF-8 text\n"


def test_meshes_that_are_not_there_or_not_clear(tmp_path):
    found = problems(
        tmp_path,
        "mesh: ycb/mugg, x: 0.4, y: 0",
        "mesh: ycb/can, x: 0.4, y: 0",
        "mesh: shop/mug, x: 0.4, y: 0",
        "mesh: nothing.stl, x: 0.4, y: 0",
    )
    assert [line for line, _ in found] == [3, 4, 5, 6]
    assert "'ycb/mugg'" in found[0][1] and "ycb/025_mug" in found[0][1]
    assert "ycb/002_master_chef_can" in found[1][1] and "4 objects" in found[1][1]
    assert "procedural" in found[2][1] and ".stl" in found[2][1]
    assert "'nothing.stl'" in found[3][1]


def test_a_mesh_that_cannot_be_read(tmp_path):
    (tmp_path / "broken.obj").write_text("v 0 0 zero\nf 1 2 9\n")
    [(line, message)] = problems(tmp_path, "mesh: broken.obj, x: 0.4, y: 0")
    assert line == 3 and "broken.obj" in message


def test_objects_off_the_table_in_each_other_and_of_one_name(tmp_path):
    found = problems(
        tmp_path,
        "mesh: ycb/mug, x: 0.3, y: 0, name: a",
        "mesh: ycb/mug, x: 0.31, y: 0, name: b",
        "mesh: ycb/bowl, x: 0.7, y: 0",
        "mesh: ycb/mug, x: 0.5, y: 0.3, name: a",
    )
    assert [line for line, _ in found] == [4, 5, 6]
    assert "'b' overlaps 'a' of line 3 by" in found[0][1]
    assert "'bowl' is off the table by 60 mm" in found[1][1] and "0.18 to 0.72" in found[1][1]
    assert "'a' is taken" in found[2][1] and "line 3" in found[2][1]


def test_what_would_fall_is_refused_and_what_is_stacked_is_not(tmp_path):
    found = problems(
        tmp_path,
        "mesh: ycb/mug, x: 0.3, y: 0, z: 0.1",
        "mesh: ycb/mustard_bottle, x: 0.5, y: 0.2, pitch: 30",
        "mesh: ycb/tuna_fish_can, x: 0.3, y: 0.3",
        "mesh: ycb/tomato_soup_can, x: 0.3, y: 0.3, z: 0.0335",
    )
    assert [line for line, _ in found] == [3, 4]
    assert "'mug' does not stay where it is put" in found[0][1] and "100 mm" in found[0][1]


def test_everything_that_is_wrong_is_reported_at_once(tmp_path):
    found = problems(
        tmp_path,
        "mesh: ycb/mugg, x: 0.3, y: -0.3",  # line 3: no such mesh
        "mesh: ycb/mug, x: 0.3, y: 0, z: 0.1",  # hangs in the air
        "mesh: ycb/bowl, x: 0.7, y: 0",  # over the edge
        "mesh: ycb/mug, x: 0.5, y: 0.3, name: a",
        "mesh: ycb/mug, x: 0.51, y: 0.3, name: b",  # in the one before
        "mesh: ycb/banana, x: 0.9, y: -0.3, shade: blue",  # an unknown key, and off the table
        "mesh: ycb/mug, x: 0.5, y: many",  # of which a place is not known
        "mesh: nothing.stl, x: 0.4, y: 2",  # no such mesh, and off the table
        "mesh: ycb/tuna_fish_can, x: 0.7, y: 0.3, colour: red",  # an unknown key that is no part of the pose
    )
    expected = [
        (3, "no mesh"),
        (4, "does not stay"),
        (5, "is off the table by 60 mm"),
        (7, "overlaps 'a' of line 6"),
        (8, "unknown key 'shade'"),
        (8, "is off the table by 180 mm, at x 0.900 and y -0.300"),
        (9, "must be a number"),
        (10, "no mesh"),
        (10, "is off the table by 1550 mm"),
        (11, "did you mean 'color'?"),
        (11, "is off the table by 22 mm: it spans"),
    ]
    assert [line for line, _ in found] == [line for line, _ in expected], found
    assert all(part in message for (_, message), (_, part) in zip(found, expected, strict=True)), found


@pytest.mark.parametrize(
    "wrong",
    [
        "mesh: ycb/tuna_fish_cann, x: 0.3, y: 0.3",  # no such mesh
        "mesh: ycb/tuna_fish_can, x: 0.3, y: 0.3, turn: 20",  # an unknown key, which may be about the pose
        "mesh: ycb/tuna_fish_can, x: 0.3",  # it can be anywhere
        "mesh: ycb/tuna_fish_can, x: 0.3, y: 0.3, z: high",
        "mesh: ycb/tuna_fish_can, x: 0.3, y: 0.3, colour: blue",  # its pose is known: it holds the other
        "x: 0.3, y: 0.3",
    ],
)
def test_what_stands_on_an_object_whose_line_is_wrong_does_not_fall_for_it(tmp_path, wrong):
    found = problems(
        tmp_path,
        wrong,
        "mesh: ycb/tomato_soup_can, x: 0.3, y: 0.3, z: 0.0335",
        "mesh: ycb/tuna_fish_can, x: 0.3, y: 0.3, z: 0.1353",  # on the one that stands on it
        "mesh: ycb/mug, x: 0.5, y: -0.2",
    )
    assert [line for line, _ in found] == [3], found


def test_what_stands_on_an_object_that_is_off_the_table_or_in_another_is_not_judged(tmp_path):
    found = problems(
        tmp_path,
        "mesh: ycb/tuna_fish_can, x: 0.71, y: 0.3",
        "mesh: ycb/tomato_soup_can, x: 0.68, y: 0.3, z: 0.0335",
        "mesh: ycb/tuna_fish_can, x: 0.3, y: 0.3, name: a",
        "mesh: ycb/tuna_fish_can, x: 0.31, y: 0.3, name: b",
        "mesh: ycb/tomato_soup_can, x: 0.3, y: 0.3, z: 0.0335",
    )
    assert [line for line, _ in found] == [3, 6]


def test_the_same_object_twice_is_reported_and_no_defect(tmp_path):
    line = "mesh: ycb/mug, x: 0.3, y: 0, name: a"
    found = problems(tmp_path, line, line)
    assert [line for line, _ in found] == [4, 4]
    assert "taken" in found[0][1] and "overlaps" in found[1][1]


def test_many_problems_are_one_sentence_for_a_run(tmp_path):
    path = written(tmp_path / "scene.yaml", "version: 1\nobjects:\n- {mesh: ycb/mug}\n- 7\n")
    with pytest.raises(SceneFileError, match=r"scene.yaml:3: .*\(and 2 more, see: structagent scene validate"):
        load_scene(path)


def test_own_meshes_are_found_from_the_file_and_take_its_noun_and_colour(tmp_path):
    (tmp_path / "parts").mkdir()
    trimesh.creation.box((0.05, 0.05, 0.06)).export(tmp_path / "parts" / "thing_1.stl")
    text = (
        "version: 1\nobjects:\n- {mesh: parts/thing_1.stl, x: 0.4, y: 0.1, yaw: 30, noun: block, color: '#0080ff'}\n"
        "- {mesh: parts/thing_1.stl, x: 0.4, y: -0.1, name: left one}\n"
    )
    block, thing = load_scene(written(tmp_path / "scene.yaml", text))
    assert (block.name, block.model.category, block.display_name) == ("block", "block", "block")
    assert block.model.color == pytest.approx((0, 128 / 255, 1))
    assert (thing.name, thing.model.category, thing.display_name) == ("left one", "thing", "left one thing")
    assert block.model.height == pytest.approx(0.06, abs=1e-3)


def test_one_of_several_objects_in_a_mesh_file_is_named_by_its_node(tmp_path):
    pack = trimesh.Scene()
    for number, name in enumerate(("mug", "plate")):
        pack.add_geometry(
            trimesh.creation.box((0.05, 0.08, 0.05)), node_name=name, geom_name=name,
            transform=trimesh.transformations.translation_matrix((0.3 * number, 0, 0)),
        )  # fmt: skip
    (tmp_path / "meshes").mkdir()
    pack.export(tmp_path / "meshes" / "pack.glb")
    text = "version: 1\nobjects:\n- {mesh: meshes/pack.glb/plate, x: 0.4, y: 0.1}\n"
    (plate,) = load_scene(written(tmp_path / "scene.yaml", text))
    assert (plate.name, plate.model.category) == ("plate", "plate")
    assert plate.model.height == pytest.approx(0.08, abs=1e-3)
    (saved,) = saved_objects([plate], [plate.world_from_object], tmp_path / "elsewhere")
    assert saved.mesh == "../meshes/pack.glb/plate"
    for mesh, why in (("pack.glb", "holds 2 objects that stand apart, mug, plate"), ("pack.glb/cup", "holds 2")):
        with pytest.raises(SceneFileError, match=f"3: .*{why}"):
            load_scene(written(tmp_path / "scene.yaml", text.replace("pack.glb/plate", mesh)))
    drawn = drawn_objects([plate.model], [np.eye(4)], str(tmp_path / "meshes"))
    assert drawn[0].source == (tmp_path / "meshes" / "pack.glb" / "plate").resolve()


def test_pose_and_numbers_are_each_others_inverse(tmp_path):
    path = written(tmp_path / "scene.yaml", CUPS)
    entry = load_scene(path)[3]
    rng = np.random.default_rng(0)
    for roll, pitch, yaw in [*rng.uniform(-180, 180, (20, 3)), (0, 90, 30), (20, -90, 0), (180, 0, 0)]:
        numbers = {"x": 0.3, "y": -0.2, "z": 0.01, "roll": float(roll), "pitch": float(pitch), "yaw": float(yaw)}
        pose = pose_of(PlacedObject("", **numbers), entry.model)
        lowest = (np.concatenate(entry.model.hulls) @ pose[:3, :3].T + pose[:3, 3])[:, 2].min()
        assert lowest == pytest.approx(0.01)
        back = pose_of(PlacedObject("", **placement_of(entry.model, pose)), entry.model)
        assert np.abs(back - pose).max() < 3e-6
        assert np.linalg.det(pose[:3, :3]) == pytest.approx(1)


def test_a_drawn_scene_is_valid_and_loads_again_bit_for_bit(scene, tmp_path):
    path, again = tmp_path / "new" / "scene.yaml", tmp_path / "new" / "again.yaml"
    code, _, output = scene("new", "--objects", "ycb", "--shape", "line", "--seed", 4, "--out", path)
    assert code == 0 and str(path) in output
    assert scene("validate", path)[:2] == (0, f"{path}: {len(load_scene(path))} objects, no errors\n")
    assert scene("new", "--shape", "line", "--seed", 4)[1] == path.read_text()

    looks = []
    for file in (path, again):
        source = FileSource(file)
        with source.open(a_line(source), 1) as table:
            looks.append((table.world_from_initial, table.look()))
            write_scene(source.saved(table, file.parent), again)
        assert again.read_text() == path.read_text().split("\n", 1)[1]  # but for the comment
    (poses, seen), (poses_again, seen_again) = looks
    assert np.array_equal(poses, poses_again) and np.array_equal(seen.color, seen_again.color)
    for cloud, same in zip(seen.objects, seen_again.objects, strict=True):
        assert cloud.name == same.name and np.array_equal(cloud.points, same.points)


def test_a_drawn_scene_names_its_objects_by_the_library_that_it_was_drawn_from(scene, tmp_path):
    path = tmp_path / "scene.yaml"
    code, _, output = scene("new", "--objects", "validation", "--seed", 3, "--out", path)
    assert code == 0 and "mesh: validation/" in path.read_text(), output
    assert scene("validate", path)[0] == 0


def test_a_scene_that_was_drawn_for_an_instruction_can_be_saved(tmp_path):
    folder = tmp_path / "boxes"
    folder.mkdir()
    for number in range(4):
        trimesh.creation.box((0.05, 0.05, 0.05 + 0.01 * number)).export(folder / f"box_{number}.stl")
    source = scene_source("simulated", str(folder))
    with source.open(a_line(source), 2) as table:
        poses, names = table.world_from_initial, table.names
        write_scene(source.saved(table, tmp_path), tmp_path / "saved.yaml")
    standing = load_scene(tmp_path / "saved.yaml")
    assert tuple(entry.name for entry in standing) == names
    assert standing[0].placed.mesh.startswith("boxes/box_")
    assert np.abs(np.array([entry.world_from_object for entry in standing]) - poses).max() < 3e-6


def test_what_has_fallen_off_the_table_is_not_saved(tmp_path):
    source = FileSource(written(tmp_path / "scene.yaml", CUPS))
    with source.open(a_line(source, (0, 1)), 0) as table:
        fallen = table.world.pose(0)
        fallen[2, 3] = -0.5
        table.world.set_pose(0, fallen)
        assert [line.name for line in source.saved(table, tmp_path)] == ["Bob", "cup 3", "banana"]


def test_show_prints_the_table_and_json(scene, tmp_path):
    path = written(tmp_path / "scene.yaml", CUPS)
    code, said, _ = scene("show", path)
    rows = said.splitlines()
    assert code == 0 and rows[0].split()[:7] == ["name", "noun", "mesh", "x", "y", "z", "yaw"]
    assert rows[1].split()[:7] == ["Alice", "cup", "ycb/065-g_cups", "0.300", "-0.300", "0.000", "0.0"]
    report = json.loads(scene("show", path, "--json")[1])
    assert [entry["name"] for entry in report["objects"]] == ["Alice", "Bob", "cup 3", "banana"]
    assert report["objects"][3]["line"] == 6 and report["objects"][3]["yaw"] == 90


def test_validate_lists_every_problem(scene, tmp_path):
    path = written(tmp_path / "scene.yaml", "version: 1\nobjects:\n- {mesh: ycb/mugg, x: 0.4, y: 0}\n- 7\n")
    code, said, error = scene("validate", path)
    assert code == 6 and [line.split(":")[1] for line in said.splitlines()] == ["3", "4"]
    assert error == f"structagent: the scene file '{path}' has 2 problems\n"
    code, said, _ = scene("validate", path, "--json")
    assert code == 6 and [problem["line"] for problem in json.loads(said)["problems"]] == [3, 4]


def test_files_that_are_there_or_not(scene, tmp_path):
    code, _, error = scene("show", tmp_path / "none.yaml")
    assert code == 6 and "none.yaml" in error and "scene new" in error
    path = written(tmp_path / "scene.yaml", CUPS)
    code, _, error = scene("new", "--out", path)
    assert code == 2 and "--force" in error and path.read_text() == CUPS
    assert scene("new", "--out", path, "--force")[0] == 0 and path.read_text() != CUPS
    assert [entry.name for entry in tmp_path.iterdir()] == ["scene.yaml"]


@pytest.mark.parametrize("verb", ["", "show", "new", "validate"])
def test_help_has_an_example(scene, verb):
    assert "Example: structagent scene" in scene(*([verb] if verb else []), "--help")[1]


def run(text: str, where: Path | str) -> dict:
    record = RunRecord()
    for event in run_instruction(text, RunOptions(scene=str(where), model="geometric", execute=False)):
        record.on_event(event)
    return record.report


def test_a_run_builds_with_the_objects_of_the_file(tmp_path):
    path = written(tmp_path / "scene.yaml", CUPS)
    report = run("put the cups in a small circle on the left", path)
    assert report["outcome"]["success"], report["outcome"]
    assert report["verdict"]["how"] == "released"
    seen = {entry["name"]: entry for entry in report["scene"]["objects"]}
    assert [name for name, entry in seen.items() if entry["takes_part"]] == ["Alice", "Bob", "cup 3"]
    assert list(seen) == ["Alice", "Bob", "cup 3", "banana"]
    assert seen["Bob"]["position"][:2] == pytest.approx([0.30, 0.30], abs=0.02)
    again = run("put the cups in a small circle on the left", path)
    assert again["scene"]["objects"] == report["scene"]["objects"]
    assert again["proposals"]["candidates"] == report["proposals"]["candidates"]


def test_names_and_colours_of_the_file_choose(tmp_path):
    report = run("put the red cup and the banana in a line", written(tmp_path / "scene.yaml", CUPS))
    taking_part = [entry["name"] for entry in report["scene"]["objects"] if entry["takes_part"]]
    assert taking_part == ["Alice", "banana"]


@pytest.mark.parametrize(
    ("text", "where", "code", "parts"),
    [
        ("put the mugs in a line", "scene.yaml", 3, ("no mug here", "Bob cup")),
        ("put the banana in a line", "scene.yaml", 3, ("a line needs 2 objects", "banana")),
        ("put the cups in a line", "none.yaml", 6, ("none.yaml",)),
        ("put the cups in a line", "bag", 2, ("'bag'", "simulated", ".yaml")),
    ],
)
def test_runs_that_a_scene_file_does_not_allow(tmp_path, monkeypatch, text, where, code, parts):
    monkeypatch.chdir(tmp_path)
    written(tmp_path / "scene.yaml", CUPS)
    outcome = run(text, where)["outcome"]
    assert outcome["exit_code"] == code
    assert all(part in outcome["message"] for part in parts), outcome


def test_a_scene_file_that_is_too_large_is_not_read(tmp_path, monkeypatch):
    (tmp_path / "a.yaml").write_text("#" * 200_001)
    monkeypatch.setattr(Path, "read_bytes", None)
    with pytest.raises(BadInput, match="a.yaml' has 200001 bytes; at most 200000 are read"):
        read_text(tmp_path / "a.yaml")
