"""`structagent generate` from end to end, small."""

import json
import os
from itertools import islice

import numpy as np
import pytest
import trimesh

from agent.cli.app import command_line
from agent.runtime.jsonl_journal import locked_folder
from agent.training import sentence_embeddings
from grounding.atomic_files import OpenFolder
from grounding.corpus.grammar import all_sentences
from structdiffusion.data import demonstrations


@pytest.fixture
def line(tmp_path, monkeypatch) -> list[str]:
    """A command line that draws eight scenes of six boxes; sentences are few, because embedding them takes long."""
    monkeypatch.setattr(demonstrations, "SHARD_SCENES", 4)
    monkeypatch.setattr(demonstrations, "PROVEN", 0)
    monkeypatch.setattr(sentence_embeddings, "all_sentences", lambda shapes: islice(all_sentences(shapes), 20))
    meshes = tmp_path / "boxes"
    meshes.mkdir()
    for number in range(6):
        trimesh.creation.box((0.05, 0.05, 0.04 + 0.005 * number)).export(meshes / f"box_{number}.stl")
    wanted = ["--scenes", "8", "--pairs", "30", "--objects", str(meshes), "--seed", "4"]
    return ["generate", "--out", str(tmp_path / "data"), *wanted, "--workers", "1"]


def test_data_and_their_datasheet_are_written_and_kept(line, tmp_path, capsys):
    assert command_line(line) == 0
    data = tmp_path / "data"
    said = capsys.readouterr().out
    assert said.startswith("8 scenes, 30 pairs and ") and said.endswith(f"see {data / 'datasheet.md'}\n")
    sheet = json.loads((data / "datasheet.json").read_text())
    assert (sheet["library"], sheet["seed"]) == (str(tmp_path / "boxes"), 4)
    assert sheet["objects_per_source"] == {"folder": 6}
    assert sheet["sentences"] == len(np.load(data / "language.npz")["words"]) > 0
    assert "--seed 4" in (data / "datasheet.md").read_text()
    files = ("library.npz", "language.npz", "pairs.npz", "shard_00000.npz", "shard_00001.npz")
    before = {name: (data / name).stat().st_mtime_ns for name in files}
    (data / "datasheet.md").unlink()
    assert command_line(line) == 0  # of a finished folder, only the datasheet is written
    assert {name: (data / name).stat().st_mtime_ns for name in files} == before
    assert (data / "datasheet.md").is_file()


@pytest.mark.usefixtures("in_this_process")
def test_a_folder_with_other_scenes_is_bad_input(line, capsys):
    assert command_line(line) == 0
    capsys.readouterr()
    assert command_line([*line, "--seed", "5"]) == 6
    assert "has scenes of seed 4, and not of seed 5" in capsys.readouterr().err


@pytest.mark.usefixtures("in_this_process")
def test_what_is_torn_is_bad_input(line, tmp_path, capsys):
    assert command_line(line) == 0
    data = tmp_path / "data"
    whole = {name: (data / name).read_bytes() for name in ("library.npz", "shard_00000.npz", "pairs.npz", "seed.json")}
    for name, content in whole.items():
        (data / name).write_bytes(content[: len(content) // 2])
        capsys.readouterr()
        assert command_line(line) == 6
        assert f"structagent: {data / name} " in capsys.readouterr().err
        if name == "shard_00000.npz":  # what is said to help does
            (data / name).unlink()
            assert command_line(line) == 0
        (data / name).write_bytes(content)
    trained = ["train", "structure", "--data", str(data), "--out", str(tmp_path / "run"), "--device", "cpu"]
    (data / "datasheet.json").write_text("{")
    assert command_line([*trained, "--steps", "1"]) == 6
    assert "datasheet.json is not a datasheet; `structagent generate" in capsys.readouterr().err


def test_a_cluster_that_is_not_there(line, capsys):
    assert command_line([*line, "--ray", "127.0.0.1:1"]) == 2
    assert "--ray cannot be '127.0.0.1:1'" in capsys.readouterr().err


def drawn_but_for_the_second(seed, scenes, proven, models, job):
    if job == (1, False):
        os._exit(9)
    return demonstrations.draw_shard(models, seed, job[0], scenes, proven, job[1])


def test_a_worker_that_dies_costs_its_shard_and_the_same_command_draws_it(line, tmp_path, monkeypatch, capsys):
    data = tmp_path / "data"
    with monkeypatch.context() as patched:
        patched.setattr(demonstrations, "_drawn", drawn_but_for_the_second)
        assert command_line(line) == 1
    said = "structagent: 1 of 2 shards of scenes are missing (worker died (exit code 9)); the same command again makes"
    assert said in capsys.readouterr().err
    assert (data / "shard_00000.npz").is_file() and not (data / "shard_00001.npz").exists()
    assert (data / "pairs.npz").is_file() and not (data / "datasheet.json").exists()
    before = (data / "shard_00000.npz").stat().st_mtime_ns
    assert command_line(line) == 0
    assert (data / "shard_00001.npz").is_file() and (data / "datasheet.json").is_file()
    assert (data / "shard_00000.npz").stat().st_mtime_ns == before


class Killed(BaseException):
    """Ends a command as a signal does."""


@pytest.mark.usefixtures("in_this_process")
@pytest.mark.parametrize("writes", [1, 2, 3, 5, 7])
def test_what_was_killed_at_any_write_becomes_what_was_not(writes, line, tmp_path, monkeypatch):
    """The files of the data are the same to the byte: library, seed, shards, pairs, sentences."""
    assert command_line(line) == 0
    (tmp_path / "data").rename(tmp_path / "whole")
    replace, left = OpenFolder.replace, iter([True] * writes)

    def killed(place, *names):
        if not next(left, False):
            raise Killed
        replace(place, *names)

    with monkeypatch.context() as patch:
        patch.setattr(OpenFolder, "replace", killed)
        with pytest.raises(Killed):
            command_line(line)
    if (facts := tmp_path / "data" / "shards.jsonl").exists():
        facts.write_bytes(facts.read_bytes()[:-9])  # the line that was written last is torn
    assert command_line(line) == 0
    whole, resumed = ({path.name: path for path in (tmp_path / name).iterdir()} for name in ("whole", "data"))
    assert resumed.keys() == whole.keys()
    for name in whole.keys() - {"datasheet.json", "datasheet.md", "shards.jsonl"}:
        assert resumed[name].read_bytes() == whole[name].read_bytes(), name
    sheets = [json.loads((tmp_path / name / "datasheet.json").read_text()) for name in ("whole", "data")]
    assert sheets[0]["sha256"] == sheets[1]["sha256"]


def test_two_cannot_generate_into_one_folder(line, tmp_path, capsys):
    with locked_folder(tmp_path / "data", "structagent generate"):
        assert command_line(line) == 2
    assert "another structagent generate is at work in" in capsys.readouterr().err
