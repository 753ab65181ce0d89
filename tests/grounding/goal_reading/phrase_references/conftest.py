"""Resolve copied phrases in the scenes of the benchmark."""

import pytest

from grounding.goal_benchmark.rows import goal_scenes
from grounding.goal_reading.phrase_references.goal_phrases import GoalPhrases
from grounding.goal_reading.phrase_references.phrase import PhraseGroup
from grounding.goal_reading.scene_references import SceneReferences
from grounding.references.object_names import vocabulary


@pytest.fixture
def meant():
    """Return a function that finds the objects of phrases, each a text or a group, in an instruction about a scene."""

    def found(scene, text, *phrases):
        objects = goal_scenes()[scene]
        groups = [each if isinstance(each, PhraseGroup) else PhraseGroup((each,)) for each in phrases or (text,)]
        names = vocabulary([each.name for each in objects])
        return GoalPhrases(SceneReferences(objects, None, False, False), names, text).resolve(groups)

    return found
