"""The message to a language model: the contract's JSON, with null for what is not known."""

import json

from grounding.goals.goal import Goal
from grounding.language_model.goal_message import MOST_TURNS, GoalMessage, OpenQuestion, Turn
from grounding.resolve.attributes import ObjectAttributes, SceneObject, scene_objects

TOWER = Goal.from_dict({"parts": [{"kind": "structure", "shape": "tower", "objects": [0, 1]}]})


def test_the_message_holds_all_that_is_known():
    mug = SceneObject("red mug", ObjectAttributes(("red", "pink"), (0.12, 0.09, 0.0801), (0.3, -0.3)))
    question = OpenQuestion("on which side?", (TOWER, "left"))
    message = GoalMessage(
        "put it\nthe other way round", (mug,), TOWER, question, (Turn("stack them", "proposed a tower"),), "opposite",
        ((0.18, 0.72), (-0.45, 0.45)),
    )  # fmt: skip
    assert json.loads(message.to_json()) == {
        "viewpoint": "opposite",
        "table_cm": {"x": [18, 72], "y": [-45, 45]},
        "objects": [
            {
                "index": 0, "name": "red mug", "kind": "mug", "color": "red", "size_cm": [12, 9, 8],
                "position_cm": [30, -30], "on": None,
            }
        ],
        "goal": TOWER.to_dict(),
        "question": {"text": "on which side?", "options": [TOWER.to_dict(), "left"]},
        "turns": [{"said": "stack them", "answer": "proposed a tower"}],
        "instruction": "put it the other way round",
    }  # fmt: skip


def test_what_is_not_known_is_null():
    found = json.loads(GoalMessage("stack the cans", scene_objects(["can 2", None])).to_json())
    unknown = {"color": None, "size_cm": None, "position_cm": None, "on": None}
    assert found["objects"] == [
        {"index": 0, "name": "can 2", "kind": "can"} | unknown,
        {"index": 1, "name": None, "kind": None} | unknown,
    ]
    assert found["table_cm"] is None and found["question"] is None and found["turns"] == []
    assert found["goal"] == {"parts": []}
    assert json.loads(GoalMessage("stack the cans", scene_objects(None)).to_json())["objects"] is None


def test_quotes_and_other_languages_stay_and_what_no_server_takes_goes():
    text = 'die Tasse 5" nach links\x00 \ud800 — 左'
    written = GoalMessage(text, None).to_json()
    assert "左" in written
    assert json.loads(written.encode())["instruction"] == 'die Tasse 5" nach links — 左'


def test_only_the_last_turns_are_sent():
    turns = tuple(Turn(f"turn {number}", "yes") for number in range(MOST_TURNS + 3))
    found = json.loads(GoalMessage("go on", None, turns=turns).to_json())["turns"]
    assert [turn["said"] for turn in found] == [f"turn {number}" for number in range(3, MOST_TURNS + 3)]


def test_a_problem_stands_in_the_message():
    assert json.loads(GoalMessage("go on", None).to_json("there is no object 7"))["problem"] == "there is no object 7"
