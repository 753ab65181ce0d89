"""The commands that train networks of language: their defaults are the trainers', and what they refuse."""

from pathlib import Path

import pytest

from agent.errors import UsageError
from agent.training import parsers
from grounding.training.embedding_parser import SENTENCES
from grounding.training.goal_reader import GoalNetworkTraining
from grounding.training.llm_adapter import AdapterTraining
from grounding.training.verifier import VerifierTraining


def test_defaults_are_those_of_the_trainers():
    goals, verifier = GoalNetworkTraining(Path("x")), VerifierTraining(Path("x"), Path("y"))
    assert parsers.PARSER_SENTENCES == SENTENCES
    assert (AdapterTraining().steps, AdapterTraining().rate) == (parsers.LLM_STEPS, parsers.LLM_LEARNING_RATE)
    assert (goals.steps, goals.rate) == (parsers.GOAL_STEPS, parsers.GOAL_LEARNING_RATE)
    assert (goals.corrections, goals.dropout) == (parsers.CORRECTIONS, parsers.DROPOUT)
    assert (verifier.steps, verifier.rate) == (parsers.VERIFIER_STEPS, parsers.VERIFIER_LEARNING_RATE)


def test_a_verifier_is_proposed_for_trained_and_calibrated(tmp_path, monkeypatch, capsys):
    done = []
    monkeypatch.setattr(
        "grounding.training.proposals.write_proposals", lambda *given: done.append(("propose", given[:2]))
    )
    monkeypatch.setattr("grounding.training.verifier.train", lambda options, report: done.append(("train", options)))
    monkeypatch.setattr(
        "grounding.training.calibration.calibrate", lambda *given: done.append(("fit", given)) or {"log_loss": 0.25}
    )
    out, network = tmp_path / "verifier", tmp_path
    parsers.train_verifier(out, 7, None, 1e-4, 3, 2, network)
    assert done == [
        ("propose", (out / "proposals.jsonl", network)),
        ("train", VerifierTraining(out, out / "proposals.jsonl", 7, None, 1e-4, 3, 2)),
        ("fit", (out, network)),
    ]
    assert capsys.readouterr().out == '{"log_loss": 0.25}\n'


def test_what_a_verifier_cannot_start_from_is_named(tmp_path):
    with pytest.raises(UsageError, match="--network must be a folder of weights, but there is no folder"):
        parsers.train_verifier(tmp_path, 1, None, 1e-4, 0, 1, tmp_path / "none")
    with pytest.raises(UsageError, match="--learning-rate cannot be 0; legal: a number above 0"):
        parsers.train_verifier(tmp_path, 1, None, 0.0, 0, 1, None)
