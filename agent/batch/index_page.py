"""Write the page of a batch's folder: a card for every row, with filters by outcome and structure, and a search.

The pictures lie beside the page and are loaded when they come into view; nothing else is loaded. A script filters the
cards; without it all of them are shown.
"""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Mapping, Sequence
from html import escape
from importlib.resources import files
from pathlib import Path
from typing import Any
from urllib.parse import quote

from agent.batch.result_schema import ROWS, report_link
from agent.batch.rows import BadRow, Row
from agent.batch.summary import outcome_in_words, structures_of
from agent.errors import NOT_BUILDABLE
from agent.rendering.image_files import FORMAT
from agent.rendering.text import duration
from agent.reporting.html.document import document

# The first picture of each group that a row has. Rows of earlier versions have that of the goal under its old name
# "imagined-goal".
_SHOWN = (
    {"camera-before": "scene", "scene-before": "scene"},
    {"goal-overlay": "goal", "proposed-goal": "goal", "imagined-goal": "goal"},
    {"camera-after": "build", "camera-tried": "released"},
)
# Outcome -> style of its badge.
_OUTCOMES = {"stood": "good", "failed": "bad", "refused": "quiet", "asked": "quiet", "waiting": ""}
_WORDS = {"waiting": "not done yet"}


def index_page(rows: Sequence[Row | BadRow], ended: Mapping[str, Mapping[str, Any]], folder: Path) -> str:
    """Return the page (HTML), with links to pictures and reports relative to the folder.

    Args:
        rows: all rows of the file.
        ended: the results of the finished rows by id.
        folder: the folder of the batch with the pictures.
    """
    results = [ended.get(row.id) for row in rows]
    outcomes = Counter(map(outcome_of, results))
    structures = Counter(name for result in results for name in _structures(result))
    counts = " ".join(
        f'<span class="badge {style}">{outcomes[name]} {_WORDS.get(name, name)}</span>'
        for name, style in _OUTCOMES.items()
        if outcomes[name]
    )
    title = f"{len(rows)} row{'s' if len(rows) > 1 else ''}"
    cards = "".join(_card(row, result, folder) for row, result in zip(rows, results, strict=True))
    body = (
        f'<header><p class="kicker">structagent batch</p><h1>{title}</h1><p>{counts}</p></header>\n'
        f'{_filters(outcomes, structures)}\n<ol class="rows">\n{cards}</ol>'
    )
    here = files("agent.batch")
    style, script = (here.joinpath(name).read_text(encoding="utf-8") for name in ("gallery.css", "gallery.js"))
    return document(title, body, style, script)


def outcome_of(result: Mapping[str, Any] | None) -> str:
    """Return the outcome of a row as the page filters it.

    Returns:
        "stood", "failed", "refused" (not understood or not buildable), "asked" (the same, and the reason is a question
        to the speaker), or "waiting" for a row without a result.
    """
    if result is None:
        return "waiting"
    if result["success"]:
        return "stood"
    if result["exit_code"] != NOT_BUILDABLE:
        return "failed"
    return "asked" if result["message"].endswith("?") else "refused"  # as every question of the readers ends


def _structures(result: Mapping[str, Any] | None) -> tuple[str, ...]:
    return () if result is None else structures_of(result)


def _filters(outcomes: Mapping[str, int], structures: Mapping[str, int]) -> str:
    """Return the filters with the number of rows of each; the script shows them."""
    buttons = '<button type="button" value="" aria-pressed="true">all</button>' + "".join(
        f'<button type="button" value="{name}" aria-pressed="false">{_WORDS.get(name, name)} {outcomes[name]}</button>'
        for name in _OUTCOMES
        if outcomes[name]
    )
    options = '<option value="">every structure</option>' + "".join(
        f'<option value="{escape(_token(name))}">{escape(name)} ({structures[name]})</option>'
        for name in sorted(structures)
    )
    return (
        f'<div class="filters" hidden><div class="outcomes" role="group" aria-label="outcome">{buttons}</div>'
        f'<select aria-label="structure" autocomplete="off">{options}</select>'
        '<input type="search" aria-label="search" placeholder="search the instructions and reasons" autocomplete="off">'
        '<output aria-live="polite"></output></div>'
    )


def _card(row: Row | BadRow, result: Mapping[str, Any] | None, folder: Path) -> str:
    outcome = outcome_of(result)
    badge = outcome_in_words(result) if result is not None and outcome == "failed" else _WORDS.get(outcome, outcome)
    name = escape(row.id)
    parts = [
        f'<p class="name"><a href="#row-{name}">{name}</a>'
        f'<span class="soft">line {row.line}{_seconds(result)}</span></p>',
        f'<p class="said">{_said(row.text)}</p>',
        f'<p><span class="badge {_OUTCOMES[outcome]}">{escape(badge)}</span></p>',
    ]
    if result is not None:
        if reason := _reason(result):
            parts.append(f'<p class="reason{" bad" if outcome == "failed" else ""}">{escape(reason)}</p>')
        if result["report"] is not None:  # a row that saw no scene has no pictures
            parts.append(_pictures(row.id, folder))
            parts.append(f'<p><a href="{escape(report_link(row.id))}">report</a></p>')
    structures = escape(" ".join(map(_token, _structures(result))))
    data = f'data-outcome="{outcome}" data-structures="{structures}"'
    return f'<li id="row-{name}" class="{outcome}" {data}>{"".join(parts)}</li>\n'


def _token(structure: str) -> str:
    """Return a structure's name without spaces, because a card lists the names of all its structures."""
    return structure.replace(" ", "-")


def _reason(result: Mapping[str, Any]) -> str:
    """Return why a row ended as it did, on one line: the message, or for a success what was checked."""
    if result["message"]:
        return " ".join(result["message"].split())
    count = len(result["checks"])
    return f"passed {'both' if count == 2 else f'all {count}'} checks" if count > 1 else ""


def _said(text: str | None) -> str:
    return '<span class="soft">no instruction</span>' if text is None else f"“{escape(text)}”"


def _seconds(result: Mapping[str, Any] | None) -> str:
    total = None if result is None else result["seconds"].get("total")
    return "" if total is None else f", {duration(total)}"


def _pictures(row_id: str, folder: Path) -> str:
    """Return the pictures of scene, goal and build as links to the report; empty if there are none."""
    present = _files_in(folder / ROWS / row_id)
    figures = []
    for group in _SHOWN:
        found = next(((name, caption) for name, caption in group.items() if f"{name}.{FORMAT}" in present), None)
        if found is not None:
            file, caption = escape(f"{ROWS}/{quote(row_id, safe='')}/{found[0]}.{FORMAT}"), found[1]
            image = f'<img src="{file}" alt="{caption} of {escape(row_id)}" loading="lazy" decoding="async">'
            linked = f'<a href="{escape(report_link(row_id))}">{image}</a>'
            figures.append(f"<figure>{linked}<figcaption>{caption}</figcaption></figure>")
    return f'<div class="pictures">{"".join(figures)}</div>' if figures else ""


def _files_in(folder: Path) -> frozenset[str]:
    try:
        return frozenset(os.listdir(folder))
    except FileNotFoundError:  # someone has removed the report since
        return frozenset()
