"""Choose the objects of a row or a column in which objects stand already: "the back row of blocks", "the left-hand column"."""

from __future__ import annotations

import re
from itertools import pairwise

from grounding.goal_reading.scene_references import SceneReferences
from grounding.goal_reading.standing_places import PlaceError
from grounding.references.word_forms import singular

APART = 0.03  # m between the centres of objects of two rows; within a row they are less far apart in depth
_ROW = re.compile(
    r"(?:every one of |all of )?(?:the |that )?(?P<side>front|near|nearest|closest|back|rear|far|farthest|furthest|middle|centre|center"
    r"|left|right|left-? ?hand|right-? ?hand|leftmost|rightmost) (?P<row>row|line|rank|column|file)"
    r"(?: of (?:the |my )?(?P<noun>[a-z]+))?",
    re.IGNORECASE,
)
_FIRST = ("front", "near", "nearest", "closest", "right", "rightmost", "righthand")  # at the smaller coordinate
_MIDDLE = ("middle", "centre", "center")


def standing_row(text: str, find: SceneReferences) -> list[int] | None:
    """Return the indices of the objects of a row that stands on the table; `None` for other words, or where no rows stand.

    Args:
        text: the words for the objects.
        find: what is there.
    """
    said = _ROW.fullmatch(text.strip())
    if said is None or find.objects is None or find.candidates is None or find.catalogue:
        return None
    noun = singular(said["noun"].lower()) if said["noun"] else ""
    anything = noun in ("", "thing", "object", "one", "item")
    among = [index for index in range(len(find.objects)) if anything or find.candidates.head(index) == noun]
    side = re.sub(r"[- ]", "", said["side"].lower())
    column = said["row"].lower() in ("column", "file")
    if column != side.startswith(("left", "right")) and side not in _MIDDLE:
        return None  # "the left row" is none of the rows that run from left to right
    try:
        rows = _rows(among, find, 1 if column else 0)
    except PlaceError:
        return None
    if len(rows) < 2 or min(map(len, rows)) < 2 or (side in _MIDDLE and len(rows) % 2 == 0):
        return None
    place = len(rows) // 2 if side in _MIDDLE else 0 if side in _FIRST else -1
    return sorted(rows[place])


def _rows(among: list[int], find: SceneReferences, axis: int) -> list[list[int]]:
    """Divide objects into rows along an axis, 0 away from the speaker and 1 to the left, the nearest or rightmost first."""
    at = {index: find.places.position(index)[axis] for index in among}
    order = sorted(among, key=at.__getitem__)
    rows = [order[:1]]
    for before, index in pairwise(order):
        if at[index] - at[before] > APART:
            rows.append([])
        rows[-1].append(index)
    return rows
