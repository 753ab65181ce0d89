"""Examples of goals that were and were not meant, and a verifier that is trained on them and written."""

import json

import numpy as np

from grounding.goals.goal import Goal
from grounding.training import verifier
from grounding.training.goal_corrections import goal_of
from grounding.training.proposals import ProposedGoals
from grounding.training.verifier import UNKNOWN, VerifierTraining, examples_of, train
from grounding.verify.verifier import Verifier

SCENE = "cans and cups"
RIGHT, WRONG = (goal_of(f"tower of the cans {{0,1,2}}, {side}.") for side in ("left", "right"))
ROW = ProposedGoals(SCENE, "stack the cans on the left", Goal(), RIGHT, (RIGHT, WRONG), False)
UNHELD = ProposedGoals(SCENE, "stack the cans upside down", Goal(), None, (RIGHT,), False)


def test_labelled_goals_are_right_and_proposed_ones_wrong(monkeypatch):
    monkeypatch.setattr(verifier, "unheld_words", lambda: {UNHELD.text: ("upside down",)})
    found = [one for seed in range(20) for one in examples_of(ROW, np.random.default_rng(seed))]
    assert {one.right for one in found} == {True, False}
    assert all(set(one.lost) == ({0.0} if one.right else {UNKNOWN}) for one in found)
    (only,) = examples_of(UNHELD, np.random.default_rng(0))
    assert not only.right and only.lost == (0.0, 0.0, 0.0, 1.0, 1.0)
    assert only.pair.words[only.pair.first : only.pair.end] == ("stack", "the", "cans", "upside", "down")


def test_a_verifier_is_trained_and_written_and_keeps_its_weights(tmp_path, monkeypatch, encoder):
    monkeypatch.setattr(verifier, "BATCH", 4)
    rows, told = tmp_path / "rows.jsonl", []
    rows.write_text("".join(json.dumps(row.to_dict()) + "\n" for row in (ROW, UNHELD)))
    (tmp_path / "config.json").write_text('{"weights": {"instruction": [1.0], "follow_up": [2.0]}}')
    train(VerifierTraining(tmp_path, rows, steps=2), told.append)
    assert told[0].startswith("step 2 of 2, loss ") and json.loads((tmp_path / "config.json").read_text())["steps"] == 2
    loaded = Verifier.from_pretrained(encoder, tmp_path)
    assert loaded.weights_of(Goal()) == (1.0,) and loaded.weights_of(ROW.goal) == (2.0,)
