"""Describe the scores of candidates in words: factors, comparisons with the best one, captions of maps."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from typing import Any

from rich.text import Text

from agent.rendering.text import number
from agent.reporting.event_text import shortcoming


def factor_rows(candidate: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return (name, value) of every factor of the score of a candidate in its JSON form."""
    return [(name, number(value, 3)) for name, value in candidate["scores"].items()]


def comparison_rows(candidates: Sequence[Mapping[str, Any]], rank: int, count: int) -> list[tuple[str, str, str]]:
    """Return (rank, score, shortcoming) of the best candidates and the worst one, leaving out a given one.

    Args:
        candidates: in their JSON form, best first.
        rank: the rank of the candidate to leave out, from 1.
        count: the number of best candidates.
    """
    shown = [*candidates[:count], *([candidates[-1]] if candidates[-1]["rank"] > count else [])]
    best = candidates[0]["scores"]
    return [
        (str(one["rank"]), number(one["scores"]["total"], 3), shortcoming(one["scores"], best))
        for one in shown
        if one["rank"] != rank
    ]


def caption_of(candidate: Mapping[str, Any], best: Mapping[str, Any], columns: int) -> list[Text]:
    """Return the lines below a candidate's map: its score and, unless it is the best, its shortcoming.

    Args:
        candidate, best: in their JSON form.
        columns: the width of the map in characters.
    """
    head = Text(f"{candidate['rank']}  score {number(candidate['scores']['total'], 2)}", "bold")
    if candidate["rank"] == best["rank"]:
        return [head]
    reason = textwrap.wrap(shortcoming(candidate["scores"], best["scores"]), columns)
    return [head, *(Text(line, "dim") for line in reason)]
