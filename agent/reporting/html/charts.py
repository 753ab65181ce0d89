"""Draw measured values as small pictures: a gauge for a check, a bar for the time that the steps took."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from html import escape

from agent.rendering.text import duration, number

_NUMBER = r"(-?\d+(?:\.\d+)?(?:e-?\d+)?)"
_BOUND = re.compile(rf"(<=|>=|<|>|at most|at least|below|above) {_NUMBER}")
_RANGE = re.compile(rf"{_NUMBER} to {_NUMBER}")
_UPPER = ("<=", "<", "at most", "below")
_ROOM = 0.12  # of the gauge, beyond the outermost of what it shows


def gauge(measured: float | None, limit: str) -> str:
    """Draw a measured value with its limit.

    Args:
        measured: the value.
        limit: as a check words it: "<= 0.02", ">= 1.2 and < 2", "0.33 to 0.67", and with "at most" and "at least".

    Returns:
        An SVG with the allowed range as a band and the value as a mark; empty if there is no range to draw, such
        as for a count that has to be met exactly.
    """
    band = _allowed(limit)
    if band is None or measured is None or not math.isfinite(measured):
        return ""
    ends = [measured, *(end for end in band if math.isfinite(end))]
    if not math.isfinite(band[0]):
        ends.append(min(0.0, *ends))  # what is to be small is small against nothing
    low, high = min(ends), max(ends)
    room = _ROOM * (high - low) or 1.0
    low = low if not math.isfinite(band[0]) and low == 0 else low - room
    high += room

    def place(value: float) -> float:
        return 100 * min(max((value - low) / (high - low), 0.0), 1.0)

    start, end = place(band[0]), place(band[1])
    words = escape(f"{number(measured, 3)} measured, allowed {limit}")
    mark = min(max(place(measured), 1.5), 98.5)
    return (
        f'<svg class="gauge" viewBox="0 0 100 12" preserveAspectRatio="none" role="img" aria-label="{words}">'
        '<rect class="track" y="4" width="100" height="4"/>'
        f'<rect class="allowed" x="{start:.1f}" y="4" width="{end - start:.1f}" height="4"/>'
        f'<rect class="mark" x="{mark - 0.8:.1f}" width="1.6" height="12"/></svg>'
    )


def _allowed(limit: str) -> tuple[float, float] | None:
    between = _RANGE.fullmatch(limit)
    if between:
        return float(between[1]), float(between[2])
    low, high = -math.inf, math.inf
    for sign, value in _BOUND.findall(limit):
        if sign in _UPPER:
            high = float(value)
        else:
            low = float(value)
    return (low, high) if (low, high) != (-math.inf, math.inf) else None


def timing(seconds: Mapping[str, float], total: float | None) -> str:
    """Draw one bar of what every step took, with the rest of the whole time as the last part.

    Args:
        seconds: step -> time.
        total: the time of the whole run, if it ended.

    Returns:
        HTML; empty if no step took any time.
    """
    if not any(seconds.values()):
        return ""
    parts = dict(seconds)
    rest = (total or 0.0) - sum(parts.values())
    if rest > 0.05:
        parts["everything else"] = rest
    whole = sum(parts.values())
    segments = "".join(
        f'<i class="part-{index % 7}" style="flex-grow:{value / whole:.4f}"></i>'
        for index, value in enumerate(parts.values())
    )
    entries = "".join(
        f'<li><span class="key part-{index % 7}"></span><span>{escape(step)} <b>{duration(value)}</b></span></li>'
        for index, (step, value) in enumerate(parts.items())
    )
    return f'<div class="timing" aria-hidden="true">{segments}</div><ul class="legend">{entries}</ul>'
