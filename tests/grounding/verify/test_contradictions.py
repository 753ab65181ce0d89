"""Parts of a goal that exclude each other are named."""

import pytest

from grounding.goals.goal import Goal
from grounding.verify.contradictions import contradiction

NAMES = ("mug", "bowl", "plate", "cup")


def relation(name, objects, reference=None, **keys):
    return {"kind": "relation", "relation": name, "objects": objects, "reference": reference, **keys}


@pytest.mark.parametrize(
    ("parts", "said"),
    [
        ([relation("left of", [0], [1]), relation("left of", [1], [0])], "'mug left of bowl' and 'bowl left of mug'"),
        ([relation("left of", [0], [1]), relation("right of", [0], [1])], "'mug left of bowl' and 'mug right of bowl'"),
        ([relation("left of", [0], [1]), relation("behind", [0], [1])], ""),
        ([relation("on", [0], [1]), relation("in", [0], [2])], "'mug on bowl' and 'mug in plate'"),
        ([relation("on", [0], [1]), relation("on", [1], [0])], "'mug on bowl' and 'bowl on mug'"),
        (
            [relation("at", [0], x_position="left"), relation("at", [0], x_position="right")],
            "'mug at left' and 'mug at right'",
        ),
        ([relation("at", [0], x_position="left"), relation("at", [0], y_position="top")], ""),
        (
            [{"kind": "structure", "shape": "line", "objects": [0, 1]}, relation("behind", {"part": 0}, [1])],
            "'line of mug, bowl' and 'part 1 behind bowl'",
        ),
    ],
)
def test_what_cannot_hold_together_is_named(parts, said):
    assert contradiction(Goal.from_dict({"parts": parts}), NAMES) == said
