import json
import shutil

import numpy as np
import pytest

from structdiffusion.data.collision_pairs import generate_pairs
from structdiffusion.data.datasheet import write_datasheet
from structdiffusion.data.demonstrations import DemonstrationSet
from structdiffusion.training.run_record import about_data
from structdiffusion.word_tokens import WORDS

ABOUT = {"version": "1.0", "command": "structagent generate --seed 3", "library": "training", "seed": 3}


@pytest.fixture
def folder(data_folder, library, tmp_path):
    for path in data_folder.iterdir():
        shutil.copy(path, tmp_path)
    list(generate_pairs(library, tmp_path, 60))
    return tmp_path


def test_the_sheet_counts_what_is_there(folder, library):
    sheet = write_datasheet(folder, library, ABOUT)
    assert sheet == json.loads((folder / "datasheet.json").read_text())
    data = DemonstrationSet.load(folder)
    assert sheet["scenes"] == 24 == sum(sheet["scenes_per_shape"].values())
    assert sheet["objects"] == len(library) == sum(sheet["objects_per_category"].values())
    assert sheet["objects_per_source"] == {"procedural": len(library)}
    for shape, slots in sheet["slots"].items():
        assert sheet["scenes_per_shape"][shape] == (data.words[:, 0] == WORDS["shape", shape]).sum()
        assert sum(sheet["objects_in_a_structure"][shape].values()) == sheet["scenes_per_shape"][shape]
        assert all(sum(values.values()) == sheet["scenes_per_shape"][shape] for values in slots.values())
    opened = ((data.words[:, 0] == 1) & (data.words[:, 4] == 0)).sum()
    assert sheet["slots"]["circle"]["rotation"]["open"] == opened
    assert sum(sheet["distractors"].values()) == 24
    drawing = sheet["drawing"]
    assert drawing["scenes"] == 24 and drawing["scenes_per_second"] > 0
    assert sum(counts.get("accepted", 0) for counts in drawing["shapes"].values()) == 24
    with np.load(folder / "pairs.npz") as pairs:
        assert sheet["pairs"]["pairs"] == len(pairs["distance"]) == 60
        assert 0 < sheet["pairs"]["penetrating"] == (pairs["distance"] < -0.002).sum()


def test_a_line_that_was_torn_is_not_told_of(folder, library):
    told = folder / "shards.jsonl"
    lines = told.read_text().splitlines()
    told.write_text(lines[0][:30] + lines[1] + "\n")
    sheet = write_datasheet(folder, library, ABOUT)
    assert sheet["scenes"] == 24 and sheet["drawing"]["scenes"] == 0
    told.write_text(lines[0] + "\n" + lines[1][:30])
    assert write_datasheet(folder, library, ABOUT)["drawing"]["scenes"] == 12


def test_people_read_the_same_numbers(folder, library):
    sheet = write_datasheet(folder, library, ABOUT)
    text = (folder / "datasheet.md").read_text()
    assert "# Datasheet: 24 scenes" in text and "seed 3" in text and sheet["sha256"] in text
    circle = sheet["slots"]["circle"]["size"]
    assert f"| circle | size | small: {circle['small']}, medium: {circle['medium']}, large: {circle['large']}" in text
    tower = sheet["drawing"]["shapes"]["tower"]
    assert f"| tower | {tower['tries']} | {tower['accepted']} |" in text
    for heading in ("Objects", "Physics", "Pairs", "Known biases", "Throughput", "Licence"):
        assert f"## {heading}" in text


def test_a_training_remembers_its_data_and_scenes_that_changed_are_others(folder, library):
    sheet = write_datasheet(folder, library, ABOUT)
    remembered = about_data(folder)
    assert remembered == {
        "name": folder.name, "scenes": 24, "seed": 3, "library": "training", "objects": len(library), "version": "1.0",
        "sha256": sheet["sha256"],
    }  # fmt: skip
    (folder / "shard_00001.npz").unlink()
    assert write_datasheet(folder, library, ABOUT)["sha256"] != sheet["sha256"]
    assert about_data(folder.parent / "none") == {"name": "none"}
