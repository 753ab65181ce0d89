"""Whole runs of goals of several parts, without the arm: events, reports and results speak of all parts."""

from pathlib import Path

import pytest

from agent import events
from agent.batch.row_task import carry_out
from agent.batch.rows import Row
from agent.event_base import Event
from agent.pipeline.resources import ResourceCache
from agent.pipeline.run import RunOptions, run_instruction
from grounding.goals.goal import Goal

OPTIONS = {"model": "geometric", "execute": False}


@pytest.fixture(scope="module")
def cache() -> ResourceCache:
    return ResourceCache()


def run_events(cache: ResourceCache, text: str, **options) -> list[Event]:
    return list(run_instruction(text, RunOptions(**OPTIONS, **options), cache))


def only(kind: type, happened: list[Event]):
    (event,) = (event for event in happened if isinstance(event, kind))
    return event


@pytest.fixture
def desk(tmp_path: Path) -> str:
    """Three cups, a bowl, and a banana that no instruction names."""
    places = {"ycb/065-b_cups": (0.3, -0.3), "ycb/065-d_cups": (0.45, 0.3), "ycb/065-f_cups": (0.62, 0.0)}
    places |= {"ycb/024_bowl": (0.35, 0.05), "ycb/011_banana": (0.6, -0.32)}
    rows = "".join(f"- {{mesh: {mesh}, x: {x}, y: {y}}}\n" for mesh, (x, y) in places.items())
    (tmp_path / "desk.yaml").write_text(f"version: 1\nobjects:\n{rows}")
    return str(tmp_path / "desk.yaml")


def test_all_parts_of_a_goal_are_told_planned_and_checked(cache, desk):
    happened = run_events(cache, "put the cups in a line on the right and the bowl to the left of it", scene=desk)
    parsed, seen = only(events.Parsed, happened), only(events.Perceived, happened)
    assert parsed.parts == ("line of cup 1, cup 2, cup 3, right", "bowl left of part 1")
    goal = Goal.from_dict(parsed.goal)
    assert [parsed.objects[i] for i in goal.parts[1].objects] == ["bowl"] and len(goal.parts) == 2
    assert [one.name for one in seen.objects if not one.takes_part] == ["banana"]
    chosen = only(events.Chosen, happened)
    assert {each["name"]: each["parts"] for each in chosen.goals} == {
        "cup 1": [1, 2], "cup 2": [1, 2], "cup 3": [1, 2], "bowl": [2]
    }  # fmt: skip
    checked = only(events.Checked, happened)
    assert checked.success and any("left of" in check.name for check in checked.checks)
    assert any("not named" in check.name for check in checked.checks)
    assert only(events.Finished, happened).success


def test_what_stands_in_the_way_is_set_aside_and_told(cache, tmp_path):
    places = {"024_bowl": (0.45, -0.05), "005_tomato_soup_can": (0.45, 0.13), "065-b_cups": (0.3, -0.3)}
    rows = "".join(f"- {{mesh: ycb/{mesh}, x: {x}, y: {y}}}\n" for mesh, (x, y) in places.items())
    (tmp_path / "way.yaml").write_text(f"version: 1\nobjects:\n{rows}")
    happened = run_events(cache, "move the bowl 15 cm to the left", scene=str(tmp_path / "way.yaml"))
    taking = [[one.name for one in e.objects if one.takes_part] for e in happened if isinstance(e, events.Perceived)]
    assert taking == [["bowl"], ["bowl", "can"]]
    goals = {each["name"]: each for each in only(events.Chosen, happened).goals}
    assert goals["can"]["aside"] and goals["can"]["parts"] == [] and not goals["bowl"]["aside"]
    assert events.Noted("set aside, because it stands in the way: can") in happened
    assert only(events.Checked, happened).success


def test_a_part_that_cannot_be_laid_out_ends_the_run_with_a_sentence(cache, desk):
    failed = only(events.Failed, run_events(cache, "move the bowl 80 cm to the left", scene=desk))
    assert failed.exit_code == 4 and failed.message.endswith(
        "part 1 (bowl moved left by 80 cm) would put the bowl beyond the edge of the table"
    )


def test_what_is_not_there_refuses_the_whole_instruction(cache, desk):
    failed = only(events.Failed, run_events(cache, "stack the cups and put the bowl behind the kettle", scene=desk))
    assert failed.exit_code == 3 and "kettle" in failed.message


def test_a_further_shape_is_planned_and_checked(cache, desk):
    happened = run_events(cache, "make a triangle out of the cups", scene=desk)
    assert only(events.Parsed, happened).spec.shape == "triangle" and only(events.Finished, happened).success


def test_a_row_of_a_batch_has_the_goal(cache, desk, tmp_path):
    row = Row(1, "a", "put the bowl in the top right corner", RunOptions(**OPTIONS, scene=desk), "0")
    result = carry_out(row, tmp_path / "rows", cache)
    assert result["success"] and result["goal"]["parts"][0]["relation"] == "at"
    assert "<ol><li>bowl at top right</li></ol>" in (tmp_path / "rows" / "report.html").read_text()
