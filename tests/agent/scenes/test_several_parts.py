"""Tables that are drawn for goals of several parts: they have what the words name, and room for it."""

from functools import cache

import numpy as np
import pytest

from agent.pipeline.instruction_parser import ReadingOptions, make_interpreter
from agent.scenes.several_parts import draw_several_parts, scatter
from agent.scenes.sources import DrawnSource
from grounding.goals.goal import Goal
from grounding.interpretation import Interpretation
from grounding.interpreter import Interpreter
from structdiffusion.data.scene_sampling import SceneError
from structdiffusion.footprints import clear_gap, turned
from structdiffusion.objects.model import unique_names
from structdiffusion.observation import Table


@cache
def interpreter() -> Interpreter:
    return make_interpreter(ReadingOptions())


@pytest.fixture(scope="module")
def source() -> DrawnSource:
    return DrawnSource("ycb")


def meant(source: DrawnSource, text: str) -> Interpretation:
    goal = interpreter().interpret(text).among(source.referents, catalogue=True)
    assert goal.status == "ok", goal.message
    return goal


def drawn(source: DrawnSource, text: str, seed: int = 0) -> tuple[list[str], np.ndarray, Goal]:
    """The nouns on the table, the poses, and the goal over them."""
    goal = meant(source, text)
    models, poses = draw_several_parts(source._library, goal, np.random.default_rng(seed))
    names = unique_names(models)
    return [model.category for model in models], poses, goal.among(names).goal


@pytest.mark.parametrize("seed", range(3))
def test_every_part_has_its_objects_and_others_have_other_nouns(source, seed):
    nouns, _, goal = drawn(source, "put the apple on the plate, then line up the cans behind it", seed)
    apple, plate, cans = goal.parts[0].objects, goal.parts[0].reference, goal.parts[1].objects
    assert [nouns[i] for i in (*apple, *plate)] == ["apple", "plate"]
    assert len(cans) >= 2 and {nouns[i] for i in cans} == {"can"}
    others = set(range(len(nouns))) - {*apple, *plate, *cans}
    assert not {nouns[i] for i in others} & {"apple", "plate", "can"} and len(others) <= 2


def test_a_number_is_kept(source):
    for seed in range(3):
        nouns, _, goal = drawn(source, "stack two cans and put three cups in a row behind it", seed)
        assert [len(part.objects) for part in goal.structures] == [2, 3]


def test_a_model_stands_there_several_times_where_the_library_has_too_few(source):
    nouns, _, goal = drawn(source, "put the mugs in a line and the bowl to the left of it")
    assert nouns.count("mug") == 2 == len(goal.parts[0].objects)


def test_groups_can_be_told_apart(source):
    goal = meant(source, "sort the objects by colour")
    models, _ = draw_several_parts(source._library, goal, np.random.default_rng(2))
    colors = [
        next(iter(each.attributes.colors))
        for each in source.referents
        for model in models
        if each.name == model.category
    ]
    assert len(models) >= 4 and len(set(colors)) >= 2


def test_what_is_moved_has_room_where_it_goes(source):
    """A mug that moves 30 cm to the left stands at least as far from the left edge."""
    for seed in range(4):
        _, poses, goal = drawn(source, "move the mug 30 cm to the left", seed)
        assert poses[goal.parts[0].objects[0]][1, 3] + 0.30 < Table().y_max


def test_the_same_seed_draws_the_same(source):
    one, same, other = (drawn(source, "swap the mug and the bowl", seed)[1] for seed in (5, 5, 6))
    assert np.array_equal(one, same) and not np.array_equal(one, other)


def test_what_no_table_has_room_for_is_said(source):
    with pytest.raises(SceneError, match="no scene in 60 draws has the objects that the instruction means: .*laid out"):
        drawn(source, "put the cups in a row 60 cm apart")


def test_first_places_are_clear_of_each_other_and_on_the_table(source):
    models = [model for model in source._library if model.flat_bottom][:8]
    poses = scatter(models, np.random.default_rng(0))
    outlines = [
        turned(model.footprint, np.arctan2(pose[1, 0], pose[0, 0])) + pose[:2, 3]
        for model, pose in zip(models, poses, strict=True)
    ]
    assert all(Table().overhang(outline) == 0 for outline in outlines)
    gaps = [clear_gap(one, other) for k, one in enumerate(outlines) for other in outlines[:k]]
    assert min(gaps) > 0.03
    assert scatter(models * 4, np.random.default_rng(0)) is None
