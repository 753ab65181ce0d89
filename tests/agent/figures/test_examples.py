"""Figures read off scene files, reports and figures' files."""

import json

import numpy as np
import pytest

from agent.errors import BadInput
from agent.figures.examples import example_of_points, read_example
from grounding.figures.figure import FigureError
from grounding.figures.files import write_figure
from grounding.figures.names import figure_named

ROOF = [(0.30, 0.2), (0.40, 0.1), (0.50, 0.0), (0.40, -0.1), (0.30, -0.2)]


def scene(folder, places):
    lines = [f"- {{mesh: ycb/065-{letter}_cups, x: {x}, y: {y}}}" for letter, (x, y) in zip("abcdefg", places)]
    path = folder / "table.yaml"
    path.write_text("version: 1\nobjects:\n" + "\n".join(lines) + "\n")
    return path


def box(x, y, z, width=0.05):
    corners = np.array([[i, j, k] for i in (-0.5, 0.5) for j in (-0.5, 0.5) for k in (0.0, 1.0)])
    return corners * [0.05, width, 0.05] + [x, y, z]


def test_a_scene_file_is_seen_from_the_robots_side(tmp_path):
    roof = read_example(scene(tmp_path, ROOF), "roof")
    (stroke,) = roof.strokes
    assert (roof.name, roof.nouns, len(stroke)) == ("roof", ("roof",), 3)
    highest = max(stroke, key=lambda point: point[1])
    assert highest == stroke[1] and min(x for x, _ in stroke) < highest[0] < max(x for x, _ in stroke)


def test_what_stands_on_others_becomes_blocks():
    from structdiffusion.figures.example import figure_of
    from structdiffusion.models.strokes.reading import read_strokes

    posts = [box(0.4, 0.1, 0.0), box(0.4, -0.1, 0.0)]
    gate = figure_of(example_of_points([*posts, box(0.4, 0.0, 0.05, width=0.25)]), "gate", ("gate",), read_strokes)
    assert [(block.level, block.width > 1) for block in gate.blocks] == [(0, False), (0, False), (1, True)]
    assert gate.legal[:3] == (3, 5, 7)


def report(success=True, shape=None):
    def seen(name, y):
        outline = [[0.3, y], [0.34, y], [0.34, y + 0.04], [0.3, y + 0.04]]
        return {"name": name, "position": [0.32, y + 0.02, 0.05], "outline": outline}

    names = ["cup 1", "cup 2", "cup 3"]
    lifted = np.eye(4)
    lifted[2, 3] = 0.1
    lifted[1, 3] = -0.1
    goals = [{"name": names[0], "position": [0.32, 0.02, 0.05], "goal_from_initial": np.eye(4).tolist()},
             {"name": names[1], "position": [0.32, 0.02, 0.15], "goal_from_initial": lifted.tolist()}]  # fmt: skip
    return {
        "schema_version": 7, "scene": {"objects": [seen(name, 0.1 * k) for k, name in enumerate(names)]},
        "chosen": {"goals": goals},
        "verdict": {"success": success, "detail": "" if success else "cup 2 fell"},
        "parse": {"goal": {"parts": [{"kind": "structure", "shape": shape, "objects": [0, 1]}]}},
    }  # fmt: skip


def test_a_report_shows_what_was_built_where_it_was_to_go(tmp_path):
    (tmp_path / "report.json").write_text(json.dumps(report()))
    assert [block.level for block in read_example(tmp_path, "pile of two").blocks] == [0, 1]
    (tmp_path / "report.json").write_text(json.dumps(report(shape="letter T")))
    assert read_example(tmp_path / "report.json", "tee").strokes == figure_named("letter T").strokes


def test_errors_say_what_is_wrong_with_which_file(tmp_path):
    (tmp_path / "report.json").write_text(json.dumps(report(success=False)))
    with pytest.raises(BadInput, match="did not end with a structure that stands as asked: cup 2 fell"):
        read_example(tmp_path, "x")
    (tmp_path / "other.json").write_text("{}")
    with pytest.raises(BadInput, match="other.json' is not the report of a run"):
        read_example(tmp_path / "other.json", "x")
    with pytest.raises(BadInput, match="legal: the folder of a run, or a file that ends in one of .toml, .yaml"):
        read_example(tmp_path / "missing.png", "x")
    with pytest.raises(FigureError, match="shows no figure: an example needs two objects or more"):
        read_example(scene(tmp_path, ROOF[:1]), "x")


def test_a_figures_file_keeps_its_drawing_under_the_new_name(tmp_path):
    write_figure(figure_named("gate"), tmp_path / "mine.toml")
    mine = read_example(tmp_path / "mine.toml", "my gate")
    assert (mine.name, mine.blocks, mine.grows) == ("my gate", figure_named("gate").blocks, ("posts",))
