import math
from dataclasses import replace

import numpy as np
import pytest
import torch

from grounding.spec import StructureSpec
from structdiffusion.completion.estimate import estimate
from structdiffusion.models.collision import CollisionDiscriminator
from structdiffusion.models.collision.model import CollisionConfig
from structdiffusion.models.structure import StructureDiscriminator
from structdiffusion.models.structure.model import StructureConfig
from structdiffusion.observation import ObjectCloud, Table
from structdiffusion.postprocessing.ranking import Ranker
from structdiffusion.word_tokens import FIRST_VOCABULARY

SPEC = StructureSpec("line", rotation="north")


class NearestPoints(torch.nn.Module):
    """A discriminator that knows: clouds whose bounding boxes overlap collide, and it was asked about so many."""

    asked = 0

    def forward(self, first, second):
        self.asked += len(first)
        low = torch.maximum(first.amin(1), second.amin(1))
        high = torch.minimum(first.amax(1), second.amax(1))
        return 100.0 * (high - low).amin(dim=1).clamp(-0.05, 0.05)


class Constant(torch.nn.Module):
    """A structure discriminator of a fixed opinion."""

    kind, config = StructureDiscriminator.kind, StructureConfig()

    def forward(self, clouds, present, nouns, words):
        return torch.full((len(clouds),), math.log(4.0))  # 0.8


def cube(name: str, y: float, x: float = 0.45) -> ObjectCloud:
    """The visible top and sides of a 6 cm cube."""
    points = np.random.default_rng(0).uniform(-0.03, 0.03, (600, 3))
    points[:300, 2], points[300:, 0] = 0.03, -0.03
    return ObjectCloud(name, "block", (points + (x, y, 0.03)).astype(np.float32))


OBJECTS = [cube("a", -0.2), cube("b", 0.0), cube("c", 0.2)]


def scores(ranker: Ranker, shifts, others=(), table=Table(), spec=SPEC):
    motions = np.tile(np.eye(4), (len(shifts), 3, 1, 1))
    motions[..., :3, 3] = shifts
    clouds = torch.from_numpy(np.stack([cloud.points[::3] for cloud in OBJECTS]))
    other_clouds = torch.from_numpy(np.stack([c.points[::3] for c in others])) if others else torch.zeros(0, 200, 3)
    estimates = [estimate(cloud) for cloud in OBJECTS]
    nouns = torch.zeros(3, dtype=torch.long)
    return ranker.scores(estimates, [estimate(c) for c in others], clouds, other_clouds, nouns, motions, spec, table)


STAY = np.zeros((3, 3))


def shift(index: int, *by: float) -> np.ndarray:
    shifts = np.zeros((3, 3))
    shifts[index] = by
    return shifts


def test_scores_lie_in_the_unit_interval_and_the_total_is_their_product():
    torch.manual_seed(0)
    ranker = Ranker(
        StructureDiscriminator(StructureConfig(width=16, layers=1)).eval(),
        CollisionDiscriminator(CollisionConfig(width=16, layers=1)).eval(),
    )
    rng = np.random.default_rng(0)
    shifts = np.concatenate((rng.normal(0, 0.15, (12, 3, 2)), np.zeros((12, 3, 1))), axis=2)
    for row in scores(ranker, shifts):
        assert set(row) == {"structure", "collision", "bounds", "checks", "support", "total"}
        assert all(0 <= value <= 1 for value in row.values())
        assert row["total"] == pytest.approx(math.prod(value for name, value in row.items() if name != "total"))


def test_a_shape_that_the_structure_discriminator_does_not_know_is_ranked_by_the_other_scores():
    judge = Constant()
    judge.config = StructureConfig(vocabulary=FIRST_VOCABULARY)
    (known,) = scores(Ranker(judge, NearestPoints()), STAY[None])
    (later,) = scores(Ranker(judge, NearestPoints()), STAY[None], spec=StructureSpec("triangle"))
    assert known["structure"] == pytest.approx(0.8)
    assert set(later) == {"collision", "bounds", "checks", "support", "total"}
    assert later["total"] == pytest.approx(math.prod(value for name, value in later.items() if name != "total"))
    (taught,) = scores(Ranker(Constant(), NearestPoints()), STAY[None], spec=StructureSpec("triangle"))
    assert taught["structure"] == pytest.approx(0.8)


def test_a_good_row_is_better_than_overlap_overhang_and_a_broken_row():
    good, overlap, overhang, broken = scores(
        Ranker(Constant(), NearestPoints()),
        np.array([STAY, shift(0, 0, 0.18, 0), np.tile([0, 0.25, 0], (3, 1)), shift(1, 0.1, 0, 0)]),
    )
    assert good["structure"] == pytest.approx(0.8)
    assert good["total"] == pytest.approx(0.8)
    assert overlap["collision"] < 0.05 and overlap["total"] < 0.05
    assert overhang["bounds"] == pytest.approx(math.exp(-3.0), rel=0.2)  # 3 cm over the edge
    assert overhang["collision"] == broken["collision"] == good["collision"] == broken["bounds"] == 1.0
    assert 0.2 < broken["checks"] < 0.5


def test_distractors_count_and_far_pairs_are_not_asked_about():
    judge = NearestPoints()
    far, near = scores(Ranker(Constant(), judge), np.array([STAY, shift(2, 0.12, 0, 0)]), others=[cube("d", 0.2, 0.6)])
    assert far["collision"] == 1.0 and near["collision"] < 0.1
    assert judge.asked == 1


def test_one_hit_among_many_pairs_is_not_averaged_away():
    """The product over pairs: two overlapping pairs weigh more than one, and one already sinks the arrangement."""
    one, two = scores(
        Ranker(Constant(), NearestPoints(), estimated_checks=False),
        np.array([shift(0, 0, 0.15, 0), [[0, 0.15, 0], [0, 0, 0], [0, -0.15, 0]]]),
    )
    assert one["collision"] < 0.5
    assert two["collision"] == pytest.approx(one["collision"] ** 2, rel=0.5)
    assert "checks" not in one


def test_the_scenes_table_is_the_bound():
    small = Table(0.40, 0.50, -0.3, 0.3)
    moves = np.array([STAY, np.tile([0.1, 0, 0], (3, 1))])
    inside, outside = scores(Ranker(Constant(), NearestPoints()), moves, table=small)
    assert inside["bounds"] == 1.0 and outside["bounds"] < 0.01


def test_the_base_of_a_setting_is_shown_first_whatever_the_order_of_the_objects():
    class Remembering(Constant):
        def forward(self, clouds, present, nouns, words):
            self.seen = clouds.mean(dim=2)[0, :, 1], nouns[0]
            return super().forward(clouds, present, nouns, words)

    structure = Remembering()
    clouds = [replace(cloud, category=noun) for cloud, noun in zip(OBJECTS, ("mug", "plate", "fork"), strict=True)]
    points = torch.from_numpy(np.stack([cloud.points for cloud in clouds]))
    for shape, order in (("table setting", [1, 0, 2]), ("line", [0, 1, 2])):
        Ranker(structure, NearestPoints()).scores(
            [estimate(cloud) for cloud in clouds], [], points, torch.zeros(0, 200, 3), torch.tensor([7, 1, 3]),
            np.tile(np.eye(4), (1, 3, 1, 1)), StructureSpec(shape), Table(),
        )  # fmt: skip
        beside, nouns = structure.seen
        assert nouns.tolist() == [[7, 1, 3][i] for i in order]
        assert beside.tolist() == pytest.approx([[-0.2, 0.0, 0.2][i] for i in order], abs=0.005)


def test_the_paper_s_mean_hides_what_the_product_shows():
    """Three objects, one pair of which collides for sure: two thirds of the pairs are free."""
    moves = np.array([shift(0, 0, 0.18, 0)])
    (mean,) = scores(Ranker(Constant(), NearestPoints(), mean_collision=True), moves)
    (product,) = scores(Ranker(Constant(), NearestPoints()), moves)
    assert product["collision"] < 0.05
    assert mean["collision"] == pytest.approx(2 / 3, abs=0.02)


def test_every_part_of_the_score_can_be_left_out():
    broken = np.array([shift(1, 0.1, 0, 0)])
    full = set(scores(Ranker(Constant(), NearestPoints()), broken)[0])
    for option, missing in (
        ("discriminators", {"structure", "collision"}),
        ("bounds", {"bounds"}),
        ("estimated_checks", {"checks", "support"}),
    ):
        (row,) = scores(Ranker(Constant(), NearestPoints(), **{option: False}), broken)
        assert set(row) == full - missing
        assert row["total"] == pytest.approx(math.prod(value for name, value in row.items() if name != "total"))


def test_the_structure_discriminator_sees_objects_in_the_order_of_their_places():
    class Remembering(Constant):
        def forward(self, clouds, present, nouns, words):
            self.seen = clouds.mean(dim=2)[..., 1]
            return super().forward(clouds, present, nouns, words)

    structure = Remembering()
    points = torch.from_numpy(np.stack([cloud.points for cloud in OBJECTS]))
    Ranker(structure, NearestPoints()).scores(
        [estimate(cloud) for cloud in OBJECTS], [], points, torch.zeros(0, 200, 3), torch.zeros(3, dtype=torch.long),
        np.tile(np.eye(4), (2, 3, 1, 1)), SPEC, Table(), np.array([[2, 0, 1], [1, 2, 0]]),
    )  # fmt: skip
    np.testing.assert_allclose(structure.seen, [[0.2, -0.2, 0.0], [0.0, 0.2, -0.2]], atol=0.005)
