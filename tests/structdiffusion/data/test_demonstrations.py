import json

import numpy as np
import pytest

from grounding.spec import StructureSpec
from structdiffusion.data import demonstrations
from structdiffusion.data.demonstrations import DataFolderError, DemonstrationSet, generate, keep_shard
from structdiffusion.data.scene_sampling import draw_scene
from structdiffusion.data.shards import draw_shard, settled_stack
from structdiffusion.geometry import pose_from_xyz_yaw
from structdiffusion.objects.solids import assemble, box, frustum
from structdiffusion.protocol.physical_stability import place_and_check
from structdiffusion.protocol.release import TabletopBodies
from structdiffusion.structures import STRUCTURES
from structdiffusion.word_tokens import WORDS

TOWER = WORDS["shape", "tower"]


@pytest.fixture(autouse=True)
def small_shards(monkeypatch, tmp_path):
    monkeypatch.setattr(demonstrations, "SHARD_SCENES", 6)
    monkeypatch.setattr(demonstrations, "PROVEN", 0)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))


def test_the_same_seed_gives_the_same_shard_and_others_differ(library, tmp_path):
    for folder, seed, number in (("a", 1, 0), ("b", 1, 0), ("c", 2, 0), ("d", 1, 1)):
        (tmp_path / folder).mkdir()
        keep_shard(tmp_path / folder, draw_shard(library, seed, number, 6))
    first, again, seeded, following = (DemonstrationSet.load(tmp_path / folder) for folder in "abcd")
    for name in DemonstrationSet.__dataclass_fields__:
        np.testing.assert_array_equal(getattr(first, name), getattr(again, name))
    assert not np.array_equal(first.initial, seeded.initial) and not np.array_equal(first.initial, following.initial)
    assert len(first) == 6


def test_a_stopped_run_writes_only_what_is_missing(library, tmp_path):
    folder = tmp_path / "data"
    assert list(generate(library, folder, 13)) == [(0, 3), (1, 3), (2, 3), (3, 3)]  # rounded up to whole shards
    before = {path.name: path.read_bytes() for path in folder.glob("shard_*")}
    times = {path.name: path.stat().st_mtime_ns for path in folder.glob("shard_*")}
    (folder / "shard_00001.npz").unlink()
    (folder / "shard_00002.77.tmp").write_bytes(b"half written")  # of a process that was stopped
    assert list(generate(library, folder, 13)) == [(2, 3), (3, 3)]
    after = {path.name: path.stat().st_mtime_ns for path in folder.glob("shard_*.npz")}
    assert {name for name in after if after[name] != times[name]} == {"shard_00001.npz"}
    stored = np.load(folder / "shard_00001.npz")
    (tmp_path / "old.npz").write_bytes(before["shard_00001.npz"])
    for name, column in np.load(tmp_path / "old.npz").items():
        np.testing.assert_array_equal(stored[name], column)
    assert len(DemonstrationSet.load(folder)) == 18
    told = [json.loads(line)["shard"] for line in (folder / "shards.jsonl").read_text().splitlines()]
    assert told == [f"shard_{number:05d}" for number in (0, 1, 2, 1)]


def test_processes_draw_what_one_does(library, tmp_path):
    for folder, workers in (("one", 1), ("two", 2)):
        list(generate(library, tmp_path / folder, 12, workers=workers))
    for number in range(2):
        one, two = (np.load(tmp_path / folder / f"shard_0000{number}.npz") for folder in ("one", "two"))
        for name, column in one.items():
            np.testing.assert_array_equal(two[name], column)


def test_other_scenes_are_not_mixed_in(library, tmp_path):
    list(generate(library, tmp_path, 6, seed=4))
    before = (tmp_path / "library.npz").stat().st_mtime_ns
    with pytest.raises(DataFolderError, match="has scenes of seed 4, and not of seed 5"):
        list(generate(library, tmp_path, 12, seed=5))
    with pytest.raises(DataFolderError, match="has other objects than the 50 given"):
        list(generate(library[:-1], tmp_path, 12, seed=4))
    assert (tmp_path / "library.npz").stat().st_mtime_ns == before
    assert len(DemonstrationSet.load(tmp_path)) == 6


def test_what_became_of_every_try_is_told(library):
    shard = draw_shard(library, 1, 0, 24, proven=1)
    shapes = shard.facts["shapes"]
    words = shard.columns["words"][:, 0]
    assert set(shapes) == set(STRUCTURES)
    for shape, counts in shapes.items():
        stacks = STRUCTURES[shape].stacks
        assert counts["tries"] == counts["accepted"] + counts["no scene"] + counts["fell"]
        assert counts["accepted"] == (words == WORDS["shape", shape]).sum()
        assert counts["proven"] == (0 if stacks else min(1, counts["accepted"]))
        assert counts["fell"] == 0 or stacks
        assert counts["stood"] == counts["proven"]  # exact shapes stand
    assert shard.facts["scenes"] == 24 and shard.facts["seconds"] > 0


def test_an_empty_folder_is_an_error_that_names_the_command(tmp_path):
    with pytest.raises(FileNotFoundError, match="has no shard_.*structagent generate"):
        DemonstrationSet.load(tmp_path)


def test_rows_are_complete(data_folder, library):
    data = DemonstrationSet.load(data_folder)
    assert len(data) == 24 and len(set(data.words[:, 0])) > 6
    for row in range(24):
        there = data.objects[row] >= 0
        count = int(there[:7].sum())
        assert there[:count].all() and count >= 2
        assert len(set(data.objects[row][there])) == there.sum()  # nothing twice
        assert (data.initial[row][~there] == 0).all() and (data.goal[row][~there[:7]] == 0).all()
        assert (np.abs(data.initial[row][there][:, :2] - (0.45, 0.0)) < (0.27, 0.45)).all()
        tower = data.words[row, 0] == TOWER
        heights = data.goal[row, :count, 2]
        if data.words[row, 0] == WORDS["shape", "pyramid"]:
            assert (heights[:2] < 0.002).all() and heights[-1] > 0.005
        else:
            assert (np.diff(heights) > 0.005).all() if tower else (heights < 0.002).all()


def test_stored_towers_stand(data_folder, library):
    """Built once more from the stored goals under the evaluation protocol, nothing tips or slides."""
    data, built = DemonstrationSet.load(data_folder), 0
    for row in np.flatnonzero(data.words[:, 0] == TOWER)[:3]:
        count = int((data.objects[row, :7] >= 0).sum())
        models = [library[i] for i in data.objects[row, :count]]
        starts, goals = data.initial[row, :count].astype(float), data.goal[row, :count].astype(float)
        initial = np.array([pose_from_xyz_yaw(x, y, 0.0, yaw) for x, y, yaw in starts])
        goal = np.array([pose_from_xyz_yaw(*at[:3], start[2] + at[3]) for at, start in zip(goals, starts)])
        bodies, motions = TabletopBodies(models, initial), goal @ np.linalg.inv(initial)
        verdict = place_and_check(bodies, motions, StructureSpec("tower"))
        assert verdict.success, (row, verdict)
        built += 1
    assert built >= 2


def solid(name: str, *parts: np.ndarray):
    return assemble(
        name, name, parts, density=500, friction=0.6, color=(1, 0, 0), source="procedural", rng=np.random.default_rng(0)
    )


def test_settling_gives_the_true_heights_and_refuses_a_tower_that_falls():
    blocks = [solid("block", box(0.08, 0.08, 0, 0.05)), solid("can", frustum(0.03, 0.03, 0, 0.06))]
    scene = draw_scene(blocks, StructureSpec("tower"), np.random.default_rng(0), distractors=0, count=2)
    heights = {"block": 0.05, "can": 0.06}
    order = scene.reference.order
    planned = scene.reference_goal_from_initial() @ scene.world_from_initial[:2]
    settled = settled_stack(scene, planned)
    bottom, top = order
    assert settled[bottom, 2, 3] == pytest.approx(0.0, abs=1.5e-3)
    assert settled[top, 2, 3] == pytest.approx(heights[scene.models[bottom].category], abs=1.5e-3)
    np.testing.assert_allclose(settled[:, :2, 3], planned[:, :2, 3], atol=2e-3)
    off = planned.copy()
    off[top, 0, 3] += 0.055  # its centre is beyond the edge
    assert settled_stack(scene, off) is None


def test_crowded_scenes_have_more_objects_and_share_a_folder_with_the_others(library, tmp_path):
    assert list(generate(library, tmp_path, 6, crowded=6, seed=3))[-1] == (2, 2)
    crowded, usual = (np.load(tmp_path / f"shard_{name}00000.npz") for name in ("crowded_", ""))
    assert crowded["goal"].shape == (6, 10, 4) and usual["goal"].shape == (6, 7, 4)
    beside = crowded["words"][:, 0] != TOWER
    taking_part = (crowded["objects"][:, :10] >= 0).sum(axis=1)
    assert (taking_part[beside] >= 7).all() and taking_part.max() > 7
    both = DemonstrationSet.load(tmp_path)
    assert len(both) == 12 and both.objects.shape == (12, 12)
    np.testing.assert_array_equal(both.objects[6:], crowded["objects"])
    np.testing.assert_array_equal(both.objects[:6, :7], usual["objects"][:, :7])
    np.testing.assert_array_equal(both.objects[:6, 10:], usual["objects"][:, 7:])
    assert (both.objects[:6, 7:10] == -1).all() and (both.goal[:6, 7:] == 0).all()
    told = [json.loads(line)["shard"] for line in (tmp_path / "shards.jsonl").read_text().splitlines()]
    assert sorted(told) == ["shard_00000", "shard_crowded_00000"]
