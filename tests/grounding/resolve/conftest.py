"""Resolve copied phrases in the scenes of the benchmark."""

import pytest

from grounding.goal_benchmark.rows import goal_scenes
from grounding.resolve.goal_phrases import GoalPhrases
from grounding.resolve.phrase import PhraseGroup
from grounding.resolve.referents import Referents


@pytest.fixture
def meant():
    """Return a function that finds the objects of phrases, each a text or a group, in an instruction about a scene."""

    def found(scene, text, *phrases):
        objects = goal_scenes()[scene]
        groups = [each if isinstance(each, PhraseGroup) else PhraseGroup((each,)) for each in phrases or (text,)]
        return GoalPhrases(Referents(objects), text).resolve(groups)

    return found
