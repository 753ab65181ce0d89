"""What a refusal offers instead."""

import re
from dataclasses import replace

import numpy as np
import pytest

from agent.errors import NoValidGoal
from agent.pipeline.candidates import filter_viable, what_fits
from agent.pipeline.instruction_parser import ReadingOptions
from agent.pipeline.resources import ResourceCache
from grounding.goals.goal import Goal
from grounding.goals.parts import StructurePart
from grounding.spec import StructureSpec
from structdiffusion.fitting_shapes import why_it_does_not_fit
from structdiffusion.observation import Arrangement
from tests.structdiffusion.test_fitting_shapes import boxes


def test_what_fits_is_offered_with_what_has_to_be_given_up():
    """Nine boxes of 13 cm make no circle on a table of 54 cm, however small, and nothing large."""
    scene = boxes(9, 0.13)
    offered = what_fits(scene, StructureSpec("circle", "large", "left"))
    shapes = re.findall("an? ([a-z]+)", offered.split(" of them fits without large and left")[0])
    assert shapes
    for shape in shapes:
        assert why_it_does_not_fit(scene, StructureSpec(shape), np.random.default_rng(1)) == ""


def test_for_a_line_that_is_too_long_a_double_one_is_offered_where_they_fit():
    scene, line = boxes(10, 0.14), StructureSpec("line", x_position="left")
    assert what_fits(scene, line).startswith("; a double line, ")
    assert "double line" not in what_fits(scene, StructureSpec("circle"))
    assert "double line" not in what_fits(boxes(5, 0.2), line)  # three of 20 cm and their gaps are more than 54 cm
    interpreter = ResourceCache().interpreter(ReadingOptions())
    names, before = [cloud.name for cloud in scene.objects], Goal((StructurePart("line"),))
    for answer in ("a double line", "a double line then", "in a double line", "make a double line of them"):
        read = interpreter.interpret(answer, names, before)
        assert [part.shape for part in read.goal.structures] == ["double line"], answer
        spec = replace(read.goal.structures[0].spec, x_position="left")
        assert why_it_does_not_fit(scene, spec, np.random.default_rng(1)) == ""


def test_a_refusal_says_what_is_needed_what_there_is_and_what_fits():
    bad = Arrangement(np.tile(np.eye(4), (9, 1, 1)), {"total": 0.0})
    with pytest.raises(
        NoValidGoal, match=r"a line of these objects is 1\.\d+ m .* room for 0\.\d+ m; .* of them fits$"
    ):
        filter_viable([bad], boxes(9, 0.13), StructureSpec("line"))
