"""Scenes of figures, their examples, template copies, and the blind classifier."""

import numpy as np
import pytest

from grounding.figures.figure import Figure
from grounding.figures.growth import supports_of
from grounding.figures.names import figure_named, shipped_names
from structdiffusion.benchmark.figure_classifier import NAMES, named
from structdiffusion.benchmark.figure_examples import METHODS, copied, example_of
from structdiffusion.benchmark.figure_families import COUNTS, FIGURE_FAMILIES, TRANSFERS, counts_of
from structdiffusion.benchmark.goals import draw_goal_scene
from structdiffusion.figures.curves import similarity
from structdiffusion.objects.blocks import block_objects
from structdiffusion.objects.procedural import procedural_objects
from structdiffusion.observation import Table
from tests.structdiffusion.structures.test_flat_figure import built, cans
from tests.structdiffusion.structures.test_upright_figure import built as built_up
from tests.structdiffusion.structures.test_upright_figure import items_for


@pytest.fixture(scope="module")
def library():
    return (*procedural_objects(60), *block_objects())


def test_counts_are_legal_and_change_as_the_protocol_says():
    assert len(COUNTS) == 12 and set(FIGURE_FAMILIES) == set(shipped_names())
    for name, counts in COUNTS.items():
        legal = figure_named(name).legal
        assert {counts.usual, *counts.fewer, *counts.more} <= set(legal), name
        assert 0.59 <= counts.fewer[1] / counts.fewer[0] <= 0.72 and 1.5 <= counts.more[1] / counts.more[0] <= 2.0, name
    assert all(counts_of(name).usual in figure_named(name).legal for name in FIGURE_FAMILIES)


@pytest.mark.parametrize("family", ("letter L", "gate"))
def test_a_scene_can_be_solved_and_has_the_objects_of_its_transfer(library, family):
    for number, transfer in enumerate(TRANSFERS):
        scene = draw_goal_scene(library, family, number, seed=3)
        (part,) = scene.goal.structures
        assert scene.kind == transfer and part.shape == family
        assert len(part.objects) == COUNTS[family].of(transfer)[1]
        assert len(scene.models) - len(part.objects) >= (2 if transfer == "distractors" else 0)
        example = example_of(scene, library)
        assert len(example.middles) == COUNTS[family].of(transfer)[0]
        again = draw_goal_scene(library, family, number, seed=3, accepted=scene.draw)
        assert [one.name for one in again.models] == [one.name for one in scene.models]


def test_every_method_makes_a_figure_of_the_number(library):
    scene = draw_goal_scene(library, "stairs", 3, seed=3)
    example = example_of(scene, library)
    for method, make in METHODS.items():
        figure = make(example, "stairs", 10)
        assert isinstance(figure, Figure) and 10 in figure.legal, method


def test_a_template_has_the_examples_places_and_nothing_more(library):
    scene = draw_goal_scene(library, "letter L", 0, seed=3)
    example = example_of(scene, library)
    same = np.array([stroke[0] for stroke in copied(example, len(example.middles)).strokes])
    scale, _, _ = similarity(same, example.middles)
    assert np.allclose(np.ptp(same, axis=0) * scale, np.ptp(example.middles, axis=0))
    fewer, more = copied(example, 4), copied(example, 9)
    assert fewer.legal == (4,) and more.legal == (9,)
    assert all(len(stroke) == 1 for stroke in (*fewer.strokes, *more.strokes))
    stairs = example_of(draw_goal_scene(library, "stairs", 0, seed=3), library)
    assert sum(block.level == 0 for block in copied(stairs, 8).blocks) == 5
    assert len(supports_of(copied(stairs, 4).blocks)) == 4


@pytest.mark.parametrize("name", ("letter T", "heart", "star", "chessboard", "zigzag"))
def test_a_flat_figure_is_named(name):
    bodies = built(name, cans(*[0.03] * COUNTS[name].usual), size="small")
    assert named(bodies, Table()) == name


@pytest.mark.parametrize("name", ("gate", "stairs", "castle"))
def test_an_upright_figure_is_named(name):
    count = COUNTS[name].usual if name in COUNTS else 6
    assert name in NAMES and named(built_up(name, items_for(name, count)), Table()) == name
