"""Scenes from elsewhere, runs with listeners, and evaluations, called from Python."""

import json
import re
import threading

import numpy as np
import pytest
import structagent
import torch
from structagent import StructagentError

CUPS = "put the cups in a small circle on the left"
FAST = {"model": "geometric", "execute": False}


def refused(call, *arguments, exit_code: int, **options) -> str:
    with pytest.raises(StructagentError) as caught:
        call(*arguments, **options)
    assert caught.value.exit_code == exit_code, caught.value
    assert "\n" not in str(caught.value) and "--" not in str(caught.value)
    return str(caught.value)


def test_a_scene_for_an_instruction_is_what_its_run_sees():
    """The proposals for the scene are those of the run, to the bit."""
    scene = structagent.load_scene(instruction=CUPS, seed=2)
    found = structagent.propose(scene, CUPS, model="diffusion-tokens", seed=2)
    result = structagent.run(CUPS, model="diffusion-tokens", seed=2, execute=False)
    assert result.success and result.exit_code == 0 and result.message == ""
    assert result.names == scene.names and result.moved == found.moved
    assert np.array_equal(result.goal_from_initial, found.best.goal_from_initial)
    assert result.spec == found.spec and all(check["passed"] for check in result.checks)


def test_a_drawn_scene_can_be_talked_about():
    scene, other = (structagent.load_scene(objects="procedural", seed=seed) for seed in (3, 4))
    again = structagent.load_scene(objects="procedural", seed=3)
    assert all(np.array_equal(one, two) for one, two in zip(scene.clouds, again.clouds, strict=True))
    assert not np.array_equal(scene.clouds[0], other.clouds[0])
    assert len(set(scene.names)) == len(scene) and scene.image.dtype == np.uint8
    for cloud, color in zip(scene.clouds, scene.colors, strict=True):
        assert cloud.dtype == np.float32 and cloud.shape[1:] == (3,) and color.shape == cloud.shape
        assert not cloud.flags.writeable
    assert str(len(scene)) in repr(scene) and scene.names[0] in repr(scene)
    found = structagent.propose(
        scene, {"shape": "line"}, objects=scene.names[1:3], model="geometric", count=4, keep_invalid=True
    )
    assert found.moved == (1, 2) and len(found) == 4


def test_the_example_recording_and_nouns():
    scene = structagent.load_scene("example", nouns={"object 1": "vase", "object 2": "jar"})
    assert scene.names[:2] == ("vase 1", "jar 2") and scene.table.x_max > scene.table.x_min
    found = structagent.parse("line up the jar and the vase", scene)  # the picture may show further cups
    assert set(found.objects) == {"vase 1", "jar 2"}


def test_a_scene_file(tmp_path):
    file = tmp_path / "desk.yaml"
    row = "- {{mesh: ycb/065-b_cups, x: {x}, y: {y}}}\n"
    file.write_text("version: 1\nobjects:\n" + "".join(row.format(x=0.3 + 0.1 * k, y=-0.2 + 0.2 * k) for k in range(3)))
    scene = structagent.load_scene(file)
    assert scene.names == ("cup 1", "cup 2", "cup 3")
    assert structagent.run("line up the cups", scene=file, **FAST).names == scene.names
    file.write_text("version: 1\nobjects: []\n")
    assert f"{file}:2:" in refused(structagent.load_scene, file, exit_code=6)
    assert f"{file}:2:" in refused(structagent.run, "a line", scene=str(file), exit_code=6)


def test_listeners_hear_everything_in_order_and_may_compute():
    heard, second = [], []

    def listen(event) -> None:
        heard.append(type(event).__name__)
        if heard[-1] == "Perceived":  # in the middle of a run, from this thread and from another one
            other = threading.Thread(target=lambda: second.append(structagent.parse("a tower").spec.shape))
            other.start()
            other.join(120)
            second.append(structagent.parse("a line").spec.shape)

    class Counter:
        count = 0

        def on_event(self, event) -> None:
            self.count += 1

    counter, threads = Counter(), torch.get_num_threads()
    torch.set_num_threads(2)
    try:
        result = structagent.run(CUPS, seed=2, on_event=[listen, counter], **FAST)
        assert torch.get_num_threads() == 2
    finally:
        torch.set_num_threads(threads)
    assert counter.count == len(heard) == len(result.events)
    assert second == ["tower", "line"]
    assert heard[:4] == ["Started", "Parsed", "Perceived", "Proposed"] and heard[-1] == "Finished"
    assert [event["kind"] for event in result.events][:3] == ["started", "parsed", "perceived"]
    json.dumps(result.events, allow_nan=False)


def test_what_a_listener_raises_comes_out_and_the_next_run_works():
    class Stop(Exception):
        pass

    def stop(event) -> None:
        if type(event).__name__ == "Perceived":
            raise Stop

    with pytest.raises(Stop):
        structagent.run(CUPS, seed=2, on_event=stop, **FAST)
    assert structagent.run(CUPS, seed=2, **FAST).success


def test_a_run_that_fails_is_a_result(tmp_path):
    """A tower of fruit cannot stand, but everything that was asked for can be tried."""
    file = tmp_path / "fruit.yaml"
    file.write_text(
        "version: 1\nobjects:\n- {mesh: ycb/017_orange, x: 0.4, y: 0.1}\n- {mesh: ycb/013_apple, x: 0.5, y: -0.1}\n"
    )
    result = structagent.run("stack everything", scene=file, **FAST)
    assert not result.success and result.exit_code == 4 and result.message
    assert result.events[-1]["exit_code"] == 4


@pytest.mark.parametrize(
    ("instruction", "options", "part", "exit_code"),
    [
        ("bau einen Turm", {}, "German", 3),
        ("put the glorps in a line", {}, "glorp", 3),
        (None, {}, "the instruction cannot be None", 2),
        ("a line", {"scene": 3}, "the scene cannot be 3", 2),
        ("a line", {"scene": ""}, "the scene cannot be ''", 2),
        ("a line", {"scene": "desk"}, "scene cannot be 'desk'", 2),
        ("a line", {"scene": "none.bag"}, "none.bag", 6),
        ("a line", {"objects": "lego"}, "lego", 6),
        ("a line", {"objects": 3}, "objects cannot be 3", 2),
        ("a line", {"model": "gan"}, "model cannot be 'gan'", 2),
        ("a line", {"seed": -1}, "seed cannot be -1", 2),
        ("a line", {"execute": "no"}, "execute cannot be 'no'; legal: True, False", 2),
        ("a line", {"on_event": 3}, "on_event cannot be 3", 2),
        ("a line", {"on_event": [print, None]}, "on_event cannot be", 2),
        ("a line", {"at": 1.0}, "recordings", 2),
        ("a line", {"at": -1.0, "scene": "example"}, "at cannot be -1.0", 2),
        ("a line", {"at": 9.0, "scene": "example"}, "no moment 9 s", 6),
        ("a line", {"nouns": {"object 77": "mug"}, "scene": "example"}, "object 77", 2),
        ("a line", {"nouns": ["mug"], "scene": "example"}, "nouns cannot be ['mug']", 2),
        ("a line", {"topics": {"sound": "/audio"}, "scene": "example"}, "topics cannot have 'sound'", 2),
        ("a line", {"world_from_camera": np.ones((4, 4)), "scene": "example"}, "not a rigid transform", 2),
        ("a line", {"world_from_camera": np.eye(3), "scene": "example"}, "of shape (3, 3)", 2),
    ],
)
def test_what_cannot_be_tried_is_an_error(instruction, options, part, exit_code):
    message = refused(structagent.run, instruction, **{**FAST, **options}, exit_code=exit_code)
    assert part in message, message


def test_hints_of_the_command_line_are_hints_for_python():
    message = refused(structagent.run, "put the forks in a line", scene="example", **FAST, exit_code=3)
    # The first object without a noun.
    assert re.search(r"nouns=\{'object \d': 'cup'\} says what an object is", message), message


@pytest.fixture(scope="module")
def report() -> structagent.EvaluationReport:
    return structagent.evaluate(["geometric", "diffusion-tokens"], structures=["line"], scenes=2, count=4, seed=5)


def test_an_evaluation_has_a_rate_for_each_planner(report):
    for model in ("geometric", "diffusion-tokens"):
        one = report.rate(model, "line")
        assert one.scenes == 2 and one.successes + sum(one.failures.values()) == 2
        assert 0.0 <= one.low <= one.rate == one.successes / 2 <= one.high <= 1.0
        assert model in str(report)
    assert "--scenes 2 --seed 5" in report.command and "--candidates 4" in report.command
    json.dumps(report.report, allow_nan=False)
    with pytest.raises(StructagentError, match="'cvae' on 'all' was not measured; legal: "):
        report.rate("cvae")


def test_an_evaluation_keeps_its_rows_in_a_folder(report, tmp_path):
    options = {"structures": ["line"], "scenes": 1, "count": 4, "seed": 5}
    first = structagent.evaluate("geometric", out=tmp_path / "kept", **options)
    again = structagent.evaluate("geometric", out=tmp_path / "kept", **options)
    assert again.report["resources"]["rows"] == 0 and first.rates == again.rates
    alone, together = (
        next(
            row for each in one.report["evaluations"] for row in each["scenes"] if each["about"]["model"] == "geometric"
        )
        for one in (first, report)
    )
    assert (alone["objects"], alone["success"], alone["draw"]) == (
        together["objects"],
        together["success"],
        together["draw"],
    )
    assert [v["checks"] for v in alone["verdicts"]] == [v["checks"] for v in together["verdicts"]]


@pytest.mark.parametrize(
    ("options", "part"),
    [
        ({"models": []}, "models cannot be []"),
        ({"models": 3}, "models cannot be 3"),
        ({"models": ["geometric", "gan"]}, "model cannot be 'gan'"),
        ({"structures": ["oval"]}, "a structure cannot be 'oval'; legal: circle, line, tower, table setting"),
        ({"structures": []}, "structures cannot be []"),
        ({"scenes": 0}, "scenes cannot be 0"),
        ({"count": 0}, "count cannot be 0"),
        ({"workers": -1}, "workers cannot be -1"),
        ({"seed": None}, "seed cannot be None"),
        ({"objects": ""}, "objects cannot be ''"),
        ({"out": 3}, "out cannot be 3"),
    ],
)
def test_options_of_an_evaluation_are_checked(options, part):
    message = refused(structagent.evaluate, **options, exit_code=2)
    assert part in message


def test_the_goal_of_a_run_speaks_of_the_objects_that_were_seen():
    result = structagent.run("put the bowl in the top right corner", seed=1, **FAST)
    (part,) = result.goal.parts
    assert result.success and part.relation == "at" and (part.x_position, part.y_position) == ("right", "top")
    assert [result.names[i] for i in part.objects] == ["bowl"] and result.moved == part.objects
    assert len(result.names) == 3 == len(result.goal_from_initial)
    assert json.dumps(result.goal.to_dict())


def test_the_goal_of_a_run_of_one_structure_is_that_structure():
    result = structagent.run(CUPS, seed=2, **FAST)
    (part,) = result.goal.parts
    assert part.spec == result.spec and part.objects == result.moved and not part.keys
