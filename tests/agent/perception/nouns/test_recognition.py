"""Objects get nouns where the picture is sure, and keep their numbers where it is not."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from agent.perception.nouns import recognition
from agent.perception.nouns.crops import GRAY, object_crop
from agent.perception.nouns.recognition import with_nouns
from agent.perception.report import objects_json
from agent.perception.segments import Segment, Segments
from agent.recordings.recording import DepthFrame, Recording
from structdiffusion.observation import Table


class Network:
    """Stands for the network: sure of one class."""

    def __init__(self, number: int) -> None:
        self.number = number

    def logits(self, picture: np.ndarray) -> np.ndarray:
        assert picture.shape == (224, 224, 3)
        scores = np.zeros(1000)
        scores[self.number] = 20.0
        return scores


@pytest.fixture
def seen() -> tuple[Recording, Segments]:
    """A drill-like thing: a cloud without a clear shape, 18 cm long."""
    rng = np.random.default_rng(0)
    points = rng.uniform((0.4, -0.09, 0.0), (0.46, 0.09, 0.2), (900, 3))
    points = points[(points[:, 2] > 0.14) | (np.abs(points[:, 1]) < 0.02)].astype(np.float32)
    labels = np.full((80, 100), -1, np.int16)
    labels[20:60, 30:70] = 1
    camera = np.eye(4)
    camera[:3, 3] = (-0.3, 0.0, 0.6)
    found = Segment("object 1", "object 1, red", points, None, np.eye(4), np.array([0.18, 0.06, 0.2]))
    segments = Segments((found,), Table(), Table(), camera, np.eye(4), labels)
    return Recording(Path("x.bag"), DepthFrame(np.zeros((80, 100, 3)), np.full((80, 100, 3), 90, np.uint8))), segments


@pytest.fixture
def looking(monkeypatch):
    """Makes the network see one class, as if its weights were installed."""

    def sees(number: int) -> None:
        monkeypatch.setattr(recognition, "nouns_available", lambda: True)
        monkeypatch.setattr(recognition, "_network", lambda: Network(number))

    return sees


def test_a_sure_noun_is_in_name_and_json(seen, looking):
    looking(740)  # power drill
    named = with_nouns(*seen)
    (found,) = named.objects
    assert (found.name, found.display_name, found.noun) == ("object 1", "drill 1, red", "drill")
    (row,) = objects_json(named)["objects"]
    assert row["noun"] == "drill" and row["confidence"] == round(found.confidence, 2) >= recognition.CONFIDENT


def test_a_cup_that_may_be_a_mug_is_called_both(seen, looking, monkeypatch):
    looking(740)
    monkeypatch.setattr(recognition, "confidences", lambda *_: {"mug": 0.5, "cup": 0.38, "pitcher": 0.02})
    (found,) = with_nouns(*seen).objects
    assert (found.noun, found.display_name) == ("mug or cup", "mug or cup 1, red")
    assert found.nouns == {"mug": 0.5, "cup": 0.38} and found.confidence == pytest.approx(0.88)


def test_several_objects_keep_their_order_and_small_ones_their_number(seen, looking):
    recording, segments = seen
    looking(740)
    labels = segments.labels.copy()
    labels[0:5, 0:5], labels[61:79, 10:90] = 2, 3
    three = tuple(replace(segments.objects[0], name=f"object {k}", display_name=f"object {k}") for k in (1, 2, 3))
    named = with_nouns(recording, replace(segments, objects=three, labels=labels))
    assert [each.display_name for each in named.objects] == ["drill 1", "object 2", "drill 3"]


@pytest.mark.parametrize("number", [281, 954])  # a cat; a banana, whose shape this is not
def test_what_is_not_sure_keeps_its_number(seen, looking, number):
    recording, segments = seen
    looking(number)
    upright = replace(segments.objects[0], sides=np.array([0.06, 0.06, 0.4]))
    named = with_nouns(recording, replace(segments, objects=(upright,)))
    assert named.objects[0].display_name == "object 1, red" and named.objects[0].confidence is None
    (row,) = objects_json(named)["objects"]
    assert row["noun"] is row["confidence"] is None


def test_nothing_is_named_without_weights_or_colours(seen, looking, monkeypatch):
    recording, segments = seen
    looking(740)
    colourless = replace(recording, frame=replace(recording.frame, color=None))
    assert with_nouns(colourless, segments) is segments
    monkeypatch.setattr(recognition, "nouns_available", lambda: False)
    assert with_nouns(recording, segments) is segments


@pytest.mark.parametrize("corner", [(0, 0), (40, 60)])
def test_a_crop_holds_the_object_and_nothing_else(corner):
    picture = np.full((80, 100, 3), 200, np.uint8)
    mask = np.zeros((80, 100), bool)
    mask[corner[0] : corner[0] + 40, corner[1] : corner[1] + 30] = True
    mask[corner[0] + 10 : corner[0] + 20, corner[1] + 10 : corner[1] + 20] = False  # a hole without depth
    crop = object_crop(picture, mask, 1.5)
    assert crop.shape == (224, 224, 3)
    middle, rim = crop[80:144, 90:134], crop[:20]
    assert (middle == 200).mean() > 0.9 and (np.abs(rim.astype(int) - GRAY) < 3).all()
