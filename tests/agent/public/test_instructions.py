"""Sentences: what `structagent.parse` understands, asks and refuses."""

import pytest
import structagent
from structagent import Scene, StructagentError, StructureSpec


def test_slots_objects_and_what_stays_open():
    found = structagent.parse("put the three cans in a small circle on the left")
    assert found.status == "ok" and found.spec == StructureSpec("circle", "small", "left")
    assert found.objects == ("three cans",) and found.spec.rotation is None
    assert all(0.0 <= share <= 1.0 for share in found.confidence.values())


def test_objects_are_told_by_their_names():
    found = structagent.parse("line up the cups", ["cup", "plate", "cup"])
    assert found.status == "ok" and found.objects == ("cup 1", "cup 2")
    assert structagent.parse("line everything up", ["cup", "plate"]).objects == ("cup", "plate")


def test_a_scene_tells_its_colours_too(clouds):
    colors = [(200, 20, 20), (20, 40, 190), (20, 40, 190), (20, 150, 40)]
    scene = Scene.from_clouds(clouds, colors=colors)
    found = structagent.parse("put the blue objects in a line", scene)
    assert found.status == "ok" and found.objects == ("object 2", "object 3")
    found = structagent.parse("put the blue object and the red one in a line", scene)
    assert found.status == "ask" and found.options == ("object 2", "object 3")


def test_a_question_has_its_answers():
    found = structagent.parse("arrange the cups nicely")
    assert found.status in ("ask", "refused") and found.message
    found = structagent.parse("put the cup and the plate in a line", ["cup", "cup", "plate"])
    assert found.status == "ask" and found.options == ("cup 1", "cup 2") and "which one?" in found.message


@pytest.mark.parametrize("text", ["", "  ", "bau einen Turm", "hello", "build a windmill", "\x00", "a" * 100_000])
def test_refusals_are_results(text):
    found = structagent.parse(text)
    assert found.status == "refused" and found.message and found.spec == StructureSpec()


def test_a_name_that_is_not_there_is_refused():
    found = structagent.parse("line up the forks", ["cup", "plate"])
    assert found.status == "refused" and "fork" in found.message


def test_what_cannot_go_together_is_told():
    assert structagent.parse("build a large tower").dropped == {"size": "large"}


def test_the_other_side_of_the_table():
    assert structagent.parse("a circle on the left", viewpoint="opposite").spec.x_position == "right"


@pytest.mark.parametrize(
    ("arguments", "options", "part"),
    [
        ((None,), {}, "the instruction cannot be None"),
        ((3,), {}, "the instruction cannot be 3"),
        (("a line", []), {}, "objects cannot be []"),
        (("a line", "cup"), {}, "objects cannot be 'cup'"),
        (("a line", ["cup", 3]), {}, "objects[1] cannot be 3"),
        (("a line",), {"viewpoint": "north"}, "viewpoint cannot be 'north'; legal: robot, opposite"),
        (("a line",), {"parser": 1}, "parser cannot be 1; legal: embedding, llm"),
    ],
)
def test_arguments_are_checked(arguments, options, part):
    with pytest.raises(StructagentError, match="legal: ") as caught:
        structagent.parse(*arguments, **options)
    assert part in str(caught.value) and caught.value.exit_code == 2
