"""Arrangements that were made by hand become the example."""

import numpy as np
import pytest

from agent.chat.arrangement import arranged_figure
from agent.errors import UsageError
from agent.runtime.output_ownership import OwnFolder
from grounding.figures.names import VARIABLE, figure_named


def test_objects_at_places_show_a_figure(scene):
    names = [cloud.name for cloud in (*scene.objects, *scene.distractors)]
    places = [(0.3, 0.2), (0.3, 0.1), (0.3, 0.0), (0.4, 0.0), (0.5, 0.0)]
    text = "; ".join(f"{name}: {x}, {y}" for name, (x, y) in zip(names, places, strict=False))
    figure = arranged_figure(text + ";", scene)
    (stroke,) = np.array(figure.strokes)
    first, last = stroke[0] - stroke[1], stroke[-1] - stroke[-2]
    assert abs(first @ last) < 0.1 * np.linalg.norm(first) * np.linalg.norm(last), "two sides that meet in a corner"


@pytest.mark.parametrize(("text", "refused"), [
    ("", "needs two objects or more, got 0, as in NAME: X, Y, TURN"),
    ("{0}: 0.3, 0.1, 5", "needs two objects or more, got 1"),
    ("{0}: 0.3, 0.1; giraffe: 0.4, 0.1", "there is no 'giraffe'; legal: {0}, "),
    ("{0} 0.3 0.1", "there is no '{0} 0.3 0.1'"),
    ("{0}: 0.3, 0.1; {0}: 0.4, 0.1", "{0} has two places"),
    ("{0}: 0.3; {1}: 0.4, 0.1", "{0} needs two or three numbers, X, Y and TURN, got '0.3'"),
    ("{0}: 0.3, far; {1}: 0.4, 0.1", "{0} needs two or three numbers, X, Y and TURN, got '0.3, far'"),
    ("{0}: nan, 0; {1}: 0.4, 0.1", "{0} needs two or three numbers, X, Y and TURN, got 'nan, 0'"),
    ("{0}: 3, 0; {1}: 0.4, 0.1", "{0} at 3, 0 is beside the table; legal: x 0.18 to 0.72, y -0.45 to 0.45"),
    ("{0}: 0.4, 0.1; {1}: 0.41, 0.1", "{0} and {1} overlap"),
])  # fmt: skip
def test_what_is_no_arrangement_is_refused_with_its_place(scene, text, refused):
    names = [cloud.name for cloud in scene.objects]
    with pytest.raises(UsageError) as caught:
        arranged_figure(text.format(*names), scene)
    assert refused.format(*names) in str(caught.value)


def test_an_arrangement_is_the_example_and_gets_a_name(conversation, tmp_path, monkeypatch):
    """Read by the networks that users have."""
    monkeypatch.setenv(VARIABLE, str(tmp_path / "taught"))
    with pytest.raises(UsageError, match="there is no example yet; /example and /arrange set one"):
        conversation.taught("call the example a hook")
    scene = conversation.table.look()
    names = [cloud.name for cloud in (*scene.objects, *scene.distractors)]
    places = [(0.30, 0.25), (0.30, 0.12), (0.30, -0.01), (0.43, -0.01), (0.56, -0.01), (0.69, -0.01)]
    text = "; ".join(f"{name}: {x}, {y}, 0" for name, (x, y) in zip(names, places, strict=False))
    name = conversation.show_arrangement(text, OwnFolder(tmp_path / "chat", "chat")).name
    assert conversation.say("the same with everything")
    assert [part.shape for part in conversation.situation.goal.structures] == [name]
    assert conversation.taught("call the example a hook")
    assert figure_named("hook").strokes == figure_named(name).strokes
