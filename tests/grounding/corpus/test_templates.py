"""Frames: how a line is read, and that every line and phrase of the training language can be used."""

import numpy as np
import pytest

from grounding.corpus.paraphrases import paraphrase
from grounding.corpus.templates import SLOTS_OF_HOLE, FrameError, Hole, all_frames, all_phrases, read_frame
from grounding.spec import FIRST_VALUES, LEGAL_VALUES, SLOTS, SLOTS_OF_SHAPE


def test_a_frame():
    frame = read_frame("shape=table setting, y_position=top => a place {x}, not {not_x}", "here")
    assert frame.labels == {"shape": "table setting", "y_position": "top"} and frame.refuse is None
    assert frame.pieces == ("a place ", Hole("x", False), ", not ", Hole("x", True))


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("put the cups", "file, line 3: a frame reads 'labels => text'"),
        ("shape=square => put", "shape cannot be 'square'; legal values: circle, line, tower, table setting"),
        ("shpe=line => put", "unknown label 'shpe'; legal: refuse, shape"),
        ("refuse=no => put", "refuse cannot be 'no'; legal values: idle, unbuildable, several, relation"),
        (" => put {cups}", r"unknown hole \{cups\}; legal: a_shape"),
        (" => put {not_objects}", r"unknown hole \{not_objects\}"),
    ],
)
def test_a_frame_that_cannot_be_read(line, message):
    with pytest.raises(FrameError, match=message):
        read_frame(line, "file, line 3")


def test_every_slot_hole_has_phrases_for_every_value():
    phrases = all_phrases()
    for hole, slots in SLOTS_OF_HOLE.items():
        if hole in ("a_shape", "xy"):  # the nouns with an article; both adjectives in one phrase
            continue
        for value in LEGAL_VALUES[slots[0]]:
            assert len(phrases[hole][value]) >= 3, (hole, value)


def test_no_frame_says_what_its_shape_cannot_carry():
    for name, frames in all_frames().items():
        for frame in frames:
            shape = frame.labels.get("shape")
            assert set(frame.labels) - {"shape"} <= set(SLOTS_OF_SHAPE[shape]), (name, frame)


def test_every_frame_can_be_filled():
    rng = np.random.default_rng(0)
    for frames in all_frames().values():
        for frame in frames:
            drawn = paraphrase(rng, frame)
            assert "{" not in drawn.text and drawn.refuse == frame.refuse
            if frame.refuse:
                assert not any(drawn.labels.values())
            else:
                assert frame.labels.items() <= drawn.labels.items()


def test_labels_are_what_the_holes_say():
    rng = np.random.default_rng(1)
    frame = read_frame(" => {a_shape} {xy} and not {not_heading}", "here")
    for _ in range(50):
        labels = paraphrase(rng, frame).labels
        assert labels["x_position"] in LEGAL_VALUES["x_position"] and labels["y_position"] in LEGAL_VALUES["y_position"]
        assert labels["size"] is None and labels["rotation"] is None, "a negated hole says nothing"


def test_all_values_are_drawn_about_equally():
    rng = np.random.default_rng(2)
    drawn = [paraphrase(rng) for _ in range(6000)]
    for slot in SLOTS:
        counts = [sum(text.labels[slot] == value for text in drawn) for value in FIRST_VALUES[slot]]
        assert min(counts) > 0.4 * max(counts), (slot, counts)
        assert min(counts) > 100
