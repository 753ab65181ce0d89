"""The evaluation of segmentation: labelled files are read as the database has them, and rows add up."""

import io
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from agent.cli.app import command_line
from agent.errors import BadInput
from agent.evaluation.segmentation import synthetic_tables
from agent.evaluation.segmentation.labelled_clouds import class_of, labelled_files, read_labelled
from agent.evaluation.segmentation.measurement import measure_segmentation, print_segmentation
from agent.synthetic_tables.sensors import SENSORS


def write_cloud(path, points, labels=None):
    import open3d  # a second, for the processes that run other tests

    cloud = open3d.t.geometry.PointCloud(open3d.core.Tensor(points.reshape(-1, 3).astype(np.float32)))
    if labels is not None:
        cloud.point["label"] = open3d.core.Tensor(labels.reshape(-1, 1).astype(np.uint32))
    open3d.t.io.write_point_cloud(str(path), cloud)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A table with two blocks, the second in two parts, as one row of points."""
    path = tmp_path_factory.mktemp("clouds")
    rng = np.random.default_rng(0)
    x, y = np.meshgrid(np.arange(-0.3, 0.3, 0.003), np.arange(-0.2, 0.2, 0.003))
    labels = np.ones(x.shape, dtype=int)
    labels[np.hypot(x + 0.15, y) < 0.05] = 20
    labels[np.hypot(x - 0.15, y) < 0.05] = 40
    labels[(labels == 40) & (x > 0.15)] = 41
    depth = np.where(labels == 1, 1.0, 0.93) + rng.normal(0.0, 0.0005, x.shape)
    write_cloud(path / "learn17.pcd", np.stack((x, y, depth), axis=-1), labels)
    return path


def test_parts_of_an_object_are_one(folder):
    cloud = read_labelled(folder / "learn17.pcd")
    assert np.unique(cloud.labels).tolist() == [0, 1, 2]
    assert (cloud.labels == 2).sum() == pytest.approx((cloud.labels == 1).sum(), rel=0.05)


def test_classes_follow_from_the_names_of_the_database():
    names = ("learn16", "learn17", "learn33", "test42", "test43", "test65", "desk-3", "7")
    classes = ["boxes", "stacked", "cylinders", "cylinders", "mixed", "complex", "desk", "all"]
    assert [class_of(Path(f"{name}.pcd")) for name in names] == classes


@pytest.mark.usefixtures("in_this_process")
def test_a_folder_is_measured(folder, tmp_path):
    report = measure_segmentation(folder, "test", 1, 0, 1)
    (row,) = report["rows"]
    assert row["objects"] == row["found"] == 2 and row["exact"] and row["class"] == "stacked"
    assert row["overlap"][2] > 0.95
    assert report["aggregate"]["all"]["exact"]["count"] == 1
    results = io.StringIO()
    print_segmentation(report, results)
    assert "stacked" in results.getvalue() and report["command"] in results.getvalue()


@pytest.mark.usefixtures("in_this_process")
def test_synthetic_tables_are_measured_per_class(capsys, tmp_path, monkeypatch):
    # A quarter of the pixels: how well objects are found is the subject of `tests/agent/perception`.
    smaller = {"_WIDTH": 320, "_HEIGHT": 240, "_LEAST": 100}
    for name, value in smaller.items():
        monkeypatch.setattr(synthetic_tables, name, value)
    monkeypatch.setattr(synthetic_tables, "SENSORS", [replace(one, focal=one.focal / 2) for one in SENSORS])
    out = tmp_path / "report.json"
    arguments = "evaluate segmentation --scenes 1 --workers 1 --json --out"
    assert command_line([*arguments.split(), str(out)]) == 0
    report = json.loads(capsys.readouterr().out)
    assert json.loads(out.read_text())["rows"] == report["rows"]
    classes = [
        "apart", "touching", "stacked", "inside", "occluded", "mixed", "edge", "divided", "flat", "row", "wall", "empty"
    ]  # fmt: skip
    assert [row["class"] for row in report["rows"]] == classes
    assert list(report["aggregate"]) == [*classes, "all"]
    total = sum(row["objects"] for row in report["rows"])
    assert report["aggregate"]["all"]["objects"] == total > 20
    assert all(row["sensor"] for row in report["rows"])


def test_what_is_no_labelled_cloud_is_refused(folder, tmp_path):
    with pytest.raises(BadInput, match="there is no folder"):
        labelled_files(tmp_path / "nowhere")
    with pytest.raises(BadInput, match="holds no labelled cloud"):
        labelled_files(tmp_path)
    write_cloud(tmp_path / "plain.pcd", np.random.default_rng(0).random((50, 3)))
    with pytest.raises(BadInput, match="has no field 'label'"):
        measure_segmentation(tmp_path, "test", 1, 0, 1)
