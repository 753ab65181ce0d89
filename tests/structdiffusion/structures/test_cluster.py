"""A cluster holds while narrow gaps join it and its hull is tight, and fails once that is broken."""

import math
from dataclasses import replace

import numpy as np
import pytest

from grounding.spec import StructureSpec
from structdiffusion.evaluation_protocol import MAX_CLUSTER_GAP
from structdiffusion.layouts import lay_out
from structdiffusion.objects.solids import circle_outline
from structdiffusion.observation import Table
from structdiffusion.structures.bodies import LayoutItem
from structdiffusion.structures.cluster import Cluster
from structdiffusion.structures.structure import LayoutError
from tests.structdiffusion.structures.handmade import at_places, cluster, failures

SPEC = StructureSpec("cluster")


def test_a_cluster_holds_until_a_gap_is_wider_than_4_cm():
    assert failures(cluster(), SPEC) == []
    for gap, failed in (
        (MAX_CLUSTER_GAP - 1e-3, []),
        (MAX_CLUSTER_GAP + 1e-3, ["widest gap that joins the cluster (m)"]),
    ):
        assert failures(at_places([(0, 0), (0.06 + gap, 0)]), SPEC) == failed


def test_two_halves_apart_are_no_cluster_although_each_object_has_a_neighbour():
    halves = at_places([(0, 0), (0.065, 0), (0.2, 0), (0.265, 0)])
    assert "widest gap that joins the cluster (m)" in failures(halves, SPEC)


def test_a_sparse_hull_is_no_cluster_however_narrow_the_gaps():
    long_row = at_places([(0, 0.09 * k) for k in range(-3, 4)])
    assert failures(long_row, SPEC) == []  # a row has a tight hull
    corner = at_places([(0.09 * k, 0) for k in range(4)] + [(0, 0.09 * k) for k in range(1, 5)])
    assert failures(corner, SPEC) == ["hull / area of the objects"]


def test_what_stands_on_another_is_no_cluster_in_the_plane():
    stacked = [*cluster()[:-1], replace(cluster()[-1], rests_on=(0,))]
    assert failures(stacked, SPEC) == ["objects on top of others"]


def test_the_hull_of_two_discs_is_measured_exactly():
    bodies, gap, radius = at_places([(0, 0), (0.09, 0)]), 0.03, 0.03
    check = next(one for one in Cluster().check(bodies, SPEC, Table()) if one.name.startswith("hull"))
    exact = (math.pi * radius**2 + 2 * radius * (2 * radius + gap)) / (2 * math.pi * radius**2)
    assert check.measured == pytest.approx(exact, rel=5e-3)


def test_a_large_cluster_of_broad_objects_would_fall_apart():
    items = [LayoutItem("can", circle_outline(0.04), 0.1) for _ in range(4)]
    with pytest.raises(
        LayoutError, match="a large cluster of these objects would fall apart: its gaps would be 0.0.. m wide"
    ):
        lay_out(items, StructureSpec("cluster", "large"), Table(), np.random.default_rng(0))
