"""Fit the rows and columns of a grid to the centroids of objects."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from structdiffusion.evaluation_protocol import MAX_OFF_LATTICE, MAX_UNEVEN_PITCH

_ROUGH = 0.05  # rad between the directions from which fits start
_EXACT = 0.003  # m: where objects are no farther from their places, no other fit is tried


@dataclass(frozen=True)
class Lattice:
    """Rows and columns at right angles, and the objects on them. Rows run left to right, within 45 degrees of the y
    axis.

    Attributes:
        rows: their number.
        columns: their number.
        places: (N, 2) the row and the column of each object, row 0 the first full one.
        centre: (2,) the middle of all places, metres.
        exact: (N, 2) where the place of each object is, metres.
        off: the largest distance of an object to its place, metres.
        uneven: the largest difference of two pitches in one direction, metres.
    """

    rows: int
    columns: int
    places: np.ndarray
    centre: np.ndarray
    exact: np.ndarray
    off: float
    uneven: float


def fit_lattice(points: np.ndarray) -> Lattice:
    """Fit a lattice to points (N, 2), N >= 4: of two or more rows and columns, of which only an outer row may be short.

    Every number of rows is tried, in the directions of all pairs of points; the best fit is returned.
    """
    one, other = np.triu_indices(len(points), 1)
    headings = np.arctan2(*(points[other] - points[one]).T[::-1])
    # The heading across rows is within 45 degrees of the x axis.
    headings = (headings + math.pi / 4) % (math.pi / 2) - math.pi / 4
    best: Lattice | None = None
    least = (2, math.inf)
    for heading in (0.0, *np.unique(np.round(headings / _ROUGH)) * _ROUGH):
        for rows, columns in divisions(len(points)):
            for towards in (1, -1)[: 1 + (rows * columns > len(points))]:
                fit = _fitted(points, heading, rows, columns, towards)
                failed = int(fit.off > MAX_OFF_LATTICE) + int(fit.uneven > MAX_UNEVEN_PITCH)
                if best is None or (failed, fit.off + fit.uneven) < least:
                    best, least = fit, (failed, fit.off + fit.uneven)
        if best is not None and least[0] == 0 and best.off < _EXACT:
            break
    assert best is not None
    return best


def divisions(count: int) -> list[tuple[int, int]]:
    """Return the possible numbers of rows and columns, two or more of each, of a grid of a number of objects."""
    found = [(rows, -(-count // rows)) for rows in range(2, count)]
    found += [(-(-count // columns), columns) for columns in range(2, count)]
    legal = ((rows, columns) for rows, columns in found if min(rows, columns) >= 2 and (rows - 1) * columns < count)
    return list(dict.fromkeys(legal))


def _fitted(points: np.ndarray, heading: float, rows: int, columns: int, towards: int) -> Lattice:
    """Assign points to places by their order across and along rows, and fit the lattice to them.

    `towards` is 1 if the last row is the farthest along the heading, -1 if it is the nearest.
    """
    axis = np.array([math.cos(heading), math.sin(heading)])
    along = points @ np.array([-axis[1], axis[0]])
    order = np.argsort(towards * (points @ axis), kind="stable")
    places = np.zeros((len(points), 2))
    full = [order[row * columns : (row + 1) * columns] for row in range(rows) if (row + 1) * columns <= len(points)]
    for row, members in enumerate(full):
        places[members, 0] = row
        places[members[np.argsort(along[members])], 1] = np.arange(columns)
    short = order[len(full) * columns :]
    if len(short):
        from scipy.optimize import linear_sum_assignment  # takes longer to import than all structures

        usual = _column_means(along, places, np.concatenate(full), columns)
        taken = linear_sum_assignment((along[short][:, None] - usual) ** 2)[1]
        places[short] = np.column_stack((np.full(len(short), len(full)), taken))
    return _least_squares(points, places, rows, columns)


def _column_means(along: np.ndarray, places: np.ndarray, members: np.ndarray, columns: int) -> np.ndarray:
    return np.array([along[members[places[members, 1] == column]].mean() for column in range(columns)])


def _least_squares(points: np.ndarray, places: np.ndarray, rows: int, columns: int) -> Lattice:
    """Fit pitches and direction of the lattice to points on known places."""
    middle, about = points.mean(axis=0), places - places.mean(axis=0)
    steps, *_ = np.linalg.lstsq(about, points - middle, rcond=None)  # (2, 2): from row to row, and column to column
    # The step between columns is turned onto that between rows, so that both say which way the lattice lies.
    quarter = np.array([steps[1][1], -steps[1][0]])
    sign = 1.0 if quarter @ steps[0] >= 0 else -1.0
    weights = (about**2).sum(axis=0)
    axis = weights[0] * steps[0] + sign * weights[1] * quarter
    axis = axis / max(float(np.linalg.norm(axis)), 1e-9)
    frame = np.array([axis, [-axis[1], axis[0]]])
    local = (points - middle) @ frame.T
    pitches = (about * local).sum(axis=0) / np.maximum(weights, 1e-9)
    off = float(np.linalg.norm(local - pitches * about, axis=1).max())
    uneven = 0.0
    for k, count in enumerate((rows, columns)):
        means = np.array([local[places[:, k] == number, k].mean() for number in range(count)])
        uneven = max(uneven, float(np.ptp(np.diff(means))) if count > 2 else 0.0)
    centre = (
        middle + (pitches * ((rows - 1) / 2 - places[:, 0].mean(), (columns - 1) / 2 - places[:, 1].mean())) @ frame
    )
    exact = middle + (pitches * about) @ frame
    return Lattice(rows, columns, places.astype(int), centre, exact, off, uneven)
