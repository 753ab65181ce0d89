"""Write the page of a batch's folder: every row with its outcome, time, and pictures of its goal and result."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

from agent.batch.results import ROWS
from agent.batch.rows import BadRow, Row
from agent.batch.summary import outcome_in_words
from agent.rendering.image_files import FORMAT
from agent.rendering.text import duration
from agent.reporting.html.document import document

# The first picture of each group that a row has; a row without a goal shows the table as it was found. Rows of earlier
# versions have the picture under its old name "imagined-goal".
_SHOWN = (("goal-overlay", "proposed-goal", "imagined-goal", "camera-before", "scene-before"), ("camera-after",))
_CAPTIONS = {"goal-overlay": "goal", "proposed-goal": "goal", "imagined-goal": "goal", "camera-after": "result"}
_STYLE = """
main { max-width: 1320px; }
.rows { display: grid; grid-template-columns: repeat(auto-fill, minmax(min(100%, 360px), 1fr)); gap: 16px;
  margin: 20px 0 0; padding: 0; list-style: none; align-items: start; }
.rows > li { background: var(--paper); border: 1px solid var(--rule); border-radius: 14px; padding: 16px 18px;
  min-width: 0; }
.rows > li.failed { border-color: var(--bad); border-left-width: 6px; }
.rows > li.waiting { border-style: dashed; }
.rows p { margin: 0 0 8px; }
.rows .name { display: flex; flex-wrap: wrap; justify-content: space-between; gap: 4px 12px; }
.rows .said { font-size: 18px; }
.rows .pictures { grid-template-columns: 1fr 1fr; gap: 10px; margin: 10px 0; }
.rows figcaption { padding: 4px 8px; }
"""


def index_page(rows: Sequence[Row | BadRow], ended: Mapping[str, Mapping[str, Any]], folder: Path) -> str:
    """Return the page (HTML), with links to pictures and reports relative to the folder.

    Args:
        rows: all rows of the file.
        ended: the results of the finished rows by id.
        folder: the folder of the batch with the pictures.
    """
    failed = [row.id for row in rows if row.id in ended and not ended[row.id]["success"]]
    waiting = len(rows) - len(ended)
    counts = [f'<span class="badge good">{len(ended) - len(failed)} done</span>']
    counts += [f'<span class="badge bad">{len(failed)} failed</span>'] if failed else []
    counts += [f'<span class="badge">{waiting} not done yet</span>'] if waiting else []
    links = ", ".join(f'<a href="#row-{escape(name)}">{escape(name)}</a>' for name in failed)
    body = (
        f'<header><p class="kicker">structagent batch</p><h1>{len(rows)} row{"s" if len(rows) > 1 else ""}</h1>'
        f"<p>{' '.join(counts)}</p>{f'<p>Failed: {links}</p>' if failed else ''}</header>\n"
        f'<ol class="rows">\n{"".join(_row(row, ended.get(row.id), folder) for row in rows)}</ol>'
    )
    return document(f"{len(rows)} rows", body, _STYLE)


def _row(row: Row | BadRow, result: Mapping[str, Any] | None, folder: Path) -> str:
    kind = "waiting" if result is None else "done" if result["success"] else "failed"
    badge = {"waiting": "", "done": " good", "failed": " bad"}[kind]
    outcome = "not done yet" if result is None else outcome_in_words(result)
    parts = [
        f'<p class="name"><b>{escape(row.id)}</b><span class="soft">line {row.line}{_seconds(result)}</span></p>',
        f'<p class="said">{_said(row.text)}</p>',
        f'<p><span class="badge{badge}">{escape(outcome)}</span></p>',
    ]
    if result is not None:
        if result["message"]:
            parts.append(f'<p class="bad">{escape(result["message"])}</p>')
        parts.append(_pictures(row.id, result["report"], folder))
        if result["report"] is not None:
            parts.append(f'<p><a href="{escape(result["report"])}">report</a></p>')
    return f'<li id="row-{escape(row.id)}" class="{kind}">{"".join(parts)}</li>\n'


def _said(text: str | None) -> str:
    return '<span class="soft">no instruction</span>' if text is None else f"“{escape(text)}”"


def _seconds(result: Mapping[str, Any] | None) -> str:
    total = None if result is None else result["seconds"].get("total")
    return "" if total is None else f", {duration(total)}"


def _pictures(row_id: str, report: str | None, folder: Path) -> str:
    """Return the pictures of goal and result as links to the report; empty if there are none."""
    figures = []
    for names in _SHOWN:
        files = {name: f"{ROWS}/{row_id}/{name}.{FORMAT}" for name in names}
        name = next((name for name in names if (folder / files[name]).is_file()), None)
        if name is not None:
            caption = _CAPTIONS.get(name, "before")
            image = f'<img src="{escape(files[name])}" alt="{caption} of {escape(row_id)}" loading="lazy">'
            linked = image if report is None else f'<a href="{escape(report)}">{image}</a>'
            figures.append(f"<figure>{linked}<figcaption>{caption}</figcaption></figure>")
    return f'<div class="pictures">{"".join(figures)}</div>' if figures else ""
