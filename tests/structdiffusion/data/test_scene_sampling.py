import itertools

import numpy as np
import pytest

from grounding.spec import SHAPES, SLOTS_OF_SHAPE, StructureSpec
from structdiffusion.data.scene_sampling import SceneError, draw_scene, eligible, full_spec, layout_item
from structdiffusion.footprints import clear_gap, turned
from structdiffusion.geometry import yaw_of
from structdiffusion.observation import Table
from structdiffusion.protocol.semantic import check_structure
from structdiffusion.structures import STRUCTURES
from structdiffusion.structures.bodies import PlacedBody
from tests.structdiffusion.structures.handmade import carriers


def outlines(scene, poses):
    return [turned(model.footprint, yaw_of(pose)) + pose[:2, 3] for model, pose in zip(scene.models, poses)]


@pytest.mark.parametrize("shape", SHAPES)
def test_a_scene_is_clear_at_first_and_its_wish_can_be_fulfilled(shape, library):
    table = Table()
    for seed in range(8):
        rng = np.random.default_rng((seed, SHAPES.index(shape)))
        spec = full_spec(shape, rng)
        assert {slot for slot, _ in spec.tokens()} == {"shape", *SLOTS_OF_SHAPE[shape]}
        scene = draw_scene(library, spec, rng)
        initial = outlines(scene, scene.world_from_initial)
        assert min(clear_gap(a, b) for a, b in itertools.combinations(initial, 2)) > 0.02
        assert table.overhang(np.concatenate(initial)) == 0.0
        goals = scene.reference_goal_from_initial() @ scene.world_from_initial[: scene.count]
        placed = outlines(scene, goals)
        for outline, other in itertools.product(placed, initial[scene.count :]):
            assert clear_gap(outline, other) > 0.02  # the distractors leave it free
        bodies, bottoms = [], goals[:, 2, 3]
        tops = [z + model.height for model, z in zip(scene.models, bottoms)]
        for i, (model, pose) in enumerate(zip(scene.models, goals)):
            carrier = carriers(i, placed, bottoms, tops) if STRUCTURES[shape].stacks else ()
            named = (model.name, model.category)
            bodies.append(PlacedBody(*named, placed[i], pose[:2, 3], bottoms[i], tops[i], yaw_of(pose), carrier))
        failed = [check for check in check_structure(bodies, spec, table) if not check.passed]
        assert not failed, (seed, spec, failed)


def test_same_seed_same_scene(library):
    spec = StructureSpec("circle")
    first, again, other = (draw_scene(library, spec, np.random.default_rng(seed)) for seed in (3, 3, 4))
    assert [m.name for m in first.models] == [m.name for m in again.models] != [m.name for m in other.models]
    np.testing.assert_array_equal(first.world_from_initial, again.world_from_initial)


def test_categories_counts_and_distractors_are_kept_to(library):
    rng = np.random.default_rng(0)
    scene = draw_scene(library, StructureSpec("line"), rng, categories=("cup", "mug"), count=3, distractors=2)
    assert scene.count == 3 and len(scene.models) == 5
    assert all(model.category in ("cup", "mug") for model in scene.models[:3])
    assert not {model.category for model in scene.models[3:]} & {model.category for model in scene.models[:3]}
    assert len({model.name for model in scene.models}) == 5
    alone = draw_scene(library, StructureSpec("line"), rng, count=2, distractors=0)
    assert len(alone.models) == 2


def test_a_setting_has_one_base_and_one_of_each_role(library):
    for seed in range(10):
        scene = draw_scene(library, StructureSpec("table setting"), np.random.default_rng(seed), distractors=0)
        nouns = [model.category for model in scene.models]
        assert nouns[0] in ("plate", "bowl") and len(set(nouns)) == len(nouns)
        assert not {"cup", "mug"} <= set(nouns) and "box" not in nouns


def test_who_can_take_part(library):
    assert {model.category for model in eligible(library, "table setting")} == {
        "plate",
        "bowl",
        "fork",
        "knife",
        "spoon",
        "cup",
        "mug",
    }
    tower = eligible(library, "tower")
    assert tower and all(model.height < 0.16 and model.flat_bottom for model in tower)
    assert not {model.category for model in tower} & {"fork", "knife", "spoon"}
    assert all(model.flat_bottom for model in eligible(library, None))


def test_layout_items_stand_as_the_model_does(library):
    item = layout_item(library[0], 0.6)
    np.testing.assert_allclose(item.footprint, turned(library[0].footprint, 0.6))
    assert (item.front_yaw, item.height) == (0.6, library[0].height)


def test_two_are_enough_where_the_shape_is_open(library):
    two = [model for model in library if model.category == "bottle"][:2]
    drawn = draw_scene(two, StructureSpec(x_position="left"), np.random.default_rng(0), distractors=0)
    assert drawn.count == 2 and drawn.reference.spec.shape in ("line", "tower")


@pytest.mark.parametrize(
    ("spec", "options", "sentence"),
    [
        (StructureSpec("circle"), {"categories": ("teapot",)}, "cannot make a circle: only 0 of 51 objects suit"),
        (StructureSpec("table setting"), {"categories": ("box",)}, "their nouns: plate, bowl, fork, .*2 or more are"),
        (StructureSpec("tower"), {"categories": ("fork",)}, "less than 0.22 m across, lower than 0.16 m, and no cut"),
        (StructureSpec("circle"), {"categories": ("mug", "cup"), "count": 2, "attempts": 3}, "needs 3 or more"),
        (StructureSpec("line", "large", rotation="east"), {"count": 9, "attempts": 3}, "no scene in 3 attempts"),
        (StructureSpec("line", "large", rotation="east"), {"count": 9, "attempts": 3}, "and the table has room for"),
        (StructureSpec("table setting"), {"categories": ("fork", "cup"), "attempts": 2}, "a plate or a bowl"),
    ],
)
def test_what_cannot_be_drawn_is_said_in_a_sentence(library, spec, options, sentence):
    with pytest.raises(SceneError, match=sentence):
        draw_scene(library, spec, np.random.default_rng(0), **options)
