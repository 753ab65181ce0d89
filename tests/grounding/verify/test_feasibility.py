"""What objects cannot do, and what a shape needs."""

import pytest

from grounding.goals.goal import Goal
from grounding.verify.feasibility import infeasible

NAMES = ("ball", "golf ball", "mug", "plate", "fork", "cup")


def goal(*parts):
    return Goal.from_dict({"parts": list(parts)})


def structure(shape, objects=None, **keys):
    return {"kind": "structure", "shape": shape, "objects": objects, **keys}


def relation(name, objects, reference=None, **keys):
    return {"kind": "relation", "relation": name, "objects": objects, "reference": reference, **keys}


@pytest.mark.parametrize(
    ("parts", "said"),
    [
        (
            [structure("tower", [0, 1])],
            "nothing can stand on a ball, so a tower of the two balls cannot be built; say 'a line of the two balls'",
        ),
        ([structure("tower", [0, 2])], ""),
        ([relation("on", [2], [0])], "nothing can stand on ball, because a ball rolls; say 'put the mug next to ball'"),
        ([relation("on", [0], [3])], ""),
        ([structure("circle", [0, 1, 2]), relation("in", [4], {"part": 0})], "an object can only be in another object"),
        (
            [structure("table setting", [3, 4]), relation("at", [4], x_position="left")],
            "the place of the fork in a table setting",
        ),
        (
            [structure("circle", [0, 1])],
            "a circle needs 3 objects, but the two balls are only 2; say 'a line of the two balls'",
        ),
        (
            [structure("arc", [2, 3], x_position="left")],
            "an arc needs 3 objects, but the mug and the plate are only 2; say 'a line of the mug and the plate on the "
            "left'",
        ),
        ([structure("square", [2])], "a square needs 4 objects, but the mug is only 1; say 'put the mug on the left'"),
        ([structure("circle")], ""),
        (
            [structure("cross"), relation("on", [4], [3])],
            "a cross needs 5 objects, but the two balls, the mug and the cup are only 4;",
        ),
        (
            [structure("cross"), relation("next to", [0, 1, 2, 3, 4], [5])],
            "a cross needs 5 objects, but no object is left for it",
        ),
        (
            [structure("grid", [2, 3, 4, 5], rows=3, columns=2)],
            "a grid of 3 rows and 2 columns needs 5 to 6 objects, but the mug, the plate, the fork and the cup are 4; "
            "say 'a grid of the mug, the plate, the fork and the cup with 2 rows and 2 columns'",
        ),
        ([structure("grid", [0, 1, 2, 3, 4], rows=3, columns=2)], ""),
        ([relation("next to", [0], [1])], ""),
    ],
)
def test_what_cannot_be_is_named_with_what_could_be_said(parts, said):
    found = infeasible(goal(*parts), NAMES)
    assert said in found and bool(found) == bool(said), found
