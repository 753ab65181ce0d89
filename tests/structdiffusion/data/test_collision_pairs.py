import numpy as np
import pytest
import torch

from structdiffusion.data.collision_pairs import generate_pairs
from structdiffusion.data.demonstrations import save_library
from structdiffusion.footprints import clear_gap, overlap_depths, turned
from structdiffusion.models.collision.loss import PairBatches
from structdiffusion.objects.solids import assemble, box


@pytest.fixture(scope="module")
def boxes():
    sizes = [(0.06, 0.06, 0.05), (0.12, 0.05, 0.08), (0.09, 0.07, 0.03)]
    return [
        assemble(
            f"box_{i}",
            "box",
            [box(x, y, 0, z)],
            density=500,
            friction=0.6,
            color=(1, 0, 0),
            source="procedural",
            rng=np.random.default_rng(i),
        )
        for i, (x, y, z) in enumerate(sizes)
    ]


@pytest.fixture(scope="module")
def folder(boxes, tmp_path_factory):
    folder = tmp_path_factory.mktemp("pairs")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.mktemp("cache")))
        save_library(boxes, folder)
        assert list(generate_pairs(boxes, folder, 300, seed=1)) == [(0, 1), (1, 1)]
        (folder / "again").mkdir()
        list(generate_pairs(boxes, folder / "again", 300, seed=1))
    return folder


def true_distance(boxes, ids, poses) -> float:
    """The signed distance of upright boxes: negative by the shortest way out, sideways or up."""
    a, b = (boxes[i] for i in ids)
    outlines = [turned(model.footprint, pose[3]) + pose[:2] for model, pose in zip((a, b), poses)]
    aside = clear_gap(*outlines)
    apart = max(poses[1][2] - (poses[0][2] + a.height), poses[0][2] - (poses[1][2] + b.height))
    if aside > 0 or apart > 0:
        return float(np.hypot(aside, max(apart, 0.0)))
    return max(-overlap_depths(*(outline[None] for outline in outlines))[0], apart)


def test_distances_of_boxes_are_right_in_sign_and_size(boxes, folder):
    with np.load(folder / "pairs.npz") as pairs:
        objects, poses, distance = pairs["objects"], pairs["poses"].astype(float), pairs["distance"]
    assert objects.shape == (300, 2) and poses.shape == (300, 2, 4) and (objects[:, 0] != objects[:, 1]).all()
    true = np.array([true_distance(boxes, *row) for row in zip(objects, poses)])
    np.testing.assert_allclose(distance, np.minimum(true, 0.03), atol=1.5e-3)
    clear = np.abs(true) > 1e-3
    assert (np.sign(distance[clear]) == np.sign(true[clear])).all()


def test_pairs_are_near_contact_on_both_sides_and_some_are_stacked(folder):
    with np.load(folder / "pairs.npz") as pairs:
        distance, lift = pairs["distance"], pairs["poses"][:, 1, 2]
    hit = distance < -0.002
    assert 0.25 < hit.mean() < 0.75
    assert (np.abs(distance) < 0.02).mean() > 0.6
    stacked = lift > 0
    assert 0.15 < stacked.mean() < 0.35
    assert hit[stacked].any() and not hit[stacked].all()


def test_same_seed_same_pairs(folder):
    with np.load(folder / "pairs.npz") as first, np.load(folder / "again" / "pairs.npz") as again:
        for name in first:
            np.testing.assert_array_equal(first[name], again[name])


def test_drawn_clouds_lie_as_far_apart_as_the_pair(folder):
    pairs = PairBatches.load(folder)
    first, second, distance = pairs.draw(64, torch.Generator().manual_seed(0))
    assert first.shape == second.shape == (64, 256, 3)
    again = pairs.draw(64, torch.Generator().manual_seed(0))
    assert torch.equal(first, again[0]) and torch.equal(distance, again[2])
    nearest = torch.cdist(first, second).flatten(1).min(dim=1).values
    # A partial view can hide the nearest points, but cannot bring apart things together.
    apart = distance > 0.005
    assert apart.sum() > 5
    assert (nearest[apart] > distance[apart] - 0.008).all()


def test_missing_pairs_are_named(folder, tmp_path):
    with pytest.raises(FileNotFoundError, match="has no library.npz; make it with `structagent generate"):
        PairBatches.load(tmp_path)
    (tmp_path / "library.npz").write_bytes((folder / "library.npz").read_bytes())
    with pytest.raises(FileNotFoundError, match="has no pairs.npz"):
        PairBatches.load(tmp_path)


def test_a_stopped_run_draws_only_the_groups_that_are_missing(tmp_path):
    library = [
        assemble(
            f"box_{i}", "box", [box(0.04 + 0.004 * i, 0.05, 0, 0.05)], density=500, friction=0.6, color=(1, 0, 0),
            source="procedural", rng=np.random.default_rng(i),
        )
        for i in range(12)
    ]  # fmt: skip
    save_library(library, tmp_path)
    run = generate_pairs(library, tmp_path, 40)
    assert [next(run), next(run)] == [(0, 2), (1, 2)]
    run.close()  # stopped: one of two groups is there
    assert not (tmp_path / "pairs.npz").exists()
    assert list(generate_pairs(library, tmp_path, 40)) == [(1, 2), (2, 2)]
    assert not list(tmp_path.glob("pairs_*"))
    (tmp_path / "whole").mkdir()
    list(generate_pairs(library, tmp_path / "whole", 40))
    with np.load(tmp_path / "pairs.npz") as pairs, np.load(tmp_path / "whole" / "pairs.npz") as whole:
        for name, column in whole.items():
            np.testing.assert_array_equal(pairs[name], column)
    before = (tmp_path / "pairs.npz").stat().st_mtime_ns
    assert list(generate_pairs(library, tmp_path, 40)) == [(2, 2)]
    assert (tmp_path / "pairs.npz").stat().st_mtime_ns == before
