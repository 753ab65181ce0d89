"""Describe the scores of candidates in words: factors, comparisons with the best, captions of maps."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from typing import Any

from rich.text import Text

from agent.rendering.text import number
from agent.reporting.event_text import shortcoming


def factor_rows(candidate: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return (name, value) of every factor of a candidate's score; takes its JSON form."""
    return [(name, number(value, 3)) for name, value in candidate["scores"].items()]


def comparison_rows(candidates: Sequence[Mapping[str, Any]], rank: int, count: int) -> list[tuple[str, str, str]]:
    """Return (rank, score, what it lacks) of the candidates beside one of them: the best ones and the worst.

    Args:
        candidates: in their JSON form, best first.
        rank: of the one that is left out, from 1.
        count: how many of the best are compared.
    """
    shown = [*candidates[:count], *([candidates[-1]] if candidates[-1]["rank"] > count else [])]
    best = candidates[0]["scores"]
    return [
        (str(one["rank"]), number(one["scores"]["total"], 3), shortcoming(one["scores"], best))
        for one in shown
        if one["rank"] != rank
    ]


def caption_of(candidate: Mapping[str, Any], best: Mapping[str, Any], columns: int) -> list[Text]:
    """Return the lines below a candidate's map: its score, and what it lacks where it is not the best.

    Args:
        candidate, best: in their JSON form.
        columns: the width of the map.
    """
    head = Text(f"{candidate['rank']}  score {number(candidate['scores']['total'], 2)}", "bold")
    if candidate["rank"] == best["rank"]:
        return [head]
    reason = textwrap.wrap(shortcoming(candidate["scores"], best["scores"]), columns)
    return [head, *(Text(line, "dim") for line in reason)]
