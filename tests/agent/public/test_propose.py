"""Proposals: rigid poses that do what was asked for, the same for the same seed,
and one sentence where there are none.
"""

import json
import pickle
import shutil
import threading
from pathlib import Path

import numpy as np
import pytest
import structagent
import torch
from structagent import Scene, StructagentError, StructureSpec

import structdiffusion
from tests.agent.public.conftest import PLACES, box_cloud

FAST = {"model": "geometric", "count": 4}
CIRCLE = {"shape": "circle", "size": None, "x_position": None, "y_position": None, "rotation": None}


def refused(*arguments, exit_code: int, **options) -> str:
    with pytest.raises(StructagentError) as caught:
        structagent.propose(*arguments, **{**FAST, **options})
    assert caught.value.exit_code == exit_code, caught.value
    assert "\n" not in str(caught.value) and caught.value.__cause__ is None
    return str(caught.value)


def assert_rigid(motions: np.ndarray) -> None:
    turns = motions[:, :3, :3]
    assert motions.dtype == np.float64 and np.isfinite(motions).all()
    assert np.allclose(turns @ turns.transpose(0, 2, 1), np.eye(3), atol=1e-5)
    assert np.allclose(np.linalg.det(turns), 1.0, atol=1e-5)
    assert np.array_equal(motions[:, 3], np.tile((0.0, 0.0, 0.0, 1.0), (len(motions), 1)))


def circle_of(places: np.ndarray) -> tuple[np.ndarray, float]:
    """Centre (2,) and radius of the least-squares circle of places (N, 2)."""
    a = np.column_stack((2 * places, np.ones(len(places))))
    x, y, c = np.linalg.lstsq(a, (places**2).sum(axis=1), rcond=None)[0]
    return np.array((x, y)), float(np.sqrt(c + x * x + y * y))


def middles(clouds) -> np.ndarray:
    """(N, 2) of the boxes: the middle of each from above."""
    return np.array([(cloud[:, :2].min(axis=0) + cloud[:, :2].max(axis=0)) / 2 for cloud in clouds])


def test_a_circle_on_the_left_is_one_by_the_evaluation_protocol(clouds):
    """Judged here by the protocol's own sentences, without a line of the package."""
    found = structagent.propose(clouds, "put everything in a circle on the left", count=24, seed=1)
    assert found.spec == StructureSpec("circle", x_position="left") and found.moved == (0, 1, 2, 3)
    assert found.status == "ok" and found.proposed == 24
    assert_rigid(found.best.goal_from_initial)
    places = middles(found.clouds_after())
    centre, radius = circle_of(places)
    off = np.abs(np.linalg.norm(places - centre, axis=1) - radius)
    assert off.max() <= max(0.02, 0.15 * radius)
    angles = np.sort(np.arctan2(*(places - centre).T[::-1]))
    gaps = np.diff(np.append(angles, angles[0] + 2 * np.pi))
    assert gaps.max() <= 1.6 * gaps.mean()
    # left: the upper third of where the centre can lie with everything on the table
    assert centre[1] > 0.0 and places[:, 1].max() <= 0.45
    # everything stays upright and on the table
    assert all(abs(cloud[:, 2].min()) < 0.02 for cloud in found.clouds_after())


def test_a_line_is_straight_with_the_learned_model(clouds):
    found = structagent.propose(clouds, {"shape": "line"}, count=16)
    places = middles(found.clouds_after())
    centred = places - places.mean(axis=0)
    assert np.abs(centred @ np.linalg.svd(centred)[2][1]).max() <= 0.02


def test_a_tower_stacks(clouds):
    after = structagent.propose(clouds[:2], {"shape": "tower"}, model="geometric", count=8).clouds_after()
    lower, upper = sorted(after, key=lambda cloud: cloud[:, 2].min())
    assert upper[:, 2].min() > 0.06 and np.linalg.norm(middles([lower])[0] - middles([upper])[0]) < 0.02


def test_poses_scores_and_order(clouds):
    found = structagent.propose(clouds, CIRCLE, count=12, model="diffusion-tokens", keep_invalid=True)
    assert len(found) == found.proposed == 12
    for each in found:
        assert_rigid(each.goal_from_initial)
        assert each.goal_from_initial.shape == (4, 4, 4)
        assert all(0.0 <= score <= 1.0 + 1e-9 for score in each.scores.values())
        with pytest.raises(ValueError, match="read-only"):
            each.goal_from_initial[0, 0, 3] = 1.0
    assert found[0] is found.best and found.best.valid and found[-1].score <= found[0].score
    valid = structagent.propose(clouds, CIRCLE, count=12, model="diffusion-tokens")
    assert [each.scores for each in valid] == [each.scores for each in found if each.valid]


def test_the_same_seed_gives_the_same_and_another_does_not(clouds):
    def poses(**options):
        return structagent.propose(clouds, CIRCLE, count=3, **options).best.goal_from_initial

    three, drawing = poses(seed=3), torch.Generator().manual_seed(5)
    assert np.array_equal(three, poses(seed=np.int64(3))) and not np.allclose(three, poses(seed=4))
    assert np.array_equal(poses(), poses(seed=0))
    one, next_one, other = (poses(generator=each) for each in (drawing, drawing, torch.Generator().manual_seed(5)))
    assert np.array_equal(one, other) and not np.allclose(one, next_one)
    one, other = (poses(generator=np.random.default_rng(5)) for _ in range(2))
    assert np.array_equal(one, other) and not np.allclose(one, poses(seed=5))


def test_nothing_global_is_changed(clouds):
    threads = torch.get_num_threads()
    torch.manual_seed(7)
    np.random.seed(7)
    expected = torch.rand(3), np.random.rand(3)
    torch.manual_seed(7)
    np.random.seed(7)
    torch.set_num_threads(2)
    try:
        structagent.propose(clouds, CIRCLE, count=4)
        with pytest.raises(StructagentError):
            structagent.propose(clouds, "build a house", count=4)
        assert torch.get_num_threads() == 2
    finally:
        torch.set_num_threads(threads)
    assert torch.equal(torch.rand(3), expected[0]) and np.array_equal(np.random.rand(3), expected[1])


def test_the_number_of_threads_changes_no_result(clouds):
    threads, found = torch.get_num_threads(), []
    try:
        for number in (1, 2):
            torch.set_num_threads(number)
            found.append(structagent.propose(clouds, CIRCLE, count=6).best.goal_from_initial)
    finally:
        torch.set_num_threads(threads)
    assert np.array_equal(*found)


def test_only_the_objects_that_the_sentence_means_move(clouds):
    names = ["cup", "plate", "cup", "cup"]
    found = structagent.propose(clouds, "put the cups in a line", names=names, count=16)
    assert found.moved == (0, 2, 3)
    assert np.array_equal(found.best.goal_from_initial[1], np.eye(4))
    assert np.allclose(found.clouds_after()[1], clouds[1], atol=1e-6)
    # the plate is an obstacle: nothing is put where it stands
    distance = np.linalg.norm(middles(found.clouds_after()) - middles([clouds[1]]), axis=1)
    assert (distance[[0, 2, 3]] > 0.05).all()


def test_slots_move_the_objects_that_are_listed(clouds):
    for objects in ([0, 3], ["object 4", "object 1"], np.array([3, 0])):
        found = structagent.propose(clouds, {"shape": "line"}, objects=objects, **FAST)
        assert found.moved == (0, 3) and np.array_equal(
            found.best.goal_from_initial[1:3], np.tile(np.eye(4), (2, 1, 1))
        )


def test_what_was_understood_but_cannot_be_is_said(clouds):
    message = refused(clouds[:2], "stack everything into a large tower", exit_code=3)
    assert message.startswith("'large' in 'stack everything into a large tower' cannot be built; leave it out"), message


def test_what_was_not_understood_is_remarked(clouds):
    names = ["cup", "cup", "cup", "plate"]
    found = structagent.propose(clouds, "put the shiny cups in a line", names=names, **FAST)
    assert any("shiny" in note for note in found.notes), found.notes


def test_what_stands_on_another_object_needs_its_bottom(clouds):
    clouds[1] = box_cloud(*PLACES[0], side=0.03) + (0.0, 0.0, 0.08)
    bottoms = [0.0, 0.08, 0.0, 0.0]
    after = structagent.propose(clouds, {"shape": "line"}, bottoms=bottoms, **FAST).clouds_after()
    assert abs(after[1][:, 2].min()) < 0.02
    message = refused(clouds, {"shape": "line"}, bottoms=bottoms, objects=[0, 2, 3], exit_code=3)
    assert "object 2 stands on the object 1" in message


@pytest.mark.parametrize(
    ("instruction", "parts", "exit_code"),
    [
        ("bau einen Kreis aus den Tassen", ("German", "English"), 3),
        ("build a windmill", ("'a windmill' in 'build a windmill' cannot be built",), 3),
        ("good morning", ("does not ask for an arrangement",), 3),
        ("", (), 3),
        ("   \n", (), 3),
        ("put the forks in a line", ("fork",), 3),
        ("do something nice with the cups", (), 3),
        ("put the red cup and the banana in a line", (), 3),
        (b"a circle", ("the instruction cannot be b'a circle'", "legal: a sentence"), 2),
        (None, ("the instruction cannot be None",), 2),
        (["a circle"], ("the instruction cannot be ['a circle']",), 2),
        ("a circle \ud800", ("place 9",), 2),
        ({"shape": "oval"}, ("shape cannot be 'oval'", "circle, line, tower, table setting"), 3),
        ({"shape": 3}, ("shape cannot be 3", "circle, line, tower, table setting"), 2),
        ({"form": "circle"}, ("there is no slot 'form'; legal: shape, size",), 2),
        ({3: "circle"}, ("there is no slot 3",), 2),
        ({"shape": ["circle"]}, ("shape cannot be ['circle']",), 2),
        ({"shape": "tower", "size": "large"}, ("a tower has no size (got 'large')",), 3),
        ({}, ("no slot has a value; name at least one of shape",), 2),
        (dict.fromkeys(CIRCLE), ("no slot has a value",), 2),
        (StructureSpec(), ("no slot has a value",), 2),
    ],
)
def test_what_cannot_be_understood_ends_with_one_sentence(clouds, instruction, parts, exit_code):
    message = refused(clouds, instruction, names=["cup"] * 4, exit_code=exit_code)
    assert message and all(part in message for part in parts), message


def test_doubt_about_the_object_is_a_question(clouds):
    message = refused(clouds, "put the cup and the plate in a line", names=["cup", "cup", "plate", "bowl"], exit_code=3)
    assert "which one?" in message and "cup 1" in message and "cup 2" in message


@pytest.mark.parametrize(
    ("number", "instruction", "parts"),
    [
        (1, {"shape": "circle"}, ("1 of 1 objects (object 1)", "a circle takes 3 to 12")),
        (2, {"shape": "circle"}, ("2 of 2 objects", "a circle takes 3 to 12")),
        (1, {"shape": "line"}, ("a line takes 2 to 12",)),
        (1, "put everything on the left", ("a structure takes 2 to 12",)),
        (13, {"shape": "line"}, ("13 of 13 objects", "the model 'geometric' takes 12 at most")),
    ],
)
def test_too_few_and_too_many_objects(number, instruction, parts):
    many = [box_cloud(0.22 + 0.11 * (k % 5), -0.3 + 0.2 * (k // 5), 0.03) for k in range(number)]
    message = refused(many, instruction, exit_code=3)
    assert all(part in message for part in parts), message


def test_eleven_small_objects_are_taken():
    many = [box_cloud(0.22 + 0.11 * (k % 5), -0.3 + 0.2 * (k // 5), 0.03, 0.03) for k in range(11)]
    found = structagent.propose(many, CIRCLE, count=8, keep_invalid=True)
    assert found.best.goal_from_initial.shape == (11, 4, 4)


@pytest.fixture
def own_weights(tmp_path):
    """A folder with a diffusion network alone, whose config is written in another way than its card says."""
    shipped = Path(structdiffusion.__file__).parent / "weights" / "diffusion"
    shutil.copytree(shipped, tmp_path / "own" / "diffusion")
    config = tmp_path / "own" / "diffusion" / "config.json"
    config.write_text(json.dumps(json.loads(config.read_text())))
    return tmp_path / "own"


def test_own_networks_are_named_where_they_cannot_be_used(clouds, own_weights):
    plain = {"weights": own_weights, "model": "diffusion-tokens-unranked"}
    message = refused(clouds, CIRCLE, **plain, exit_code=7)
    assert "allow_unverified=True" in message and "--" not in message
    assert len(structagent.propose(clouds, CIRCLE, **plain, count=2, allow_unverified=True)) == 2
    more = {**plain, "model": "diffusion", "allow_unverified": True}
    message = refused(clouds, CIRCLE, **more, exit_code=6)
    assert "lacks structure, collision" in message and "--data SCENES" in message
    assert "own2" in refused(clouds, CIRCLE, weights=own_weights.with_name("own2"), model="diffusion", exit_code=6)


def test_networks_for_fewer_objects_say_so(clouds, own_weights):
    config = own_weights / "diffusion" / "config.json"
    config.write_text(json.dumps(json.loads(config.read_text()) | {"max_objects": 3}))
    message = refused(clouds, CIRCLE, weights=own_weights, model="diffusion-tokens-unranked", exit_code=3)
    assert "means 4 of 4 objects" in message and message.endswith("takes 3 at most")


def test_no_valid_arrangement_is_an_error_unless_it_is_asked_for():
    """Three boxes that are too large for a circle on a table of 40 cm."""
    large = [box_cloud(0.3 + 0.12 * k, -0.1 + 0.1 * k, 0.28, 0.05) for k in range(3)]
    table = (0.25, 0.65, -0.2, 0.2)
    message = refused(large, {"shape": "circle"}, table=table, model="diffusion", exit_code=4)
    assert "none of 4 " in message and "a circle of these objects is 0.6" in message and "room for 0.39 m" in message
    found = structagent.propose(large, {"shape": "circle"}, table=table, count=4, keep_invalid=True)
    assert found.status == "no valid arrangement" and len(found) == 4 and not found.best.valid
    assert "no valid arrangement" in repr(found)


@pytest.mark.parametrize(
    ("options", "parts"),
    [
        ({"model": "difusion"}, ("model cannot be 'difusion'", "did you mean 'diffusion'")),
        ({"model": None}, ("model cannot be None", "diffusion")),
        ({"model": ["diffusion"]}, ("model cannot be ['diffusion']",)),
        ({"count": 0}, ("count cannot be 0; legal: a whole number of 1 to 1024",)),
        ({"count": 10**9}, ("count cannot be 1000000000",)),
        ({"count": 2.5}, ("count cannot be 2.5",)),
        ({"count": True}, ("count cannot be True",)),
        ({"count": np.ones(3, int)}, ("count cannot be an array",)),
        ({"seed": -1}, ("seed cannot be -1; legal: a whole number of 0 to 9223372036854775807",)),
        ({"seed": 2**63}, ("seed cannot be 9223372036854775808",)),
        ({"seed": "0"}, ("seed cannot be '0'",)),
        ({"seed": 1, "generator": np.random.default_rng(0)}, ("seed and generator cannot be given together",)),
        ({"generator": 5}, ("generator cannot be 5; legal: a torch.Generator",)),
        ({"generator": np.random.RandomState(0)}, ("generator cannot be",)),
        ({"weights": 3}, ("weights cannot be 3",)),
        ({"weights": ""}, ("weights cannot be ''",)),
        ({"viewpoint": "left"}, ("viewpoint cannot be 'left'",)),
        ({"parser": "bert"}, ("parser cannot be 'bert'; legal: embedding, llm",)),
        ({"objects": [0, 1]}, ("objects= goes with slots only",)),
    ],
)
def test_options_are_checked(clouds, options, parts):
    message = refused(clouds, "put everything in a line", exit_code=2, **options)
    assert all(part in message for part in parts), message


@pytest.mark.parametrize(
    ("objects", "parts"),
    [
        (["object 9"], ("objects[0] cannot be 'object 9'", "object 1, object 2, object 3, object 4")),
        ([0, 4], ("objects[1] cannot be 4", "indices of 0 to 3")),
        ([0, -1], ("objects[1] cannot be -1",)),
        ([0, 0], ("objects names 'object 1' twice",)),
        ([0, "object 1"], ("objects names 'object 1' twice",)),
        ([], ("objects cannot be []",)),
        ("object 1", ("objects cannot be 'object 1'",)),
        ([True, False, True, True], ("objects[0] cannot be True",)),
        ([1.0, 2.0], ("objects[0] cannot be 1.0",)),
    ],
)
def test_listed_objects_are_checked(clouds, objects, parts):
    message = refused(clouds, {"shape": "line"}, objects=objects, exit_code=2)
    assert all(part in message for part in parts), message


def test_slots_are_in_the_world_frame_and_take_no_viewpoint(clouds):
    assert "viewpoint cannot be 'opposite'" in refused(clouds, {"shape": "line"}, viewpoint="opposite", exit_code=2)
    turned = structagent.propose(clouds, "put everything in a circle on the left", viewpoint="opposite", **FAST)
    assert turned.spec.x_position == "right"


def test_a_scene_takes_no_second_names(clouds):
    scene = Scene.from_clouds(clouds, names=["cup"] * 4)
    assert "names= goes with arrays only" in refused(scene, {"shape": "line"}, names=["cup"] * 4, exit_code=2)
    assert structagent.propose(scene, "put the cups in a line", **FAST).scene is scene


def test_errors_and_results_travel_between_processes(clouds):
    error = pickle.loads(pickle.dumps(StructagentError("no", 6)))
    assert (str(error), error.exit_code) == ("no", 6)
    found = structagent.propose(clouds, {"shape": "line"}, **FAST)
    again = pickle.loads(pickle.dumps(found))
    assert np.array_equal(again.best.goal_from_initial, found.best.goal_from_initial) and again.spec == found.spec


def test_it_works_after_the_folder_changed(clouds, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    found = structagent.propose(
        clouds, "put everything in a line", model="diffusion-tokens", count=4, keep_invalid=True
    )
    assert len(found) == 4
    assert list(tmp_path.iterdir()) == []


def test_models_are_loaded_once(clouds, monkeypatch):
    from structagent import engine

    from structdiffusion.planners import factory

    structagent.propose(clouds, "put everything in a line", count=2, keep_invalid=True)

    def loaded_again(*arguments, **options):
        raise AssertionError("a model was loaded twice")

    monkeypatch.setattr(factory, "load_planner", loaded_again)
    structagent.propose(clouds, "put everything in a circle", count=2, keep_invalid=True)
    with engine.computing() as one, engine.computing() as other:
        assert one is other


def test_two_threads_get_the_same_as_one(clouds):
    def work(seed: int) -> None:
        for text in ("put everything in a circle", "put everything in a line"):
            found = structagent.propose(clouds, text, count=4, seed=seed, keep_invalid=True)
            results[seed].append(found.best.goal_from_initial)

    results: dict[int, list[np.ndarray]] = {1: [], 2: []}
    work(1)
    alone = results[1]
    results[1] = []
    threads = [threading.Thread(target=work, args=(seed,)) for seed in (1, 2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(300)
    assert not any(thread.is_alive() for thread in threads)
    assert all(np.array_equal(one, other) for one, other in zip(alone, results[1], strict=True))
    assert len(results[2]) == 2 and not np.allclose(results[1][0], results[2][0])


# --- goals of several parts ------------------------------------------------------------------------

LEFT_OF = {"kind": "relation", "relation": "left of", "objects": ["can"], "reference": ["bowl"]}
NAMES = ["box", "can", "bowl", "jar"]


def test_a_goal_moves_what_its_parts_place_and_leaves_the_rest(clouds):
    found = structagent.propose(clouds, {"parts": [LEFT_OF]}, names=NAMES, seed=1, **FAST)
    assert found.moved == (1,) and found.goal.parts[0].objects == (1,) and found.goal.parts[0].reference == (2,)
    assert_rigid(found.best.goal_from_initial)
    assert np.array_equal(found.best.goal_from_initial[[0, 2, 3]], np.tile(np.eye(4), (3, 1, 1)))
    can, bowl = middles(found.clouds_after())[1:3]
    along, across = (can - bowl)[1], (can - bowl)[0]
    assert along > abs(across)  # left is +y, within 45 degrees
    goal = structagent.Goal.from_dict({"parts": [LEFT_OF | {"objects": [1], "reference": [2]}]})
    again = structagent.propose(clouds, goal, names=NAMES, seed=1, **FAST)
    assert np.array_equal(found.best.goal_from_initial, again.best.goal_from_initial)


def test_a_sentence_of_several_parts_is_parsed_and_proposed(clouds):
    text = "put the can to the left of the bowl and the box behind the jar"
    parsed, found = structagent.parse(text, NAMES), structagent.propose(clouds, text, names=NAMES, seed=0, **FAST)
    assert [part.relation for part in parsed.goal.parts] == ["left of", "behind"]
    assert parsed.goal == found.goal and found.moved == (0, 1)
    assert "can left of bowl; box behind jar; ok" in repr(found)


def test_the_goal_of_one_structure_is_that_structure(clouds):
    part = {"kind": "structure", **CIRCLE, "objects": [0, 1, 3]}
    whole = structagent.propose(clouds, {"parts": [part]}, seed=3, **FAST)
    slots = structagent.propose(clouds, CIRCLE, objects=[0, 1, 3], seed=3, **FAST)
    assert whole.goal == slots.goal and whole.moved == slots.moved == (0, 1, 3)
    assert np.array_equal(whole.best.goal_from_initial, slots.best.goal_from_initial)


@pytest.mark.parametrize(
    ("goal", "exit_code", "message"),
    [
        ({"parts": []}, 2, "the goal has no parts"),
        ({"parts": [LEFT_OF | {"objects": [9]}]}, 2, "an object of the goal cannot be 9"),
        ({"parts": [LEFT_OF | {"objects": ["kettle"]}]}, 2, "names: box, can, bowl, jar"),
        ({"parts": [LEFT_OF | {"relation": "beside"}]}, 3, "legal values: left of"),
        ({"parts": [LEFT_OF | {"distance": -0.1}]}, 3, "distance cannot be -0.1 m"),
        ({"parts": "line"}, 3, "the parts of a goal are a list"),
        ({"parts": [LEFT_OF, LEFT_OF | {"relation": "right of"}]}, 4, "part 1"),
    ],
)
def test_goals_that_cannot_be_used_are_refused(clouds, goal, exit_code, message):
    assert message in refused(clouds, goal, names=NAMES, exit_code=exit_code)


def test_objects_are_not_given_twice(clouds):
    assert "a goal itself says which" in refused(clouds, {"parts": [LEFT_OF]}, names=NAMES, objects=[0], exit_code=2)
