"""Assemble the page: its head, its style, an explanation of the turns, and the turns."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from importlib.resources import files

from agent.reporting.html.turn import Turn
from agent.reporting.session_reader import Session

_SCRIPTS = {"film": "report.js", "table-view": "table_view.js"}  # the class of the figures that a script works on


def run_page(turn: Turn) -> str:
    """Make the page (HTML) of one run."""
    body = (
        f'<header><h1 class="kicker">structagent</h1><h2>{escape(turn.title)}</h2>{_result(turn)}</header>\n'
        f"<article>\n{turn.sections()}\n</article>\n"
        f"<footer><p>structagent {escape(turn.report['version'])}</p></footer>"
    )
    return document(turn.title, body)


def session_page(session: Session, turns: Sequence[Turn]) -> str:
    """Make the page (HTML) of a session: its turns one after the other, behind a list of them."""
    listed = "".join(
        f'<li><a href="#turn-{number}">{escape(turn.title)}</a> {turn.outcome}</li>'
        for number, turn in enumerate(turns, start=1)
    )
    count = "1 turn" if len(turns) == 1 else f"{len(turns)} turns"
    articles = "\n".join(
        f'<article id="turn-{number}">\n<header><p class="kicker">turn {number} of {len(turns)}</p>'
        f"<h2>{escape(turn.title)}</h2>{_result(turn)}</header>\n{turn.sections()}\n</article>"
        for number, turn in enumerate(turns, start=1)
    )
    body = (
        f'<header><p class="kicker">structagent session</p><h1>{count}</h1>'
        f'<p class="soft">begun {escape(session.started.replace("T", " "))}</p></header>\n'
        f'<nav aria-label="turns"><ol>{listed}</ol></nav>\n{articles}\n'
        f"<footer><p>structagent {escape(session.version)}, {escape(session.machine)}</p></footer>"
    )
    return document(f"session of {session.started}", body)


def _result(turn: Turn) -> str:
    message = turn.report["outcome"]["message"]
    return f"<p>{turn.outcome}{f' {escape(message)}' if message else ''}</p>"


def document(title: str, body: str, more_style: str = "", more_script: str = "") -> str:
    """Make a whole page (HTML) in the style of the reports; the scripts run when the body is there."""
    style = files("agent.reporting.html").joinpath("report.css").read_text(encoding="utf-8") + more_style
    scripts = [more_script]
    for figure, name in _SCRIPTS.items():
        if f'<figure class="{figure}"' in body:
            scripts.append(files("agent.reporting.html").joinpath(name).read_text(encoding="utf-8"))
    script = "".join(f"<script>\n{each}</script>\n" for each in scripts if each)
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        '<meta name="color-scheme" content="light dark">\n'
        f"<title>structagent: {escape(title)}</title>\n<style>\n{style}</style>\n</head>\n"
        f"<body>\n<main>\n{body}\n</main>\n{script}</body>\n</html>\n"
    )
