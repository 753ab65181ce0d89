"""Place the blocks of an upright figure along its wall, for objects of any widths: who rests on whom stays as drawn."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from grounding.figures.growth import Blocks, supports_of

CLEAR = 0.006  # m between neighbours of a level
# Gap between two objects that carry a third, over its width. What it carries presses on its inner half: over a narrow
# gap, one of the two would carry everything.
_GAP_SHARE = 0.3
HOLD = 0.18  # of its width, by which an object has to lie on each of its outer carriers
_INSIDE = 0.2  # of the narrower one's width, by which an object's middle stays inside the only one that carries it
_LEAST_UNIT = 1e-3  # weight of a tight figure against blocks that stand where they were drawn


def places_along(blocks: Blocks, widths: Sequence[float]) -> np.ndarray | None:
    """Return where the middles of objects stand along a wall, (N,) metres; `None` if they cannot carry each other so.

    A linear program: objects stand as nearly as they can where they were drawn, at the tightest scale. What is bridged
    is half as much wider as it can be; all that lies between two possible ways is possible too.

    Args:
        blocks: the drawing.
        widths: of the objects along the wall, metres, by block.
    """
    from scipy.optimize import linprog  # takes longer to import than all structures

    count, drawn = len(blocks), np.array([block.x for block in blocks])
    rows, limits = _constraints(blocks, np.asarray(widths, float))
    # Variables: middles (N), the unit (m), and how far each middle is off its drawn place (N).
    ones, unit = np.eye(count), drawn[:, None]
    off = np.vstack((np.hstack((ones, -unit, -ones)), np.hstack((-ones, unit, -ones))))
    wide = np.hstack((rows, np.zeros((len(rows), 1 + count))))
    bounds = [(None, None)] * count + [(0.0, float(max(widths)))] + [(0.0, None)] * count
    ways = []
    for weight in (_LEAST_UNIT, -_LEAST_UNIT) if any(block.width > 1 for block in blocks) else (_LEAST_UNIT,):
        cost = np.concatenate((np.zeros(count), [weight * count], np.ones(count)))
        found = linprog(cost, np.vstack((wide, off)), np.concatenate((limits, np.zeros(2 * count))), bounds=bounds)
        if found.status:
            return None
        ways.append(found.x[:count] - found.x[:count].mean())
    return np.asarray(np.mean(ways, axis=0))


def _constraints(blocks: Blocks, widths: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return what the middles x have to keep, as rows @ x <= limits."""
    rows: list[np.ndarray] = []
    limits: list[float] = []

    def apart(left: int, right: int, least: float) -> None:
        row = np.zeros(len(blocks))
        row[left], row[right] = 1.0, -1.0
        rows.append(row)
        limits.append(-least)

    carriers = supports_of(blocks)
    for i, j in combinations(range(len(blocks)), 2):
        left, right = (i, j) if blocks[i].x < blocks[j].x else (j, i)
        levels = blocks[j].level - blocks[i].level
        if levels == 0:
            upper = [widths[k] for k, own in enumerate(carriers) if i in own and j in own]
            apart(left, right, (widths[i] + widths[j]) / 2 + max([CLEAR, *(_GAP_SHARE * width for width in upper)]))
        elif abs(levels) == 1 and not {(i, j), (j, i)} & {(k, own) for k in (i, j) for own in carriers[k]}:
            apart(left, right, (widths[i] + widths[j]) / 2 + CLEAR)
    for k, own in enumerate(carriers):
        if len(own) == 1:
            most = widths[own[0]] / 2 - _INSIDE * min(widths[k], widths[own[0]])
            apart(k, own[0], -most)
            apart(own[0], k, -most)
        elif own:
            first, last = min(own, key=lambda one: blocks[one].x), max(own, key=lambda one: blocks[one].x)
            for one, sign in ((first, 1), (last, -1)):
                # It reaches over the inner edge of the outer carrier, and its middle does not come to stand over it.
                reach = (widths[k] + widths[one]) / 2 - HOLD * min(widths[k], widths[one])
                left, right = (one, k) if sign > 0 else (k, one)
                apart(right, left, -reach)
                apart(left, right, widths[one] / 2)
    return np.array(rows).reshape(-1, len(blocks)), np.array(limits)
