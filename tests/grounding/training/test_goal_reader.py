"""Training of the goal network: labels, their variation, and weights that are written and trained further."""

from __future__ import annotations

import json

import numpy as np
import pytest

from grounding.goal_network.vocabulary import END, KEYWORD, KEYWORDS, START
from grounding.goal_network.writer import NetworkWriter
from grounding.training.goal_corrections import goal_corrections
from grounding.training.goal_lines import GoalLine, LabelError, goal_lines, labelled
from grounding.training.goal_reader import GoalNetworkTraining, held_out, train
from grounding.training.goal_variation import varied


def written(row):
    """Write the steps of a row out, with the first of several right places."""
    words = []
    for kind, at in row.steps:
        words.append(KEYWORDS[at[0]] if kind == KEYWORD else f"{'<' if kind == START else '>'}{row.words[at[0]]}")
    return words


def test_a_label_becomes_keywords_and_places():
    row = labelled(
        "the tins go in a stack 5 cm behind the plate, tins by height",
        "tower of the tins {0,1}, order height up from bottom; "
        "place of structure 1, behind the plate {2}, distance 5 cm.",
    )
    assert written(row) == [
        "tower of", "<the", ">tins", "order height", "ascending", "from bottom",
        "place of", "structure 1", "rel behind", "<the", ">plate", "distance", "<5", ">cm", "<end>",
    ]  # fmt: skip


def test_the_same_words_in_several_places_are_all_right():
    row = labelled("cups left, cups right", "structure of cups, left.")
    assert row.steps[1] == (START, (0, 3)) and row.steps[2] == (END, (0, 3))


@pytest.mark.parametrize(
    ("label", "message"),
    [
        ("tower of the jars.", "does not stand in the instruction"),
        ("heap of the tins.", "there is no head 'heap'"),
        ("tower of the tins, facing up.", "there is no keyword"),
        ("tower of the tins, gap the tins.", "not legal"),
        ("place of the tins, under the tins.", "there is no relation"),
    ],
)
def test_illegal_labels_are_refused(label, message):
    with pytest.raises(LabelError, match=message):
        labelled("stack the tins", label)


def test_every_shipped_label_is_legal():
    lines = goal_lines()
    assert len(lines) > 3000
    assert len({line.text for line in lines}) > 0.99 * len(lines)
    for line in lines:
        labelled(line.text, line.label)
    assert 0.06 < np.mean([held_out(line) for line in lines]) < 0.11


@pytest.mark.parametrize("seed", range(30))
def test_variations_keep_the_label_right(seed):
    text = "put the red mug to the left of the plate then line the cans up along the right edge"
    label = "place of the red mug, left of the plate; line of the cans, along right."
    row = varied(labelled(text, label), np.random.default_rng(seed))
    names = written(row)
    left, right = row.words[6], row.words[-2]
    assert ("rel left of" in names) == left.startswith("l")  # "right" may be mistyped
    assert ("along right" in names) == right.startswith("r") != left.startswith("r")
    places = [at[0] for kind, at in row.steps if kind != KEYWORD]
    assert [row.words[place] for place in places[::2]] == ["the"] * 3  # each phrase still begins with its article


def test_idle_sides_are_not_mirrored():
    row = labelled("all right, stack the cans", "tower of the cans.")
    seen = {varied(row, np.random.default_rng(seed)).words[1] for seed in range(60)}
    assert "left" not in seen


def test_a_network_is_trained_written_and_continued(tmp_path, monkeypatch, encoder):
    lines = (
        GoalLine("x", "blocks", "stack the cans", "tower of the cans {0}."),
        GoalLine("x", "blocks", "what a day", "nothing."),
    )
    monkeypatch.setattr("grounding.training.goal_reader.goal_lines", lambda: lines)
    monkeypatch.setattr("grounding.training.goal_reader.goal_corrections", lambda: ())
    monkeypatch.setattr("grounding.training.goal_reader.BATCH", 4)
    told = []
    train(GoalNetworkTraining(tmp_path / "one", steps=2, corrections=0.0), told.append)
    assert told[0].startswith("step 2 of 2, loss ")
    assert json.loads((tmp_path / "one/config.json").read_text())["steps"] == 2
    assert NetworkWriter.from_pretrained(encoder, tmp_path / "one").likeliest("stack the cans", 2)
    train(GoalNetworkTraining(tmp_path / "two", steps=1, start=tmp_path / "one", corrections=0.0), told.append)
    one, two = (NetworkWriter.from_pretrained(encoder, tmp_path / each).decoder.state for each in ("one", "two"))
    far = max(float(np.abs(array - two[name]).max()) for name, array in one.items())
    assert 0.0 < far < 0.05  # a single step from there


def test_illegal_share_of_corrections_is_named(tmp_path):
    with pytest.raises(ValueError, match="share of corrections cannot be 1.5; legal values: 0 to 1"):
        GoalNetworkTraining(tmp_path, corrections=1.5)


def test_corrections_are_trained_on(tmp_path, monkeypatch):
    monkeypatch.setattr("grounding.training.goal_reader.goal_lines", lambda: goal_lines()[:60])
    monkeypatch.setattr("grounding.training.goal_reader.goal_corrections", lambda: goal_corrections()[:60])
    monkeypatch.setattr("grounding.training.goal_reader.BATCH", 4)
    told = []
    train(GoalNetworkTraining(tmp_path, steps=2, corrections=0.9), told.append)
    instructions, corrections = told[0].split("held out ")[1].split(", ")[:2]
    assert float(instructions) > 0.0 and float(corrections) > 0.0
