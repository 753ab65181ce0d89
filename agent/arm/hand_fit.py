"""Fit the open hand over parts of a cloud, many hands at once.

All hands of one call close along the same horizontal direction. Their places are given along three axes: `across` (the
closing direction), `along` (the row of the fingers) and up. B is the number of hands, P that of points. Metres,
radians.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from agent.arm.hand import Hand

PALM_CLEARANCE = 0.006  # m
FLOOR_CLEARANCE = 0.0005  # m between the lowest finger and what the object stands on
FLAT = 0.03  # m: lower than this is flat
_PALM_SHARE = 0.01  # of the points there that may be nearer to the palm than that, as stray ones
_LIFT, _LIFTS = 0.006, 4  # m by which a hand that does not fit is tried higher, and how often it is tried
_LEVEL = 1e-3 / 2  # m: fingers that end so near to what the object stands on need not be lowered further


@dataclass(frozen=True)
class Contacts:
    """The points that hands come down on, one for each of B hands.

    Attributes:
        across, along, top: (B,) the place, and its height.
        depth: (B,) how far below it the finger tips end.
        tilt: (B,) how far the hand leans about its closing axis.
        section: (B, P) which points come between the fingers.
    """

    across: np.ndarray
    along: np.ndarray
    top: np.ndarray
    depth: np.ndarray
    tilt: np.ndarray
    section: np.ndarray


@dataclass(frozen=True)
class Fits:
    """The hands that fit, one entry for each of the B contacts.

    Attributes:
        fits: (B,) bool; the other arrays mean nothing where it is false.
        along, height: (B,) where the end effector is; across it stands at the contact.
        opening, closing: (B,) the finger angles while approaching, and where the fingers first touch the object.
        width: (B,) of the object between the fingers.
        incline: (B,) of the contacts, see `agent.arm.hand.Hand.contacts`.
    """

    fits: np.ndarray
    along: np.ndarray
    height: np.ndarray
    opening: np.ndarray
    closing: np.ndarray
    width: np.ndarray
    incline: np.ndarray


def fit_hands(hand: Hand, points: np.ndarray, places: Contacts, support: float) -> Fits:
    """Return for each contact the lowest hand that passes the object with open fingers and then meets it.

    Args:
        hand: all of them.
        points: (P, 3) the whole object, as across, along and height; it must stay clear of the palm.
        places: where the B hands come down.
        support: z of what the object stands on.
    """
    count = len(places.tilt)
    sine, cosine = np.sin(places.tilt), np.cos(places.tilt)
    low = places.top - support < FLAT
    clearance = np.where(low, hand.flat_clearance, hand.side_clearance)
    farthest = np.full(count, hand.reach(0.0, hand.closed))
    fits = np.zeros(count, dtype=bool)
    along, height, opening, closing, width, incline = (np.zeros(count) for _ in range(6))
    sideways = points[:, 0] - places.across[:, None]
    waiting = np.arange(count)
    for attempt in range(_LIFTS):
        down = places.depth - _LIFT * attempt - hand.tip_level
        along[waiting] = places.along[waiting] + (sine * down)[waiting]
        height[waiting] = places.top[waiting] - (cosine * down)[waiting]
        trying = waiting
        # How low the fingers reach depends on how far they close, and that on the height: flat things are met twice.
        for last in (False, True):
            lean = hand.lateral * np.abs(sine[trying])  # leaning fingers reach lower on one side
            lowest = height[trying] - farthest[trying] * cosine[trying] - lean
            height[trying] += np.maximum(0.0, support + FLOOR_CLEARANCE - lowest)
            levels = sine[trying, None] * (points[:, 1] - along[trying, None])
            levels -= cosine[trying, None] * (points[:, 2] - height[trying, None])
            free = _clear_of_palm(levels, np.abs(sideways[trying]) < hand.palm_width, hand.palm_level + PALM_CLEARANCE)
            trying, levels = trying[free], levels[free]
            passing, there = _widths(hand, levels, sideways[trying], places.section[trying], clearance[trying])
            open_to, (closed_to, inclined) = hand.openings_for(passing), hand.contacts(there)
            # A comparison with NaN is false: no opening passes, or the closing fingers never meet the object.
            good = (closed_to >= open_to) & (there.max(axis=1) <= hand.widest)
            trying, there, open_to, closed_to = trying[good], there[good], open_to[good], closed_to[good]
            opening[trying], closing[trying] = open_to, closed_to
            width[trying], incline[trying] = there.max(axis=1), inclined[good]
            lower = farthest[trying] - hand.reaches(open_to, closed_to)
            done = ~low[trying] | (lower < _LEVEL) | last
            fits[trying[done]] = True
            trying, lower = trying[~done], lower[~done]
            if not len(trying):
                break
            farthest[trying] -= lower
            height[trying] -= lower
        waiting = waiting[~fits[waiting]]
        if not len(waiting):
            break
    return Fits(fits, along, height, opening, closing, width, incline)


def _clear_of_palm(levels: np.ndarray, under: np.ndarray, room: float) -> np.ndarray:
    """Return whether the points under the palm are clear of it (B,): the 1st percentile of their levels.

    It is counted, because to sort the points of every hand takes most of the time.

    Args:
        levels: (B, P) along each hand's approach direction. under: (B, P) bool.
        room: the least level that is clear of the palm.
    """
    above = under & (levels < room)
    over, total = above.sum(axis=1), under.sum(axis=1)
    place = _PALM_SHARE * np.maximum(total - 1, 0)
    first = np.floor(place).astype(int)
    clear = over <= first
    for row in np.flatnonzero(over == first + 1):  # the percentile lies between the two points about the limit
        below = levels[row][above[row]].max()
        beyond = levels[row][under[row] & ~above[row]]
        upper = beyond.min() if len(beyond) else below
        clear[row] = below + (place[row] - first[row]) * (upper - below) >= room
    return clear


def _widths(
    hand: Hand, levels: np.ndarray, sideways: np.ndarray, section: np.ndarray, clearance: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return two (B, L), metres, for each of the hand's levels: the width that the open hand must pass, and that
    of the object there.

    Going down, the hand's level l passes everything that ends up at levels below l's height, that
    is between the palm and l.
    """
    there = np.zeros((len(levels), len(hand.levels)))
    bins = np.rint((levels - hand.levels[0]) / (hand.levels[1] - hand.levels[0])).astype(int)
    row, point = np.nonzero(section & (bins >= 0) & (bins < len(hand.levels)))
    # Twice the farther side: the hand closes about its own middle.
    np.maximum.at(there, (row, bins[row, point]), 2 * np.abs(sideways[row, point]))
    none = np.zeros((len(there), 1))
    beside = np.maximum(np.hstack((there[:, 1:], none)), np.hstack((none, there[:, :-1])))
    there = np.maximum(there, beside)
    passing = np.maximum.accumulate(there, axis=1)
    room = np.maximum(passing + 2 * hand.least_clearance, hand.widest)
    return np.where(passing > 0.0, np.minimum(passing + 2 * clearance[:, None], room), 0.0), there
