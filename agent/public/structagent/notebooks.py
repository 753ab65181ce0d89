"""Show scenes, proposals and results in notebooks as HTML: the report's pictures, without a style of their own."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from html import escape
from typing import Any

from agent.event_base import Event, RecordedEvent
from agent.rendering.image_files import pictures_of, webp_of
from agent.rendering.scene_images import from_above, goal_from_above, goal_overlay
from agent.rendering.text import number
from agent.reporting.html.markup import figure, paragraph, table
from agent.reporting.run_report import RunRecord
from structdiffusion.observation import Arrangement, Scene

_SHOWN = 6  # proposals whose scores are listed


def scene_html(scene: Scene, notes: Iterable[str]) -> str:
    """Return the camera's picture, if there is one, the table from above, and the remarks, as HTML."""
    camera = None if scene.color is None else figure(webp_of(scene.color), "the scene through the camera")
    return _beside([camera, figure(webp_of(from_above(scene)), "the scene from above")]) + _remarks(notes)


def proposals_html(
    scene: Scene, goal: Arrangement, ranked: Sequence[tuple[Mapping[str, float], bool]], notes: Iterable[str]
) -> str:
    """Return the best proposal as pictures, and the scores of the best few, as HTML.

    Args:
        scene: with the objects that the proposals move as its objects.
        goal: the best proposal.
        ranked: of each proposal its scores and whether it is valid, the best first.
        notes: remarks, a sentence each.
    """
    over = None
    if scene.color is not None and scene.intrinsics is not None and scene.world_from_camera is not None:
        over = figure(webp_of(goal_overlay(scene, goal)), "the best proposal over the camera picture")
    above = figure(webp_of(goal_from_above(scene, goal)), "the best proposal from above, and the paths to it")
    rows = [
        [str(rank), *(number(score, 3) for score in scores.values()), "yes" if valid else "no"]
        for rank, (scores, valid) in enumerate(ranked[:_SHOWN], start=1)
    ]
    return _beside([over, above]) + table(("rank", *ranked[0][0], "valid"), rows) + _remarks(notes)


def result_html(events: Iterable[Mapping[str, Any]], shown: Iterable[Event], notes: Iterable[str]) -> str:
    """Return the outcome of a run, its pictures, and the checks, as HTML.

    Args:
        events: the JSON form of all of its events.
        shown: the live events whose pictures are shown.
        notes: remarks, a sentence each.
    """
    record = RunRecord()
    for payload in events:
        record.on_event(RecordedEvent(payload))
    pictures = [figure(each.content, each.caption) for event in shown for each in pictures_of(event)]
    verdict = record.report["verdict"]
    rows = [
        ("✓" if check["passed"] else "✗", escape(check["name"]), number(check["measured"], 3), escape(check["limit"]))
        for check in (verdict["checks"] if verdict is not None else ())
    ]
    checks = table(("", "check", "measured", "allowed"), rows) if rows else ""
    outcome = f"<p>{record.turn.outcome} {escape(record.report['outcome']['message'] or '')}</p>"
    return outcome + _beside(pictures) + checks + _remarks(notes)


def evaluation_html(rates: Iterable[Mapping[str, Any]]) -> str:
    """Return the rates, each with the attributes of a `SuccessRate`, as an HTML table."""
    rows = [
        [escape(one["model"]), escape(one["structure"]), f"{one['successes']} of {one['scenes']}",
         f"{one['rate']:.1%}", f"{one['low']:.1%} to {one['high']:.1%}"]
        for one in rates
    ]  # fmt: skip
    return table(("planner", "structure", "stand", "share", "95 % interval"), rows)


def _beside(figures: Iterable[str | None]) -> str:
    """Place figures next to each other; those that are missing are left out."""
    return f'<div style="display:flex;gap:1em">{"".join(filter(None, figures))}</div>'


def _remarks(notes: Iterable[str]) -> str:
    return "".join(map(paragraph, notes))
